#pragma once
#include <span>
#include <vector>

#include "tpm/fit/fit.hpp"
#include "tpm/fit/recording/prepared_recording.hpp"

namespace tpm::fit {

/// doubt_contact, and the zero where a rest does not tell it.
///
/// A rest whose readings are all the same, the smallest of the recording, although readings under
/// load scatter, was cut off: an amplifier that has no negative output, or a display that
/// suppresses small values. The true zero may lie anywhere below, and the force rises from that
/// level late. Neither zero nor contact is called identified then (ParameterResult::not_separable),
/// nor are coefficients of a tissue that is pressed: they are counted from that contact. Says so in
/// FitResult::remarks. A rest without a reading below 0 whose noise would make some lost them, or
/// their sign: zero and contact are then off by up to its noise, and are not identified, either;
/// the coefficients hardly notice. No such rest: rounding that is coarser than the noise, and a
/// noise that grows with the reading.
/// @param recordings as they were prepared, in the order of FitConfig::data
void doubt_placement(FitResult& fit, std::span<const PreparedRecording> recordings);

/// The same for the data of a configuration, in the order of FitConfig::data.
void doubt_placement(FitResult& fit, const std::vector<DataSet>& data);

}  // namespace tpm::fit
