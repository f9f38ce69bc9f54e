#pragma once
// JPK force files that are damaged, hostile or of another kind (test_errors.cpp).
#include "error_case.hpp"
#include "jpk_archive.hpp"

namespace tpm::test {

inline std::vector<ErrorCase> jpk_error_cases() {
  const std::string type = "JPK force file";
  const std::string import = "data import {}/c.jpk-force -o {}/out";
  const auto file = [](std::string bytes) {
    return with_files({{"c.jpk-force", std::move(bytes)}});
  };
  const auto curve = [&file](const ZipMembers& members) { return file(zipped(members)); };
  const auto replaced = [&curve](const std::string& from, const std::string& to) {
    return curve(with_replaced(jpk_curve(), from, to));
  };
  const std::string whole = zipped(jpk_curve());
  ZipMembers twice = jpk_curve();
  twice.push_back(twice.front());
  ZipMembers missing = jpk_curve();
  missing.pop_back();
  ZipMembers bomb = jpk_curve();
  bomb.back().second.assign(std::size_t{64} << 20U, '\0');
  std::string flipped = zipped(jpk_curve(), 0);
  flipped[flipped.find(std::string("\0\4\0\3", 4)) + 1] = 9;
  const std::string distance = "vDeflection.conversion-set.conversion.distance.";
  return {
      {type, "empty", import + " --input-format jpk", file("")},
      {type, "no archive", import + " --input-format jpk", file(kGarbage)},
      {type, "truncated", import, file(whole.substr(0, whole.size() / 2))},
      {type, "another archive", import, curve({{"xl/workbook.xml", "<workbook/>"}})},
      {type, "map of curves", import, curve({{"header.properties", "type=force-scan-map\n"}})},
      {type, "no segment", import, curve({{"header.properties", "type=force-scan-series\n"}})},
      {type, "one name twice", import, curve(twice)},
      {type, "channel without data", import, curve(missing)},
      {type, "data of another length", import, replaced("num-points=4", "num-points=5")},
      {type, "64 MiB in place of 8 bytes", import, curve(bomb)},
      {type, "a billion samples", import, replaced("num-points=4", "num-points=1000000000")},
      {type, "wrong check sum", import, file(flipped)},
      {type, "unknown encoder", import, replaced("=signedshort", "=packeddecimal")},
      {type, "scaling that is no number", import,
       replaced(distance + "scaling.multiplier=1", distance + "scaling.multiplier=NaN")},
      {type, "conversions in a circle", import,
       replaced(distance + "base-calibration-slot=volts",
                distance + "base-calibration-slot=distance")},
      {type, "deflection not calibrated", import,
       replaced(distance + "defined=true", distance + "defined=false")},
      {type, "no spring constant", import,
       replaced("vDeflection.conversion-set.conversion.force.defined=true",
                "vDeflection.conversion-set.conversion.force.defined=false")},
      {type, "no duration", import, replaced("duration=2", "duration=0")},
      {type, "style that is no word", import, replaced("style=extend", "style=../extend")},
      {type, "unknown height", import + " --drive lift", curve(jpk_curve())},
      {type, "unknown segment", import + " --segments pause", curve(jpk_curve())},
      {type, "segments with a gap", import + " --segments extend,retract",
       curve(jpk_curve({"extend", "pause", "retract"}))},
      {type, "missing segment", import, curve([] {
         ZipMembers members = jpk_curve({"extend", "pause", "retract"});
         std::erase_if(members, [](const auto& m) { return m.first.starts_with("segments/1/"); });
         return members;
       }())},
      {type, "pause without samples", import, curve([] {
         ZipMembers members = jpk_curve({"extend"});
         for (auto& member : jpk_segment("pause", 1)) {
           members.push_back(
               member.first.ends_with("header.properties")
                   ? std::pair(member.first,
                               std::string("force-segment-header.settings.style=pause\nforce-"
                                           "segment-header.num-points=0\n"
                                           "force-segment-header.duration=2\n"))
                   : member);
         }
         for (auto& member : jpk_segment("retract", 2)) members.push_back(member);
         return members;
       }())},
      {type, "unit of a column", import + " --unit height=mm", curve(jpk_curve())},
      {type, "spring constant of a table",
       "data import {}/m.csv -o {}/out --spring-constant \"1 N/m\"",
       with_files({{"m.csv", "Time (s),Force (N),Depth (mm)\n0,0,0\n1,1,1\n"}})},
      {type, "segments that are not all rows", "data show {}/c.csv",
       with_files({{"c.json", R"({"id": "c", "title": "t", "kind": "recording",
"observable": "contact_force", "provenance": "measured",
"columns": {"time_s": {"quantity": "time", "unit": "s"},
            "force_N": {"quantity": "contact_force", "unit": "N"}},
"segments": [{"kind": "extend", "samples": 3}]})"},
                   {"c.csv", "time_s,force_N\n0,0\n1,1\n"}})},
  };
}

}  // namespace tpm::test
