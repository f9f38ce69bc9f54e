#pragma once
// The kinds of files that users write, each with its form.
#include <functional>
#include <string>
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/keys/form.hpp"

namespace tpm::files {

/// A kind of file with its declared form.
struct FileKind {
  std::string name;      ///< "scene" for schemas/scene.schema.json
  std::string title;     ///< meaning of such a file, and its commands
  std::string sentence;  ///< the notation of its values
  FormPtr form;
};

/// The document without "$schema", which is for editors. Throws
/// Error(bad_input), at the key, for what has not the form; what is a file of another kind is
/// called so.
[[nodiscard]] Json checked(Json document, const FileKind& kind, const DocumentPlace& place,
                           Numbers numbers = Numbers::texts_alone);

/// A document without "$schema": a document within another, where the name would mean another file.
[[nodiscard]] Json without_schema_key(Json document);

/// The JSON Schema (draft 7) of a kind, as it stands in schemas/. Rules about several keys stand in
/// descriptions.
[[nodiscard]] Json json_schema(const FileKind& kind);

/// A small file of the kind: the required keys, and those whose declaration has an example.
[[nodiscard]] Json example_of(const FileKind& kind);

/// All keys of a kind as a section of the page of keys, Markdown.
[[nodiscard]] std::string keys_section(const FileKind& kind);

}  // namespace tpm::files
