#pragma once
#include <fmt/format.h>

#include <CLI/CLI.hpp>

namespace tpm::app {

/// Adds --verbose: all that was computed instead of an answer of at most 25 lines.
/// @param such_as "every law tried, starts, readings"
inline void add_verbose_option(CLI::App& command, bool& verbose, const char* such_as) {
  command.add_flag(
      "--verbose", verbose,
      fmt::format("Print everything: {} (default: an answer of at most 25 lines)", such_as));
}

}  // namespace tpm::app
