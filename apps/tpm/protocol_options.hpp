#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/scene/protocol_file.hpp"

namespace tpm::app {

/// --depth, --rate and --hold: the protocol that people ask for most, without a file.
struct RampOptions {
  std::string depth, rate, hold;
};

void add_ramp_options(CLI::App& command, RampOptions& options);

/// The protocol of the options, or of a JSON file that has one; none for another file. Throws
/// Error(usage) for neither or both.
[[nodiscard]] std::optional<ProtocolFile> chosen_protocol(const RampOptions& options,
                                                          const std::vector<std::string>& files);

}  // namespace tpm::app
