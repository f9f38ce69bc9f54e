// A ball that moves over the surface of a small block: the servo model against the full network,
// and both against what they have to obey.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "counted_allocations.hpp"
#include "expected_values.hpp"
#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/random.hpp"
#include "tpm/contact/surface_network.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpm/organ/bonds/network.hpp"
#include "tpm/organ/steps/ball_by_cvode.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::organ {
using namespace contact;

namespace {

using Catch::Matchers::WithinAbs;
using Way = std::vector<Eigen::Vector3d>;

Organ block_with_contact() {
  Organ organ = block(4, 3, 2, 0.020, Lattice::cubic);
  organ.contact = 6;  // in the middle of the top but for one row
  return organ;
}

Constraints standing(const Organ& organ) {
  Constraints constraints(organ.size());
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] == 2) constraints.fix(i);
  }
  return constraints;
}

/// A block of 60 spheres that stands on its lowest plane, under a ball.
struct BallScene {
  explicit BallScene(double tau_s, double radius_m = 10e-3)
      : network(build_network(block_with_contact(), {}, "scene")),
        bonds(network, TpmParameters{}.with_relaxation_time(tau_s)),
        constraints(standing(network.organ)),
        ball(ball_on_surface(network.organ, *network.organ.contact, into, radius_m)) {}
  [[nodiscard]] const Positions& rest() const { return network.organ.position; }
  [[nodiscard]] SurfaceNetwork servo(const SurfaceNetworkOptions& options = {}) const {
    return {bonds, rest(), constraints, ball, options};
  }
  [[nodiscard]] BallOnNetwork full() const { return {bonds, rest(), constraints, ball}; }
  /// On, over 20 mm of the surface, and off.
  [[nodiscard]] Way slide(double depth_m, int steps) const {
    Way way;
    const auto line = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
      for (int i = 1; i <= steps; ++i) way.emplace_back(from + i * (to - from) / steps);
    };
    const Eigen::Vector3d deep = depth_m * into, there = deep + 20e-3 * aside;
    line(Eigen::Vector3d::Zero(), deep);
    line(deep, there);
    line(there, there - 2.0 * deep);
    return way;
  }

  Network network;
  BondSystem bonds;
  Constraints constraints;
  Eigen::Vector3d into = -Eigen::Vector3d::UnitZ();
  Eigen::Vector3d aside{std::cos(0.2), std::sin(0.2), 0.0};  // not quite over the next sphere
  BallTool ball;
};

TEST_CASE("A ball slides over the surface as over the full network", "[heavy]") {
  const double tau_s = GENERATE(0.02, 20.0);
  CAPTURE(tau_s);
  const BallScene scene(tau_s);
  SurfaceNetwork servo = scene.servo();
  BallOnNetwork full = scene.full();
  double peak = 0.0, worst = 0.0, estimate = 0.0, aside = 0.0;
  int touching = 0;
  Eigen::Vector3d last;
  for (const Eigen::Vector3d& at : scene.slide(4e-3, 300)) {
    const ContactAnswer answer = servo.step(at);
    last = full.step(scene.ball.start_m + at, servo.period_s());
    REQUIRE(answer.valid);
    CHECK(answer.force_N.isZero(0.0) == last.isZero(0.0));
    peak = std::max(peak, last.norm());
    aside = std::max(aside, (last - last.dot(scene.into) * scene.into).norm());
    worst = std::max(worst, (answer.force_N - last).norm());
    estimate = std::max(estimate, answer.error_N);
    touching = std::max(touching, full.touching());
  }
  CHECK(touching >= 2);
  CHECK(aside > 0.1 * peak);
  CHECK(worst < 1e-3 * peak);
  CHECK(worst < estimate);
  CHECK(last.isZero(0.0));
}

TEST_CASE("Pressed for long a ball feels the least of the potential energy", "[heavy]") {
  constexpr double kTau_s = 1e-3;
  const BallScene scene(kTau_s);
  // Between two spheres, so that both are touched.
  const Eigen::Vector3d at = 6e-3 * scene.into + 10e-3 * scene.aside;
  SurfaceNetwork servo = scene.servo();
  ContactAnswer answer;
  for (int i = 1; i <= 300; ++i) answer = servo.step(std::min(1.0, 0.01 * i) * at);

  // Everything relaxed: springs of k - g, and k/2 of each overlap squared; its gradient only, by
  // the steps of Barzilai and Borwein.
  const Eigen::Vector3d ball = scene.ball.start_m + at;
  Eigen::Vector3d felt;
  const auto gradient = [&](const Positions& x) {
    Positions g = Positions::Zero(3, x.cols());
    for (std::size_t b = 0; b < scene.bonds.size(); ++b) {
      const auto row = static_cast<Eigen::Index>(b);
      const std::uint32_t from = scene.bonds.end_a()[b], to = scene.bonds.end_b()[b];
      const Eigen::Vector3d apart = x.col(to) - x.col(from);
      const double length = apart.norm();
      const double pull = (scene.bonds.stiffness()[row] - scene.bonds.relaxing()[row]) *
                          (length - scene.bonds.rest_length_m()[row]);
      g.col(to) += pull / length * apart;
      g.col(from) -= pull / length * apart;
    }
    felt.setZero();
    for (const std::size_t sphere : scene.ball.touchable) {
      const auto column = static_cast<Eigen::Index>(sphere);
      const Eigen::Vector3d apart = ball - x.col(column);
      const double overlap = scene.ball.reach_m() - apart.norm();
      if (overlap <= 0.0) continue;
      const Eigen::Vector3d force = scene.ball.stiffness_N_per_m * overlap * apart.normalized();
      felt += force;
      g.col(column) += force;
    }
    scene.constraints.project(g);
    return g;
  };
  Positions x = scene.rest(), ahead = x;
  double momentum = 1.0, left_N = 1.0;
  const double step = 1.0 / (1.5 * scene.ball.stiffness_N_per_m);
  for (int i = 0; i < 20000 && left_N > 1e-8; ++i) {
    const Positions g = gradient(ahead);
    left_N = g.cwiseAbs().maxCoeff();
    const Positions next = ahead - step * g;
    if (g.cwiseProduct(next - x).sum() > 0.0) momentum = 1.0;  // it went uphill: start anew
    const double then = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * momentum * momentum));
    ahead = next + (momentum - 1.0) / then * (next - x);
    momentum = then;
    x = next;
  }
  REQUIRE(left_N <= 1e-8);
  CHECK(servo.touching() >= 2);
  CHECK((answer.force_N - felt).norm() < 1e-4 * felt.norm());
}

TEST_CASE("The ball's work is stored or dissipated, in the second order of the step") {
  const BallScene scene(0.05);
  const auto imbalance = [&](int steps) {
    BallOnNetwork full = scene.full();
    const double step_s = 0.2 / steps;
    Eigen::Vector3d before = Eigen::Vector3d::Zero(), force_before = before;
    double work = 0.0, heat = 0.0, heating = 0.0;
    for (const Eigen::Vector3d& at : scene.slide(4e-3, steps)) {
      const Eigen::Vector3d force = full.step(scene.ball.start_m + at, step_s);
      work -= 0.5 * (force + force_before).dot(at - before);
      heat += 0.5 * step_s * (heating + full.dissipation_W());
      heating = full.dissipation_W();
      force_before = force;
      before = at;
    }
    CHECK(heat > 0.1 * work);
    return std::abs(work - heat - full.stored_J()) / heat;
  };
  const double coarse = imbalance(40), fine = imbalance(80);
  CHECK(fine < test::allowed_error("ball.energy_balance"));
  CHECK(coarse / fine > 3.0);
}

TEST_CASE("Steps under a ball approach what CVODE finds, in the second order", "[heavy]") {
  constexpr double kKnot_s = 0.01;
  const BallScene scene(0.05);
  std::vector<BallPlace> places{{0.0, scene.ball.start_m}};
  for (const Eigen::Vector3d& at : scene.slide(4e-3, 10)) {
    places.push_back({kKnot_s * static_cast<double>(places.size()), scene.ball.start_m + at});
  }
  const auto by_cvode = [&](double tolerance) {
    return ball_forces_by_cvode(scene.bonds, scene.rest(), scene.constraints, scene.ball, places,
                                tolerance);
  };
  const std::vector<Eigen::Vector3d> expected = by_cvode(1e-9);
  double peak = 0.0;
  for (const Eigen::Vector3d& force : expected) peak = std::max(peak, force.norm());
  const auto apart = [&](int parts) {
    BallOnNetwork full = scene.full();
    double most = 0.0;
    for (std::size_t k = 1; k < places.size(); ++k) {
      Eigen::Vector3d force;
      for (int i = 1; i <= parts; ++i) {
        const double part = static_cast<double>(i) / parts;
        force = full.step(places[k - 1].at_m + part * (places[k].at_m - places[k - 1].at_m),
                          kKnot_s / parts);
      }
      most = std::max(most, (force - expected[k]).norm());
    }
    return most / peak;
  };
  const double coarse = apart(2), fine = apart(8);
  CAPTURE(coarse, fine, peak);
  CHECK(peak > 0.05);
  CHECK(fine < test::allowed_error("ball.against_cvode"));
  CHECK(coarse / fine > 10.0);
  // Its tolerance is what limits it.
  const std::vector<Eigen::Vector3d> rough = by_cvode(1e-6);
  double off = 0.0;
  for (std::size_t k = 0; k < rough.size(); ++k)
    off = std::max(off, (rough[k] - expected[k]).norm());
  CHECK(off > 0.0);
  CHECK(off < 1e-3 * peak);
}

TEST_CASE("A servo network under a ball converges in the second order of its period", "[heavy]") {
  const BallScene scene(0.05);
  const auto force_with = [&](int steps) {
    SurfaceNetwork servo =
        scene.servo({.period_s = 0.2 / steps, .balance_again_above = 1e-9, .most_balances = 20});
    ContactAnswer answer;
    for (int i = 1; i <= steps; ++i) {
      const double part = static_cast<double>(i) / steps;
      answer = servo.step(4e-3 * std::sin(2.0 * part) * scene.into + 5e-3 * part * scene.aside);
    }
    return answer.force_N;
  };
  const Eigen::Vector3d a = force_with(8), b = force_with(16), c = force_with(32);
  const double ratio = (a - b).norm() / (b - c).norm();
  CHECK(ratio > 3.4);
  CHECK(ratio < 4.6);
}

TEST_CASE("The estimate knows what linear elongations cost where tissue relaxes in a few periods",
          "[heavy]") {
  const double tau_s = GENERATE(1e-3, 4e-3, 0.1);
  constexpr int kParts = 8;
  const BallScene scene(tau_s);
  // Balanced to the last digits, so that nothing else is left of the error.
  SurfaceNetwork servo = scene.servo({.balance_again_above = 1e-9, .most_balances = 20});
  BallOnNetwork full = scene.full();
  double peak = 0.0, worst = 0.0, estimate = 0.0;
  int beyond = 0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  Way way = scene.slide(4e-3, 40);
  way.resize(80);  // drawn out as fast as this, relaxed tissue snaps
  for (const Eigen::Vector3d& at : way) {
    const ContactAnswer answer = servo.step(at);
    Eigen::Vector3d force;
    for (int i = 1; i <= kParts; ++i) {
      const double part = static_cast<double>(i) / kParts;
      force =
          full.step(scene.ball.start_m + before + part * (at - before), servo.period_s() / kParts);
    }
    before = at;
    const double error = (answer.force_N - force).norm();
    peak = std::max(peak, force.norm());
    worst = std::max(worst, error);
    estimate = std::max(estimate, servo.linear_error_N());
    beyond += error > answer.error_N + 1e-5 * peak ? 1 : 0;
  }
  CAPTURE(tau_s, peak, worst, estimate, beyond);
  CHECK(beyond == 0);
  CHECK(estimate < test::allowed_error("ball.estimate_over_error") * worst);
}

TEST_CASE("Random motions of a ball draw nothing, repeat to the bit and allocate nothing",
          "[heavy]") {
  const BallScene scene(1.0);
  Way way;
  Random random(3);
  const auto about = [&](double size) { return size * (2.0 * random.uniform() - 1.0); };
  Eigen::Vector3d at = Eigen::Vector3d::Zero(), aim = at, speed = at;
  for (int i = 0; i < 2000; ++i) {
    if (i % 50 == 0) {
      aim = (1e-3 + about(4e-3)) * scene.into + about(12e-3) * scene.aside +
            about(12e-3) * scene.into.cross(scene.aside);
    }
    speed += 1e-3 * (400.0 * (aim - at) - 30.0 * speed);
    at += 1e-3 * speed;
    way.push_back(at);
  }
  SurfaceNetwork servo = scene.servo();
  const auto follow = [&way](SurfaceNetwork& network, std::vector<Eigen::Vector3d>& force) {
    network.reset();
    for (std::size_t i = 0; i < way.size(); ++i) force[i] = network.step(way[i]).force_N;
  };
  std::vector<Eigen::Vector3d> first(way.size()), again(way.size()), plain(way.size());
  follow(servo, first);
  const tpm::testing::HeapWatch heap;
  follow(servo, again);
  const long calls = heap.calls();
  CHECK(calls == 0);
  CHECK(first == again);
  SurfaceNetwork portable = scene.servo({.portable = true});
  follow(portable, plain);
  double work = 0.0, least = 0.0, most = 0.0, apart = 0.0, peak = 0.0;
  for (std::size_t i = 1; i < way.size(); ++i) {
    work -= 0.5 * (first[i] + first[i - 1]).dot(way[i] - way[i - 1]);
    least = std::min(least, work);
    most = std::max(most, work);
    peak = std::max(peak, first[i].norm());
    apart = std::max(apart, (first[i] - plain[i]).norm());
  }
  CHECK(most > 1e-5);
  CHECK(least >= -1e-9 * most);
  CHECK(apart < test::allowed_error("ball.portable_code") * peak);
}

TEST_CASE("A network under a ball says when it is out of its range") {
  const BallScene scene(1.0);
  SurfaceNetwork servo = scene.servo({.deepest_m = 3e-3});
  CHECK(servo.step(2e-3 * scene.into).valid);
  for (int i = 1; i <= 300; ++i) (void)servo.step((2e-3 + 1e-5 * i) * scene.into);
  CHECK_FALSE(servo.step(5e-3 * scene.into).valid);
  const ContactAnswer bad =
      servo.step(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  CHECK_FALSE(bad.valid);
  CHECK_FALSE(bad.force_N.allFinite());
  servo.reset();
  CHECK(servo.step(2e-3 * scene.into).valid);
  // Stiffness at once, at rest: what a small push says.
  servo.reset();
  const Eigen::Vector3d push = 1e-5 * scene.into;
  const double expected = scene.into.dot(servo.instantaneous_stiffness() * push);
  CHECK_THAT(-scene.into.dot(servo.step(push).force_N), WithinAbs(expected, 2e-3 * expected));

  // So small a ball fits between four spheres, and comes to one of the next layer.
  const BallScene small(1.0, 1e-3);
  SurfaceNetwork fits = small.servo();
  const Eigen::Vector3d between(10e-3, 10e-3, 5e-3);
  CHECK(fits.step(between).valid);
  CHECK(fits.step(between + 36e-3 * small.into).valid);
  CHECK(fits.touching() == 0);
  CHECK_FALSE(fits.step(Eigen::Vector3d(5e-3, 5e-3, -31e-3)).valid);

  BallTool inside = scene.ball;
  inside.start_m += 1e-3 * scene.into;
  const auto build = [&](const BallTool& ball, const SurfaceNetworkOptions& options) {
    (void)SurfaceNetwork(scene.bonds, scene.rest(), scene.constraints, ball, options);
  };
  CHECK_THROWS_AS(build(inside, {}), Error);
  CHECK_THROWS_AS(build(scene.ball, {.period_s = 0.0}), Error);
  BallTool soft = scene.ball;
  soft.stiffness_N_per_m = 0.0;
  CHECK_THROWS_AS(build(soft, {}), Error);
  CHECK_THROWS_AS(BallOnNetwork(scene.bonds, scene.rest(), scene.constraints, soft), Error);
}

TEST_CASE("The smallest turn takes one direction onto another, opposite ones too") {
  const Eigen::Vector3d from = Eigen::Vector3d(1.0, -2.0, 0.5).normalized();
  for (const Eigen::Vector3d& to :
       {from, Eigen::Vector3d(-from), Eigen::Vector3d(Eigen::Vector3d::UnitY())}) {
    const Eigen::Matrix3d turn = turn_onto(from, to);
    CHECK((turn * from - to).norm() < 1e-14);
    CHECK((turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-14);
    CHECK_THAT(turn.determinant(), WithinAbs(1.0, 1e-14));
  }
}

}  // namespace
}  // namespace tpm::organ
