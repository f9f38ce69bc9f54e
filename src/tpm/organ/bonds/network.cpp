#include "tpm/organ/bonds/network.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr double kRounding = 1e-12;  // of a lattice whose neighbours lie exactly on the support

void require_valid(const NetworkOptions& options, std::string_view where) {
  if (!(options.support > 1.0) || !std::isfinite(options.support)) {
    throw bad_input(where, fmt::format("support = {}", shortest(options.support)),
                    "a number of spacings above 1");
  }
  if (!(options.reference_spacing_m > 0.0) || !std::isfinite(options.reference_spacing_m)) {
    throw bad_input(where,
                    fmt::format("reference spacing = {} m", shortest(options.reference_spacing_m)),
                    "a length above 0");
  }
}

Eigen::Vector3d separation(const Organ& organ, std::size_t from, std::size_t to) {
  return organ.position.col(static_cast<Eigen::Index>(to)) -
         organ.position.col(static_cast<Eigen::Index>(from));
}

Bond bond_of(const Organ& organ, const NeighbourPair& pair, std::string_view where) {
  const auto [a, b] = std::minmax(pair.first, pair.second);
  if (b >= organ.size() || a == b) {
    throw bad_input(where, fmt::format("a bond of the spheres {} and {}", a + 1, b + 1),
                    fmt::format("two different spheres from 1 to {}", organ.size()));
  }
  Bond bond;
  bond.a = static_cast<std::uint32_t>(a);
  bond.b = static_cast<std::uint32_t>(b);
  bond.kind = organ.layer[a] == organ.layer[b] ? BondKind::lateral : BondKind::radial;
  bond.rest_length_m = separation(organ, a, b).norm();
  return bond;
}

/// cos^2 of the angle between the line through two spheres and the normal of one of them.
double cosine_squared(const Organ& organ, std::size_t sphere, std::size_t other) {
  const Eigen::Vector3d along = separation(organ, sphere, other).normalized();
  const double cosine = along.dot(organ.normal.col(static_cast<Eigen::Index>(sphere)));
  return cosine * cosine;
}

/// Share that a sphere's sum allows each of its bonds; 0 where the sphere has no say.
double share_at(const BondSums& sums, BondKind kind) {
  if (kind == BondKind::lateral) return 2.0 / sums.lateral_count;
  return sums.radial > 0.0 ? 1.0 / sums.radial : 0.0;
}

void normalise(Network& network, std::string_view where) {
  const std::vector<BondSums> sums = bond_sums(network);  // all factors are 1
  for (Bond& bond : network.bonds) {
    const double a = share_at(sums[bond.a], bond.kind);
    const double b = share_at(sums[bond.b], bond.kind);
    if (a == 0.0 && b == 0.0) {
      throw bad_input(where,
                      fmt::format("the bond of the spheres {} and {} between two layers is square "
                                  "to the normals of both",
                                  bond.a + 1, bond.b + 1),
                      "layers one above the other");
    }
    bond.factor = a == 0.0 || b == 0.0 ? a + b : 0.5 * (a + b);
  }
  if (!network.organ.contact) return;
  const std::size_t contact = *network.organ.contact;
  const BondSums at_contact = bond_sums(network)[contact];
  for (Bond& bond : network.bonds) {
    if (bond.a != contact && bond.b != contact) continue;
    bond.factor /= bond.kind == BondKind::lateral ? 0.5 * at_contact.lateral : at_contact.radial;
  }
}

bool in_one_layer(const Organ& organ, const NeighbourPair& pair) {
  return organ.layer[pair.first] == organ.layer[pair.second];
}

/// The local spacing of every sphere, m, as build_network describes it.
std::vector<double> local_spacings(const Organ& organ, std::span<const NeighbourPair> pairs) {
  constexpr std::size_t kLatticeNeighbours = 6;  // neighbours in a triangular lattice
  std::vector<std::vector<double>> distances(organ.size());
  for (const NeighbourPair& pair : pairs) {
    if (!in_one_layer(organ, pair)) continue;
    const double distance = separation(organ, pair.first, pair.second).norm();
    distances[pair.first].push_back(distance);
    distances[pair.second].push_back(distance);
  }
  std::vector<double> spacing(organ.size(), organ.spacing);
  for (std::size_t i = 0; i < organ.size(); ++i) {
    std::vector<double>& d = distances[i];
    if (d.size() < kLatticeNeighbours) continue;
    std::sort(d.begin(), d.end());
    const double mean =
        std::accumulate(d.begin(), d.begin() + kLatticeNeighbours, 0.0) / kLatticeNeighbours;
    spacing[i] = std::min(mean, organ.spacing);
  }
  return spacing;
}

/// Drops the pairs of one layer that are no neighbours at their local spacing.
void drop_far_laterals(const Organ& organ, double support, std::vector<NeighbourPair>& pairs) {
  const std::vector<double> spacing = local_spacings(organ, pairs);
  std::erase_if(pairs, [&](const NeighbourPair& pair) {
    const double reach = support * 0.5 * (spacing[pair.first] + spacing[pair.second]);
    return in_one_layer(organ, pair) &&
           separation(organ, pair.first, pair.second).norm() > (1.0 + kRounding) * reach;
  });
}

/// Keeps of the pairs across layers, for each sphere, the one with the next deeper layer that is
/// nearest to its normal.
void drop_diagonals(const Organ& organ, std::vector<NeighbourPair>& pairs) {
  std::vector<double> straightest(organ.size(), -1.0);
  std::vector<std::size_t> partner(organ.size());
  const auto upper_first = [&](const NeighbourPair& pair) {
    return organ.layer[pair.first] < organ.layer[pair.second]
               ? pair
               : NeighbourPair{pair.second, pair.first};
  };
  for (const NeighbourPair& pair : pairs) {
    const auto [upper, lower] = upper_first(pair);
    if (organ.layer[lower] != organ.layer[upper] + 1) continue;
    const double straight = cosine_squared(organ, upper, lower);
    if (straight <= straightest[upper]) continue;
    straightest[upper] = straight;
    partner[upper] = lower;
  }
  std::erase_if(pairs, [&](const NeighbourPair& pair) {
    if (in_one_layer(organ, pair)) return false;
    const auto [upper, lower] = upper_first(pair);
    return straightest[upper] < 0.0 || partner[upper] != lower;
  });
}

}  // namespace

std::vector<BondSums> bond_sums(const Network& network) {
  std::vector<BondSums> sums(network.organ.size());
  for (const Bond& bond : network.bonds) {
    for (const auto& [sphere, other] : {std::pair(bond.a, bond.b), std::pair(bond.b, bond.a)}) {
      BondSums& s = sums[sphere];
      if (bond.kind == BondKind::lateral) {
        s.lateral += bond.factor;
        ++s.lateral_count;
      } else {
        s.radial += bond.factor * cosine_squared(network.organ, sphere, other);
        ++s.radial_count;
      }
    }
  }
  return sums;
}

Network join(Organ organ, std::span<const NeighbourPair> pairs, const NetworkOptions& options,
             std::string_view where) {
  require_valid(organ, where);
  require_valid(options, where);
  Network network{std::move(organ), options, {}};
  network.bonds.reserve(pairs.size());
  for (const NeighbourPair& pair : pairs) {
    network.bonds.push_back(bond_of(network.organ, pair, where));
  }
  const auto key = [](const Bond& bond) { return std::pair(bond.a, bond.b); };
  std::sort(network.bonds.begin(), network.bonds.end(),
            [&](const Bond& p, const Bond& q) { return key(p) < key(q); });
  const auto twice =
      std::adjacent_find(network.bonds.begin(), network.bonds.end(),
                         [&](const Bond& p, const Bond& q) { return key(p) == key(q); });
  if (twice != network.bonds.end()) {
    throw bad_input(
        where, fmt::format("the spheres {} and {} are joined twice", twice->a + 1, twice->b + 1),
        "each pair once");
  }
  if (options.rule == StiffnessRule::normalised) normalise(network, where);
  if (options.spacing_law == SpacingLaw::continuum) {
    const double scale = network.organ.spacing / options.reference_spacing_m;
    for (Bond& bond : network.bonds) bond.factor *= scale;
  }
  return network;
}

Network build_network(Organ organ, const NetworkOptions& options, std::string_view where) {
  require_valid(organ, where);
  require_valid(options, where);
  auto pairs = pairs_within(organ.position, options.support * organ.spacing);
  drop_far_laterals(organ, options.support, pairs);
  if (!options.diagonals) drop_diagonals(organ, pairs);
  return join(std::move(organ), pairs, options, where);
}

}  // namespace tpm::organ
