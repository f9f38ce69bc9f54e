#pragma once
// Parts of parse_fit_config, each for one section of the document. All throw Error(bad_input) with
// the key; all are given documents that the schema has accepted.
#include <string>
#include <string_view>

#include "tpm/files/document_place.hpp"
#include "tpm/fit/likelihood/config.hpp"

namespace tpm::fit {

/// The dimension of the readings of a data set, and so of a in sigma = a + b |model|.
[[nodiscard]] Dimension reading_dimension(const FitConfig& config, const DataChoice& data);

/// An element of "data".
[[nodiscard]] DataChoice parse_data(const Json& j, const FitConfig& config,
                                    const DocumentPlace& place);

/// "noise" of a data set.
/// @param readings dimension of the data
void parse_noise(const Json& j, DataChoice& data, Dimension readings, const DocumentPlace& place);

/// Gives the noise parameters without a name of their own one: "sigma_a", "sigma_b", and the data
/// set's name if there are several of them.
void name_noise_parameters(FitConfig& config);

/// Reads the parameters to estimate: of the model in the order of the file, then of the noise.
void parse_parameters(const Json& document, const Model& model, FitConfig& config,
                      const DocumentPlace& place);

/// Fixed values of all model parameters; NaN where nobody gave one.
[[nodiscard]] std::vector<double> parse_fixed(const Json& document, const Model& model,
                                              const FitConfig& config, const DocumentPlace& place);

/// Each model parameter of each data set is set once: by one estimated parameter, or fixed.
void require_each_set_once(const FitConfig& config, const Model& model, const Json& document,
                           const DocumentPlace& place);

/// "hypotheses".
void parse_hypotheses(const Json& list, FitConfig& config, const DocumentPlace& place);

}  // namespace tpm::fit
