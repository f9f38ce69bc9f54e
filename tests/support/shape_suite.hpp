#pragma once
// What every shape of a material has to show, whatever its formula: one suite for all. Each check
// says what it found; a shape keeps its word if nothing is found.
#include <string>
#include <vector>

#include "tpmkit/elongation_function.hpp"

namespace tpm::test {

/// Runs the whole suite on a shape: rest, symmetry, slope, energy, derivatives, Legendre transform,
/// form at servo rate, and a bond's account of energy. "check: found" for each promise that is
/// broken.
[[nodiscard]] std::vector<std::string> broken_promises(const ElongationShape& shape);

/// Runs the star with such bonds by every formulation: those that take its potential answer its
/// closed form, the others refuse it in one line.
[[nodiscard]] std::vector<std::string> broken_in_scenes(const ElongationShape& shape);

}  // namespace tpm::test
