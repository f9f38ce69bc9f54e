// Runs the program on bad input of every file type and checks that it answers as promised: one line
// on standard error, an exit code that is not zero, no output file left behind. The answers are the
// table docs/errors.md. To add a file type, write a function that returns its cases and add it to
// all_cases(). After a wanted change run this test with TPM_UPDATE_DOCS=1 and review the table.
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <regex>
#include <set>
#include <sstream>

#include "error_case.hpp"
#include "jpk_error_cases.hpp"
#include "material_error_cases.hpp"
#include "organ_law_error_cases.hpp"
#include "placement_error_cases.hpp"
#include "simulation_error_cases.hpp"
#include "sweep_error_cases.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/pack.hpp"
#include "tpmkit/curve_file.hpp"
#include "validation_error_cases.hpp"

using namespace tpm;
using namespace tpm::files;
using test::ErrorCase;
using test::Files;
using test::kGarbage;
using test::long_line;
using test::TempFolder;
using test::with_files;

namespace {

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("nothing to replace: " + from);
  return text.replace(at, from.size(), to);
}

const std::string kPointsJson = R"({"id": "c", "title": "t", "kind": "points",
"observable": "contact_force",
"columns": {"depth_mm": {"quantity": "indentation_depth", "unit": "mm"},
            "force_N": {"quantity": "contact_force", "unit": "N"}}})";

const std::string kRecordingJson = R"({"id": "c", "title": "t", "kind": "recording",
"observable": "contact_force", "provenance": "measured",
"columns": {"time_s": {"quantity": "time", "unit": "s"},
            "force_N": {"quantity": "contact_force", "unit": "N"}}})";

std::vector<ErrorCase> curve_csv_cases() {
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

std::vector<ErrorCase> curve_json_cases() {
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

std::vector<ErrorCase> machine_cases() {
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
      {type, "no number", import, machine(head + "0,0,0\n1,high,1\n")},
      {type, "NaN", import, machine(head + "0,0,0\n1,nan,1\n")},
      {type, "NaN that leaves too few", "fit {}/m.csv --no-draw",
       machine(head + "0,0,0\n1,1,1\n2,nan,2\n")},
      {type, "unsorted time", import, machine(head + "0,0,0\n2,1,1\n1,1,1\n")},
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
      {type, "workbook", import, machine("\xD0\xCF\x11\xE0 workbook")},
      {type, "YAML", "data import {}/m.yaml -o {}/out", with_files({{"m.yaml", "a: 1\n"}})},
      {type, "law to be fitted", "fit {}/l.json",
       with_files({{"l.json", R"({"law": "linear-1", "parameters": {}, "provenance": "text"})"}})},
      {type, "force counted negative", "fit {}/m.csv --no-draw",
       machine(head + "0,0,0\n1,-1,1\n2,-2,2\n3,-3,3\n4,-3,3\n")},
      {type, "only a hold", "fit {}/m.csv --no-draw",
       machine(head + "0,3,1\n1,2,1\n2,1.5,1\n3,1.2,1\n4,1,1\n")},
      {type, "binary garbage", import, machine(kGarbage)},
      {type, "100 MB line", import, machine(long_line())},
  };
}

const std::string kSpectrumJson = R"({"id": "c", "title": "t", "kind": "spectrum",
"provenance": "measured",
"columns": {"frequency_Hz": {"quantity": "frequency", "unit": "Hz"},
            "storage_Pa": {"quantity": "storage_modulus", "unit": "Pa"},
            "loss_Pa": {"quantity": "loss_modulus", "unit": "Pa"}}})";

std::vector<ErrorCase> spectrum_cases() {
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

std::vector<ErrorCase> digitizer_cases() {
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

std::function<void(const TempFolder&)> packed(double part) {
  return [part](const TempFolder& folder) {
    pack_curves(folder / "p.h5", {load_curve("evren_static")});
    const std::string whole = read_file(folder / "p.h5");
    const auto size = static_cast<std::size_t>(static_cast<double>(whole.size()) * part);
    std::ofstream(folder / "p.h5", std::ios::binary) << whole.substr(0, size);
  };
}

std::vector<ErrorCase> hdf5_cases() {
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

const std::string kFitConfig = R"({
  "title": "t",
  "parameters": {"E": {"start": "12 kPa", "lower": "1 kPa", "upper": "100 kPa", "sets": ["E1", "E2"]}},
  "data": [{"dataset": "c.csv",
            "protocol": {"kind": "ramp_hold", "rate": "4 mm/s"},
            "noise": {"kind": "relative_to_datum", "relative": 0.1}}]
})";

const std::string kFittedJson = R"({"id": "c", "title": "t", "kind": "points",
"observable": "contact_force", "time_origin": "end_of_ramp",
"columns": {"depth_mm": {"quantity": "indentation_depth", "unit": "mm"},
            "time_s": {"quantity": "time", "unit": "s"},
            "force_N": {"quantity": "contact_force", "unit": "N"}}})";
const std::string kFittedCsv =
    "depth_mm,time_s,force_N,provenance\n2,0,0.32,table\n2,30,0.21,table\n";

std::vector<ErrorCase> fit_config_cases() {
  const std::string type = "fit configuration";
  const std::string fit = "fit {}/f.json --format json -o {}/out";
  const auto config = [](std::string text) {
    return with_files(
        {{"c.json", kFittedJson}, {"c.csv", kFittedCsv}, {"f.json", std::move(text)}});
  };
  const auto with = [&](const std::string& from, const std::string& to) {
    return config(replaced(kFitConfig, from, to));
  };
  const auto data = [](const std::string& from, const std::string& to) {
    return with_files({{"c.json", kFittedJson},
                       {"c.csv", replaced(kFittedCsv, from, to)},
                       {"f.json", kFitConfig}});
  };
  return {
      {type, "missing", fit, with_files({})},
      {type, "empty", fit, config("")},
      {type, "truncated", fit, config(kFitConfig.substr(0, 120))},
      {type, "binary garbage", fit, config(kGarbage)},
      {type, "100 MB line", fit, config(long_line())},
      {type, "missing key", fit, with("\"title\": \"t\",", "")},
      {type, "unknown key", fit, with("\"start\"", "\"strat\": \"1 kPa\", \"start\"")},
      {type, "wrong unit", fit, with("12 kPa", "12 mm")},
      {type, "no unit", fit, with("12 kPa", "12")},
      {type, "NaN", fit, with("12 kPa", "nan kPa")},
      {type, "negative modulus", fit, with("\"1 kPa\"", "\"-1 kPa\"")},
      {type, "start outside the bounds", fit, with("12 kPa", "120 kPa")},
      {type, "negative rate", fit, with("4 mm/s", "-4 mm/s")},
      {type, "negative standard deviation", fit, with("0.1", "-0.1")},
      {type, "unknown model parameter", fit, with("\"E2\"", "\"E3\"")},
      {type, "unknown noise", fit, with("relative_to_datum", "gaussian")},
      {type, "unknown noise distribution", fit,
       with("\"relative\": 0.1", "\"relative\": 0.1, \"distribution\": \"cauchy\"")},
      {type, "log-normal beside another kind", fit,
       with("\"relative\": 0.1", "\"relative\": 0.1, \"distribution\": \"log_normal\"")},
      {type, "degrees of freedom without Student's t", fit,
       with("\"relative\": 0.1", "\"relative\": 0.1, \"degrees_of_freedom\": 4")},
      {type, "noise relative to the datum estimated", fit,
       with("\"relative\": 0.1", "\"relative\": \"estimated\"")},
      {type, "noise factor and sigma estimated", fit,
       with("\"relative_to_datum\", \"relative\": 0.1",
            "\"relative_to_model\", \"relative\": \"estimated\", \"scale\": \"estimated\"")},
      {type, "robust loss beside a distribution", fit,
       with("\"relative\": 0.1}}]",
            "\"relative\": 0.1, \"distribution\": \"laplace\"}}], \"loss\": {\"kind\": "
            "\"huber\"}")},
      {type, "few bootstrap replicates", fit,
       with("\"title\"", "\"bootstrap\": {\"replicates\": 3}, \"title\"")},
      {type, "unknown resampling", "fit {}/f.json --bootstrap 20 --resample jackknife -o {}/out",
       config(kFitConfig)},
      {type, "resampling without a bootstrap", "fit {}/f.json --resample blocks -o {}/out",
       config(kFitConfig)},
      {type, "one data set drawn as a whole",
       "fit {}/f.json --bootstrap 20 --resample recordings -o {}/out", config(kFitConfig)},
      {type, "unknown data set", fit, with("c.csv", "livre")},
      {type, "data set is missing", fit, with("c.csv", "d.csv")},
      {type, "datum without a depth", fit, data("2,0,0.32", ",0,0.32")},
      {type, "datum of 0 under relative noise", fit, data("0.32", "0")},
      {type, "wrong option value", "fit {}/f.json --rate '4 mm' -o {}/out", config(kFitConfig)},
      {type, "output cannot be written", "fit {}/f.json -o /proc/none/out", config(kFitConfig)},
  };
}

const std::string kOscillationConfig = R"({
  "title": "t", "law": {"name": "linear-1", "reference": "2 mm"},
  "parameters": {"k1": {"start": "12 N/m", "lower": "1 N/m", "upper": "100 N/m"}},
  "fixed": {"k_inf": "10 N/m", "tau1": "1 s"},
  "data": [{"dataset": "c.csv", "stiffness_per_modulus": "12.56 mm",
            "protocol": {"kind": "oscillation", "operating_depth": "2 mm"},
            "noise": {"kind": "relative_to_datum", "relative": 0.1}}]
})";

std::vector<ErrorCase> oscillation_cases() {
  const std::string type = "fit of a spectrum";
  const std::string fit = "fit {}/f.json --format json -o {}/out";
  const auto fitted = [](std::string config, const std::string& rows) {
    return with_files({{"c.json", kSpectrumJson},
                       {"c.csv", "frequency_Hz,storage_Pa,loss_Pa\n" + rows},
                       {"f.json", std::move(config)}});
  };
  const auto with = [&](const std::string& from, const std::string& to) {
    return fitted(replaced(kOscillationConfig, from, to), "1,1000,100\n");
  };
  const std::string length = "\"stiffness_per_modulus\": \"12.56 mm\",";
  return {
      {type, "the paper's element", fit,
       with("\"law\": {\"name\": \"linear-1\", \"reference\": \"2 mm\"},", "")},
      {type, "moduli against an indentation", fit, with(length, "")},
      {type, "stiffness over modulus of 0", fit, with("12.56 mm", "0 mm")},
      {type, "stiffness over modulus of another dimension", fit, with("12.56 mm", "12.56 mm^2")},
      {type, "unknown operating depth unit", fit,
       with("\"operating_depth\": \"2 mm\"", "\"operating_depth\": \"2 furlong\"")},
      {type, "negative operating depth", fit,
       with("\"operating_depth\": \"2 mm\"", "\"operating_depth\": \"-2 mm\"")},
      {type, "noise of another dimension", fit,
       with("\"relative_to_datum\", \"relative\": 0.1", "\"absolute\", \"absolute\": \"1 N/m\"")},
      {type, "operating depth of a recording", fit, with("oscillation", "measured")},
      {type, "a window of time", fit, with("\"stiffness_per", "\"to\": \"3 s\", \"stiffness_per")},
      {type, "loss of 0 under relative noise", fit, fitted(kOscillationConfig, "1,1000,0\n")},
      {type, "a spectrum of a relaxation", fit,
       with("\"oscillation\", \"operating_depth\": \"2 mm\"", "\"step_hold\"")},
  };
}

const std::string kProblem = R"({"title": "t", "parameter_file": "p.csv",
"observable_file": "o.csv", "condition_file": "c.csv", "measurement_file": "m.csv"})";

std::vector<ErrorCase> fit_tables_cases() {
  const std::string type = "fit tables";
  const std::string fit = "fit {}/f.json -o {}/out";
  const Files sound{
      {"f.json", kProblem},
      {"p.csv",
       "parameterId,parameterScale,lowerBound,upperBound,nominalValue,estimate,unit,sets\n"
       "E,log,1,100,12,1,kPa,E1 E2\n"},
      {"o.csv", "observableId,observableFormula,unit,noiseFormula\nF,contact_force,N,0.02\n"},
      {"c.csv", "conditionId,protocol,depth,rate\nc2,ramp_hold,2 mm,4 mm/s\n"},
      {"m.csv", "observableId,simulationConditionId,time,measurement\nF,c2,0,0.32\n"}};
  const auto with = [&](const char* file, const std::string& from, const std::string& to) {
    Files list = sound;
    for (auto& [name, bytes] : list) {
      if (name == file) bytes = replaced(bytes, from, to);
    }
    return with_files(std::move(list));
  };
  return {
      {type, "table is missing", fit, with("f.json", "m.csv", "n.csv")},
      {type, "missing key", fit, with("f.json", "\"condition_file\": \"c.csv\",", "")},
      {type, "missing column", fit, with("m.csv", "time", "datasetId")},
      {type, "preequilibration", fit, with("m.csv", "time", "preequilibrationConditionId")},
      {type, "prior", fit, with("p.csv", "sets", "objectivePriorType")},
      {type, "scale", fit, with("p.csv", "log", "logit")},
      {type, "estimate neither 0 nor 1", fit, with("p.csv", "12,1", "12,2")},
      {type, "bound without a number", fit, with("p.csv", "100", "inf")},
      {type, "formula", fit, with("o.csv", "contact_force", "2 * contact_force")},
      {type, "noise formula", fit, with("o.csv", "0.02", "0.1 * depth")},
      {type, "unit", fit, with("o.csv", "N,0.02", "mm,0.02")},
      {type, "unknown condition", fit, with("m.csv", "c2", "c3")},
      {type, "measurement without a number", fit, with("m.csv", "0.32", "high")},
  };
}

const std::string kClaims = R"({
  "title": "t", "citation": "c",
  "symbols": [{"name": "k", "value": "2", "unit": "kPa", "where": "p. 1", "quote": "k = 2 kPa",
               "provenance": "text"}],
  "claims": [{"id": "doubled", "topic": "1", "kind": "value", "where": "p. 2", "quote": "4 kPa",
              "printed": "4", "unit": "kPa", "expression": "2 * k",
              "if_holds": "It is.", "if_fails": "It is not."}]
})";

std::vector<ErrorCase> claims_cases() {
  const std::string type = "claims file";
  const std::string audit = "paper audit {}/c.json -o {}/out";
  const auto claims = [](std::string text) { return with_files({{"c.json", std::move(text)}}); };
  const auto with = [&](const std::string& from, const std::string& to) {
    return claims(replaced(kClaims, from, to));
  };
  return {
      {type, "missing", audit, with_files({})},
      {type, "empty", audit, claims("")},
      {type, "truncated", audit, claims(kClaims.substr(0, 150))},
      {type, "binary garbage", audit, claims(kGarbage)},
      {type, "100 MB line", audit, claims(long_line())},
      {type, "missing key", audit, with("\"title\": \"t\",", "")},
      {type, "unknown key", audit, with("\"topic\"", "\"tropic\": \"1\", \"topic\"")},
      {type, "unknown kind", audit,
       with("\"value\", \"where\": \"p. 2\"", "\"guess\", \"where\": \"p. 2\"")},
      {type, "NaN", audit, with("\"value\": \"2\"", "\"value\": \"nan\"")},
      {type, "printed value is no number", audit,
       with("\"printed\": \"4\"", "\"printed\": \"four\"")},
      {type, "wrong unit", audit,
       with("\"unit\": \"kPa\", \"where\"", "\"unit\": \"kPb\", \"where\"")},
      {type, "unknown symbol", audit, with("2 * k", "2 * q")},
      {type, "broken expression", audit, with("2 * k", "2 * (k")},
      {type, "division by zero", audit, with("2 * k", "k / (k - k)")},
  };
}

const std::string kDesign = R"({"title": "t", "law": {"name": "linear-1", "reference": "1 mm"},
"parameters": {
  "k_inf": {"start": "100 N/m", "lower": "1 N/m", "upper": "1000 N/m"},
  "k1": {"start": "100 N/m", "lower": "1 N/m", "upper": "1000 N/m"},
  "tau1": {"start": "2 s", "lower": "0.1 s", "upper": "100 s"}},
"noise": {"force": {"absolute": "0.01 N"}},
"candidates": [{"kind": "ramp_hold", "rate": ["4 mm/s"], "depth": ["8 mm"], "hold": ["9 s"],
  "interval": ["1 s"]}]})";

std::vector<ErrorCase> design_cases() {
  const std::string type = "design";
  const std::string run_design = "design {}/d.json --repetitions 0 -o {}/out";
  const auto design = [](std::string text) { return with_files({{"d.json", std::move(text)}}); };
  const auto with = [&](const std::string& from, const std::string& to) {
    return design(replaced(kDesign, from, to));
  };
  return {
      {type, "missing", run_design, with_files({})},
      {type, "missing key", run_design, with("\"title\": \"t\",", "")},
      {type, "wrong unit", run_design, with("2 s", "2 mm")},
      {type, "rate of 0", run_design, with("4 mm/s", "0 mm/s")},
      {type, "no depth", run_design, with("\"depth\": [\"8 mm\"],", "")},
      {type, "creep with a rate", run_design, with("ramp_hold", "creep")},
      {type, "deeper than the limit", run_design, with("8 mm", "13 mm")},
      {type, "unknown criterion", run_design,
       with("\"title\"", "\"criterion\": \"tau2\", \"title\"")},
      {type, "unknown nuisance", run_design,
       with("\"title\"", "\"nuisance\": [\"offset\"], \"title\"")},
      {type, "too few simulations", "design {}/d.json --repetitions 3 -o {}/out", design(kDesign)},
      {type, "no file and no laws", "design -o {}/out", with_files({})},
      {type, "noise of laws beside a design", "design {}/d.json --noise 0.1 -o {}/out",
       design(kDesign)},
      {type, "candidates of laws", "design --laws linear-1 --top 3 -o {}/out", with_files({})},
  };
}

std::vector<ErrorCase> recording_folder_cases() {
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
      {type, "the same file twice", fit(""), with_files({{"a1.csv", csv}, {"a2.csv", csv}})},
      {type, "times that do not rise", fit("--times '1 s, 1 s'"), folder},
      {type, "times of another law", fit("--times '1 s, 2 s'"), folder},
      {type, "times of two laws",
       "fit {} --no-draw --laws linear-1,linear-2 --times '1 s' -o {}/out", folder},
      {type, "group of one recording", "fit {}/a1.csv --no-draw --group-by animal -o {}/out",
       folder},
  };
}

const std::string kLaw = R"({"law": "linear-1", "drive": "indentation_depth",
"response": "contact_force", "reference_m": 0.001, "provenance": "assumed",
"parameters": {"k_inf_N_per_m": 20.0, "k1_N_per_m": 30.0, "tau1_s": 1.5}})";

std::vector<ErrorCase> law_cases() {
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

std::string polygon(int corners) {
  std::string obj, face = "f";
  for (int i = 0; i < corners; ++i) {
    const double angle = 6.283185307179586 * i / corners;
    obj += "v " + std::to_string(std::cos(angle)) + " " + std::to_string(std::sin(angle)) + " 0\n";
    face += " " + std::to_string(i + 1);
  }
  return obj + face + "\n";
}

std::vector<ErrorCase> scene_cases() {
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
      {type, "bad count", "network build --spheres 1 -o {}/out", with_files({})},
  };
}

std::vector<ErrorCase> table_option_cases() {
  const std::string type = "options of tpm paper tables";
  return {
      {type, "depth that overflows", "paper tables --depths 1e300 -o {}/out", with_files({})},
      {type, "depth in newtons", "paper tables --depths '2,8 N' -o {}/out", with_files({})},
      {type, "infinite depth", "paper tables --depths 1e400 -o {}/out", with_files({})},
      {type, "depth without unit", "paper tables --depths inf -o {}/out", with_files({})},
  };
}

const std::string kSession = R"({"model": {"kind": "condensed", "scene": {
  "organ": {"kind": "liver", "count": 60}, "material": {"eta1": "2.4e5 Pa s"},
  "anchors": [{"kind": "far_side", "fraction": 0.3}]}},
"indentations": {"depths": ["2 mm"], "rates": ["4 mm/s"], "hold": "1 s"}})";

std::vector<ErrorCase> session_cases() {
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
      {type, "model that was removed", run_session, with("\"condensed\"", "\"network_beside\"")},
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

std::vector<ErrorCase> device_file_cases() {
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

std::vector<ErrorCase> session_recording_cases() {
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

std::vector<ErrorCase> view_cases() {
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
       file(R"({"title": "t", "model": "m", "chi_square": 1, "parameters": [{"name": "k"}]})")},
  };
}

std::vector<ErrorCase> all_cases() {
  std::vector<ErrorCase> all;
  for (const auto& cases : {curve_csv_cases(),
                            curve_json_cases(),
                            machine_cases(),
                            spectrum_cases(),
                            digitizer_cases(),
                            test::jpk_error_cases(),
                            hdf5_cases(),
                            fit_config_cases(),
                            oscillation_cases(),
                            fit_tables_cases(),
                            design_cases(),
                            claims_cases(),
                            recording_folder_cases(),
                            law_cases(),
                            scene_cases(),
                            table_option_cases(),
                            session_cases(),
                            device_file_cases(),
                            session_recording_cases(),
                            view_cases(),
                            test::simulation_error_cases(),
                            test::sweep_error_cases(),
                            test::material_error_cases(),
                            test::placement_error_cases(),
                            test::plugin_error_cases(),
                            test::organ_law_error_cases(),
                            test::validation_error_cases()}) {
    all.insert(all.end(), cases.begin(), cases.end());
  }
  return all;
}

std::string replace_all(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

struct ProgramAnswer {
  int exit_code = 0;
  std::string error;
};

ProgramAnswer run(const std::string& arguments, const TempFolder& folder) {
  const std::string error_file = folder / "stderr";
  const std::string command = std::string("\"") + TPM_TEST_PROGRAM + "\" " +
                              replace_all(arguments, "{}", folder.path().string()) +
                              " >/dev/null 2>\"" + error_file + "\"";
  const int status = std::system(command.c_str());
  REQUIRE(WIFEXITED(status));
  std::ifstream in(error_file, std::ios::binary);
  ProgramAnswer answer{WEXITSTATUS(status), std::string(std::istreambuf_iterator<char>(in), {})};
  std::filesystem::remove(error_file);
  return answer;
}

std::size_t count_files(const TempFolder& folder) {
  using Iterator = std::filesystem::recursive_directory_iterator;
  return static_cast<std::size_t>(
      std::count_if(Iterator(folder.path()), Iterator(),
                    [](const auto& entry) { return entry.is_regular_file(); }));
}

/// A row of the table, without anything that differs from machine to machine.
std::string table_row(const ErrorCase& error_case, const ProgramAnswer& answer,
                      const TempFolder& folder) {
  std::string message = answer.error.substr(0, answer.error.find('\n'));
  message = replace_all(message, folder.path().string() + "/", "");
  message = replace_all(message, folder.path().string(), "FOLDER");
  message = replace_all(message, share_dir().string() + "/", "");
  // The load at which a path meets an instability depends on roundings of the linear algebra.
  static const std::regex buckling(R"(a load of [0-9.]+ N(,? the tissue buckles) around [^:]* mm)");
  message = std::regex_replace(message, buckling, "a load of ... N$1 around sphere ...");
  static const std::regex sagging(R"((that stay the tissue buckles) around [^:;]* mm)");
  message = std::regex_replace(message, sagging, "$1 around sphere ...");
  message = replace_all(message, "|", "\\|");
  return "| " + error_case.file_type + " | " + error_case.what + " | " +
         std::to_string(answer.exit_code) + " | `" + message + "` |\n";
}

/// The lines of one text that the other has not.
std::string rows_only_in(const std::string& text, const std::string& other) {
  std::istringstream lines(other);
  std::set<std::string> known;
  for (std::string line; std::getline(lines, line);) known.insert(line);
  std::string rows;
  lines = std::istringstream(text);
  for (std::string line; std::getline(lines, line);) {
    if (!known.contains(line)) rows += line + "\n";
  }
  return rows;
}

}  // namespace

TEST_CASE("bad input gives one line, an exit code and no output; docs/errors.md says which",
          "[heavy]") {
  std::string table =
      "# What tpm says to bad input\n\n"
      "Written by `tests/files/test_errors.cpp`, which runs the program on each of these files; "
      "after a\n"
      "wanted change run it with `TPM_UPDATE_DOCS=1`. Exit codes: 1 the answer is no, 2 command\n"
      "line, also a bad value of an option or an output that exists, 3 bad input, 4 numerical "
      "failure,\n"
      "5 environment.\n\n"
      "| file type | fault | exit code | message |\n| --- | --- | --- | --- |\n";
  for (const ErrorCase& error_case : all_cases()) {
    INFO(error_case.file_type << ": " << error_case.what);
    const TempFolder folder;
    error_case.make(folder);
    const std::size_t files_before = count_files(folder);
    const ProgramAnswer answer = run(error_case.arguments, folder);
    CAPTURE(answer.error.substr(0, 500));
    CHECK(answer.exit_code != 0);
    CHECK(answer.error.starts_with("tpm: "));
    CHECK(std::count(answer.error.begin(), answer.error.end(), '\n') == 1);
    CHECK(answer.error.size() < 600);
    CHECK(answer.error.find("internal error") == std::string::npos);
    CHECK(count_files(folder) == files_before);
    table += table_row(error_case, answer, folder);
  }
  // Beside the test program, to compare by hand.
  std::ofstream(TPM_TEST_BINARY_DIR "/errors.md", std::ios::binary) << table;
  const std::string committed = std::string(TPM_TEST_SOURCE_DIR) + "/docs/errors.md";
  if (std::getenv("TPM_UPDATE_DOCS") != nullptr) write_file(committed, table);
  INFO("docs/errors.md is out of date: run this test with TPM_UPDATE_DOCS=1 and review it");
  CHECK(rows_only_in(table, read_file(committed)) == "");
  CHECK(rows_only_in(read_file(committed), table) == "");
  CHECK((read_file(committed) == table));
}

TEST_CASE("tpm data check reports every failing file and answers no") {
  const TempFolder folder;
  const std::string broken = "depth_mm,force_N,provenance\n2,x,table\n";
  with_files(
      {{"c.json", kPointsJson}, {"c.csv", broken}, {"d.json", kPointsJson}, {"d.csv", broken}})(
      folder);
  const ProgramAnswer answer = run("data check {}/c.csv evren_static {}/d.csv", folder);
  CHECK(answer.exit_code == 1);
  CHECK(std::count(answer.error.begin(), answer.error.end(), '\n') == 2);
  CHECK(run("data check {}/c.csv {}/missing.csv", folder).exit_code == 3);
  CHECK(run("data check evren_static", folder).exit_code == 0);
}

TEST_CASE("tpm data import and pack do not replace files without --overwrite") {
  const TempFolder folder;
  with_files({{"m.csv", "Time (s),Force (N)\n0,0\n1,1\n"}})(folder);
  CHECK(run("data import {}/m.csv -o {}/out", folder).exit_code == 0);
  const std::string first = read_file(folder / "out.csv");
  CHECK(run("data import {}/m.csv -o {}/out", folder).exit_code == 2);
  CHECK(run("data import {}/m.csv -o {}/out --overwrite", folder).exit_code == 0);
  CHECK(read_file(folder / "out.csv") == first);
  CHECK(run("data pack {}/out.csv -o {}/p.h5", folder).exit_code == 0);
  CHECK(run("data pack {}/out.csv -o {}/p.h5", folder).exit_code == 2);
  CHECK(run("data show {}/p.h5 --format json", folder).exit_code == 0);
}
