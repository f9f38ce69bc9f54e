#include "tpm/sweep/sweep_sensitivity.hpp"

#include "tpmkit/error.hpp"

namespace tpm::sweep {

SweepSensitivity sensitivity_of(const SweepReader& sweep, const std::string& variable,
                                const FixedPlaces& fixed, double level) {
  const Json& axes = sweep.document().at("axes");
  for (std::size_t a = 0; a < axes.size(); ++a) {
    if (axes[a].value("samples", "") != "sensitivity") continue;
    const ReadAxis& axis = sweep.axes().at(a);
    SweepSensitivity found{variable, axis.parameters, {}, {}, other_places(sweep, axis, fixed)};
    found.design = {
        static_cast<int>(axis.parameters.size()), axes[a].at("count").get<std::uint64_t>(),
        axes[a].at("replicates").get<std::uint64_t>(), axes[a].value("seed", std::uint64_t{0})};
    found.indices = sobol_indices(found.design, sweep.slice(variable, {}, axis.name, fixed), level);
    return found;
  }
  throw bad_input("sweep", "no axis of samples of the kind 'sensitivity'",
                  "{\"samples\": \"sensitivity\", \"count\": 256, \"replicates\": 16, ...}");
}

}  // namespace tpm::sweep
