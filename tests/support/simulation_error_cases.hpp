#pragma once
#include "error_case.hpp"

namespace tpm::test {

/// Scenes of which the tissue is sound and what is done to it is not.
inline std::vector<ErrorCase> simulation_error_cases() {
  const std::string type = "simulation scene";
  const std::string simulate = "simulate {}/s.json -o {}/out.h5 --folder {}/out";
  const auto scene = [](const std::string& more) {
    return with_files({{"s.json", R"({"organ": {"kind": "liver"})" + more + "}"}});
  };
  const std::string push = R"("protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s",
    "hold": "1 s"})";
  const auto pushed = [&](const std::string& more) { return scene(", " + push + ", " + more); };
  const auto protocol = [&](const std::string& keys) {
    return scene(R"(, "protocol": {)" + keys + "}");
  };
  const auto contact = [&](const std::string& keys) {
    return pushed(R"("contacts": [{"kind": "sphere", )" + keys + "}]");
  };
  return {
      {type, "no protocol", simulate, scene("")},
      {type, "unknown key", simulate, protocol(R"("kind": "creep", "laod": "1 N")")},
      {type, "key of another protocol", simulate,
       protocol(R"("kind": "creep", "load": "1 N", "duration": "1 s", "depth": "1 mm")")},
      {type, "missing key of a protocol", simulate, protocol(R"("kind": "creep", "load": "1 N")")},
      {type, "contact outside the organ", simulate,
       contact(R"("at": ["0 mm", "136 mm", "-200 mm"])")},
      {type, "no sphere of that number", simulate, contact(R"("number": 425)")},
      {type, "contact said twice", simulate,
       contact(R"("number": 71, "at": ["2 mm", "136 mm", "57 mm"])")},
      {type, "tool without a size", simulate, pushed(R"("contacts": [{"kind": "ball"}])")},
      {type, "tool wider than the organ", simulate,
       pushed(R"("contacts": [{"kind": "ball", "radius": "2 m"}])")},
      {type, "key of another contact", simulate, contact(R"("radius": "2 mm")")},
      {type, "nothing driven", simulate,
       pushed(R"("contacts": [{"kind": "punch", "radius": "2 mm", "share": 0}])")},
      {type, "tool that pulls", simulate,
       scene(R"(, "contacts": [{"kind": "ball", "radius": "2 mm"}], "protocol": {"kind": "knots",
         "knots": [{"time": "0 s", "load": "0 N"}, {"time": "1 s", "load": "-1 N"}]})")},
      {type, "tool without mass among masses", simulate,
       pushed(R"("contacts": [{"kind": "ball", "radius": "2 mm"}],
         "formulation": {"kind": "inertial"})")},
      {type, "one sphere driven twice", simulate,
       pushed(R"("contacts": [{"kind": "sphere"}, {"kind": "patch", "radius": "30 mm"}])")},
      {type, "patch over an anchored sphere", simulate,
       scene(", " + push +
             R"(, "anchors": [{"kind": "far_side"}, {"kind": "spheres", "spheres": [70]}],
         "contacts": [{"kind": "patch", "radius": "20 cm"}])")},
      {type, "contact without a protocol", simulate,
       scene(R"(, "contacts": [{"kind": "sphere", )" + push +
             R"(}, {"kind": "sphere", "number": 80}])")},
      {type, "protocol beside those of the contacts", simulate,
       pushed(R"("contacts": [{"kind": "sphere", )" + push + "}]")},
      {type, "protocols that begin apart", simulate,
       pushed(R"("contacts": [{"kind": "sphere"}, {"kind": "sphere", "number": 80,
         "protocol": {"kind": "knots", "knots": [{"time": "1 s", "depth": "0 mm"},
         {"time": "2 s", "depth": "1 mm"}]}}])")},
      {type, "first contact stands still beside another", simulate,
       scene(R"(, "contacts": [{"kind": "sphere", "protocol": {"kind": "knots",
         "knots": [{"time": "0 s", "depth": "0 mm"}, {"time": "2 s", "depth": "0 mm"}]}},
         {"kind": "sphere", "number": 80, )" +
             push + "}]")},
      {type, "share beside a protocol of its own", simulate, contact(R"("share": 0.5, )" + push)},
      {type, "protocols of their own, static", simulate,
       scene(R"(, "formulation": {"kind": "static"}, "contacts": [{"kind": "sphere", )" + push +
             R"(}, {"kind": "sphere", "number": 80, )" + push + "}]")},
      {type, "recording that is not there", simulate, scene(R"(, "contacts": [{"kind": "sphere",
         "protocol": {"kind": "recording", "file": "none.csv"}}])")},
      {type, "mass said twice", simulate,
       pushed(R"("loads": [{"kind": "gravity", "direction": [0, -1, 0], "mass_kg": 1,
         "density_kg_per_m3": 1000}])")},
      {type, "pressure on nothing", simulate,
       pushed(R"("loads": [{"kind": "pressure", "pressure": "1 kPa",
         "centre": ["9 m", "0 m", "0 m"], "radius": "1 mm"}])")},
      {type, "pressure on an inner sphere", simulate,
       pushed(R"("loads": [{"kind": "pressure", "pressure": "1 kPa", "spheres": [424]}])")},
      {type, "gravity, static", simulate, pushed(R"("formulation": {"kind": "static"},
         "loads": [{"kind": "gravity", "direction": [0, -1, 0]}])")},
      {type, "weight under which it buckles", simulate,
       pushed(R"("loads": [{"kind": "gravity", "direction": [0, -1, 0], "mass_kg": 1000}])")},
      {type, "direction without length", simulate, contact(R"("direction": [0, 0, 0])")},
      {type, "load on an anchored sphere", simulate,
       scene(R"(, "anchors": [{"kind": "far_side"}, {"kind": "spheres", "spheres": [5]}],
         "contacts": [{"kind": "sphere", "number": 5}],
         "protocol": {"kind": "creep", "load": "0.1 N", "duration": "1 s"})")},
      {type, "load of 1e6 N", simulate,
       protocol(R"("kind": "creep", "load": "1e6 N", "duration": "1 s")")},
      {type, "load of 1e6 N, static", simulate,
       scene(R"(, "protocol": {"kind": "creep", "load": "1e6 N", "duration": "1 s"},
         "formulation": {"kind": "static"})")},
      {type, "load of 1e6 N, with mass", simulate,
       scene(R"(, "protocol": {"kind": "creep", "load": "1e6 N", "duration": "1 s"},
         "formulation": {"kind": "inertial"})")},
      {type, "depth through the organ", simulate,
       protocol(R"("kind": "ramp_hold", "depth": "30 cm", "rate": "4 mm/s", "hold": "1 s")")},
      {type, "NaN", simulate,
       protocol(R"("kind": "ramp_hold", "depth": "nan mm", "rate": "4 mm/s", "hold": "1 s")")},
      {type, "negative depth", simulate,
       protocol(R"("kind": "ramp_hold", "depth": "-4 mm", "rate": "4 mm/s", "hold": "1 s")")},
      {type, "rate of 0", simulate,
       protocol(R"("kind": "ramp_hold", "depth": "4 mm", "rate": "0 mm/s", "hold": "1 s")")},
      {type, "negative stiffness", simulate, pushed(R"("material": {"E2": "-12 kPa"})")},
      {type, "no anchors", simulate, pushed(R"("anchors": [])")},
      {type, "knots of two kinds", simulate,
       protocol(R"("kind": "knots", "knots": [{"time": "0 s", "depth": "0 mm"},
         {"time": "1 s", "load": "1 N"}])")},
      {type, "knots back in time", simulate,
       protocol(R"("kind": "knots", "knots": [{"time": "1 s", "depth": "0 mm"},
         {"time": "0 s", "depth": "1 mm"}])")},
      {type, "jump of depth with mass", simulate,
       scene(R"(, "protocol": {"kind": "step_hold", "depth": "2 mm", "hold": "1 s"},
         "formulation": {"kind": "inertial"})")},
      {type, "damping without mass", simulate,
       pushed(R"("formulation": {"kind": "quasi_static", "damping_ratio": 0.1})")},
      {type, "solver with mass", simulate,
       pushed(R"("formulation": {"kind": "inertial", "solver": "direct"})")},
      {type, "springs without a comparison", simulate,
       pushed(R"("formulation": {"springs": "equal"})")},
      {type, "output after the end", simulate, pushed(R"("outputs": {"times": ["3 s"]})")},
      {type, "too many outputs", simulate, pushed(R"("outputs": {"spacing": "1 us"})")},
      {type, "tolerance of 0", simulate, pushed(R"("tolerance": 0)")},
      {type, "checkpoints of another unit", simulate + " --checkpoint-every '5 mm'",
       pushed(R"("title": "t")")},
      {type, "checkpoints without a pause", simulate + " --checkpoint-every '0 s'",
       pushed(R"("title": "t")")},
      {type, "tolerance of a plan that is not asked for",
       "simulate {}/s.json --tolerance 1e-3 -o {}/out.h5", pushed(R"("title": "t")")},
      {type, "output of another kind", "simulate {}/s.json -o {}/out.csv",
       pushed(R"("title": "t")")},
      {type, "output cannot be written", "simulate {}/s.json -o /proc/none/out.h5",
       pushed(R"("title": "t")")},
      {type, "garbage as checkpoint", simulate,
       with_files({{"s.json", R"({"organ": {"kind": "liver"}, )" + push + "}"},
                   {"out.h5.checkpoint", kGarbage}})},
  };
}

}  // namespace tpm::test
