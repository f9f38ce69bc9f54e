#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/sweep/sweep_keys.hpp"
#include "tpm/sweep/sweep_result.hpp"

namespace tpm::sweep {

/// An axis of a file of results.
struct ReadAxis {
  std::string name, unit;
  std::vector<double> places;  ///< SI, or numbers from 0 on where several parameters change
  std::vector<std::string> parameters;  ///< that change along it
};

/// A variable, or an operation that is counted.
struct ReadVariable {
  std::string name, unit, meaning;
  std::vector<double> times_s;  ///< of a curve
  bool counts = false;          ///< operations, not a variable
};

/// Where another axis is fixed.
struct FixedValue {
  std::string axis;
  double value = 0.0;  ///< SI
  std::string unit;
};

/// A place on each axis that is fixed, by name.
using FixedPlaces = std::vector<std::pair<std::string, std::uint64_t>>;

/// Reads what write_sweep has written, a piece at a time. Everything throws Error(bad_input).
class SweepReader {
 public:
  explicit SweepReader(const std::filesystem::path& file);

  [[nodiscard]] const std::string& title() const { return title_; }
  /// An axis as SWEEP.json says it.
  [[nodiscard]] AxisKeys said_of(const ReadAxis& of) const;
  [[nodiscard]] const std::vector<ReadAxis>& axes() const { return axes_; }
  /// Variables, then counts of operations as count_NAME.
  [[nodiscard]] const std::vector<ReadVariable>& variables() const { return variables_; }
  [[nodiscard]] const ReadVariable& variable(const std::string& name) const;
  /// The number of an axis. Throws Error(bad_input) that names those there are.
  [[nodiscard]] std::size_t axis(const std::string& name) const;
  [[nodiscard]] std::uint64_t cells() const;
  [[nodiscard]] CellTally tally() const;
  /// A parameter's values along its axis.
  [[nodiscard]] std::vector<double> parameter(const std::string& name) const;
  [[nodiscard]] std::string parameter_unit(const std::string& name) const;
  /// As the model knows it.
  [[nodiscard]] std::string parameter_target(const std::string& name) const;
  /// Numbers of cells that ran on each model, by name, and the rule that chose the models, in
  /// words; nothing where there was no choice.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> models() const;
  [[nodiscard]] std::string choice_of_models() const;

  /// A number over one or two axes, the others fixed at a place each (the first, if not said).
  /// @param rows, columns names of axes; no rows: one row
  [[nodiscard]] std::vector<double> slice(const std::string& variable,
                                          const std::optional<std::string>& rows,
                                          const std::string& columns,
                                          const FixedPlaces& fixed) const;
  /// A curve at a place on each axis.
  [[nodiscard]] std::vector<double> curve(const std::string& variable,
                                          const FixedPlaces& fixed) const;
  /// All numbers of several scalars, a stretch of cells at a time.
  void each(const std::vector<std::string>& names,
            const std::function<void(const std::vector<std::vector<double>>&)>& see) const;

 private:
  [[nodiscard]] std::vector<std::uint64_t> start_at(const FixedPlaces& fixed) const;

  Hdf5Reader file_;
  std::string title_;
  Json document_;
  std::vector<ReadAxis> axes_;
  std::vector<ReadVariable> variables_;
};

/// Where all axes but one are fixed (at the first place, if not said).
/// Throws Error(bad_input) naming `--at` if that one is fixed too.
[[nodiscard]] std::vector<FixedValue> other_places(const SweepReader& sweep, const ReadAxis& along,
                                                   const FixedPlaces& fixed);

}  // namespace tpm::sweep
