#pragma once
// Functions that the exponential sums of fractional laws are checked against.
#include <cmath>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/law/relaxation/exponential_sum.hpp"
#include "tpm/law/relaxation/mittag_leffler.hpp"

namespace tpm::law {

inline constexpr double kAlphas[] = {0.01, 0.05, 0.1,  0.25, 0.4999, 0.5,      0.5001,    0.66, 0.7,
                                     0.9,  0.96, 0.97, 0.99, 0.999,  0.999999, 1 - 1e-12, 1.0};

/// E_alpha(-(t/tau)^alpha), and t E_{alpha,2}, its integral from 0 to t.
inline double relaxation(double alpha, double tau, double t) {
  return mittag_leffler(alpha, 1.0, std::pow(t / tau, alpha));
}
inline double relaxation_integral(double alpha, double tau, double t) {
  return t > 0.0 ? t * mittag_leffler(alpha, 2.0, std::pow(t / tau, alpha)) : 0.0;
}

/// d E_alpha(-(t/tau)^alpha) / d ln tau = z E_{alpha,alpha}(-z) with z = (t/tau)^alpha.
inline double relaxation_by_log_tau(double alpha, double tau, double t) {
  const double z = std::pow(t / tau, alpha);
  return z * mittag_leffler(alpha, alpha, z);
}

inline double springpot(double alpha, double t) {
  return alpha < 1.0 ? std::pow(t, -alpha) / std::tgamma(1.0 - alpha) : 0.0;
}
inline double springpot_integral(double alpha, double t) {
  return t > 0.0 ? std::pow(t, 1.0 - alpha) / std::tgamma(2.0 - alpha) : 0.0;
}

/// The sum of exponentials at a time > 0, and its integral from 0 on (with the dashpot).
inline double sum_at(const ExponentialSum& sum, const FractionalWeights& weights, double t_s) {
  double value = weights.constant;
  for (std::size_t i = 0; i < sum.rates_per_s().size(); ++i) {
    value += weights.weight[static_cast<Eigen::Index>(i)] * std::exp(-sum.rates_per_s()[i] * t_s);
  }
  return value;
}
inline double sum_integral_s(const ExponentialSum& sum, const FractionalWeights& weights,
                             double t_s) {
  double value = weights.dashpot_s + weights.constant * t_s;
  for (std::size_t i = 0; i < sum.rates_per_s().size(); ++i) {
    const double rate = sum.rates_per_s()[i];
    value -= weights.weight[static_cast<Eigen::Index>(i)] * std::expm1(-rate * t_s) / rate;
  }
  return value;
}

/// n numbers from `low` to `high`, evenly on a logarithmic axis.
inline std::vector<double> decades(double low, double high, int n) {
  std::vector<double> x(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    x[static_cast<std::size_t>(i)] = low * std::pow(high / low, i / (n - 1.0));
  }
  return x;
}

/// Derivatives of the weights, as weights.
inline FractionalWeights weights_of(const Eigen::VectorXd& weight, double constant,
                                    double dashpot_s) {
  FractionalWeights w;
  w.weight = weight;
  w.constant = constant;
  w.dashpot_s = dashpot_s;
  return w;
}
inline FractionalWeights by_alpha(const FractionalWeights& w) {
  return weights_of(w.d_weight_d_alpha, w.d_constant_d_alpha, w.d_dashpot_d_alpha_s);
}
inline FractionalWeights by_log_tau(const FractionalWeights& w) {
  return weights_of(w.d_weight_d_log_tau, w.d_constant_d_log_tau, w.d_dashpot_d_log_tau_s);
}

}  // namespace tpm::law
