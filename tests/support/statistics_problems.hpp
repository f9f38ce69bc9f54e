#pragma once
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "tpm/base/random.hpp"
#include "tpm/fit/likelihood/bootstrap.hpp"
#include "tpm/fit/likelihood/error_law.hpp"
#include "tpm/fit/uncertainty.hpp"

namespace tpm::test {
using namespace fit;

/// A curve with two parameters: f(x, p) and its derivatives by p.
using Curve = double (*)(double x, std::span<const double> p, double* derivatives);

inline double straight_line(double x, std::span<const double> p, double* d) {
  d[0] = 1.0;
  d[1] = x;
  return p[0] + p[1] * x;
}

/// p[0] exp(-x / p[1])
inline double decay(double x, std::span<const double> p, double* d) {
  const double e = std::exp(-x / p[1]);
  d[0] = e;
  d[1] = p[0] * e * x / (p[1] * p[1]);
  return p[0] * e;
}

struct CurveData {
  std::vector<double> x, y;
  double sigma = 1.0;
  ErrorLaw law{};  ///< shape only
};

class CurveResiduals final : public ResidualFunction {
 public:
  CurveResiduals(Curve curve, CurveData data) : curve_(curve), data_(std::move(data)) {}

  Eigen::Index residual_count() const override { return static_cast<Eigen::Index>(data_.x.size()); }

  bool evaluate(std::span<const double> p, Eigen::VectorXd& r, RowMatrix* j) const override {
    return fill(p, &r, j, false);
  }

  bool information_root(std::span<const double> p, RowMatrix& root) const override {
    return fill(p, nullptr, &root, true);
  }

  RowMatrix sensitivity(std::span<const double> p) const {
    RowMatrix s(residual_count(), 2);
    for (Eigen::Index i = 0; i < s.rows(); ++i) {
      curve_(data_.x[static_cast<std::size_t>(i)], p, s.row(i).data());
    }
    return s;
  }

 private:
  bool fill(std::span<const double> p, Eigen::VectorXd* r, RowMatrix* j, bool information) const {
    if (r != nullptr) r->resize(residual_count());
    if (j != nullptr) j->resize(residual_count(), 2);
    for (Eigen::Index i = 0; i < residual_count(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      double d[2];
      const double f = curve_(data_.x[k], p, d);
      const ShapedResidual shaped = shaped_residual(data_.law, (f - data_.y[k]) / data_.sigma);
      const double slope = information ? std::sqrt(location_information(data_.law)) : shaped.slope;
      if (r != nullptr) (*r)[i] = shaped.r;
      if (j == nullptr) continue;
      (*j)(i, 0) = slope * d[0] / data_.sigma;
      (*j)(i, 1) = slope * d[1] / data_.sigma;
    }
    return true;
  }

  Curve curve_;
  CurveData data_;
};

/// Readings in recordings of equal length.
class CurveRefit final : public Refittable {
 public:
  CurveRefit(Curve curve, CurveData data, std::size_t recordings)
      : curve_(curve), data_(std::move(data)), recordings_(recordings) {}

  std::vector<std::size_t> recording_lengths() const override {
    return std::vector<std::size_t>(recordings_, data_.x.size() / recordings_);
  }

  std::vector<double> standardised_residuals(std::span<const double> p) const override {
    std::vector<double> z(data_.x.size());
    for (std::size_t i = 0; i < z.size(); ++i) z[i] = (data_.y[i] - answer(i, p)) / data_.sigma;
    return z;
  }

  std::unique_ptr<ResidualFunction> with_residuals(std::span<const double> p,
                                                   std::span<const double> z) const override {
    CurveData data = data_;
    for (std::size_t i = 0; i < z.size(); ++i) data.y[i] = answer(i, p) + data.sigma * z[i];
    return std::make_unique<CurveResiduals>(curve_, std::move(data));
  }

  std::unique_ptr<ResidualFunction> with_readings(
      std::span<const std::size_t> readings) const override {
    CurveData data{{}, {}, data_.sigma, data_.law};
    for (const std::size_t i : readings) {
      data.x.push_back(data_.x[i]);
      data.y.push_back(data_.y[i]);
    }
    return std::make_unique<CurveResiduals>(curve_, std::move(data));
  }

 private:
  double answer(std::size_t i, std::span<const double> p) const {
    double d[2];
    return curve_(data_.x[i], p, d);
  }

  Curve curve_;
  CurveData data_;
  std::size_t recordings_;
};

/// An autoregression of first order with variance 1.
inline std::vector<double> autoregression(std::size_t n, double phi, Random& random) {
  std::vector<double> x(n);
  double last = random.normal();
  const double innovation = std::sqrt(1.0 - phi * phi);
  for (double& value : x) {
    value = last;
    last = phi * last + innovation * random.normal();
  }
  return x;
}

/// x = 0, 1/(n-1), ..., 1 times `length`; y the curve at `true_values` plus sigma times `errors`.
inline CurveData curve_data(Curve curve, std::vector<double> true_values, double length,
                            double sigma, const std::vector<double>& errors) {
  CurveData data{{}, {}, sigma, {}};
  const auto n = errors.size();
  for (std::size_t i = 0; i < n; ++i) {
    double d[2];
    data.x.push_back(length * static_cast<double>(i) / static_cast<double>(n - 1));
    data.y.push_back(curve(data.x[i], true_values, d) + sigma * errors[i]);
  }
  return data;
}

inline std::vector<double> normal_errors(std::size_t n, Random& random) {
  std::vector<double> errors(n);
  for (double& e : errors) e = random.normal();
  return errors;
}

inline FitParameter parameter(std::string name, Scale scale, double start, double lower,
                              double upper, Unit unit = {"", Dimension::dimensionless, 1.0}) {
  return {std::move(name), std::move(unit), scale, start, lower, upper};
}

inline std::vector<FitParameter> line_parameters() {
  return {parameter("intercept", Scale::linear, 0.0, -1e3, 1e3),
          parameter("slope", Scale::linear, 0.0, -1e3, 1e3)};
}

inline std::vector<FitParameter> decay_parameters() {
  return {parameter("amplitude", Scale::log, 3.0, 1e-3, 1e3),
          parameter("tau", Scale::log, 2.0, 1e-3, 1e3)};
}

}  // namespace tpm::test
