#include "tpm/plan/scalar_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::plan {

double DepthCurve::operator()(double depth_m) const {
  if (force_N.empty()) {
    const double linear = stiffness_N_per_m * depth_m;
    if (tension_N_per_m == 0.0) return linear;
    return linear + tension_N_per_m * one_minus_cosine(depth_m, spacing_m) * depth_m;
  }
  const auto last = static_cast<double>(force_N.size() - 1);
  const double place = (depth_m - first_m) / (last_m - first_m) * last;
  const double begin = std::clamp(std::floor(place) - 1.0, 0.0, last - 3.0);
  const double s = place - begin;
  const double* f = force_N.data() + static_cast<std::size_t>(begin);
  return -f[0] * (s - 1) * (s - 2) * (s - 3) / 6.0 + f[1] * s * (s - 2) * (s - 3) / 2.0 -
         f[2] * s * (s - 1) * (s - 3) / 2.0 + f[3] * s * (s - 1) * (s - 2) / 6.0;
}

ScalarModel::ScalarModel(DepthCurve equilibrium, DepthCurve relaxing,
                         std::vector<ScalarBranch> branches, double period_s)
    : equilibrium_(std::move(equilibrium)),
      relaxing_(std::move(relaxing)),
      branches_(std::move(branches)),
      weights_(branches_.size()),
      instantaneous_(branches_.size(), Weights{1.0, 0.0, 0.0}),
      viscous_(branches_.size(), 0.0) {
  set_period(period_s);
}

void ScalarModel::set_period(double period_s) {
  for (std::size_t i = 0; i < branches_.size(); ++i) {
    // Viscous state of a quantity that is linear over the step, exact for every h/tau.
    const double z = period_s / branches_[i].time_s;
    const double lost = -std::expm1(-z);  // 1 - exp(-z)
    const double mean = z < 1e-5 ? 1.0 - 0.5 * z : lost / z;
    weights_[i] = {1.0 - lost, mean - (1.0 - lost), 1.0 - mean};
  }
}

void ScalarModel::settle(double depth_m) {
  depth_m_ = depth_m;
  start_N_ = relaxing_(depth_m);
  std::fill(viscous_.begin(), viscous_.end(), start_N_);
}

double ScalarModel::force_at(double depth_m, const std::vector<Weights>& weights) const {
  const double end_N = relaxing_(depth_m);
  double force = equilibrium_(depth_m);
  for (std::size_t i = 0; i < branches_.size(); ++i) {
    const Weights& w = weights[i];
    const double viscous = w.viscous * viscous_[i] + w.start * start_N_ + w.end * end_N;
    force += branches_[i].share * (end_N - viscous);
  }
  return force;
}

void ScalarModel::accept(double depth_m, const std::vector<Weights>& weights) {
  const double end_N = relaxing_(depth_m);
  for (std::size_t i = 0; i < branches_.size(); ++i) {
    const Weights& w = weights[i];
    viscous_[i] = w.viscous * viscous_[i] + w.start * start_N_ + w.end * end_N;
  }
  depth_m_ = depth_m;
  start_N_ = end_N;
}

double ScalarModel::step_to(double depth_m) {
  const double force = force_at(depth_m, weights_);
  accept(depth_m, weights_);
  return force;
}

double ScalarModel::jump_to(double depth_m) {
  const double force = force_at(depth_m, instantaneous_);
  accept(depth_m, instantaneous_);
  return force;
}

/// The secant method from the depth before.
double ScalarModel::depth_under(double load_N, const std::vector<Weights>& weights) const {
  double a = depth_m_;
  double fa = force_at(a, weights) - load_N;
  if (fa == 0.0) return a;
  double b = a + std::copysign(1e-6, -fa);
  for (int i = 0; i < 60; ++i) {
    const double fb = force_at(b, weights) - load_N;
    if (fb == fa) break;
    const double next = b - fb * (b - a) / (fb - fa);
    a = b;
    fa = fb;
    b = next;
    if (std::abs(b - a) < 1e-13 || std::abs(fb) < 1e-14) return b;
    if (!std::isfinite(b) || std::abs(b) > 1.0) break;
  }
  throw Error(ExitCode::numerical, "scalar model",
              fmt::format("no depth carries a load of {} N", shortest(load_N)), "");
}

double ScalarModel::step_under(double load_N) {
  accept(depth_under(load_N, weights_), weights_);
  return depth_m_;
}

double ScalarModel::jump_under(double load_N) {
  accept(depth_under(load_N, instantaneous_), instantaneous_);
  return depth_m_;
}

}  // namespace tpm::plan
