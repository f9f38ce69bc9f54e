#include "tpm/fit/recording/rest_line.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "tpm/base/distributions.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/recording/prepared_recording.hpp"

namespace tpm::fit {
namespace {

constexpr double kFewestDegrees = 2.5;

/// Standard deviation of a normal distribution as wide as Student's t.
double students(double sd, double degrees) {
  const double f = std::max(degrees, kFewestDegrees);
  return sd * std::sqrt(f / (f - 2.0));
}

/// Upper end of the 95 % interval of an estimated standard deviation.
double upper_end(double sd, double degrees) {
  constexpr double kBeyond = 0.025;
  const double f = std::max(degrees, kFewestDegrees);
  return sd * std::sqrt(f / chi_squared_quantile(kBeyond, f));
}

/// Readings of one noise, each part about its own curve: the first columns are the line of the
/// rests.
struct NoisyReadings {
  std::vector<double> time_s;
  Eigen::VectorXd reading;
  Eigen::MatrixXd curve;
  double step_s = 0.0;
};

/// The rests and the hold together.
/// @param line of the rests
NoisyReadings with_hold(const std::vector<double>& time_s, const Eigen::VectorXd& reading,
                        const Eigen::MatrixXd& line, const HoldSamples& hold) {
  const auto before = std::ranges::lower_bound(time_s, hold.time_s.front());
  NoisyReadings all;
  all.step_s = hold.step_s;
  all.time_s.assign(time_s.begin(), before);
  all.time_s.insert(all.time_s.end(), hold.time_s.begin(), hold.time_s.end());
  all.time_s.insert(all.time_s.end(), before, time_s.end());
  const auto first = static_cast<Eigen::Index>(before - time_s.begin());
  const Eigen::Index held = hold.reading.size(), last = reading.size() - first, p = line.cols();
  all.reading.resize(first + held + last);
  all.reading << reading.head(first), hold.reading, reading.tail(last);
  all.curve = Eigen::MatrixXd::Zero(all.reading.size(), p + hold.curve.cols());
  all.curve.topLeftCorner(first, p) = line.topRows(first);
  all.curve.block(first, p, held, hold.curve.cols()) = hold.curve;
  all.curve.bottomLeftCorner(last, p) = line.bottomRows(last);
  return all;
}

/// Estimates of a line (or a level) through readings at rest by generalised least squares.
struct LineEstimate {
  Eigen::VectorXd x;
  Eigen::MatrixXd inverse;  ///< covariance for readings of variance 1
};

LineEstimate line_at(double phi, double step_s, const std::vector<double>& time_s,
                     const Eigen::MatrixXd& line, const Eigen::VectorXd& reading) {
  const Eigen::Index p = line.cols();
  Eigen::MatrixXd whitened(line.rows(), p + 1);
  whitened << line, reading;
  AutoregressiveNoise(phi, step_s).whiten(time_s, whitened);
  const Eigen::MatrixXd gram = whitened.leftCols(p).transpose() * whitened.leftCols(p);
  LineEstimate estimate;
  estimate.inverse = gram.llt().solve(Eigen::MatrixXd::Identity(p, p));
  estimate.x = estimate.inverse * (whitened.leftCols(p).transpose() * whitened.col(p));
  return estimate;
}

/// An estimate under each phi that the readings leave possible: a mixture of Student's t.
class EstimateOfAnyPhi {
 public:
  explicit EstimateOfAnyPhi(double degrees) : degrees_(std::max(degrees, 1.0)) {}
  void add(double weight, double value, double variance) {
    of_.push_back({weight, value, std::sqrt(variance)});
  }
  /// Standard deviation of a normal distribution about a value whose 95 % interval is as probable.
  [[nodiscard]] double sd_about(double value) const {
    constexpr double kHeld = 0.95;
    const double half = solved([&](double h) {
      double held = 0.0;
      for (const One& o : of_) {
        held += o.weight * (student_cdf((value + h - o.value) / o.sd, degrees_) -
                            student_cdf((value - h - o.value) / o.sd, degrees_));
      }
      return held >= kHeld;
    });
    return half / normal_quantile(0.5 + 0.5 * kHeld);
  }
  /// Upper end of the 95 % interval of its standard deviation.
  [[nodiscard]] double upper_sd() const {
    constexpr double kWithin = 0.975;
    return solved([&](double sd) {
      double below = 0.0;
      for (const One& o : of_) {
        below += o.weight * chi_squared_tail(degrees_ * (o.sd / sd) * (o.sd / sd), degrees_);
      }
      return below >= kWithin;
    });
  }

 private:
  struct One {
    double weight, value, sd;
  };
  /// The least number above 0 from which on a condition is met.
  template <class Condition>
  [[nodiscard]] double solved(const Condition& met) const {
    constexpr int kHalvings = 20, kMostDoublings = 60;
    double low = 0.0, high = 0.0;
    for (const One& o : of_) high = std::max(high, o.sd);
    for (int i = 0; i < kMostDoublings && !met(high); ++i) high *= 2.0;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (low + high);
      (met(middle) ? high : low) = middle;
    }
    return high;
  }

  double degrees_;
  std::vector<One> of_;
};

}  // namespace

double middle_of_rest(std::span<const double> values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

RestLine fit_rest_line(const std::vector<double>& time_s, const std::vector<double>& reading,
                       bool sloped, double rounding, const HoldSamples* hold) {
  constexpr double kSignificant = 5.41;  // chi-square of one degree, one-sided 1 %
  const auto n = static_cast<Eigen::Index>(reading.size());
  const Eigen::Index p = sloped ? 2 : 1;
  const double middle = middle_of_rest(time_s);
  const double length = time_s.back() - time_s.front();
  Eigen::MatrixXd j(n, p);
  Eigen::VectorXd y(n);
  const double level = middle_of_rest(reading);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    j(i, 0) = 1.0;
    if (p > 1) j(i, 1) = (time_s[k] - middle) / length;
    y[i] = reading[k] - level;
  }
  const NoisyReadings all =
      hold ? with_hold(time_s, y, j, *hold) : NoisyReadings{time_s, y, j, median_step(time_s)};
  const AutoregressionEstimate noise =
      estimate_autoregression(all.time_s, all.reading, all.curve, all.step_s);
  const LineEstimate line = line_at(noise.phi, all.step_s, time_s, j, y);
  const Eigen::VectorXd& x = line.x;
  const Eigen::MatrixXd covariance = noise.variance * line.inverse;
  RestLine result;
  result.phi = noise.phi;
  result.noise_sd = std::sqrt(noise.variance);
  // Zero and slope are uncorrelated at the origin.
  const double shift = p > 1 ? -covariance(0, 1) / covariance(1, 1) : 0.0;  // in lengths
  result.origin_s = middle + shift * length;
  const Eigen::Index samples = all.reading.size(), columns = all.curve.cols();
  EstimateOfAnyPhi any_zero(static_cast<double>(samples - columns)), any_slope(any_zero);
  const bool correlated = noise.gain > kSignificant;
  if (correlated) {
    Eigen::VectorXd at_origin = Eigen::VectorXd::Constant(p, shift);
    at_origin[0] = 1.0;
    for (const PossibleAutoregression& one :
         possible_autoregressions(all.time_s, all.reading, all.curve, all.step_s, noise)) {
      const LineEstimate there = line_at(one.phi, all.step_s, time_s, j, y);
      any_zero.add(one.weight, at_origin.dot(there.x),
                   one.variance * at_origin.dot(there.inverse * at_origin));
      if (p > 1) any_slope.add(one.weight, there.x[1], one.variance * there.inverse(1, 1));
    }
  }
  const auto degrees = [&](Eigen::Index column) {
    return satterthwaite_degrees(noise, column, samples, columns);
  };
  const double zero_value = x[0] + (p > 1 ? shift * x[1] : 0.0);
  const double zero_sd =
      std::sqrt(p > 1 ? covariance(0, 0) - covariance(0, 1) * covariance(0, 1) / covariance(1, 1)
                      : covariance(0, 0));
  const double stated_zero =
      correlated ? any_zero.sd_about(zero_value) : students(zero_sd, degrees(0));
  // A rest alone may hold a motion that seems to be correlated noise; a hold about its own curve
  // confirms phi.
  const bool confirmed = correlated && hold != nullptr;
  const double limit_of_zero = confirmed    ? stated_zero
                               : correlated ? any_zero.upper_sd()
                                            : upper_end(zero_sd, degrees(0));
  result.zero = Measured{level + zero_value, std::hypot(stated_zero, rounding)};
  result.zero_limit = std::hypot(limit_of_zero, rounding);
  if (p == 1) return result;
  const double slope_sd = std::sqrt(covariance(1, 1));
  const double stated_slope =
      correlated ? any_slope.sd_about(x[1]) : students(slope_sd, degrees(1));
  const double limit_of_slope = confirmed    ? stated_slope
                                : correlated ? any_slope.upper_sd()
                                             : upper_end(slope_sd, degrees(1));
  result.slope = Measured{x[1] / length, std::hypot(stated_slope, rounding) / length};
  result.telling_slope_sd = std::hypot(confirmed ? slope_sd : stated_slope, rounding) / length;
  result.slope_limit = std::hypot(limit_of_slope, rounding) / length;
  return result;
}

}  // namespace tpm::fit
