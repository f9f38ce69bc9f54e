// Files of fits, designs, laws and curves: their schemas say what their readers say.
#include <catch2/catch.hpp>

#include "odd_documents.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/import/description.hpp"
#include "tpm/files/import/reading_options.hpp"
#include "tpm/fit/design/design.hpp"
#include "tpm/fit/likelihood/fit_keys.hpp"

using namespace tpm;
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

TEST_CASE("the schema of a fit shows the defaults of the library and the rules of the reader") {
  const Json schema = json_schema(fit_kind());
  const auto default_of = [&](const char* block, const char* name) {
    return schema.at("definitions").at(block).at("properties").at(name).value("default", Json());
  };
  CHECK(default_of("starts", "count") == FitConfig{}.starts);
  CHECK(default_of("starts", "seed") == FitConfig{}.seed);
  CHECK(default_of("profile", "level") == FitConfig{}.level);
  CHECK(default_of("profile", "enabled") == FitConfig{}.profiles);
  CHECK(default_of("loss", "width") == RobustLoss{}.width);
  CHECK(default_of("bootstrap", "replicates") == BootstrapOptions{}.replicates);
  CHECK(default_of("bootstrap", "resample") == "residuals");
  CHECK(default_of("bootstrap", "block_length").is_null());
  CHECK(default_of("fit_noise", "scale") == "known");
  CHECK(default_of("fit_data", "from").is_null());
  const auto noise = schema.at("definitions").at("fit_noise").at("description").get<std::string>();
  CHECK(noise.find("only with the distribution 'student_t'") != std::string::npos);
}

TEST_CASE("options of reading a recording are read as they are written") {
  ImportOptions options;
  for (const auto& [name, text] :
       std::vector<std::pair<std::string, std::string>>{{"decimal", "comma"},
                                                        {"separator", "semicolon"},
                                                        {"header_rows", "3"},
                                                        {"drive", "Depth"},
                                                        {"negate_response", "true"},
                                                        {"step_time", "185 s"},
                                                        {"rest_length", "20 mm"},
                                                        {"segments", "extend,pause"}}) {
    set_reading_option(options, name, text, "test");
  }
  set_reading_unit(options, "Force", "mN", "test");
  const ValueType<ImportOptions> type = reading_type();
  const Json written = type.write(options);
  CHECK(written.at("negate_response") == true);
  CHECK(written.at("segments") == Json::array({"extend", "pause"}));
  CHECK(written.at("units") == Json{{"Force", "mN"}});
  CHECK(type.form->keys.size() == reading_options().size() + 1);  // and the units
  const DocumentPlace place{"test"};
  CHECK_NOTHROW(require_form(written, *type.form, place));
  CHECK(type.write(type.read(written, place)) == written);
}

TEST_CASE("examples of fits, designs and laws are read", "[keys]") {
  CHECK_NOTHROW(parse_fit_config(example_of(fit_kind()), "example"));
  CHECK_NOTHROW(parse_design(example_of(design_kind()), "example"));
  CHECK_NOTHROW(law_from_json(example_of(law_kind()), "example"));
}
