#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/units.hpp"

namespace tpm::sweep {

/// Result of each cell under one name: a number, or a curve.
struct SweepVariable {
  std::string name;
  std::string unit;  ///< SI; may be empty
  std::string meaning;
  std::vector<double> times_s;  ///< of a curve; empty for a number

  [[nodiscard]] std::size_t width() const { return times_s.empty() ? 1 : times_s.size(); }
};

/// Remarks of a cell's run besides its values.
struct CellAnswer {
  /// Of the error, in parts of the largest response; 0 where there is none but rounding. Where the
  /// sweep states a tolerance the claim of the model that was chosen, else the method's estimate.
  double error_estimate = 0.0;
  std::uint8_t model = 0;  ///< in SweepModel::models()
};

/// Parameter that a sweep changes, and its range.
struct SweptTarget {
  std::string target;  ///< as the model knows it
  std::size_t axis = 0;
  std::uint64_t places = 1;           ///< of the axis
  double least = 0.0, largest = 0.0;  ///< SI, as far as a few thousand places show
};

/// A worker's own model of a cell: not for two threads.
class CellModel {
 public:
  CellModel() = default;
  CellModel(const CellModel&) = delete;
  CellModel& operator=(const CellModel&) = delete;
  virtual ~CellModel() = default;

  /// @param swept SI values of the swept parameters
  /// @param values of the model's variables one after the other; to be filled
  /// @param counts of the model's operations, to be filled
  /// Throws Error(bad_input) or Error(numerical) where the cell has no answer. The result depends
  /// on `swept` alone, not on cells before.
  virtual CellAnswer run(std::span<const double> swept, std::span<double> values,
                         std::span<std::int64_t> counts) = 0;
};

/// Subject of a sweep, as SWEEP.json describes it.
class SweepModel {
 public:
  SweepModel() = default;
  SweepModel(const SweepModel&) = delete;
  SweepModel& operator=(const SweepModel&) = delete;
  virtual ~SweepModel() = default;

  /// Of a parameter that can be swept. Throws Error(bad_input) that names those there are.
  [[nodiscard]] virtual Dimension dimension_of(const std::string& target,
                                               std::string_view where) const = 0;
  [[nodiscard]] virtual const std::vector<SweepVariable>& variables() const = 0;
  /// Names of the operations that are counted.
  [[nodiscard]] virtual std::vector<std::string> counted() const = 0;
  /// Names of the models that cells may run on; none where all run on one.
  [[nodiscard]] virtual std::vector<std::string> models() const { return {}; }
  /// Rule that chooses the models of cells, in words; empty where there is no choice.
  [[nodiscard]] virtual std::string choice_of_models(
      const std::vector<SweptTarget>& /*swept*/) const {
    return {};
  }
  /// Names that expressions may use besides swept parameters, with their SI values.
  [[nodiscard]] virtual std::vector<std::pair<std::string, double>> constants() const { return {}; }
  /// Number of cells that are worth being computed and stored together.
  [[nodiscard]] virtual std::uint64_t usual_block() const = 0;
  /// @param swept the parameters, in their order
  [[nodiscard]] virtual std::unique_ptr<CellModel> cell_model(
      const std::vector<SweptTarget>& swept) const = 0;
};

struct SweepKeys;

/// The paper's star in closed form: indentation, creep or both.
[[nodiscard]] std::shared_ptr<const SweepModel> single_contact_model(const SweepKeys& keys,
                                                                     std::string_view where);

/// The quasi-static network of a scene, which may not be a file's name any more. Parameters are
/// JSON pointers to numbers in the scene, and those of its first material by name: material.tau2.
/// @param folder that a mesh in the scene is relative to
[[nodiscard]] std::shared_ptr<const SweepModel> organ_sweep_model(
    const SweepKeys& keys, std::string_view where, const std::filesystem::path& folder);

}  // namespace tpm::sweep
