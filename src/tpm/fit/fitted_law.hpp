#pragma once
#include <optional>
#include <string>

#include "tpm/fit/fit.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::fit {

/// Why a fit of this configuration has no law file: it fits an organ, or the paper's element with
/// a tension frozen at one value. Empty if it has one.
[[nodiscard]] std::optional<std::string> no_law_because(const FitConfig& config);

/// The fitted law with its uncertainty, for law files. The paper's element becomes the law
/// linear-1-elastic, which is the same model:
///
///     k_inf = P2 A0/l0,  k1 = E2^2/(E1 + E2) A0/l0,  tau1 = eta1/(E1 + E2),
///     k_tension = lambda1(u_ref) A0/l0,  spacing = x
///
/// Contact point and offset are in it if it was fitted to one recording; of several each has its
/// own, and they are left out. The covariance is the fit's, in the fit's coordinates (of the
/// element mapped to those of the law to first order); there is none if the data do not determine
/// all parameters. Throws Error(bad_input) with no_law_because().
[[nodiscard]] LawFile fitted_law(const FitResult& fit);

/// The coordinate of a law file in which a parameter was estimated.
[[nodiscard]] Coordinate coordinate_of(Scale scale);

/// True if recordings of a stretch that are fitted together have slack lengths of their own.
[[nodiscard]] bool has_own_slack(const FitConfig& config);

}  // namespace tpm::fit
