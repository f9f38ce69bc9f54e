#include "tpm/files/keys/file_kind.hpp"

#include "tpm/files/other_kind.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {

Json checked(Json document, const FileKind& kind, const DocumentPlace& place, Numbers numbers) {
  if (document.is_object() && document.contains(kSchemaKey)) {
    if (!document.at(kSchemaKey).is_string()) {
      throw bad_input(place.key(kSchemaKey).where, "is of the wrong type",
                      "a text: the schema of this file, for editors");
    }
    document = without_schema_key(std::move(document));
  }
  require_not_other_kind(document, kind.name, place.where);
  require_form(document, *kind.form, place, numbers);
  return document;
}

Json without_schema_key(Json document) {
  if (document.is_object()) document.erase(kSchemaKey);
  return document;
}

}  // namespace tpm::files
