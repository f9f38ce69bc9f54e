#pragma once
// Bad input about the placement of recordings: priors, drifts, held contacts, imposed loads.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "error_case.hpp"

namespace tpm::test {

/// A ramp to 2 mm in 2 s and a hold to 4 s.
inline std::string ramp_recording() {
  std::string text = "time [s],depth [mm],force [N]\n";
  for (int i = 0; i <= 40; ++i) {
    const double depth = std::min(0.1 * i, 2.0);
    text += fmt::format("{:.1f},{:.1f},{:.4f}\n", 0.1 * i, depth, 0.01 * depth + 1e-4 * (i % 3));
  }
  return text;
}

/// The same 1 s later, with a cell that starts far off.
inline std::string recording_with_start_up() {
  std::string text = "time [s],depth [mm],force [N]\n";
  for (int i = 0; i <= 50; ++i) {
    const double depth = std::min(0.1 * std::max(i - 10, 0), 2.0);
    text += fmt::format("{:.1f},{:.1f},{:.4f}\n", 0.1 * i, depth,
                        i < 3 ? 9.99 : 0.01 * depth + 1e-4 * (i % 3));
  }
  return text;
}

/// A stress that is ramped and held while the strain goes on, under noise.
inline std::string creep_recording() {
  std::string text = "time [s],strain [%],stress [Pa]\n";
  for (int i = 0; i <= 200; ++i) {
    const double t = 0.1 * i;
    text +=
        fmt::format("{:.1f},{:.4f},{:.1f}\n", t,
                    std::min(t, 2.0) + 3.0 * (1.0 - std::exp(-0.2 * t)) + 0.05 * (i * 7 % 5 - 2),
                    50.0 * std::min(t, 2.0));
  }
  return text;
}

/// A strain that goes on under a stress that is there from the first row on.
inline std::string loaded_creep_recording() {
  std::string text = "time [s],strain [%],stress [Pa]\n";
  for (int i = 0; i <= 300; ++i) {
    const double t = 0.1 * i, crept = 3.0 * (1.0 - std::exp(-0.2 * std::min(t, 20.0)));
    const bool loaded = i <= 200;
    text += fmt::format("{:.1f},{:.4f},{}\n", t, crept * (loaded ? 1.0 : std::exp(4.0 - 0.2 * t)),
                        loaded ? "100.0" : "0.0");
  }
  return text;
}

inline std::vector<ErrorCase> placement_error_cases() {
  const std::string type = "placement of a recording";
  const std::string config = R"({"title": "t", "law": {"name": "linear", "reference": "2 mm"},
"parameters": {
  "k_inf": {"start": "10 N/m", "lower": "1 N/m", "upper": "100 N/m",
            "prior": {"mean": "10 N/m", "sd": "1 N/m"}},
  "drift": {"start": "0 mN/s", "lower": "-1 mN/s", "upper": "1 mN/s", "scale": "linear",
            "drift": {"of": "r.csv", "origin": "0 s"}}},
"data": [{"dataset": "r.csv", "protocol": {"kind": "measured"},
          "noise": {"kind": "absolute", "absolute": "1 mN"}}]})";
  const auto with = [config](const std::string& from, const std::string& to) {
    std::string changed = config;
    const auto at = changed.find(from);
    if (at == std::string::npos) throw std::logic_error("nothing to replace: " + from);
    return with_files(
        {{"r.csv", ramp_recording()}, {"f.json", changed.replace(at, from.size(), to)}});
  };
  const std::string fit = "fit {}/f.json -o {}/out";
  const auto files = with_files({{"r.csv", ramp_recording()}, {"c.csv", creep_recording()}});
  const std::string law = R"({"law": "linear", "drive": "indentation_depth",
"response": "contact_force", "reference_m": 0.002, "provenance": "assumed",
"parameters": {"k_inf": 10}})";
  return {
      {type, "drift of no recording", fit, with("\"of\": \"r.csv\"", "\"of\": \"q.csv\"")},
      {type, "drift beside sets", fit,
       with("\"drift\": {\"of\"", "\"sets\": [\"k_inf\"], \"drift\": {\"of\"")},
      {type, "drift without a second", fit, with("0 mN/s", "0 mN")},
      {type, "prior of standard deviation 0", fit, with("\"sd\": \"1 N/m\"", "\"sd\": \"0 N/m\"")},
      {type, "imposed load without a recording", fit,
       with("\"protocol\": {\"kind\": \"measured\"}",
            "\"protocol\": {\"kind\": \"static\"}, \"imposed\": \"response\"")},
      {type, "contact deeper than the recording",
       "fit {}/r.csv --contact \"3 mm\" --no-draw -o {}/out", files},
      {type, "contact beside a force of contact",
       "fit {}/r.csv --contact \"1 mm\" --contact-force \"2 mN\" --no-draw -o {}/out", files},
      {type, "contact deeper, all laws", "fit {}/r.csv --no-draw --contact \"3 mm\" -o {}/out",
       files},
      {type, "zero in another unit", "fit {}/r.csv --zero \"3 mm\" --no-draw -o {}/out", files},
      {type, "contact with a protocol",
       "predict {}/law.json --depth \"1 mm\" --rate \"1 mm/s\" --hold \"1 s\" --contact \"1 mm\" "
       "-o {}/out",
       with_files({{"law.json", law}})},
      {type, "creep identified sample by sample", "identify {}/c.csv -o {}/out", files},
      {type, "force cell that starts far off", "fit {}/s.csv --no-draw -o {}/out",
       with_files({{"s.csv", recording_with_start_up()}})},
      {type, "two columns that may be the depth", "fit {}/g.csv --no-draw -o {}/out",
       with_files(
           {{"g.csv", "time [s],gap [mm],force [N],sensor [mm]\n0,0,0,0\n1,1,1,2\n2,2,2,3\n"}})},
      {type, "force in grams", "fit {}/g.csv --no-draw -o {}/out",
       with_files({{"g.csv", "time [s],depth [mm],force [g]\n0,0,0\n1,1,1\n2,2,2\n"}})},
      {type, "a voltage as a force", "fit {}/g.csv --no-draw -o {}/out",
       with_files({{"g.csv", "time [s],depth [mm],force [mV]\n0,0,0\n1,1,1\n2,2,2\n"}})},
      {type, "creep from after its load on", "fit {}/l.csv --no-draw -o {}/out",
       with_files({{"l.csv", loaded_creep_recording()}})},
      {type, "a unit that may be two", "fit {}/g.csv --no-draw -o {}/out",
       with_files({{"g.csv", "time [s],depth [mm],force [MN]\n0,0,0\n1,1,1\n2,2,2\n"}})},
      {type, "minutes as metres", "fit {}/g.csv --no-draw -o {}/out",
       with_files({{"g.csv", "time [m],depth [mm],force [N]\n0,0,0\n1,1,1\n2,2,2\n"}})},
      {type, "the same readings twice", "fit {}/r.csv {}/q.csv --no-draw -o {}/out",
       with_files({{"r.csv", ramp_recording()}, {"q.csv", ramp_recording()}})},
  };
}

}  // namespace tpm::test
