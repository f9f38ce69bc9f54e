#pragma once
#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// A kernel whose fitted exponent is that of no probe (1 of a punch, 1.5 of a ball, 2 of a cone) is
/// a power that happens to follow the loading, of a thin layer or a tissue that stiffens, say. It
/// leads back to a contact of its own, which may lie far in the air. Where what was measured of the
/// contact is much less sure than the fit, or where the fit leaves contact open, contact is not
/// called identified (ParameterResult::not_separable), nor are the stiffnesses and the exponent:
/// they describe a power of the depth from that contact, and hold at no depth from another. Nor is
/// a zero of the force that no rest tells. The covariance does not
/// tell how far they are off, as it supposes the power. Relaxation times are left as they are: they
/// follow from the course of the force while the depth is constant, for any loading.
void doubt_contact(FitResult& fit);

/// Few samples of a loading weigh little in a long recording: a law may describe the whole and miss
/// them, and contact follows from them alone. Where they lie twice as far from the law as its
/// noise goes, and one further than chance takes it (0.01 %), contact and the stiffnesses that are
/// counted from it are not called identified (ParameterResult::unconfirmed), and a remark says so.
/// Leaves a law alone that was found not to describe the recording.
void doubt_loading(FitResult& fit);

}  // namespace tpm::fit
