#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/document_place.hpp"
#include "tpm/sweep/cell_model.hpp"
#include "tpm/sweep/parameter_values.hpp"

namespace tpm::sweep {

/// Of what and when a variable is.
struct SweepOutput {
  enum class Kind {
    lambda1,                    ///< lambda1 at the imposed depth
    peak_force,                 ///< the largest force of an indentation
    end_force,                  ///< at its end
    force_at,                   ///< at a time
    force_over,                 ///< at several times: a curve
    instantaneous_creep_depth,  ///< just after the load
    creep_depth,                ///< at the end of the load
    creep_depth_at,
    creep_depth_over,
  };
  Kind kind = Kind::peak_force;
  SweepVariable variable;
  double time_s = 0.0;  ///< of force_at and creep_depth_at, from the start on

  [[nodiscard]] bool of_creep() const {
    return kind == Kind::instantaneous_creep_depth || kind == Kind::creep_depth ||
           kind == Kind::creep_depth_at || kind == Kind::creep_depth_over;
  }
};

/// Name of an output in a file.
struct OutputForm {
  enum class When { fixed, at, over };
  SweepOutput::Kind meaning;
  std::string_view text, unit, words;
  When when;
};
[[nodiscard]] std::span<const OutputForm> output_forms();

/// A list or a range of values as a file says it. The dimension of a parameter's values is known
/// to the model alone.
struct ValueKeys {
  std::string name;  ///< of the parameter; empty: that of what it changes
  std::vector<Json> values;
  Json from, to;  ///< null: none
  std::optional<std::uint64_t> count;
  std::optional<AxisScale> scale;
};

/// An output as a file says it.
struct SweepOutputKeys {
  std::optional<SweepOutput::Kind> kind;  ///< none: a formula
  std::string name;
  double time_s = 0.0;  ///< of one at a time
  ValueKeys times;      ///< of a curve
  std::string formula;
};

/// Those of the model, without formulas. Throws Error(bad_input).
[[nodiscard]] std::vector<SweepOutput> outputs_of(const std::vector<SweepOutputKeys>& outputs,
                                                  const DocumentPlace& place);

/// Two ends and how what lies between is spread. Throws Error(bad_input).
struct SweepRange {
  double from = 0.0, to = 0.0;
  AxisScale scale = AxisScale::linear;
};
[[nodiscard]] SweepRange range_of(const ValueKeys& said, Dimension dimension,
                                  const DocumentPlace& place);

/// A list or a range of quantities. Throws Error(bad_input).
struct CountedValues {
  ParameterValues values;
  std::uint64_t count = 0;
};
[[nodiscard]] CountedValues values_of(const ValueKeys& said, Dimension dimension,
                                      const DocumentPlace& place);

/// Throws Error(bad_input) unless a text can stand for a number in an expression.
void require_identifier(const std::string& name, std::string_view where);

}  // namespace tpm::sweep
