// Files of fits, designs, laws and curves: their schemas say what their readers say.
#include <catch2/catch.hpp>

#include "odd_documents.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/import/description.hpp"
#include "tpm/fit/design/design.hpp"
#include "tpm/fit/likelihood/fit_keys.hpp"

using namespace tpm;
using namespace tpm::files;
using namespace tpm::fit;

namespace {

Json of_source(const char* file) {
  return read_json(std::string(TPM_TEST_SOURCE_DIR "/") + file);
}

}  // namespace

TEST_CASE("schema and reader of a fit's configuration agree on odd ones", "[keys]") {
  test::compare_schema_and_form(
      fit_kind(),
      {of_source("configs/liver_all.json"), of_source("configs/liver_relaxation.json"),
       of_source("configs/oscillation_example/fit.json"), example_of(fit_kind())},
      500);
}

TEST_CASE("schema and reader of a fit in tables agree on odd ones", "[keys]") {
  test::compare_schema_and_form(fit_tables_kind(), {of_source("configs/liver_tables/problem.json")},
                                200);
}

TEST_CASE("schema and reader of a design agree on odd ones", "[keys]") {
  test::compare_schema_and_form(design_kind(),
                                {of_source("configs/design_liver.json"),
                                 of_source("configs/design_meat.json"), example_of(design_kind())},
                                400);
}

TEST_CASE("schema and reader of a law agree on odd ones", "[keys]") {
  test::compare_schema_and_form(
      law_kind(), {of_source("tests/fuzz/corpus/law/linear_1.json"), example_of(law_kind())}, 300);
}

TEST_CASE("schema and reader of a curve's description agree on odd ones", "[keys]") {
  test::compare_schema_and_form(
      curve_kind(),
      {of_source("data/amy_creep.json"), of_source("data/evren_static.json"),
       of_source("data/literature_values.json"), of_source("configs/oscillation_example/hold.json"),
       of_source("configs/oscillation_example/spectrum.json"), example_of(curve_kind())},
      300);
}

TEST_CASE("examples of fits, designs and laws are read", "[keys]") {
  CHECK_NOTHROW(parse_fit_config(example_of(fit_kind()), "example"));
  CHECK_NOTHROW(parse_design(example_of(design_kind()), "example"));
  CHECK_NOTHROW(law_from_json(example_of(law_kind()), "example"));
}
