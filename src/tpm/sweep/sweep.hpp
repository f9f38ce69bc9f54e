#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"
#include "tpm/sweep/cell_model.hpp"
#include "tpm/sweep/parameter_values.hpp"

namespace tpm::sweep {

/// One dimension of a sweep.
struct SweepAxis {
  std::string name;
  std::uint64_t size = 0;
};

/// A parameter that a sweep changes. All parameters of one axis change together.
struct SweptParameter {
  std::string name;    ///< in expressions and results
  std::string target;  ///< as the model knows it: "spacing", "/material/E1"
  std::string unit;    ///< SI; may be empty
  std::size_t axis = 0;
  ParameterValues values;
};

/// Cells for which a condition holds are not run.
struct SkipCondition {
  std::string when;                   ///< an expression; anything but 0 means skip
  std::optional<std::string> reason;  ///< none: the expression
};

/// A scalar computed from parameters and other scalars.
struct SweepFormula {
  std::string name, text;
};

/// Request of SWEEP.json (schemas/sweep.schema.json, docs/sweep.md). A cell is one combination
/// of the axes' places, numbered with the last axis fastest.
struct Sweep {
  std::string title, description;
  std::string document;     ///< as read, scenes put in: what decides the results
  std::string fingerprint;  ///< of the document, of meshes it names and of this version of tpm
  std::vector<SweepAxis> axes;
  std::vector<SweptParameter> parameters;
  std::vector<SkipCondition> skip;
  std::vector<SweepFormula> formulas;
  std::shared_ptr<const SweepModel> model;
  std::vector<SweepVariable> variables;  ///< the model's, then those of the formulas
  std::uint64_t block_cells = 1;         ///< cells that are computed and stored together

  [[nodiscard]] std::uint64_t cells() const;
  [[nodiscard]] std::uint64_t blocks() const;
  /// Changed parameters, for the model.
  [[nodiscard]] std::vector<SweptTarget> swept() const;
  /// The places on all axes of a cell.
  [[nodiscard]] std::vector<std::uint64_t> places(std::uint64_t cell) const;
  /// All numbers of one cell's variables, curves included.
  [[nodiscard]] std::size_t width() const;
};

/// More cells than this are refused: nobody would wait for them.
inline constexpr double kMostCells = 1e12;

/// Throws Error(bad_input) with the key.
/// @param folder that files named in the document are relative to
[[nodiscard]] Sweep parse_sweep(const Json& document, std::string_view where,
                                const std::filesystem::path& folder);
[[nodiscard]] Sweep read_sweep(const std::filesystem::path& path);

}  // namespace tpm::sweep
