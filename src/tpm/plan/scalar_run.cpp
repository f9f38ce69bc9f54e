#include "tpm/plan/scalar_run.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace tpm::plan {
ScalarModel linear_contact(const ContactSpectrum& spectrum, int branches) {
  return {{.stiffness_N_per_m = spectrum.equilibrium()},
          {.stiffness_N_per_m = spectrum.instantaneous() - spectrum.equilibrium()},
          fitted_branches(spectrum, branches),
          1.0};
}

ScalarModel curves_contact(const ContactCurves& curves, const ContactSpectrum& spectrum,
                           int branches) {
  return {curves.equilibrium, curves.relaxing, fitted_branches(spectrum, branches), 1.0};
}

ScalarRun::ScalarRun(const Protocol& protocol, ScalarModel model, double longest_step_s,
                     bool one_step_at_rest)
    : protocol_(protocol),
      by_depth_(protocol.drive() == Drive::displacement),
      model_(std::move(model)),
      longest_s_(longest_step_s),
      one_step_at_rest_(one_step_at_rest && by_depth_),
      knots_(protocol_.knots()) {
  time_s_ = knots_.front().time_s;
  const double first = knots_.front().value;
  if (protocol_.equilibrium_at_start()) {
    settle(first);
  } else {
    jump(first);
  }
  pass_jumps();
}

double ScalarRun::at(double time_s) {
  while (next_ < knots_.size() && knots_[next_].time_s <= time_s) {
    cross(knots_[next_].time_s, knots_[next_].value);
    ++next_;
    pass_jumps();
  }
  if (time_s > time_s_) cross(time_s, value_at(protocol_, time_s));
  return response_;
}

void ScalarRun::jump(double value) {
  response_ = by_depth_ ? model_.jump_to(value) : model_.jump_under(value);
  value_ = value;
}

/// Relaxed under a first value: after a very long step.
void ScalarRun::settle(double value) {
  constexpr double kForever_s = 1e12;
  jump(value);
  model_.set_period(kForever_s);
  response_ = by_depth_ ? model_.step_to(value) : model_.step_under(value);
  if (!by_depth_) {
    for (int i = 0; i < 200; ++i) response_ = model_.step_under(value);
  }
}

void ScalarRun::pass_jumps() {
  while (next_ < knots_.size() && knots_[next_].time_s <= time_s_) jump(knots_[next_++].value);
}

void ScalarRun::cross(double time_s, double value) {
  const double length = time_s - time_s_;
  if (!(length > 0.0)) return;
  const bool rests = one_step_at_rest_ && value == value_;
  const double count = rests ? 1.0 : std::max(1.0, std::ceil(length / longest_s_ * (1.0 - 1e-9)));
  model_.set_period(length / count);
  const double begin = value_;
  const auto steps = static_cast<std::uint64_t>(count);
  for (std::uint64_t i = 1; i <= steps; ++i) {
    const double now = begin + (value - begin) * static_cast<double>(i) / count;
    response_ = by_depth_ ? model_.step_to(now) : model_.step_under(now);
  }
  steps_ += count;
  time_s_ = time_s;
  value_ = value;
}

}  // namespace tpm::plan
