// Declared in tpm/fit/predict/budget_parts.hpp.
// The stages of one contact.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "tpm/base/distributions.hpp"
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

/// Depths along a motion, asked for in rising times.
class DepthAlong {
 public:
  explicit DepthAlong(const Protocol& motion) : knots_(motion.knots()) {}

  double at(double time_s) {
    while (knot_ + 1 < knots_.size() && knots_[knot_ + 1].time_s <= time_s) ++knot_;
    const Knot& a = knots_[knot_];
    if (knot_ + 1 == knots_.size()) return a.value;
    const Knot& b = knots_[knot_ + 1];
    return a.value + (b.value - a.value) * (time_s - a.time_s) / (b.time_s - a.time_s);
  }

 private:
  std::span<const Knot> knots_;
  std::size_t knot_ = 0;
};

/// Reads forces at wanted times as they come, one period after another.
class LateReader {
 public:
  /// @param order places of the times, rising
  LateReader(std::span<const double> times_s, std::span<const std::size_t> order, double begin_s,
             double period_s)
      : times_s_(times_s),
        order_(order),
        begin_s_(begin_s),
        period_s_(period_s),
        read_(times_s.size()) {}

  /// Told the forces of the periods k - 1 and k, k from 1.
  void between(std::size_t k, double before, double now) {
    const auto left = static_cast<double>(k - 1);
    for (; next_ < order_.size() && place() < left + 1.0; ++next_) {
      read_[order_[next_]] = before + (place() - left) * (now - before);
    }
  }
  std::vector<double> finish(double last) {
    for (; next_ < order_.size(); ++next_) read_[order_[next_]] = last;
    return std::move(read_);
  }

 private:
  [[nodiscard]] double place() const {
    return std::max((times_s_[order_[next_]] - begin_s_) / period_s_, 0.0);
  }

  std::span<const double> times_s_;
  std::span<const std::size_t> order_;
  double begin_s_, period_s_;
  std::vector<double> read_;
  std::size_t next_ = 0;
};

/// The law in the loop; it begins relaxed under its first depth, as a fit takes a recording.
PeriodStep law_in_loop(const LawFile& law, const Protocol& motion, double period_s) {
  const auto contact = std::make_shared<LawContact>(
      law, LawContactSettings{.period_s = period_s,
                              .longest_s = motion.end_s() - motion.start_s(),
                              .deepest_m = motion.peak(),
                              .deepest_valid_m = valid_depth_m(law, motion.peak())});
  if (motion.equilibrium_at_start()) {
    const double depth = motion.knots().front().value;
    const LawModel model(law.spec);
    contact->take_over(depth, model.at(law.values, nullptr).kernel.value(std::max(depth, 0.0)));
  }
  return [contact](double depth) {
    return std::max(-contact->step(Eigen::Vector3d(0.0, 0.0, depth)).force_N.z(), 0.0);
  };
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
  add_device_stages(stages, motion, law_in_loop(law, motion, device.period_s),
                    law_in_loop(law, motion, device.period_s), times_s, device,
                    {"loop",
                     fmt::format("the update of {} ms", significant(1e3 * device.period_s, 3)),
                     "integration",
                     BudgetKind::computation,
                     {}});
  return stages;
}

/// Uncertainty of a recording's force F at depth u and time t due to its instrument:
/// u^2 = (gain F)^2 + zero^2 + (dF/du)^2 (a^2 + (b u)^2) + (dF/dt)^2 c^2.
void add_instrument_part(ErrorBudget& budget, const LawFile& plain, const Protocol& motion,
                         const Instrument& instrument, double level) {
  const LawModel model(plain.spec);
  const Response at =
      model.respond(motion, budget.time_s, plain.values, Want::values_and_sensitivity);
  const auto of = [](const std::optional<ChannelUncertainty>& channel) {
    return channel.value_or(ChannelUncertainty{});
  };
  const ChannelUncertainty force = of(instrument.force), depth = of(instrument.depth),
                           time = of(instrument.time);
  double largest = 0.0;
  for (Eigen::Index i = 0; i < at.value.size(); ++i) {
    const double by_depth =
        -at.sensitivity(i, at.sensitivity.cols() - 2);  // contact is the last but one
    const double u_m = value_at(motion, budget.time_s[static_cast<std::size_t>(i)]);
    const Eigen::Index a = std::max<Eigen::Index>(i - 1, 0),
                       b = std::min<Eigen::Index>(i + 1, at.value.size() - 1);
    const double dt =
        budget.time_s[static_cast<std::size_t>(b)] - budget.time_s[static_cast<std::size_t>(a)];
    const double by_time = dt > 0.0 ? (at.value[b] - at.value[a]) / dt : 0.0;
    const double u = std::hypot(
        std::hypot(force.relative * at.value[i],
                   std::hypot(force.absolute, instrument.zero.value_or(0.0))),
        by_depth * std::hypot(depth.absolute, depth.relative * u_m), by_time * time.absolute);
    if (std::isfinite(u)) largest = std::max(largest, u);
  }
  const double k = normal_quantile(0.5 + 0.5 * level);
  budget.instrument = BudgetInstrumentPart{instrument.id, level, k * largest / budget.peak_N};
}

/// Options of a prediction for the random part.
PredictionOptions random_part_options(const BudgetOptions& options) {
  PredictionOptions prediction;
  prediction.samples = options.samples;
  prediction.seed = options.seed;
  prediction.level = options.level;
  prediction.contact = options.contact;
  prediction.zero = options.zero;
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
  budget.remarks.insert(budget.remarks.end(), p.remarks.begin(), p.remarks.end());
}

void add_random_part(ErrorBudget& budget, const LawFile& law, const Protocol& motion,
                     const BudgetOptions& options) {
  if (law.uncertainty) {
    add_random_part(budget, predict_law(law, motion, budget.time_s, random_part_options(options)));
  } else {
    budget.remarks.push_back(
        {"no_random_part", "the law file carries no uncertainty of a fit: no random part"});
  }
}

BudgetStage law_stage(const LawFile& law, const Protocol& motion,
                      const std::vector<double>& times_s) {
  return {"law", fmt::format("{}, exact along the motion", law_name(law.spec)), "law",
          BudgetKind::data,
          to_vector(LawModel(law.spec).respond(motion, times_s, law.values, Want::values).value)};
}

std::vector<std::vector<double>> stepped_forces(const Protocol& motion, double period_s,
                                                double encoder_step_m, const PeriodStep& step,
                                                std::span<const double> times_s,
                                                std::span<const double> late_s) {
  std::vector<std::size_t> order(times_s.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return times_s[i]; });
  std::vector<LateReader> readers;
  readers.reserve(late_s.size());
  for (const double late : late_s) {
    readers.emplace_back(times_s, order, motion.start_s() + late, period_s);
  }
  const double length_s = motion.end_s() - motion.start_s();
  const auto count = static_cast<std::size_t>(std::ceil(length_s / period_s * (1.0 - 1e-12))) + 1;
  DepthAlong along(motion);
  double before = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    double depth =
        along.at(std::min(motion.start_s() + static_cast<double>(k) * period_s, motion.end_s()));
    if (encoder_step_m > 0.0) depth = encoder_step_m * std::round(depth / encoder_step_m);
    const double now = step(depth);
    if (k > 0) {
      for (LateReader& reader : readers) reader.between(k, before, now);
    }
    before = now;
  }
  return mapped<std::vector<double>>(
      readers, [before](LateReader& reader) { return reader.finish(before); });
}

void add_device_stages(std::vector<BudgetStage>& stages, const Protocol& motion,
                       const PeriodStep& smooth, const PeriodStep& quantised,
                       const std::vector<double>& times_s, const BudgetDevice& device,
                       const BudgetStage& loop) {
  const double late_s = device.delay_periods * device.period_s;
  const std::array<double, 3> late{0.0, late_s, late_s + device.period_s};
  stages.push_back(loop);
  stages.back().force_N = std::move(
      stepped_forces(motion, device.period_s, 0.0, smooth, times_s, std::span(late).first(1))
          .front());
  auto forces =
      stepped_forces(motion, device.period_s, device.encoder_step_m, quantised, times_s, late);
  stages.push_back(
      {"encoder",
       fmt::format("positions in steps of {} um", significant(1e6 * device.encoder_step_m, 3)),
       "quantisation", BudgetKind::device, std::move(forces[0])});
  stages.push_back({"delayed", fmt::format("forces {} periods late", device.delay_periods), "delay",
                    BudgetKind::device, std::move(forces[1])});
  stages.push_back({"hand", "each force kept until the next, at the end of its period", "period",
                    BudgetKind::device, std::move(forces[2])});
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
  if (recording.instrument) {
    add_instrument_part(budget, plain, motion, *recording.instrument, options.level);
  }
  conclude(budget);
  return budget;
}

}  // namespace tpm::fit
