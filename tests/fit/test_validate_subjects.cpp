// tpm validate beyond one law on one ramp: grids, creep, organs, picks of plans, rendering, copies
// of fitted data, requirements, and what an instrument adds.
#include <catch2/catch.hpp>
#include <cmath>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/fit/predict/organ_prediction.hpp"
#include "tpm/fit/sample_digest.hpp"
#include "tpm/fit/select/instrument_of_recording.hpp"
#include "tpm/fit/validate/fitted_copy.hpp"
#include "tpm/fit/validate/grid_convergence.hpp"
#include "validation_studies.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

LawFile quiet_law() {
  Random random(3);
  test::StudyNoise noise;
  noise.sigma_N = 2e-4;
  return test::study_calibration(1, noise, random);
}

PreparedRecording quiet_recording(double stiffer, std::uint64_t seed = 5) {
  Random random(seed);
  test::StudyNoise noise;
  noise.sigma_N = 2e-4;
  return prepare_recording("validation", test::study_recording(test::study_validation(200, 0.0),
                                                               noise, random, stiffer));
}

/// 0.1 N within 1 s on the material of the studies, held for 20 s; depths scatter by 2 um.
PreparedRecording creep_recording(const LawFile& law, double stiffer, std::uint64_t seed) {
  Recording r;
  r.header.id = "creep";
  r.drive_quantity = Quantity::load;
  r.response_quantity = Quantity::indentation_depth;
  for (int i = 0; i <= 500; ++i) {
    const double t = 0.05 * i;
    r.time_s.push_back(t);
    r.drive.push_back(0.1 * std::clamp(t - 4.0, 0.0, 1.0));
  }
  Protocol load = measured_history(Drive::force, r.time_s, r.drive);
  load.set_equilibrium_at_start(true);
  std::vector<double> values{60.0, 45.0, 2.0, 0.0, 0.0};
  const Response depth = LawModel(law.spec).respond(load, r.time_s, values, Want::values);
  Random random(seed);
  for (const double d : depth.value)
    r.response.push_back(d / stiffer + 2e-6 * random.normal() + 3e-5);
  PreparedRecording prepared;
  prepared.name = "creep";
  prepared.recording = std::move(r);
  prepared.to_s = prepared.recording.time_s.back();
  return prepared;
}

ValidationRequest request_for(const LawFile& law, PreparedRecording recording) {
  ValidationRequest request;
  request.law_file = "law.json";
  request.law = law;
  request.recordings = {std::move(recording)};
  return request;
}

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

TEST_CASE("creep has depth, ratio, half time and rate of the curve", "[validate]") {
  // Depth 1 mm + 0.1 mm/s (t - corner) on a load that ends its ramp at 5 s.
  PreparedRecording r = creep_recording(quiet_law(), 1.0, 4);
  Eigen::VectorXd curve(501);
  for (int i = 0; i <= 500; ++i) curve[i] = 1e-3 + 1e-4 * std::max(0.05 * i - 5.0, 0.0);
  const RecordingParts parts = parts_of(r);
  REQUIRE(parts.has_hold());
  CHECK_THAT(parts.corner_s, WithinAbs(5.0, 1e-9));
  const auto read = [&](QuantityKind kind) {
    return read_quantity({kind}, parts, r.recording, 0.0, curve).value().value;
  };
  CHECK_THAT(read(QuantityKind::peak), WithinRel(1e-3, 1e-9));
  CHECK_THAT(read(QuantityKind::rate), WithinRel(1e-4, 1e-9));
  const double end = 1e-3 + 1e-4 * 19.0;  // mean of the last 2 s of 20 s
  CHECK_THAT(read(QuantityKind::end_of_hold), WithinRel(end, 1e-9));
  CHECK_THAT(read(QuantityKind::half_time), WithinRel(9.5, 1e-6));
  CHECK(quantity_words({QuantityKind::peak}, Quantity::load, Quantity::indentation_depth) ==
        "depth at the corner");
}

TEST_CASE("creep of the same material is as predicted, of a stiffer one it is not", "[validate]") {
  const LawFile law = quiet_law();
  const Validation same = validate(request_for(law, creep_recording(law, 1.0, 5)));
  INFO(to_terminal_text(same));
  CHECK(same.verdict == ModelVerdict::not_seen);
  CHECK(same.recordings.front().creep);
  CHECK(same.recordings.front().quantities.size() == 5);
  ValidationRequest stiff = request_for(law, creep_recording(law, 1.1, 6));
  stiff.requirement = parse_requirement("0.4 mm", "test");
  const Validation other = validate(stiff);
  const QuantityComparison& end =
      test::study_quantity(other.recordings.front(), QuantityKind::end_of_hold);
  // S = 0.1 N / 60 N/m, D that over 1.1.
  CHECK_THAT(end.e.error, WithinAbs((0.1 / 60.0) * (1.0 - 1.0 / 1.1), 3.0 * end.e.u_val + 1e-6));
  CHECK(end.verdict == ModelVerdict::adequate);
  CHECK(validate(request_for(law, creep_recording(law, 1.1, 6))).verdict == ModelVerdict::seen);
}

TEST_CASE("the text takes 25 lines at most and ends in the verdict", "[validate]") {
  const LawFile law = quiet_law();
  const auto lines_of = [](const Validation& v) {
    const std::string text = to_terminal_text(v);
    INFO(text);
    CHECK(text.ends_with("\n"));
    // The verdict is the last item, of three lines at most.
    const auto verdict = text.rfind("\nverdict        ");
    REQUIRE(verdict != std::string::npos);
    CHECK(std::count(text.begin() + static_cast<std::ptrdiff_t>(verdict), text.end(), '\n') <= 4);
    const auto lines = std::count(text.begin(), text.end(), '\n');
    CHECK(lines <= 25);
    CHECK((to_json(v)["recordings"].size() == v.recordings.size()));
    return lines;
  };
  SECTION("creep with five undetermined quantities") {
    PreparedRecording creep = creep_recording(law, 1.0, 5);
    // No reading before the load tells the depth without one.
    Recording& r = creep.recording;
    const std::ptrdiff_t rest = 80;
    r.time_s.erase(r.time_s.begin(), r.time_s.begin() + rest);
    r.drive.erase(r.drive.begin(), r.drive.begin() + rest);
    r.response.erase(r.response.begin(), r.response.begin() + rest);
    r.drive.front() = 0.01;
    ValidationRequest request = request_for(law, creep);
    request.requirement = parse_requirement("0.000001%", "test");
    for (int i = 0; i < 8; ++i) request.remarks.push_back("something that is to be said with it");
    const Validation v = validate(request);
    CHECK(v.recordings.front().quantities.size() == 5);
    CHECK(std::ranges::all_of(v.recordings.front().quantities, [](const QuantityComparison& q) {
      return q.verdict == ModelVerdict::undetermined || q.remark.empty();
    }));
    (void)lines_of(v);
  }
  SECTION("thirty quantities, each with a remark of its own") {
    ValidationRequest request = request_for(law, quiet_recording(1.0));
    for (int i = 0; i < 30; ++i) {
      request.quantities.push_back({QuantityKind::at_time, 20.5 + 0.5 * i});
    }
    request.requirement = parse_requirement("0.1%", "test");
    const Validation v = validate(request);
    CHECK(lines_of(v) == 25);
    CHECK_THAT(to_terminal_text(v), Contains("left out") && Contains("quantities ("));
  }
  SECTION("forty recordings with long names") {
    ValidationRequest request = request_for(law, quiet_recording(1.0, 1));
    for (std::uint64_t i = 2; i <= 40; ++i) {
      request.recordings.push_back(quiet_recording(1.0, i));
      request.recordings.back().name = std::string(60, 'a') + std::to_string(i);
    }
    const Validation v = validate(request);
    CHECK(lines_of(v) >= 24);
    CHECK_THAT(to_terminal_text(v), Contains("recordings (") && !Contains("aaa9"));
  }
  SECTION("an ordinary answer is printed whole") {
    const Validation v = validate(request_for(law, quiet_recording(1.05)));
    CHECK(lines_of(v) < 25);
    CHECK_THAT(to_terminal_text(v), !Contains("left out"));
  }
}

TEST_CASE("a requirement in the unit of nothing is refused, also of fitted data", "[validate]") {
  const LawFile law = quiet_law();
  ValidationRequest request = request_for(law, quiet_recording(1.0));
  request.requirement = parse_requirement("20 mm", "--require");
  const auto refused = [&request] { (void)validate(request); };
  CHECK_THAT(test::refusal_of(refused), Contains("the unit of no quantity") && Contains("in N"));
  request.recordings.front().recording.header.sha256 = "abc";
  request.calibration.files.push_back({"fitted.csv", "abc", std::nullopt, ""});
  CHECK_THAT(test::refusal_of(refused), Contains("the unit of no quantity"));
}

TEST_CASE("what a hand can tell is asked of forces alone", "[validate]") {
  ValidationRequest request = request_for(quiet_law(), quiet_recording(1.02));
  request.requirement = parse_requirement("jnd", "--require");
  const Validation v = validate(request);
  for (const QuantityComparison& q : v.recordings.front().quantities) {
    const bool force = q.unit.symbol == "N";
    CHECK(q.limit.has_value() == force);
    CHECK((q.verdict == ModelVerdict::no_requirement) == !force);
    if (force) CHECK_THAT(*q.limit, WithinRel(0.07 * q.measured, 1e-12));
  }
  CHECK(v.verdict == ModelVerdict::adequate);
}

TEST_CASE("a renamed and resaved copy of fitted data gets no verdict", "[validate]") {
  const PreparedRecording fitted = prepare_recording("fitted.csv", quiet_recording(1.0).recording);
  SetupOptions setup;
  setup.profiles = false;
  setup.starts = 2;
  const std::vector<PreparedRecording> data{fitted};
  const FitResult fit = run_fit(recording_config(test::study_law(), data, setup), data_sets(data));
  const Json document = law_document(fit);
  const std::vector<std::string> digests = sample_digests(document);
  REQUIRE(digests.size() == 1);
  PreparedRecording copy = fitted;
  copy.name = "another.csv";
  copy.recording.header.sha256 = "of other bytes";
  for (double& f : copy.recording.response) f *= 1.0 + 1e-15;  // units back and forth
  CHECK(samples_sha256(copy.recording) == digests.front());
  ValidationRequest request = request_for(fitted_law(fit), copy);
  request.calibration = find_calibration(request.law, "nowhere/law.json", digests,
                                         [](const std::string&) { return PreparedRecording(); });
  CHECK(validate(request).verdict == ModelVerdict::residual);
  request.recordings.front().recording.response[100] += 1e-6;
  CHECK(validate(request).verdict != ModelVerdict::residual);
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

TEST_CASE("parts of fitted data get no verdict, whatever was done to them", "[validate]") {
  // 2 mN of scatter.
  Random random(8);
  const test::StudyNoise noise;
  const PreparedRecording fitted =
      prepare_recording("fitted.csv", test::study_recording({}, noise, random));
  const PreparedRecording other =
      prepare_recording("other.csv", test::study_recording({}, noise, random));
  const LawFile law = test::study_fit({fitted});
  ValidationRequest request = request_for(law, other);
  request.calibration.files.push_back({"fitted.csv", "of the bytes", fitted, ""});
  // The same protocol, readings of its own.
  CHECK(share_of_readings(other.recording, fitted.recording, noise.sigma_N) < 0.1);
  CHECK(validate(request).verdict != ModelVerdict::residual);
  const auto refused = [&](const char* what, const auto& change) {
    Recording r;
    for (std::size_t i = 0; i < fitted.recording.time_s.size(); ++i) {
      double t = fitted.recording.time_s[i], d = fitted.recording.drive[i],
             f = fitted.recording.response[i];
      if (!change(i, t, d, f)) continue;
      r.time_s.push_back(t);
      r.drive.push_back(d);
      r.response.push_back(f);
    }
    request.recordings = {prepare_recording("copy.csv", std::move(r))};
    const Validation v = validate(request);
    CAPTURE(what, to_terminal_text(v),
            share_of_readings(request.recordings.front().recording, fitted.recording,
                              v.recordings.front().scatter.sigma));
    CHECK(v.verdict == ModelVerdict::residual);
    REQUIRE(v.remarks.size() == 1);
    CHECK_THAT(v.remarks.front(), Contains("those of fitted.csv"));
  };
  refused("cut", [](std::size_t i, double&, double&, double&) { return i > 20 && i < 200; });
  refused("later", [](std::size_t, double& t, double&, double&) {
    t += 7.3;
    return true;
  });
  refused("thinned out", [](std::size_t i, double&, double&, double&) { return i % 2 == 0; });
  refused("sampled again between its samples", [&](std::size_t i, double& t, double& d, double& f) {
    const Recording& r = fitted.recording;
    if (i + 1 == r.time_s.size()) return false;
    t = std::lerp(t, r.time_s[i + 1], 0.3);
    d = std::lerp(d, r.drive[i + 1], 0.3);
    f = std::lerp(f, r.response[i + 1], 0.3);
    return true;
  });
  refused("rounded", [](std::size_t, double&, double&, double& f) {
    f = 1e-5 * std::round(1e5 * f);
    return true;
  });
  refused("half of it replaced", [&](std::size_t i, double&, double&, double& f) {
    if (i % 5 < 2) f = other.recording.response[i];
    return true;
  });
}

TEST_CASE("a drift of the zero that the rest tells is no model error", "[validate]") {
  const LawFile law = quiet_law();
  const test::StudyNoise noise;  // 2 mN
  const auto with_drift = [&](double per_s, std::uint64_t seed) {
    Random random(seed);
    Recording r = test::study_recording(test::study_validation(200, 0.0), noise, random);
    for (std::size_t i = 0; i < r.time_s.size(); ++i) r.response[i] += per_s * r.time_s[i];
    return prepare_recording("drifting", std::move(r));
  };
  int covered = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Validation v = validate(request_for(law, with_drift(1e-3, seed)));
    const RecordingComparison& r = v.recordings.front();
    REQUIRE(r.placement.drift);
    CHECK_THAT(r.placement.drift->per_s, WithinAbs(1e-3, 4.0 * r.placement.drift->u_per_s));
    const QuantityComparison& q = test::study_quantity(r, QuantityKind::end_of_hold);
    // By hand: u of the slope times the time from the middle of the rest to the middle of the last
    // tenth of the hold.
    const auto part = std::ranges::find(q.parts, "the drift of the zero", &UncertaintyPart::name);
    REQUIRE(part != q.parts.end());
    const double lever_s = 19.9 + 0.75 + 19.0 - r.placement.drift->origin_s;
    CHECK_THAT(part->u, WithinRel(r.placement.drift->u_per_s * lever_s, 0.02));
    covered += std::abs(q.e.error) <= q.e.expanded();
    if (seed == 1) {
      CHECK_THAT(to_terminal_text(v), Contains("taken out"));
      CHECK(to_json(v).at("recordings").at(0).at("placement").contains("zero_drift_per_s"));
    }
  }
  CHECK(covered >= 17);  // fewer of 20 at 95 %: one run in 40
  CHECK_FALSE(validate(request_for(law, with_drift(0.0, 2))).recordings.front().placement.drift);
}

TEST_CASE("a force in the wrong unit is a model error with a hint", "[validate]") {
  const LawFile law = quiet_law();
  PreparedRecording wrong = quiet_recording(1.0);
  for (double& f : wrong.recording.response) f *= 1e3;
  const Validation v = validate(request_for(law, wrong));
  CHECK(v.verdict == ModelVerdict::seen);
  CHECK_THAT(to_terminal_text(v), Contains("1e+03 times S") && Contains("units"));
  CHECK(validate(request_for(law, quiet_recording(1.5))).remarks.empty());
}

TEST_CASE("a force that is counted negative is refused, not called a model error", "[validate]") {
  PreparedRecording turned = quiet_recording(1.0);
  for (double& f : turned.recording.response) f = -f;
  turned = prepare_recording("turned.csv", turned.recording);
  const LawFile law = quiet_law();
  CHECK_THAT(test::refusal_of([&] { (void)validate(request_for(law, turned)); }),
             Contains("--negate-response"));
}

TEST_CASE("a verdict on several recordings counts what only one of them has", "[validate]") {
  const LawFile law = quiet_law();
  ValidationRequest request = request_for(law, quiet_recording(1.0));
  // The first one ends with its ramp: it has no hold to differ in.
  Recording ramp = quiet_recording(1.0, 6).recording;
  const auto corner = std::ranges::max_element(ramp.drive) - ramp.drive.begin();
  for (auto* column : {&ramp.time_s, &ramp.drive, &ramp.response}) {
    column->resize(static_cast<std::size_t>(corner) + 1);
  }
  request.recordings.insert(request.recordings.begin(), prepare_recording("ramp", ramp));
  request.requirement = parse_requirement("5%", "test");
  request.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
  const Validation right = validate(request);
  INFO(to_terminal_text(right));
  CHECK(right.pooled.size() == 1);
  REQUIRE(right.alone.size() == 1);
  CHECK(right.verdict == ModelVerdict::adequate);
  // The hold of the other sinks by a fifth in its course, its peak does not.
  Recording& sunk = request.recordings.back().recording;
  const auto peak =
      static_cast<std::size_t>(std::ranges::max_element(sunk.response) - sunk.response.begin());
  const auto rest = static_cast<double>(sunk.response.size() - peak);
  for (std::size_t i = peak; i < sunk.response.size(); ++i) {
    sunk.response[i] *= 1.0 - 0.2 * static_cast<double>(i - peak) / rest;
  }
  const Validation wrong = validate(request);
  INFO(to_terminal_text(wrong));
  CHECK(wrong.verdict == ModelVerdict::not_adequate);
  CHECK_THAT(conclusion_words(wrong), Contains("force at end of hold"));
  CHECK(to_json(wrong).at("in_one_only").size() == 1);
}

TEST_CASE("the whole curve expects what the instrument may be off by", "[validate]") {
  const LawFile law = quiet_law();
  ValidationRequest request = request_for(law, quiet_recording(1.0));
  const double without = validate(request).recordings.front().curve.mean_square_u;
  Instrument cell;
  cell.id = "cell";
  cell.force = ChannelUncertainty{0.01, 0.0};
  request.instruments = {cell};
  const RecordingComparison r = validate(request).recordings.front();
  // 1 % of the readings: D's part alone, for the calibration's instrument is not stated.
  double square = 0.0;
  std::size_t count = 0;
  const std::vector<double>& f = request.recordings.front().recording.response;
  for (std::size_t i = r.parts.ramp_first; i <= *r.parts.hold_last; ++i, ++count) {
    square += std::pow(0.01 * (f[i] - r.placement.zero), 2);
  }
  CHECK_THAT(r.curve.mean_square_u - without, WithinRel(square / static_cast<double>(count), 1e-6));
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

TEST_CASE("an instrument is stated once, and fits and budgets take it", "[validate]") {
  const test::TempFolder folder;
  write_file(folder / "r.json",
             R"j({"instrument": {"id": "cell", "force": "1 % of reading (standard)",
                 "depth": "20 um (standard)", "zero": "3 mN (standard)", "resolution": "12 mN",
                 "noise": "0.1 mN"}})j");
  PreparedRecording recording = quiet_recording(1.0);
  take_instrument(recording, folder / "r.csv");
  REQUIRE(recording.instrument);
  CHECK_THAT(recording.instrument->reading_floor(), WithinRel(0.012 / std::sqrt(12.0), 1e-12));
  REQUIRE_FALSE(recording.warnings.empty());
  CHECK_THAT(recording.warnings.back(), Contains("gain of instrument cell"));
  // No reading is known better than its step.
  CHECK_THAT(scatter_of(recording, parts_of(recording)).sigma,
             WithinRel(0.012 / std::sqrt(12.0), 1e-12));
  // The budget at the end of the ramp: 1 % of 300 mN, 3 mN, and 20 um of 105 N/m.
  LawFile law = quiet_law();
  law.values = {60.0, 45.0, 2.0, 0.0, 0.0};
  const ErrorBudget budget = contact_budget(law, recording, {});
  REQUIRE(budget.instrument);
  const double peak = budget.peak_N;
  const double u = std::hypot(0.01 * peak, 3e-3, 20e-6 * 105.0);
  CHECK_THAT(budget.instrument->largest, WithinRel(1.959964 * u / peak, 0.03));
  CHECK(budget.data_part >= budget.instrument->largest);
  CHECK_THAT(to_terminal_text(budget), Contains("instrument cell, 95 %"));
}

TEST_CASE("without readings before contact a fit's zero is what the instrument states",
          "[validate]") {
  Random random(11);
  test::StudyNoise noise;
  noise.sigma_N = 2e-4;
  test::StudyTest slow;
  slow.rate_mm_per_s = 0.5;
  Recording cut = test::study_recording(slow, noise, random);
  constexpr std::ptrdiff_t kGone = 42;
  for (auto* column : {&cut.time_s, &cut.drive, &cut.response}) {
    column->erase(column->begin(), column->begin() + kGone);
  }
  PreparedRecording recording = prepare_recording("cut", cut);
  recording.instrument = Instrument{};
  recording.instrument->id = "cell";
  recording.instrument->zero = 1.5e-3;
  const FitConfig config = recording_config(test::study_law(), {&recording, 1}, {});
  const auto zero = std::ranges::find_if(
      config.parameters, [](const EstimatedParameter& p) { return p.fit.name == "offset"; });
  REQUIRE(zero != config.parameters.end());
  REQUIRE(zero->prior);
  CHECK(zero->prior->sd == 1.5e-3);
  CHECK_THAT(zero->prior->from, Contains("stated by instrument cell"));
}

}  // namespace tpm::fit
