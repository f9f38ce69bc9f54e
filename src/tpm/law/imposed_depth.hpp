#pragma once
#include <optional>

#include "tpm/law/contact_history.hpp"
#include "tpm/law/drive_path.hpp"

namespace tpm::law {

/// The answer of ContactHistory to an imposed drive, for laws whose branches have times among the
/// parameters: all steps of one branch after those of another, in plain arrays, several times as
/// fast. Agrees with it to the tolerance of both, 1e-10 of the peak; derivatives to 1e-5 where the
/// sampling is uneven by a few millionths.
/// @return nothing if the surface leaves the probe: then only ContactHistory has the answer
[[nodiscard]] std::optional<Response> respond_in_contact(const LawAtParameters& law,
                                                         const DrivePath& path, Want want);

}  // namespace tpm::law
