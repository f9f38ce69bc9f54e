// Places in documents, for messages.
#include <catch2/catch.hpp>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/document_place.hpp"

using namespace tpm;
using namespace tpm::files;

TEST_CASE("a key of a document follows its file, a key below a key follows that") {
  const DocumentPlace file{"s.json"};
  CHECK(file.where == "s.json");
  CHECK(file.key("model").where == "s.json: key /model");
  CHECK(file.key("model").key("scene").key("0").where == "s.json: key /model/scene/0");
}

TEST_CASE("the name of a file does not decide whether a key was named") {
  CHECK(DocumentPlace{"odd: key name.json"}.key("a").where == "odd: key name.json: key /a");
}
