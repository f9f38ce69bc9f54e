#include "tpm/haptics/loop/delay_watch.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace tpm::haptics {
namespace {

constexpr double kHalf_s = 0.010, kLook_s = 0.002;
constexpr std::array<double, 3> kWindows_s{0.05, 0.12, 0.35};
/// Noise of the acceleration, (m/s^2)^2: of the prior of 1/mass, and of an encoder.
constexpr double kNoise2 = 0.1, kEncoderNoise2 = 0.005;
constexpr double kUsual_per_kg = 2.5, kSpread_per_kg = 1.5;
/// Acceleration, speed and place are means over this many looks, about: neighbours say the same.
constexpr double kSame = 8.0;
/// In units that make the sums alike.
constexpr double kPlaceUnit_m = 0.01;

/// Extremes for active hands on passive set-ups, for each window, and a quarter more: standard
/// errors below 0, and the least ratio of what a longer delay leaves unexplained. Found by
/// simulation (tests/haptics/test_safety_slow.cpp, tests/measure/hands.cpp), not derived.
struct Usual {
  double most_errors, least_ratio;
};
constexpr std::array<Usual, 3> kUsual{{{8.5, 0.12}, {13.0, 0.05}, {20.0, 0.03}}};
constexpr double kMostUnexplained = 0.4;  ///< above it the fit says nothing
constexpr double kLeastErrors = 1.0;      ///< below 0, for a ratio to count

int whole(double time_s, double period_s) {
  return static_cast<int>(std::max(1L, std::lround(time_s / period_s)));
}

}  // namespace

DelayWatch::DelayWatch(const DelayWatchSettings& settings)
    : half_(whole(kHalf_s, settings.period_s)),
      every_(whole(kLook_s, settings.period_s)),
      look_s_(every_ * settings.period_s) {
  const double period_s = settings.period_s;
  for (std::size_t i = 0; i < kDelays; ++i) {
    const double delay_s = i == 0 ? settings.told_s : LateEnergyWatch::kDelays_s[i - 1];
    supposed_[i] = i == 0 || delay_s > settings.told_s + 0.5 * period_s;
    delay_[i] = std::lround(delay_s / period_s);
  }
  for (std::size_t i = 0; i < kWindows; ++i) keeps_[i] = std::exp(-look_s_ / kWindows_s[i]);
  const Eigen::Index n = 2 * half_ + 1;
  weight_.resize(n);
  slope_.resize(n);
  bend_.resize(n);
  const double to_s = (half_ + 1) * period_s;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double s = static_cast<double>(j - half_) / (half_ + 1);
    const double q = 1.0 - s * s;
    weight_[j] = std::pow(q, 4);
    slope_[j] = -8.0 * s * std::pow(q, 3) / to_s;
    bend_[j] = (48.0 * s * s - 8.0 * q) * q * q / (to_s * to_s);
  }
  const double sum = weight_.sum();
  weight_ /= sum;
  slope_ /= sum;
  bend_ /= sum;
  places_m_ = Eigen::VectorXd::Zero(2 * n);
  forces_N_ = Eigen::VectorXd::Zero(2 * (n + *std::max_element(delay_.begin(), delay_.end())));
}

void DelayWatch::observe(double at_m, double force_N, int periods) noexcept {
  if (!begun_) before_m_ = at_m;
  begun_ = true;
  for (int i = 0; i < periods; ++i) {
    add(before_m_ + (at_m - before_m_) * static_cast<double>(i) / static_cast<double>(periods),
        force_N);
  }
  before_m_ = at_m;
}

void DelayWatch::add(double at_m, double force_N) noexcept {
  const Eigen::Index places = places_m_.size() / 2, forces = forces_N_.size() / 2;
  places_m_[place_] = places_m_[place_ + places] = at_m;
  forces_N_[force_] = forces_N_[force_ + forces] = force_N;
  if (++place_ == places) place_ = 0;
  if (++force_ == forces) force_ = 0;
  if (++seen_ < static_cast<std::uint64_t>(forces) || ++to_look_ < every_) return;
  to_look_ = 0;
  look();
}

void DelayWatch::look() noexcept {
  const Eigen::Index n = weight_.size();
  // The oldest one stands where the next one will be written.
  const auto places_m = places_m_.segment(place_, n);
  const double newest_m = places_m[n - 1];
  const double a = bend_.dot(places_m) - newest_m * bend_.sum();
  Terms terms = Terms::Zero();
  terms[0] = -slope_.dot(places_m);
  terms[1] = weight_.dot(places_m) / kPlaceUnit_m;
  terms[2] = 1.0;
  const Eigen::Index newest = force_ + forces_N_.size() / 2;  // one after it
  for (std::size_t i = 0; i < kDelays; ++i) {
    if (!supposed_[i]) continue;
    terms[4 + static_cast<Eigen::Index>(i)] =
        weight_.dot(forces_N_.segment(newest - delay_[i] - n, n));
  }
  sign_ = 0.0;
  for (std::size_t w = 0; w < kWindows; ++w) {
    Sums& sums = sums_[w];
    sums.terms *= keeps_[w];
    sums.with_a *= keeps_[w];
    sums.aa = keeps_[w] * sums.aa + a * a;
    sums.count = keeps_[w] * sums.count + 1.0;
    // The time of the newest look is 0.
    sums.terms.row(3) -= look_s_ * sums.terms.row(2);
    sums.terms.col(3) -= look_s_ * sums.terms.col(2);
    sums.with_a[3] -= look_s_ * sums.with_a[2];
    sums.terms += terms * terms.transpose();
    sums.with_a += a * terms;
    const Fit told = fitted(sums, 0);
    const double errors = -told.errors_below_0;
    if (errors < kLeastErrors) continue;
    double least = told.unexplained;
    for (std::size_t i = 1; i < kDelays; ++i) {
      if (supposed_[i]) least = std::min(least, fitted(sums, i).unexplained);
    }
    const Usual& usual = kUsual[w];
    sign_ = std::max(sign_, std::log(told.unexplained / least) / -std::log(usual.least_ratio));
    if (told.unexplained < kMostUnexplained) sign_ = std::max(sign_, errors / usual.most_errors);
  }
}

DelayWatch::Fit DelayWatch::fitted(const Sums& sums, std::size_t delay) const noexcept {
  using Matrix = Eigen::Matrix<double, 5, 5>;
  using Vector = Eigen::Matrix<double, 5, 1>;
  constexpr double kPrior = kNoise2 / (kSpread_per_kg * kSpread_per_kg);
  constexpr double kHold = 1e-6;  // of what the motion does not say
  const Eigen::Index force = 4 + static_cast<Eigen::Index>(delay);
  Matrix terms;
  Vector with_a;
  terms.topLeftCorner<4, 4>() = sums.terms.topLeftCorner<4, 4>();
  terms.block<4, 1>(0, 4) = sums.terms.block<4, 1>(0, force);
  terms.block<1, 4>(4, 0) = sums.terms.block<1, 4>(force, 0);
  terms(4, 4) = sums.terms(force, force);
  with_a << sums.with_a.head<4>(), sums.with_a[force];
  Matrix held = terms;
  held.diagonal() += Vector(kHold, kHold, kHold, kHold, kPrior);
  Vector told = with_a;
  told[4] += kPrior * kUsual_per_kg;
  const Eigen::LDLT<Matrix> solver(held);
  const Vector found = solver.solve(told);
  const double left = std::max(0.0, sums.aa - 2.0 * found.dot(with_a) + found.dot(terms * found));
  const double about_mean =
      std::max(0.0, sums.aa - with_a[2] * with_a[2] / std::max(terms(2, 2), 1.0));
  const double variance = left / std::max(1.0, sums.count) + kEncoderNoise2;
  const double error =
      std::sqrt(std::max(0.0, solver.solve(Vector(Vector::Unit(0)))[0]) * variance * kSame);
  const double noise = kEncoderNoise2 * sums.count;
  Fit fit;
  fit.unexplained = (left + noise) / (about_mean + noise);
  // The term is +v: c is its factor with the other sign.
  if (error > 0.0) fit.errors_below_0 = std::min(0.0, -found[0] / error);
  return fit;
}

}  // namespace tpm::haptics
