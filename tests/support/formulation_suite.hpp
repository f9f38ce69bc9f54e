#pragma once
// What every formulation has to show, whatever its equations: one suite for all. Each check says
// what it found; a formulation keeps its word if nothing is found.
#include <string>
#include <vector>

#include "tpmkit/formulation.hpp"

namespace tpm::test {

/// Something that a formulation said and did not keep.
struct BrokenWord {
  std::string check;  ///< which part of the suite
  std::string found;  ///< in numbers
};

/// Runs the whole suite on a formulation.
[[nodiscard]] std::vector<BrokenWord> broken_words(const Formulation& formulation);

/// "check: found" in lines.
[[nodiscard]] std::string listed(const std::vector<BrokenWord>& broken);

/// Calls of the heap so far; a program that counts them defines it (counted_allocations.hpp).
using HeapCalls = long (*)();
/// The part of the suite for what a servo loop steps: rest, determinism, no heap in a step.
[[nodiscard]] std::vector<BrokenWord> broken_in_loop(const Formulation& formulation,
                                                     HeapCalls heap_calls);

}  // namespace tpm::test
