#pragma once
#include "tpm/base/namespaces.hpp"
#include "tpm/files/keys/file_kind.hpp"

namespace tpm::haptics {

/// Keys of the header before the rows of a recording.
[[nodiscard]] const FileKind& recording_header_kind();

/// Keys of the footer behind them.
[[nodiscard]] const FileKind& recording_closing_kind();

}  // namespace tpm::haptics
