#include "tpm/organ/bonds/material_refusal.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

bool relaxes_on_kernel(const BondSystem& bonds) {
  for (std::size_t i = 0; i < bonds.first_contact(); ++i) {
    const bool relaxes = bonds.relaxing()[static_cast<Eigen::Index>(i)] > 0.0;
    if (relaxes && !bonds.laws()[bonds.law_of(i)].kernel.is_linear()) return true;
  }
  return false;
}

/// The bonds have a spring of such a function.
template <class Predicate>
bool has_spring(const BondSystem& bonds, Predicate&& is) {
  const auto laws = bonds.laws();
  return std::any_of(laws.begin(), laws.end(), [&](const ViscousLaw& law) {
    return std::any_of(law.springs.begin(), law.springs.end(),
                       [&](const ViscousLaw::Spring& spring) { return is(spring.function); });
  });
}

}  // namespace

std::vector<ViscousLaw::Branch> common_branches(const BondSystem& bonds) {
  for (std::size_t i = 0; i < bonds.first_contact(); ++i) {
    if (bonds.relaxing()[static_cast<Eigen::Index>(i)] > 0.0) {
      return bonds.laws()[bonds.law_of(i)].branches;
    }
  }
  return {};
}

std::vector<MaterialNeed> needs_of(const BondSystem& bonds) {
  std::vector<MaterialNeed> needs;
  const bool alike = bonds.relaxes_alike();
  if (!alike) needs.push_back(&Capabilities::mixed);
  if (relaxes_on_kernel(bonds)) needs.push_back(&Capabilities::kernels);
  if (alike && bonds.relaxation_times_s().size() > 1) needs.push_back(&Capabilities::branches);
  if (has_spring(bonds, [](const ElongationFunction& f) { return !f.cubic_per_m2(); })) {
    needs.push_back(&Capabilities::any_potential);
  }
  if (has_spring(bonds, [](const ElongationFunction& f) {
        return !f.is_linear() && f.cubic_per_m2().has_value();
      })) {
    needs.push_back(&Capabilities::stiffening);
  }
  return needs;
}

std::vector<MaterialNeed> needs_of(const MaterialField& field) {
  if (field.materials.size() > 1 || (field.factor.array() != 1.0).any()) {
    return {&Capabilities::regions};
  }
  return {};
}

void require_material(const BondSystem& bonds, std::string_view who,
                      std::initializer_list<MaterialNeed> takes) {
  for (const MaterialNeed need : needs_of(bonds)) {
    if (std::find(takes.begin(), takes.end(), need) != takes.end()) continue;
    throw bad_input("material", fmt::format("{} is no formulation that {}", who, words_of(need)),
                    fmt::format("one of {}", formulations_that([&](const Formulation& f) {
                                  return f.can().*need;
                                })));
  }
}

}  // namespace tpm::organ
