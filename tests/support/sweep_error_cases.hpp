#pragma once
// Bad sweeps, and bad files beside them (test_errors.cpp).
#include <string>
#include <vector>

#include "error_case.hpp"

namespace tpm::test {

inline std::vector<ErrorCase> sweep_error_cases() {
  const std::string type = "sweep";
  const std::string good =
      R"({"model": "single_contact", "indentation": {"kind": "step_hold", "depth": "4 mm"},
"axes": [{"parameter": "spacing", "values": ["20 mm", "30 mm"]}], "outputs": ["peak_force"]})";
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    if (at == std::string::npos) throw std::logic_error("nothing to replace: " + from);
    return with_files({{"s.json", text.replace(at, from.size(), to)}});
  };
  const auto by_name = [](const std::string& target, const std::string& value) {
    return with_files({{"s.json", R"({"model": "organ", "scene": {"organ": {"kind": "star"},
"protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s", "hold": "1 s"}},
"axes": [{"parameter": ")" + target + R"(", "values": [")" +
                                      value + R"("]}],
"outputs": ["peak_force"]})"}});
  };
  const std::string run = "sweep {}/s.json -o {}/out.h5";
  return {
      {type, "missing", run, with_files({})},
      {type, "empty", run, with_files({{"s.json", ""}})},
      {type, "truncated", run, with_files({{"s.json", good.substr(0, 60)}})},
      {type, "binary garbage", run, with_files({{"s.json", kGarbage}})},
      {type, "unknown key", run, with("\"axes\"", "\"axis\"")},
      {type, "unknown model", run, with("single_contact", "double_contact")},
      {type, "unknown parameter", run, with("\"spacing\"", "\"distance\"")},
      {type, "unit of another kind", run, with("\"20 mm\"", "\"20 N\"")},
      {type, "parameter of what is not done", run, with("\"spacing\"", "\"load\"")},
      {type, "contact with a protocol of its own", run,
       with_files({{"s.json", R"({"model": "organ", "scene": {"organ": {"kind": "star"},
"contacts": [{"kind": "sphere", "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s",
"hold": "1 s"}}]}, "axes": [{"parameter": "/material/E1", "values": ["9 kPa"]}],
"outputs": ["peak_force"]})"}})},
      {type, "protocol that a sweep does not vary", run,
       with_files({{"s.json", R"({"model": "organ", "scene": {"organ": {"kind": "star"},
"protocol": {"kind": "sine", "depth": "4 mm", "frequency": "1 Hz"}},
"axes": [{"parameter": "/material/E1", "values": ["9 kPa"]}], "outputs": ["peak_force"]})"}})},
      {type, "nothing to sweep", run,
       with("{\"parameter\": \"spacing\", \"values\": [\"20 mm\", \"30 mm\"]}", "")},
      {type, "range without a count", run,
       with("\"values\": [\"20 mm\", \"30 mm\"]", "\"from\": \"20 mm\", \"to\": \"30 mm\"")},
      {type, "values and a range", run, with("\"values\"", "\"from\": \"20 mm\", \"values\"")},
      {type, "two axes of one parameter", run,
       with("\"axes\": [",
            "\"axes\": [{\"parameter\": \"spacing\", \"name\": \"x\", \"values\": "
            "[\"1 mm\"]}, ")},
      {type, "too many cells", run,
       with("\"axes\": [",
            "\"axes\": [{\"parameter\": \"E1\", \"from\": \"1 kPa\", \"to\": \"2 "
            "kPa\", \"count\": 1000000000000}, ")},
      {type, "unknown output", run, with("peak_force", "peek_force")},
      {type, "output of what is not done", run, with("peak_force", "creep_depth")},
      {type, "name twice", run,
       with("\"peak_force\"", "{\"formula\": \"1\", \"name\": \"spacing\"}")},
      {type, "formula of something unknown", run,
       with("\"peak_force\"", "{\"formula\": \"farce\", \"name\": \"a\"}")},
      {type, "condition that is no formula", run,
       with("\"axes\"", "\"skip\": [{\"when\": \"spacing >\"}], \"axes\"")},
      {type, "no depth", run, with(", \"depth\": \"4 mm\"", "")},
      {type, "organ with an indentation of the single contact", run,
       with("single_contact", "organ")},
      {type, "samples of an unknown kind", run,
       with("\"parameter\": \"spacing\", \"values\": [\"20 mm\", \"30 mm\"]",
            "\"samples\": \"sobel\", \"count\": 4, \"parameters\": {\"spacing\": {\"from\": \"20 "
            "mm\", \"to\": \"30 mm\"}}")},
      {type, "name that the results have", run,
       with("\"peak_force\"", "{\"formula\": \"1\", \"name\": \"sweep\"}")},
      {type, "output over the sweep itself", "sweep {}/s.json -o {}/./s.json",
       with_files({{"s.json", good}})},
      {type, "output where the CSV goes", "sweep {}/s.json -o {}/out.csv",
       with_files({{"s.json", good}})},
      {type, "output whose times go over the sweep", "sweep {}/out.run.json -o {}/out.h5",
       with_files({{"out.run.json", good}})},
      {type, "shard beyond the last", run + " --shard 3/2", with_files({{"s.json", good}})},
      {type, "merge without shards", "sweep merge {}/s.json -o {}/out.h5",
       with_files({{"s.json", good}})},
      {type, "merge of garbage", "sweep merge {}/s.json {}/shard -o {}/out.h5",
       with_files({{"s.json", good}, {"shard", kGarbage}})},
      {type, "garbage as log", run, with_files({{"s.json", good}, {"out.h5.blocks", kGarbage}})},
      {type, "output cannot be written", "sweep {}/s.json -o /proc/none/out.h5",
       with_files({{"s.json", good}})},
      {type, "parameter that the material has not", run, by_name("material.tau2", "1 s")},
      {type, "material's parameter of another unit", run, by_name("material.tau1", "1 kPa")},
      {type, "show of another file", "sweep show {}/s.json", with_files({{"s.json", good}})},
  };
}

}  // namespace tpm::test
