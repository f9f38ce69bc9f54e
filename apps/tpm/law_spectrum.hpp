#pragma once
#include <string>

#include "command.hpp"

namespace tpm::app {

/// Options of `tpm predict LAW --frequencies`.
struct SpectrumTexts {
  std::string law;
  std::string frequencies;  ///< "1 Hz, 10 Hz", or "0.001 Hz : 100 Hz : 16"
  std::string depth;        ///< about which the tissue oscillates; the law's reference if empty
  std::string output;
};

/// Writes storage and loss of a law over frequency, small oscillations; returns the exit code.
int write_spectrum(const SpectrumTexts& texts, const Session& session);

}  // namespace tpm::app
