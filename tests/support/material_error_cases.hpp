#pragma once
// Materials of a scene that mean nothing, and libraries that are no device plugin
// (test_errors.cpp).
#include "error_case.hpp"

namespace tpm::test {

inline std::vector<ErrorCase> material_error_cases() {
  const std::string type = "material of a scene";
  const std::string check = "network check {}/s.json";
  const auto material = [](const std::string& keys) {
    return with_files(
        {{"s.json", R"({"organ": {"kind": "liver", "count": 60}, "material": {)" + keys + "}}"}});
  };
  const auto region = [&](const std::string& keys) {
    return material(R"("regions": [{)" + keys + "}]");
  };
  const auto run =
      [](const std::string& keys, const std::string& kind) {
        return with_files({{"s.json", R"({"organ": {"kind": "star"}, "material": {)" + keys + R"(},
      "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s", "hold": "1 s"},
      "formulation": {"kind": ")" + kind + R"("}})"}});
      };
  const std::string two = R"("Einf": "5 kPa", "branches": [{"g": "3 kPa", "tau": "1 s"},
    {"g": "2 kPa", "tau": "9 s"}])";
  std::string many;
  for (int i = 0; i < 41; ++i) {
    many += std::string(i == 0 ? "" : ", ") + R"({"g": "1 kPa", "tau": "1 s"})";
  }
  return {
      {type, "both ways to say it", check, material(R"("E1": "12 kPa", "Einf": "6 kPa")")},
      {type, "branch of no time", check, material(R"("branches": [{"g": "3 kPa", "tau": "0 s"}])")},
      {type, "negative branch", check, material(R"("branches": [{"g": "-3 kPa", "tau": "1 s"}])")},
      {type, "41 branches", check, material(R"("branches": [)" + many + "]")},
      {type, "no modulus", check, material(R"("Einf": "0 kPa")")},
      {type, "shape without its length", check,
       material(R"("Einf": "5 kPa", "potential": {"shape": "cubic"})")},
      {type, "length of a linear shape", check,
       material(R"("Einf": "5 kPa", "kernel": {"shape": "linear", "stiffening": "5 mm"})")},
      {type, "unknown shape", check,
       material(R"("Einf": "5 kPa", "potential": {"shape": "quintic"})")},
      {type, "length of 0", check,
       material(R"("Einf": "5 kPa", "potential": {"shape": "sinh", "stiffening": "0 mm"})")},
      {type, "fractional order above 1", check,
       material(R"("fractional": {"g": "8 kPa", "order": 1.5, "tau": "1 s", "shortest": "10 ms",
         "longest": "100 s"})")},
      {type, "fractional of too many branches", check,
       material(R"("fractional": {"g": "8 kPa", "order": 0.3, "tau": "1 s", "shortest": "1 us",
         "longest": "1e5 s", "error": 1e-6})")},
      {type, "region without spheres", check,
       region(R"("kind": "ball", "centre": ["9 m", "0 m", "0 m"], "radius": "1 mm", "factor": 2)")},
      {type, "region of two things", check,
       region(R"("kind": "layer", "layer": 1, "factor": 2, "material": {"Einf": "5 kPa"})")},
      {type, "key of another region", check,
       region(R"("kind": "layer", "layer": 1, "radius": "1 mm", "factor": 2)")},
      {type, "ball of two places", check,
       region(R"("kind": "ball", "centre": ["0 m", "0 m", "0 m"], "below_contact": "1 mm",
         "radius": "1 mm", "factor": 2)")},
      {type, "factor of 0", check, region(R"("kind": "layer", "layer": 1, "factor": 0)")},
      {type, "factor that is no formula", check,
       region(R"("kind": "function", "factor": "1 + q")")},
      {type, "laws of its own in closed form", "simulate {}/s.json -o {}/out.h5",
       run(two, "closed_form")},
      {type, "regions in closed form", "simulate {}/s.json -o {}/out.h5",
       run(R"("regions": [{"kind": "spheres", "spheres": [2], "factor": 2}])", "closed_form")},
  };
}

inline std::vector<ErrorCase> plugin_error_cases() {
  const std::string type = "device plugin";
  const std::string devices = "hil devices --plugin {}/p.so";
  return {
      {type, "missing", devices, with_files({})},
      {type, "empty", devices, with_files({{"p.so", ""}})},
      {type, "binary garbage", devices, with_files({{"p.so", kGarbage}})},
      {type, "no library", devices, with_files({{"p.so", std::string(4096, 'x')}})},
  };
}

}  // namespace tpm::test
