#include "tpm/haptics/session/device_identification.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/session/handle_fit.hpp"

namespace tpm::haptics {
namespace {

constexpr double kCentring_N_per_m = 15.0;
constexpr double kShortestBit_s = 0.040, kLongestBit_s = 0.120;
constexpr std::size_t kFewestWindows = 40, kFewestEdges = 10;
constexpr double kLeastExplained = 0.9, kFewestSteps = 20.0;

/// Neighbouring windows overlap by half: twice the variance for as many independent ones.
double error_of(const HandleSolution& s, Eigen::Index i) {
  constexpr double kOverlap = 2.0;
  return std::sqrt(kOverlap * s.spread(i, i));
}
constexpr double kBothSides = 1.96;
constexpr double kSums = 0.98;  // sums and signs over samples are not quite the integrals

double coulomb_margin_N(const HandleSolution& s) {
  return (1.0 - kSums) * std::abs(s.value[2]) + kBothSides * error_of(s, 2);
}

enum class Handle { free, held, not_known };

/// The handle, free and with little friction; otherwise notes the obstacle.
Handle handle_of(DeviceIdentification& found, const HandleSolution& s) {
  constexpr double kLeastHeld_N_per_m = 3.0, kSurely = 3.0, kMostCoulomb_N = 0.5 * kEdge_N;
  constexpr double kMostMargin_N = 0.025;
  found.held_N_per_m = s.value[3];
  const double margin_N = coulomb_margin_N(s), rubs_N = s.value[2] + margin_N;
  const bool told = margin_N <= kMostMargin_N;  // not if the sign of the motion was never known
  if (told && rubs_N > kMostCoulomb_N) {
    found.not_identified.push_back(
        {"coulomb_friction",
         fmt::format("delay, friction, mass: Coulomb friction of up to {} N; at most {} N let the "
                     "handle follow edges of {} N",
                     significant(rubs_N, 3), kMostCoulomb_N, kEdge_N)});
    return Handle::not_known;
  }
  // The centring spring is a part of the forces: what is left of stiffness is a hand's.
  const bool free =
      std::abs(found.held_N_per_m) < std::max(kLeastHeld_N_per_m, kBothSides * error_of(s, 3));
  if (!free && found.held_N_per_m > 0.0) {
    // The damping of a hand is not friction of the device, and the gate would count it.
    found.not_identified.push_back(
        {"held",
         fmt::format("delay, friction: something holds the handle with {} N/m; let go of it",
                     significant(found.held_N_per_m, 3))});
    return Handle::held;
  }
  if (!told) {
    found.not_identified.push_back(
        {"friction_untold",
         "delay, friction, mass: the motion does not tell Coulomb friction; the encoder is too "
         "coarse, or friction stops the handle"});
    return Handle::not_known;
  }
  if (!free || s.value[1] + kSurely * error_of(s, 1) < 0.0) {
    found.not_identified.push_back(
        {"moved", "delay, friction, mass: something else moves the handle; let go of it"});
    return Handle::not_known;
  }
  return Handle::free;
}

void find_delay(DeviceIdentification& found, const std::vector<double>& delays) {
  const auto count = static_cast<double>(delays.size());
  double sum = 0.0, squares = 0.0;
  for (const double d : delays) sum += d;
  const double mean = sum / count;
  for (const double d : delays) squares += (d - mean) * (d - mean);
  found.edges = static_cast<int>(delays.size());
  found.delay_mean_s = std::max(0.0, mean);
  found.delay_jitter_s = std::sqrt(squares / (count - 1.0));
  found.delay_largest_s = std::max({*found.delay_mean_s, *found.delay_jitter_s,
                                    *std::max_element(delays.begin(), delays.end())});
}

/// The limit of viscous friction is that of 99 %: errors of friction that rubs are not quite those
/// of least squares, and simulated devices need this for 95 %
/// (tests/haptics/test_device_identification.cpp).
void find_friction(DeviceIdentification& found, const HandleSolution& s) {
  constexpr double kOneSided = 2.33;
  found.viscous_N_s_per_m = s.value[1];
  found.viscous_lower_95_N_s_per_m = std::clamp(kSums * s.value[1] - kOneSided * error_of(s, 1),
                                                0.0, kMostHandleFriction_N_s_per_m);
  const double coulomb_N = s.value[2], margin_N = coulomb_margin_N(s);
  found.coulomb_low_N = std::max(0.0, coulomb_N - margin_N);
  found.coulomb_high_N = std::max(0.0, coulomb_N) + margin_N;
}

void find_mass(DeviceIdentification& found, const DelayFit& fit, bool free, double step_m) {
  constexpr double kWithin = 0.1, kMostStep_m = 10.5e-6, kMostCoulomb_N = 0.05;
  constexpr double kExplainedByHand = 0.98;
  if (!free && !(fit.explained > kExplainedByHand)) {
    found.not_identified.push_back(
        {"held_not_spring", "mass: whatever holds the handle is more than a spring"});
    return;
  }
  const HandleSolution& s = fit.solution;
  const double mass_kg = s.value[0];
  const double margin_kg = std::max(kWithin * mass_kg, kBothSides * error_of(s, 0));
  found.mass_kg = mass_kg;
  found.mass_certain = free && step_m <= kMostStep_m && s.value[2] <= kMostCoulomb_N &&
                       kBothSides * error_of(s, 0) < kWithin * mass_kg;
  found.mass_low_kg = free ? std::max(0.0, mass_kg - margin_kg) : 0.0;
  found.mass_high_kg = mass_kg + margin_kg;
}

}  // namespace

std::optional<double> checked_delay_s(const std::vector<IdentificationSample>& samples,
                                      double period_s) {
  const auto [half, margin] = window_lengths(period_s);
  const HandleTimeline line = timeline_of(samples, period_s);
  if (line.size() < 2 * margin + half) return std::nullopt;
  const double step_m = step_of(samples).value_or(noise_of(line) * std::sqrt(12.0));
  const double stroke_m = stroke_of(samples);
  if (!(stroke_m >= kFewestSteps * step_m) || stroke_m <= 0.0) return std::nullopt;
  const HandleWindows windows =
      windows_of(line, half, margin, std::max<std::size_t>(1, half / 8), 2.0 * step_m);
  if (windows.centre.size() < kFewestWindows) return std::nullopt;
  const DelayFit fit = fit_delay(line, windows, half);
  if (!(fit.explained > kLeastExplained) || !(fit.solution.value[0] > 0.0)) return std::nullopt;
  const std::vector<double> delays = edge_delays(line, fit, {half, margin}, 2.0 * step_m);
  if (delays.empty()) return fit.delay_s;
  // Edges of a constant delay differ by noise of up to the resolution, also if a hand holds the
  // handle.
  const double largest_s = *std::max_element(delays.begin(), delays.end());
  return largest_s - fit.delay_s > 0.5 * period_s ? largest_s : fit.delay_s;
}

IdentifyingForce::IdentifyingForce(double period_s, std::uint64_t seed) noexcept
    : period_s_(period_s), state_(seed * 2862933555777941757ULL + 3037000493ULL) {}

double IdentifyingForce::next_N(double at_m) noexcept {
  if (--left_ <= 0) {
    // An irregular time until the next edge.
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    const double even = static_cast<double>(state_ >> 11U) / 9007199254740992.0;
    left_ =
        static_cast<int>((kShortestBit_s + (kLongestBit_s - kShortestBit_s) * even) / period_s_);
    sign_ = -sign_;
  }
  return std::clamp(sign_ * kEdge_N - kCentring_N_per_m * at_m, -kMostIdentifyingForce_N,
                    kMostIdentifyingForce_N);
}

namespace {

/// Why forces and motion tell nothing of the handle; empty if they do.
std::optional<Remark> unusable_motion(const std::vector<IdentificationSample>& samples,
                                      double stroke_m, double step_m) {
  const auto saturated = std::ranges::count_if(samples, &IdentificationSample::saturated);
  if (saturated > 0) {
    return Remark{"saturated",
                  fmt::format("delay, friction, mass: the motors were saturated in {} of {} "
                              "cycles, so that the force on the handle is not known",
                              saturated, samples.size())};
  }
  if (stroke_m >= kFewestSteps * step_m && stroke_m > 0.0) return std::nullopt;
  return Remark{"small_stroke", fmt::format("delay, friction, mass: the stroke of {} mm is below "
                                            "{} steps of the encoder",
                                            significant(1e3 * stroke_m, 3), kFewestSteps)};
}

}  // namespace

DeviceIdentification identify_device(const std::vector<IdentificationSample>& samples,
                                     double period_s) {
  DeviceIdentification found;
  found.resolution_s = 0.5 * period_s;
  const auto [half, margin] = window_lengths(period_s);
  const HandleTimeline line = timeline_of(samples, period_s);
  if (line.size() < 2 * margin + half) {
    found.not_identified.push_back({"too_short", "everything: the measurement is too short"});
    return found;
  }
  found.stroke_m = stroke_of(samples);
  found.encoder_step_m = step_of(samples);
  found.stalls = line.stalls;
  found.stalled_s = line.stalled_s;
  found.noise_m = noise_of(line);
  const double step_m = found.encoder_step_m.value_or(found.noise_m * std::sqrt(12.0));
  if (!found.encoder_step_m) {
    found.not_identified.push_back(
        {"no_common_step", "encoder step: changes of the position have no common step"});
  }
  if (std::optional<Remark> why = unusable_motion(samples, found.stroke_m, step_m)) {
    found.not_identified.push_back(*std::move(why));
    return found;
  }
  const double least_m = 2.0 * step_m;
  const HandleWindows windows = windows_of(line, half, margin, half, least_m);
  if (windows.centre.size() < kFewestWindows) {
    found.not_identified.push_back(
        {"stalled", fmt::format("delay, friction, mass: the loop or the device stalled too often: "
                                "{} of {} windows of {} "
                                "ms are whole, and {} are needed (tpm hil check)",
                                windows.centre.size(), windows.tried,
                                significant(1e3 * kVelocityWindow_s, 3), kFewestWindows)});
    return found;
  }
  const DelayFit fit = fit_delay(line, windows, half);
  constexpr double kLeastExplainedAlone = 0.95;  // in a second of the check it may be less
  if (!(fit.explained > kLeastExplainedAlone) || !(fit.solution.value[0] > 0.0)) {
    found.not_identified.push_back(
        {"unexplained", fmt::format("delay, friction, mass: the motion follows from the forces to "
                                    "{} % only; something else "
                                    "moves the handle, or friction holds it",
                                    significant(100.0 * std::max(fit.explained, 0.0), 2))});
    return found;
  }
  const std::vector<double> delays = edge_delays(line, fit, {half, margin}, least_m);
  if (delays.size() < kFewestEdges) {
    found.not_identified.push_back(
        {"stalled_at_edges",
         "delay: the loop or the device stalled at all but a few edges of the force (tpm hil "
         "check)"});
    return found;
  }
  const Handle handle = handle_of(found, fit.solution);
  if (handle == Handle::free) {
    find_delay(found, delays);
    find_friction(found, fit.solution);
  }
  if (handle != Handle::not_known) find_mass(found, fit, handle == Handle::free, step_m);
  return found;
}

}  // namespace tpm::haptics
