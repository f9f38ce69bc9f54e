#pragma once
// Parts of parse_fit_config: what a file states, in the dimensions of the model and the data. All
// throw Error(bad_input) with the place in the file.
#include <vector>

#include "tpm/files/document_place.hpp"
#include "tpm/fit/likelihood/stated_fit.hpp"

namespace tpm::fit {

/// The dimension of the readings of a data set, and so of a in sigma = a + b |model|.
[[nodiscard]] Dimension reading_dimension(const FitConfig& config, const DataChoice& data);

/// The data sets of a configuration that has its model. Noise parameters without a name of their
/// own are called "sigma_a" and "sigma_b", with the data set's name if there are several of them.
[[nodiscard]] std::vector<DataChoice> data_of(const std::vector<StatedData>& stated,
                                              const FitConfig& config);

/// The parameters to estimate: of the model in the order of the file, then of the noise.
/// @param config has its data
[[nodiscard]] std::vector<EstimatedParameter> parameters_of(const StatedFit& stated,
                                                            const Model& model,
                                                            const FitConfig& config);

/// Fixed values of all model parameters; NaN where nobody gave one.
[[nodiscard]] std::vector<double> fixed_values(const StatedValues& stated, const Model& model,
                                               const FitConfig& config);

/// Each model parameter of each data set is set once: by one estimated parameter, or fixed.
/// @param place of the configuration
void require_each_set_once(const FitConfig& config, const Model& model, const StatedValues& fixed,
                           const DocumentPlace& place);

[[nodiscard]] std::vector<Hypothesis> hypotheses_of(const std::vector<StatedHypothesis>& stated,
                                                    const FitConfig& config);

}  // namespace tpm::fit
