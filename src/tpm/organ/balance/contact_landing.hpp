#pragma once
#include <cstddef>
#include <limits>
#include <optional>

#include "tpm/organ/balance/stage_balance.hpp"

namespace tpm::organ {

/// Cuts a step within which a contact with a tool closes or opens, so that it ends there.
class ContactLanding {
 public:
  enum class Answer {
    keep,          ///< nothing changes within the step, or the contact does at its end
    try_again,     ///< with the shorter step
    change_first,  ///< the contact changes where the step begins
  };

  /// @param change in the step just balanced
  /// @param h of that step, s; of the next one to try
  /// @param least_s a time that is none
  [[nodiscard]] Answer see(const std::optional<ContactChange>& change, double& h, double least_s) {
    constexpr double kLanded = 1.0 - 1e-6;  // of a step that was to end where a contact changes
    if (!change) return Answer::keep;
    if (change->fraction * h <= least_s) {
      cut_.reset();
      return Answer::change_first;
    }
    if (cut_ && cut_->contact == change->contact && change->fraction > kLanded) return Answer::keep;
    cut_ = Cut{change->contact, cut_ ? cut_->whole_s : h};
    h *= change->fraction;
    return Answer::try_again;
  }

  /// A contact that changes where the step ends, with the length of the step before it was cut.
  struct Cut {
    std::size_t contact;
    double whole_s;
  };
  [[nodiscard]] const std::optional<Cut>& cut() const { return cut_; }
  void reset() { cut_.reset(); }

  /// False if contacts have changed at this time more often than any motion explains.
  [[nodiscard]] bool may_change(double time_s, std::size_t contacts) {
    constexpr std::size_t kMostTogether = 4;  // changes of a contact at one time
    together_ = time_s == changed_at_s_ ? together_ + 1 : 1;
    changed_at_s_ = time_s;
    return together_ <= kMostTogether * contacts;
  }

 private:
  std::optional<Cut> cut_;
  double changed_at_s_ = -std::numeric_limits<double>::infinity();
  std::size_t together_ = 0;
};

}  // namespace tpm::organ
