// Claims of a paper: their schema says what their reader says.
#include <catch2/catch.hpp>

#include "odd_documents.hpp"
#include "tpm/paper/claims/claims.hpp"

using namespace tpm;
using namespace tpm::paper;

namespace {

Json of_source(const char* file) {
  return read_json(std::string(TPM_TEST_SOURCE_DIR "/") + file);
}

}  // namespace

TEST_CASE("schema and reader of claims agree on odd ones", "[keys]") {
  Json few = of_source("data/paper_claims.json");
  for (const char* list : {"symbols", "tables", "claims"}) {
    Json& all = few.at(list);
    while (all.size() > 6) all.erase(all.size() - 1);
  }
  test::compare_schema_and_form(claims_kind(), {few, example_of(claims_kind())}, 300);
}
