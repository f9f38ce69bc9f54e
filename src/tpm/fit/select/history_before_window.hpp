#pragma once
#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// Detects a fit without earlier loads that had not relaxed yet. Rows that --from-time
/// or --step-time leave out when a file is read are no part of the history that drives the law: it
/// then rests at the drive of the first row that is kept. The file is read once more without them.
/// Where a load among them (2 % of the largest fitted drive from contact, with a response beyond
/// the residual) ended less than 5 times the longest relaxation time before the fitted part, or the
/// law has a spring-pot, whose memory has no end, no parameter of the material is identified
/// (ParameterResult::unconfirmed), and a remark says so. A window "from" of a configuration keeps
/// the history and is not concerned.
/// @return true if a parameter lost its verdict
bool doubt_history(FitResult& fit);

/// Whether the history before the fitted part of an indentation is one that the law has: it loses
/// contact where a load would have to pull. Where at least 3 readings in a row before the fitted
/// part, after a load, lie below the force without contact by more than 5 residuals and 1 % of the
/// peak (a specimen that is glued, gripped or sticks), and less than 5 times the longest relaxation
/// time passed since, no parameter of the material is identified, and a remark says so.
/// @return true if such a history was found
bool doubt_pulled_history(FitResult& fit);

}  // namespace tpm::fit
