#pragma once
#include <string>
#include <vector>

#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// The warnings of select_law(), for the fit of a configuration, so that a configuration that
/// `tpm fit RECORDING` has written warns of the same: what must be known of each recording
/// (recording_remarks), what the protocol cannot resolve (protocol_remarks) or, of one material
/// function, its range (function_remarks), and samples after the window (outside_remarks). Beside
/// data sets of another kind nothing is said of the protocol: they may tell what it hides.
/// @param data what was fitted, one for each of the configuration's data sets
/// @param from_files the data sets stand in the files that the configuration names: rows left out
///        of them and the instrument beside them are then told, too
[[nodiscard]] std::vector<Remark> configuration_remarks(const FitResult& fit,
                                                        const std::vector<DataSet>& data,
                                                        bool from_files);

}  // namespace tpm::fit
