#include "tpm/organ/scene/material_directions.hpp"

#include <cmath>

#include "tpmkit/error.hpp"

namespace tpm::organ {

std::array<TangentDirection, 3> material_directions(const Network& network, double E1_Pa,
                                                    double E2_Pa, double modulus_to_stiffness_m) {
  // Radial: k ~ E2, g ~ E2^2/(E1 + E2), tau = eta1/(E1 + E2). Lateral: k ~ E'.
  const double sum_Pa = E1_Pa + E2_Pa;
  const double share2 = E2_Pa / sum_Pa;
  const auto size = static_cast<Eigen::Index>(network.bonds.size());
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(size);
  Eigen::VectorXd radial = zero;
  Eigen::VectorXd lateral = zero;
  for (Eigen::Index i = 0; i < size; ++i) {
    const Bond& bond = network.bonds[static_cast<std::size_t>(i)];
    Eigen::VectorXd& kind = bond.kind == BondKind::radial ? radial : lateral;
    kind[i] = bond.factor * modulus_to_stiffness_m;
  }
  return {{{zero, -share2 * share2 * radial, -1.0 / sum_Pa, 0.0},
           {radial, (2.0 - share2) * share2 * radial, -1.0 / sum_Pa, 0.0},
           {lateral, zero, 0.0, 0.0}}};
}

namespace {

/// Changes of one law.
LawChange change_between(const ViscousLaw& minus, const ViscousLaw& plus, double step) {
  const auto values_change = [step](const ElongationFunction& a, const ElongationFunction& b) {
    ShapeValues change{};
    for (std::size_t k = 0; k < change.size(); ++k) {
      change[k] = (b.values()[k] - a.values()[k]) / step;
    }
    return change;
  };
  LawChange change;
  for (std::size_t j = 0; j < minus.branches.size(); ++j) {
    const ViscousLaw::Branch& a = minus.branches[j];
    const ViscousLaw::Branch& b = plus.branches[j];
    change.share.push_back((b.share - a.share) / step);
    change.log_time.push_back(std::log(b.relaxation_time_s / a.relaxation_time_s) / step);
  }
  for (std::size_t i = 0; i < minus.springs.size(); ++i) {
    const ViscousLaw::Spring& a = minus.springs[i];
    const ViscousLaw::Spring& b = plus.springs[i];
    change.spring_share.push_back((b.share - a.share) / step);
    change.spring_values.push_back(values_change(a.function, b.function));
  }
  change.kernel_values = values_change(minus.kernel, plus.kernel);
  return change;
}

bool correspond(const BondSystem& minus, const BondSystem& plus) {
  if (minus.size() != plus.size() || minus.laws().size() != plus.laws().size()) return false;
  for (std::size_t i = 0; i < minus.laws().size(); ++i) {
    const ViscousLaw& a = minus.laws()[i];
    const ViscousLaw& b = plus.laws()[i];
    if (a.branches.size() != b.branches.size() || a.springs.size() != b.springs.size()) {
      return false;
    }
  }
  for (std::size_t i = 0; i < minus.size(); ++i) {
    if (minus.law_of(i) != plus.law_of(i)) return false;
  }
  return true;
}

}  // namespace

TangentDirection direction_between(const BondSystem& minus, const BondSystem& bonds,
                                   const BondSystem& plus, double step) {
  if (!correspond(minus, bonds) || !correspond(bonds, plus)) {
    throw bad_input("material", "its laws change their form where a derivative is taken",
                    "moduli above 0, relaxation times that differ, and regions of one law varied "
                    "together");
  }
  TangentDirection direction;
  direction.stiffness = (plus.stiffness() - minus.stiffness()) / step;
  direction.relaxing = (plus.relaxing() - minus.relaxing()) / step;
  for (std::size_t i = 0; i < minus.laws().size(); ++i) {
    direction.laws.push_back(change_between(minus.laws()[i], plus.laws()[i], step));
  }
  return direction;
}

}  // namespace tpm::organ
