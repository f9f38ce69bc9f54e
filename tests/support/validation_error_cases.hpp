#pragma once
// Laws, recordings, pages and options that tpm validate refuses (test_errors.cpp).
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "error_case.hpp"

namespace tpm::test {

/// A ramp of 2 mm within 1 s and a hold, of 100 + 50 exp(-t / 2 s) N/m.
inline std::string validated_recording(double sign = 1.0, int count = 120) {
  std::string text = "time [s],depth [mm],force [N]\n";
  for (int i = 0; i < count; ++i) {
    const double t = 0.1 * i - 1.0, ramp = std::min(std::max(t, 0.0), 1.0);
    const double branch =
        50.0 * 2.0 * (1.0 - std::exp(-ramp / 2.0)) * std::exp(-std::max(t - 1.0, 0.0) / 2.0);
    const double force = 2e-3 * (100.0 * ramp + branch) + 1e-4 * std::sin(7.0 * i * i);
    text += std::to_string(0.1 * i) + "," + std::to_string(2.0 * ramp) + "," +
            std::to_string(sign * force) + "\n";
  }
  return text;
}

inline std::vector<ErrorCase> validation_error_cases() {
  const std::string type = "validation";
  const auto law = [](const std::string& more) {
    return R"({"law": "linear-1", "drive": "indentation_depth", "response": "contact_force",
"reference_m": 0.002, "provenance": "derived",
"parameters": {"k_inf_N_per_m": 100, "k1_N_per_m": 50, "tau1_s": 2})" +
           more + "}";
  };
  const std::string fit = R"(, "fit": {"parameters": ["k_inf_N_per_m", "k1_N_per_m", "tau1_s"],
"coordinates": ["linear", "linear", "log"],
"covariance": [[1e-3, 0, 0], [0, 1e-2, 0], [0, 0, 1e-5]], "level": 0.95,
"readings_per_independent_reading": 1, "noise": {"kind": "absolute", "absolute_N": 1e-4,
"relative": 0, "column_factor": 1, "lag_1_correlation": 0}, "data": [],
"degrees_of_freedom": 100, "duration_s": 11})";
  const std::string page_opens =
      "<html><body><script type=\"application/json\" id=\"tpm-credibility\">";
  const std::string page_closes = "</script></body></html>";
  const auto files = [law](const std::string& recording) {
    return with_files({{"l.json", law("")}, {"r.csv", recording}});
  };
  const auto page = [page_opens, page_closes](const std::string& record) {
    return with_files({{"p.html", page_opens + record + page_closes}});
  };
  const std::string command = "validate {}/l.json {}/r.csv";
  const std::string recheck = "validate --recheck {}/p.html";
  const std::string whole =
      R"({"tpm": "1", "summary": {"question": "", "context": "", "risk": ""}, "files": {},
"evidence": [], "law": {}, "validation": {}, "invocation": )";
  const auto fitted = [law, fit](const std::string& recording) {
    return with_files({{"l.json", law(fit)}, {"r.csv", recording}});
  };
  std::string still = "time [s],depth [mm],force [N]\n";
  std::string sudden = still, few = still, strip = "time [s],strain [1],stress [kPa]\n",
              pulled = "time [s],stress [kPa],strain [1]\n";
  for (int i = 0; i < 40; ++i) {
    const std::string t = std::to_string(0.1 * i);
    const std::string rising = std::to_string(std::min(0.1 * i, 1.0));
    still += t + ",1,0.1\n";
    sudden += t + (i < 10 ? ",0.5,0\n" : ",2,0.2\n");
    if (i < 5) few += t + "," + rising + "," + rising + "\n";
    strip += t + "," + rising + "," + rising + "\n";
    pulled += t + "," + rising + "," + rising + "\n";
  }
  return {
      {type, "neither law nor recording", "validate", with_files({})},
      {type, "law without recording", "validate {}/l.json", with_files({{"l.json", law("")}})},
      {type, "recording in the law's place", "validate {}/r.csv {}/r.csv",
       files(validated_recording())},
      {type, "recording in the law's place of tpm predict",
       "predict {}/r.csv --depth 1mm --rate 1mm/s --hold 1s", files(validated_recording())},
      {type, "recording in the law's place of tpm budget", "budget {}/r.csv {}/r.csv",
       files(validated_recording())},
      {type, "folder in the law's place", "validate {}/.. {}/r.csv", files(validated_recording())},
      {type, "folder in a recording's place", "validate {}/l.json {}/..",
       files(validated_recording())},
      {type, "protocol in the law's place", command,
       with_files({{"l.json", R"({"protocol": {"kind": "ramp_hold", "depth": "1 mm",
"rate": "1 mm/s", "hold": "1 s"}})"},
                   {"r.csv", validated_recording()}})},
      {type, "configuration of a fit in the law's place", command,
       with_files({{"l.json", R"({"title": "t", "law": "linear-1", "parameters": [], "data": []})"},
                   {"r.csv", validated_recording()}})},
      {type, "web page in the law's place", command,
       with_files({{"l.json", "<html></html>"}, {"r.csv", validated_recording()}})},
      {type, "missing law", command, with_files({{"r.csv", validated_recording()}})},
      {type, "missing recording", command, with_files({{"l.json", law("")}})},
      {type, "law without uncertainty", command, files(validated_recording())},
      {type, "requirement that is none", command + " --require much", files(validated_recording())},
      {type, "requirement of nothing", command + " --require ''", files(validated_recording())},
      {type, "requirement of 0", command + " --require 0%", files(validated_recording())},
      {type, "requirement of less than 0", command + " --require=-5%",
       files(validated_recording())},
      {type, "requirement of 200 %", command + " --require 200%", files(validated_recording())},
      {type, "requirement that is no number", command + " --require nan%",
       files(validated_recording())},
      {type, "requirement without a unit", command + " --require 20", files(validated_recording())},
      {type, "unknown placement", command + " --placement best", files(validated_recording())},
      {type, "unknown quantity", command + " --quantity slope", files(validated_recording())},
      {type, "--planned with a law", command + " --planned", files(validated_recording())},
      {type, "--tolerance without --planned", command + " --tolerance 1%",
       files(validated_recording())},
      {type, "missing instrument", command + " --instrument {}/none.json",
       files(validated_recording())},
      {type, "session beside a recording", command + " {}/s.tpmrec", files(validated_recording())},
      {type, "--session with a session", "validate {}/l.json {}/s.tpmrec --session {}/t.tpmrec",
       with_files({{"l.json", law("")}})},
      {type, "force counted negative", command, fitted(validated_recording(-1.0))},
      {type, "depth that does not rise", command, fitted(still)},
      {type, "depth that jumps", command, fitted(sudden)},
      {type, "five samples", command, fitted(few)},
      {type, "strip, for a law of contact", command, fitted(strip)},
      {type, "strip under a load, for a law of contact", command, fitted(pulled)},
      {type, "requirement in the unit of nothing", command + " --require '20 mm'",
       fitted(validated_recording())},
      {type, "quantity that the recording lacks", command + " --quantity work",
       fitted(validated_recording())},
      {type, "--at-recording of no recording", command + " --at-recording other.csv",
       fitted(validated_recording())},
      {type, "instrument that is none", command + " --instrument {}/i.json",
       with_files({{"l.json", law(fit)},
                   {"r.csv", validated_recording()},
                   {"i.json", R"({"instrument": {"id": "cell", "force": "much"}})"}})},
      {type, "radius without a probe", command + " --instrument {}/i.json",
       with_files({{"l.json", law(fit)},
                   {"r.csv", validated_recording()},
                   {"i.json", R"({"instrument": {"id": "cell", "radius": "10 um"}})"}})},
      {type, "share of a radius of what", command + " --instrument {}/i.json",
       with_files({{"l.json", law(fit)},
                   {"r.csv", validated_recording()},
                   {"i.json", R"({"instrument": {"id": "cell", "radius": "1 %"}})"}})},
      {type, "new specimen of a law without recordings", command + " --new-specimen",
       fitted(validated_recording())},
      {type, "unknown category of evidence",
       command + " --credibility {}/out --evidence checks={}/l.json",
       fitted(validated_recording())},
      {type, "missing evidence",
       command + " --folder {}/out --credibility {}/out2 --evidence plausibility={}/gone.json",
       fitted(validated_recording())},
      {type, "evidence without a page", command + " --evidence plausibility={}/l.json",
       fitted(validated_recording())},
      {type, "--recheck beside a law", command + " --recheck {}/p.html",
       fitted(validated_recording())},
      {type, "no page", recheck, with_files({{"p.html", "<html></html>"}})},
      {type, "missing page", recheck, with_files({})},
      {type, "page whose record is no JSON", recheck, page("{\"tpm\": ")},
      {type, "page of an older format", recheck, page(R"({"tpm": "1", "summary": {}})")},
      {type, "page whose invocation is damaged", recheck, page(whole + "{\"law\": 3}}")},
      {type, "page whose law is gone", recheck,
       page(whole + R"({"law": "{}/gone.json", "recordings": ["r.csv"], "reading": {}, "units": [],
"contact_force": "", "quantities": [], "require": "", "placement": "held", "instrument": "",
"calibration_instrument": "", "at": "", "evidence": []}})")},
  };
}

}  // namespace tpm::test
