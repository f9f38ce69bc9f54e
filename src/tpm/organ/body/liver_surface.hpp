#pragma once
#include <array>
#include <cstddef>
#include <string_view>

#include "tpm/organ/body/mesh_surface.hpp"

namespace tpm::organ {

/// A liver in named measures. Axes: x to the patient's right, y up, z to the back; the probe comes
/// from the front, along +z. All lengths refer to the lobes before they are blended into each
/// other.
struct LiverShape {
  double width = 0.210;           ///< right to left, m; above 0
  double height = 0.160;          ///< of the right lobe, top to bottom, m; 0.5 to 1.2 widths
  double depth = 0.115;           ///< of the right lobe, front to back, m; 0.35 to 0.9 widths
  double right_share = 0.62;      ///< of the width that is right lobe; 0.5 to 0.75
  double left_height = 0.55;      ///< of the left lobe, in heights of the right one; 0.4 to 0.6
  double left_depth = 0.50;       ///< of the left lobe, in depths of the right one; 0.45 to 0.8
  double notch_depth = 0.20;      ///< between the lobes, from below, in heights; 0.1 to 0.2
  double notch_width = 0.10;      ///< half width of the notch, in widths; 0.08 to 0.14
  double visceral_hollow = 0.25;  ///< of the face towards the bowel, in heights; 0 to 0.3
};

/// One measure of a LiverShape as files and options name it.
struct LiverMeasure {
  std::string_view name;  ///< "right_share"
  double LiverShape::*value;
  double least, most;        ///< valid range
  double LiverShape::*unit;  ///< the range is in multiples of this measure; null: as it stands
  std::string_view meaning;  ///< one phrase
};

/// All measures with their valid ranges.
[[nodiscard]] const std::array<LiverMeasure, 9>& liver_measures() noexcept;

/// Throws Error(bad_input) that names the first measure out of its range.
void require_valid(const LiverShape& shape, std::string_view where);

/// The same proportions at `factor` times the size.
[[nodiscard]] LiverShape scaled(LiverShape shape, double factor);

/// A smooth closed surface: two ellipsoids blended into each other, hollowed by a sphere from below
/// and behind and grooved between the lobes, in 20,480 triangles. Made of arithmetic and square
/// roots only, so that it does not depend on a mathematical library. Throws as require_valid.
[[nodiscard]] MeshSurface liver_surface(const LiverShape& shape);

/// The triangles of that surface alone: what its area needs. Throws as require_valid.
[[nodiscard]] TriangleMesh liver_mesh(const LiverShape& shape);

/// The point in the middle of the front of the right lobe, where a surgeon's probe gets at it.
[[nodiscard]] SurfacePoint front_of_right_lobe(const LiverShape& shape, const Surface& surface);

}  // namespace tpm::organ
