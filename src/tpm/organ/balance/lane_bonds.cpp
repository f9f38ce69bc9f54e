#include "tpm/organ/balance/lane_bonds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tpm/base/wide_vectors.hpp"

namespace tpm::organ {
namespace {

constexpr std::size_t kSphere = std::size_t{3} * kLanes;
constexpr std::size_t kDown = std::size_t{2} * kLanes;  // from x to z of a sphere

/// The place or force of a sphere, a row a lane.
auto columns_of(const LaneMatrix& vectors, std::uint32_t sphere) {
  return vectors.middleCols<3>(3 * static_cast<Eigen::Index>(sphere));
}
auto columns_of(LaneMatrix& vectors, std::uint32_t sphere) {
  return vectors.middleCols<3>(3 * static_cast<Eigen::Index>(sphere));
}

/// The vector from one end of a bond to the other.
struct Span {
  std::array<double, kLanes> x, y, z, length, inverse;
};

[[gnu::always_inline]] inline void measure(const double* from, const double* to, Span& span) {
  std::array<double, kLanes> square;
#pragma omp simd
  for (std::size_t s = 0; s < kLanes; ++s) {
    span.x[s] = to[s] - from[s];
    span.y[s] = to[kLanes + s] - from[kLanes + s];
    span.z[s] = to[kDown + s] - from[kDown + s];
    square[s] = span.x[s] * span.x[s] + span.y[s] * span.y[s] + span.z[s] * span.z[s];
  }
#pragma omp simd
  for (std::size_t s = 0; s < kLanes; ++s) {
    span.length[s] = std::sqrt(square[s]);
    span.inverse[s] = 1.0 / span.length[s];
  }
}

/// The vector of a bond times the change of its ends.
[[gnu::always_inline]] inline double along(const Span& span, const double* ua, const double* ub,
                                           std::size_t s) {
  return span.x[s] * (ub[s] - ua[s]) + span.y[s] * (ub[kLanes + s] - ua[kLanes + s]) +
         span.z[s] * (ub[kDown + s] - ua[kDown + s]);
}

/// Force of a bond on its ends: the first along it, the other against.
using Pull = std::array<double, kSphere>;

[[gnu::always_inline]] inline void pull_ends(const Pull& pull, double* a, double* b) {
#pragma omp simd
  for (std::size_t s = 0; s < kSphere; ++s) {
    a[s] += pull[s];
    b[s] -= pull[s];
  }
}

/// Change of u(l) with a change of the law.
double equilibrium_change(const ViscousLaw& law, const LawChange& change, double l) {
  double sum = 0.0;
  for (std::size_t i = 0; i < change.spring_share.size(); ++i) {
    const auto& [share, function] = law.springs[i];
    sum += change.spring_share[i] * function.value(l) +
           share * function.change(l, change.spring_values[i]);
  }
  return sum;
}

}  // namespace

LaneBonds::LaneBonds(const BondSystem& bonds)
    : contacts_(bonds.contacts()),
      laws_(bonds.laws().begin(), bonds.laws().end()),
      linear_(bonds.is_linear()) {
  std::vector<Data> all;
  std::vector<Data> lasting;
  std::vector<std::size_t> lasting_number;
  for (std::size_t i = 0; i < bonds.first_contact(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    constexpr double kNever = -std::numeric_limits<double>::infinity();
    const Data data{bonds.end_a()[i],       bonds.end_b()[i],      bonds.rest_length_m()[row],
                    bonds.stiffness()[row], bonds.relaxing()[row], bonds.is_rope(i) ? 0.0 : kNever,
                    bonds.law_of(i)};
    if (data.g > 0.0) {
      relaxing_.push_back(i);
    } else {
      lasting.push_back(data);
      lasting_number.push_back(i);
    }
    all.push_back(data);
  }
  std::stable_sort(relaxing_.begin(), relaxing_.end(),
                   [&](std::size_t x, std::size_t y) { return all[x].law < all[y].law; });
  for (const std::size_t i : relaxing_) {
    const auto column = static_cast<Eigen::Index>(bond_.size());
    if (groups_.empty() || groups_.back().law != all[i].law) {
      groups_.push_back({all[i].law, column, 0});
    }
    ++groups_.back().count;
    bond_.push_back(all[i]);
  }
  bond_.insert(bond_.end(), lasting.begin(), lasting.end());
  number_ = relaxing_;
  number_.insert(number_.end(), lasting_number.begin(), lasting_number.end());
}

void LaneBonds::close_contacts(std::span<const char> closed) {
  closed_.clear();
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    if (closed[i] != 0) closed_.push_back(contacts_[i]);
  }
}

LaneBonds::ContactGeometry LaneBonds::contact_geometry(const ToolContact& contact,
                                                       const LaneMatrix& position) const {
  ContactGeometry contact_geometry;
  const Eigen::Matrix<double, kLanes, 3> apart =
      columns_of(position, contact.tool) - columns_of(position, contact.sphere);
  if (contact.normal) {
    contact_geometry.direction.rowwise() = contact.normal->transpose();
    contact_geometry.overlap_force =
        contact.stiffness_N_per_m * ((apart * *contact.normal).array() - contact.reach_m);
    contact_geometry.turning.setZero();
    return contact_geometry;
  }
  const LaneVector length = apart.rowwise().norm();
  contact_geometry.direction = apart.array().colwise() / length.array();
  contact_geometry.overlap_force = contact.stiffness_N_per_m * (length.array() - contact.reach_m);
  contact_geometry.turning = contact_geometry.overlap_force.cwiseQuotient(length);
  return contact_geometry;
}

Eigen::VectorXd LaneBonds::in_order(const Eigen::VectorXd& all) const {
  return all(number_);
}

Eigen::VectorXd LaneBonds::of_relaxing(const Eigen::VectorXd& all) const {
  return all(relaxing_);
}

void LaneBonds::elongations(const LaneMatrix& position, LaneMatrix& elongation) const {
  elongation.resize(kLanes, static_cast<Eigen::Index>(relaxing_.size()));
  const double* const x = position.data();
  double* const l = elongation.data();
  run_wide([&]() __attribute__((always_inline)) {
    Span span;
    for (std::size_t i = 0; i < relaxing_.size(); ++i) {
      measure(x + kSphere * bond_[i].a, x + kSphere * bond_[i].b, span);
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s)
        l[kLanes * i + s] = span.length[s] - bond_[i].rest_length_m;
    }
  });
}

void LaneBonds::followed(const LaneMatrix& position, LaneMatrix& followed) const {
  elongations(position, followed);
  if (linear_) return;
  double* const v = followed.data();
  for (std::size_t i = 0; i < relaxing_.size(); ++i) {
    const ElongationFunction& kernel = laws_[bond_[i].law].kernel;
    for (std::size_t s = 0; s < kLanes; ++s) v[kLanes * i + s] = kernel.value(v[kLanes * i + s]);
  }
}

void LaneBonds::add_contact_forces(const LaneMatrix& position, LaneMatrix& force) const {
  for (const ToolContact& contact : closed_) {
    const ContactGeometry now = contact_geometry(contact, position);
    const Eigen::Matrix<double, kLanes, 3> pull =
        now.direction.array().colwise() * now.overlap_force.array();
    columns_of(force, contact.sphere) += pull;
    columns_of(force, contact.tool) -= pull;
  }
}

struct LaneBondKernels {
  using Data = LaneBonds::Data;
  using Lanes = std::array<double, kLanes>;

  /// Adds the force of a linear bond to its ends.
  [[gnu::always_inline]] static void pull_linear(const Data& bond, const Span& span,
                                                 const double* viscous, double* f) {
    Lanes share;
#pragma omp simd
    for (std::size_t s = 0; s < kLanes; ++s) {
      const double l = span.length[s] - bond.rest_length_m;
      const double taut = l >= bond.least ? 1.0 : 0.0;
      share[s] = taut * (bond.k * l - bond.g * viscous[s]) * span.inverse[s];
    }
    pull_along(bond, span, share, f);
  }

  [[gnu::always_inline]] static void pull_along(const Data& bond, const Span& span,
                                                const Lanes& share, double* f) {
    Pull pull;
#pragma omp simd
    for (std::size_t s = 0; s < kLanes; ++s) {
      pull[s] = share[s] * span.x[s];
      pull[kLanes + s] = share[s] * span.y[s];
      pull[kDown + s] = share[s] * span.z[s];
    }
    pull_ends(pull, f + kSphere * bond.a, f + kSphere * bond.b);
  }

  /// Linear bonds of one group, whose y follows what it does at the stages.
  template <bool kKnown>
  [[gnu::always_inline]] static void pull_following(const Data* bonds, std::size_t begin,
                                                    std::size_t end,
                                                    const LaneBonds::Following& following,
                                                    const double* x, double* followed, double* f) {
    const double* const weight = following.weights->of_stages.data();
    const double* const from_start = following.weights->of_start.data();
    const double* const from_viscous = following.weights->of_viscous.data();
    Span span;
    for (std::size_t i = begin; i < end; ++i) {
      const Data& bond = bonds[i];
      measure(x + kSphere * bond.a, x + kSphere * bond.b, span);
      double* const l = followed + kLanes * i;
      Lanes viscous;
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) l[s] = span.length[s] - bond.rest_length_m;
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) {
        double lane = 0.0;
        if constexpr (kKnown) {
          lane = following.known[kLanes * i + s];
        } else {
          lane = from_start[s] * following.followed[i] + from_viscous[s] * following.mean[i];
        }
        for (std::size_t j = 0; j < kLanes; ++j) lane += weight[kLanes * j + s] * l[j];
        viscous[s] = lane;
      }
      pull_linear(bond, span, viscous.data(), f);
    }
  }
};

void LaneBonds::add_forces_of_stages(const LaneMatrix& position, std::span<const Following> groups,
                                     LaneMatrix& followed, LaneMatrix& force) const {
  followed.resize(kLanes, static_cast<Eigen::Index>(relaxing_.size()));
  const double* const x = position.data();
  double* const l = followed.data();
  double* const f = force.data();
  const Data* const bonds = bond_.data();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const Following following = groups[i];
    const auto begin = static_cast<std::size_t>(groups_[i].first);
    const auto end = begin + static_cast<std::size_t>(groups_[i].count);
    if (following.known != nullptr) {
      run_wide([&]() __attribute__((always_inline)) {
        LaneBondKernels::pull_following<true>(bonds, begin, end, following, x, l, f);
      });
    } else {
      run_wide([&]() __attribute__((always_inline)) {
        LaneBondKernels::pull_following<false>(bonds, begin, end, following, x, l, f);
      });
    }
  }
  run_wide([&]() __attribute__((always_inline)) {
    constexpr LaneBondKernels::Lanes kNothing{};
    Span span;
    for (std::size_t i = relaxing_.size(); i < bond_.size(); ++i) {
      measure(x + kSphere * bonds[i].a, x + kSphere * bonds[i].b, span);
      LaneBondKernels::pull_linear(bonds[i], span, kNothing.data(), f);
    }
  });
  add_contact_forces(position, force);
}

void LaneBonds::add_forces(const LaneMatrix& position, const LaneMatrix& mean_viscous,
                           LaneMatrix& force) const {
  linear_ ? add_bond_forces<true>(position, mean_viscous, force)
          : add_bond_forces<false>(position, mean_viscous, force);
  add_contact_forces(position, force);
}

template <bool kLinear>
void LaneBonds::add_bond_forces(const LaneMatrix& position, const LaneMatrix& mean_viscous,
                                LaneMatrix& force) const {
  const double* const x = position.data();
  const double* const y = mean_viscous.data();
  double* const f = force.data();
  const std::size_t relaxing = relaxing_.size();
  const auto sweep = [&]() __attribute__((always_inline)) {
    constexpr LaneBondKernels::Lanes kNothing{};
    Span span;
    for (std::size_t i = 0; i < bond_.size(); ++i) {
      const Data& bond = bond_[i];
      const double* const viscous = i < relaxing ? y + kLanes * i : kNothing.data();
      measure(x + kSphere * bond.a, x + kSphere * bond.b, span);
      if constexpr (kLinear) {
        LaneBondKernels::pull_linear(bond, span, viscous, f);
      } else {
        const ViscousLaw& law = laws_[bond.law];
        LaneBondKernels::Lanes share;
        for (std::size_t s = 0; s < kLanes; ++s) {
          const double l = span.length[s] - bond.rest_length_m;
          const double taut = l >= bond.least ? 1.0 : 0.0;
          const double pull =
              (bond.k - bond.g) * law.equilibrium(l) + bond.g * (law.kernel.value(l) - viscous[s]);
          share[s] = taut * pull * span.inverse[s];
        }
        LaneBondKernels::pull_along(bond, span, share, f);
      }
    }
  };
  // Calls of laws are not inlined.
  if constexpr (kLinear) {
    run_wide(sweep);
  } else {
    sweep();
  }
}

LaneVector LaneBonds::stored_J(const LaneMatrix& position, const LaneMatrix& mean_viscous) const {
  const double* const x = position.data();
  const double* const y = mean_viscous.data();
  LaneBondKernels::Lanes twice{};
  run_wide([&]() __attribute__((always_inline)) {
    constexpr LaneBondKernels::Lanes kNothing{};
    Span span;
    for (std::size_t i = 0; i < bond_.size(); ++i) {
      const Data& bond = bond_[i];
      const double* const viscous = i < relaxing_.size() ? y + kLanes * i : kNothing.data();
      measure(x + kSphere * bond.a, x + kSphere * bond.b, span);
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) {
        const double l = span.length[s] - bond.rest_length_m;
        const double taut = l >= bond.least ? 1.0 : 0.0;
        const double spring = l - viscous[s];
        twice[s] += taut * ((bond.k - bond.g) * l * l + bond.g * spring * spring);
      }
    }
  });
  LaneVector stored = 0.5 * LaneVector::Map(twice.data());
  for (const ToolContact& contact : closed_) {
    stored += contact_geometry(contact, position).overlap_force.cwiseAbs2() /
              (2.0 * contact.stiffness_N_per_m);
  }
  return stored;
}

void LaneBonds::followed_changes(const LaneMatrix& position, const LaneMatrix& displacement,
                                 std::span<const LawChange> laws, LaneMatrix& change) const {
  change.resize(kLanes, static_cast<Eigen::Index>(relaxing_.size()));
  const double* const x = position.data();
  const double* const u = displacement.data();
  double* const dl = change.data();
  run_wide([&]() __attribute__((always_inline)) {
    Span span;
    for (std::size_t i = 0; i < relaxing_.size(); ++i) {
      measure(x + kSphere * bond_[i].a, x + kSphere * bond_[i].b, span);
      const double* const ua = u + kSphere * bond_[i].a;
      const double* const ub = u + kSphere * bond_[i].b;
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) {
        dl[kLanes * i + s] = span.inverse[s] * along(span, ua, ub, s);
      }
    }
  });
  if (linear_) return;
  Span span;
  for (std::size_t i = 0; i < relaxing_.size(); ++i) {
    const ElongationFunction& kernel = laws_[bond_[i].law].kernel;
    measure(x + kSphere * bond_[i].a, x + kSphere * bond_[i].b, span);
    for (std::size_t s = 0; s < kLanes; ++s) {
      const double l = span.length[s] - bond_[i].rest_length_m;
      dl[kLanes * i + s] =
          kernel.slope(l) * dl[kLanes * i + s] + kernel.change(l, laws[bond_[i].law].kernel_values);
    }
  }
}

template <bool kLinear>
void LaneBonds::add_bond_force_changes(const LaneMatrix& position, const LaneMatrix& mean_viscous,
                                       const Changes& changes, LaneMatrix& force) const {
  const double* const x = position.data();
  const double* const u = changes.displacement.data();
  const double* const y = mean_viscous.data();
  const double* const dy = changes.mean.data();
  double* const f = force.data();
  const std::size_t relaxing = relaxing_.size();
  const auto sweep = [&]() __attribute__((always_inline)) {
    constexpr std::array<double, kLanes> kNothing{};
    Span span;
    for (std::size_t i = 0; i < bond_.size(); ++i) {
      const Data bond = bond_[i];
      const double dk = changes.stiffness[static_cast<Eigen::Index>(i)];
      const double dg = changes.relaxing[static_cast<Eigen::Index>(i)];
      const double* const viscous = i < relaxing ? y + kLanes * i : kNothing.data();
      const double* const aged = i < relaxing ? dy + kLanes * i : kNothing.data();
      const double* const ua = u + kSphere * bond.a;
      const double* const ub = u + kSphere * bond.b;
      measure(x + kSphere * bond.a, x + kSphere * bond.b, span);
      // N t with t the unit vector: dN t + N (du - t dl)/length, where dl = t du.
      std::array<double, kLanes> with_span, with_change;
      if constexpr (kLinear) {
#pragma omp simd
        for (std::size_t s = 0; s < kLanes; ++s) {
          const double l = span.length[s] - bond.rest_length_m;
          const double taut = l >= bond.least ? 1.0 : 0.0;
          const double share = taut * span.inverse[s] * (bond.k * l - bond.g * viscous[s]);
          const double dl = span.inverse[s] * along(span, ua, ub, s);
          const double dn = bond.k * dl - bond.g * aged[s] + dk * l - dg * viscous[s];
          with_span[s] = span.inverse[s] * (taut * dn - share * dl);
          with_change[s] = share;
        }
      } else {
        const ViscousLaw& law = laws_[bond.law];
        for (std::size_t s = 0; s < kLanes; ++s) {
          const double l = span.length[s] - bond.rest_length_m;
          const double taut = l >= bond.least ? 1.0 : 0.0;
          const double shape = law.equilibrium(l);
          const double v = law.kernel.value(l) - viscous[s];
          const double slope =
              (bond.k - bond.g) * law.equilibrium_slope(l) + bond.g * law.kernel.slope(l);
          const double share = taut * span.inverse[s] * ((bond.k - bond.g) * shape + bond.g * v);
          const double dl = span.inverse[s] * along(span, ua, ub, s);
          const double dn = slope * dl - bond.g * aged[s] + dk * shape + dg * (v - shape) +
                            (bond.k - bond.g) * equilibrium_change(law, changes.laws[bond.law], l) +
                            bond.g * law.kernel.change(l, changes.laws[bond.law].kernel_values);
          with_span[s] = span.inverse[s] * (taut * dn - share * dl);
          with_change[s] = share;
        }
      }
      Pull pull;
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) {
        const std::size_t sy = kLanes + s;
        const std::size_t sz = kDown + s;
        pull[s] = with_span[s] * span.x[s] + with_change[s] * (ub[s] - ua[s]);
        pull[sy] = with_span[s] * span.y[s] + with_change[s] * (ub[sy] - ua[sy]);
        pull[sz] = with_span[s] * span.z[s] + with_change[s] * (ub[sz] - ua[sz]);
      }
      pull_ends(pull, f + kSphere * bond.a, f + kSphere * bond.b);
    }
  };
  // Calls of laws are not inlined.
  if constexpr (kLinear) {
    run_wide(sweep);
  } else {
    sweep();
  }
}

void LaneBonds::add_force_changes(const LaneMatrix& position, const LaneMatrix& mean_viscous,
                                  const Changes& changes, LaneMatrix& force) const {
  linear_ ? add_bond_force_changes<true>(position, mean_viscous, changes, force)
          : add_bond_force_changes<false>(position, mean_viscous, changes, force);
  for (const ToolContact& contact : closed_) {
    const ContactGeometry now = contact_geometry(contact, position);
    const Eigen::Matrix<double, kLanes, 3> apart = columns_of(changes.displacement, contact.tool) -
                                                   columns_of(changes.displacement, contact.sphere);
    const LaneVector along = now.direction.cwiseProduct(apart).rowwise().sum();
    const LaneVector straight =
        along.cwiseProduct(LaneVector::Constant(contact.stiffness_N_per_m) - now.turning);
    const Eigen::Matrix<double, kLanes, 3> change =
        (now.direction.array().colwise() * straight.array() +
         apart.array().colwise() * now.turning.array());
    columns_of(force, contact.sphere) += change;
    columns_of(force, contact.tool) -= change;
  }
}

}  // namespace tpm::organ
