#include "tpmkit/protocol.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/base/time_range.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
using namespace base;

namespace {

void require_positive(double value, std::string_view what, std::string_view unit) {
  if (std::isfinite(value) && value > 0.0) return;
  throw bad_input("protocol", fmt::format("{} = {} {}", what, shortest(value), unit),
                  "a finite value above 0");
}

void require_not_negative(double value, std::string_view what, std::string_view unit) {
  if (std::isfinite(value) && value >= 0.0) return;
  throw bad_input("protocol", fmt::format("{} = {} {}", what, shortest(value), unit),
                  "a finite value of at least 0");
}

}  // namespace

Protocol::Protocol(Drive drive, std::vector<Knot> knots, std::string name, bool holds_forever)
    : drive_(drive),
      knots_(std::move(knots)),
      name_(std::move(name)),
      holds_forever_(holds_forever) {
  if (knots_.empty()) throw bad_input("protocol", "has no knots", "at least one");
  for (std::size_t i = 0; i < knots_.size(); ++i) {
    if (!std::isfinite(knots_[i].time_s) || !std::isfinite(knots_[i].value)) {
      throw bad_input("protocol", fmt::format("knot {} is not finite", i + 1));
    }
    if (!is_time_in_range(knots_[i].time_s)) {
      throw bad_input("protocol",
                      fmt::format("knot {} is at {} s", i + 1, shortest(knots_[i].time_s)),
                      kTimeRange);
    }
    if (i > 0 && knots_[i].time_s < knots_[i - 1].time_s) {
      throw bad_input("protocol", fmt::format("time goes back at knot {}", i + 1),
                      "times that do not decrease");
    }
    if (i > 1 && knots_[i].time_s == knots_[i - 2].time_s) {
      throw bad_input("protocol", fmt::format("three knots at {} s", shortest(knots_[i].time_s)),
                      "at most two, which make a jump");
    }
  }
}

double Protocol::peak() const noexcept {
  double peak = 0.0;
  for (const Knot& k : knots_) peak = std::max(peak, std::abs(k.value));
  return peak;
}

Protocol Protocol::scaled(double factor) const {
  Protocol other = *this;
  for (Knot& knot : other.knots_) knot.value *= factor;
  return other;
}

double value_at(const Protocol& protocol, double time_s) {
  const auto knots = protocol.knots();
  const auto after = std::upper_bound(knots.begin(), knots.end(), time_s,
                                      [](double t, const Knot& knot) { return t < knot.time_s; });
  if (after == knots.begin()) return 0.0;
  const Knot& from = *(after - 1);
  if (after == knots.end()) return from.value;
  return from.value +
         (after->value - from.value) * (time_s - from.time_s) / (after->time_s - from.time_s);
}

Protocol history_until(const Protocol& protocol, double time_s) {
  std::vector<Knot> knots;
  for (const Knot& knot : protocol.knots()) {
    if (knot.time_s <= time_s) knots.push_back(knot);
  }
  if (knots.empty() || knots.back().time_s < time_s) {
    knots.push_back({time_s, value_at(protocol, time_s)});
  }
  Protocol part(protocol.drive(), std::move(knots), protocol.name());
  part.set_equilibrium_at_start(protocol.equilibrium_at_start());
  return part;
}

Protocol step_and_hold(double depth_m, double hold_s) {
  if (std::isinf(hold_s)) return {Drive::displacement, {{0.0, depth_m}}, "step and hold", true};
  require_not_negative(hold_s, "hold", "s");
  return {Drive::displacement, {{0.0, depth_m}, {hold_s, depth_m}}, "step and hold"};
}

Protocol ramp_and_hold(double depth_m, double rate_m_per_s, double hold_s) {
  require_positive(depth_m, "depth", "m");
  require_positive(rate_m_per_s, "rate", "m/s");
  require_not_negative(hold_s, "hold", "s");
  const double ramp_s = depth_m / rate_m_per_s;
  std::vector<Knot> knots{{0.0, 0.0}, {ramp_s, depth_m}};
  if (hold_s > 0.0) knots.push_back({ramp_s + hold_s, depth_m});
  return {Drive::displacement, std::move(knots), "ramp and hold"};
}

Protocol creep(double load_N, double duration_s) {
  if (std::isinf(duration_s)) return {Drive::force, {{0.0, load_N}}, "creep", true};
  require_positive(duration_s, "duration", "s");
  return {Drive::force, {{0.0, load_N}, {duration_s, load_N}}, "creep"};
}

Protocol measured_history(Drive drive, std::span<const double> time_s,
                          std::span<const double> value) {
  if (time_s.size() != value.size()) {
    throw bad_input("measured history",
                    fmt::format("{} times and {} values", time_s.size(), value.size()),
                    "as many of one as of the other");
  }
  std::vector<Knot> knots(time_s.size());
  for (std::size_t i = 0; i < knots.size(); ++i) knots[i] = {time_s[i], value[i]};
  return {drive, std::move(knots), "measured history"};
}

}  // namespace tpm
