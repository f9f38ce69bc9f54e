#pragma once
#include <span>

#include "tpm/organ/balance/quasistatic.hpp"

namespace tpm::organ {

/// Throws Error(bad_input) if a time is asked for before the one that a run begins at.
void require_later(std::span<const double> times_s, double from_s);

/// Throws Error(bad_input) unless a state that a run resumes from is one of the network.
void require_same_network(const QuasiStaticState& from, const BondSystem& bonds);

}  // namespace tpm::organ
