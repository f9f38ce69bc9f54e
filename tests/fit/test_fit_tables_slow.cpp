// Fits of a problem in tables.
#include <catch2/catch.hpp>
#include <string>

#include "fitted_parameter.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/petab.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Contains;
using Catch::Matchers::WithinRel;

namespace {

const std::string kTables = std::string(TPM_TEST_SOURCE_DIR) + "/configs/liver_tables/";

/// A copy of the shipped tables with one text replaced in one file.
void copy_with(const test::TempFolder& folder, const std::string& file, const std::string& from,
               const std::string& to) {
  for (const char* name : {"problem.json", "parameters.csv", "observables.csv", "conditions.csv",
                           "measurements.csv"}) {
    std::string text = read_file(kTables + name);
    if (name == file) {
      const auto at = text.find(from);
      REQUIRE(at != std::string::npos);
      text.replace(at, from.size(), to);
    }
    write_file(folder / name, text);
  }
}

}  // namespace

TEST_CASE("the tables of the liver give the fit of its configuration") {
  FitProblem problem = read_fit_problem(kTables + "problem.json");
  problem.config.profiles = false;
  const FitResult tables = run_fit(problem);
  FitConfig config =
      read_fit_config(std::string(TPM_TEST_SOURCE_DIR) + "/configs/liver_relaxation.json");
  config.hypotheses.clear();
  config.profiles = false;
  const FitResult configured = run_fit(config);
  CHECK_THAT(tables.chi_square, WithinRel(configured.chi_square, 1e-10));
  REQUIRE(tables.parameters.size() == 3);
  for (const ParameterResult& p : configured.parameters) {
    CHECK_THAT(find(tables, p.parameter.name).estimate, WithinRel(p.estimate, 1e-7));
  }
}

TEST_CASE("what tables hold and cannot be used is refused by its name and line") {
  const auto refuse = [](const char* file, const char* from, const char* to, const char* message) {
    const test::TempFolder folder;
    copy_with(folder, file, from, to);
    CHECK_THROWS_WITH(read_fit_problem(folder / "problem.json"), Contains(message));
  };
  refuse("measurements.csv", "label", "preequilibrationConditionId",
         "column 'preequilibrationConditionId': is not supported");
  refuse("measurements.csv", "depth_2mm", "depth_3mm",
         "measurements.csv:2: column 'simulationConditionId': 'depth_3mm' is unknown");
  refuse("measurements.csv", "0.32,", "nan,", "column 'measurement'");
  refuse("observables.csv", "force,contact_force", "force,2 * contact_force",
         "formulas are not supported");
  refuse("observables.csv", "normal", "log10-normal", "normal, log-normal, laplace or log-laplace");
  refuse("parameters.csv", "1000,12,1,kPa", "1000,12,yes,kPa", "parameters.csv:2");
  refuse("parameters.csv", "eta1,log", "E,log", "'E' stands twice");
  refuse("parameters.csv", "parameterScale", "objectivePriorType", "is not supported");
  refuse("conditions.csv", "protocol", "treatment", "column 'treatment': is not supported");
  refuse("problem.json", "\"starts\"", "\"data\": [], \"starts\"", "key /data: unknown key");
}

TEST_CASE("a noise formula may be a number, a multiple of the observable or a parameter") {
  for (const char* formula : {"0.02", "0.1 * contact_force", "sigma"}) {
    CAPTURE(formula);
    const test::TempFolder folder;
    copy_with(folder, "observables.csv", "noiseParameter1_force", formula);
    std::string parameters = read_file(folder / "parameters.csv");
    if (std::string(formula) == "sigma") parameters += "sigma,log,0.1,1000,20,1,mN,\n";
    write_file(folder / "parameters.csv", parameters);
    FitProblem problem = read_fit_problem(folder / "problem.json");
    problem.config.profiles = false;
    problem.config.starts = 2;
    CHECK(run_fit(problem).best.usable);
  }
}
