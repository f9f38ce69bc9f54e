// Declared in tpm/law/contact_history.hpp.
// The force of a contact that shrinks, from the history up to where its edge was met.
#include "tpm/law/contact_history.hpp"
#include "tpm/law/contact_retreat.hpp"

namespace tpm::law {
namespace {

/// exp(-rate (t - t1)); 0 for what was met under rest, all of which has relaxed
Eigen::ArrayXd kept(const RelaxationSum& relaxation, const ContactEdge& edge) {
  if (edge.at_rest) return Eigen::ArrayXd::Zero(relaxation.rate_per_s.size());
  return (-relaxation.rate_per_s.array() * edge.later_s).exp();
}

}  // namespace

double ContactHistory::force_within(const ContactEdge& edge) const {
  const RelaxationSum& m = law_.relaxation;
  const Point met = imposed(edge.met_drive, true);
  const double viscous = (m.stiffness.array() * kept(m, edge) * (met.v - w_)).sum();
  return law_.offset + m.constant * met.v + viscous + law_.kernel.tangent(met.u).slope * edge.pull;
}

Slopes ContactHistory::force_slopes_within(const ContactEdge& edge) const {
  const RelaxationSum& m = law_.relaxation;
  const Point met = imposed(edge.met_drive, true);
  const Eigen::ArrayXd decay = kept(m, edge);
  const Eigen::ArrayXd stiffness = m.stiffness.array() * decay;
  Slopes slopes = (m.constant + stiffness.sum()) * met.v_by - weighted_slopes(stiffness);
  slopes[law_.place.offset] += 1.0;
  for (std::size_t q = 0; q < m.by.size(); ++q) {
    const auto c = static_cast<Eigen::Index>(q);
    slopes[m.by[q]] +=
        m.d_constant[c] * met.v + (m.d_stiffness.col(c).array() * decay * (met.v - w_)).sum();
  }
  for (std::size_t j = 0; j < m.rate_parameter.size(); ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    if (!(decay[row] > 0.0)) continue;
    const double rate = m.rate_per_s[row];
    slopes[m.rate_parameter[j]] += stiffness[row] * (met.v - w_[row]) * edge.later_s * rate * rate;
  }
  return slopes + law_.kernel.tangent(met.u).slope * edge.pull_by;
}

}  // namespace tpm::law
