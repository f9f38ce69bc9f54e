// A delay that has grown, found by how the hand moves.
#include <catch2/catch.hpp>
#include <cmath>
#include <deque>

#include "tpm/haptics/loop/delay_watch.hpp"

namespace tpm::haptics {
namespace {

/// A mass on a spring towards a place, with a damper, and a spring that answers so much later.
struct LateSpring {
  double mass_kg = 0.4, damping_N_s_per_m = 1.0, hand_N_per_m = 50.0, stiffness_N_per_m = 600.0;
  double delay_s = 0.0, at_m = 1e-3, speed_m_per_s = 0.0;
};

/// Largest sign that a watch which was told 1 ms sees within so long.
double largest_sign(LateSpring s, double time_s, double encoder_step_m = 1e-5) {
  constexpr double kPeriod_s = 1e-3;
  constexpr int kParts = 20;
  DelayWatch watch({.period_s = kPeriod_s, .told_s = 1e-3});
  std::deque<double> coming(static_cast<std::size_t>(std::lround(s.delay_s / kPeriod_s)), 0.0);
  double largest = 0.0, sent_N = 0.0;
  for (int i = 0; i < static_cast<int>(time_s / kPeriod_s); ++i) {
    const double seen_m = encoder_step_m * std::round(s.at_m / encoder_step_m);
    watch.observe(seen_m, sent_N, 1);
    largest = std::max(largest, watch.sign());
    sent_N = -s.stiffness_N_per_m * seen_m;
    coming.push_back(sent_N);
    const double force_N = coming.front();
    coming.pop_front();
    for (int part = 0; part < kParts; ++part) {
      const double a =
          (force_N - s.damping_N_s_per_m * s.speed_m_per_s - s.hand_N_per_m * s.at_m) / s.mass_kg;
      s.speed_m_per_s += a * kPeriod_s / kParts;
      s.at_m += s.speed_m_per_s * kPeriod_s / kParts;
    }
  }
  return largest;
}

TEST_CASE(
    "A loop that feeds itself because its forces are late is found, and one that dies out not") {
  // It feeds with K d = 6 and 12 N s/m what takes up 1 N s/m.
  for (const double delay_s : {0.010, 0.020}) {
    LateSpring late;
    late.delay_s = delay_s;
    CAPTURE(delay_s);
    CHECK(largest_sign(late, 1.0) > 1.0);
  }
  // As told: 600 N/m over 1.5 ms feed less than is taken up.
  LateSpring told;
  told.delay_s = 0.001;
  CHECK(largest_sign(told, 1.0) < 0.5);
  told.damping_N_s_per_m = 5.0;
  CHECK(largest_sign(told, 1.0) < 0.5);
  // Later than told, in a hand that takes up more.
  LateSpring heavy;
  heavy.delay_s = 0.005;
  heavy.damping_N_s_per_m = 6.0;
  CHECK(largest_sign(heavy, 1.0) < 1.0);
}

TEST_CASE("A hand at rest, and one that moves evenly, say nothing of the delay") {
  DelayWatch watch({.period_s = 1e-3, .told_s = 1e-3});
  for (int i = 0; i < 2000; ++i) {
    watch.observe(1e-5 * std::round(1e5 * (i < 1000 ? 0.0 : 1e-5 * (i - 1000))), 0.0, 1);
    REQUIRE(watch.sign() < 1.0);
  }
}

TEST_CASE("Missed periods are lived through") {
  DelayWatch watch({.period_s = 1e-3, .told_s = 1e-3});
  for (int i = 0; i < 200; ++i) watch.observe(1e-3 * std::sin(0.1 * i), 0.1, 1 + i % 5);
  CHECK(std::isfinite(watch.sign()));
}

}  // namespace
}  // namespace tpm::haptics
