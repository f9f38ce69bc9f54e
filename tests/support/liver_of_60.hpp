#pragma once
// What the tests of materials on organs share.
#include "tpm/files/json.hpp"
#include "tpm/fit/predict/organ_material.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::testing {
using namespace fit;

inline Json liver_of_60() {
  return Json::parse(R"({"organ": {"kind": "liver", "count": 60, "spacing": "20 mm"},
                         "anchors": [{"kind": "far_side"}], "contacts": [{"kind": "sphere"}]})");
}

/// To 2 mm in 1 s and held for 5 s, four samples a second.
inline MaterialMotion ramp_to_2_mm() {
  std::vector<double> times;
  for (int i = 0; i <= 24; ++i) times.push_back(0.25 * i);
  return motion_of_protocol(ramp_and_hold(2e-3, 2e-3, 5.0), times);
}

}  // namespace tpm::testing
