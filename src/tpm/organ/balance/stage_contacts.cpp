// Declared in tpm/organ/balance/stage_balance.hpp.
// Contacts with a tool that close or open within the step that StageBalance has found.
#include <boost/math/tools/roots.hpp>
#include <cstdint>

#include "tpm/organ/balance/stage_balance.hpp"

namespace tpm::organ {
namespace {

/// Where a function that is below 0 at `from` and above at `to` crosses it.
template <class Function>
double root_between(const Function& function, double from, double to) {
  std::uintmax_t most = 100;
  return boost::math::tools::toms748_solve(function, from, to,
                                           boost::math::tools::eps_tolerance<double>(), most)
      .first;
}

}  // namespace

double StageBalance::gap_m(const ToolContact& contact, double fraction) const {
  const Eigen::RowVectorXd shape = full_.interpolation(fraction).tail(stages_).transpose();
  const auto place = [&](std::uint32_t column) -> Eigen::RowVector3d {
    const Eigen::Index first = 3 * static_cast<Eigen::Index>(column);
    const Eigen::RowVector3d start = start_.segment<3>(first);
    return start + shape * (x_.middleCols<3>(first).topRows(stages_).rowwise() - start);
  };
  return contact_gap_m(contact, place(contact.sphere).transpose(), place(contact.tool).transpose());
}

std::optional<ContactChange> StageBalance::contact_change(double tolerance) const {
  const auto& contacts = tissue_.bonds().contacts();
  // Errors of force and length that change the response by the tolerance.
  const double of_response = tolerance * scale_;
  const double of_imposed = of_response / unit_response_;
  const double length = tissue_.depth_driven() ? of_imposed : of_response;
  const double force = tissue_.depth_driven() ? of_response : of_imposed;
  std::optional<ContactChange> first;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const bool closed = closed_[i] != 0;
    // Size of the violation: a closed contact that pulls, an open one that overlaps.
    const auto wrong = [&](double fraction) {
      const double gap = gap_m(contacts[i], fraction);
      return closed ? gap : -gap;
    };
    const double allowed = closed ? force / contacts[i].stiffness_N_per_m : length;
    double before = 0.0;
    for (int stage = 0; stage < stages_; ++stage) {
      const double at = node(stage);
      if (first && before >= first->fraction) break;
      if (wrong(at) > allowed) {
        const double crossing = wrong(before) < 0.0 ? root_between(wrong, before, at) : before;
        if (!first || crossing < first->fraction) first = ContactChange{i, crossing};
        break;
      }
      before = at;
    }
  }
  return first;
}

void StageBalance::change_contact(TissueState& state, std::size_t contact) {
  state.closed[contact] = state.closed[contact] != 0 ? 0 : 1;
  ++work_.contact_changes;
  factorised_ = false;
  last_rate_.reset();
}

}  // namespace tpm::organ
