#pragma once
#include <string>

#include "tpm/organ/balance/driven_tissue.hpp"

namespace tpm::organ {

/// That a tissue buckles and where, in words for a message: "buckles around sphere 12 at (1, 2, 3)
/// mm: its stiffness is no longer positive". It is the sphere that moves most in the softest motion
/// of the last state in balance, found by inverse iteration, or by least curvature where an
/// iterative solver meets a stiffness that is not positive definite.
/// @param state the last in balance; the factorisation of the tissue is lost
[[nodiscard]] std::string buckling_words(DrivenTissue& tissue, const TissueState& state);

/// The place where a tissue is softest, as in buckling_words: of one that is stable and finds no
/// balance near, where it is likely to snap through.
[[nodiscard]] std::string softest_place(DrivenTissue& tissue, const TissueState& state);
/// ": it may snap through around sphere 12 at (1, 2, 3) mm", with that place.
[[nodiscard]] std::string snap_words(DrivenTissue& tissue, const TissueState& state);

/// The place of buckling_words: " around sphere 12 at (1, 2, 3) mm".
/// @param equilibrium its factorisation is lost
/// @param position the last in balance, m
/// @param spheres the first columns of it; tools follow
[[nodiscard]] std::string buckling_place(Equilibrium& equilibrium, const Positions& position,
                                         const ViscousState& viscous, Eigen::Index spheres);

}  // namespace tpm::organ
