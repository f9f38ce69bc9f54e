#pragma once
#include <Eigen/Core>
#include <array>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"

namespace tpm::organ {

/// Regular arrangements of spheres, by their neighbours: 6, 8 or 12 at the spacing.
enum class Lattice { cubic, bcc, fcc };

inline constexpr std::array<Word<Lattice>, 3> kLatticeWords{
    {{Lattice::cubic, "cubic"}, {Lattice::bcc, "bcc"}, {Lattice::fcc, "fcc"}}};

/// A lattice as those integer points (i, j, k) that it keeps, times a pitch.
class LatticePoints {
 public:
  /// @param spacing distance of nearest neighbours, m
  LatticePoints(Lattice lattice, double spacing);

  [[nodiscard]] double pitch() const { return pitch_; }
  /// Steps of the integer grid in one conventional cell: 1 or 2.
  [[nodiscard]] int cell() const { return lattice_ == Lattice::cubic ? 1 : 2; }
  [[nodiscard]] bool holds(int i, int j, int k) const;

 private:
  Lattice lattice_;
  double pitch_;
};

/// Volume that one sphere of a lattice fills up, m^3.
/// @param spacing distance of nearest neighbours, m
[[nodiscard]] double volume_per_sphere(Lattice lattice, double spacing);

}  // namespace tpm::organ
