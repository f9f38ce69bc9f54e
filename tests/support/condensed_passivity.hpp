#pragma once
// Random motion of a condensed contact, whose energy is accounted for step by step.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tpm/base/random.hpp"
#include "tpm/contact/condensed/condensed.hpp"

namespace tpm::testing {
using namespace contact;

struct EnergyAccount {
  double created_J = 0.0;   ///< the most in one step: change of the stored energy less the work
  double least_J = 0.0;     ///< smallest stored energy
  double highest_J = 0.0;   ///< largest
  double supplied_J = 0.0;  ///< work over all steps less what is stored at the end
};

/// Work on the tissue while the contact moves straight and its viscous state stands still, J. Four
/// points of Gauss are exact for a potential of degree 7.
inline double straight_work_J(const CondensedContact& contact, const Eigen::Vector3d& from,
                              const Eigen::Vector3d& to, const CondensedViscousState& viscous) {
  constexpr std::array<double, 2> kPlace{0.33998104358485626, 0.86113631159405258};
  constexpr std::array<double, 2> kWeight{0.65214515486254614, 0.34785484513745386};
  double work = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    for (const double place : {-kPlace[k], kPlace[k]}) {
      const Eigen::Vector3d at = from + 0.5 * (1.0 + place) * (to - from);
      work -= 0.5 * kWeight[k] * contact.force_N(at, viscous).dot(to - from);
    }
  }
  return work;
}

/// Strides, holds, jumps and fast circles within the range, drawn from a seed.
inline EnergyAccount account_of_random_motion(CondensedContact& contact,
                                              const Eigen::Vector3d& into,
                                              const CondensedOptions& range, long long steps,
                                              std::uint64_t seed) {
  Random random(seed);
  const Eigen::Vector3d across = into.unitOrthogonal();
  const Eigen::Vector3d other = into.cross(across);
  contact.reset();
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  double stored = contact.stored_energy_J(at, contact.viscous_state());
  EnergyAccount account;
  const auto place = [&](double depth_share, double radius_share, double angle) {
    const double radius = radius_share * range.tangential_m;
    return Eigen::Vector3d(depth_share * range.depth_m * into + radius * std::cos(angle) * across +
                           radius * std::sin(angle) * other);
  };
  const auto go = [&](const Eigen::Vector3d& to) {
    const CondensedViscousState before = contact.viscous_state();
    (void)contact.step(to);
    const CondensedViscousState after = contact.viscous_state();
    const Eigen::Vector3d rests = at + contact.relaxation_point() * (to - at);
    const double work =
        straight_work_J(contact, at, rests, before) + straight_work_J(contact, rests, to, after);
    const double now = contact.stored_energy_J(to, after);
    account.created_J = std::max(account.created_J, now - stored - work);
    account.supplied_J += work - (now - stored);
    account.least_J = std::min(account.least_J, now);
    account.highest_J = std::max(account.highest_J, now);
    stored = now;
    at = to;
  };
  double depth = 0.0, radius = 0.0, angle = 0.0;
  for (long long done = 0; done < steps;) {
    const auto count = static_cast<long long>(1 + random.below(60));
    const double kind = random.uniform();
    const double depth_to = random.uniform();
    const double radius_to = random.uniform();
    // A jump, a hold, a stride, a circle of up to three turns in ten steps.
    const double turn = kind > 0.6 ? 2.0 * random.uniform() : 0.0;
    const double share = kind < 0.1 ? 1.0 : kind < 0.3 ? 0.0 : 1.0 / static_cast<double>(count);
    const double depth_step = share * (depth_to - depth);
    const double radius_step = share * (radius_to - radius);
    for (long long i = 0; i < (kind < 0.1 ? 1 : count) && done < steps; ++i, ++done) {
      depth += depth_step;
      radius += radius_step;
      angle += turn;
      go(place(depth, radius, angle));
    }
  }
  return account;
}

}  // namespace tpm::testing
