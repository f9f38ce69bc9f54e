#pragma once
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace tpm {

/// The imposed quantity; the response is the other one.
enum class Drive {
  displacement,  ///< indentation depth in m; the response is the contact force in N
  force,         ///< load in N; the response is the indentation depth in m
};

/// A point of the imposed history.
struct Knot {
  double time_s;
  double value;  ///< m or N, after the drive
};

/// The imposed history: piecewise linear between knots, at rest (value 0) before the first one.
/// Two knots at one time are a jump; a first knot with value other than 0 is a jump from rest.
class Protocol {
 public:
  /// Throws Error(bad_input) unless there is at least one knot, all finite, times within 1e15 s
  /// of 0 and not decreasing, and no more than two knots at one time.
  /// @param holds_forever the last value remains for ever. Times up to and including infinity are
  ///        allowed; infinity means full relaxation
  Protocol(Drive drive, std::vector<Knot> knots, std::string name = "history",
           bool holds_forever = false);

  [[nodiscard]] Drive drive() const noexcept { return drive_; }
  [[nodiscard]] std::span<const Knot> knots() const noexcept { return knots_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] double start_s() const noexcept { return knots_.front().time_s; }
  [[nodiscard]] double end_s() const noexcept {
    return holds_forever_ ? std::numeric_limits<double>::infinity() : knots_.back().time_s;
  }
  /// Largest absolute imposed value.
  [[nodiscard]] double peak() const noexcept;

  /// The same history with every value times a factor.
  [[nodiscard]] Protocol scaled(double factor) const;

  /// True if the tissue is in equilibrium with the first value at the first knot (a preload),
  /// instead of jumping to it from 0.
  [[nodiscard]] bool equilibrium_at_start() const noexcept { return equilibrium_at_start_; }
  void set_equilibrium_at_start(bool equilibrium) noexcept { equilibrium_at_start_ = equilibrium; }

 private:
  Drive drive_;
  std::vector<Knot> knots_;
  std::string name_;
  bool holds_forever_;
  bool equilibrium_at_start_ = false;
};

/// The imposed value at a time not before the first knot. At a jump it is the value after the jump,
/// beyond the last knot the last value.
[[nodiscard]] double value_at(const Protocol& protocol, double time_s);

/// The history up to a finite time from the first knot on, all jumps at that time included.
[[nodiscard]] Protocol history_until(const Protocol& protocol, double time_s);

/// Jump to a depth at t = 0, held for `hold_s` (may be infinite).
[[nodiscard]] Protocol step_and_hold(double depth_m, double hold_s);

/// From rest to `depth_m` (> 0) at constant speed `rate_m_per_s` (> 0), then held for `hold_s`
/// (>= 0). The ramp ends at depth / rate.
[[nodiscard]] Protocol ramp_and_hold(double depth_m, double rate_m_per_s, double hold_s);

/// Constant load from t = 0 on, for `duration_s` (may be infinite).
[[nodiscard]] Protocol creep(double load_N, double duration_s);

/// A measured history, linear between its samples. Both spans of one length, times increasing.
[[nodiscard]] Protocol measured_history(Drive drive, std::span<const double> time_s,
                                        std::span<const double> value);

}  // namespace tpm
