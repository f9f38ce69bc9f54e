#include "tpm/files/keys/file_kind.hpp"

#include "tpm/files/other_kind.hpp"
#include "tpm/files/renamed_names.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {

Json checked(Json document, const FileKind& kind, std::string_view where, Numbers numbers) {
  Json current = with_current_names(std::move(document), kind.name, where);
  const DocumentPlace place{std::string(where)};
  if (current.is_object() && current.contains(kSchemaKey)) {
    if (!current.at(kSchemaKey).is_string()) {
      throw bad_input(place.key(kSchemaKey).where, "is of the wrong type",
                      "a text: the schema of this file, for editors");
    }
    current = without_schema_key(std::move(current));
  }
  require_not_other_kind(current, kind.name, where);
  require_form(current, *kind.form, place, numbers);
  return current;
}

Json without_schema_key(Json document) {
  if (document.is_object()) document.erase(kSchemaKey);
  return document;
}

}  // namespace tpm::files
