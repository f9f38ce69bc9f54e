#pragma once
// Configurations of fits, tables of problems, claims and designs with faults (test_errors.cpp).
#include <string>
#include <utility>
#include <vector>

#include "error_case.hpp"

namespace tpm::test::error_cases {
using namespace files;

inline const std::string kFitConfig = R"({
  "title": "t",
  "parameters": {"E": {"start": "12 kPa", "lower": "1 kPa", "upper": "100 kPa", "sets": ["E1", "E2"]}},
  "data": [{"dataset": "c.csv",
            "protocol": {"kind": "ramp_hold", "rate": "4 mm/s"},
            "noise": {"kind": "relative_to_datum", "relative": 0.1}}]
})";

inline const std::string kFittedJson = R"({"id": "c", "title": "t", "kind": "points",
"observable": "contact_force", "time_origin": "end_of_ramp",
"columns": {"depth_mm": {"quantity": "indentation_depth", "unit": "mm"},
            "time_s": {"quantity": "time", "unit": "s"},
            "force_N": {"quantity": "contact_force", "unit": "N"}}})";
inline const std::string kFittedCsv =
    "depth_mm,time_s,force_N,provenance\n2,0,0.32,table\n2,30,0.21,table\n";

inline std::vector<ErrorCase> fit_config_cases() {
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

inline const std::string kOscillationConfig = R"({
  "title": "t", "law": {"name": "linear-1", "reference": "2 mm"},
  "parameters": {"k1": {"start": "12 N/m", "lower": "1 N/m", "upper": "100 N/m"}},
  "fixed": {"k_inf": "10 N/m", "tau1": "1 s"},
  "data": [{"dataset": "c.csv", "stiffness_per_modulus": "12.56 mm",
            "protocol": {"kind": "oscillation", "operating_depth": "2 mm"},
            "noise": {"kind": "relative_to_datum", "relative": 0.1}}]
})";

inline std::vector<ErrorCase> oscillation_cases() {
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
      {type, "a force of contact", fit,
       with("\"stiffness_per", "\"contact_force\": \"1 mN\", \"stiffness_per")},
      {type, "loss of 0 under relative noise", fit, fitted(kOscillationConfig, "1,1000,0\n")},
      {type, "a spectrum of a relaxation", fit,
       with("\"oscillation\", \"operating_depth\": \"2 mm\"", "\"step_hold\"")},
  };
}

inline const std::string kProblem = R"({"title": "t", "parameter_file": "p.csv",
"observable_file": "o.csv", "condition_file": "c.csv", "measurement_file": "m.csv"})";

inline std::vector<ErrorCase> fit_tables_cases() {
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

inline const std::string kClaims = R"({
  "title": "t", "citation": "c",
  "symbols": [{"name": "k", "value": "2", "unit": "kPa", "where": "p. 1", "quote": "k = 2 kPa",
               "provenance": "text"}],
  "claims": [{"id": "doubled", "topic": "1", "kind": "value", "where": "p. 2", "quote": "4 kPa",
              "printed": "4", "unit": "kPa", "expression": "2 * k",
              "if_holds": "It is.", "if_fails": "It is not."}]
})";

inline std::vector<ErrorCase> claims_cases() {
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

inline const std::string kDesign =
    R"({"title": "t", "law": {"name": "linear-1", "reference": "1 mm"},
"parameters": {
  "k_inf": {"start": "100 N/m", "lower": "1 N/m", "upper": "1000 N/m"},
  "k1": {"start": "100 N/m", "lower": "1 N/m", "upper": "1000 N/m"},
  "tau1": {"start": "2 s", "lower": "0.1 s", "upper": "100 s"}},
"noise": {"force": {"absolute": "0.01 N"}},
"candidates": [{"kind": "ramp_hold", "rate": ["4 mm/s"], "depth": ["8 mm"], "hold": ["9 s"],
  "interval": ["1 s"]}]})";

inline std::vector<ErrorCase> design_cases() {
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

}  // namespace tpm::test::error_cases
