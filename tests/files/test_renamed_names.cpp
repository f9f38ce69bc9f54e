// Former names of keys and words in input files: read with a warning, never beside the new name.
#include <algorithm>
#include <catch2/catch.hpp>
#include <charconv>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "hil_scenes.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/base/warning.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/renamed_names.hpp"
#include "tpm/fit/design/design.hpp"
#include "tpm/haptics/session/session.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "tpm/sweep/sweep.hpp"
#include "tpmkit/version.hpp"

namespace tpm::files {
using namespace organ;
using namespace fit;
using namespace haptics;
using namespace sweep;

namespace {

using Catch::Matchers::Contains;
using test::refusal_of;

/// The warnings of the library while it lives.
class Heard {
 public:
  Heard() : before_(set_warning_sink([this](const std::string& text) { lines.push_back(text); })) {}
  ~Heard() { set_warning_sink(std::move(before_)); }
  Heard(const Heard&) = delete;
  Heard& operator=(const Heard&) = delete;

  std::vector<std::string> lines;

 private:
  WarningSink before_;
};

std::string block_with(const std::string& keys) {
  return R"({"organ": {"kind": "block", "cells": [2, 2, 2], "spacing": "10 mm"},
             "anchors": [{"kind": "spheres", "spheres": [1]}], )" +
         keys + "}";
}

organ::Tissue tissue_of(const std::string& keys, const char* where) {
  return organ::parse_tissue(parse_json(block_with(keys), where), where, {});
}

/// "0.3" or "0.3.1" as a pair that can be compared.
std::pair<int, int> minor_version(std::string_view text) {
  std::pair<int, int> numbers{0, 0};
  const std::size_t dot = text.find('.');
  std::from_chars(text.data(), text.data() + dot, numbers.first);
  std::from_chars(text.data() + dot + 1, text.data() + text.size(), numbers.second);
  return numbers;
}

/// The keys of the objects that a place of a document of this kind names.
Json properties_at(const Json& whole, const Json& schema, const std::string& place) {
  if (schema.contains("$ref")) {
    const std::string pointer = schema.at("$ref").get<std::string>().substr(1);
    return properties_at(whole, whole.at(Json::json_pointer(pointer)), place);
  }
  for (const char* either : {"allOf", "anyOf"}) {
    if (schema.contains(either)) return properties_at(whole, schema.at(either).at(0), place);
  }
  if (place.empty()) return schema.at("properties");
  const std::size_t end = std::min(place.find('/', 1), place.size());
  const std::string name = place.substr(1, end - 1);
  const char* any = schema.contains("items") ? "items" : "additionalProperties";
  const Json& part = name == "*" ? schema.at(any) : schema.at("properties").at(name);
  return properties_at(whole, part, place.substr(end));
}

TEST_CASE("a former key is read as the new one, with one warning") {
  Heard heard;
  const organ::Tissue by_new = tissue_of(R"("sliders": [6])", "new.json");
  CHECK(heard.lines.empty());
  for (int time = 0; time < 2; ++time) {
    const organ::Tissue by_former = tissue_of(R"("guides": [6])", "former.json");
    REQUIRE(by_former.sliders.size() == 1);
    CHECK(by_former.sliders[0].sphere == by_new.sliders[0].sphere);
    CHECK(by_former.constraints().count() == by_new.constraints().count());
  }
  CHECK(heard.lines ==
        std::vector<std::string>{"former.json: key /guides is now called 'sliders'; the former "
                                 "name is read until version 0.3"});
}

TEST_CASE("a former key beside the new one is an error that names both") {
  CHECK(refusal_of([] {
          static_cast<void>(tissue_of(R"("guides": [6], "sliders": [7])", "both.json"));
        }) ==
        "both.json: key /guides: stands beside its new name 'sliders'; expected 'sliders' alone");
}

TEST_CASE("mistakes below a former key are told under the new one, which is what is offered") {
  Heard heard;
  CHECK_THAT(refusal_of([] { static_cast<void>(tissue_of(R"("guides": ["six"])", "m.json")); }),
             Contains("m.json: key /sliders/0: is of the wrong type"));
  const std::string unknown =
      refusal_of([] { static_cast<void>(tissue_of(R"("guide": [6])", "u.json")); });
  CHECK_THAT(unknown, Contains("key /guide: unknown key") && Contains("sliders"));
  CHECK_THAT(unknown, !Contains("guides"));
}

TEST_CASE("a former word of a list is read as the new one, in formulas as well") {
  Heard heard;
  const std::string former = R"({"model": "single_contact", "creep": {},
    "axes": [{"parameter": "load", "values": ["0.2 N"]}],
    "outputs": ["creep_depth_at_once", "creep_depth",
                {"formula": "creep_depth/creep_depth_at_once", "name": "growth"}]})";
  const Json current = checked(parse_json(former, "w.json"), "sweep", "w.json");
  CHECK(current.at("outputs")[0] == "instantaneous_creep_depth");
  CHECK(current.at("outputs")[2].at("formula") == "creep_depth/instantaneous_creep_depth");
  CHECK(heard.lines == std::vector<std::string>{
                           "w.json: key /outputs/0: 'creep_depth_at_once' is now called "
                           "'instantaneous_creep_depth'; the former name is read until version "
                           "0.3"});
  CHECK(checked(current, "sweep", "w2.json") == current);
  CHECK(sweep::parse_sweep(parse_json(former, "w.json"), "w.json", ".").document ==
        sweep::parse_sweep(current, "w2.json", ".").document);
  CHECK(heard.lines.size() == 1);

  Json both = current;
  both["outputs"].push_back("creep_depth_at_once");
  CHECK(refusal_of([&] { static_cast<void>(checked(both, "sweep", "b.json")); }) ==
        "b.json: key /outputs/3: 'creep_depth_at_once': stands beside its new name "
        "'instantaneous_creep_depth'; expected 'instantaneous_creep_depth' alone");
}

TEST_CASE("a user's own name is left alone") {
  const Json sweep = parse_json(R"({"model": "single_contact", "creep": {},
    "axes": [{"parameter": "load", "values": ["0.2 N"]}],
    "outputs": [{"creep_depth_at": "1 s", "name": "creep_depth_at_once"},
                {"formula": "2 * creep_depth_at_once", "name": "twice"}]})",
                                "own.json");
  Heard heard;
  CHECK(checked(sweep, "sweep", "own.json") == sweep);
  CHECK(heard.lines.empty());
}

TEST_CASE("pointers of axes to what was renamed are read as pointers to the new name") {
  Heard heard;
  const auto sweep = [](const std::string& key, const std::string& axes) {
    return parse_json(R"({"model": "organ", "scene": {"organ": {"kind": "star"}, ")" + key +
                          R"(": [2, 5]}, "outputs": ["peak_force"],
                          "axes": )" +
                          axes + "}",
                      "p.json");
  };
  const auto single = [](const std::string& key) {
    return R"([{"parameter": "/)" + key + R"(/0", "name": "z", "values": [1, 2]}])";
  };
  const auto together = [](const std::string& key) {
    return R"([{"together": {"/)" + key + R"(/0": {"values": [0, 1], "name": "y"},
               "/material/E1": {"values": ["6 kPa", "12 kPa"]}}}])";
  };
  const auto samples = [](const std::string& key) {
    return R"([{"samples": "sobol", "count": 4, "parameters":
               {"/)" +
           key + R"(/0": {"from": 0, "to": 1, "name": "y"}}}])";
  };
  CHECK(with_current_names(sweep("guides", single("guides")), "sweep", "p.json") ==
        sweep("sliders", single("sliders")));
  REQUIRE(heard.lines.size() == 2);
  CHECK(heard.lines[1] ==
        "p.json: key /axes/0/parameter: '/guides/0' is now called '/sliders/0'; "
        "the former name is read until version 0.3");
  CHECK(with_current_names(sweep("guides", together("guides")), "sweep", "p2.json") ==
        sweep("sliders", together("sliders")));
  CHECK(with_current_names(sweep("guides", samples("guides")), "sweep", "p3.json") ==
        sweep("sliders", samples("sliders")));
  CHECK(heard.lines.size() == 6);
  // Other keys that begin alike, or stand deeper, are left alone.
  for (const char* key : {"guidesx", "organ/guides"}) {
    const Json own = sweep("sliders", single(key));
    CHECK(with_current_names(own, "sweep", "p4.json") == own);
  }
  CHECK(heard.lines.size() == 6);
  const std::string both = R"([{"together": {"/guides/0": {"values": [0, 1]},
                               "/sliders/0": {"values": [0, 1]}}}])";
  CHECK(refusal_of([&] {
          static_cast<void>(with_current_names(sweep("sliders", both), "sweep", "p5.json"));
        }) ==
        "p5.json: key /axes/0/together: '/guides/0': stands beside its new name "
        "'/sliders/0'; expected '/sliders/0' alone");
}

TEST_CASE("the design's former criterion chooses the same") {
  Heard heard;
  Json design = read_json(share_dir() / "configs" / "design_liver.json");
  design["criterion"] = "eta1";
  const fit::DesignProblem by_new = fit::parse_design(design, "d.json");
  design.erase("criterion");
  design["goal"] = "eta1";
  const fit::DesignProblem by_former = fit::parse_design(design, "d.json");
  CHECK(by_former.criterion == by_new.criterion);
  CHECK(by_former.criterion_parameter == by_new.criterion_parameter);
  CHECK(heard.lines.size() == 1);
}

TEST_CASE("scenes within other files are read by the same rule; what tpm wrote is no news") {
  Heard heard;
  const Json session = parse_json(R"({"model": {"scene": {"guides": [6]}}})", "t");
  const Json expected = parse_json(R"({"model": {"scene": {"sliders": [6]}}})", "t");
  CHECK(with_current_names(session, "hil", "r.tpmrec", FormerNames::silent) == expected);
  CHECK(heard.lines.empty());
  CHECK(with_current_names(session, "hil", "s.json") == expected);
  REQUIRE(heard.lines.size() == 1);
  CHECK_THAT(heard.lines.front(), Contains("s.json: key /model/scene/guides is now"));
  // A document of any form is left to the schema.
  for (const char* text : {"3", "[]", "null", R"({"outputs": 3})", R"({"outputs": {"fields": 1}})",
                           R"({"materials": {"a": 1}})", R"({"scene": "a.json"})"}) {
    for (const RenamedName& name : renamed_names()) {
      CHECK(with_current_names(parse_json(text, "t"), name.schema, "t") == parse_json(text, "t"));
    }
  }
}

TEST_CASE("former keys of sessions mean the same as the new ones") {
  Heard heard;
  const auto session = [](const char* timeout, const char* validity, const char* rest,
                          const char* set_point) {
    Json json = test::short_session();
    json["limits"][timeout] = "20 ms";
    json["limits"][validity] = "0.25 s";
    json["start"][rest] = "0.5 s";
    json["virtual_device"][set_point] = "3 mm";
    return haptics::parse_session(json, "s.json", "");
  };
  const haptics::HilSession by_new =
      session("cycle_timeout", "outside_validity", "at_rest", "arm_set_point");
  CHECK(heard.lines.empty());
  CHECK(by_new.cycle_timeout_s == 0.02);
  CHECK(by_new.servo.outside_validity_limit_s == 0.25);
  CHECK(by_new.servo.gate->rest_time_s == 0.5);
  CHECK(by_new.plant.arm_set_point_m == 3e-3);
  const haptics::HilSession by_former = session("hang", "untrusted", "still", "limp_at");
  CHECK(heard.lines.size() == 4);
  CHECK(by_former.cycle_timeout_s == by_new.cycle_timeout_s);
  CHECK(by_former.servo.outside_validity_limit_s == by_new.servo.outside_validity_limit_s);
  CHECK(by_former.servo.gate->rest_time_s == by_new.servo.gate->rest_time_s);
  CHECK(by_former.plant.arm_set_point_m == by_new.plant.arm_set_point_m);
}

TEST_CASE("a recording of a motion with the former key is read without a word") {
  Heard heard;
  const Json recorded = parse_json(R"({"motion": {"relax_s": 3.0}})", "t");
  CHECK(with_current_names(recorded, "hil", "r.tpmrec", FormerNames::silent) ==
        parse_json(R"({"motion": {"initial_hold_s": 3.0}})", "t"));
  CHECK(heard.lines.empty());
}

TEST_CASE("schemas mark former keys, and no name outlives its version") {
  for (const RenamedName& name : renamed_names()) {
    CAPTURE(name.schema, name.former);
    CHECK(minor_version(version()) < minor_version(name.until));  // else drop its row
    if (name.kind == RenamedName::Kind::value) continue;
    const Json schema =
        read_json(share_dir() / "schemas" / (std::string(name.schema) + ".schema.json"));
    const Json keys = properties_at(schema, schema, std::string(name.place));
    const Json& former = keys.at(std::string(name.former));
    CHECK(former.value("deprecated", false));
    CHECK_THAT(former.at("description").get<std::string>(),
               Contains("former name of " + std::string(name.current)) &&
                   Contains("until version " + std::string(name.until)));
    CHECK_FALSE(keys.at(std::string(name.current)).contains("deprecated"));
  }
}

TEST_CASE("the program warns of a former name in one line on standard error") {
  const test::TempFolder folder;
  const std::string scene = folder / "s.json", said = folder / "said";
  write_file(scene, R"({"organ": {"kind": "star"}, "guides": [2]})");
  CHECK(std::system(
            ("'" TPM_TEST_PROGRAM "' network check '" + scene + "' > /dev/null 2> '" + said + "'")
                .c_str()) == 0);
  CHECK(read_file(said) == "tpm: warning: " + scene +
                               ": key /guides is now called 'sliders'; the former name is read "
                               "until version 0.3\n");
}

}  // namespace
}  // namespace tpm::files
