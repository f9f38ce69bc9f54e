// tpm validate where an organ, the pick of a plan or a session answers: grids, the place of the
// spheres, relaxation times, claimed errors, rendering.
#include <catch2/catch.hpp>
#include <cmath>

#include "quiet_recordings.hpp"
#include "refusal.hpp"
#include "tpm/fit/predict/organ_prediction.hpp"
#include "tpm/fit/validate/grid_convergence.hpp"

namespace tpm::fit {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::quiet_law;
using test::quiet_recording;
using test::request_for;

namespace {

/// The paper's star: four spheres, which answer within milliseconds.
OrganMaterial star_with(const LawFile& law, bool fit_times) {
  OrganMaterialOptions options;
  options.fit_times = fit_times;
  return put_on_organ(
      law,
      {motion_of_protocol(ramp_and_hold(4e-3, 1e-3, 20.0),
                          [] {
                            std::vector<double> t;
                            for (int i = 0; i <= 96; ++i) t.push_back(0.25 * i);
                            return t;
                          }())},
      Json::parse(R"({"organ": {"kind": "star"}, "contacts": [{"kind": "sphere"}]})"), "test", {},
      options);
}
const OrganMaterial& star_of(const LawFile& law) {
  static const OrganMaterial once = star_with(law, true);
  return once;
}

}  // namespace

TEST_CASE("the grid convergence index has its closed form", "[validate]") {
  // 1 + 0.1 h^2 on h = 1, 2, 4: the error of the finest is 0.1, and the order 2.
  const GridConvergenceEstimate g = grid_convergence({1.1, 1.4, 2.6}, 2.0);
  CHECK(g.monotone);
  CHECK_THAT(g.order, WithinRel(2.0, 1e-12));
  CHECK_THAT(g.expanded, WithinRel(1.25 * 0.1, 1e-12));
  CHECK_THAT(g.u, WithinRel(0.0625, 1e-12));
  // An oscillation, differences that grow, and two grids: 3 times the largest difference.
  CHECK_THAT(grid_convergence({1.0, 1.2, 1.1}, 2.0).expanded, WithinRel(0.6, 1e-12));
  CHECK_THAT(grid_convergence({1.0, 1.3, 1.4}, 2.0).expanded, WithinRel(1.2, 1e-12));
  CHECK_THAT(grid_convergence({1.0, 1.1}, 2.0).u, WithinRel(0.15, 1e-12));
  CHECK_THAT(grid_convergence({1.0, 1.0, 1.0}, 2.0).u, WithinAbs(0.0, 0.0));
  CHECK_THAT(test::refusal_of([] { (void)grid_convergence({1.0}, 2.0); }),
             Contains("two or more finite values"));
}

TEST_CASE("an organ is compared as its law is, with the numbers of its network", "[validate]") {
  const LawFile law = quiet_law();
  ValidationRequest request = request_for(law, quiet_recording(1.0));
  const Validation by_law = validate(request);
  request.organ =
      std::shared_ptr<const OrganOfLaw>(new OrganOfLaw(organ_of_law(star_of(law), "test")));
  const Validation v = validate(request);
  INFO(to_terminal_text(v));
  CHECK_THAT(v.subject, Contains("on an organ of 4 spheres"));
  for (const QuantityKind kind : {QuantityKind::peak, QuantityKind::end_of_hold}) {
    const QuantityComparison& q = test::study_quantity(v.recordings.front(), kind);
    const QuantityComparison& l = test::study_quantity(by_law.recordings.front(), kind);
    // The star is the law's own network: what differs is the fit of its bonds.
    CHECK_THAT(q.simulated, WithinRel(l.simulated, 0.01));
    CHECK_THAT(q.u_input, WithinRel(l.u_input, 0.2));
    CHECK(q.u_num > 0.0);
    CHECK(q.u_num < 2e-3 * q.simulated);
  }
  // A material 10 % stiffer is seen on the organ, too.
  request.recordings = {quiet_recording(1.1)};
  CHECK(validate(request).verdict == ModelVerdict::seen);
}

TEST_CASE("what the place of an organ's spheres does to a quantity is in u_num", "[validate]") {
  const LawFile law = quiet_law();
  std::vector<double> times;
  for (int i = 0; i <= 24; ++i) times.push_back(static_cast<double>(i));
  const OrganMaterial on_liver = put_on_organ(
      law, {motion_of_protocol(ramp_and_hold(4e-3, 1e-3, 20.0), times)},
      Json::parse(R"({"organ": {"kind": "liver", "count": 60}, "contacts": [{"kind": "sphere"}],
"anchors": [{"kind": "far_side", "fraction": 0.3}]})"),
      "test", {}, {});
  const OrganOfLaw organ = organ_of_law(on_liver, "test");
  const OtherFillings others = other_fillings(organ);
  INFO(others.words);
  REQUIRE(others.organs.size() == kOtherFillings);
  for (const auto& other : others.organs) {
    // The same body and number of spheres, in other places; the probe comes from the same side.
    CHECK(other->spheres() == organ.spheres());
    const Organ &a = other->spheres_of_scene(), &b = organ.spheres_of_scene();
    CHECK((a.position - b.position).norm() > 0.1 * b.spacing);
    const Eigen::Vector3d contact = a.position.col(static_cast<Eigen::Index>(*a.contact));
    CHECK((contact - b.position.col(static_cast<Eigen::Index>(*b.contact))).norm() < b.spacing);
  }
  ComparisonOptions options;
  options.organ = &organ;
  options.fillings = &others;
  options.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
  const PreparedRecording recording = quiet_recording(1.0);
  const RecordingComparison r = compare_with_recording(law, recording, options);
  options.fillings = nullptr;
  const RecordingComparison without = compare_with_recording(law, recording, options);
  // By hand: each filling's forces times the factor by which they come nearest to the organ's along
  // the motion at the calibration's depth; then the standard deviation of the six.
  const LawAlong along(law, recording, &organ);
  const std::vector<Eigen::VectorXd> forces = along.by_filling(others, r.placement.contact);
  REQUIRE(forces.size() == kOtherFillings + 1);
  for (std::size_t i = 0; i < 2; ++i) {
    const QuantityComparison &q = r.quantities[i], &bare = without.quantities[i];
    CAPTURE(q.name, q.u_num, bare.u_num);
    const double lattice = q.of_filling.norm();
    CHECK(lattice > 0.0);
    CHECK(lattice < 0.05 * q.simulated);
    CHECK_THAT(q.u_num, WithinRel(std::hypot(lattice, bare.u_num), 1e-9));
    CHECK(q.numerical.front().name == "the place of the spheres");
    CHECK(q.e.coverage > bare.e.coverage);  // six values tell a scatter with five degrees
    std::vector<double> s;
    for (const Eigen::VectorXd& f : forces) {
      s.push_back(
          read_quantity(options.quantities[i], r.parts, recording.recording, r.placement.contact, f)
              .value()
              .value);
    }
    double mean = 0.0, square = 0.0;
    for (const double v : s) mean += v / 6.0;
    for (const double v : s) square += (v - mean) * (v - mean) / 5.0;
    CHECK_THAT(std::sqrt(square), WithinRel(lattice, 1e-6));
  }
  // Two recordings share it: it does not shrink with their number.
  ValidationRequest request = request_for(law, recording);
  request.recordings.push_back(quiet_recording(1.0, 6));
  request.organ = std::shared_ptr<const OrganOfLaw>(new OrganOfLaw(organ_of_law(on_liver, "test")));
  const Validation both = validate(request);
  REQUIRE_FALSE(both.pooled.empty());
  CHECK(both.pooled.front().u_shared >= 0.99 * r.quantities.front().of_filling.norm());
  CHECK_THAT(to_terminal_text(both), Contains("5 other fillings of the body"));
  CHECK_THAT(to_json(both).at("recordings").at(0).at("u_num_of_spheres").get<std::string>(),
             Contains("5 other fillings"));
}

TEST_CASE("an organ without another filling says so", "[validate]") {
  const LawFile law = quiet_law();
  ValidationRequest request = request_for(law, quiet_recording(1.0));
  request.organ =
      std::shared_ptr<const OrganOfLaw>(new OrganOfLaw(organ_of_law(star_of(law), "test")));
  CHECK_THAT(to_terminal_text(validate(request)),
             Contains("without the effect of the places of the spheres: a star"));
}

TEST_CASE("bonds that keep the law's relaxation times hide none of their uncertainty",
          "[validate]") {
  const LawFile law = quiet_law();
  ValidationRequest request = request_for(law, quiet_recording(1.0));
  request.quantities = {
      {QuantityKind::end_of_hold}, {QuantityKind::relaxation_ratio}, {QuantityKind::half_time}};
  const Validation by_law = validate(request);
  request.organ = std::shared_ptr<const OrganOfLaw>(
      new OrganOfLaw(organ_of_law(star_with(law, false), "test")));
  REQUIRE_FALSE(request.organ->times_follow());
  const Validation v = validate(request);
  INFO(to_terminal_text(v));
  for (std::size_t i = 0; i < 3; ++i) {
    CAPTURE(v.recordings.front().quantities[i].name);
    CHECK_THAT(v.recordings.front().quantities[i].u_input,
               WithinRel(by_law.recordings.front().quantities[i].u_input, 0.1));
  }
  CHECK_THAT(v.u_input_from, Contains("which the bonds keep"));
}

TEST_CASE("a pick answers in place of its organ, and its claim is a limit", "[validate]") {
  const LawFile law = quiet_law();
  const OrganOfLaw organ = organ_of_law(star_of(law), "test");
  ComparisonOptions options;
  options.organ = &organ;
  options.quantities = {{QuantityKind::end_of_hold}};
  const PreparedRecording recording = quiet_recording(1.0);
  const QuantityComparison full =
      compare_with_recording(law, recording, options).quantities.front();
  options.pick = [&organ](const Protocol& motion, const std::vector<double>& times_s) {
    const LawFile plain = at_surface(organ.law());
    return PickedAnswer{
        "made", 1.02 * organ.respond(motion, times_s, plain.values, Want::values).value, 5e-3};
  };
  const RecordingComparison r = compare_with_recording(law, recording, options);
  CHECK(r.pick == "made");
  const QuantityComparison& q = r.quantities.front();
  CHECK_THAT(q.simulated, WithinRel(1.02 * full.simulated, 1e-4));
  // A mean of readings: a limit of 5 mN is 5 mN / sqrt 3.
  CHECK_THAT(q.u_num, WithinRel(std::hypot(5e-3 / std::numbers::sqrt3, full.u_num), 1e-3));
}

TEST_CASE("what a session's rendering changes is part of S, its scatter of u_num", "[validate]") {
  const LawFile law = quiet_law();
  ValidationRequest request = request_for(law, quiet_recording(1.0));
  request.quantities = {{QuantityKind::end_of_hold}};
  const Validation plain = validate(request);
  request.rendering = {{{QuantityKind::end_of_hold}, 0.03, 0.01, 4}};
  request.session = "made.tpmrec";
  const Validation v = validate(request);
  const QuantityComparison& a = plain.recordings.front().quantities.front();
  const QuantityComparison& b = v.recordings.front().quantities.front();
  CHECK_THAT(b.simulated, WithinRel(1.03 * a.simulated, 1e-12));
  CHECK_THAT(b.u_num, WithinRel(0.01 * a.simulated / std::numbers::sqrt3, 1e-6));
  CHECK_THAT(to_terminal_text(v), Contains("made.tpmrec") && Contains("4 presses"));
}

}  // namespace tpm::fit
