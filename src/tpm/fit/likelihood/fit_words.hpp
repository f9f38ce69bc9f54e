#pragma once
// The words of files and options for the choices of a fit.
#include <array>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/fit/likelihood/bootstrap.hpp"
#include "tpm/fit/likelihood/noise.hpp"
#include "tpm/fit/likelihood/parameter.hpp"

namespace tpm::fit {

inline constexpr auto kScaleWords = std::to_array<Word<Scale>>(
    {{Scale::log, "log"}, {Scale::linear, "linear"}, {Scale::inverse_square, "inverse_square"}});

inline constexpr auto kNoiseKindWords = std::to_array<Word<NoiseKind>>({
    {NoiseKind::relative_to_datum, "relative_to_datum"},
    {NoiseKind::absolute, "absolute"},
    {NoiseKind::combined, "combined"},
    {NoiseKind::per_row, "per_row"},
    {NoiseKind::log, "log"},
    {NoiseKind::relative_to_model, "relative_to_model"},
});

inline constexpr auto kErrorShapeWords =
    std::to_array<Word<ErrorShape>>({{ErrorShape::normal, "normal"},
                                     {ErrorShape::laplace, "laplace"},
                                     {ErrorShape::student_t, "student_t"}});

/// True if the size of the noise is known.
inline constexpr auto kNoiseScaleWords =
    std::to_array<Word<bool>>({{true, "known"}, {false, "estimated"}});

inline constexpr auto kLossWords = std::to_array<Word<Loss>>(
    {{Loss::none, "none"}, {Loss::huber, "huber"}, {Loss::cauchy, "cauchy"}});

inline constexpr auto kResamplingWords =
    std::to_array<Word<Resampling>>({{Resampling::residuals, "residuals"},
                                     {Resampling::blocks, "blocks"},
                                     {Resampling::recordings, "recordings"}});

}  // namespace tpm::fit
