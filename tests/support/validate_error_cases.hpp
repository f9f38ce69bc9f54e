#pragma once
// Comparisons that tpm validate refuses (test_errors.cpp).
#include <algorithm>
#include <string>
#include <vector>

#include "error_case.hpp"

namespace tpm::test {

inline std::vector<ErrorCase> validate_error_cases() {
  const std::string type = "validation";
  const std::string law =
      R"({"law": "linear-1", "drive": "indentation_depth", "response": "contact_force",
"reference_m": 0.002, "provenance": "derived",
"parameters": {"k_inf_N_per_m": 60, "k1_N_per_m": 45, "tau1_s": 2},
"fit": {"parameters": ["k_inf_N_per_m"], "coordinates": ["linear"], "covariance": [[1]],
"noise": {"kind": "absolute", "absolute_N": 0.001}, "data": [{"file": "gone.csv"}]}})";
  const std::string description =
      R"({"id": "r", "title": "t", "kind": "recording", "observable": "contact_force",
"provenance": "measured", "columns": {"time_s": {"quantity": "time", "unit": "s"},
"depth_mm": {"quantity": "indentation_depth", "unit": "mm"},
"force_N": {"quantity": "contact_force", "unit": "N"}})";
  std::string csv = "time_s,depth_mm,force_N\n";
  for (int i = 0; i < 200; ++i) {
    const double t = 0.05 * i, depth = 2.0 * std::clamp(t - 1.0, 0.0, 1.0);
    csv += std::to_string(t) + "," + std::to_string(depth) + "," +
           std::to_string(0.1 * depth + 0.0001 * (i * 7 % 5)) + "\n";
  }
  const auto files = [&](const std::string& more) {
    return with_files({{"l.json", law}, {"r.csv", csv}, {"r.json", description + more + "}"}});
  };
  const std::string run = "validate {}/l.json {}/r.csv";
  return {
      {type, "requirement in the unit of nothing", run + " --require '20 mm'", files("")},
      {type, "requirement that is none", run + " --require big", files("")},
      {type, "evidence of no category", run + " --credibility {}/out --evidence l.json", files("")},
      {type, "plan of a law", run + " --plan", files("")},
      {type, "session that is none", "validate {}/l.json {}/r.tpmrec",
       with_files({{"l.json", law}, {"r.tpmrec", kGarbage}})},
      {type, "session beside a recording", run + " {}/s.tpmrec", files("")},
      {type, "instrument without a name", run, files(R"(, "instrument": {"noise": "0.2 mN"})")},
      {type, "instrument with noise of another dimension", run,
       files(R"(, "instrument": {"id": "cell", "noise": "0.2 mm"})")},
  };
}

}  // namespace tpm::test
