#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "command.hpp"

namespace tpm::app {

/// Options of `tpm design` as typed; a text is empty if its option is missing.
struct DesignOptions {
  std::string design;       ///< a design, or a configuration of a fit; empty: laws are studied
  std::string repetitions;  ///< simulated data sets
  std::string seed = "0";
  std::string top;
  std::string folder;
  std::vector<std::string> laws;
  std::string family, noise, order;
  std::vector<std::string> margins;
  std::string output;
  bool verbose = false;
};

/// --seed: a number, or 'clock' for one that differs from run to run.
[[nodiscard]] std::uint64_t design_seed(const std::string& text);

/// A configuration of a fit: how often do its intervals contain the true values? Returns the exit
/// code.
int check_intervals(const DesignOptions& options, const Session& session);

/// No file: does the selection return the law behind simulated data? Returns the exit code.
int check_choice_of_law(const DesignOptions& options, const Session& session);

}  // namespace tpm::app
