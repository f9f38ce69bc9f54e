#include "tpm/haptics/device/device_keys.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/keys/more_types.hpp"
#include "tpm/haptics/device/device_limits.hpp"

namespace tpm::haptics {
namespace {

constexpr auto kKnownByWords =
    std::to_array<Word<KnownBy>>({{KnownBy::measured, "measured"}, {KnownBy::assumed, "assumed"}});

template <class K>
Key<K> known_by() {
  return required(key("provenance", &K::provenance, word(kKnownByWords),
                      "measured: on this device; assumed: taken over from elsewhere"));
}

ValueType<std::vector<double>> interval_type() {
  return list(number(), {.fewest = 2, .most = 2});
}

/// Of a limit that does not stand in the block.
std::optional<Fault> stray_provenance(const DeviceLimitKeys& limits) {
  const std::pair<std::string_view, bool> stated[] = {
      {"force_N", limits.force_N.has_value()},
      {"reach_m", limits.reach_m.has_value()},
      {"stiffness_N_per_m", limits.stiffness_N_per_m.has_value()},
      {"damping_N_s_per_m", limits.damping_N_s_per_m.has_value()},
      {"slew_N_per_s", limits.slew_N_per_s.has_value()},
      {"least_ramp_in_s", limits.least_ramp_in_s.has_value()}};
  if (!limits.provenance) return std::nullopt;
  for (const auto& [name, words] : *limits.provenance) {
    const bool there =
        std::any_of(std::begin(stated), std::end(stated),
                    [&, &key = name](const auto& one) { return one.first == key && one.second; });
    if (!there) return Fault{"provenance", "of '" + printable(name) + "', which is not stated"};
  }
  return std::nullopt;
}

const Block<DeviceLimitKeys>& device_limits_block() {
  using K = DeviceLimitKeys;
  static const Block<K> block(
      "device_limits",
      "what may be asked of the device. In the file of a device that the program ships, or knows "
      "itself, "
      "in place of those of the kind: none may be above them",
      {key("force_N", &K::force_N, number(kAboveZero), "largest force"),
       key("reach_m", &K::reach_m, number(kAboveZero), "radius of the workspace"),
       key("stiffness_N_per_m", &K::stiffness_N_per_m, number(kAboveZero),
           "largest stiffness that is rendered"),
       key("damping_N_s_per_m", &K::damping_N_s_per_m, number(kZeroOrMore),
           "largest damping that the passivity controller adds"),
       key("slew_N_per_s", &K::slew_N_per_s, number(kAboveZero), "fastest rise of the force"),
       key("least_ramp_in_s", &K::least_ramp_in_s, number({.least = 0.1}),
           "shortest time in which the limit of the force grows to its value"),
       key("provenance", &K::provenance, map_of(text(1)),
           "of each of these numbers, by its key: assumed or measured, and from where")},
      {{"provenance of limits that stand beside it", stray_provenance}});
  return block;
}

/// Of a measurement: its mean and its spread are not above its largest value.
std::optional<Fault> below_largest(const DeviceDelayKeys& delay) {
  const auto above = [&delay](const std::optional<double>& part, const char* name) {
    if (!part || *part <= delay.largest_s) return std::optional<Fault>();
    return std::optional(Fault{name, fmt::format("{} is above largest_s, {}", shortest(*part),
                                                 shortest(delay.largest_s))});
  };
  const auto mean = above(delay.mean_s, "mean_s");
  return mean ? mean : above(delay.jitter_s, "jitter_s");
}

/// The limit of 95 % is a lower one. An estimate may be negative, the limit is 0 then.
std::optional<Fault> below_estimate(const ViscousFrictionKeys& friction) {
  const double estimate = friction.estimate_N_s_per_m.value_or(friction.lower_95_N_s_per_m);
  if (friction.lower_95_N_s_per_m <= std::max(0.0, estimate)) return std::nullopt;
  return Fault{"lower_95_N_s_per_m",
               fmt::format("{} is above estimate_N_s_per_m, {}",
                           shortest(friction.lower_95_N_s_per_m), shortest(estimate))};
}

std::optional<Fault> not_an_interval(const std::optional<std::vector<double>>& interval,
                                     const char* name) {
  if (!interval || (interval->front() >= 0.0 && interval->front() <= interval->back())) {
    return std::nullopt;
  }
  return Fault{name,
               fmt::format("is {} to {}", shortest(interval->front()), shortest(interval->back()))};
}

std::optional<Fault> mass_outside(const MovingMassKeys& mass) {
  if (const auto fault = not_an_interval(mass.interval_kg, "interval_kg")) return fault;
  if (!mass.mass_kg || !mass.interval_kg) return std::nullopt;
  if (*mass.mass_kg >= mass.interval_kg->front() && *mass.mass_kg <= mass.interval_kg->back()) {
    return std::nullopt;
  }
  return Fault{"mass_kg", fmt::format("{} lies outside interval_kg", shortest(*mass.mass_kg))};
}

const Block<DeviceDelayKeys>& delay_block() {
  using K = DeviceDelayKeys;
  static const Block<K> block(
      "device_delay",
      "from a position to the force that answers it, both paths together, without the hold of a "
      "command",
      {known_by<K>(), key("mean_s", &K::mean_s, number(kZeroOrMore), "mean"),
       required(key("largest_s", &K::largest_s, number({.least = 0.0, .most = 1.0}),
                    "the largest one seen")),
       key("jitter_s", &K::jitter_s, number(kZeroOrMore), "standard deviation"),
       key("resolution_s", &K::resolution_s, number(kZeroOrMore),
           "half a period of the loop that measured it"),
       key("hold", &K::hold, text(1),
           "in words, that the hold of a command is not in these numbers"),
       key("tries", &K::tries, whole<int>(1, 1e9), "how often it was measured")},
      {{"a mean and a spread that are not above the largest delay", below_largest}});
  return block;
}

const Block<ViscousFrictionKeys>& viscous_block() {
  using K = ViscousFrictionKeys;
  static const Block<K> block(
      "viscous_friction", "viscous friction of the device",
      {known_by<K>(),
       required(key("lower_95_N_s_per_m", &K::lower_95_N_s_per_m,
                    number({.least = 0.0, .most = kMostHandleFriction_N_s_per_m}),
                    "the friction is larger with 95 %; Coulomb friction is not counted")),
       key("estimate_N_s_per_m", &K::estimate_N_s_per_m, number(), "best estimate")},
      {{"a lower limit that is not above the estimate", below_estimate}});
  return block;
}

const Block<EncoderStepKeys>& encoder_block() {
  using K = EncoderStepKeys;
  static const Block<K> block(
      "encoder_step", "resolution of positions",
      {known_by<K>(),
       required(key("step_m", &K::step_m, number({.least = 0.0, .most = 1e-3, .above = true}),
                    "of a position")),
       key("noise_m", &K::noise_m, number(kZeroOrMore), "standard deviation of a position")});
  return block;
}

const Block<CoulombFrictionKeys>& coulomb_block() {
  using K = CoulombFrictionKeys;
  static const Block<K> block(
      "coulomb_friction", "friction that does not depend on speed",
      {known_by<K>(), key("interval_N", &K::interval_N, interval_type(), "lower and upper bound")},
      {{"an interval from its lower to its upper bound, both at least 0",
        [](const K& coulomb) { return not_an_interval(coulomb.interval_N, "interval_N"); }}});
  return block;
}

const Block<MovingMassKeys>& mass_block() {
  using K = MovingMassKeys;
  static const Block<K> block(
      "moving_mass", "mass that a hand moves",
      {known_by<K>(), key("mass_kg", &K::mass_kg, number(kAboveZero), "where it is known to 10 %"),
       key("interval_kg", &K::interval_kg, interval_type(), "lower and upper bound")},
      {{"an interval from its lower to its upper bound, both at least 0, that holds the mass",
        mass_outside}});
  return block;
}

ValueType<Json> measurement_type() {
  ValueType<Json> type = any("");
  type.form = shared({.type = Form::Type::map, .item = any("").form});
  return type;
}

}  // namespace

const Block<DeviceKeys>& device_block() {
  using K = DeviceKeys;
  static const Block<K> block(
      "device", "",
      {with_example(required(key("device", &K::device, text(1),
                                 "kind of the device, as tpm hil run --device takes it")),
                    "omega7"),
       key("name", &K::name, text(), "as its maker writes it"),
       key("description", &K::description, text(), "what else is to be said of it"),
       key("serial", &K::serial, text(),
           "of the device that was measured; a session on another one is refused, and so is one on "
           "a device that says a serial while a file with something measured has none"),
       key("limits", &K::limits, device_limits_block().type(), "what may be asked of it"),
       key("delay", &K::delay, delay_block().type(), "from a position to its force"),
       key("viscous_friction", &K::viscous_friction, viscous_block().type(),
           "what it takes up by itself"),
       key("encoder_step", &K::encoder_step, encoder_block().type(), "of its positions"),
       key("coulomb_friction", &K::coulomb_friction, coulomb_block().type(),
           "recorded; it counts as no damping"),
       key("moving_mass", &K::moving_mass, mass_block().type(), "recorded"),
       key("not_identified", &K::not_identified, list(remark()),
           "what could not be measured, and why"),
       key("measurement", &K::measurement, measurement_type(), "when, with what, at which rate")});
  return block;
}

const FileKind& device_kind() {
  static const FileKind kind{
      "device", "What is known of a haptic device",
      "Limits and measured numbers of one device: tpm hil identify writes it, tpm hil run "
      "--device-file reads it, and configs/devices holds those of devices that nobody here has "
      "tried. SI units. A delay or friction that is assumed is recorded and not counted",
      device_block().form()};
  return kind;
}

}  // namespace tpm::haptics
