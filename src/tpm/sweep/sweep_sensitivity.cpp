#include "tpm/sweep/sweep_sensitivity.hpp"

#include "tpmkit/error.hpp"

namespace tpm::sweep {

SweepSensitivity sensitivity_of(const SweepReader& sweep, const std::string& variable,
                                const FixedPlaces& fixed, double level) {
  for (const ReadAxis& axis : sweep.axes()) {
    const AxisKeys said = sweep.said_of(axis);
    if (said.kind != AxisKind::samples || said.points != PointKind::sensitivity) continue;
    SweepSensitivity found{variable, sweep.variable(variable).unit,   axis.parameters, {},
                           {},       other_places(sweep, axis, fixed)};
    found.design = {static_cast<int>(axis.parameters.size()), said.count, said.replicates.value(),
                    said.seed};
    found.indices = sobol_indices(found.design, sweep.slice(variable, {}, axis.name, fixed), level);
    return found;
  }
  throw bad_input("sweep", "no axis of samples of the kind 'sensitivity'",
                  "{\"samples\": \"sensitivity\", \"count\": 256, \"replicates\": 16, ...}");
}

}  // namespace tpm::sweep
