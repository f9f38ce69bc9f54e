#pragma once
// Folders of recordings, laws, scenes and options of tables with faults (test_errors.cpp).
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "error_case.hpp"

namespace tpm::test::error_cases {
using namespace files;

inline std::vector<ErrorCase> recording_folder_cases() {
  const std::string type = "folder of recordings";
  std::string csv = "time [s],depth [mm],force [N],animal\n";
  for (int i = 0; i < 30; ++i) {
    const double depth_mm = std::min(0.2 * i, 3.0);
    csv += std::to_string(0.1 * i) + "," + std::to_string(depth_mm) + "," +
           std::to_string(0.1 * depth_mm) + "," + (i < 20 ? "a" : "b") + "\n";
  }
  const auto folder = with_files({{"a1.csv", csv}});
  const auto fit = [](const std::string& options) {
    return "fit {} --no-draw --laws linear-1 " + options + " -o {}/out";
  };
  return {
      {type, "no recording", "fit {} --no-draw -o {}/out", with_files({})},
      {type, "name without a specimen", fit("--group-by '(cow[0-9])'"), folder},
      {type, "two groups in a pattern", fit("--group-by '(a)(1)'"), folder},
      {type, "no pattern", fit("--group-by '(['"), folder},
      {type, "no such column", fit("--group-by cow"), folder},
      {type, "column of two values", fit("--group-by animal"), folder},
      {type, "reference depth 0", fit("--reference '0 mm'"), folder},
      {type, "comparison of one folder", fit("--compare"), folder},
      {type, "comparison with no folder", "fit {} gone --compare --no-draw -o {}/out", folder},
      {type, "folder that tpm fit wrote", fit(""), with_files({{"selection.json", "{}"}})},
      {type, "the same file twice", fit(""), with_files({{"a1.csv", csv}, {"a2.csv", csv}})},
      {type, "times that do not rise", fit("--times '1 s, 1 s'"), folder},
      {type, "times of another law", fit("--times '1 s, 2 s'"), folder},
      {type, "times of two laws",
       "fit {} --no-draw --laws linear-1,linear-2 --times '1 s' -o {}/out", folder},
      {type, "group of one recording", "fit {}/a1.csv --no-draw --group-by animal -o {}/out",
       folder},
  };
}

inline const std::string kLaw = R"({"law": "linear-1", "drive": "indentation_depth",
"response": "contact_force", "reference_m": 0.001, "provenance": "assumed",
"parameters": {"k_inf_N_per_m": 20.0, "k1_N_per_m": 30.0, "tau1_s": 1.5}})";

inline std::vector<ErrorCase> law_cases() {
  const std::string type = "law file";
  const std::string spectrum = "predict {}/l.json --frequencies '1 Hz' -o {}/out";
  const auto law = [](std::string text) { return with_files({{"l.json", std::move(text)}}); };
  const auto with = [&](const std::string& from, const std::string& to) {
    return law(replaced(kLaw, from, to));
  };
  const std::string to_febio = "export {}/l.json --to febio -o {}/out";
  const std::string bar = R"("k1_N_per_m": 30.0, "tau1_s": 1.5)";
  return {
      {type, "missing", spectrum, with_files({})},
      {type, "empty", spectrum, law("")},
      {type, "truncated", spectrum, law(kLaw.substr(0, 90))},
      {type, "binary garbage", spectrum, law(kGarbage)},
      {type, "missing key", spectrum, with("\"reference_m\": 0.001, ", "")},
      {type, "unknown key", spectrum, with("\"provenance\"", "\"x\": 1, \"provenance\"")},
      {type, "unknown law", spectrum, with("linear-1", "cubic-1")},
      {type, "misspelt law", spectrum, with("linear-1", "linaer-1")},
      {type, "missing parameter", spectrum, with(", \"tau1_s\": 1.5", "")},
      {type, "unknown parameter", spectrum, with("tau1_s", "tau1_ms")},
      {type, "negative time", spectrum, with("1.5", "-1.5")},
      {type, "strip in m", spectrum, with("contact_force", "stress")},
      {type, "Hertz contact of a strip", spectrum,
       law(replaced(replaced(replaced(replaced(kLaw, "linear-1", "hertz-1"), "indentation_depth",
                                      "relative_length"),
                             "contact_force", "stress"),
                    "reference_m", "reference"))},
      {type, "frequency 0", "predict {}/l.json --frequencies \"0 Hz\" -o {}/out", law(kLaw)},
      {type, "frequency that overflows",
       "predict {}/l.json --frequencies \"0.001 Hz : 1e308 Hz : 16\" -o {}/out", law(kLaw)},
      {type, "frequency the law does not reach",
       "predict {}/l.json --frequencies \"1 Hz : 1e308 Hz : 16\" -o {}/out", law(kLaw)},
      {type, "frequencies that do not rise",
       "predict {}/l.json --frequencies \"2 Hz, 1 Hz\" -o {}/out", law(kLaw)},
      {type, "frequencies beside a protocol",
       "predict {}/l.json --frequencies \"1 Hz\" --hold \"1 s\" -o {}/out", law(kLaw)},
      {type, "depth imposed on a law of strain",
       "predict {}/l.json --depth \"4 mm\" --rate \"2 mm/s\" --hold \"1 s\"",
       with_files({{"l.json", R"({"law": "linear-1", "drive": "strain", "response": "stress",
"reference": 1, "provenance": "assumed",
"parameters": {"k_inf_Pa": 20.0, "k1_Pa": 30.0, "tau1_s": 1.5}})"}})},
      {type, "table of G(t) in a recording's place", "predict {}/l.json {}/g.csv",
       with_files({{"l.json", kLaw}, {"g.csv", "Time (s),G(t) (Pa)\n0.1,9\n0.2,8\n0.3,7\n"}})},
      {type, "unknown program", "export {}/l.json --to nastran -o {}/out", law(kLaw)},
      {type, "misspelt program", "export {}/l.json --to abaqsu -o {}/out", law(kLaw)},
      {type, "tension in FEBio", to_febio,
       law(replaced(replaced(kLaw, "linear-1", "linear-1-elastic"), bar,
                    bar + ", \"k_tension_N_per_m\": 2.0"))},
      {type, "fluid in FEBio", to_febio,
       law(replaced(replaced(kLaw, "linear-1", "linear-1-fluid"), "\"k_inf_N_per_m\": 20.0, ",
                    ""))},
      {type, "density of a law", "export {}/l.json --to ansys --density 900 -o {}/out", law(kLaw)},
      {type, "area without length", "export {}/l.json --to ansys --area \"3 mm^2\" -o {}/out",
       law(kLaw)},
  };
}

inline std::string polygon(int corners) {
  std::string obj, face = "f";
  for (int i = 0; i < corners; ++i) {
    const double angle = 6.283185307179586 * i / corners;
    obj += "v " + std::to_string(std::cos(angle)) + " " + std::to_string(std::sin(angle)) + " 0\n";
    face += " " + std::to_string(i + 1);
  }
  return obj + face + "\n";
}

/// Spheres of a cube of 3 x 3 x 3, a column of two on it, and a tip out of reach of all but one.
inline std::string tower_with_tip() {
  std::string spheres;
  const auto add = [&](int x, int y, int z, int layer) {
    spheres += (spheres.empty() ? "" : ", ") + ("{\"at\": [" + std::to_string(x)) + ", " +
               std::to_string(y) + ", " + std::to_string(z) +
               "], \"layer\": " + std::to_string(layer) + ", \"normal\": [0, 0, 1]}";
  };
  for (int layer = 1; layer <= 3; ++layer) {
    for (int i = 0; i < 9; ++i) add(20 * (i % 3), 20 * (i / 3), 60 - 20 * layer, layer);
  }
  add(20, 20, 60, 2);
  add(20, 20, 88, 1);
  return "[" + spheres + "]";
}

inline std::vector<ErrorCase> scene_cases() {
  const std::string type = "scene";
  const std::string check = "network check {}/s.json";
  const auto scene = [](std::string text) { return with_files({{"s.json", std::move(text)}}); };
  // A dented tetrahedron without its last face.
  const std::string corners = "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nv 3 3 3\n";
  const std::string open = corners + "f 1 3 2\nf 1 2 4\nf 2 3 5\nf 3 4 5\nf 4 2 5\n";
  const auto mesh = [&](std::string obj) {
    return with_files(
        {{"m.obj", std::move(obj)},
         {"s.json", R"({"organ": {"kind": "mesh", "mesh": "m.obj", "unit": "cm", "count": 90}})"}});
  };
  const auto liver = [&](const std::string& more) {
    return scene(R"({"organ": {"kind": "liver"}, )" + more + "}");
  };
  const auto organ = [&](const std::string& keys) { return scene(R"({"organ": {)" + keys + "}}"); };
  const std::string listed = R"("kind": "listed", "unit": "mm", "spacing": "20 mm", "spheres": )";
  return {
      {type, "missing", check, with_files({})},
      {type, "empty", check, scene("")},
      {type, "truncated", check, scene("{\"organ\": {")},
      {type, "binary garbage", check, scene(kGarbage)},
      {type, "no organ", check, scene("{}")},
      {type, "organ predicted without its fit",
       "predict {}/s.json --depth \"1 mm\" --rate \"1 mm/s\" --hold \"1 s\" -o {}/out",
       organ(R"("kind": "liver")")},
      {type, "organ exported with a law's option",
       "export {}/s.json --to sofa --radius \"2 mm\" -o {}/out", organ(R"("kind": "liver")")},
      {type, "organ exported as a law", "export {}/s.json --to abaqus -o {}/out",
       organ(R"("kind": "liver")")},
      {type, "law in its place", "simulate {}/s.json -o {}/out.h5",
       scene(R"({"law": "linear-1", "response": "contact_force"})")},
      {type, "unknown key", check, organ(R"("kind": "liver", "cuont": 424)")},
      {type, "key of another kind", check, organ(R"("kind": "liver", "cells": [2, 2, 2])")},
      {type, "unknown kind", check, organ(R"("kind": "kidney")")},
      {type, "one sphere", check, organ(R"("kind": "liver", "count": 1)")},
      {type, "NaN", check, organ(R"("kind": "liver", "spacing": "nan mm")")},
      {type, "overflow", check, organ(listed + R"([{"at": [0, 0, 1e400]}, {"at": [0, 0, 1]}])")},
      {type, "spacing and width", check,
       organ(R"("kind": "liver", "spacing": "20 mm", "shape": {"width": "21 cm"})")},
      {type, "measure out of range", check,
       organ(R"("kind": "liver", "shape": {"notch_depth": 0.5})")},
      {type, "coinciding spheres", check,
       organ(listed + R"([{"at": [0, 0, 0]}, {"at": [20, 0, 0]}, {"at": [20, 0, 0]}])")},
      {type, "normal without length", check,
       organ(listed + R"([{"at": [0, 0, 0], "normal": [0, 0, 0]}, {"at": [20, 0, 0]}])")},
      {type, "cells that 32 bits cut", check,
       scene(R"({"organ": {"kind": "block", "cells": [4294967299, 3, 3]}})")},
      {type, "seed above 2^63", check, organ(R"("kind": "liver", "seed": 9223372036854775809)")},
      {type, "seed above 2^53", check, organ(R"("kind": "liver", "seed": 9007199254740993)")},
      {type, "open mesh", check, mesh(open)},
      {type, "face of too many corners", check, mesh(polygon(5000))},
      {type, "coordinate that is no number", check, mesh("v 0 0 0\nv 0 nan 0\n" + open)},
      {type, "corner without a vertex", check, mesh(open + "f 1 2 9\n")},
      {type, "mesh cut off", check,
       with_files({{"m.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0"},
                   {"s.json", R"({"organ": {"kind": "mesh", "mesh": "m.stl", "unit": "cm"}})"}})},
      {type, "more triangles than the mesh holds", check,
       with_files({{"m.stl", std::string(80, ' ') + "\xff\xff\xff\x7f" + std::string(50, '\1')},
                   {"s.json", R"({"organ": {"kind": "mesh", "mesh": "m.stl", "unit": "cm"}})"}})},
      {type, "mesh that names an endless file", check, mesh("mtllib /dev/zero\n" + open)},
      {type, "landing far off", check,
       with_files(
           {{"m.obj", corners + "f 1 3 2\nf 1 2 4\nf 2 3 5\nf 3 4 5\nf 4 2 5\nf 1 4 3\n"},
            {"s.json", R"({"organ": {"kind": "mesh", "mesh": "m.obj", "unit": "cm", "count": 90,
"landing": ["50 m", "0 m", "0 m"]}})"}})},
      {type, "missing mesh", check,
       organ(R"("kind": "mesh", "mesh": "m.stl", "unit": "mm", "count": 90)")},
      {type, "mesh without unit", check, organ(R"("kind": "mesh", "mesh": "m.stl", "count": 90)")},
      {type, "negative stiffness", check, liver(R"("material": {"Eprime": "-12 kPa"})")},
      {type, "wrong unit", check, liver(R"("material": {"E1": "12 mm"})")},
      {type, "support below 1", check, liver(R"("bonds": {"support": 0.9})")},
      {type, "no anchors", check, liver(R"("anchors": [])")},
      {type, "no sphere of that number", check,
       liver(R"("anchors": [{"kind": "spheres", "spheres": [425]}])")},
      {type, "anchors hold nothing", check,
       liver(
           R"("anchors": [{"kind": "half_space", "point": ["9 m", "0 m", "0 m"], "normal": [1, 0, 0]}])")},
      {type, "contact anchored", check,
       liver(R"("anchors": [{"kind": "far_side", "fraction": 1}])")},
      {type, "slider anchored", check,
       liver(R"("anchors": [{"kind": "spheres", "spheres": [7]}], "sliders": [7])")},
      {type, "far side without contact", check,
       scene(
           R"({"organ": {"kind": "block", "cells": [2, 2, 2]}, "anchors": [{"kind": "far_side"}]})")},
      {type, "two planes to slide on", check, liver(R"("anchors": [{"kind": "far_side"},
         {"kind": "half_space", "point": ["0 mm", "136 mm", "57 mm"], "normal": [0, 1, 0], "slides": true},
         {"kind": "half_space", "point": ["0 mm", "136 mm", "57 mm"], "normal": [1, 0, 0], "slides": true}])")},
      {type, "modulus of the tissue of a shell", check, liver(R"("material": {"E": "3 kPa"})")},
      {type, "Poisson ratio without a modulus", check, liver(R"("material": {"nu": 0.3})")},
      {type, "Poisson ratio of another tissue", check,
       scene(
           R"({"organ": {"kind": "liver", "count": 3000, "filling": "solid"}, "material": {"E": "3 kPa", "nu": 0.49}})")},
      {type, "modulus of the tissue beside the law paper", check,
       liver(R"("bonds": {"spacing_law": "paper"}, "material": {"E": "3 kPa"})")},
      {type, "one radial bond a sphere", check, liver(R"("bonds": {"diagonals": false})")},
      {type, "unguided star", check, scene(R"({"organ": {"kind": "star"}, "sliders": []})")},
      {type, "scene and options", check + " --spheres 424", liver(R"("title": "t")")},
      {type, "tip of a spike that one sphere holds", "network build {}/s.json -o {}/out",
       organ(listed + tower_with_tip())},
      {type, "the same to MuJoCo", "export {}/s.json --to mjcf -o {}/out",
       organ(listed + tower_with_tip())},
      {type, "bad count", "network build --spheres 1 -o {}/out", with_files({})},
  };
}

inline std::vector<ErrorCase> table_option_cases() {
  const std::string type = "options of tpm paper tables";
  return {
      {type, "depth that overflows", "paper tables --depths '1e300 mm' -o {}/out", with_files({})},
      {type, "depth in newtons", "paper tables --depths '2,8 N' -o {}/out", with_files({})},
      {type, "infinite depth", "paper tables --depths '1e400 mm' -o {}/out", with_files({})},
      {type, "depth without unit", "paper tables --depths 2,8 -o {}/out", with_files({})},
  };
}

}  // namespace tpm::test::error_cases
