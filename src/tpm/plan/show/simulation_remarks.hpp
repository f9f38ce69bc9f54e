#pragma once
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/organ/run/simulation.hpp"

namespace tpm::plan {

/// Limits of validity that a run passes.
[[nodiscard]] std::vector<Remark> breach_remarks(const Validity& validity);
/// The dependence of a run's numbers on the stiffness of its contacts, if it matters.
[[nodiscard]] std::vector<Remark> contact_remarks(const SimulationRun& run);
/// Both.
[[nodiscard]] std::vector<Remark> simulation_remarks(const SimulationRun& run);

}  // namespace tpm::plan
