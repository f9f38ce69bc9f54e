#pragma once
#include <string>

#include "tpm/haptics/session/session.hpp"

namespace tpm::test {
using namespace haptics;

/// A short session on the paper's star: one indentation to 4 mm and one load.
inline Json short_session() {
  return Json::parse(R"({
    "title": "short",
    "model": {"kind": "element", "scene": {
      "organ": {"kind": "star", "spacing": "30 mm"},
      "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e4 Pa s"}}},
    "indentations": {"depths": ["4 mm"], "rates": ["4 mm/s"], "hold": "2 s", "rest": "1 s"},
    "creep": {"loads": ["0.2 N"], "hold": "1 s", "rest": "1 s"}})");
}

/// One indentation of a small liver. @param kind of the model
inline Json network_session(const char* kind, const char* eta1 = "2.4e4 Pa s") {
  Json json = Json::parse(R"({
    "model": {"kind": "", "scene": {
      "organ": {"kind": "liver", "count": 60},
      "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa"},
      "anchors": [{"kind": "far_side", "fraction": 0.3}]}},
    "indentations": {"depths": ["4 mm"], "rates": ["8 mm/s"], "hold": "0.4 s", "rest": "0.2 s"}})");
  json["model"]["kind"] = kind;
  json["model"]["scene"]["material"]["eta1"] = eta1;
  return json;
}

/// A ball that presses into the same liver and slides over it.
inline Json slide_session() {
  Json json = network_session("surface");
  json.erase("indentations");
  json["slides"] = Json::parse(R"({"depths": ["4 mm"], "press": "10 mm/s", "direction": [0, 1, -3],
                                   "distance": "20 mm", "rate": "20 mm/s", "rest": "0.2 s"})");
  return json;
}

inline HilSession parsed(const Json& json) {
  return parse_session(json, "session", {});
}

inline Json with(Json json, const char* pointer, const Json& value) {
  json[Json::json_pointer(pointer)] = value;
  return json;
}

}  // namespace tpm::test
