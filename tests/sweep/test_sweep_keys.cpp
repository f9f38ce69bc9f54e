// Files of sweeps: their schema says what their reader says.
#include <catch2/catch.hpp>

#include "odd_documents.hpp"
#include "tpm/sweep/sweep.hpp"
#include "tpm/sweep/sweep_keys.hpp"

using namespace tpm;
using namespace tpm::sweep;

namespace {

Json of_source(const char* file) {
  return read_json(std::string(TPM_TEST_SOURCE_DIR "/") + file);
}

}  // namespace

TEST_CASE("schema and reader of a sweep agree on odd ones", "[keys]") {
  test::compare_schema_and_form(
      sweep_kind(),
      {of_source("configs/sweep_x_depth.json"), of_source("configs/sweep_creep_work.json"),
       of_source("configs/sweep_sensitivity.json"), of_source("configs/sweep_organ.json"),
       of_source("configs/sweep_convergence_step.json"),
       of_source("configs/sweep_sensitivity_organ_creep.json"), example_of(sweep_kind())},
      500);
}

TEST_CASE("the example of a sweep is read", "[keys]") {
  CHECK_NOTHROW(parse_sweep(example_of(sweep_kind()), "example", {}));
}

TEST_CASE("an axis or an output that says two things, or nothing, is refused at its place",
          "[keys]") {
  const auto refusal = [](const char* pointer, Json value) {
    Json sweep = of_source("configs/sweep_x_depth.json");
    sweep[Json::json_pointer(pointer)] = std::move(value);
    return test::refusal_of([&] { (void)checked(sweep, sweep_kind(), "s.json"); });
  };
  using Catch::Matchers::Contains;
  CHECK_THAT(refusal("/axis", 1), Contains("/axis: unknown key (did you mean 'axes'?)"));
  CHECK_THAT(refusal("/axes/0", {{"values", {1}}}),
             Contains("key /axes/0: has no key that says what it is; expected one of parameter"));
  CHECK_THAT(refusal("/axes/0", {{"parameter", "E1"}, {"seed", 1}}),
             Contains("key /axes/0/seed: stands beside 'parameter'") &&
                 Contains("seed goes with samples"));
  CHECK_THAT(refusal("/outputs/0", "peek_force"),
             Contains("key /outputs/0: unknown word 'peek_force' (did you mean 'peak_force'?)"));
  CHECK_THAT(refusal("/tolerance", "1 %"),
             Contains("key /tolerance: is no key of the model 'single_contact'"));
}
