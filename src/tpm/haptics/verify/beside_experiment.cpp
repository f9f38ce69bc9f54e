// Declared in tpm/haptics/verify/verify.hpp.
// Why a session's force differs from a reading of the experiment that it repeats.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/haptics/verify/verify.hpp"
#include "tpmkit/servo_record.hpp"
#include "tpmkit/units.hpp"

namespace tpm::haptics {
namespace {

std::string limits_that_acted(std::uint32_t flags) {
  constexpr std::array<std::pair<std::uint32_t, const char*>, 6> kLimits{
      {{kForceLimited, "the session's force limit"},
       {kSaturated, "the motors' force"},
       {kSlipping, "the allowed rise of the force"},
       {kRampingIn, "the growth of forces after the start"},
       {kDamped, "damping"},
       {kBeyondModel, "the model's range"}}};
  std::string words;
  for (const auto& [flag, name] : kLimits) {
    if ((flags & flag) != 0) words += (words.empty() ? "" : ", ") + std::string(name);
  }
  return words;
}

std::string force_words(double force_N) {
  return sized_text(Dimension::force, force_N, 3);
}

}  // namespace

std::string cause_of_difference(const BesideExperiment& e, const std::string& material) {
  constexpr double kReached = 0.98;    // of the depth; less is named
  constexpr double kOfLoop = 0.05;     // of the difference; more from the loop is named
  constexpr double kMostAlike = 0.02;  // of the reading: nothing to explain
  const double gap_N = e.measured_N - e.commanded_N;
  if (std::abs(gap_N) <= kMostAlike * std::abs(e.measured_N)) return "the reading is met";
  std::string words;
  const auto add = [&words](const std::string& part) {
    words += (words.empty() ? "" : "; ") + part;
  };
  if (e.reached_m < kReached * e.depth_m) {
    add(fmt::format("the surface was pushed to {} of {}",
                    sized_text(Dimension::length, e.reached_m, 3),
                    sized_text(Dimension::length, e.depth_m, 3)));
  }
  const std::string acted = limits_that_acted(e.flags);
  if (!e.reference_N) {
    add(acted.empty() ? "no limit acted, and the full network has no equilibrium here"
                      : "limits acted: " + acted);
    return words;
  }
  const double loop_N = e.commanded_N - *e.reference_N;
  if (std::abs(loop_N) > kOfLoop * std::abs(gap_N)) {
    add(fmt::format("{} of it {}", force_words(std::abs(loop_N)),
                    acted.empty() ? "is the error of the model in the loop; no limit acted"
                                  : "is the loop's, where limits acted: " + acted));
  } else {
    add(acted.empty() ? "no limit acted" : "limits acted (" + acted + "), and changed little");
  }
  if (std::abs(e.measured_N - *e.reference_N) > kMostAlike * std::abs(e.measured_N)) {
    const double ratio = *e.reference_N / e.measured_N;
    add(fmt::format(
        "the full network answers {} to the same motion: the scene's organ and material{} are {} "
        "than the tissue measured",
        force_words(*e.reference_N), material.empty() ? "" : " (" + material + ")",
        ratio > 0.0 ? fmt::format("{} times {}", significant(ratio < 1.0 ? 1.0 / ratio : ratio, 2),
                                  ratio < 1.0 ? "softer" : "stiffer")
                    : std::string("softer")));
  }
  return words;
}

}  // namespace tpm::haptics
