#pragma once
#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// Doubts the intervals of a fit whose adequacy was not judged and whose residuals follow each
/// other so closely that they count as fewer independent readings than there are parameters: then
/// neither a rest nor the residuals tell the noise, and a law that is wrong looks the same. No
/// parameter is then called identified (ParameterResult::unconfirmed).
/// @return true if they are doubted
bool doubt_untold_noise(FitResult& fit);

}  // namespace tpm::fit
