// The servo network on a small organ, and what it is made of.
#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "counted_allocations.hpp"
#include "expected_values.hpp"
#include "organ_scene.hpp"
#include "star_network.hpp"
#include "tpm/accuracy/contact_reference.hpp"
#include "tpm/base/random.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/law/relaxation/relaxation_filter.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::accuracy;
using tpm::testing::OrganScene;

namespace {

const OrganScene& small_liver() {
  static const OrganScene scene = [] {
    LiverRequest request;
    request.count = 60;
    return OrganScene(fill_liver(request));
  }();
  return scene;
}

/// What a model answered along a motion.
struct Answers {
  Eigen::Matrix3Xd force_N;
  double estimate_N = 0.0;
  bool valid = true;
};

Answers follow(ContactModel& model, const ContactMotion& motion) {
  Answers answers;
  answers.force_N.resize(3, motion.steps());
  model.reset();
  for (Eigen::Index i = 0; i < motion.steps(); ++i) {
    const ContactAnswer answer = model.step(motion.displacement_m.col(i));
    answers.force_N.col(i) = answer.force_N;
    answers.estimate_N = std::max(answers.estimate_N, answer.error_N);
    answers.valid = answers.valid && answer.valid;
  }
  return answers;
}

double largest(const Eigen::Matrix3Xd& vectors) {
  return vectors.colwise().norm().maxCoeff();
}

}  // namespace

TEST_CASE("a factor in fronts solves as a dense one does", "[frontal]") {
  Random random(3);
  constexpr Eigen::Index kNodes = 57;
  Eigen::Matrix3Xd places(3, kNodes);
  for (Eigen::Index i = 0; i < kNodes; ++i) {
    places.col(i) << random.uniform(), random.uniform(), 0.2 * random.uniform();
  }
  std::vector<FrontalFactor::Edge> edges;
  for (std::uint32_t a = 0; a < kNodes; ++a) {
    for (std::uint32_t b = a + 1; b < kNodes; ++b) {
      if ((places.col(a) - places.col(b)).norm() > 0.3) continue;
      edges.push_back(random.uniform() < 0.5 ? FrontalFactor::Edge{a, b}
                                             : FrontalFactor::Edge{b, a});
    }
  }
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(3 * kNodes, 3 * kNodes);
  std::vector<Eigen::Matrix3d> diagonal, across;
  const auto noise = [&] {
    return Eigen::Matrix3d::NullaryExpr([&] { return random.uniform() - 0.5; });
  };
  for (Eigen::Index i = 0; i < kNodes; ++i) {
    const Eigen::Matrix3d part = noise();
    diagonal.emplace_back(part + part.transpose() + 40.0 * Eigen::Matrix3d::Identity());
    dense.block<3, 3>(3 * i, 3 * i) = diagonal.back();
  }
  for (const auto& [a, b] : edges) {
    across.emplace_back(noise());
    dense.block<3, 3>(Eigen::Index{3} * a, Eigen::Index{3} * b) += across.back();
    dense.block<3, 3>(Eigen::Index{3} * b, Eigen::Index{3} * a) += across.back().transpose();
  }
  Eigen::VectorXd right(3 * kNodes);
  for (auto& value : right) value = random.uniform() - 0.5;
  const Eigen::VectorXd exact = dense.ldlt().solve(right);
  const auto fronts = std::make_shared<const EliminationFronts>(kNodes, edges);
  for (const bool portable : {false, true}) {
    FrontalFactor factor(fronts, portable);
    REQUIRE(factor.factorise(diagonal, edges, across));
    AlignedFloats x(4 * kNodes, 0.0F);
    for (std::size_t i = 0; i < kNodes; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        x[std::size_t{4} * fronts->place()[i] + c] =
            static_cast<float>(right[static_cast<Eigen::Index>(3 * i + c)]);
      }
    }
    factor.solve(x.data());
    Eigen::VectorXd found(3 * kNodes);
    for (std::size_t i = 0; i < kNodes; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        found[static_cast<Eigen::Index>(3 * i + c)] =
            static_cast<double>(x[std::size_t{4} * fronts->place()[i] + c]);
      }
    }
    // Numbers of the factor have 8 binary digits: 1/512 each.
    CHECK((found - exact).norm() < 1.0 / 512.0 * exact.norm());
    // A correction of what is left of the right-hand side gains as much again.
    const Eigen::VectorXd left = right - dense * found;
    for (std::size_t i = 0; i < kNodes; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        x[std::size_t{4} * fronts->place()[i] + c] =
            static_cast<float>(left[static_cast<Eigen::Index>(3 * i + c)]);
      }
    }
    factor.solve(x.data());
    for (std::size_t i = 0; i < kNodes; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        found[static_cast<Eigen::Index>(3 * i + c)] +=
            static_cast<double>(x[std::size_t{4} * fronts->place()[i] + c]);
      }
    }
    CHECK((found - exact).norm() < 1e-5 * exact.norm());
  }
  diagonal[5] *= -1.0;
  FrontalFactor factor(fronts);
  CHECK_FALSE(factor.factorise(diagonal, edges, across));
}

TEST_CASE("servo bonds pull and relax as the bonds of the network", "[servo][heavy]") {
  const OrganScene& scene = small_liver();
  const Positions& rest = scene.network.organ.position;
  const double z = 0.3;
  const BondSystem bonds(
      scene.network, TpmParameters{}.with_relaxation_time(1.0).bonds(LateralBond::tension_only));
  std::vector<ServoBonds::Choice> all;
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    all.push_back({b, bonds.end_a()[b], bonds.end_b()[b]});
  }
  const std::size_t spheres = bonds.spheres();
  for (const bool portable : {false, true}) {
    ServoBonds servo(bonds, rest, all, static_cast<std::uint32_t>(spheres), portable);
    const RelaxationWeights w = relaxation_weights(z);
    Eigen::VectorXd viscous = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size()));
    Eigen::VectorXd before = viscous;
    Random random(1);
    for (int step = 0; step < 5; ++step) {
      Positions position = rest;
      AlignedFloats u(4 * (spheres + 1), 0.0F);
      AlignedFloats force(8 * (spheres + 1), 0.0F);
      for (std::size_t i = 0; i < spheres; ++i) {
        for (int c = 0; c < 3; ++c) {
          const auto moved = static_cast<float>(2e-3 * (random.uniform() - 0.5));
          u[4 * i + static_cast<std::size_t>(c)] = moved;
          position(c, static_cast<Eigen::Index>(i)) += static_cast<double>(moved);
        }
      }
      const auto expect = [&](std::size_t first, const Eigen::VectorXd& mean_viscous) {
        Eigen::Matrix3Xd exact = Eigen::Matrix3Xd::Zero(3, rest.cols());
        bonds.add_forces(position, {mean_viscous, 0.0}, exact);
        double worst = 0.0;
        for (std::size_t i = 0; i < spheres; ++i) {
          for (std::size_t c = 0; c < 3; ++c) {
            const double difference = static_cast<double>(force[8 * i + first + c]) -
                                      exact(static_cast<int>(c), static_cast<Eigen::Index>(i));
            worst = std::max(worst, std::abs(difference));
          }
        }
        CHECK(worst < 2e-6);
      };
      Eigen::VectorXd now;
      bonds.elongations(position, now);
      viscous = (w.r * viscous + w.w0 * before + w.w1 * now).eval();
      // Advancing twice is advancing once: only what is accepted changes the state.
      servo.advance(u.data(), servo_weights(bonds, z * bonds.relaxation_time_s()), force.data());
      std::fill(force.begin(), force.end(), 0.0F);
      servo.advance(u.data(), servo_weights(bonds, z * bonds.relaxation_time_s()), force.data());
      expect(0, viscous);
      const Eigen::VectorXd later = w.r * viscous + (w.w0 + w.w1) * now;
      expect(4, later);
      servo.accept();
      std::fill(force.begin(), force.end(), 0.0F);
      servo.add_next(u.data(), servo_weights(bonds, z * bonds.relaxation_time_s()), force.data());
      expect(4, later);
      before = now;
    }
  }
}

TEST_CASE("the servo network follows the network along the normal and in space", "[servo][heavy]") {
  const OrganScene& scene = small_liver();
  const Positions& rest = scene.network.organ.position;
  const Eigen::Vector3d into = scene.probe.direction;
  const ContactAxes axes = contact_axes(into);
  for (const double tau : {2e-4, 0.05, 100.0}) {
    const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(tau));
    const TouchedTissue tissue{bonds, rest, scene.constraints, scene.probe.sphere};
    ServoNetwork servo(bonds, rest, scene.constraints, scene.probe.sphere, into);
    const ContactMotion ramp = ramp_motion(into, 6e-3, 0.05, 0.1, servo.period_s());
    const Eigen::VectorXd exact = line_reference(tissue, ramp, 1e-9);
    const Answers along = follow(servo, ramp);
    const double peak_N = exact.cwiseAbs().maxCoeff();
    const double error_N = (along.force_N.transpose() * into - exact).cwiseAbs().maxCoeff();
    CAPTURE(tau, error_N / peak_N, along.estimate_N / error_N);
    CHECK(error_N < test::allowed_error("servo_network.along_normal") * peak_N);
    CHECK(along.estimate_N > 0.3 * error_N);
    CHECK(along.estimate_N < 30.0 * error_N + 1e-5 * peak_N);
    CHECK(along.valid);

    if (tau < 1e-3) continue;  // needs a finer reference: tests/test_servo_network_slow.cpp
    const ContactMotion circles = circling_motion(axes, 2e-3, 1e-3, 20.0, 0.5, servo.period_s());
    const ContactReference in_space = fine_reference(tissue, circles, 1);
    CHECK(in_space.error_N < 1e-4 * in_space.peak_N());
    const Answers around = follow(servo, circles);
    const double space_error_N = largest(around.force_N - in_space.force_N);
    CAPTURE(space_error_N / in_space.peak_N(), around.estimate_N / space_error_N);
    CHECK(space_error_N < test::allowed_error("servo_network.in_space") * in_space.peak_N());
    CHECK(around.estimate_N > 0.3 * space_error_N);
  }
}

TEST_CASE("the fine reference is the quasi-static network", "[servo][heavy]") {
  const OrganScene& scene = small_liver();
  const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(5e-3));
  const TouchedTissue tissue{bonds, scene.network.organ.position, scene.constraints,
                             scene.probe.sphere};
  const ContactAxes axes = contact_axes(scene.probe.direction);
  const Eigen::Vector3d slanted = (2.0 * axes.into + axes.first - 0.5 * axes.second).normalized();
  const ContactMotion motion = ramp_motion(slanted, 4e-3, 0.1, 0.02, 1e-3);
  const Eigen::VectorXd exact = line_reference(tissue, motion, 1e-10);
  const double peak_N = exact.cwiseAbs().maxCoeff();
  std::vector<double> error;
  for (const int substeps : {2, 4}) {
    const ContactReference fine = fine_reference(tissue, motion, substeps);
    error.push_back((fine.force_N.transpose() * slanted - exact).cwiseAbs().maxCoeff());
    CHECK(error.back() < 2.0 * fine.error_N + 1e-9 * peak_N);
  }
  CHECK(error.back() < test::allowed_error("fine_reference.quasi_static") * peak_N);
}

TEST_CASE("the cost of linear elongations is what halving the step says", "[servo]") {
  const OrganScene& scene = small_liver();
  const Positions& rest = scene.network.organ.position;
  const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(2e-3));
  const TouchedTissue tissue{bonds, rest, scene.constraints, scene.probe.sphere};
  const double period_s = 1e-3;
  // So small that the network is linear.
  const ContactMotion motion = ramp_motion(scene.probe.direction, 2e-5, 2e-3, 0.01, period_s);
  const ContactReference exact = fine_reference(tissue, motion, 8);
  FineContact stepped(tissue, period_s);
  PushedContact pushed(bonds, rest, scene.constraints, scene.probe.sphere);
  StepError estimate(pushed, rest, 0.0, period_s);
  double worst = 0.0;
  double largest_N = 0.0;
  for (Eigen::Index i = 0; i < motion.steps(); ++i) {
    const Eigen::Vector3d at = motion.displacement_m.col(i);
    // The estimate speaks of forces on the tissue.
    const Eigen::Vector3d error = stepped.step(at) - exact.force_N.col(i);
    worst = std::max(worst, (estimate.advance(at) - error).norm());
    largest_N = std::max(largest_N, error.norm());
  }
  CAPTURE(largest_N / exact.peak_N(), worst / largest_N);
  CHECK(largest_N > 1e-6 * exact.peak_N());
  CHECK(worst < 0.2 * largest_N);
}

TEST_CASE("a step of the servo network allocates nothing, and runs repeat", "[servo][heavy]") {
  const OrganScene& scene = small_liver();
  const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(0.01));
  const Eigen::Vector3d into = scene.probe.direction;
  ServoNetwork servo(bonds, scene.network.organ.position, scene.constraints, scene.probe.sphere,
                     into);
  const ContactMotion motion = random_motion_in_space(contact_axes(into), 6e-3, 1e-3, 50, 0, 1e-3);
  const Answers first = follow(servo, motion);
  const Answers again = follow(servo, motion);
  CHECK(first.force_N == again.force_N);
  const tpm::testing::HeapWatch heap;
  for (Eigen::Index i = 0; i < motion.steps(); ++i) servo.step(motion.displacement_m.col(i));
  const long calls = heap.calls();
  CHECK(calls == 0);
  Eigen::Matrix3Xd all(3, servo.spheres());
  servo.displacements(all);
  const Eigen::Vector3d at = motion.displacement_m.rightCols<1>();
  CHECK((all.col(static_cast<Eigen::Index>(scene.probe.sphere)) - at).norm() < 1e-9);

  ServoNetwork portable(bonds, scene.network.organ.position, scene.constraints, scene.probe.sphere,
                        into, {.portable = true});
  const Answers plain = follow(portable, motion);
  CHECK(largest(plain.force_N - first.force_N) < 1e-5 * largest(first.force_N));
}

TEST_CASE("the servo network says when it is out of its range", "[servo]") {
  const OrganScene& scene = small_liver();
  const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(0.01));
  const Positions& rest = scene.network.organ.position;
  const Eigen::Vector3d into = scene.probe.direction;
  ServoNetwork servo(bonds, rest, scene.constraints, scene.probe.sphere, into, {.deepest_m = 5e-3});
  CHECK(servo.step(1e-3 * into).valid);
  servo.reset();
  CHECK_FALSE(follow(servo, ramp_motion(into, 6e-3, 0.1, 0.01, 1e-3)).valid);
  CHECK_FALSE(servo.step(Eigen::Vector3d::Constant(std::nan(""))).valid);
  servo.reset();
  CHECK(servo.step(1e-3 * into).valid);
  CHECK_THROWS_AS(ServoNetwork(bonds, rest, scene.constraints, scene.probe.sphere, 2.0 * into),
                  Error);
  CHECK_THROWS_AS(
      ServoNetwork(bonds, rest, scene.constraints, scene.probe.sphere, into, {.period_s = 0.0}),
      Error);
  Constraints held = scene.constraints;
  held.fix(scene.probe.sphere);
  CHECK_THROWS_AS(ServoNetwork(bonds, rest, held, scene.probe.sphere, into), Error);
}

TEST_CASE("a guided sphere stays on its guide in the servo network", "[servo]") {
  const OrganScene& scene = small_liver();
  const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(0.01));
  const Positions& rest = scene.network.organ.position;
  const Eigen::Vector3d into = scene.probe.direction;
  std::size_t guided = 0;
  while (!scene.constraints.is_free(guided) || guided == scene.probe.sphere) ++guided;
  const Eigen::Vector3d along = Eigen::Vector3d(1.0, 2.0, -0.5).normalized();
  Constraints constraints = scene.constraints;
  constraints.slide(guided, along);
  ServoNetwork servo(bonds, rest, constraints, scene.probe.sphere, into);
  const ContactMotion ramp = ramp_motion(into, 4e-3, 0.05, 0.02, 1e-3);
  const Answers answers = follow(servo, ramp);
  const TouchedTissue tissue{bonds, rest, constraints, scene.probe.sphere};
  const Eigen::VectorXd exact = line_reference(tissue, ramp, 1e-9);
  CHECK((answers.force_N.transpose() * into - exact).cwiseAbs().maxCoeff() <
        1e-3 * exact.cwiseAbs().maxCoeff());
  Eigen::Matrix3Xd all(3, servo.spheres());
  servo.displacements(all);
  const Eigen::Vector3d moved = all.col(static_cast<Eigen::Index>(guided));
  CHECK((moved - moved.dot(along) * along).norm() < 1e-9);
}
