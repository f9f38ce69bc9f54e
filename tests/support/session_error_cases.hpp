#pragma once
// Sessions, files of devices, recordings of sessions and files to view with faults
// (test_errors.cpp).
#include <string>
#include <utility>
#include <vector>

#include "curve_error_cases.hpp"
#include "error_case.hpp"

namespace tpm::test::error_cases {
using namespace files;

inline const std::string kSession = R"({"model": {"kind": "condensed", "scene": {
  "organ": {"kind": "liver", "count": 60}, "material": {"eta1": "2.4e5 Pa s"},
  "anchors": [{"kind": "far_side", "fraction": 0.3}]}},
"indentations": {"depths": ["2 mm"], "rates": ["4 mm/s"], "hold": "1 s"}})";

inline std::vector<ErrorCase> session_cases() {
  const std::string type = "session";
  const std::string run_session = "hil run {}/h.json -o {}/out";
  const auto session = [](std::string text) { return with_files({{"h.json", std::move(text)}}); };
  const auto with = [&](const std::string& from, const std::string& to) {
    return session(replaced(kSession, from, to));
  };
  return {
      {type, "missing", run_session, with_files({})},
      {type, "empty", run_session, session("")},
      {type, "truncated", run_session, session(kSession.substr(0, 90))},
      {type, "binary garbage", run_session, session(kGarbage)},
      {type, "missing scene", run_session,
       session(R"({"model": {"kind": "condensed"}, "creep": {"loads": ["1 N"], "hold": "1 s"}})")},
      {type, "table of samples", run_session, session("time [s],depth [mm]\n0,0\n1,1\n")},
      {type, "scene is missing", run_session,
       session(R"({"model": {"scene": "none.json"}, "creep": {"loads": ["1 N"], "hold": "1 s"}})")},
      {type, "contacts of its scene", run_session,
       with("\"material\"", "\"contacts\": [{\"kind\": \"sphere\"}], \"material\"")},
      {type, "loads of its scene", run_session,
       with("\"material\"",
            "\"loads\": [{\"kind\": \"gravity\", \"direction\": [0, -1, 0]}], \"material\"")},
      {type, "nothing to do", run_session,
       session(R"({"model": {"scene": {"organ": {"kind": "liver"}}}})")},
      {type, "unit of a rate", run_session, with("4 mm/s", "4 mm")},
      {type, "rate of 0", run_session, with("4 mm/s", "0 mm/s")},
      {type, "longer than a day", run_session, with("\"1 s\"", "\"1e12 s\"")},
      {type, "unit in its scene", run_session, with("2.4e5 Pa s", "5 mm")},
      {type, "one sphere", run_session, with("60", "1")},
  };
}

inline std::vector<ErrorCase> device_file_cases() {
  const std::string type = "device file";
  const std::string run_session = "hil run {}/h.json --device-file {}/d.json -o {}/out";
  const auto device = [](std::string text) {
    return with_files({{"h.json", kSession}, {"d.json", std::move(text)}});
  };
  return {
      {type, "missing", run_session, with_files({{"h.json", kSession}})},
      {type, "binary garbage", run_session, device(kGarbage)},
      {type, "no device", run_session, device("{}")},
      {type, "delay without provenance", run_session,
       device(R"({"device": "omega7", "delay": {"largest_s": 0.001}})")},
      {type, "negative delay", run_session,
       device(R"({"device": "omega7", "delay": {"provenance": "measured", "largest_s": -1}})")},
      {type, "another device",
       "hil run {}/h.json --device omega7 --device-file {}/d.json -o {}/out",
       device(R"({"device": "falcon"})")},
      {type, "missing, for a rehearsal", "hil identify {}/h.json --device-file {}/d.json -o {}/out",
       with_files({{"h.json", kSession}})},
      {type, "missing, for a check", "hil check {}/h.json --duration '1 s' --device-file {}/d.json",
       with_files({{"h.json", kSession}})},
      {type, "recording without replay",
       "hil run {}/h.json --device-recording {}/gone.tpmrec -o {}/out",
       with_files({{"h.json", kSession}})},
      {type, "plugin without its device", "hil run {}/h.json --plugin {}/gone.so -o {}/out",
       with_files({{"h.json", kSession}})},
      {type, "limit above that of the device", run_session,
       device(R"({"device": "omega7", "limits": {"force_N": 40}})")},
      {type, "provenance of a limit that is not stated", run_session,
       device(R"({"device": "omega7", "limits": {"provenance": {"force_N": "assumed"}}})")},
      {type, "mean above the largest delay", run_session,
       device(R"({"device": "omega7", "delay": {"provenance": "measured", "mean_s": 0.02,
                  "largest_s": 0.001}})")},
      {type, "encoder step of zero", run_session,
       device(R"({"device": "omega7", "encoder_step": {"provenance": "measured", "step_m": 0}})")},
      {type, "device that nobody knows", "hil run {}/h.json --device gloves -o {}/out",
       with_files({{"h.json", kSession}})},
      {type, "duration of an identification", "hil identify --duration '1 s' -o {}/out",
       with_files({})},
      {type, "identification of a recording", "hil identify --device replay -o {}/out",
       with_files({})},
      {"Inverse service", "a force that was never measured",
       "hil run {}/h.json --device inverse3 -o {}/out", with_files({{"h.json", kSession}})},
      {"rendering", "above the stiffness limit of the device", "hil run {}/h.json -o {}/out",
       with_files({{"h.json", replaced(kSession, "\"eta1\"", "\"E2\": \"1 MPa\", \"eta1\"")}})},
      {"rendering", "slew limit below a step of the encoder", "hil run {}/h.json -o {}/out",
       with_files({{"h.json", replaced(kSession, "\"indentations\"",
                                       "\"limits\": {\"slew_N_per_s\": 1}, \"indentations\"")}})},
      {"rendering", "beyond the stop along x", "hil run {}/h.json -o {}/out",
       with_files({{"h.json", replaced(kSession, "\"indentations\"",
                                       "\"push\": [1, 0, 0], \"surface\": [\"54 mm\", \"0 mm\", "
                                       "\"0 mm\"], \"indentations\"")}})},
      {"Inverse service", "a port of the system", "hil serve {}/h.json --port 80",
       with_files({{"h.json", kSession}})},
      {"Inverse service", "no number of a port", "hil serve {}/h.json --port abc",
       with_files({{"h.json", kSession}})},
      {"Inverse service", "serial number of a simulated device",
       "hil run {}/h.json --device virtual --serial 4711 -o {}/out",
       with_files({{"h.json", kSession}})},
      {"Inverse service", "no time to serve", "hil serve {}/h.json --duration '0 s'",
       with_files({{"h.json", kSession}})},
  };
}

inline std::vector<ErrorCase> session_recording_cases() {
  const std::string type = "recording of a session";
  const std::string to_hdf5 = "hil export {}/r.tpmrec -o {}/out.h5";
  const auto recording = [](std::string bytes) {
    return with_files({{"r.tpmrec", std::move(bytes)}});
  };
  return {
      {type, "missing", to_hdf5, with_files({})},
      {type, "empty", to_hdf5, recording("")},
      {type, "binary garbage", to_hdf5, recording(kGarbage)},
      {type, "100 MB line", to_hdf5, recording(long_line())},
      {type, "cut off in its header", to_hdf5,
       recording(std::string("TPMROWS1\x88\0\0\0\x10\0\0\0{", 17))},
      {type, "damaged header", to_hdf5,
       recording(std::string("TPMROWS1\x88\0\0\0\x02\0\0\0{}\0\0\0\0", 22))},
      {type, "report of garbage", "hil report {}/r.tpmrec --folder {}/out", recording(kGarbage)},
      {type, "verification of garbage", "hil verify {}/r.tpmrec", recording(kGarbage)},
      {type, "replay of garbage",
       "hil run {}/h.json --device replay --device-recording {}/r.tpmrec -o {}/out",
       with_files({{"h.json", kSession}, {"r.tpmrec", kGarbage}})},
  };
}

inline std::vector<ErrorCase> view_cases() {
  const std::string type = "file to view";
  const std::string show = "view {}/f -o {}/out.html";
  const auto file = [](std::string bytes) { return with_files({{"f", std::move(bytes)}}); };
  return {
      {type, "missing", show, with_files({})},
      {type, "empty", show, file("")},
      {type, "binary garbage", show, file(kGarbage)},
      {type, "100 MB line", show, file(long_line())},
      {type, "signature of HDF5 only", show, file("\x89HDF\r\n\x1a\n")},
      {type, "pack of curves", "view {}/p.h5 -o {}/out.html", packed(1.0)},
      {type, "beginning of a recording only", show, file("TPMROWS1")},
      {type, "JSON of a scene", show, file(R"({"organ": {"kind": "star"}})")},
      {type, "truncated JSON", show, file(R"({"figures": [)")},
      {type, "figures that are none", show, file(R"({"figures": [{"panels": [{"x": 1}]}]})")},
      {type, "answer of a fit without estimates", show,
       file(R"({"title": "t", "model": "m", "chi_square": 1, "confidence_level": 0.95,
                "parameters": [{"name": "k"}]})")},
      {type, "answer of a fit without its level", show,
       file(R"({"title": "t", "model": "m", "chi_square": 1, "parameters": [{"name": "k"}]})")},
      {type, "folder without a result", "view {} -o {}/out.html",
       with_files({{"notes.md", "nothing"}})},
      {type, "table of samples", "view {}/c.csv -o {}/out.html",
       with_files({{"c.csv", "time_s,force_N\n"}})},
      {type, "folder with a recording", "view {} -o {}/out.html",
       with_files({{"c.csv", "time_s,force_N\n"}})},
      {type, "folder with recordings", "view {} -o {}/out.html",
       with_files({{"c.csv", "time_s,force_N\n"}, {"d.csv", "time_s,force_N\n"}})},
      {type, "folder with a credibility page", "view {} -o {}/out.html",
       with_files({{"p.html", "<!DOCTYPE html>\n<title>Credibility of law.json</title>"}})},
      {type, "folder with a pack of curves", "view {} -o {}/out.html", packed(1.0)},
      {"file to write", "page that is no page", "view {}/f -o {}/out.pdf", with_files({})},
      {"file to write", "drawing that is a page", "network show -o {}/out.html", with_files({})},
  };
}

}  // namespace tpm::test::error_cases
