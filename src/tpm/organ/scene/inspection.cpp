#include "tpm/organ/scene/inspection.hpp"

#include <algorithm>
#include <numeric>

namespace tpm::organ {
namespace {

Spread spread_of(const std::vector<double>& values) {
  if (values.empty()) return {};
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return {*least, sum / static_cast<double>(values.size()), *most};
}

/// The spread of a quantity of the spheres, over each layer.
template <class Quantity>
std::vector<Spread> by_layer(const Organ& organ, const std::vector<BondSums>& sums,
                             Quantity&& quantity) {
  std::vector<std::vector<double>> values(static_cast<std::size_t>(organ.layer_count()));
  for (std::size_t i = 0; i < sums.size(); ++i) {
    values[static_cast<std::size_t>(organ.layer[i])].push_back(quantity(sums[i]));
  }
  std::vector<Spread> spreads;
  spreads.reserve(values.size());
  for (const std::vector<double>& layer : values) spreads.push_back(spread_of(layer));
  return spreads;
}

}  // namespace

NetworkInspection inspect(const Tissue& tissue) {
  const Organ& organ = tissue.network.organ;
  const std::vector<BondSums> sums = bond_sums(tissue.network);
  NetworkInspection result;
  for (const Bond& bond : tissue.network.bonds) {
    ++(bond.kind == BondKind::radial ? result.radial_bonds : result.lateral_bonds);
  }
  result.free_coordinates = tissue.constraints().count();
  result.nearest = nearest_distances(organ);
  result.lateral_count = by_layer(organ, sums, [](const BondSums& s) { return s.lateral_count; });
  result.radial_count = by_layer(organ, sums, [](const BondSums& s) { return s.radial_count; });
  std::vector<double> radial;
  std::vector<double> lateral;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (i == organ.contact) continue;
    if (sums[i].radial_count > 0) radial.push_back(sums[i].radial);
    if (sums[i].lateral_count > 0) lateral.push_back(sums[i].lateral);
  }
  result.radial_sum = spread_of(radial);
  result.lateral_sum = spread_of(lateral);
  const BondSystem bonds = tissue.bonds();
  result.instantaneous = effective_moduli(tissue.network, bonds, 0.0);
  result.equilibrium = effective_moduli(tissue.network, bonds, 1.0);
  if (!organ.contact) return result;
  const ContactStiffness held =
      held_stiffness(tissue.bonds(), organ.position, *organ.contact,
                     organ.normal.col(static_cast<Eigen::Index>(*organ.contact)));
  const BondLaw star_bond = tissue.materials.materials.front().radial_law();
  const ContactStiffness star{star_bond.instantaneous_N_per_m(), star_bond.equilibrium_N_per_m()};
  result.contact_over_star = ContactStiffness{held.instantaneous / star.instantaneous, 0.0};
  // A material that relaxes to nothing has no equilibrium stiffness to compare.
  if (star.equilibrium > 0.0)
    result.contact_over_star->equilibrium = held.equilibrium / star.equilibrium;
  return result;
}

}  // namespace tpm::organ
