#pragma once
#include "tpm/organ/body/lattice.hpp"
#include "tpmkit/organ.hpp"

namespace tpm::organ {

/// A cuboid of nx x ny x nz conventional cells of a lattice with all points on its faces, one
/// corner at the origin: (nx + 1)(ny + 1)(nz + 1) spheres if cubic. Layers are the planes across z,
/// the outermost at the largest z, and every normal is +z. Numbers run from the top plane down, in
/// a plane by y and then x. The radius is half the spacing. Throws Error(bad_input) for a cell
/// count below 1, more than 1,000,000 spheres, or a spacing that is not a length above 0.
/// @param spacing distance of nearest neighbours, m
[[nodiscard]] Organ block(int nx, int ny, int nz, double spacing, Lattice lattice);

/// The four spheres of the element, in the order A, B, C, D: B at the origin, A and C beside it at
/// -x and +x along the x axis, the partner D at `length` below along -z. A, B and C are the outer
/// layer, the normals are +z, the contact is B. Throws Error(bad_input).
/// @param spacing x, m, above 0
/// @param length of the inter-layer bond B-D, m, above 0
[[nodiscard]] Organ star(double spacing, double length);

}  // namespace tpm::organ
