#pragma once
#include "tpm/haptics/session.hpp"
#include "tpm/store/document_place.hpp"

namespace tpm {

/// The phases that the blocks `indentations`, `slides` and `creep` lead to. Throws
/// Error(bad_input).
[[nodiscard]] std::vector<SessionPhase> parse_phases(const Json& session,
                                                     const DocumentPlace& place);

}  // namespace tpm
