#pragma once
#include "tpm/fit/select/recording_setup.hpp"

namespace tpm::fit {

/// Finds which channel of a stress-strain recording was imposed: the stress if it is the less noisy
/// one, was held, and the strain went on under it (creep). Sets load_imposed. A fit takes the
/// strain as exact all the same; `warnings` say what that biases, here and where both channels are
/// noisy.
void find_imposed_channel(PreparedRecording& recording);

}  // namespace tpm::fit
