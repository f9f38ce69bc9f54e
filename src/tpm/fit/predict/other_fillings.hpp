#pragma once
#include <memory>
#include <string>
#include <vector>

#include "tpm/fit/predict/organ_prediction.hpp"

namespace tpm::fit {

/// The body of an organ filled with spheres in other places: what the place of the spheres under
/// the contact does to an answer, as the shifts of a lattice do (ASME V&V 20-2009).
struct OtherFillings {
  std::vector<std::unique_ptr<const OrganOfLaw>> organs;  ///< kOtherFillings of them, or none
  std::string words;                                      ///< which they are, or why there are none
};
inline constexpr int kOtherFillings = 5;

/// Fillings of the same body by the seeds after the organ's own, pressed at the outer sphere
/// nearest to the organ's contact, with the same bonds. Seeds whose network does not stand are
/// passed over. None where the spheres do not follow from a seed: a block, a star, spheres listed
/// one by one (also from a mesh), and scenes whose anchors, regions or sliders name spheres by
/// number.
[[nodiscard]] OtherFillings other_fillings(const OrganOfLaw& organ);

}  // namespace tpm::fit
