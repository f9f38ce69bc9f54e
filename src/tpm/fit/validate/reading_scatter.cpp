#include "tpm/fit/validate/reading_scatter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/select/clipping.hpp"
#include "tpm/fit/validate/law_along.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kFewestReadings = 10;
constexpr std::size_t kMostOfScatter = 20'000;  // more tell sigma no better than anyone needs

/// Basis of a curve without noise over [0, 1]: decaying exponentials, times a factor of two apart,
/// or powers.
Eigen::MatrixXd smooth_shapes(std::span<const double> x, bool hold) {
  constexpr Eigen::Index kTimes = 10, kDegree = 4;
  const auto places = Eigen::VectorXd::Map(x.data(), static_cast<Eigen::Index>(x.size())).array();
  Eigen::MatrixXd shapes(places.size(), hold ? kTimes : kDegree);
  double time = 1.0;
  for (Eigen::Index k = 0; k < shapes.cols(); ++k) {
    if (hold) {
      shapes.col(k) = (-places / time).exp();
      time *= 0.5;
    } else {
      shapes.col(k) = (2.0 * places - 1.0).pow(static_cast<double>(k + 1));
    }
  }
  return shapes;
}

/// True if a drive that is said to be held moves.
bool trembles(std::span<const double> drive, double travel) {
  constexpr double kSmall = 1e-3;  // of the travel
  const auto [low, high] = std::ranges::minmax_element(drive);
  return *high - *low > kSmall * travel;
}

/// Basis of a viscoelastic response to a drive that is not constant: the drive itself and its
/// memories, int exp(-(t - s) / tau) dx(s), with times a factor of four apart.
Eigen::MatrixXd answers_to(std::span<const double> time_s, std::span<const double> drive) {
  constexpr Eigen::Index kMemories = 6;
  const auto n = static_cast<Eigen::Index>(time_s.size());
  Eigen::MatrixXd answers(n, kMemories + 1);
  double tau_s = 0.5 * (time_s.back() - time_s.front());
  for (Eigen::Index k = 0; k < kMemories; ++k, tau_s *= 0.25) {
    double memory = 0.0;
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (i > 0) {
        const double x = (time_s[at] - time_s[at - 1]) / tau_s;
        memory = memory * std::exp(-x) - (drive[at] - drive[at - 1]) * std::expm1(-x) / x;
      }
      answers(i, k) = memory;
    }
  }
  answers.col(kMemories) = Eigen::VectorXd::Map(drive.data(), n);
  for (auto column : answers.colwise()) {  // of the size of the other shapes
    const double size = column.cwiseAbs().maxCoeff();
    if (size > 0.0) column /= size;
  }
  return answers;
}

/// A smooth curve and the noise about it.
struct SmoothFit {
  AutoregressionEstimate noise;
  Eigen::Index columns = 0;
  double criterion = 0.0;  ///< BIC
};

SmoothFit fitted_curve(std::span<const double> time_s, const Eigen::VectorXd& y,
                       const Eigen::MatrixXd& columns, double step_s) {
  const Eigen::MatrixXd q = orthonormal_columns(columns);
  const Eigen::VectorXd residual = y - q * (q.transpose() * y);
  SmoothFit fit;
  fit.columns = columns.cols();
  constexpr double kRounding = 1e-12;
  const auto n = static_cast<double>(y.size());
  const double least = kRounding * y.norm();
  if (!(residual.norm() > least)) {  // noise-free
    fit.criterion = -std::numeric_limits<double>::infinity();
    return fit;
  }
  fit.noise = estimate_autoregression(time_s, residual, q, step_s);
  const double squares = fit.noise.variance * static_cast<double>(y.size() - q.cols());
  fit.criterion = n * std::log(squares / n) +
                  AutoregressiveNoise(fit.noise.phi, step_s).log_determinant(time_s) +
                  static_cast<double>(q.cols()) * std::log(n);
  return fit;
}

/// Takes in shapes one by one as long as BIC falls: each follows a little of the noise, too.
SmoothFit smooth_fit(std::span<const double> time_s, const Eigen::VectorXd& y,
                     const Eigen::MatrixXd& shapes, double step_s, Eigen::Index most) {
  Eigen::MatrixXd columns = Eigen::VectorXd::Ones(y.size());
  SmoothFit best = fitted_curve(time_s, y, columns, step_s);
  constexpr Eigen::Index kReadingsOfColumn = 5;
  std::vector<bool> taken(static_cast<std::size_t>(shapes.cols()), false);
  while (columns.cols() < most && kReadingsOfColumn * (columns.cols() + 1) <= y.size() &&
         std::isfinite(best.criterion)) {
    SmoothFit next = best;
    Eigen::Index place = -1;
    Eigen::MatrixXd with(columns.rows(), columns.cols() + 1);
    with.leftCols(columns.cols()) = columns;
    for (Eigen::Index k = 0; k < shapes.cols(); ++k) {
      if (taken[static_cast<std::size_t>(k)]) continue;
      with.col(columns.cols()) = shapes.col(k);
      const SmoothFit fit = fitted_curve(time_s, y, with, step_s);
      if (fit.criterion < next.criterion) {
        next = fit;
        place = k;
      }
    }
    if (place < 0) break;
    with.col(columns.cols()) = shapes.col(place);
    taken[static_cast<std::size_t>(place)] = true;
    columns = with;
    best = next;
  }
  return best;
}

}  // namespace

double ReadingScatter::of(std::span<const double> time_s, const Eigen::VectorXd& weight) const {
  return std::sqrt(std::max(covariance(time_s, weight)(0, 0), 0.0));
}

Eigen::MatrixXd ReadingScatter::covariance(std::span<const double> time_s,
                                           const Eigen::MatrixXd& weights) const {
  Eigen::MatrixXd spread = weights;  // R W
  if (phi > 0.0) {
    const AutoregressiveNoise noise(phi, step_s);
    Eigen::RowVectorXd forth = Eigen::RowVectorXd::Zero(weights.cols()), back = forth;
    const Eigen::Index n = weights.rows();
    for (Eigen::Index i = 1; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      forth = noise.correlation(time_s[k] - time_s[k - 1]) * (forth + weights.row(i - 1));
      spread.row(i) += forth;
    }
    for (Eigen::Index i = n - 2; i >= 0; --i) {
      const auto k = static_cast<std::size_t>(i);
      back = noise.correlation(time_s[k + 1] - time_s[k]) * (back + weights.row(i + 1));
      spread.row(i) += back;
    }
  }
  return sigma * sigma * weights.transpose() * spread;
}

ReadingScatter scatter_of(const PreparedRecording& recording, const RecordingParts& parts) {
  return scatter_of(recording, parts, clipped_readings(recording));
}

ReadingScatter scatter_of(const PreparedRecording& recording, const RecordingParts& parts,
                          const Eigen::Array<bool, Eigen::Dynamic, 1>& clipped) {
  const Recording& r = recording.recording;
  ReadingScatter scatter;
  std::size_t first = parts.ramp_first, last = parts.ramp_last;
  const std::size_t before = parts.ramp_first + 1;
  bool hold = false, rest = false;
  const auto at_limit = [&](std::size_t i) { return clipped[static_cast<Eigen::Index>(i)]; };
  std::size_t held = parts.has_hold() ? *parts.hold_first : 0;  // after the last clipped reading
  for (std::size_t i = held; parts.has_hold() && i <= *parts.hold_last; ++i) {
    if (at_limit(i)) held = i + 1;
  }
  for (std::size_t i = last; i > first; --i) {
    if (at_limit(i)) last = i - 1;
  }
  if (parts.has_hold() && *parts.hold_last + 1 >= held + kFewestReadings) {
    first = held;
    last = *parts.hold_last;
    scatter.told_by = "the hold";
    hold = true;
  } else if (before >= kFewestReadings && before >= last - first + 1) {
    first = 0;
    last = parts.ramp_first;
    scatter.told_by = "before contact";
    rest = true;
  } else {
    scatter.told_by = "the ramp";
  }
  if (last - first + 1 > kMostOfScatter) first = last + 1 - kMostOfScatter;
  const std::size_t n = last - first + 1;
  if (n < kFewestReadings) {
    throw bad_input(fmt::format("recording '{}'", recording.name),
                    fmt::format("{} samples cannot tell the noise of the readings", n),
                    fmt::format("a hold, or a ramp of {} samples or more", kFewestReadings));
  }
  const std::span<const double> t(r.time_s.data() + first, n);
  const auto y = Eigen::VectorXd::Map(r.response.data() + first, static_cast<Eigen::Index>(n));
  std::vector<double> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = (t[i] - t[0]) / (t[n - 1] - t[0]);
  scatter.step_s = median_step(t);
  scatter.count = n;
  constexpr Eigen::Index kMostShapes = 5, kMostAnswers = 6;
  Eigen::MatrixXd shapes = rest ? Eigen::MatrixXd(y.size(), 0) : smooth_shapes(x, hold);
  Eigen::Index most = kMostShapes;
  const std::span<const double> drive(r.drive.data() + first, n);
  const double travel = r.drive[parts.ramp_last] - r.drive[parts.ramp_first];
  if (hold && trembles(drive, travel)) {
    const Eigen::MatrixXd answers = answers_to(t, drive);
    const Eigen::Index smooth = shapes.cols();
    shapes.conservativeResize(Eigen::NoChange, smooth + answers.cols());
    shapes.rightCols(answers.cols()) = answers;
    most += kMostAnswers;
  }
  const SmoothFit fit = smooth_fit(t, y, shapes, scatter.step_s, most);
  scatter.phi = fit.noise.phi;
  scatter.sigma = std::sqrt(fit.noise.variance);
  const double independent = (static_cast<double>(n) - static_cast<double>(fit.columns)) *
                             (1.0 - scatter.phi) / (1.0 + scatter.phi);
  const double quantum = quantum_of({r.response.data() + first, n});
  const double stated = recording.instrument && !is_load(r.drive_quantity)
                            ? recording.instrument->reading_floor()
                            : 0.0;
  scatter.sigma = std::max({scatter.sigma, quantum / std::sqrt(12.0), stated});
  scatter.degrees = std::max(independent - 1.0, 1.0);
  return scatter;
}

}  // namespace tpm::fit
