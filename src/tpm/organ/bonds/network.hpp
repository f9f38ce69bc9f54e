#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tpm/organ/body/neighbours.hpp"
#include "tpmkit/organ.hpp"

namespace tpm::organ {

enum class BondKind {
  radial,   ///< between layers: the Zener element along the bond
  lateral,  ///< within a layer: elastic, modulus E'
};

/// Stiffness of a bond against the paper's E A0/l0 (docs/theory.md).
enum class StiffnessRule {
  /// A radial bond carries the mean over its ends of 1/S, S the sum of cos^2 (angle to the local
  /// normal) over the sphere's radial bonds; a lateral bond the mean over its ends of 2/n, n the
  /// sphere's lateral bonds; the bonds of the contact sphere are then rescaled so that its own sums
  /// are 1 and 2, those of the four-sphere star.
  normalised,
  per_bond,  ///< every bond has E A0/l0, as printed
};

/// Dependence of stiffness on the spacing.
enum class SpacingLaw {
  paper,      ///< not at all
  continuum,  ///< in proportion to x, so that a block keeps its modulus under refinement
};

struct NetworkOptions {
  double support = 1.5;  ///< neighbours are within this many spacings, > 1
  /// Without: of the bonds of a sphere with the next deeper layer only the one nearest to its
  /// normal (one radial bond per sphere; usually a mechanism, docs/theory.md).
  bool diagonals = true;
  StiffnessRule rule = StiffnessRule::normalised;
  SpacingLaw spacing_law = SpacingLaw::paper;
  double reference_spacing_m = 0.020;  ///< where the continuum law has the paper's stiffness, > 0
};

/// Two spheres joined; a < b.
struct Bond {
  std::uint32_t a = 0, b = 0;
  BondKind kind = BondKind::radial;
  double rest_length_m = 0.0;
  double factor = 1.0;  ///< times E A0/l0
};

/// The spheres and their bonds.
struct Network {
  Organ organ;
  NetworkOptions options;
  std::vector<Bond> bonds;  ///< by a, then b
};

/// Joins the pairs given. Bonds within a layer are lateral, all others radial.
/// Throws Error(bad_input) for options out of range, a pair that is no pair of the organ's spheres
/// or stands twice, and, under the rule `normalised`, a radial bond square to both its normals.
[[nodiscard]] Network join(Organ organ, std::span<const NeighbourPair> pairs,
                           const NetworkOptions& options, std::string_view where);

/// Joins the spheres that are neighbours: of different layers within `support` spacings of the
/// organ; of one layer within `support` times the mean of their local spacings, so that a crowded
/// layer is joined to its first neighbours as the others are. The local spacing of a sphere is the
/// mean distance of its six nearest in its layer, and at most the organ's spacing; it is the
/// organ's spacing if fewer than six are within the support. Throws Error(bad_input) as join does.
[[nodiscard]] Network build_network(Organ organ, const NetworkOptions& options,
                                    std::string_view where);

/// Sums over the bonds of one sphere, those that the rule `normalised` aims at 1 and 2.
struct BondSums {
  double radial = 0.0;   ///< of factor times cos^2 (angle to the sphere's normal)
  double lateral = 0.0;  ///< of factors
  int radial_count = 0, lateral_count = 0;
};

[[nodiscard]] std::vector<BondSums> bond_sums(const Network& network);

}  // namespace tpm::organ
