#include "tpm/organ/steps/bond_projection.hpp"

namespace tpm::organ {

BondProjection::BondProjection(const BondSystem& bonds, const Constraints& constraints)
    : bonds_(bonds),
      constraints_(constraints),
      tension_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size()))) {}

void BondProjection::sweep(Positions& position, const ViscousState& viscous_state,
                           const Eigen::VectorXd& compliance_m_per_N) {
  for (std::size_t i = 0; i < bonds_.first_contact(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const std::uint32_t a = bonds_.end_a()[i];
    const std::uint32_t b = bonds_.end_b()[i];
    const Eigen::Vector3d apart = position.col(b) - position.col(a);
    const double length = apart.norm();
    const Eigen::Vector3d n = apart / length;
    const double l = length - bonds_.rest_length_m()[row];
    const bool slack = bonds_.is_rope(i) && l < 0.0;
    const double g = bonds_.relaxing()[row];
    const ViscousLaw& law = bonds_.laws()[bonds_.law_of(i)];
    const double follows = 1.0 - viscous_state.relaxation_factor(bonds_.law_of(i));
    double slope = 0.0;
    double pull = 0.0;
    if (!slack) {
      const double k = bonds_.stiffness()[row] - g;
      slope = k * law.equilibrium_slope(l) + g * follows * law.kernel.slope(l);
      pull =
          k * law.equilibrium(l) + g * (follows * law.kernel.value(l) - viscous_state.offset[row]);
    }
    const Eigen::Vector3d move_a = compliance_m_per_N[a] * (constraints_.projector(a) * n);
    const Eigen::Vector3d move_b = compliance_m_per_N[b] * (constraints_.projector(b) * n);
    const double compliance = n.dot(move_a + move_b);
    const double more = (pull - tension_[row]) / (1.0 + slope * compliance);
    tension_[row] += more;
    position.col(a) += more * move_a;
    position.col(b) -= more * move_b;
  }
}

}  // namespace tpm::organ
