#include "tpm/fit/select/placement_parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/data/contact_onset.hpp"
#include "tpm/data/drive_pieces.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/recording/placement.hpp"
#include "tpm/fit/recording/unseen_rises.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

bool is_stretch(const LawSpec& law) {
  return law.drive == Quantity::relative_length;
}

bool is_indentation(const LawSpec& law) {
  return law.drive == Quantity::indentation_depth && law.response == Quantity::contact_force;
}

bool bends(const LawSpec& law) {
  return law.kernel != Kernel::linear || law.tension != Tension::none;
}

/// True if contact and offset can be told apart: by a bend of the kernel, or by a response that
/// begins to rise within the recording. Where it begins was found in noisy readings; to fix contact
/// there would take an estimate for known.
bool contact_is_seen(const LawSpec& law, const PreparedRecording& r) {
  if (law.drive == Quantity::strain) return false;  // it counts from the unloaded specimen
  if (bends(law)) return true;
  const double contact_s = r.recording.time_s[r.phases.contact_index];
  return !r.phases.preloaded && r.phases.contact_found && contact_s >= r.from_s;
}

/// Stretch at which the stress of a strip begins to rise; none if it does so at once.
std::optional<double> onset_of_stress(const PreparedRecording& r) {
  constexpr double kCreeps = 0.01;  // part of the range that a still drive may creep
  constexpr std::size_t kSustained = 5, kOfSamples = 8;
  const Recording& read = r.recording;
  const auto pieces =
      data::drive_pieces(read.time_s, read.drive, r.phases.drive_jitter_sd, kCreeps);
  const std::size_t most = std::max<std::size_t>(read.response.size() / kOfSamples, 1);
  const data::Touch touch = data::find_touch(
      {read.drive, read.response, pieces, r.phases.noise_sd_estimate, std::min(kSustained, most)},
      std::nullopt);
  if (!touch.index || touch.instantaneous) return std::nullopt;
  return read.drive[*touch.index];
}

/// True if stresses begin to rise at different stretches, by more than 2 % of the shortest range.
/// Under a bent law they leave the noise late, but those of one slack length at one stretch.
bool have_own_slack(std::span<const PreparedRecording> recordings) {
  constexpr double kApart = 0.02;
  double least = std::numeric_limits<double>::infinity(), most = -least, range = least;
  for (const PreparedRecording& r : recordings) {
    if (r.load_imposed) continue;
    const std::optional<double> onset = onset_of_stress(r);
    if (!onset) continue;
    least = std::min(least, *onset);
    most = std::max(most, *onset);
    range = std::min(range, r.phases.peak_drive - r.recording.drive.front());
  }
  return most - least > kApart * range;
}

/// Part of the travel by which bounds leave a held parameter free.
constexpr double kHeldWithin = 1e-6;

/// Contact may lie this many times the depth of the recording before its start at most.
constexpr double kFurthestContact = 2.0;

/// The slack length of a strip: nothing measures it beforehand. It is passed in the first nine
/// tenths of the stretch; a strip that is taut from the start was slack no further back than a
/// contact may lie, and not below a tenth of the length at the start. These bounds are not widened
/// where a fit presses on them: a bend of the kernel from further away swallows a lack of fit.
AutomaticBounds slack_length_bounds(const LawSpec& law, const PreparedRecording& r,
                                    std::string name) {
  constexpr double kMostOfStretch = 0.9, kShortest = 0.1;
  FitParameter fit;
  fit.name = std::move(name);
  fit.scale = Scale::linear;
  fit.unit = shown_unit(quantity_dimension(law.drive));
  const double begin = start_drive(r);
  const double range = r.phases.peak_drive - begin;
  fit.lower = std::max(begin - kFurthestContact * range, kShortest * begin);
  fit.upper = begin + kMostOfStretch * range;
  // Under a straight kernel that was in contact from the start, depth and offset say the same.
  if (!bends(law)) fit.lower = std::max(begin, r.recording.drive.front());
  fit.start = std::max(begin, fit.lower);
  return {readable(std::move(fit)), std::nullopt};
}

/// Where contact of a depth can lie at all: the probe touches before the force rises, and in a
/// recording that begins in contact not much further back than it then goes on.
AutomaticBounds contact_bounds(const LawSpec& law, const PreparedRecording& r, const Onset& onset,
                               bool measured, std::string name) {
  constexpr double kBeforeRise = 0.25, kAfterRise = 0.1;
  FitParameter fit;
  fit.name = std::move(name);
  fit.scale = Scale::linear;
  fit.unit = shown_unit(quantity_dimension(law.drive));
  const double begin = start_drive(r);
  const double range = r.phases.peak_drive - begin;
  fit.lower = begin - (onset.from_rest ? kBeforeRise : kFurthestContact) * range;
  fit.upper = begin + kAfterRise * range;
  // Under a straight kernel that was in contact from the start, depth and offset say the same,
  // unless the zero was measured.
  if (!bends(law) && !(onset.from_rest && measured)) {
    fit.lower = std::max(fit.lower, r.recording.drive.front());
  }
  fit.start = std::clamp(measured ? onset.drive.value : begin, fit.lower, fit.upper);
  return {readable(std::move(fit)), std::nullopt};
}

/// A zero lies no further away than what was read.
AutomaticBounds offset_bounds(const LawSpec& law, const PreparedRecording& r, std::string name) {
  const double peak = std::abs(r.phases.peak_response) + std::abs(r.phases.floor_response);
  const Unit unit = shown_unit(quantity_dimension(law.response));
  return {readable({std::move(name), unit, Scale::linear, 0.0, -peak, peak}), std::nullopt};
}

/// Depth of contact, or strain of the specimen without a load, under an imposed load. Every reading
/// under a load lies behind it; a probe that rested without a load had not passed it. Otherwise it
/// may lie as far back as kFurthestContact times the largest reading, and no further.
AutomaticBounds unloaded_bounds(const LawSpec& law, const PreparedRecording& r, std::string name) {
  constexpr double kLoaded = 0.05;  // of the largest load, above the first one
  constexpr double kSure = 4.0;     // standard deviations of a reading
  const std::vector<double>& load = r.recording.drive;
  const std::vector<double>& reading = r.recording.response;
  const std::size_t rest = samples_before_load(r.recording);
  const double zero = rest > 0 ? load.front() : 0.0;
  const double loaded = zero + kLoaded * (r.phases.peak_drive - zero);
  double shallowest = r.phases.peak_response;  // under a load
  double travel = 0.0;
  for (std::size_t i = rest; i < reading.size(); ++i) {
    travel = std::max(travel, std::abs(reading[i]));
    if (load[i] > loaded) shallowest = std::min(shallowest, reading[i]);
  }
  const double noise = kSure * r.phases.noise_sd_estimate;
  FitParameter fit;
  fit.name = std::move(name);
  fit.scale = Scale::linear;
  fit.unit = shown_unit(quantity_dimension(law.drive));
  fit.upper = shallowest + noise;
  fit.lower = shallowest - kFurthestContact * travel;
  if (rest > 0) {
    const auto end = reading.begin() + static_cast<std::ptrdiff_t>(rest);
    fit.lower = std::min(*std::min_element(reading.begin(), end), shallowest) - noise;
  }
  fit.start = std::clamp(r.phases.floor_response, fit.lower, fit.upper);
  return {readable(std::move(fit)), std::nullopt};
}

Prior zero_prior(const PreparedRecording& r, const RestReadings& rests) {
  constexpr double kStated = 0.02;  // of the peak
  if (rests.zero) {
    const char* pulled = rests.pulled
                             ? "; those after withdrawal are left out: they lie lower than "
                               "a drift explains, as if tissue still pulled the probe"
                             : "";
    return {rests.zero->value, rests.zero->sd,
            rests.before > 0 ? fmt::format("{} samples before contact{}", rests.before, pulled)
                             : fmt::format("{} samples after withdrawal", rests.after)};
  }
  if (r.instrument && r.instrument->zero && *r.instrument->zero > 0.0) {
    return {0.0, *r.instrument->zero,
            fmt::format("stated by instrument {}: no samples before contact tell the zero",
                        r.instrument->id),
            false};
  }
  const double floor = std::abs(r.phases.floor_response);
  return {0.0, std::max(floor, kStated * std::abs(r.phases.peak_response)),
          "stated: no samples before contact tell the zero", false};
}

Prior contact_prior(const Onset& onset) {
  std::string from;
  if (!onset.from_rest) {
    from = "stated: no samples before contact, so its depth is an unknown";
  } else if (onset.samples == 0) {
    from = "between two samples: the ramp has too few to be extrapolated";
  } else {
    from = fmt::format("onset extrapolated from {} samples, the first {} % of the ramp",
                       onset.samples, significant(100.0 * onset.part, 2));
  }
  return {onset.drive.value, onset.drive.sd, std::move(from), onset.from_rest};
}

/// "mN/s": drifts of a force are small.
Unit drift_unit_of(const PreparedRecording& r) {
  const Dimension response = quantity_dimension(r.recording.response_quantity);
  return per_second(response == Dimension::force ? parse_unit("mN", response, "drift")
                                                 : shown_unit(response));
}

/// True if the rests of a recording tell its drift: those of an indentation under an imposed depth.
/// The readings of a strip or a creeping specimen at rest may be the tissue's.
bool rests_unloaded(const LawSpec& law, const PreparedRecording& r) {
  return is_indentation(law) && !r.load_imposed;
}

void add_drift(FitConfig& config, const PreparedRecording& r, std::size_t i,
               const RestReadings& rests, std::string name) {
  constexpr double kWide = 20.0;  // standard deviations
  const Measured drift = rests.drift.value_or(Measured{});
  const double duration = r.to_s - r.from_s;
  const double most = std::max(kWide * drift.sd, std::abs(r.phases.peak_response) / duration);
  EstimatedParameter p;
  p.fit = readable({std::move(name), drift_unit_of(r), Scale::linear, drift.value,
                    drift.value - most, drift.value + most});
  if (rests.drift) {
    p.prior = Prior{drift.value, drift.sd,
                    fmt::format("{} samples before contact and {} after withdrawal", rests.before,
                                rests.after)};
  }
  p.drift = DriftTerm{i, rests.drift ? rests.origin_s : r.from_s};
  config.parameters.push_back(std::move(p));
}

/// Holds the reading without a load where it was before the force rose.
void hold_zero_of_load(FitConfig& config, const LawModel& model, const PreparedRecording& r,
                       std::vector<std::size_t> scope) {
  constexpr double kHeld = 1e-6;  // of the largest force
  const std::size_t rest = samples_before_load(r.recording);
  const double zero = rest > 0 ? r.recording.drive.front() : 0.0;
  if (scope.empty()) {
    config.fixed[model.index("offset")] = zero;
    return;
  }
  const double off = kHeld * r.phases.peak_drive;
  add_automatic(
      config,
      {{fmt::format("offset {}", r.name), shown_unit(quantity_dimension(model.spec().response)),
        Scale::linear, zero, zero - off, zero + off},
       std::nullopt},
      {{model.index("offset"), std::move(scope)}});
}

/// Takes the level of the rest before the load for the parameter that was added last, where the fit
/// begins behind it.
void take_level_before_load(FitConfig& config, const PreparedRecording& r) {
  const auto before = level_before_load(r);
  if (!before) return;
  EstimatedParameter& p = config.parameters.back();
  p.prior = Prior{before->level.value, before->level.sd,
                  fmt::format("{} samples before the load", before->samples)};
  p.fit.start = std::clamp(before->level.value, p.fit.lower, p.fit.upper);
}

/// Zero and contact of recordings that are no indentations, and of creep: nothing is measured
/// beforehand but the force before it rises.
void add_free_placement(FitConfig& config, const LawModel& model, const PreparedRecording& r,
                        const std::vector<std::size_t>& scope, std::string offset,
                        const SetupOptions& options) {
  const LawSpec& law = model.spec();
  if (r.load_imposed) {
    add_automatic(config, unloaded_bounds(law, r, std::move(offset)),
                  {{model.index("contact"), scope}});
    if (options.measured) take_level_before_load(config, r);
    return;
  }
  add_automatic(config, offset_bounds(law, r, std::move(offset)), {{model.index("offset"), scope}});
  if (options.measured) take_level_before_load(config, r);
}

/// Slack lengths of a stretch: one of each recording that shows it where they differ (the strip may
/// have been gripped again, or be another one), and one for all others.
void add_slack_lengths(FitConfig& config, const LawModel& model,
                       std::span<const PreparedRecording> recordings) {
  const std::size_t contact = model.index("contact");
  const bool own = have_own_slack(recordings);
  std::vector<std::size_t> taut;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const PreparedRecording& r = recordings[i];
    if (r.load_imposed) continue;
    if (own && onset_of_stress(r)) {
      add_automatic(config,
                    slack_length_bounds(model.spec(), r, fmt::format("slack_length {}", r.name)),
                    {{contact, {i}}});
    } else {
      taut.push_back(i);
    }
  }
  if (taut.empty()) return;
  const bool all = taut.size() == recordings.size();
  add_automatic(config, slack_length_bounds(model.spec(), recordings[taut.front()], "slack_length"),
                {{contact, all ? std::vector<std::size_t>{} : taut}});
}

/// Contact that is known, where each recording has its own.
/// @param range travel of the recording from there
AutomaticBounds held_contact(const LawSpec& law, double at, double range, std::string name) {
  return {{std::move(name), shown_unit(quantity_dimension(law.drive)), Scale::linear, at,
           at - kHeldWithin * range, at + kHeldWithin * range},
          std::nullopt};
}

}  // namespace

void add_automatic(FitConfig& config, AutomaticBounds bounds, std::vector<Target> sets) {
  EstimatedParameter p;
  p.fit = std::move(bounds.fit);
  p.sets = std::move(sets);
  p.widest = bounds.widest;
  config.parameters.push_back(std::move(p));
}

double start_drive(const PreparedRecording& r) {
  return r.phases.contact_found && !r.phases.preloaded ? r.phases.contact_drive
                                                       : r.recording.drive.front();
}

void require_contact_within(double contact, std::span<const PreparedRecording> recordings,
                            std::string_view where) {
  for (const PreparedRecording& r : recordings) {
    const double deepest = r.load_imposed ? r.phases.peak_response : r.phases.peak_drive;
    if (contact < deepest) continue;
    const Unit unit = shown_unit(quantity_dimension(law_drive(r.recording)));
    throw Error(ExitCode::usage, std::string(where),
                fmt::format("{} is not below the largest depth of '{}', {}",
                            with_unit(significant(contact / unit.to_si, 4), unit), r.name,
                            with_unit(significant(deepest / unit.to_si, 4), unit)),
                "the depth at which the probe begins to touch");
  }
}

void add_possible_drift(FitConfig& config, const PreparedRecording& r, std::size_t place) {
  const RestReadings rests = rests_unloaded(config.law.value(), r) ? read_rests(r) : RestReadings{};
  if (drift_finding(r, rests) != DriftFinding::not_separable) return;
  const bool several = config.data.size() > 1;
  add_drift(config, r, place, rests,
            several ? fmt::format("drift {}", r.name) : std::string("drift"));
}

void add_placement(FitConfig& config, const LawModel& model,
                   std::span<const PreparedRecording> recordings, const SetupOptions& options) {
  const LawSpec& law = model.spec();
  const std::size_t offset = model.index("offset"), contact = model.index("contact");
  if (options.zero) config.fixed[offset] = *options.zero;
  if (options.contact) config.fixed[contact] = *options.contact;
  if (options.nuisance == Nuisance::none) return;
  const bool several = recordings.size() > 1;
  const auto named = [&](const char* what, const PreparedRecording& r) {
    return several ? fmt::format("{} {}", what, r.name) : std::string(what);
  };
  int held = 0, told = 0;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const PreparedRecording& r = recordings[i];
    const auto scope = several ? std::vector<std::size_t>{i} : std::vector<std::size_t>{};
    if (options.measured) add_rise_delays(config, r, i, several ? " " + r.name : "");
    if (!is_indentation(law) || r.load_imposed) {
      held += options.measured && drift_finding(r, {}) != DriftFinding::no_hold;
      const bool pressed = is_indentation(law);
      if (pressed && !options.zero) hold_zero_of_load(config, model, r, scope);
      if (r.load_imposed ? options.contact.has_value() : options.zero.has_value()) continue;
      add_free_placement(config, model, r, scope,
                         named(pressed          ? "contact"
                               : r.load_imposed ? "strain_zero"
                                                : "offset",
                               r),
                         options);
      continue;
    }
    const MeasuredPlacement placement = !options.measured ? MeasuredPlacement{}
                                        : options.placements
                                            ? options.placements->of(r, law, options.exponent)
                                            : measure_placement(r, law, options.exponent);
    if (!options.zero) {
      add_automatic(config, offset_bounds(law, r, named("offset", r)), {{offset, scope}});
      if (options.measured) config.parameters.back().prior = zero_prior(r, placement.rests);
    }
    const bool free = options.nuisance == Nuisance::offset_and_contact || contact_is_seen(law, r);
    if (options.contact || options.nuisance == Nuisance::offset) {
      // fixed
    } else if (r.contact_held && several) {
      const double at = r.phases.contact_drive;
      add_automatic(config, held_contact(law, at, r.phases.peak_drive - at, named("contact", r)),
                    {{contact, scope}});
    } else if (!r.contact_held && free) {
      add_automatic(config,
                    contact_bounds(law, r, placement.onset, options.measured, named("contact", r)),
                    {{contact, scope}});
      if (options.measured) config.parameters.back().prior = contact_prior(placement.onset);
    }
    if (!options.measured) continue;
    held += placement.drift != DriftFinding::no_hold;
    told += placement.drift == DriftFinding::told;
    if (placement.drift == DriftFinding::told)
      add_drift(config, r, i, placement.rests, named("drift", r));
  }
  const bool slack = is_stretch(law) && !options.zero && options.nuisance != Nuisance::offset;
  if (slack) add_slack_lengths(config, model, recordings);
  if (held == 0 || told > 0) return;
  for (EstimatedParameter& p : config.parameters) {
    if (p.fit.name == "k_inf") p.not_separable = Remark{kDriftOrBranch, "drift or a slow branch"};
  }
}

}  // namespace tpm::fit
