#pragma once
// Curves, spectra, raw files of machines and packs that are damaged or do not hold what their
// description says (test_errors.cpp).
#include <algorithm>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "error_case.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/pack.hpp"
#include "tpmkit/curve_file.hpp"

namespace tpm::test::error_cases {
using namespace files;

inline const std::string kPointsJson = R"({"id": "c", "title": "t", "kind": "points",
"observable": "contact_force",
"columns": {"depth_mm": {"quantity": "indentation_depth", "unit": "mm"},
            "force_N": {"quantity": "contact_force", "unit": "N"}}})";

inline const std::string kRecordingJson = R"({"id": "c", "title": "t", "kind": "recording",
"observable": "contact_force", "provenance": "measured",
"columns": {"time_s": {"quantity": "time", "unit": "s"},
            "force_N": {"quantity": "contact_force", "unit": "N"}}})";

inline std::vector<ErrorCase> curve_csv_cases() {
  const std::string type = "curve CSV";
  const std::string show = "data show {}/c.csv";
  const std::string head = "depth_mm,force_N,provenance\n";
  const auto points = [](std::string csv) {
    return with_files({{"c.json", kPointsJson}, {"c.csv", std::move(csv)}});
  };
  return {
      {type, "missing", show, with_files({{"c.json", kPointsJson}})},
      {type, "missing description", show, with_files({{"c.csv", head}})},
      {type, "empty", show, points("")},
      {type, "header only", show, points(head)},
      {type, "wrong column", show, points("depth_mm,farce_N,provenance\n2,1,table\n")},
      {type, "missing column", show, points("depth_mm,provenance\n2,table\n")},
      {type, "no number", show, points(head + "2,high,table\n")},
      {type, "NaN", show, points(head + "2,nan,table\n")},
      {type, "overflow", show, points(head + "2,1e400,table\n")},
      {type, "negative depth", show, points(head + "-2,1,table\n")},
      {type, "unknown provenance", show, points(head + "2,1,guess\n")},
      {type, "truncated row", show, points(head + "2,1,table\n4,")},
      {type, "unclosed quote", show, points(head + "2,1,\"table\n")},
      {type, "binary garbage", show, points(kGarbage)},
      {type, "100 MB line", show, points(head + long_line())},
      {type, "unsorted time", show,
       with_files({{"c.json", kRecordingJson}, {"c.csv", "time_s,force_N\n0,0\n2,1\n1,1\n"}})},
  };
}

inline std::vector<ErrorCase> curve_json_cases() {
  const std::string type = "curve description";
  const std::string show = "data show {}/c.json";
  const auto described = [](const std::string& from, const std::string& to) {
    std::string json = kPointsJson;
    const auto at = json.find(from);
    if (at == std::string::npos) throw std::logic_error("nothing to replace: " + from);
    json.replace(at, from.size(), to);
    return with_files({{"c.json", json}, {"c.csv", "depth_mm,force_N,provenance\n2,1,table\n"}});
  };
  const auto json = [](std::string text) { return with_files({{"c.json", std::move(text)}}); };
  return {
      {type, "missing", show, with_files({})},
      {type, "empty", show, json("")},
      {type, "truncated", show, json(kPointsJson.substr(0, 100))},
      {type, "binary garbage", show, json(kGarbage)},
      {type, "100 MB line", show, json(long_line())},
      {type, "missing key", show, described("\"title\": \"t\",", "")},
      {type, "unknown key", show, described("\"title\"", "\"titel\": \"t\", \"title\"")},
      {type, "key twice", show, described("\"title\"", "\"title\": \"u\", \"title\"")},
      {type, "wrong type", show, described("\"t\"", "7")},
      {type, "unknown kind", show, described("points", "curve")},
      {type, "unknown quantity", show, described("indentation_depth", "height")},
      {type, "wrong unit", show, described("\"unit\": \"mm\"", "\"unit\": \"N\"")},
      {type, "unknown unit", show, described("\"unit\": \"mm\"", "\"unit\": \"furlong\"")},
      {type, "negative diameter", show,
       described("\"kind\"", "\"probe\": {\"diameter\": \"-4 mm\"}, \"kind\"")},
      {type, "id of another file", show, described("\"c\"", "\"d\"")},
  };
}

/// 50 rows, each of which lacks one of two columns.
inline std::string rows_in_turn() {
  constexpr int kRows = 50;
  std::string rows;
  for (int i = 0; i < kRows; ++i) {
    const std::string number = std::to_string(i);
    rows += i % 2 == 0 ? number + "," + number + ",\n" : number + ",," + number + "\n";
  }
  return rows;
}

inline std::vector<ErrorCase> machine_cases() {
  const std::string type = "machine export";
  const std::string import = "data import {}/m.csv -o {}/out";
  const std::string head = "Time,Force,Depth\ns,N,mm\n";
  const auto machine = [](std::string text) { return with_files({{"m.csv", std::move(text)}}); };
  return {
      {type, "missing", import, with_files({})},
      {type, "empty", import, machine("")},
      {type, "two files for one name", "data import {}/m.csv {}/n.csv -o {}/out",
       with_files({{"m.csv", head + "0,0,0\n1,1,1\n"}, {"n.csv", head + "0,0,0\n1,1,1\n"}})},
      {type, "header only", import, machine(head)},
      {type, "wrong column", import, machine("a,b,c\n0,0,0\n1,1,1\n")},
      {type, "no unit", import, machine("Time,Force,Depth\n0,0,0\n1,1,1\n")},
      {type, "wrong unit", import, machine("Time,Force,Depth\ns,mm,mm\n0,0,0\n1,1,1\n")},
      {type, "two units of a column", import,
       machine("Time (s),Force (N),Depth (mm)\ns,mN,mm\n0,0,0\n1,1,1\n")},
      {type, "unit of no column", import + " --unit Last=mN", machine(head + "0,0,0\n1,1,1\n")},
      {type, "no number", import, machine(head + "0,0,0\n1,high,1\n")},
      {type, "NaN", import, machine(head + "0,0,0\n1,nan,1\n")},
      {type, "NaN that leaves too few", "fit {}/m.csv --no-draw",
       machine(head + "0,0,0\n1,1,1\n2,nan,2\n")},
      {type, "unsorted time", import, machine(head + "0,0,0\n2,1,1\n1,1,1\n")},
      {type, "newest row first", import, machine(head + "4,4,4\n3,3,3\n2,2,2\n1,1,1\n0,0,0\n")},
      {type, "rows sorted by force", import,
       machine(head + "0,0,0\n4,1,3\n1,2,1\n5,3,3\n2,4,2\n6,5,3\n3,6,3\n8,7,3\n7,8,3\n")},
      {type, "negative standard deviation", import,
       machine("Time,Force,Depth,SD\ns,N,mm,N\n0,0,0,0\n1,1,1,-1\n")},
      {type, "no contact", import + " --contact-force \"5 N\"", machine(head + "0,0,0\n1,1,1\n")},
      {type, "truncated row", import, machine(head + "0,0,0\n1,1,1\n2,2")},
      {type, "UTF-16 without byte order mark", import, machine(std::string("T\0,\0F\0", 6))},
      {type, "marks of thousands or decimal signs", import,
       machine("Time (s);Force (mN);Depth (um)\n0;1,002;1\n1;1,332;2\n2;1,665;3\n")},
      {type, "points beside commas", import,
       machine("Time (s);Force (N);Depth (mm)\n0.5;0,1;1\n1.5;0,2;2\n")},
      {type, "decimal commas between commas", import,
       machine("Time (s),Force (N),Depth (mm)\n0,1,0,2,0,3\n0,2,0,3,0,4\n")},
      {type, "step at another time", import,
       machine("Time (s),G(t) (Pa)\n185.1,5\n185.2,4\n185.3,3\n")},
      {type, "G(t) as a share of its first reading", import,
       machine("Time (s),G(t)/G0 (%)\n0.1,90\n0.2,80\n0.3,70\n")},
      {type, "mean and deviation in one cell", import,
       machine("Time (s),G(t) (Pa)\n0.1,9 +/- 1\n0.2,8 +/- 1\n")},
      {type, "stress without a drive", "fit {}/m.csv --response 2 --no-draw",
       machine("Time (s),Amount (Pa)\n0.1,9\n0.2,8\n0.3,7\n")},
      {type, "step time of a ramp", import + " --step-time \"1 s\"",
       machine(head + "0,0,0\n1,1,1\n2,2,2\n3,3,3\n")},
      {type, "no time left", import + " --from-time \"9 s\"", machine(head + "0,0,0\n1,1,1\n")},
      {type, "what was asked for alone", import,
       machine("Time (s),Force (N),Depth command (mm)\n0,0,0\n1,1,1\n")},
      {type, "two forces", import,
       machine("Time (s),Force A (N),Force B (N),Depth (mm)\n0,0,0,0\n1,1,2,1\n")},
      {type, "two blocks", import,
       machine(head + "0,0,0\n1,1,1\n2,2,2\n" + head + "0,0,0\n1,1,1\n2,2,2\n")},
      {type, "no such block", import + " --block 3", machine(head + "0,0,0\n1,1,1\n")},
      {type, "strain of 2000 %", import,
       machine("Time (s),Strain (-),Stress (Pa)\n0,0,0\n1,10,1\n2,20,2\n")},
      {type, "deflection without spring constant", import,
       machine("Time (s),Height (um),Deflection (V)\n0,0,0\n1,1,1\n")},
      {type, "deflection without sensitivity", import + " --spring-constant \"0.05 N/m\"",
       machine("Time (s),Height (um),Deflection (V)\n0,0,0\n1,1,1\n")},
      {type, "height that falls", import + " --spring-constant \"0.05 N/m\"",
       machine("Time (s),Height (um),Force (nN)\n0,3,0\n1,2,1\n2,1,2\n")},
      {type, "deflection of something else", import,
       machine("Time (s),Height (um),Deflection (nm),Force (nN)\n0,0,0,0\n1,1,20,1\n2,2,40,2.8\n"
               "3,3,60,5.2\n")},
      {type, "deflection as large as the height", import,
       machine("Time (s),Height (um),Deflection (um),Force (nN)\n0,0,0,0\n1,1,1,1\n2,2,2,2\n")},
      {type, "workbook", import, machine("\xD0\xCF\x11\xE0 workbook")},
      {type, "YAML", "data import {}/m.yaml -o {}/out", with_files({{"m.yaml", "a: 1\n"}})},
      {type, "law to be fitted", "fit {}/l.json",
       with_files({{"l.json", R"({"law": "linear-1", "parameters": {}, "provenance": "text"})"}})},
      {type, "force counted negative", "fit {}/m.csv --no-draw",
       machine(head + "0,0,0\n1,-1,1\n2,-2,2\n3,-3,3\n4,-3,3\n")},
      {type, "load that is taken away", "fit {}/m.csv --no-draw",
       machine(head + "0,3,3\n1,3,3\n2,2,2\n3,1,1\n4,0,0\n5,0,0\n")},
      {type, "only a hold", "fit {}/m.csv --no-draw",
       machine(head + "0,3,1\n1,2,1\n2,1.5,1\n3,1.2,1\n4,1,1\n")},
      {type, "no titles", import, machine("0,0,0\n1,1,1\n2,2,2\n")},
      {type, "logarithms", import, machine("log w,log G',log G''\n0,0,0\n1,1,1\n2,2,2\n")},
      {type, "columns logged in turn", import, machine(head + rows_in_turn())},
      {type, "load that was on before", "fit {}/m.csv --no-draw",
       machine(head + "0,3,1\n1,3,1.5\n2,3,1.8\n3,3,1.9\n4,3,1.95\n5,3,1.97\n6,3,1.98\n7,3,1.99\n"
                      "8,3,2\n")},
      {type, "binary garbage", import, machine(kGarbage)},
      {type, "100 MB line", import, machine(long_line())},
  };
}

inline const std::string kSpectrumJson = R"({"id": "c", "title": "t", "kind": "spectrum",
"provenance": "measured",
"columns": {"frequency_Hz": {"quantity": "frequency", "unit": "Hz"},
            "storage_Pa": {"quantity": "storage_modulus", "unit": "Pa"},
            "loss_Pa": {"quantity": "loss_modulus", "unit": "Pa"}}})";

inline std::vector<ErrorCase> spectrum_cases() {
  const std::string type = "spectrum";
  const std::string show = "data show {}/c.csv";
  const std::string import = "data import {}/m.csv -o {}/out";
  const std::string head = "frequency_Hz,storage_Pa,loss_Pa\n";
  const auto rows = [&head](const std::string& text) {
    return with_files({{"c.json", kSpectrumJson}, {"c.csv", head + text}});
  };
  const auto described = [&head](const std::string& from, const std::string& to) {
    return with_files({{"c.json", replaced(kSpectrumJson, from, to)}, {"c.csv", head + "1,1,1\n"}});
  };
  const auto machine = [](std::string text) { return with_files({{"m.csv", std::move(text)}}); };
  return {
      {type, "frequency of 0", show, rows("0,1,1\n")},
      {type, "frequency twice", show, rows("1,1,1\n1,2,2\n")},
      {type, "negative storage", show, rows("1,-1,1\n")},
      {type, "negative loss", show, rows("1,1,-1\n")},
      {type, "no number", show, rows("1,1,\n")},
      {type, "observable", show, described("\"kind\"", "\"observable\": \"stress\", \"kind\"")},
      {type, "missing provenance", show, described("\"provenance\": \"measured\",", "")},
      {type, "another quantity", show,
       described("\"loss_modulus\", \"unit\": \"Pa\"", "\"stress\", \"unit\": \"Pa\"")},
      {type, "export without loss", import, machine("Frequency (Hz),G' (Pa)\n1,1\n2,2\n")},
      {type, "export with one column for both", import + " --loss 2",
       machine("Frequency (Hz),G' (Pa)\n1,1\n2,2\n")},
      {type, "export of a viscosity alone", import,
       machine("Frequency (Hz),|eta*| (Pa s)\n1,1\n2,2\n")},
      {type, "export of a compliance beside a modulus", import,
       machine("Frequency (Hz),J' (1/Pa),G'' (Pa)\n1,1,1\n2,2,2\n")},
      {type, "export of a sweep of the amplitude", import,
       machine("Strain (%),G' (Pa),G'' (Pa)\n0.1,9,1\n1,8,2\n")},
      {type, "export without units", import, machine("Frequency,G',G''\n1,1,1\n2,2,2\n")},
      {type, "export with a frequency twice", import,
       machine("Frequency (Hz),G' (Pa),G'' (Pa)\n1,1,1\n1,2,2\n")},
      {type, "modulus beside stiffness", import,
       machine("Frequency (Hz),G' (Pa),G'' (N/m)\n1,1,1\n2,2,2\n")},
      {type, "digitised storage alone",
       import + " --x-quantity frequency:Hz --y-quantity storage_modulus:Pa",
       machine("1,1\n2,2\n")},
  };
}

inline std::vector<ErrorCase> digitizer_cases() {
  const std::string type = "WebPlotDigitizer project";
  const std::string import =
      "data import {}/w.json -o {}/out --x-quantity time:s --y-quantity contact_force:N";
  const auto project = [](std::string text) { return with_files({{"w.json", std::move(text)}}); };
  const auto data = [&project](const std::string& points) {
    return project(R"({"axesColl": [], "datasetColl": [{"name": "d", "axesName": "XY", "data": [)" +
                   points + "]}]}");
  };
  return {
      {type, "missing", import, with_files({})},
      {type, "empty", import, project("")},
      {type, "truncated", import, project(R"({"datasetColl": [{"name": "d", "da)")},
      {type, "another JSON file", import, project(R"({"a": 1})")},
      {type, "no dataset", import, project(R"({"datasetColl": []})")},
      {type, "no number", import, data(R"({"value": ["a", 1]})")},
      {type, "null", import, data(R"({"value": [null, 1]})")},
      {type, "pixels without axes", import, data(R"({"x": 1, "y": 2})")},
      {type, "one time twice", import, data(R"({"value": [1, 1]}, {"value": [1, 2]})")},
      {type, "axes not named", "data import {}/w.json -o {}/out", data(R"({"value": [1, 1]})")},
      {type, "wrong unit",
       "data import {}/w.json -o {}/out --x-quantity time:mm --y-quantity contact_force:N",
       data(R"({"value": [1, 1]})")},
      {type, "binary garbage", import, project("{" + kGarbage)},
      {type, "100 MB line", import, project("{" + long_line())},
  };
}

inline std::function<void(const TempFolder&)> packed(double part) {
  return [part](const TempFolder& folder) {
    pack_curves(folder / "p.h5", {load_curve("evren_static")});
    const std::string whole = read_file(folder / "p.h5");
    const auto size = static_cast<std::size_t>(static_cast<double>(whole.size()) * part);
    std::ofstream(folder / "p.h5", std::ios::binary) << whole.substr(0, size);
  };
}

inline std::vector<ErrorCase> hdf5_cases() {
  const std::string type = "HDF5";
  const std::string show = "data show {}/p.h5";
  return {
      {type, "missing", show, with_files({})},
      {type, "empty", show, with_files({{"p.h5", ""}})},
      {type, "truncated", show, packed(0.5)},
      {type, "signature only", show, with_files({{"p.h5", "\x89HDF\r\n\x1a\n"}})},
      {type, "binary garbage", show, with_files({{"p.h5", kGarbage}})},
      {type, "100 MB line", show, with_files({{"p.h5", long_line()}})},
      {type, "curve twice", "data pack evren_static evren_static -o {}/out.h5", with_files({})},
      {type, "unknown curve", "data pack evren_static nobody -o {}/out.h5", with_files({})},
      {type, "misspelt curve", "data pack evren_statc -o {}/out.h5", with_files({})},
  };
}

}  // namespace tpm::test::error_cases
