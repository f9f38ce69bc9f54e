// A law felt at one contact: against the law's own answer, without a heap, passive, in sessions.
#include <fmt/format.h>
#include <catch2/catch.hpp>
#include <cmath>

#include "counted_allocations.hpp"
#include "expected_values.hpp"
#include "hil_scenes.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/contact/law_contact.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/verify/law_reference.hpp"
#include "tpm/haptics/verify/verify.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::contact {
using namespace haptics;

namespace {

using Catch::Matchers::Contains;

LawFile law_of(const std::string& name) {
  LawFile law;
  law.spec = parse_law_name(name, "test");
  law.spec.reference = 4e-3;
  int branch = 0;
  for (const LawParameter& p : law_parameters(law.spec)) {
    const double tau = 0.05 * std::pow(12.0, branch);
    if (p.dimension == Dimension::time) ++branch;
    law.values.push_back(p.name == "alpha"                     ? 0.35
                         : p.name == "beta"                    ? 0.1
                         : p.name == "exponent"                ? 1.9
                         : p.name == "tension_share"           ? 0.3
                         : p.name == "spacing"                 ? 0.02
                         : p.dimension == Dimension::time      ? tau
                         : p.nuisance                          ? 0.0
                         : p.dimension == Dimension::stiffness ? 60.0
                                                               : p.preset.value_or(1.0));
  }
  law.provenance = Provenance::assumed;
  return law;
}

/// In and out again without leaving the surface: 1 mm at 5 Hz about a slow ramp to 3 mm.
double depth_at(double t) {
  return 3e-3 * std::min(t, 1.0) + 4e-4 * std::sin(10.0 * M_PI * t) * std::min(t, 1.0);
}

/// Largest distance of the loop's force from the law's, in parts of the peak.
double off_the_law(const LawFile& law, double period_s, double end_s) {
  LawContact contact(
      law, {.period_s = period_s, .longest_s = end_s, .deepest_m = 4e-3, .deepest_valid_m = 5e-3});
  std::vector<double> time, depth, force;
  for (int i = 0; i * period_s <= end_s; ++i) {
    time.push_back(i * period_s);
    depth.push_back(depth_at(time.back()));
    const ContactAnswer answer = contact.step(Eigen::Vector3d(0.0, 0.0, depth.back()));
    CHECK(answer.valid);
    force.push_back(-answer.force_N.z());
  }
  const LawModel model(law.spec);
  const auto exact = model.respond(measured_history(Drive::displacement, time, depth), time,
                                   law.values, Want::values);
  double peak = 0.0, off = 0.0;
  for (std::size_t i = 0; i < time.size(); ++i) {
    const double f = exact.value[static_cast<Eigen::Index>(i)];
    REQUIRE(std::isfinite(f));
    peak = std::max(peak, std::abs(f));
    off = std::max(off, std::abs(f - force[i]));
  }
  return off / peak;
}

constexpr const char* kLaws[] = {"linear",           "linear-1",           "linear-5",
                                 "linear-2-series",  "linear-1-elastic",   "linear-2-relaxing",
                                 "power-2",          "power-2-elastic",    "linear-fzener",
                                 "linear-fmaxwell2", "power-fkelvin_voigt"};

TEST_CASE("The loop answers as the law does, whatever its kernel and branches") {
  for (const char* name : kLaws) {
    INFO(name);
    CHECK(off_the_law(law_of(name), 1e-3, 3.0) < test::allowed_error("law_contact.against_law"));
  }
}

TEST_CASE("Curved kernels cost an error that falls with the square of the period") {
  const LawFile law = law_of("power-2");
  const double coarse = off_the_law(law, 4e-3, 2.0), fine = off_the_law(law, 2e-3, 2.0);
  CHECK(coarse > 1e-8);
  CHECK(coarse / fine == Approx(4.0).epsilon(0.15));
}

TEST_CASE("Forty branches are stepped without a call of the heap") {
  LawContact contact(law_of("power-40-elastic"), {});
  const testing::HeapWatch heap;
  for (int i = 0; i < 1000; ++i) (void)contact.step(Eigen::Vector3d(0.0, 0.0, 1e-6 * i));
  contact.reset();
  CHECK(heap.calls() == 0);
  CHECK(contact.relaxation_times_s().size() == 2);
}

TEST_CASE("No closed path of a relaxing contact gives energy") {
  for (const char* name : {"linear-2", "power-2", "hertz-3", "linear-2-relaxing"}) {
    INFO(name);
    const LawFile law = law_of(name);
    LawContact contact(law, {});
    Random random(5);
    double depth = 0.0, work = 0.0, force = 0.0, most = 0.0;
    for (int i = 0; i < 200000; ++i) {
      const double to = std::clamp(depth + 2e-5 * random.normal(), 0.0, 4e-3);
      const double next = -contact.step(Eigen::Vector3d(0.0, 0.0, to)).force_N.z();
      work += 0.5 * (force + next) * (to - depth);
      most = std::max(most, work);
      depth = to;
      force = next;
      // What may be had back is what is stored, never more than was put in.
      if (!(work > -1e-12)) FAIL("work of the hand " << work << " J after " << i << " steps");
    }
    CHECK(most > 1e-3);
  }
}

TEST_CASE("Two quadratures of a law agree, where the surface lets go too") {
  std::vector<double> time, depth;
  for (int i = 0; i <= 4000; ++i) {
    time.push_back(1e-3 * i);
    depth.push_back(3e-3 * std::sin(2.0 * M_PI * time.back()));
  }
  for (const char* name : {"linear-2", "power-2-elastic"}) {
    INFO(name);
    const LawFile law = law_of(name);
    const auto gauss = law_forces_by_gauss(law, time, depth);
    const auto model = LawModel(law.spec).respond(
        measured_history(Drive::displacement, time, depth), time, law.values, Want::values);
    double peak = 0.0, apart = 0.0;
    for (std::size_t i = 0; i < time.size(); ++i) {
      peak = std::max(peak, gauss[i]);
      apart = std::max(apart, std::abs(gauss[i] - model.value[static_cast<Eigen::Index>(i)]));
    }
    // Where it lets go within a stretch, to the length of a stretch.
    CHECK(apart < test::allowed_error("law_contact.quadratures_apart") * peak);
  }
  CHECK_THROWS_WITH(law_forces_by_gauss(law_of("linear-fzener"), time, depth),
                    Contains("a law with branches"));
}

Json law_session(const std::string& law, double fitted_to_m = 4e-3) {
  Json json = test::short_session();
  LawFile file = law_of(law);
  file.fitted_to = fitted_to_m;
  json["model"] = {{"kind", "law"}, {"law", to_json(file)}};
  return json;
}

Verification verified(const HilSession& session, const test::TempFolder& folder,
                      const std::string& device = "virtual") {
  SessionRunOptions options;
  options.recording = folder / "s.tpmrec";
  DeviceChoice choice;
  choice.kind = device;
  const SessionRun run = run_session(session, choice, options);
  CHECK(run.outcome.cause == StopCause::finished);
  CHECK(run.outcome.counts.beyond_model == 0);
  return verify(read_recording(options.recording));
}

TEST_CASE("A law is felt in a session, and what is felt is the law") {
  for (const char* name : {"linear-2-relaxing", "power-2", "hertz-2", "linear-fzener"}) {
    INFO(name);
    const test::TempFolder folder;
    const Verification v = verified(test::parsed(law_session(name)), folder);
    CHECK(v.all.peak_N > 0.05);
    CHECK(v.all.max_N < test::allowed_error("session.law") * v.all.peak_N);
    CHECK(v.reference_error_N < test::allowed_error("session.law_reference") * v.all.peak_N);
  }
}

TEST_CASE("A law is refused where it cannot be felt") {
  const auto refused = [](const Json& json) {
    return test::refusal_of([&] { (void)make_loop_model(test::parsed(json)); });
  };
  const Json session = law_session("linear-1");
  CHECK_THAT(refused(law_session("linear-1", 2e-3)),
             Contains("goes to a depth of 4 mm, the law was fitted to 2 mm; expected 2.4 mm"));
  Json json = session;
  json["model"].erase("law");
  CHECK_THAT(refused(json), Contains("no key 'law'"));
  json["model"]["scene"] = test::short_session().at("model").at("scene");
  CHECK_THAT(refused(json), Contains("/model/scene: is not for the kind 'law'"));
  json = session;
  json["model"]["kind"] = "element";
  CHECK_THAT(refused(json), Contains("/model/law: is not for the kind 'element'"));
  json = session;
  json["model"]["law"]["drive"] = "relative_length";
  json["model"]["law"]["response"] = "stress";
  json["model"]["law"].erase("reference_m");
  json["model"]["law"].erase("fitted_to_m");
  json["model"]["law"]["reference"] = 1.0;
  json["model"]["law"]["parameters"] = {{"k_inf_Pa", 1e3}, {"k1_Pa", 1e3}, {"tau1_s", 1.0}};
  CHECK_THAT(refused(json), Contains("a contact force over an indentation depth"));
  json = test::short_session();
  json["motion"] = {{"recording", "r.csv"}};
  CHECK_THAT(refused(json), Contains("motion: is for the model 'law' only"));
}

TEST_CASE("The motion of a recording is repeated, and the recording stands beside the loop") {
  const test::TempFolder folder;
  LawFile law = law_of("power-2");
  const LawModel model(law.spec);
  law.values[model.index("offset")] = 0.05;
  for (const double contact_m : {1e-3, -1e-3}) {  // touched on the way; touching from the start
    INFO(contact_m);
    law.values[model.index("contact")] = contact_m;
    law.fitted_to = 4e-3;
    std::vector<double> time, depth;
    for (int i = 0; i <= 400; ++i) {
      time.push_back(0.01 * i);
      depth.push_back(std::min(2e-3 * time.back(), 3e-3));
    }
    Protocol history = measured_history(Drive::displacement, time, depth);
    history.set_equilibrium_at_start(true);
    const auto force = model.respond(history, time, law.values, Want::values).value;
    std::string csv = "time [s],depth [m],force [N]\n";
    for (std::size_t i = 0; i < time.size(); ++i) {
      csv += fmt::format("{},{},{}\n", time[i], depth[i], force[static_cast<Eigen::Index>(i)]);
    }
    write_file(folder / "r.csv", csv);
    write_law(folder / "law.json", law);
    write_file(folder / "session.json", to_text(test::short_session()));
    const HilSession session = read_session(
        folder / "session.json", {.law = folder / "law.json", .motion = folder / "r.csv"});
    const Verification v = verified(session, folder, "replay");
    CHECK(v.all.max_N < test::allowed_error("session.replay") * v.all.peak_N);
    const CrossCheck& beside = v.others.back();
    CHECK_THAT(beside.name, Contains("MEASURED: the recording r.csv"));
    CHECK(beside.commanded.instants == 4000);
    // The offset is not rendered; what is left is a straight line between samples, most at the
    // bend.
    CHECK(beside.commanded.max_N <
          test::allowed_error("session.replay_beside_recording") * v.all.peak_N);
    CHECK(beside.commanded.rms_N <
          test::allowed_error("session.replay_beside_recording_rms") * v.all.peak_N);
    CHECK(beside.apart_N < test::allowed_error("session.replay_references_apart") * v.all.peak_N);
  }
  CHECK_THROWS_WITH(read_session(folder / "session.json", {.law = {}, .motion = folder / "r.csv"}),
                    Contains("the session feels no law"));
}

TEST_CASE("A motion and a law named in a call stand beside the caller, not beside the session") {
  const test::TempFolder folder;
  const std::filesystem::path caller = folder / "caller", sessions = folder / "sessions";
  std::filesystem::create_directories(caller);
  std::filesystem::create_directories(sessions);
  write_law((caller / "law.json").string(), law_of("power-2"));
  write_file((sessions / "session.json").string(), to_text(test::short_session()));
  const auto recording_to = [](double depth_m) {
    return fmt::format("time [s],depth [m],force [N]\n0,0,0\n1,{},0.3\n2,{},0.2\n", depth_m,
                       depth_m);
  };
  write_file((caller / "r.csv").string(), recording_to(2e-3));
  write_file((sessions / "r.csv").string(), recording_to(1e-3));  // of the same name
  write_file((sessions / "other.csv").string(), recording_to(1e-3));

  struct WorkingFolder {  // as if called from there
    explicit WorkingFolder(const std::filesystem::path& there) {
      std::filesystem::current_path(there);
    }
    WorkingFolder(const WorkingFolder&) = delete;
    WorkingFolder& operator=(const WorkingFolder&) = delete;
    ~WorkingFolder() {
      std::error_code ignored;
      std::filesystem::current_path(before, ignored);
    }
    std::filesystem::path before = std::filesystem::current_path();
  };
  const WorkingFolder inside(caller);
  const std::filesystem::path session = std::filesystem::path("..") / "sessions" / "session.json";
  const auto read = [&](const char* motion) {
    return read_session(session, {.law = "law.json", .motion = motion});
  };
  CHECK(deepest_asked_m(read("r.csv"), 0.0) == Approx(2e-3));
  CHECK(deepest_asked_m(read("../sessions/r.csv"), 0.0) == Approx(1e-3));
  CHECK_THAT(test::refusal_of([&] { (void)read("other.csv"); }), Contains("other.csv"));
}

}  // namespace
}  // namespace tpm::contact
