#include "tpm/fit/online/identification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/select/history_before_window.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

void require_possible(const IdentifyOptions& options) {
  const auto within = [](double value, double low, double high, const char* what) {
    if (value > low && value < high) return;
    throw bad_input("identification", fmt::format("{} {}", what, shortest(value)),
                    fmt::format("a value between {} and {}", shortest(low), shortest(high)));
  };
  within(options.level, 0.0, 1.0, "level");
  within(options.target, 0.0, 1.0, "target");
  if (options.patience < 1.0 || !std::isfinite(options.patience)) {
    throw bad_input("identification", fmt::format("patience {}", shortest(options.patience)),
                    "1 or more");
  }
}

/// Since when the drive has been held: within a part of its way to the deepest place so far.
class HoldWatch {
 public:
  void see(double time_s, double drive) {
    if (!begin_s_) {
      begin_s_ = since_s_ = time_s;
      first_ = deepest_ = drive;
    }
    deepest_ = std::max(deepest_, drive);
    if (std::abs(drive - held_) > kHeldWithin * (deepest_ - first_)) {
      held_ = drive;
      since_s_ = time_s;
    }
    now_s_ = time_s;
  }
  /// Held for a tenth of the time so far: a ramp alone does not tell what relaxes.
  [[nodiscard]] bool holds() const {
    return begin_s_ && now_s_ - since_s_ >= kHeldShare * (now_s_ - *begin_s_);
  }

 private:
  static constexpr double kHeldWithin = 0.01, kHeldShare = 0.1;
  std::optional<double> begin_s_;
  double first_ = 0.0, deepest_ = 0.0, held_ = 0.0, since_s_ = 0.0, now_s_ = 0.0;
};

/// Watches the widths and says when to stop.
class StoppingRule {
 public:
  explicit StoppingRule(const IdentifyOptions& options) : options_(options) {}

  bool stops_at(const IdentifiedSample& sample, const HoldWatch& hold) {
    // Intervals hold only where contact and offset are off their bounds.
    const bool narrow =
        hold.holds() &&
        std::ranges::none_of(sample.estimate.parameters, &SequentialParameter::at_bound) &&
        sample.estimate.widest_relative_half_width() <= options_.target;
    const auto n = static_cast<double>(sample.estimate.samples);
    if (!was_narrow_ || law_ != sample.law) since_ = n;
    was_narrow_ = narrow;
    law_ = sample.law;
    return narrow && n >= options_.patience * since_;
  }

 private:
  const IdentifyOptions& options_;
  bool was_narrow_ = false;
  double since_ = 0.0;  ///< samples when the widths became narrow
  std::size_t law_ = 0;
};

LawUncertainty uncertainty_of(const SequentialEstimate& e, double level) {
  LawUncertainty u;
  std::vector<Eigen::Index> rows;
  double degrees = 0.0;
  for (std::size_t i = 0; i < e.parameters.size(); ++i) {
    const SequentialParameter& p = e.parameters[i];
    if (p.at_bound) {
      u.at_bound.push_back(p.parameter.name);
      continue;
    }
    rows.push_back(static_cast<Eigen::Index>(i));
    u.place.push_back(p.place);
    u.coordinate.push_back(coordinate_of(p.parameter.scale));
    // One number for all: the fewest, so that no interval is too short.
    degrees = degrees == 0.0 ? p.degrees_of_freedom : std::min(degrees, p.degrees_of_freedom);
  }
  u.covariance = e.covariance(rows, rows);
  u.covariance = 0.5 * (u.covariance + u.covariance.transpose()).eval();
  u.level = level;
  u.degrees_of_freedom = degrees;
  u.readings_per_independent = (1.0 + e.phi) / (1.0 - e.phi);
  u.noise.absolute = e.sigma;
  u.noise.lag_1 = e.phi;
  return u;
}

/// Laws that can be fitted sample by sample and that differ noticeably.
std::vector<LawSpec> live_laws() {
  std::vector<LawSpec> laws;
  for (const Kernel kernel : {Kernel::linear, Kernel::power}) {
    for (int branches = 0; branches <= 2; ++branches) {
      laws.push_back({.kernel = kernel, .branches = branches});
    }
  }
  laws.push_back({.tension = Tension::elastic});
  return laws;
}

}  // namespace

const IdentifiedSample& Identification::result() const {
  return stopped ? history[*stopped] : history.back();
}

Identification identify(const PreparedRecording& recording, const IdentifyOptions& options) {
  require_possible(options);
  require_imposed_motion(recording.recording, recording.name, "identification");
  Identification id;
  id.name = recording.name;
  id.options = options;
  id.begin_s = recording.from_s;
  id.end_s = recording.to_s;
  id.peak_response = std::abs(recording.phases.peak_response);
  const Recording& r = recording.recording;
  SequentialSettings settings;
  settings.level = options.level;
  settings.seed = options.seed;
  settings.reference = options.reference.value_or(reference_drive(std::span(&recording, 1)));
  std::vector<SequentialFit> fits;
  for (const LawSpec& law : options.laws.empty() ? live_laws() : options.laws) {
    fits.emplace_back(law, r.drive_quantity, r.response_quantity, settings);
    id.laws.push_back(fits.back().law());
  }
  StoppingRule rule(id.options);
  HoldWatch hold;
  for (std::size_t i = 0; i < r.time_s.size() && r.time_s[i] <= recording.to_s; ++i) {
    for (SequentialFit& fit : fits) fit.add(r.time_s[i], r.drive[i], r.response[i]);
    ++id.samples;
    if (r.time_s[i] >= recording.from_s) hold.see(r.time_s[i], r.drive[i]);
    const auto least = least_law(fits, options.margin);
    if (!least) continue;
    id.history.push_back({r.time_s[i], *least, *fits[*least].estimate()});
    if (!id.stopped && rule.stops_at(id.history.back(), hold)) id.stopped = id.history.size() - 1;
  }
  if (id.history.empty()) {
    throw bad_input(fmt::format("recording '{}'", recording.name),
                    "has too few samples for any of the laws", "more samples than parameters");
  }
  if (auto remark = history_before_window(id.laws[id.result().law], id.result().estimate.values,
                                          recording, "the identification")) {
    id.remarks.push_back(*std::move(remark));
  }
  if (!id.stopped) {
    id.remarks.push_back(
        {"not_stopped",
         fmt::format("not stopped: the widest interval never stayed below {} % of its estimate",
                     significant(100.0 * options.target, 3))});
  }
  constexpr double kNearlyOne = 0.98;
  if (id.result().estimate.phi > kNearlyOne) {
    id.remarks.push_back(
        {"correlated_residuals", fmt::format("neighbouring residuals are correlated by {}: the law "
                                             "does not fit, or the zero drifts; "
                                             "intervals take it for noise",
                                             significant(id.result().estimate.phi, 4))});
  }
  for (const SequentialParameter& p : id.result().estimate.parameters) {
    if (!p.nuisance || !p.at_bound) continue;
    id.remarks.push_back(
        {"nuisance_at_bound",
         fmt::format("{} stands on its automatic bound: the intervals hold only there",
                     p.parameter.name)});
  }
  if (!id.result().estimate.identified) {
    id.remarks.push_back(
        {"not_identified",
         "a material parameter stands on a bound or is not told apart from others"});
  }
  return id;
}

LawFile law_of_sample(const Identification& identification, const IdentifiedSample& sample) {
  LawFile law;
  law.spec = identification.laws[sample.law];
  law.values = sample.estimate.values;
  law.provenance = Provenance::derived;
  law.note =
      fmt::format("identified: {} after {} samples", identification.name, sample.estimate.samples);
  return law;
}

LawFile identified_law(const Identification& identification, const PreparedRecording& recording) {
  const IdentifiedSample& sample = identification.result();
  LawFile law = law_of_sample(identification, sample);
  const double contact = law.values[law.values.size() - 2];
  const Recording& r = recording.recording;
  double deepest = 0.0;
  for (std::size_t i = 0; i < r.time_s.size() && r.time_s[i] <= sample.time_s; ++i) {
    deepest = std::max(deepest, r.drive[i] - contact);
  }
  if (deepest > 0.0) law.fitted_to = deepest;
  const bool cut = std::ranges::any_of(identification.remarks, [](const Remark& remark) {
    return remark.code == kHistoryBeforeWindow;
  });
  if (!sample.estimate.identified || cut) return law;
  law.uncertainty = uncertainty_of(sample.estimate, identification.options.level);
  law.uncertainty->duration_s = sample.time_s - recording.from_s;
  law.uncertainty->data.push_back({recording.name, r.header.sha256,
                                   static_cast<int>(sample.estimate.samples), recording.from_s,
                                   sample.time_s});
  return law;
}

}  // namespace tpm::fit
