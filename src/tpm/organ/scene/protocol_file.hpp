#pragma once
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::organ {

/// A history and when its answer is asked for.
struct ProtocolFile {
  Protocol protocol;
  std::vector<double> times_s;  ///< rising
};

/// True if a document says what is done to a tissue: it has a block `protocol`.
[[nodiscard]] bool has_protocol(const Json& document);

/// The declaration of a file with these blocks.
[[nodiscard]] const FileKind& protocol_kind();

/// The blocks `protocol` and `outputs` of a document, of a scene for example; its other blocks are
/// not looked at (schemas/protocol.schema.json). Throws Error(bad_input) with the key.
[[nodiscard]] ProtocolFile parse_protocol_file(const Json& document, std::string_view where);

/// `count` times over a protocol, both ends and all of its corners among them.
[[nodiscard]] std::vector<double> times_over(const Protocol& protocol, std::size_t count);

}  // namespace tpm::organ
