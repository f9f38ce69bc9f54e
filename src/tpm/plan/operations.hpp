#pragma once
// Cost of operations on a machine.
#include <array>
#include <filesystem>
#include <string>
#include <string_view>

#include "tpmkit/operation_count.hpp"

#include "tpm/base/namespaces.hpp"

namespace tpm::plan {

/// A kind of work in words and figures.
struct OperationEntry {
  Operation meaning;
  std::string_view text;  ///< key in files and results
  double nominal_s;       ///< usual time of one, where no machine was calibrated
};
[[nodiscard]] const std::array<OperationEntry, kOperations>& operation_table();

/// The time that each operation takes on a machine, s.
struct OperationCosts {
  std::array<double, kOperations> seconds;
  std::string source;  ///< "nominal", or the file it was read from

  [[nodiscard]] double seconds_of(const OperationCount& count) const;
};

[[nodiscard]] OperationCosts nominal_costs();

/// Measures every operation on this machine, some seconds: the least of many short repeats, written
/// with two digits.
[[nodiscard]] OperationCosts measured_costs();

/// The file that `tpm plan` keeps the costs of this machine in: tpmkit/operations.json in
/// $XDG_CACHE_HOME, else in .cache of $HOME; empty if neither is set.
[[nodiscard]] std::filesystem::path usual_costs_file();

/// Throws Error(environment).
void write_costs(const OperationCosts& costs, const std::filesystem::path& file);
/// Throws Error(bad_input) with the key.
[[nodiscard]] OperationCosts read_costs(const std::filesystem::path& file);

}  // namespace tpm::plan
