// The pages of tpm view hold what the files say: read back from the page's own text.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "hil_scenes.hpp"
#include "page_arrays.hpp"
#include "simulated_scene.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/fit/show/view_fit.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/show/view_file.hpp"
#include "tpm/organ/run/simulation_file.hpp"
#include "tpm/plan/show/simulation_report.hpp"

using namespace tpm;
using namespace tpm::haptics;
using Catch::Matchers::Contains;
using test::numbers;
using test::TempFolder;

namespace {

std::string recorded_session(const TempFolder& folder) {
  const HilSession session = test::parsed(test::short_session());
  SessionRunOptions options;
  options.recording = folder / "s.tpmrec";
  (void)run_session(session, DeviceChoice{}, options);
  return options.recording.string();
}

}  // namespace

TEST_CASE("the page of a result holds every state, to the precision of a float") {
  const TempFolder folder;
  const ExperimentScene scene = test::small_scene(
      R"("title": "a </script> title", "anchors": [{"kind": "far_side", "fraction": 0.3}],
         "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s", "hold": "1 s"},
         "outputs": {"count": 9})");
  const RunNetwork network = network_to_run(scene);
  const SimulationRun run = simulate(scene, network);
  const std::string file = folder / "r.h5";
  write_simulation(scene, network, run, file);
  const ViewPage page = view_file(file);
  const Json& organ = page.description.at("organ");
  const std::string html = page.html();
  CHECK(page.description.at("simulated") == true);
  CHECK_THAT(page.description.dump(), Contains(sha256_hex(read_file(file))));
  CHECK_THAT(html, !Contains("a </script> title"));
  const auto times = numbers<double>(html, organ.at("time_s"));
  const auto moved = numbers<float>(html, organ.at("displacement_m"));
  const std::vector<QuasiStaticState>& outputs = run.record.outputs;
  REQUIRE(times.size() == outputs.size());
  REQUIRE(moved.size() == times.size() * 3 * 60);
  for (std::size_t k = 0; k < times.size(); ++k) {
    CHECK(times[k] == outputs[k].time_s);
    const Positions u = network.spheres(outputs[k].position) - network.network.organ.position;
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      const float shown = moved[k * 180 + static_cast<std::size_t>(i)];
      REQUIRE(std::abs(static_cast<double>(shown) - u.reshaped()[i]) < 1e-7 * 4e-3 + 1e-18);
    }
  }
  // With less room states are left out evenly; the first and the last stay, and the page says so.
  ViewOptions options;
  options.most_numbers = 4 * 180;
  const ViewPage small = view_file(file, options);
  const std::string small_html = small.html();
  const auto few = numbers<double>(small_html, small.description.at("organ").at("time_s"));
  CHECK(few.size() <= 5);
  CHECK(few.front() == times.front());
  CHECK(few.back() == times.back());
  CHECK_THAT(small.description.at("organ").at("shown").get<std::string>(), Contains("so that"));
}

TEST_CASE("the page of a result opens at the largest response that tpm simulate states") {
  const TempFolder folder;
  // The sphere flies off the ball and comes back: while the contact settles, its force is larger
  // than any of the tissue.
  const ExperimentScene scene = test::experiment(test::kStruckStar);
  const RunNetwork network = network_to_run(scene);
  const SimulationRun run = simulate(scene, network);
  const auto force = [](const CurvePoint& p) { return std::abs(p.response); };
  REQUIRE_FALSE(counts(*std::ranges::max_element(run.record.curve, {}, force)));
  const std::string file = folder / "r.h5";
  write_simulation(scene, network, run, file);
  const Json stated = plan::simulation_json(scene, network, run).at("largest");
  const double start_s = view_file(file).description.at("start_s").get<double>();
  CHECK_THAT(start_s, Catch::Matchers::WithinRel(stated.at("time_s").get<double>(), 1e-8));
  CHECK(start_s == largest_point(run.record.curve, scene.formulation.tolerance).time_s);
}

TEST_CASE("the page of a result shows the force of every tool with its name") {
  const TempFolder folder;
  constexpr const char* kScene = R"({
    "organ": {"kind": "block", "cells": [2, 2, 2], "spacing": "10 mm", "lattice": "cubic"},
    "anchors": [{"kind": "half_space", "point": ["0 mm", "0 mm", "1 mm"], "normal": [0, 0, -1],
                 "slides": true}, {"kind": "spheres", "spheres": [11, 14]}],
    "contacts": [
      {"kind": "punch", "at": ["0 mm", "10 mm", "10 mm"], "direction": [1, 0, 0],
       "radius": "30 mm"FIRST},
      {"kind": "punch", "at": ["20 mm", "10 mm", "10 mm"], "direction": [-1, 0, 0],
       "radius": "30 mm"SECOND}], "outputs": {"count": 4}BESIDE})";
  const std::string motion =
      R"(, "protocol": {"kind": "ramp_hold", "depth": "1 mm", "rate": "1 mm/s", "hold": "1 s"})";
  const auto viewed = [&](const std::string& first, const std::string& second,
                          const std::string& beside) {
    std::string text = kScene;
    for (const auto& [place, words] :
         {std::pair{"FIRST", first}, {"SECOND", second}, {"BESIDE", beside}}) {
      text.replace(text.find(place), std::strlen(place), words);
    }
    const ExperimentScene scene = test::experiment(text);
    const RunNetwork network = network_to_run(scene);
    const std::string file = folder / "r.h5";
    write_simulation(scene, network, simulate(scene, network), file);
    return view_file(file);
  };
  const auto labels = [](const Json& plot) {
    std::vector<std::string> list;
    for (const Json& series : plot.at("series")) list.push_back(series.at("label"));
    return list;
  };
  const std::vector<std::string> kBoth{"contact 1: punch", "contact 2: punch"};
  // A protocol of its own: a curve of its own, also of the depth.
  const ViewPage own = viewed(motion, R"(, "protocol": {"kind": "ramp_hold", "depth": "0.5 mm",
      "rate": "1 mm/s", "hold": "1.5 s"})",
                              "");
  const Json& plots = own.description.at("plots");
  CHECK(plots.at(0).at("title") == "depth");
  CHECK(labels(plots.at(0)) == kBoth);
  CHECK(plots.at(1).at("title") == "contact force");
  CHECK(labels(plots.at(1)) == kBoth);
  CHECK(own.description.at("organ").at("tools").at("names") == Json(kBoth));
  const Hdf5Reader file(folder / "r.h5");
  CHECK(numbers<double>(own.html(), plots.at(1).at("series").at(1).at("y")) ==
        file.numbers("/contacts/2/force_N"));
  // The energy is that of the tissue.
  CHECK(labels(plots.at(2)) == std::vector<std::string>{"dissipated energy"});
  // One protocol for both: the force of each at the states of the file.
  const ViewPage both = viewed("", "", motion);
  const Json& force = both.description.at("plots").at(1);
  CHECK(labels(force) ==
        std::vector<std::string>{"contact 1: punch + contact 2: punch", kBoth[0], kBoth[1]});
  const std::string html = both.html();
  const auto first = numbers<double>(html, force.at("series").at(1).at("y"));
  const auto second = numbers<double>(html, force.at("series").at(2).at("y"));
  const Hdf5Reader again(folder / "r.h5");
  REQUIRE(first.size() == again.numbers("/steps/time_s").size());
  REQUIRE(second.size() == first.size());
  const std::string last = "/steps/0000" + std::to_string(first.size() - 1);
  const std::vector<double> held = again.table(last + "/tools/force_on_tissue_N");
  CHECK(first.back() == held[0]);
  CHECK(second.back() == -held[3]);
  CHECK(first.back() > 0.0);
  CHECK(second.back() > 0.0);
}

TEST_CASE("the page of a result on a smooth table says what slides in its plane") {
  const TempFolder folder;
  const ExperimentScene scene = test::experiment(R"({
    "organ": {"kind": "block", "cells": [2, 2, 2], "spacing": "10 mm", "lattice": "cubic", "contact": 1},
    "anchors": [{"kind": "half_space", "point": ["0 mm", "0 mm", "1 mm"], "normal": [0, 0, -1], "slides": true},
      {"kind": "spheres", "spheres": [26, 27]}],
    "contacts": [{"kind": "sphere", "number": 5, "direction": [0, 0, -1]}],
    "protocol": {"kind": "ramp_hold", "depth": "1 mm", "rate": "1 mm/s", "hold": "1 s"}})");
  const RunNetwork network = network_to_run(scene);
  const std::string file = folder / "r.h5";
  write_simulation(scene, network, simulate(scene, network), file);
  const ViewPage page = view_file(file);
  const auto constraint =
      numbers<std::uint32_t>(page.html(), page.description.at("organ").at("constraint"));
  CHECK(std::count(constraint.begin(), constraint.end(), 3U) > 0);
  CHECK(std::count(constraint.begin(), constraint.end(), 2U) == 2);
}

TEST_CASE("the page of a recording holds every sample, or the extremes of parts") {
  const TempFolder folder;
  const std::string file = recorded_session(folder);
  const HilRecording recording = read_recording(file);
  std::vector<float> depth_mm;
  for (const ServoRecord& row : recording.rows) {
    if (row.phase >= 0) depth_mm.push_back(static_cast<float>(1e3 * row.tool_depth_m));
  }
  const ViewPage page = view_file(file);
  CHECK(page.description.at("simulated") == true);
  CHECK(page.description.at("badge") == "SIMULATED DEVICE");
  CHECK(page.description.at("samples") == depth_mm.size());
  CHECK(page.description.at("organ").at("spheres") == 4);
  // It opens when the hand felt most.
  const ServoRecord& peak =
      *std::ranges::max_element(recording.rows, {}, [&](const ServoRecord& r) {
        return r.phase >= 0 ? std::abs(recording.commanded_N(r)) : -1.0;
      });
  REQUIRE(std::abs(recording.commanded_N(peak)) > 0.0);
  CHECK(page.description.at("start_s") == recording.time_s(peak));
  const Json& whole = page.description.at("plots").at(0).at("series").at(0);
  CHECK(numbers<float>(page.html(), whole.at("y")) == depth_mm);

  ViewOptions options;
  options.organ = false;
  options.most_samples = 100;
  const ViewPage parts = view_file(file, options);
  CHECK_FALSE(parts.description.contains("organ"));
  const auto part = parts.description.at("samples_per_value").get<std::size_t>();
  CHECK(part == (depth_mm.size() + 99) / 100);
  const Json& series = parts.description.at("plots").at(0).at("series").at(0);
  const std::string html = parts.html();
  const auto least = numbers<float>(html, series.at("y"));
  const auto most = numbers<float>(html, series.at("most"));
  REQUIRE(least.size() <= 100);
  REQUIRE(most.size() == least.size());
  for (std::size_t k = 0; k < least.size(); ++k) {
    const auto from = depth_mm.begin() + static_cast<std::ptrdiff_t>(k * part);
    const auto to =
        depth_mm.begin() + static_cast<std::ptrdiff_t>(std::min((k + 1) * part, depth_mm.size()));
    CHECK(least[k] == *std::min_element(from, to));
    CHECK(most[k] == *std::max_element(from, to));
  }
}

TEST_CASE("a law is viewed without its figures, and says so") {
  const TempFolder folder;
  std::ofstream(folder / "law.json") << R"({"law": "linear-1", "drive": "indentation_depth",
    "response": "contact_force", "reference_m": 0.004, "provenance": "derived",
    "parameters": {"k_inf_N_per_m": 60, "k1_N_per_m": 45, "tau1_s": 2, "contact_m": 0,
                   "offset_N": 0}})";
  const ViewPage page = view_file(folder / "law.json");
  CHECK(page.description.at("table").at("rows").size() == 5);
  CHECK(page.description.at("table").at("rows").at(2) == Json({"tau1", "2", "s", "fixed", "-"}));
  CHECK_THAT(page.description.dump(), Contains("there is no figures.json beside the law"));
}

TEST_CASE("a law with its covariance is viewed with intervals in units of their size") {
  const TempFolder folder;
  // Known noise: normal quantiles. The interval of a logarithm is a factor about its estimate.
  std::ofstream(folder / "law.json") << R"({"law": "linear-1", "drive": "indentation_depth",
    "response": "contact_force", "reference_m": 0.004, "provenance": "derived",
    "adequacy": {"verdict": "not_described", "summary": "residual 9 times the noise"},
    "parameters": {"k_inf_N_per_m": 60, "k1_N_per_m": 45, "tau1_s": 2, "contact_m": 0,
                   "offset_N": -2e-5},
    "fit": {"parameters": ["k_inf_N_per_m", "tau1_s", "offset_N"],
            "coordinates": ["linear", "log", "linear"],
            "covariance": [[0.25, 0, 0], [0, 0.0001, 0], [0, 0, 1e-12]], "level": 0.95,
            "readings_per_independent_reading": 1.0, "duration_s": 20,
            "noise": {"kind": "absolute", "absolute_N": 2e-4, "relative": 0, "column_factor": 1,
                      "lag_1_correlation": 0},
            "data": [{"file": "a.csv", "readings": 100, "sha256": ""}]}})";
  const Json page = view_file(folder / "law.json").description;
  CHECK(page.at("lead") ==
        Json::array({{{"text", "residual 9 times the noise"}, {"doubt", true}}}));
  const Json& table = page.at("table");
  CHECK(table.at("head").at(4) == "95 % interval");
  // 1.96 standard errors; 2 exp(-+0.0196)
  CHECK(table.at("rows").at(0) == Json({"k_inf", "60", "N/m", "0.5", "59.02 .. 60.98"}));
  CHECK(table.at("rows").at(1) == Json({"k1", "45", "N/m", "fixed", "-"}));
  CHECK(table.at("rows").at(2) == Json({"tau1", "2", "s", "0.02", "1.961 .. 2.04"}));
  CHECK(table.at("rows").at(4) == Json({"offset", "-20", "uN", "1", "-21.96 .. -18.04"}));
}

TEST_CASE("the page of a fit says first whether the law describes the data, and runs no name") {
  const TempFolder folder;
  const std::string title = R"(R&D <b>"x"</b></script><script>alert(1)</script>)";
  Json fit = Json::parse(R"({"model": "law", "chi_square": 1.0, "confidence_level": 0.95,
    "parameters": [{"name": "k1", "estimate_SI": 45.0, "interval_SI": [44.0, null], "SI_unit": "N/m",
                    "verdict": "no upper limit", "profile_SI_and_deviance": [[44, 4], [45, 0]]},
                   {"name": "drift", "estimate_SI": -9.87e-7, "interval_SI": [-6.93e-6, 4.96e-6],
                    "SI_unit": "N/s", "verdict": "identified", "deviance_at_limit": 6.84,
                    "profile_SI_and_deviance": [[-7e-6, 7], [-9.87e-7, 3], [5e-6, null], [6e-6, 9]]}],
    "adequacy": {"verdict": "not_described", "summary": "no law tried describes this recording"},
    "remarks": []})");
  fit["title"] = title;
  const Json answer{{"fit", fit},
                    {"summary", {"the simplest is linear-1"}},
                    {"remarks", {{{"code", "a_code"}, {"text", title}}}}};
  const Json figures = Json::parse(R"({"figures": [{"title": "fit", "panels": [{
    "x": {"quantity": "time", "unit": "s"}, "y": {"quantity": "force", "unit": "N"},
    "series": [{"kind": "line", "label": "law", "x": [0, 1], "y": [1, 2]}]}]}]})");
  std::ofstream(folder / "law.json") << "{}";
  const ViewPage page = fit::fit_page(answer, figures, folder / "law.json");
  const Json& lead = page.description.at("lead");
  REQUIRE(lead.size() == 3);
  CHECK(lead[0] == Json{{"text", "no law tried describes this recording"}, {"doubt", true}});
  CHECK(lead[2].at("text") == "warning: " + title);
  CHECK(page.description.at("table").at("rows")[0] ==
        Json({"k1", "45", "44 .. open", "N/m", "no upper limit"}));
  CHECK(page.description.at("table").at("rows")[1] ==
        Json({"drift", "-987", "-6930 .. 4960", "nN/s", "identified"}));
  REQUIRE(page.description.at("plots").size() == 3);  // the figure, and the profiles
  const std::string html = page.html();
  // In the unit of the table, as a rise, with the interval: no upper end of k1, both of the drift.
  const Json& profile = page.description["plots"][2];
  CHECK(profile.at("x").at("unit") == "nN/s");
  CHECK(profile.at("y").at("quantity") == "rise of the deviance");
  const auto of = [&](const Json& name) { return numbers<double>(html, name); };
  CHECK_THAT(of(profile.at("series")[0].at("x")),
             Catch::Matchers::Approx(std::vector<double>{-7000, -987, 6000}));
  CHECK(of(profile.at("series")[0].at("y")) == std::vector<double>{4, 0, 6});
  CHECK_THAT(of(profile.at("series")[1].at("x")),
             Catch::Matchers::Approx(std::vector<double>{-987}));
  CHECK(profile.at("series")[2].at("label") == "95 % interval");
  CHECK_THAT(of(profile.at("series")[2].at("x")),
             Catch::Matchers::Approx(std::vector<double>{-6930, 4960}));
  CHECK(of(page.description["plots"][1].at("series")[2].at("x")) == std::vector<double>{44});
  // The line at which the interval ends, above the least deviance.
  const Json& limit = profile.at("series")[3];
  CHECK(limit.at("kind") == "line");
  CHECK(limit.at("label") == "limit of the 95 % interval");
  CHECK_THAT(of(limit.at("x")), Catch::Matchers::Approx(std::vector<double>{-7000, 6000}));
  CHECK_THAT(of(limit.at("y")), Catch::Matchers::Approx(std::vector<double>{3.84, 3.84}));
  CHECK(html.find("<script>alert") == std::string::npos);
  CHECK(html.find("<b>") == std::string::npos);

  // Of a folder the answer is shown with its figures.
  std::ofstream(folder / "selection.json") << answer.dump();
  std::ofstream(folder / "figures.json") << figures.dump();
  const ViewPage seen = view_path(folder.path()).pages.at(0);
  CHECK(seen.description.at("lead") == lead);
  CHECK(seen.description.at("plots").size() == 3);
  // So is that of a configuration.
  const TempFolder configured;
  std::ofstream(configured / "answer.json") << fit.dump();
  std::ofstream(configured / "figures.json") << figures.dump();
  std::ofstream(configured / "law.json") << "{}";
  const ViewPage told = view_path(configured.path()).pages.at(0);
  CHECK(told.description.at("lead").at(0) == lead.at(0));
  CHECK(told.description.at("table") == page.description.at("table"));
  CHECK(told.description.at("plots").size() == 3);
  // Several figures are called by their folder.
  const TempFolder drawn;
  Json two = figures;
  two["figures"].push_back(figures.at("figures").at(0));
  std::ofstream(drawn / "figures.json") << two.dump();
  CHECK(view_path(drawn.path()).pages.at(0).description.at("title") ==
        drawn.path().filename().string() + ": 2 figures");
  const TempFolder empty;
  CHECK_THROWS_WITH(view_path(empty.path()),
                    Contains("is a folder without a result that tpm view shows; expected a result "
                             "of tpm simulate"));
}

TEST_CASE("the page of a fit says which intervals it has, and no level that nobody stated") {
  const TempFolder folder;
  Json fit = Json::parse(R"({"title": "t", "model": "law", "chi_square": 1.0,
    "confidence_level": 0.9,
    "parameters": [{"name": "k1", "estimate_SI": 45.0, "interval_SI": [null, null],
                    "SI_unit": "N/m", "verdict": "not profiled", "profile_SI_and_deviance": []},
                   {"name": "k2", "estimate_SI": 45.001934, "interval_SI": [null, null],
                    "SI_unit": "N/m", "verdict": "flat",
                    "profile_SI_and_deviance": [[44, 0.1], [45, 0], [46, 0.1]]}]})");
  const auto viewed = [&] {
    std::ofstream(folder / "a.json") << fit.dump();
    return view_file(folder / "a.json").description.at("table");
  };
  const Json table = viewed();
  CHECK(table.at("head").at(2) == "90 % interval");
  CHECK(table.at("rows").at(0) == Json({"k1", "45", "-", "N/m", "not profiled"}));
  CHECK(table.at("rows").at(1) ==
        Json({"k2", "45.002", "open .. open", "N/m", "flat"}));  // as printed
  fit["confidence_level"] = 95;
  CHECK_THROWS_WITH(viewed(), Contains("a.json: key /confidence_level: is no confidence level; "
                                       "expected a number between 0 and 1"));
  fit.erase("confidence_level");
  CHECK_THROWS_WITH(viewed(), Contains("a.json: key /confidence_level: is missing; expected a "
                                       "number between 0 and 1"));
  fit = Json{{"fit", fit}};
  CHECK_THROWS_WITH(viewed(), Contains("key /fit/confidence_level: is missing"));
}
