#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "tpm/organ/body/lattice.hpp"
#include "tpm/organ/body/surface.hpp"

namespace tpm::organ {

/// Request of a shell of spheres. The surface fixes the size, so one of count and spacing
/// is free and follows from the other: an outer layer of n spheres at spacing x covers n x^2
/// sqrt(3)/2, the area of a triangular lattice. If both are given they must agree within 1 %.
struct ShellRequest {
  std::optional<std::size_t> count;  ///< all spheres of all layers, 2 to 1,000,000
  int layers = 2;                    ///< 1 to 100, at most the count
  std::optional<double> spacing;     ///< x, m
  std::optional<double> radius;      ///< m; half the spacing (spheres that touch) if not given
  std::uint64_t seed = 1;            ///< of the places from which the outer layer starts
  /// Where the probe lands, m: the nearest outer sphere becomes the contact, with a flat landing
  /// site around it (landing_site.hpp). None: no contact.
  std::optional<Eigen::Vector3d> landing;
};

/// Request of a solid filling; exactly one of count and spacing.
struct SolidRequest {
  std::optional<std::size_t> count;  ///< 2 to 1,000,000
  std::optional<double> spacing;     ///< x, m
  Lattice lattice = Lattice::fcc;    ///< of the inside
  std::optional<double> radius;      ///< m; half the spacing if not given
  std::uint64_t seed = 1;
};

/// Spheres in layers below the surface. The centres of the outer layer lie on the surface, evenly
/// spread (relaxed by repulsion). Below each stands a column: its sphere in layer k lies k steps
/// inwards along the normal. The step is the spacing, or less where the body has no room for the
/// layers (0.8 of its inner radius over layers - 1); the organ's assumptions say so. Inner spheres
/// that would come closer than 0.62 steps to another one move aside.
///
/// The count is split evenly; each of the first (count mod layers) layers has one more. Numbers run
/// layer by layer, and within each from the smallest x to the largest (as they
/// lay before a landing site was flattened), so that sphere i of layer k
/// stands above sphere i of layer k + 1; only the last sphere of a longer layer has none below.
/// Coordinates are rounded to nanometres. O(n log n). Throws Error(bad_input).
[[nodiscard]] Organ fill_shell(const Surface& surface, const ShellRequest& request);

/// Spheres throughout the body: an outer layer on the surface as in a shell, and inside it the
/// points of a lattice that are at least 0.7 spacings deep. Where an outer sphere has fewer than
/// three of them within 1.5 spacings, spheres are added below it (solid_support.hpp). Layers inside
/// are one spacing thick. Of a given count, the spacing is about the largest that gives so many;
/// what is then too much is left out nearest to the outer layer, where the outer spheres can do
/// without. Numbers run layer by layer, the outer one by rising x, the others in the order of the
/// lattice (z, then y, then x), those that were added behind them. O(n log n). Throws
/// Error(bad_input), also for a body with no room for three layers where it is thickest.
[[nodiscard]] Organ fill_solid(const Surface& surface, const SolidRequest& request);

/// Radius of about the largest ball inside, m: the deepest point of a grid of 24^3, or the first
/// one, from the middle outwards, that is deeper than `enough`.
[[nodiscard]] double inner_radius(const Surface& surface, double enough);
/// By which part it may be below the radius itself: half a diagonal of a cell, on a ball.
inline constexpr double kInnerRadiusError = 0.07;

/// `count` points evenly spread over a surface, each at a nominal distance of
/// even_spacing(surface, count) from its neighbours.
[[nodiscard]] Positions even_points(const Surface& surface, std::size_t count, std::uint64_t seed);

/// Distance of neighbours if `count` points cover an area (m^2) as a triangular lattice, m.
[[nodiscard]] double even_spacing(double area, std::size_t count);
[[nodiscard]] double even_spacing(const Surface& surface, std::size_t count);

/// Number of points that cover a surface at a spacing, rounded; may be 0.
[[nodiscard]] std::size_t even_count(const Surface& surface, double spacing);

/// Throws Error(bad_input) unless 2 <= count <= 1,000,000.
void require_sphere_count(std::size_t count);

/// The points in the order of rising x, then y, then z.
[[nodiscard]] Positions sorted_by_x(const Positions& points);

/// Each coordinate rounded to a nanometre, so that numbers and output do not hang on last bits.
void round_to_nanometres(Positions& positions);

}  // namespace tpm::organ
