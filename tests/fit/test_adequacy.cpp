// The residual of a law against the noise where nothing moves: how often a law that is right is
// called wrong, and how often a defect of a given size is found. Recordings are simulated from
// closed forms; each is fitted by linear least squares, with the noise of every recording of its
// own seed.
#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "tpm/base/random.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::fit;
using Catch::Matchers::WithinRel;

namespace {

constexpr double kReadingStep_s = 0.1;
constexpr int kLoaded = 240;

/// Force of a parallel branch k, tau under a ramp of 1 per second for 2 s and a hold.
double branch_force(double t, double tau) {
  const double ramp = std::min(t, 2.0);
  return tau * (1.0 - std::exp(-ramp / tau)) * std::exp(-(t - ramp) / tau);
}

/// Correlated noise of unit variance.
class UnitNoise {
 public:
  UnitNoise(double rho, std::uint64_t seed) : rho_(rho), random_(seed), last_(random_.normal()) {}
  double next() {
    last_ = rho_ * last_ + std::sqrt(1.0 - rho_ * rho_) * random_.normal();
    return last_;
  }

 private:
  double rho_;
  Random random_;
  double last_;
};

struct Simulated {
  std::vector<double> rest_time_s, rest, time_s, reading, residual;

  [[nodiscard]] AdequacyData data() const {
    return {rest_time_s, rest, time_s, reading, residual, 3};
  }
};

enum class ResidualDefect { none, slow_branch, drift, ringing };

/// The defect's force where the recording is loaded; before, only drift is there.
double defect_force(ResidualDefect defect, double t) {
  switch (defect) {
    case ResidualDefect::none:
      return 0.0;
    case ResidualDefect::slow_branch:
      return t < 0.0 ? 0.0 : branch_force(t, 12.0);
    case ResidualDefect::drift:
      return 0.1 * t;
    case ResidualDefect::ringing:
      return t < 0.0 ? 0.0 : std::exp(-t / 3.0) * std::sin(9.0 * t);
  }
  return 0.0;
}

/// Columns of the law that is fitted: an offset, the ramp and hold, a branch of 2 s.
Eigen::MatrixXd law_columns() {
  Eigen::MatrixXd a(kLoaded, 3);
  for (int i = 0; i < kLoaded; ++i) {
    const double t = kReadingStep_s * i;
    a.row(i) << 1.0, std::min(t, 2.0), branch_force(t, 2.0);
  }
  return a;
}

Eigen::VectorXd left_by_law(const Eigen::VectorXd& y) {
  static const Eigen::MatrixXd a = law_columns();
  static const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(a);
  return y - a * qr.solve(y);
}

/// @param noises rms of the residual that the best fit leaves without noise, in standard
///        deviations of the noise
/// @param quantum to which readings are rounded, in the same unit; 0 for none
Simulated simulated_adequacy(int at_rest, double rho, ResidualDefect defect, double noises,
                             double quantum, std::uint64_t seed) {
  double factor = 0.0;
  if (defect != ResidualDefect::none) {
    Eigen::VectorXd shape(kLoaded);
    for (int i = 0; i < kLoaded; ++i) shape[i] = defect_force(defect, kReadingStep_s * i);
    factor = noises / (left_by_law(shape).norm() / std::sqrt(1.0 * kLoaded));
  }
  UnitNoise noise(rho, seed);
  const auto read = [&](double force) {
    const double y = force + noise.next();
    return quantum > 0.0 ? quantum * std::round(y / quantum) : y;
  };
  Simulated s;
  for (int i = -at_rest; i < 0; ++i) {
    s.rest_time_s.push_back(kReadingStep_s * i);
    s.rest.push_back(read(factor * defect_force(defect, kReadingStep_s * i)));
  }
  Eigen::VectorXd y(kLoaded);
  for (int i = 0; i < kLoaded; ++i) {
    const double t = kReadingStep_s * i;
    const double law = 60.0 * std::min(t, 2.0) + 45.0 * branch_force(t, 2.0);
    s.time_s.push_back(t);
    y[i] = read(5.0 * law + factor * defect_force(defect, t));
    s.reading.push_back(y[i]);
  }
  const Eigen::VectorXd off = left_by_law(y);
  s.residual.assign(off.begin(), off.end());
  return s;
}

constexpr int kRestCounts[] = {10, 14, 20, 30, 50, 80, 120, 200};

}  // namespace

TEST_CASE("a law that is right is called wrong in no more than a test at 1 % allows",
          "[adequacy]") {
  int wrong = 0;
  int judged = 0;
  Random pick(5);
  for (int i = 0; i < 1000; ++i) {
    const int rest = kRestCounts[i % 8];
    const int kind = i % 3;
    const double rho = kind == 1 ? 0.9 : 0.0;
    const double quantum =
        kind == 2 ? std::exp(std::log(0.3) + pick.uniform() * std::log(20.0)) : 0.0;
    const Simulated s = simulated_adequacy(rest, rho, ResidualDefect::none, 0.0, quantum, 1000 + i);
    const Adequacy a = judge_adequacy(s.data());
    wrong += a.described == Described::not_described;
    judged += a.described != Described::not_judged;
  }
  CAPTURE(wrong, judged);
  CHECK(wrong <= 35);
  CHECK(judged >= 700);  // the rest is AR(1) with too few effective samples
}

TEST_CASE("a law that leaves three times the noise is found", "[adequacy]") {
  int found = 0;
  Random pick(6);
  constexpr ResidualDefect kDefects[] = {ResidualDefect::slow_branch, ResidualDefect::drift,
                                         ResidualDefect::ringing};
  for (int i = 0; i < 1000; ++i) {
    // At least 20 effective samples: n (1 - rho) / (1 + rho).
    const double rho = i % 2 == 0 ? 0.0 : 0.6;
    const int rest =
        static_cast<int>(std::ceil((20.0 + 30.0 * pick.uniform()) * (1.0 + rho) / (1.0 - rho)));
    const double noises = 3.0 * std::exp(pick.uniform() * std::log(10.0));
    const Simulated s = simulated_adequacy(rest, rho, kDefects[i % 3], noises, 0.0, 5000 + i);
    const Adequacy a = judge_adequacy(s.data());
    found += a.described == Described::not_described;
  }
  CHECK(found >= 927);
}

TEST_CASE("noise that grows under load is no lack of fit, and a smooth misfit beside it is",
          "[adequacy]") {
  int wrong = 0, found = 0;
  for (int i = 0; i < 300; ++i) {
    Simulated s = simulated_adequacy(40, 0.0, ResidualDefect::none, 0.0, 0.0, 700 + i);
    for (double& off : s.residual) off *= 12.0;  // a probe that shakes in contact
    const Adequacy a = judge_adequacy(s.data());
    CHECK(a.noise_under_load);
    wrong += a.described == Described::not_described;
    for (std::size_t k = 0; k < s.residual.size(); ++k) {
      s.residual[k] += 36.0 * std::sin(6.0 * static_cast<double>(k) / kLoaded);
    }
    found += judge_adequacy(s.data()).described == Described::not_described;
  }
  CHECK(wrong <= 10);
  CHECK(found >= 297);
  const Simulated even = simulated_adequacy(40, 0.0, ResidualDefect::none, 0.0, 0.0, 3);
  CHECK_FALSE(judge_adequacy(even.data()).noise_under_load);
}

TEST_CASE("readings before the load are no lost signal", "[adequacy]") {
  Simulated s = simulated_adequacy(60, 0.0, ResidualDefect::slow_branch, 30.0, 0.0, 8);
  for (int i = 0; i < 6; ++i) {
    s.reading[i] = 0.2 * (i % 3 - 1);
    s.residual[i] = -40.0;  // an offset that the fit takes in vain
  }
  for (const Remark& cause : judge_adequacy(s.data()).causes) {
    CHECK(cause.code != "signal_lost");
    CHECK(cause.code != "signal_ends");
  }
}

TEST_CASE("a clipped force cell is named", "[adequacy]") {
  int named = 0;
  Random pick(7);
  for (int i = 0; i < 500; ++i) {
    Simulated s =
        simulated_adequacy(20, 0.0, ResidualDefect::none, 0.0, i % 2 == 0 ? 0.0 : 1.0, 9000 + i);
    const double peak = *std::ranges::max_element(s.reading);
    const double limit = (0.6 + 0.35 * pick.uniform()) * peak;
    for (double& y : s.reading) y = std::min(y, limit);
    const auto run = clipped_run(s.reading, s.rest);
    named += run && run->largest;
  }
  CHECK(named >= 495);
  int healthy = 0;
  for (int i = 0; i < 500; ++i) {
    const double quantum = i % 2 == 0 ? 0.0 : 0.3 * (1.0 + i % 20);
    const Simulated s = simulated_adequacy(20, 0.0, ResidualDefect::none, 0.0, quantum, 20000 + i);
    healthy += clipped_run(s.reading, s.rest).has_value();
  }
  CHECK(healthy <= 5);
}

TEST_CASE("the causes of a misfit are told apart", "[adequacy]") {
  const auto first_code = [](const Simulated& s) {
    const Adequacy a = judge_adequacy(s.data());
    REQUIRE(a.described == Described::not_described);
    return a.causes.empty() ? std::string("none") : a.causes.front().code;
  };
  CHECK(first_code(simulated_adequacy(60, 0.0, ResidualDefect::drift, 10.0, 0.0, 3)) == "drift");
  CHECK(first_code(simulated_adequacy(60, 0.0, ResidualDefect::slow_branch, 10.0, 0.0, 3)) ==
        "none");
  Simulated early = simulated_adequacy(60, 0.0, ResidualDefect::none, 0.0, 0.0, 4);
  for (int i = 0; i < 5; ++i) early.residual[i] += 60.0;
  CHECK(first_code(early) == "transient");
  Simulated lost = simulated_adequacy(60, 0.0, ResidualDefect::none, 0.0, 0.0, 5);
  for (int i = 100; i < 110; ++i) {
    lost.residual[i] -= lost.reading[i];
    lost.reading[i] = 0.3 * (i % 3 - 1);
  }
  CHECK(first_code(lost) == "signal_lost");
  // What is back at the level of the rest for good may also be a fluid that nothing moves any more.
  for (int i = 110; i < kLoaded; ++i) {
    lost.residual[i] -= lost.reading[i];
    lost.reading[i] = 0.3 * (i % 3 - 1);
  }
  CHECK(first_code(lost) == "signal_ends");
}

TEST_CASE("a signal that stands still at any level is named", "[adequacy]") {
  for (const int first : {30, 100, kLoaded - 20}) {
    CAPTURE(first);
    Simulated frozen = simulated_adequacy(60, 0.0, ResidualDefect::none, 0.0, 0.0, 6);
    for (int i = first + 1; i < first + 20; ++i) {
      const double law = frozen.reading[i] - frozen.residual[i];
      frozen.reading[i] = frozen.reading[first];
      // The law goes on while the readings do not, more than under the end of a hold.
      frozen.residual[i] = frozen.reading[i] - law - 2.0 * (i - first);
    }
    const Adequacy a = judge_adequacy(frozen.data());
    REQUIRE(a.described == Described::not_described);
    REQUIRE_FALSE(a.causes.empty());
    CHECK(a.causes.front().code == "signal_frozen");
    CHECK_THAT(a.causes.front().text,
               Catch::StartsWith("frozen signal: 20 readings in a row from"));
  }
  // Coarsely rounded readings repeat, and nothing stands still.
  Simulated coarse = simulated_adequacy(60, 0.0, ResidualDefect::ringing, 20.0, 6.0, 7);
  for (const Remark& cause : judge_adequacy(coarse.data()).causes) {
    CHECK(cause.code != "signal_frozen");
  }
}

TEST_CASE("the bend of a zero that warms up is told from correlated noise", "[adequacy]") {
  constexpr int kTrials = 1000;
  for (const double rho : {0.0, 0.6, 0.9}) {
    for (const int at_rest : {20, 60, 200}) {
      CAPTURE(rho, at_rest);
      int found = 0;
      for (int i = 0; i < kTrials; ++i) {
        const Simulated s =
            simulated_adequacy(at_rest, rho, ResidualDefect::none, 0.0, 0.0, 900U + i);
        const auto bend = rest_bend(s.rest_time_s, s.rest);
        REQUIRE(bend);
        found += bend->p_value < 1e-3;
      }
      CHECK(found <= 5);  // of 1000, at a level of 0.1 %
    }
  }
  Simulated warm = simulated_adequacy(100, 0.0, ResidualDefect::none, 0.0, 0.0, 8);
  for (std::size_t i = 0; i < warm.rest.size(); ++i) {
    warm.rest[i] += 50.0 * (1.0 - std::exp(-(warm.rest_time_s[i] - warm.rest_time_s[0]) / 8.0));
  }
  const RestBend bend = rest_bend(warm.rest_time_s, warm.rest).value();
  CHECK(bend.p_value < 1e-6);
  CHECK(bend.noises > 3.0);
}

TEST_CASE("too short a rest gives no verdict", "[adequacy]") {
  const Simulated s = simulated_adequacy(7, 0.0, ResidualDefect::slow_branch, 50.0, 0.0, 1);
  CHECK(judge_adequacy(s.data()).described == Described::not_judged);
  const Simulated none = simulated_adequacy(0, 0.0, ResidualDefect::slow_branch, 50.0, 0.0, 1);
  CHECK(judge_adequacy(none.data()).described == Described::not_judged);
  Simulated short_by_one = simulated_adequacy(20, 0.0, ResidualDefect::none, 0.0, 0.0, 1);
  short_by_one.rest.pop_back();
  CHECK_THROWS_AS(judge_adequacy(short_by_one.data()), Error);
}

TEST_CASE("readings scatter less than a noise of half a step by chance in 5 %", "[adequacy]") {
  CHECK_THAT(hidden_noise_variance(1e6), WithinRel(4.0 / 3.0, 0.003));
  CHECK_THAT(hidden_noise_variance(100.0), WithinRel(4.0 / 3.0 * 0.779295, 1e-5));  // tables
  CHECK(hidden_noise_variance(2.0) == 2.0 / 3.0);
}

TEST_CASE("the grid of rounded readings is found", "[adequacy]") {
  const std::vector<double> rounded{0.25, 0.5, 0.5, 1.25, 2.0, 0.75};
  CHECK(quantum_of(rounded) == Approx(0.25));
  const std::vector<double> smooth{0.1003, 0.2711, 0.4321, 0.9, 1.37, 2.012};
  CHECK(quantum_of(smooth) == 0.0);
  const std::vector<double> same{1.0, 1.0, 1.0};
  CHECK(quantum_of(same) == 0.0);
}

TEST_CASE("a drive that was rounded is told from one that lies on a grid", "[rounded_drive]") {
  const auto ramp_and_hold = [](double speed, double step) {
    std::vector<double> drive;
    for (int i = 0; i < 400; ++i) {
      const double depth = std::clamp(speed * (i - 50), 0.0, 97.0 * speed);
      drive.push_back(step > 0.0 ? step * std::round(depth / step) : depth);
    }
    return drive;
  };
  const RoundedLevels coarse = rounded_levels(ramp_and_hold(0.031, 0.1));
  CHECK(coarse.step == Approx(0.1));
  CHECK(coarse.error_sd() == Approx(0.1 / std::sqrt(12.0)));
  REQUIRE(coarse.levels.size() == 31);  // 0 to 3.0
  CHECK(coarse.levels.front().first == 0);
  CHECK(coarse.levels.back().end == 400);
  CHECK(coarse.levels.back().size() > 200);  // the hold
  // Every reading of an exact ramp is another level.
  CHECK(rounded_levels(ramp_and_hold(0.03, 0.0)).levels.empty());
  // Finely written readings, and three stairs that were imposed.
  CHECK(rounded_levels(ramp_and_hold(0.031, 1e-5)).levels.empty());
  std::vector<double> stairs;
  for (int i = 0; i < 400; ++i) stairs.push_back(std::floor(0.01 * i));
  CHECK(rounded_levels(stairs).levels.empty());
  // Cycles pass the same few levels again and again.
  std::vector<double> cycles;
  for (int i = 0; i < 1500; ++i) cycles.push_back(i / 50 % 2);
  CHECK(rounded_levels(cycles).levels.empty());
  for (int i = 0; i < 1500; ++i)
    cycles[static_cast<std::size_t>(i)] = std::min({i % 60, 4, 60 - i % 60});
  CHECK(rounded_levels(cycles).levels.empty());
}
