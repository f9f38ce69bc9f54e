// Declared in tpm/accuracy/problem.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "tpm/accuracy/element_problems.hpp"
#include "tpm/accuracy/organ_problems.hpp"
#include "tpm/accuracy/servo_problems.hpp"
#include "tpmkit/error.hpp"

namespace tpm::accuracy {
namespace {

constexpr std::array<BenchmarkEntry, 11> kEntries{{
    {"bond_paper", "one bond with the paper's eta1, ramp and hold", bond_paper_problem},
    {"bond_fitted", "one bond with the fitted eta1, ramp and hold", bond_fitted_problem},
    {"star_creep", "the star under a constant load", star_creep_problem},
    {"organ_hold", "424 spheres, ramp and hold", organ_hold_problem},
    {"organ_poke", "424 spheres, poked at 100 mm/s", organ_poke_problem},
    {"organ_creep", "424 spheres, 300 s of creep", organ_creep_problem},
    {"bond_mass", "one bond with a mass, loaded in a step", bond_mass_problem},
    {"organ_poke_mass", "424 spheres with masses, poked at 100 mm/s", organ_poke_mass_problem},
    {"servo_normal", "contact models along the normal, 424 spheres", servo_normal_problem},
    {"servo_space", "contact models in space, 424 spheres", servo_space_problem},
    {"servo_inner", "contact models in space, inner layer fixed", servo_inner_problem},
}};

}  // namespace

std::span<const BenchmarkEntry> benchmark_entries() {
  return kEntries;
}

std::vector<BenchmarkEntry> chosen_benchmarks(std::span<const std::string> names) {
  std::vector<std::string_view> known;
  known.reserve(std::size(kEntries));
  for (const BenchmarkEntry& entry : kEntries) known.push_back(entry.name);
  for (const std::string& name : names) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      throw Error(ExitCode::usage, "PROBLEM", fmt::format("'{}'", printable(name)),
                  fmt::format("one of {}", fmt::join(known, ", ")));
    }
  }
  std::vector<BenchmarkEntry> chosen;
  for (const BenchmarkEntry& entry : kEntries) {
    const bool named = std::find(names.begin(), names.end(), entry.name) != names.end();
    if (names.empty() || named) chosen.push_back(entry);
  }
  return chosen;
}

}  // namespace tpm::accuracy
