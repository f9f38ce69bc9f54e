#include "tpm/organ/body/lattice.hpp"

#include <cmath>

namespace tpm::organ {

namespace {

double pitch_of(Lattice lattice, double spacing) {
  switch (lattice) {
    case Lattice::bcc:
      return spacing / std::sqrt(3.0);
    case Lattice::fcc:
      return spacing / std::sqrt(2.0);
    case Lattice::cubic:
      break;
  }
  return spacing;
}

}  // namespace

LatticePoints::LatticePoints(Lattice lattice, double spacing)
    : lattice_(lattice), pitch_(pitch_of(lattice, spacing)) {}

bool LatticePoints::holds(int i, int j, int k) const {
  switch (lattice_) {
    case Lattice::bcc:
      return (i - j) % 2 == 0 && (j - k) % 2 == 0;
    case Lattice::fcc:
      return (i + j + k) % 2 == 0;
    case Lattice::cubic:
      break;
  }
  return true;
}

double volume_per_sphere(Lattice lattice, double spacing) {
  const double grid = std::pow(pitch_of(lattice, spacing), 3);
  switch (lattice) {
    case Lattice::bcc:
      return 4.0 * grid;  // a cell of 8 grid cubes holds two
    case Lattice::fcc:
      return 2.0 * grid;  // and four
    case Lattice::cubic:
      break;
  }
  return grid;
}

}  // namespace tpm::organ
