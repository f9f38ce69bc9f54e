#pragma once
#include "tpm/fit/select/recording_setup.hpp"

namespace tpm::fit {

/// Finds which channel of a stress-strain recording was imposed, before its phases are known: the
/// stress if it is the less noisy one, was held, and the strain went on under it (creep). Drive and
/// response then change places, and load_imposed is set: a fit imposes the stress and compares the
/// strain. `warnings` say so, and what it biases if both channels are noisy.
void find_imposed_channel(PreparedRecording& recording);

}  // namespace tpm::fit
