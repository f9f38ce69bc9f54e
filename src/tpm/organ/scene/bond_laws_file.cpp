#include "tpm/organ/scene/bond_laws_file.hpp"

#include <algorithm>

namespace tpm::organ {
namespace {

/// Shapes by number, and their parameters side by side.
class ShapeColumns {
 public:
  explicit ShapeColumns(std::vector<std::string>& names) : names_(names) {}

  void add(const ElongationFunction& function) {
    const std::string name(function.shape_name());
    const auto found = std::find(names_.begin(), names_.end(), name);
    shape_.push_back(static_cast<std::int32_t>(found - names_.begin()));
    if (found == names_.end()) names_.push_back(name);
    for (std::size_t k = 0; k < kMostShapeParameters; ++k) {
      parameters_.push_back(k < function.parameters().size() ? function.values()[k] : 0.0);
    }
  }

  void write(const std::string& what, Hdf5Writer& file) const {
    file.integers("/laws/" + what + "_shape", shape_, 1);
    file.table("/laws/" + what + "_parameters", parameters_, kMostShapeParameters);
  }

 private:
  std::vector<std::string>& names_;
  std::vector<std::int32_t> shape_;
  std::vector<double> parameters_;
};

void write_laws(const BondSystem& bonds, Hdf5Writer& file) {
  std::vector<std::string> names;
  ShapeColumns springs(names), kernels(names);
  std::vector<std::int32_t> spring_law, branch_law;
  std::vector<double> spring_share, branch_share, branch_time;
  std::int32_t number = 0;
  for (const ViscousLaw& law : bonds.laws()) {
    for (const ViscousLaw::Spring& spring : law.springs) {
      spring_law.push_back(number);
      spring_share.push_back(spring.share);
      springs.add(spring.function);
    }
    kernels.add(law.kernel);
    for (const ViscousLaw::Branch& branch : law.branches) {
      branch_law.push_back(number);
      branch_share.push_back(branch.share);
      branch_time.push_back(branch.relaxation_time_s);
    }
    ++number;
  }
  if (!spring_law.empty()) {
    file.integers("/laws/spring_law", spring_law, 1);
    file.numbers("/laws/spring_share", spring_share);
    springs.write("spring", file);
  }
  kernels.write("kernel", file);
  if (!branch_law.empty()) {
    file.integers("/laws/branch_law", branch_law, 1);
    file.numbers("/laws/branch_share", branch_share);
    file.numbers("/laws/branch_time_s", branch_time);
  }
  file.texts("/laws/shapes", names);
  file.attribute("/laws/shapes", "meaning",
                 "names by number; tpm simulate --list-materials has their formulas");
}

void write_materials_of_spheres(const Tissue& tissue, Hdf5Writer& file) {
  const MaterialField& field = tissue.materials;
  const std::size_t spheres = tissue.network.organ.size();
  std::vector<std::int32_t> material(field.of_sphere.begin(), field.of_sphere.end());
  material.resize(spheres, 0);
  std::vector<double> factor(field.factor.begin(), field.factor.end());
  factor.resize(spheres, 1.0);
  file.integers("/spheres/material", material, 1);
  file.numbers("/spheres/material_factor", factor);
}

}  // namespace

void write_bond_laws(const Tissue& tissue, Hdf5Writer& file) {
  const BondSystem bonds = tissue.bonds();
  std::vector<std::int32_t> law, rope;
  for (std::size_t bond = 0; bond < bonds.size(); ++bond) {
    law.push_back(static_cast<std::int32_t>(bonds.law_of(bond)));
    rope.push_back(bonds.is_rope(bond) ? 1 : 0);
  }
  file.numbers("/bonds/stiffness_N_per_m", {bonds.stiffness().begin(), bonds.stiffness().end()});
  file.numbers("/bonds/relaxing_N_per_m", {bonds.relaxing().begin(), bonds.relaxing().end()});
  file.integers("/bonds/law", law, 1);
  file.integers("/bonds/rope", rope, 1);
  file.attribute("/bonds/stiffness_N_per_m", "meaning",
                 "k: N = (k - g) u(l) + g (V(l) - sum gamma_j m_j), dm_j/dt = (V(l) - m_j)/tau_j");
  file.attribute("/bonds/relaxing_N_per_m", "meaning", "g, the part of k that relaxes");
  file.attribute("/bonds/law", "meaning", "number in /laws, from 0");
  file.attribute("/bonds/rope", "meaning", "1: pulls only");
  write_laws(bonds, file);
  write_materials_of_spheres(tissue, file);
}

}  // namespace tpm::organ
