#pragma once
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/curve_file.hpp"

namespace tpm::app {

/// A curve as a person reads it: mm, N, s, kPa, bands as "0.07 - 0.18", provenance in each row.
/// Of a long recording only the beginning and the end, unless `all_rows`.
[[nodiscard]] std::string curve_text(const Curve& curve, bool all_rows);

/// A curve as a program reads it: SI, with the unit in the key.
[[nodiscard]] Json curve_json(const Curve& curve);

}  // namespace tpm::app
