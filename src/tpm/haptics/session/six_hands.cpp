#include "tpm/haptics/session/six_hands.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string_view>
#include <vector>

namespace tpm::haptics {

double largest_stiffness_for_hands(double delay_s, double friction_N_s_per_m, double period_s) {
  constexpr double kInExcess_N_s_per_m = 1.0;
  return (kInExcess_N_s_per_m + friction_N_s_per_m) / (0.5 * period_s + delay_s);
}

PlantSettings plant_with_hand(const SafeHand& hand, double friction_N_s_per_m) {
  PlantSettings plant;
  constexpr double kOfDevice = 0.5;  // of the mass: only the sum matters
  plant.mass_kg = kOfDevice * hand.mass_kg;
  plant.arm.mass_kg = hand.mass_kg - plant.mass_kg;
  plant.damping_N_s_per_m = friction_N_s_per_m;
  plant.arm.damping_N_s_per_m = hand.damping_N_s_per_m;
  plant.arm.stiffness_N_per_m = hand.stiffness_N_per_m;
  return plant;
}

std::string hands_that_are_stable(const RenderedContact& contact, double friction_N_s_per_m) {
  std::vector<std::string_view> names;
  for (const SafeHand& hand : kSafeHands) {
    const PlantSettings plant = plant_with_hand(hand, friction_N_s_per_m);
    if (loop_spectral_radius(contact, plant) < 1.0) names.emplace_back(hand.name);
  }
  if (names.empty()) return "none";
  if (names.size() == kSafeHands.size()) return "all six";
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace tpm::haptics
