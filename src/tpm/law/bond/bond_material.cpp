#include "tpmkit/bond_material.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
using namespace base;

namespace {

/// The number behind a letter: branch_number("tau12", "tau") is 12; 0 if there is none.
std::size_t branch_number(std::string_view name, std::string_view letter) {
  if (!name.starts_with(letter)) return 0;
  const std::string_view digits = name.substr(letter.size());
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return error == std::errc{} && end == digits.data() + digits.size() ? number : 0;
}

constexpr std::string_view kOfKernel = "kernel_";

/// The number of a parameter of a function by its name; none if it has none of that name.
std::optional<std::size_t> parameter_number(const ElongationFunction& function,
                                            std::string_view name) {
  const auto parameters = function.parameters();
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (parameters[k].name == name) return k;
  }
  return std::nullopt;
}

/// A parameter of the shape of W or V, by its name in the table.
struct ShapePlace {
  ElongationFunction* function;
  std::size_t number;
};
std::optional<ShapePlace> shape_place_of(BondMaterial& material, std::string_view name) {
  if (const auto k = parameter_number(material.potential, name)) {
    return ShapePlace{&material.potential, *k};
  }
  if (!name.starts_with(kOfKernel)) return std::nullopt;
  if (const auto k = parameter_number(material.kernel, name.substr(kOfKernel.size()))) {
    return ShapePlace{&material.kernel, *k};
  }
  return std::nullopt;
}

/// Where another parameter is kept in a material; null if it has none of that name.
double* place_of(BondMaterial& material, std::string_view name) {
  if (name == "Einf") return &material.equilibrium_Pa;
  if (name == "Eprime") return &material.lateral_Pa;
  if (name == "A0") return &material.A0_m2;
  if (name == "l0") return &material.l0_m;
  if (const std::size_t j = branch_number(name, "tau"); j > 0 && j <= material.branches.size()) {
    return &material.branches[j - 1].relaxation_time_s;
  }
  if (const std::size_t j = branch_number(name, "g"); j > 0 && j <= material.branches.size()) {
    return &material.branches[j - 1].modulus_Pa;
  }
  return nullptr;
}

}  // namespace

double BondMaterial::relaxing_Pa() const {
  double sum = 0.0;
  for (const Branch& branch : branches) sum += branch.modulus_Pa;
  return sum;
}

BondLaw BondMaterial::radial_law() const {
  const double per_Pa = modulus_to_stiffness_m();
  BondLaw law;
  law.springs = {{equilibrium_Pa * per_Pa, potential}};
  law.kernel = kernel;
  for (const Branch& branch : branches) {
    law.branches.push_back({branch.modulus_Pa * per_Pa, branch.relaxation_time_s});
  }
  law.tidy();
  return law;
}

BondLaw BondMaterial::lateral_law() const {
  if (lateral == LateralBond::relaxing) {
    const double instantaneous = instantaneous_Pa();
    if (!(instantaneous > 0.0)) return {};
    return radial_law().scaled(lateral_Pa / instantaneous);
  }
  BondLaw law;
  law.springs = {{lateral_Pa * modulus_to_stiffness_m(), potential}};
  law.tidy();
  return law;
}

std::string kernel_parameter(std::string_view name) {
  return fmt::format("{}{}", kOfKernel, name);
}

std::vector<MaterialParameter> parameters_of(const BondMaterial& material) {
  std::vector<MaterialParameter> table{
      {"Einf", Dimension::stress, 0.0, false, "modulus of the radial bonds at equilibrium"},
      {"Eprime", Dimension::stress, 0.0, false, "instantaneous modulus of the lateral bonds"},
  };
  for (const MaterialParameter& parameter : material.potential.parameters()) {
    table.push_back(parameter);
    table.back().meaning += " of the equilibrium potential";
  }
  for (const MaterialParameter& parameter : material.kernel.parameters()) {
    table.push_back(parameter);
    table.back().name = kernel_parameter(parameter.name);
    table.back().meaning += " of the kernel that the branches act on";
  }
  for (std::size_t j = 1; j <= material.branches.size(); ++j) {
    table.push_back({fmt::format("g{}", j), Dimension::stress, 0.0, false,
                     fmt::format("modulus of branch {}", j)});
    table.push_back({fmt::format("tau{}", j), Dimension::time, 0.0, true,
                     fmt::format("relaxation time of branch {}", j)});
  }
  table.push_back({"A0", Dimension::area, 0.0, true, "area that turns stress into force"});
  table.push_back(
      {"l0", Dimension::length, 0.0, true, "length that turns displacement into strain"});
  return table;
}

std::optional<double> value_of(const BondMaterial& material, std::string_view name) {
  BondMaterial copy = material;
  if (const auto shape = shape_place_of(copy, name)) {
    return shape->function->values()[shape->number];
  }
  const double* place = place_of(copy, name);
  if (place == nullptr) return std::nullopt;
  return *place;
}

void set_value(BondMaterial& material, std::string_view name, double value,
               std::string_view where) {
  std::vector<std::string> names;
  for (const MaterialParameter& parameter : parameters_of(material)) {
    names.emplace_back(parameter.name);
    if (parameter.name != name) continue;
    if (!std::isfinite(value) || !parameter.allows(value)) {
      throw bad_input(
          where, fmt::format("{} = {} {}", name, shortest(value), si_symbol(parameter.dimension)),
          range_of(parameter));
    }
    if (const auto shape = shape_place_of(material, name)) {
      shape->function->set_value(shape->number, value);
    } else {
      *place_of(material, name) = value;
    }
    return;
  }
  throw unknown_word(where, "the material has no parameter", name, names);
}

void require_valid(const BondMaterial& material, std::string_view where) {
  if (material.branches.size() > BondMaterial::kMostBranches) {
    throw bad_input(where, fmt::format("{} branches", material.branches.size()),
                    fmt::format("at most {}", BondMaterial::kMostBranches));
  }
  BondMaterial checked = material;
  for (const MaterialParameter& parameter : parameters_of(material)) {
    set_value(checked, parameter.name, *value_of(material, parameter.name), where);
  }
}

}  // namespace tpm
