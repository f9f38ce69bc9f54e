#pragma once
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

/// Reads the block `outputs`, without its formulas. Throws Error(bad_input).
[[nodiscard]] std::vector<SweepOutput> parse_sweep_outputs(const Json& list,
                                                           const DocumentPlace& place);

/// Two ends and how what lies between is spread: {"from", "to", "scale"}. Throws Error(bad_input).
struct SweepRange {
  double from = 0.0, to = 0.0;
  AxisScale scale = AxisScale::linear;
};
[[nodiscard]] SweepRange parse_range(const Json& object, Dimension dimension,
                                     const DocumentPlace& place);

/// A list or a range of quantities, {"values": [...]} or {"from", "to", "count", "scale"}.
/// Throws Error(bad_input).
struct CountedValues {
  ParameterValues values;
  std::uint64_t count = 0;
};
[[nodiscard]] CountedValues parse_values(const Json& object, Dimension dimension,
                                         const DocumentPlace& place);
/// A list of quantities. Throws Error(bad_input).
[[nodiscard]] std::vector<double> parse_list(const Json& list, Dimension dimension,
                                             const DocumentPlace& place);

/// Throws Error(bad_input) unless a text can stand for a number in an expression.
void require_identifier(const std::string& name, std::string_view where);

}  // namespace tpm::sweep
