#pragma once
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/haptics/session/session.hpp"

namespace tpm::haptics {

/// A condition of a rendering that is checked before a session.
enum class RenderingCondition { stability, device_stiffness, slew_limit, delay };
/// As a message begins: "stability", "stiffness limit of the device", "slew limit", "delay".
[[nodiscard]] std::string_view to_string(RenderingCondition condition);

/// Can this tissue be rendered on this device? Found before a session begins.
struct RenderingCheck {
  double rate_Hz = 0.0;
  double delay_s = 0.0;   ///< that counts, both paths of the device
  int delay_periods = 0;  ///< the same in whole periods, rounded up: for stability with the arm
  double longest_delay_s = std::numeric_limits<double>::infinity();  ///< that is guarded
  bool delay_measured = true;  ///< false: hardware that nobody has measured
  /// Why the delay counts as not measured although a file says it; empty otherwise.
  std::string delay_note;
  std::optional<double> delay_at_start_s;   ///< found by the check of one second; empty: none made
  double friction_N_s_per_m = 0.0;          ///< of the device that counts
  double stiffness_N_per_m = 0.0;           ///< largest instantaneous one up to the session's depth
  double equilibrium_share = 1.0;           ///< of it, of the equilibrium
  double depth_m = 0.0;                     ///< where that stiffness was found
  double passive_friction_N_s_per_m = 0.0;  ///< K (T/2 + delay), for every passive operator
  double passive_N_per_m = 0.0;  ///< largest stiffness that is passive with this friction
  double stable_N_per_m = 0.0;   ///< largest that is stable with the arm of the operator
  double spectral_radius = 0.0;  ///< of device, arm and contact over a period; stable below 1
  double largest_N_per_m = 0.0;  ///< that the device's maker recommends
  double hands_N_per_m = 0.0;    ///< largest that is safe in six hands, see six_hands.hpp
  std::string stable_hands;      ///< of those six, with which the linear loop is stable
  double recovery_s = 0.0;       ///< time constant in which a free surface recovers
  double encoder_step_m = 0.0;   ///< of the device, known or assumed
  double rise_N = 0.0;           ///< by which the session lets a force rise within a period
  std::vector<Remark> remarks;

  [[nodiscard]] bool passive() const { return stiffness_N_per_m <= passive_N_per_m; }
  /// The linear loop grows.
  [[nodiscard]] bool unstable() const {
    return spectral_radius >= 1.0 || stiffness_N_per_m > stable_N_per_m;
  }
  /// With margin: the boundary is that of small motions, and impacts and limits reduce it.
  [[nodiscard]] bool stable() const {
    return !unstable() && stiffness_N_per_m <= kRoom * stable_N_per_m;
  }
  [[nodiscard]] bool within_device() const { return stiffness_N_per_m <= largest_N_per_m; }
  /// A step of the encoder changes the force by less than the force may rise within a period. Else
  /// the model's tool slips back at every step towards the tissue and does not come forward again
  /// at those away from it: the force rendered is too small, and never at rest.
  [[nodiscard]] bool follows_encoder() const {
    return stiffness_N_per_m * encoder_step_m <= rise_N * (1.0 + 1e-12);
  }
  /// None of six hands receives more energy than it may, also if the rendering is not passive.
  [[nodiscard]] bool safe_in_hands() const { return stiffness_N_per_m <= hands_N_per_m; }
  /// Of hardware: gate and supervisor were tried for a delay as long as this, see six_hands.hpp.
  [[nodiscard]] bool delay_is_guarded() const { return delay_s <= longest_delay_s * (1.0 + 1e-12); }
  [[nodiscard]] bool acceptable() const { return refusal(false).empty(); }
  /// Only stability, of the arm or of six hands, may be in the way: what refusal(true) leaves out.
  [[nodiscard]] bool acceptable_if_unstable() const {
    return within_device() && follows_encoder() && delay_is_guarded();
  }
  /// Why it is refused, one line; empty: it is not.
  /// @param accept_unstable instability is no reason, with the operator's arm or with six hands;
  ///        each other reason still is
  [[nodiscard]] std::string refusal(bool accept_unstable) const;
  /// The condition that is not met; empty: none.
  [[nodiscard]] std::optional<RenderingCondition> unmet(bool accept_unstable) const;
  static constexpr double kRoom = 0.8;  ///< share of stable_N_per_m that is allowed
  /// One line: passive, stable, too little margin, or why not.
  [[nodiscard]] std::string verdict() const;
};

/// The change with which a condition is met.
[[nodiscard]] std::string_view remedy(RenderingCondition condition);

/// The stiffness is that of the model's own steps: pushed to four depths up to the session's
/// deepest, then a little further within one period; of a tool that moves in space the largest of
/// all directions. Stability is that of the linear, two-sided
/// loop with the arm of the session's simulated operator; the slip element only ever takes energy
/// and is left out. The model is at rest afterwards.
///
/// Delay and friction that count:
///   - hardware: what was measured on it (device_file.hpp), the largest delay seen plus a period;
///     if nobody measured its delay, 20 ms and no friction, also where a friction was measured; and
///     in either case the larger delay and the smaller friction of these and of what the session
///     states;
///     A delay measured above kLongestDelay_s (six_hands.hpp) is refused;
///   - the simulated device: what the session states; a simulated plugin: what it says.
/// @param limits of the device
[[nodiscard]] RenderingCheck check_rendering(const HilSession& session, ContactModel& model,
                                             const LoopModel& loop, const DeviceLimits& limits);
/// @param kind of device, see limits_of()
[[nodiscard]] RenderingCheck check_rendering(const HilSession& session, ContactModel& model,
                                             const LoopModel& loop, std::string_view kind);

[[nodiscard]] Json to_json(const RenderingCheck& check);

}  // namespace tpm::haptics
