// Declared in tpm/fit/predict/budget_parts.hpp.
// The stages of one contact.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/contact/law_contact.hpp"
#include "tpm/fit/predict/budget_parts.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

std::vector<double> to_vector(const Eigen::VectorXd& values) {
  return {values.begin(), values.end()};
}

/// Linear between periods; before the first the first.
double force_at(const SteppedForces& forces, double time_s) {
  const double place = std::max((time_s - forces.start_s) / forces.period_s, 0.0);
  const std::size_t last = forces.force_N.size() - 1;
  const auto k = std::min(static_cast<std::size_t>(place), last);
  if (k == last) return forces.force_N[last];
  const double along = place - static_cast<double>(k);
  return forces.force_N[k] + along * (forces.force_N[k + 1] - forces.force_N[k]);
}

/// The law in the loop; it begins relaxed under its first depth, as a fit takes a recording.
SteppedForces law_forces(const LawFile& law, const Protocol& motion, double period_s,
                         double encoder_step_m) {
  LawContact contact(law, {.period_s = period_s,
                           .longest_s = motion.end_s() - motion.start_s(),
                           .deepest_m = motion.peak(),
                           .deepest_valid_m = valid_depth_m(law, motion.peak())});
  if (motion.equilibrium_at_start()) {
    const double depth = motion.knots().front().value;
    const LawModel model(law.spec);
    contact.take_over(depth, model.at(law.values, nullptr).kernel.value(std::max(depth, 0.0)));
  }
  return stepped_forces(motion, period_s, encoder_step_m, [&](double depth) {
    return std::max(-contact.step(Eigen::Vector3d(0.0, 0.0, depth)).force_N.z(), 0.0);
  });
}

}  // namespace

namespace {

void require_contact_law(const LawFile& law) {
  const bool contact =
      law.spec.drive == Quantity::indentation_depth && law.spec.response == Quantity::contact_force;
  const bool steps = law.spec.fractional == Fractional::none;
  if (contact && steps) return;
  throw bad_input(fmt::format("law {}", law_name(law.spec)), "has no budget",
                  "a contact force over a depth, with branches");
}

/// The stages after `law` of one contact.
std::vector<BudgetStage> loop_stages(const LawFile& law, const Protocol& motion,
                                     const std::vector<double>& times_s,
                                     const BudgetDevice& device) {
  require_possible(device);
  std::vector<BudgetStage> stages;
  add_device_stages(stages, law_forces(law, motion, device.period_s, 0.0),
                    law_forces(law, motion, device.period_s, device.encoder_step_m), times_s,
                    device,
                    {"loop",
                     fmt::format("the update of {} ms", significant(1e3 * device.period_s, 3)),
                     "integration",
                     BudgetKind::computation,
                     {}});
  return stages;
}

/// How a prediction is asked for the random part.
PredictionOptions random_part_options(const BudgetOptions& options) {
  PredictionOptions prediction;
  prediction.samples = options.samples;
  prediction.seed = options.seed;
  prediction.level = options.level;
  return prediction;
}

}  // namespace

void add_random_part(ErrorBudget& budget, const LawPrediction& p) {
  BudgetRandomPart random;
  random.samples = p.samples;
  random.level = p.level;
  for (std::size_t i = 0; i < p.time_s.size(); ++i) {
    const bool counts = !p.recording || p.recording->in_window[i];
    if (!counts || !std::isfinite(p.response[i])) continue;
    random.largest =
        std::max(random.largest, 0.5 * (p.mean_upper[i] - p.mean_lower[i]) / budget.peak_N);
  }
  budget.random = random;
  for (const std::string& flag : p.flags) budget.flags.push_back(flag);
}

void add_random_part(ErrorBudget& budget, const LawFile& law, const Protocol& motion,
                     const BudgetOptions& options) {
  if (law.uncertainty) {
    add_random_part(budget, predict_law(law, motion, budget.time_s, random_part_options(options)));
  } else {
    budget.flags.push_back("the law file carries no uncertainty of a fit: no random part");
  }
}

BudgetStage law_stage(const LawFile& law, const Protocol& motion,
                      const std::vector<double>& times_s) {
  return {"law", fmt::format("{}, exact along the motion", law_name(law.spec)), "law",
          BudgetKind::data,
          to_vector(LawModel(law.spec).respond(motion, times_s, law.values, Want::values).value)};
}

SteppedForces stepped_forces(const Protocol& motion, double period_s, double encoder_step_m,
                             const std::function<double(double)>& step) {
  SteppedForces forces{motion.start_s(), period_s, {}};
  const double length_s = motion.end_s() - motion.start_s();
  const auto count = static_cast<std::size_t>(std::ceil(length_s / period_s * (1.0 - 1e-12))) + 1;
  const auto knots = motion.knots();
  std::size_t knot = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double t = std::min(motion.start_s() + static_cast<double>(k) * period_s, motion.end_s());
    while (knot + 1 < knots.size() && knots[knot + 1].time_s <= t) ++knot;
    double depth = knots[knot].value;
    if (knot + 1 < knots.size()) {
      const Knot &a = knots[knot], &b = knots[knot + 1];
      depth += (b.value - a.value) * (t - a.time_s) / (b.time_s - a.time_s);
    }
    if (encoder_step_m > 0.0) depth = encoder_step_m * std::round(depth / encoder_step_m);
    forces.force_N.push_back(step(depth));
  }
  return forces;
}

void add_device_stages(std::vector<BudgetStage>& stages, const SteppedForces& smooth,
                       const SteppedForces& quantised, const std::vector<double>& times_s,
                       const BudgetDevice& device, const BudgetStage& loop) {
  const auto late = [&](const SteppedForces& forces, double late_s) {
    return mapped<double>(times_s, [&](double t) { return force_at(forces, t - late_s); });
  };
  const double late_s = device.delay_periods * device.period_s;
  stages.push_back(loop);
  stages.back().force_N = late(smooth, 0.0);
  stages.push_back(
      {"encoder",
       fmt::format("positions in steps of {} um", significant(1e6 * device.encoder_step_m, 3)),
       "quantisation", BudgetKind::device, late(quantised, 0.0)});
  stages.push_back({"delayed", fmt::format("forces {} periods late", device.delay_periods), "delay",
                    BudgetKind::device, late(quantised, late_s)});
  stages.push_back({"hand", "each force kept until the next, at the end of its period", "period",
                    BudgetKind::device, late(quantised, late_s + device.period_s)});
}

void require_possible(const BudgetDevice& device) {
  if (device.period_s > 0.0 && device.encoder_step_m >= 0.0 && device.delay_periods >= 0) return;
  throw bad_input("budget", "a period, encoder step or delay out of range",
                  "a period above 0, the others 0 or more");
}

ErrorBudget contact_budget(const LawFile& law, const Protocol& motion, std::vector<double> times_s,
                           const BudgetOptions& options) {
  require_contact_law(law);
  if (motion.drive() != Drive::displacement) {
    throw bad_input("budget", "a protocol of loads", "one of depths");
  }
  const LawFile plain = at_surface(law);
  std::vector<BudgetStage> stages{law_stage(plain, motion, times_s)};
  std::ranges::move(loop_stages(plain, motion, times_s, options.device),
                    std::back_inserter(stages));
  ErrorBudget budget = budget_of(std::move(times_s), std::move(stages));
  budget.title = fmt::format("{} at one contact", law_name(law.spec));
  add_random_part(budget, plain, motion, options);
  conclude(budget);
  return budget;
}

ErrorBudget contact_budget(const LawFile& law, const PreparedRecording& recording,
                           const BudgetOptions& options) {
  require_contact_law(law);
  const Recording& r = recording.recording;
  // The recording's own contact and offset, found as a prediction finds them. They scatter with
  // the material: alone, the material would scatter far more than the force does.
  const LawPrediction placed = predict_recording(law, recording, random_part_options(options));
  std::vector<double> depth = r.drive;
  for (double& d : depth) d -= placed.contact;
  Protocol motion = measured_history(Drive::displacement, r.time_s, depth);
  motion.set_equilibrium_at_start(true);
  BudgetStage readings{"recording", "the readings less their offset", "", BudgetKind::data, {}};
  std::vector<double> times_s;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    if (r.time_s[i] < recording.from_s || r.time_s[i] > recording.to_s) continue;
    times_s.push_back(r.time_s[i]);
    readings.force_N.push_back(r.response[i] - placed.offset);
  }
  const LawFile plain = at_surface(law);
  std::vector<BudgetStage> stages{std::move(readings), law_stage(plain, motion, times_s)};
  std::ranges::move(loop_stages(plain, motion, times_s, options.device),
                    std::back_inserter(stages));
  ErrorBudget budget = budget_of(std::move(times_s), std::move(stages));
  budget.title = fmt::format("{} along {}", law_name(law.spec),
                             std::filesystem::path(recording.name).filename().string());
  add_random_part(budget, placed);
  conclude(budget);
  return budget;
}

}  // namespace tpm::fit
