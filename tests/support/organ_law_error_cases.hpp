#pragma once
// Laws that cannot be put on an organ (test_errors.cpp).
#include <string>
#include <vector>

#include "error_case.hpp"

namespace tpm::test {

inline std::vector<ErrorCase> organ_law_error_cases() {
  const std::string type = "law on an organ";
  const std::string law =
      R"({"law": "linear-1", "drive": "indentation_depth", "response": "contact_force",
"reference_m": 0.002, "provenance": "assumed",
"parameters": {"k_inf_N_per_m": 100, "k1_N_per_m": 50, "tau1_s": 2}})";
  const std::string fractional =
      R"({"law": "linear-fzener", "drive": "indentation_depth", "response": "contact_force",
"reference_m": 0.002, "provenance": "assumed",
"parameters": {"k_inf_N_per_m": 100, "k1_N_per_m": 50, "tau1_s": 2, "alpha": 0.5}})";
  const auto scene = [](const std::string& more) {
    return R"({"organ": {"kind": "liver", "count": 60, "spacing": "20 mm"},
"anchors": [{"kind": "far_side"}])" +
           more + "}";
  };
  const auto both = [](std::string l, std::string s) {
    return with_files({{"l.json", std::move(l)}, {"s.json", std::move(s)}});
  };
  const std::string put = "material {}/l.json {}/s.json -o {}/out";
  const std::string press = put + " --depth '2 mm' --rate '2 mm/s' --hold '2 s'";
  return {
      {type, "missing scene", press, with_files({{"l.json", law}})},
      {type, "scene that is no JSON", press, both(law, kGarbage)},
      {type, "no motion", put, both(law, scene(""))},
      {type, "load imposed", put,
       both(law, scene(R"(, "protocol": {"kind": "creep", "load": "1 N", "duration": "5 s"})"))},
      {type, "intervals of readings without a recording", press + " --intervals readings",
       both(law, scene(""))},
      {type, "spring-pot", press, both(fractional, scene(""))},
      {type, "two contacts", press,
       both(law, scene(R"(, "contacts": [{"kind": "sphere", "number": 1},
{"kind": "sphere", "number": 2}])"))},
      {type, "contact with a protocol of its own", press,
       both(law, scene(R"(, "contacts": [{"kind": "sphere", "protocol":
{"kind": "ramp_hold", "depth": "2 mm", "rate": "2 mm/s", "hold": "2 s"}}])"))},
      {type, "gravity", press,
       both(law, scene(R"(, "loads": [{"kind": "gravity", "direction": [0, 0, -1]}])"))},
      {type, "scene in place of a recording", "validate {}/l.json {}/s.json", both(law, scene(""))},
      {type, "motion of a scene with own protocols", "predict {}/l.json {}/s.json",
       both(law, scene(R"(, "contacts": [{"kind": "sphere", "protocol":
{"kind": "ramp_hold", "depth": "2 mm", "rate": "2 mm/s", "hold": "2 s"}}])"))},
  };
}

}  // namespace tpm::test
