#pragma once
#include <span>
#include <string>
#include <vector>

#include "tpm/files/json.hpp"
#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// SHA-256 of the numbers of a recording, however the file that holds them is named, ordered or
/// formatted: time, drive and response of each sample with 9 significant digits, SI. Two files of
/// the same readings agree in it, and tpm validate refuses a copy of what was fitted.
[[nodiscard]] std::string samples_sha256(std::span<const double> time_s,
                                         std::span<const double> drive,
                                         std::span<const double> response);
[[nodiscard]] std::string samples_sha256(const Recording& recording);

/// law.json of a fit: the fitted law, and samples_sha256 of each recording it was fitted to.
[[nodiscard]] Json law_document(const FitResult& fit);

/// A law.json with samples_sha256 of its data, in their order; empty ones are left out.
[[nodiscard]] Json with_sample_digests(Json law_document, const std::vector<std::string>& digests);

/// samples_sha256 of the data of a law.json, in their order; empty where it does not state them.
[[nodiscard]] std::vector<std::string> sample_digests(const Json& law_document);

}  // namespace tpm::fit
