// Contact models at servo rate with several branches, stiffening bonds and regions, against the
// quasi-static network; what they do not take.
#include <catch2/catch.hpp>
#include <functional>

#include "condensed_passivity.hpp"
#include "counted_allocations.hpp"
#include "expected_values.hpp"
#include "organ_scene.hpp"
#include "tpm/base/random.hpp"
#include "tpm/contact/condensed/condensed.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/law/relaxation/relaxation_filter.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::contact;
using tpm::testing::OrganScene;

namespace {

constexpr double kPeriod_s = 1e-3, kDepth_m = 8e-3;
constexpr int kRamp = 400, kSteps = 1200;

const OrganScene& small_liver() {
  static const OrganScene scene = [] {
    LiverRequest request;
    request.count = 60;
    return OrganScene(fill_liver(request));
  }();
  return scene;
}

BondMaterial material_of(const std::vector<double>& times, double relaxing_share) {
  BondMaterial m;
  m.equilibrium_Pa = (1.0 - relaxing_share) * 12e3;
  for (const double time_s : times) {
    m.branches.push_back({relaxing_share * 12e3 / static_cast<double>(times.size()), time_s});
  }
  m.lateral_Pa = 12e3;
  return m;
}

BondMaterial stiffening(BondMaterial m) {
  m.potential = elongation_function("cubic", {5e-3});
  return m;
}

/// Five times stiffer around the contact.
MaterialField with_tumour(const BondMaterial& m) {
  const Organ& organ = small_liver().network.organ;
  MaterialField field(m);
  field.factor = Eigen::VectorXd::Ones(organ.position.cols());
  const auto contact = static_cast<Eigen::Index>(*organ.contact);
  const Eigen::Vector3d centre = organ.position.col(contact) - 0.010 * organ.normal.col(contact);
  for (Eigen::Index i = 0; i < field.factor.size(); ++i) {
    if ((organ.position.col(i) - centre).norm() <= 0.015) field.factor[i] = 5.0;
  }
  return field;
}

double depth_at(int step) {
  return kDepth_m * std::min(1.0, static_cast<double>(step) / kRamp);
}

Eigen::VectorXd reference(const BondSystem& bonds) {
  const OrganScene& scene = small_liver();
  std::vector<double> times;
  for (int i = 1; i <= kSteps; ++i) times.push_back(kPeriod_s * i);
  const Protocol protocol(
      Drive::displacement,
      {{0.0, 0.0}, {kRamp * kPeriod_s, kDepth_m}, {kSteps * kPeriod_s, kDepth_m}}, "ramp");
  // Models at servo rate move the contact in space: it does not yield to the side.
  Constraints guided = scene.constraints;
  guided.slide(scene.probe.sphere, scene.probe.direction);
  return QuasiStatic(bonds, scene.network.organ.position, guided, scene.probe, {.tolerance = 1e-7})
      .run(protocol, times)
      .response;
}

struct ModelErrors {
  double error, claim;  ///< the largest of a run, over the peak
};

ModelErrors errors_of(ContactModel& model, const Eigen::VectorXd& expected) {
  const Eigen::Vector3d& into = small_liver().probe.direction;
  ModelErrors found{0.0, 0.0};
  const double peak = expected.maxCoeff();
  for (int i = 1; i <= kSteps; ++i) {
    const ContactAnswer answer = model.step(depth_at(i) * into);
    found.error =
        std::max(found.error, std::abs(-answer.force_N.dot(into) - expected[i - 1]) / peak);
    found.claim = std::max(found.claim, answer.error_N / peak);
  }
  return found;
}

/// The model's largest error over the peak; it may not be above the largest that the model claims.
double worst_error(ContactModel& model, const Eigen::VectorXd& expected) {
  const ModelErrors found = errors_of(model, expected);
  CHECK(found.error <= found.claim);
  return found.error;
}

ServoNetwork servo_network(const BondSystem& bonds, bool portable = false) {
  const OrganScene& scene = small_liver();
  ServoNetworkOptions options{.period_s = kPeriod_s};
  options.portable = portable;
  return {bonds,
          scene.network.organ.position,
          scene.constraints,
          scene.probe.sphere,
          scene.probe.direction,
          options};
}

std::string refusal_of(const std::function<void()>& make) {
  try {
    make();
  } catch (const Error& error) {
    CHECK(error.code() == ExitCode::bad_input);
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("servo bonds of several branches and a cubic potential pull as the network's",
          "[servo][heavy]") {
  const OrganScene& scene = small_liver();
  const Positions& rest = scene.network.organ.position;
  const BondSystem bonds(scene.network, stiffening(material_of({0.5e-3, 4e-3, 0.1}, 0.9)));
  std::vector<ServoBonds::Choice> all;
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    all.push_back({b, bonds.end_a()[b], bonds.end_b()[b]});
  }
  const std::size_t spheres = bonds.spheres();
  const ServoWeights weights = servo_weights(bonds, kPeriod_s);
  REQUIRE(weights.branches.size() == 3);
  for (const bool portable : {false, true}) {
    ServoBonds servo(bonds, rest, all, static_cast<std::uint32_t>(spheres), portable);
    Eigen::MatrixXd viscous =
        Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(bonds.size()), bonds.most_branches());
    Eigen::VectorXd before = viscous.col(0);
    Random random(1);
    for (int step = 0; step < 5; ++step) {
      Positions position = rest;
      AlignedFloats u(4 * (spheres + 1), 0.0F);
      AlignedFloats force(8 * (spheres + 1), 0.0F);
      for (std::size_t i = 0; i < spheres; ++i) {
        for (int c = 0; c < 3; ++c) {
          const auto moved = static_cast<float>(4e-3 * (random.uniform() - 0.5));
          u[4 * i + static_cast<std::size_t>(c)] = moved;
          position(c, static_cast<Eigen::Index>(i)) += static_cast<double>(moved);
        }
      }
      const auto expect = [&](std::size_t first, const Eigen::MatrixXd& m) {
        Eigen::Matrix3Xd exact = Eigen::Matrix3Xd::Zero(3, rest.cols());
        bonds.add_forces(position, {bonds.mean_viscous(m), 0.0}, exact);
        double worst = 0.0;
        for (std::size_t i = 0; i < spheres; ++i) {
          for (std::size_t c = 0; c < 3; ++c) {
            worst =
                std::max(worst, std::abs(static_cast<double>(force[8 * i + first + c]) -
                                         exact(static_cast<int>(c), static_cast<Eigen::Index>(i))));
          }
        }
        CHECK(worst < 4e-6);
      };
      const auto after = [&](const Eigen::MatrixXd& m, const Eigen::VectorXd& from,
                             const Eigen::VectorXd& to) {
        Eigen::MatrixXd next = m;
        for (Eigen::Index j = 0; j < m.cols(); ++j) {
          const RelaxationWeights w = relaxation_weights(
              kPeriod_s / bonds.relaxation_times_s()[static_cast<std::size_t>(j)]);
          next.col(j) = w.r * m.col(j) + w.w0 * from + w.w1 * to;
        }
        return next;
      };
      Eigen::VectorXd now;
      bonds.elongations(position, now);
      viscous = after(viscous, before, now);
      servo.advance(u.data(), weights, force.data());
      std::fill(force.begin(), force.end(), 0.0F);
      servo.advance(u.data(), weights, force.data());
      expect(0, viscous);
      expect(4, after(viscous, now, now));
      servo.accept();
      std::fill(force.begin(), force.end(), 0.0F);
      servo.add_next(u.data(), weights, force.data());
      expect(4, after(viscous, now, now));
      before = now;
    }
  }
}

TEST_CASE("models at servo rate keep their claims with several branches and stiffening bonds",
          "[servo][heavy]") {
  const OrganScene& scene = small_liver();
  struct Case {
    const char* name;
    MaterialField field;
  };
  for (const Case& c :
       std::vector<Case>{{"two branches, 90 %", material_of({0.02, 5.0}, 0.9)},
                         {"five branches, 90 %", material_of({2e-3, 0.02, 0.2, 2.0, 50.0}, 0.9)},
                         {"cubic", stiffening(material_of({0.3}, 0.5))},
                         {"tumour", with_tumour(material_of({0.02, 5.0}, 0.5))}}) {
    CAPTURE(c.name);
    const BondSystem bonds(scene.network, c.field);
    const Eigen::VectorXd expected = reference(bonds);
    ServoNetwork full = servo_network(bonds);
    CHECK(worst_error(full, expected) < test::allowed_error("servo_network.materials"));
  }
}

TEST_CASE("one branch written as two of the same time is the same servo network", "[servo]") {
  const OrganScene& scene = small_liver();
  BondMaterial one = material_of({0.3}, 0.8);
  BondMaterial two = one;
  two.branches = {{0.4 * one.branches[0].modulus_Pa, 0.3},
                  {0.6 * one.branches[0].modulus_Pa, 0.3 * (1.0 + 1e-9)}};
  const BondSystem a(scene.network, one), b(scene.network, two);
  REQUIRE(b.most_branches() == 2);
  for (const bool portable : {false, true}) {
    ServoNetwork first = servo_network(a, portable), second = servo_network(b, portable);
    double apart_N = 0.0, largest_N = 0.0;
    for (int i = 1; i <= 600; ++i) {
      const Eigen::Vector3d at = depth_at(i) * scene.probe.direction;
      const Eigen::Vector3d x = first.step(at).force_N, y = second.step(at).force_N;
      apart_N = std::max(apart_N, (x - y).norm());
      largest_N = std::max(largest_N, x.norm());
    }
    CHECK(apart_N < test::allowed_error("servo_network.branch_in_two") * largest_N);
  }
}

TEST_CASE("a servo step with several branches allocates nothing, and runs repeat", "[servo]") {
  const BondSystem bonds(small_liver().network, stiffening(material_of({0.01, 0.2, 4.0}, 0.9)));
  ServoNetwork model = servo_network(bonds);
  const Eigen::Vector3d& into = small_liver().probe.direction;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (const bool again : {false, true}) {
    model.reset();
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    const tpm::testing::HeapWatch heap;
    for (int i = 1; i <= 300; ++i) force = model.step(depth_at(i) * into).force_N;
    const long calls = heap.calls();
    CHECK(calls == 0);
    if (again) CHECK(force == last);
    last = force;
  }
}

namespace {

CondensedContact condensed(const BondSystem& bonds) {
  const OrganScene& scene = small_liver();
  return build_condensed(bonds, scene.network.organ.position, scene.constraints, scene.probe.sphere,
                         scene.probe.direction, {.depth_m = kDepth_m, .period_s = kPeriod_s});
}

}  // namespace

TEST_CASE("the condensed model errs with several branches as it does with one",
          "[condensed][heavy]") {
  struct Case {
    std::vector<double> times;
    double relaxing_share;
  };
  constexpr double kMore = 1.5;
  const auto error_of = [](const std::vector<double>& times, double share) {
    const BondSystem bonds(small_liver().network, material_of(times, share));
    CondensedContact model = condensed(bonds);
    REQUIRE(model.branches().size() == times.size());
    const double worst = worst_error(model, reference(bonds));
    CHECK(model.kept_viscous_states() == 0);
    return worst;
  };
  for (const Case& c : std::vector<Case>{
           {{0.5, 10.0}, 0.5}, {{0.02, 5.0}, 0.9}, {{2e-4, 0.02, 0.2, 2.0, 50.0}, 0.9}}) {
    CAPTURE(c.times.size(), c.relaxing_share);
    double of_one = 0.0;
    for (const double time_s : {0.1, 0.5, 5.0}) {
      of_one = std::max(of_one, error_of({time_s}, c.relaxing_share));
    }
    CHECK(error_of(c.times, c.relaxing_share) < kMore * of_one);
  }
}

TEST_CASE("one branch written as two of the same time is the same condensed model",
          "[condensed][heavy]") {
  const BondSystem bonds(small_liver().network, material_of({0.3}, 0.8));
  CondensedContact one = condensed(bonds);
  CondensedContact two = one.with_branches({{0.4, 0.3}, {0.6, 0.3 * (1.0 + 1e-9)}});
  const Eigen::Vector3d& into = small_liver().probe.direction;
  double apart_N = 0.0, largest_N = 0.0;
  for (int i = 1; i <= 600; ++i) {
    const Eigen::Vector3d at =
        depth_at(i) * into + 1e-3 * std::sin(0.02 * i) * into.unitOrthogonal();
    const ContactAnswer x = one.step(at), y = two.step(at);
    apart_N = std::max(apart_N, (x.force_N - y.force_N).norm());
    largest_N = std::max(largest_N, x.force_N.norm());
  }
  CHECK(apart_N < test::allowed_error("condensed.branch_in_two") * largest_N);
}

TEST_CASE("a condensed contact of several branches creates no energy and allocates nothing",
          "[condensed][heavy]") {
  const BondSystem bonds(small_liver().network, material_of({0.3}, 0.9));
  CondensedOptions range{.depth_m = 4e-3, .tangential_m = 1e-3, .period_s = kPeriod_s};
  const OrganScene& scene = small_liver();
  CondensedContact contact =
      build_condensed(bonds, scene.network.organ.position, scene.constraints, scene.probe.sphere,
                      scene.probe.direction, range)
          .with_branches({{0.2, 5e-4}, {0.3, 0.02}, {0.3, 0.5}, {0.2, 20.0}});
  const tpm::testing::EnergyAccount account =
      tpm::testing::account_of_random_motion(contact, scene.probe.direction, range, 20000, 7);
  CHECK(account.created_J < 1e-13 * account.highest_J);
  CHECK(account.least_J > -1e-13 * account.highest_J);
  CHECK(account.supplied_J > 0.05 * account.highest_J);
  CHECK(static_cast<double>(contact.kept_viscous_states()) <
        test::allowed_cost("condensed.kept_viscous_states"));
  contact.reset();
  CHECK(contact.viscous_state().spread_J == 0.0);
  const tpm::testing::HeapWatch heap;
  for (int i = 1; i <= 300; ++i) (void)contact.step(0.5 * depth_at(i) * scene.probe.direction);
  const long calls = heap.calls();
  CHECK(calls == 0);
}

TEST_CASE("the condensed model takes a stiffening potential and factors of place",
          "[condensed][heavy]") {
  const OrganScene& scene = small_liver();
  for (const bool tumour : {false, true}) {
    CAPTURE(tumour);
    const BondMaterial m = material_of({0.3}, 0.5);
    const BondSystem bonds(scene.network, tumour ? with_tumour(m) : MaterialField(stiffening(m)));
    CondensedContact model = condensed(bonds);
    CHECK(worst_error(model, reference(bonds)) < test::allowed_error("condensed.materials"));
    CHECK(model.kept_viscous_states() == 0);
  }
}

TEST_CASE("models at servo rate say which materials they do not take") {
  const OrganScene& scene = small_liver();
  const auto servo = [&](const MaterialField& field) {
    return refusal_of([&] {
      const BondSystem bonds(scene.network, field);
      static_cast<void>(servo_network(bonds));
    });
  };
  BondMaterial kernel = material_of({0.3}, 0.5);
  kernel.kernel = elongation_function("cubic", {5e-3});
  CHECK_THAT(servo(kernel),
             Catch::StartsWith("material: the network at servo rate is no formulation that takes "
                               "branches on a kernel; expected one of static, network_step, "
                               "quasi_static, inertial, "));
  BondMaterial sinh = material_of({0.3}, 0.5);
  sinh.potential = elongation_function("sinh", {5e-3});
  CHECK_THAT(servo(sinh), Catch::Contains("a potential of any shape"));
  MaterialField regions(material_of({0.3}, 0.5));
  regions.materials.push_back(material_of({3.0}, 0.5));
  regions.of_sphere.assign(scene.network.organ.size(), 0);
  regions.of_sphere[0] = 1;
  CHECK_THAT(servo(regions), Catch::Contains("regions that relax differently"));
  const BondSystem mixed(scene.network, regions);
  CHECK_THAT(refusal_of([&] { static_cast<void>(condensed(mixed)); }),
             Catch::Contains("the condensed model is no formulation that takes regions that relax "
                             "differently"));
  BondMaterial elastic = material_of({0.3}, 0.5);
  elastic.branches.clear();
  const BondSystem nothing(scene.network, elastic);
  CHECK_THAT(refusal_of([&] { static_cast<void>(condensed(nothing)); }),
             Catch::Contains("nothing relaxes"));
}
