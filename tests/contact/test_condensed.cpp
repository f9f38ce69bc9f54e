// The condensed contact on a small organ, against the full network and its own energy.
#include <catch2/catch.hpp>

#include "condensed_passivity.hpp"
#include "contact_path.hpp"
#include "expected_values.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::contact;
using namespace tpm::testing;

namespace {

struct SmallOrgan {
  Tissue tissue = parse_tissue(
      Json::parse(R"({"organ": {"kind": "liver", "count": 60, "layers": 2, "spacing": "20 mm"},
                      "anchors": [{"kind": "inner_layer"}]})"),
      "small organ", {});
  std::size_t contact = *tissue.network.organ.contact;
  Eigen::Vector3d into = -tissue.network.organ.normal.col(static_cast<Eigen::Index>(contact));
  CondensedOptions options{4e-3, 1e-3, 1e-3};

  [[nodiscard]] BondSystem bonds(double relaxation_time_s) const {
    return {tissue.network, tissue.element().with_relaxation_time(relaxation_time_s)};
  }
  [[nodiscard]] CondensedContact build(double relaxation_time_s) const {
    return build_condensed(bonds(relaxation_time_s), tissue.network.organ.position,
                           tissue.constraints(), contact, into, options);
  }
};

const SmallOrgan& small_organ() {
  static const SmallOrgan small;
  return small;
}
const CondensedContact& built() {
  static const CondensedContact contact = small_organ().build(0.1);
  return contact;
}

/// In, a turn with a shift aside, a hold, and half out again: 200 steps.
Eigen::Vector3d path(int step) {
  const double t = 0.005 * step;
  const Eigen::Vector3d across = small_organ().into.unitOrthogonal();
  const double depth = t < 0.3 ? t / 0.3 : t < 0.7 ? 1.0 : 1.0 - 0.5 * (t - 0.7) / 0.3;
  const double aside = t < 0.2 ? 0.0 : t < 0.5 ? (t - 0.2) / 0.3 : 1.0 - (t - 0.5);
  return 4e-3 * depth * small_organ().into +
         1e-3 * aside *
             (std::cos(6.0 * t) * across + std::sin(6.0 * t) * small_organ().into.cross(across));
}

}  // namespace

TEST_CASE("a condensed contact follows the full network, force and field", "[condensed][heavy]") {
  const double tau = GENERATE(2e-4, 0.02, 0.2, 50.0);
  CAPTURE(tau);
  const BondSystem bonds = small_organ().bonds(tau);
  ContactPath full(bonds, small_organ().tissue.network.organ.position,
                   small_organ().tissue.constraints(), small_organ().contact);
  CondensedContact contact = built().with_relaxation_time(tau);
  double force_peak = 0.0, force_error = 0.0, field_peak = 0.0, field_error = 0.0;
  Eigen::Matrix3Xd field(3, contact.spheres());
  bool bounded = true;
  for (int i = 1; i <= 200; ++i) {
    full.advance(path(i), contact.period_s());
    const ContactAnswer answer = contact.step(path(i));
    REQUIRE(answer.valid);
    contact.displacements(field);
    const double off = (answer.force_N - full.force_N()).norm();
    bounded = bounded && off <= 1.5 * answer.error_N;
    force_error = std::max(force_error, off);
    force_peak = std::max(force_peak, full.force_N().norm());
    const Eigen::Matrix3Xd true_field = full.displacements_m();
    field_error = std::max(field_error, (field - true_field).colwise().norm().maxCoeff());
    field_peak = std::max(field_peak, true_field.colwise().norm().maxCoeff());
  }
  CHECK(force_error < test::allowed_error("condensed.force") * force_peak);
  CHECK(field_error < test::allowed_error("condensed.field") * field_peak);
  CHECK(bounded);
}

TEST_CASE("a condensed contact starts with the stiffness of the network", "[condensed]") {
  const Eigen::Matrix3d k = built().instantaneous_stiffness();
  const Eigen::Matrix3d relaxed = built().equilibrium_stiffness();
  CHECK((k - k.transpose()).norm() < 1e-9 * k.norm());
  CHECK((relaxed - relaxed.transpose()).norm() < 1e-9 * k.norm());
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Vector3d small = Eigen::Vector3d::Unit(i) * 1e-6;
    CondensedContact fast = built().with_relaxation_time(1e9);
    CHECK((fast.step(small).force_N + k * small).norm() < 1e-3 * k.norm() * small.norm());
    CondensedContact slow = built().with_relaxation_time(1e-9);
    for (int n = 0; n < 3; ++n) (void)slow.step(small);
    CHECK((slow.step(small).force_N + relaxed * small).norm() < 2e-3 * k.norm() * small.norm());
  }
  CondensedContact rest = built();
  CHECK(rest.step(Eigen::Vector3d::Zero()).force_N.norm() < 1e-12);
}

TEST_CASE("another relaxation time needs no new solutions", "[condensed][heavy]") {
  CondensedContact rescaled = built().with_relaxation_time(0.02);
  CondensedContact anew = small_organ().build(0.02);
  for (int i = 1; i <= 200; ++i) {
    REQUIRE(rescaled.step(path(i)).force_N == anew.step(path(i)).force_N);
  }
  // Two steps of half the period come to nearly one.
  CondensedContact half = rescaled.with_period(0.5e-3);
  rescaled.reset();
  double off = 0.0, peak = 0.0;
  for (int i = 1; i <= 200; ++i) {
    (void)half.step(0.5 * (path(i - 1) + path(i)));
    const Eigen::Vector3d force = rescaled.step(path(i)).force_N;
    off = std::max(off, (half.step(path(i)).force_N - force).norm());
    peak = std::max(peak, force.norm());
  }
  CHECK(off < test::allowed_error("condensed.half_period") * peak);
}

TEST_CASE("a condensed contact creates no energy", "[condensed][heavy]") {
  const double tau = GENERATE(2e-4, 0.01, 1.0);
  CAPTURE(tau);
  CondensedContact contact = built().with_relaxation_time(tau);
  const EnergyAccount account =
      account_of_random_motion(contact, small_organ().into, small_organ().options, 20000, 7);
  CHECK(account.created_J < 1e-13 * account.highest_J);
  CHECK(account.least_J > -1e-13 * account.highest_J);
  CHECK(account.supplied_J > 0.05 * account.highest_J);
}

TEST_CASE("beyond its range a condensed contact says so", "[condensed]") {
  CondensedContact contact = built();
  CHECK(contact.step(4e-3 * small_organ().into).valid);
  CHECK_FALSE(contact.step(4.5e-3 * small_organ().into).valid);
  CHECK_FALSE(
      contact.step(2e-3 * small_organ().into + 1.2e-3 * small_organ().into.unitOrthogonal()).valid);
  CHECK_FALSE(contact.step(-0.5e-3 * small_organ().into).valid);
}

TEST_CASE("what cannot be condensed is refused", "[condensed]") {
  const BondSystem bonds = small_organ().bonds(0.1);
  const auto build = [&](const CondensedOptions& options, const Eigen::Vector3d& into,
                         std::size_t contact) {
    return build_condensed(bonds, small_organ().tissue.network.organ.position,
                           small_organ().tissue.constraints(), contact, into, options);
  };
  CHECK_THROWS_AS(build({0.0, 1e-3, 1e-3}, small_organ().into, small_organ().contact), Error);
  CHECK_THROWS_AS(build({4e-3, -1.0, 1e-3}, small_organ().into, small_organ().contact), Error);
  CHECK_THROWS_AS(build({4e-3, 1e-3, 0.0}, small_organ().into, small_organ().contact), Error);
  CHECK_THROWS_AS(build({4e-3, 1e-3, 1e-3}, 2.0 * small_organ().into, small_organ().contact),
                  Error);
  CHECK_THROWS_AS(build({4e-3, 1e-3, 1e-3}, small_organ().into, 60), Error);
  CHECK_THROWS_AS(built().with_relaxation_time(0.0), Error);
  CHECK_THROWS_AS(built().with_period(-1.0), Error);
}
