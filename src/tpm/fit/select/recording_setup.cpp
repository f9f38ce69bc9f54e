#include "tpm/fit/select/recording_setup.hpp"
#include "tpm/fit/select/fixed_times.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/lists.hpp"
#include "tpm/base/median.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/import/reading_options.hpp"
#include "tpm/fit/likelihood/fit_words.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/recording/end_of_test.hpp"
#include "tpm/fit/recording/kept_load.hpp"
#include "tpm/fit/recording/loading_sense.hpp"
#include "tpm/fit/recording/placement.hpp"
#include "tpm/fit/recording/start_up.hpp"
#include "tpm/fit/recording/strained_start.hpp"
#include "tpm/fit/recording/unseen_rises.hpp"
#include "tpm/fit/select/clipping.hpp"
#include "tpm/fit/select/imposed_channel.hpp"
#include "tpm/fit/select/placement_parameters.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

/// Samples before contact that are kept where they are too few to measure the zero beforehand.
constexpr std::size_t kBaseline = 10;
constexpr std::size_t kFewestBeforeContact = 3;

/// Sizes of a law's parameters, estimated from the recordings.
struct Sizes {
  double drive = 0.0;     ///< largest drive above contact
  double response = 0.0;  ///< largest response above its floor
  double shortest_s = 0.0;
  double longest_s = 0.0;
};

bool is_only_a_hold(const PreparedRecording& r) {
  return std::all_of(r.phases.phases.begin(), r.phases.phases.end(),
                     [](const Phase& phase) { return phase.kind == PhaseKind::hold; });
}

/// Loading that falls much farther than it rises from where it starts is counted the other way.
bool falls_instead(std::span<const double> values, double start, double noise_sd) {
  constexpr double kMuch = 3.0, kNoise = 20.0;
  const auto [low, high] = std::ranges::minmax_element(values);
  const double fall = start - *low, rise = *high - start;
  return fall > kMuch * std::max(rise, 0.0) && fall > kNoise * noise_sd;
}

/// A response that falls towards 0, and not below it, from a start far above it: a load that is
/// taken away. One that is counted the other way begins near 0 and falls below.
bool starts_loaded(std::span<const double> response, double noise_sd) {
  constexpr double kBelow = 0.1;  // of the start
  constexpr double kNoise = 4.0;
  const double lowest = *std::ranges::min_element(response);
  return lowest > -std::max(kBelow * response.front(), kNoise * noise_sd) &&
         response.front() > std::abs(lowest);
}

/// Number of samples, from the first one on, in which the drive rests.
std::size_t samples_of_still_drive(const PreparedRecording& r) {
  constexpr double kStill = 1e-4;  // of the range
  const std::vector<double>& drive = r.recording.drive;
  const auto [low, high] = std::ranges::minmax_element(drive);
  const double still = std::max(4.0 * r.phases.drive_jitter_sd, kStill * (*high - *low));
  std::size_t n = 1;
  while (n < drive.size() && std::abs(drive[n] - drive.front()) <= still) ++n;
  return n;
}

/// Readings that start far off the level of the rest and reach it while the drive still rests: a
/// cell that was switched on or tared, and not a response that is counted the other way.
void require_no_start_up(const PreparedRecording& r, std::span<const double> response) {
  constexpr std::size_t kFewest = 8;
  constexpr double kSpoilt = 20.0;  // standard deviations of the noise
  const std::size_t resting = samples_of_still_drive(r);
  if (resting < kFewest || resting >= response.size()) return;
  const std::span<const double> rest = response.first(resting);
  const double level = median({rest.begin(), rest.end()});
  if (falls_instead(response, level, r.phases.noise_sd_estimate)) return;
  std::size_t settled = 0;
  for (std::size_t i = 0; i < resting / 2; ++i) {
    if (std::abs(rest[i] - level) > kSpoilt * r.phases.noise_sd_estimate) settled = i + 1;
  }
  if (settled == 0) return;
  throw bad_input(
      fmt::format("recording '{}'", r.name),
      fmt::format("the first {} samples of the response lie far off the others at rest", settled),
      fmt::format("--from-time \"{} s\", which leaves them out",
                  significant(r.recording.time_s[settled], 6)));
}

}  // namespace

void require_rise(const PreparedRecording& r) {
  if (is_only_a_hold(r)) return;
  const std::span<const double> drive = r.recording.drive;
  const auto loaded = static_cast<std::size_t>(std::ranges::max_element(drive) - drive.begin()) + 1;
  const bool down = falls_instead(drive, drive.front(), r.phases.drive_jitter_sd);
  const std::span<const double> all = r.recording.response;
  const std::span<const double> response = down ? all : all.first(loaded);
  const bool response_down = falls_instead(response, response.front(), r.phases.noise_sd_estimate);
  if (!down && !response_down) return;
  if (!down) require_no_start_up(r, response);
  const bool both = down && response_down;
  if (both && starts_loaded(response, r.phases.noise_sd_estimate)) {
    throw bad_input(
        fmt::format("recording '{}'", r.name),
        "it begins under a load: drive and response fall from where they start, the response "
        "towards 0",
        "the recording from before the load on (what the tissue went through before the first "
        "sample is unknown), or --negate-drive --negate-response, if the machine counts them the "
        "other way from a zero of its own");
  }
  const bool turns_drive = r.load_imposed ? response_down : down;  // the option that does
  throw bad_input(fmt::format("recording '{}'", r.name),
                  both   ? "the drive falls, and so does the response"
                  : down ? "the drive falls"
                         : "the response falls where the drive rises",
                  fmt::format("{}, if the machine counts {} the other way",
                              both          ? "--negate-drive --negate-response"
                              : turns_drive ? "--negate-drive"
                                            : "--negate-response",
                              both ? "them" : "it"));
}

namespace {

Sizes sizes_of(std::span<const PreparedRecording> recordings) {
  for (const PreparedRecording& r : recordings) {
    require_no_kept_load(r);
    require_rise(r);
  }
  Sizes sizes;
  sizes.shortest_s = std::numeric_limits<double>::infinity();
  for (const PreparedRecording& r : recordings) {
    const double imposed = r.phases.peak_drive - start_drive(r);
    const double answer = r.phases.peak_response - r.phases.floor_response;
    sizes.drive = std::max(sizes.drive, r.load_imposed ? answer : imposed);
    sizes.response = std::max(sizes.response, r.load_imposed ? imposed : answer);
    sizes.shortest_s = std::min(sizes.shortest_s, median_step(r.recording.time_s));
    sizes.longest_s = std::max(sizes.longest_s, r.to_s - r.from_s);
  }
  if (sizes.drive > 0.0 && sizes.response > 0.0) return sizes;
  const PreparedRecording& first = recordings.front();
  const std::string where = fmt::format("recording '{}'", first.name);
  if (is_only_a_hold(first)) {
    throw bad_input(where, "only a hold: the drive stays where it is from the first sample on",
                    "the recording from before the ramp on (nothing else tells how the response "
                    "began), or a strain and a stress, which make a relaxation modulus");
  }
  throw bad_input(where,
                  sizes.drive > 0.0 ? "the response never rises above where it starts"
                                    : "the drive never rises above where contact begins",
                  "a ramp that is answered by a rising response");
}

AutomaticBounds law_parameter_bounds(const LawParameter& p, const Sizes& sizes, int branches) {
  constexpr double kFurther = 1e3;  // on a log scale
  const auto linear = [&p](double lower, double start, double upper) {
    return FitParameter{p.name, shown_unit(p.dimension), Scale::linear, start, lower, upper};
  };
  FitParameter fit = linear(p.lower, p.lower, p.upper);
  WidestBounds widest{p.lower, p.upper};
  const double stiffness = sizes.response / sizes.drive;
  if (p.dimension == Dimension::time) {
    fit.scale = Scale::log;
    fit.lower = 0.5 * sizes.shortest_s;
    fit.upper = 10.0 * sizes.longest_s;
    fit.start = std::clamp(0.1 * sizes.longest_s, fit.lower, fit.upper);
    // Relaxation between two samples is invisible, however far the bound is moved.
    widest = {fit.lower, kFurther * fit.upper};
  } else if (p.name == "exponent") {
    fit = linear(1.0, 1.5, 6.0);
  } else if (p.name == "alpha") {
    fit.start = 0.3;
  } else if (p.name == "beta") {
    fit.start = 0.1;
  } else if (p.name == "tension_share") {
    fit = linear(0.0, 0.5, 1.0);
  } else {
    fit.scale = p.linear ? Scale::linear : Scale::log;
    fit.lower = p.linear ? 0.0 : 1e-4 * stiffness;
    fit.upper = 1e3 * stiffness;
    fit.start = stiffness / (branches + 1);
    widest = {fit.lower / (p.linear ? 1.0 : kFurther), kFurther * fit.upper};
  }
  fit = readable(std::move(fit));
  return {fit, WidestBounds{std::min(widest.lower, fit.lower), std::max(widest.upper, fit.upper)}};
}

Noise noise_of(const PreparedRecording& r) {
  Noise noise;
  noise.scale_known = false;
  const std::vector<double>& sd = r.recording.response_sd;
  if (!sd.empty() && std::all_of(sd.begin(), sd.end(), [](double s) { return s > 0.0; })) {
    noise.kind = NoiseKind::per_row;
    return noise;
  }
  noise.kind = NoiseKind::absolute;
  noise.absolute =
      0.01 * std::max(std::abs(r.phases.peak_response), std::numeric_limits<double>::min());
  return noise;
}

void require_alike(std::span<const PreparedRecording> recordings) {
  if (recordings.empty()) throw bad_input("fit", "no recording", "at least one");
  const Recording& first = recordings.front().recording;
  for (const PreparedRecording& r : recordings) {
    if (law_drive(r.recording) == law_drive(first) &&
        law_response(r.recording) == law_response(first)) {
      continue;
    }
    throw bad_input(fmt::format("recording '{}'", r.name),
                    fmt::format("{} over {}", quantity_name(law_response(r.recording)),
                                quantity_name(law_drive(r.recording))),
                    fmt::format("{} over {}, as in '{}'", quantity_name(law_response(first)),
                                quantity_name(law_drive(first)), recordings.front().name));
  }
}

}  // namespace

FitParameter readable(FitParameter fit) {
  constexpr int kDigits = 4;
  fit.lower = rounded(fit.lower, kDigits);
  fit.upper = rounded(fit.upper, kDigits);
  fit.start = std::clamp(rounded(fit.start, kDigits), fit.lower, fit.upper);
  return fit;
}

void keep_baseline(PreparedRecording& r) {
  const std::size_t contact = r.phases.contact_found ? r.phases.contact_index : 0;
  r.from_s = r.recording.time_s[contact > kBaseline ? contact - kBaseline : 0];
}

PreparedRecording prepare_recording(std::string name, Recording recording,
                                    const PhaseOptions& options) {
  PreparedRecording r{std::move(name), std::move(recording), {}, 0.0, 0.0, {}};
  find_imposed_channel(r);
  r.phases = find_phases(r.recording, options);
  const std::vector<double>& time = r.recording.time_s;
  const std::size_t contact = r.phases.contact_found ? r.phases.contact_index : 0;
  r.contact_held = options.contact_response && r.phases.contact_found;
  r.contact_response = options.contact_response;
  // Samples that measure the zero are not fitted once more.
  if (samples_before_contact(r) >= kFewestBeforeContact) {
    r.from_s = time[contact];
  } else {
    keep_baseline(r);
  }
  r.to_s = end_of_test(r);
  end_before_unseen_motion(r);
  if (!r.load_imposed) find_clipping(r);
  if (const std::size_t rest = samples_before_load(r.recording); rest > 0) {
    r.from_s = time[rest];
    r.phases.floor_response = r.recording.response[rest];
  }
  leave_out_start_up(r);
  if (auto remark = strained_start_remark(r)) r.remarks.push_back(*std::move(remark));
  if (r.to_s > r.from_s) return r;
  throw bad_input(fmt::format("recording '{}'", r.name), "no ramp and hold before the unloading",
                  "a recording that loads before it unloads");
}

double reference_drive(std::span<const PreparedRecording> recordings) {
  return rounded(sizes_of(recordings).drive, 2);
}

double common_reference(std::span<const PreparedRecording> recordings) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    least = std::min(least, reference_drive(recordings.subspan(i, 1)));
  }
  return least;
}

FitConfig recording_config(LawSpec law, std::span<const PreparedRecording> recordings,
                           const SetupOptions& options) {
  require_alike(recordings);
  law.drive = law_drive(recordings.front().recording);
  law.response = law_response(recordings.front().recording);
  const Sizes sizes = sizes_of(recordings);
  law.reference = options.reference.value_or(reference_drive(recordings));
  const LawModel model(law);
  FitConfig config;
  config.law = law;
  config.title = recordings.size() == 1 ? recordings.front().name
                                        : fmt::format("{} recordings", recordings.size());
  config.title += fmt::format(": {}", law_name(law));
  config.starts = options.starts;
  config.seed = options.seed;
  config.level = options.level;
  config.profiles = options.profiles;
  config.interrupted = options.interrupted;
  for (const LawParameter& p : model.law_parameters()) {
    config.fixed.push_back(p.preset.value_or(0.0));
  }
  for (std::size_t i = 0; i < model.law_parameters().size(); ++i) {
    const LawParameter& p = model.law_parameters()[i];
    if (p.nuisance || p.preset) continue;
    if (p.name == "exponent" && options.exponent) {
      config.fixed[i] = *options.exponent;
      continue;
    }
    if (const auto time_s = stated_time(p.name, options.times_s)) {
      config.fixed[i] = *time_s;
      continue;
    }
    add_automatic(config, law_parameter_bounds(p, sizes, law.branches), {{i, {}}});
  }
  for (const PreparedRecording& r : recordings) {
    DataChoice data;
    data.dataset = r.name;
    data.protocol.kind = ProtocolChoice::Kind::measured;
    data.noise = noise_of(r);
    data.from_s = r.from_s;
    data.to_s = r.to_s;
    data.load_imposed = r.load_imposed;
    data.clipped_above = r.clipped_above;
    data.contact_response = r.contact_response;
    data.clipped_below = r.clipped_below;
    data.import = r.import;
    config.data.push_back(std::move(data));
  }
  if (!recordings.front().load_imposed) {
    config.fixed[model.index("contact")] = start_drive(recordings.front());
  }
  add_placement(config, model, recordings, options);
  if (std::ranges::any_of(recordings, &PreparedRecording::load_imposed)) {
    config.given_starts = creep_starts(config, recordings, options);
  }
  return config;
}

std::vector<DataSet> data_sets(std::span<const PreparedRecording> recordings) {
  return mapped<DataSet>(recordings, &PreparedRecording::recording);
}

Json config_json(const FitConfig& config) {
  const std::unique_ptr<Model> model = make_model(config);
  const auto text = [](double value, const Unit& unit) {
    return with_unit(shortest(value / unit.to_si), unit);
  };
  Json j{{"title", config.title}};
  if (config.law) {
    const Unit& unit = shown_unit(quantity_dimension(config.law->drive));
    j["law"] = {{"name", law_name(*config.law)},
                {"drive", quantity_name(config.law->drive)},
                {"reference", text(config.law->reference, unit)}};
  } else {
    j["model"] = config.model;
  }
  const Unit& second = shown_unit(Dimension::time);
  Json parameters = Json::object();
  std::vector<bool> estimated(model->parameters().size(), false);
  for (const EstimatedParameter& p : config.parameters) {
    Json entry{{"start", text(p.fit.start, p.fit.unit)},
               {"lower", text(p.fit.lower, p.fit.unit)},
               {"upper", text(p.fit.upper, p.fit.unit)},
               {"scale", scale_name(p.fit.scale)}};
    Json sets = Json::array();
    for (const Target& target : p.sets) {
      sets.push_back(model->parameters()[target.parameter].name);
      estimated[target.parameter] = true;
    }
    if (!sets.empty()) entry["sets"] = std::move(sets);
    const auto dataset = [&](std::size_t i) { return config.data[i].dataset; };
    if (!p.sets.empty() && !p.sets.front().data.empty()) {
      entry["for"] = array_json(p.sets.front().data, dataset);
    }
    if (p.prior) {
      entry["prior"] = {{"mean", text(p.prior->mean, p.fit.unit)},
                        {"sd", text(p.prior->sd, p.fit.unit)}};
      if (!p.prior->from.empty()) entry["prior"]["from"] = p.prior->from;
      if (!p.prior->measured) entry["prior"]["measured"] = false;
    }
    if (p.drift) {
      entry["drift"] = {{"of", config.data[p.drift->choice].dataset},
                        {"origin", text(p.drift->origin_s, second)}};
    }
    if (p.rise) {
      entry["rise"] = {{"of", config.data[p.rise->choice].dataset},
                       {"begin", text(p.rise->begin_s, second)},
                       {"end", text(p.rise->end_s, second)}};
    }
    if (p.not_separable) entry["not_separable"] = remark_json(*p.not_separable);
    parameters[p.fit.name] = std::move(entry);
  }
  j["parameters"] = std::move(parameters);
  Json fixed = Json::object();
  for (std::size_t i = 0; i < estimated.size(); ++i) {
    if (estimated[i] || !std::isfinite(config.fixed[i])) continue;
    const auto& p = model->parameters()[i];
    fixed[std::string(p.name)] = text(config.fixed[i], shown_unit(p.dimension));
  }
  if (!fixed.empty()) j["fixed"] = std::move(fixed);
  Json data = array_json(config.data, [&](const DataChoice& d) {
    Json noise{{"kind", noise_kind_name(d.noise.kind)}};
    if (uses_absolute(d.noise.kind)) {
      const Quantity read = d.load_imposed ? config.law->drive : config.law->response;
      noise["absolute"] = text(d.noise.absolute, shown_unit(quantity_dimension(read)));
    }
    if (uses_relative(d.noise.kind)) noise["relative"] = d.noise.relative;
    if (d.noise.angle_rad) noise["angle"] = shortest(*d.noise.angle_rad) + " rad";
    noise["scale"] = word_for(kNoiseScaleWords, d.noise.scale_known);
    Json entry{{"dataset", d.dataset}};
    entry["protocol"] = {{"kind", protocol_kind_name(d.protocol.kind)}};
    entry["noise"] = std::move(noise);
    if (d.load_imposed) entry["imposed"] = "response";
    if (says_how_to_read(d.import)) entry["import"] = reading_type().write(d.import);
    for (const auto& [key, limit] : {std::pair{"contact_force", d.contact_response},
                                     {"clipped_above", d.clipped_above},
                                     {"clipped_below", d.clipped_below}}) {
      if (limit) entry[key] = text(*limit, shown_unit(quantity_dimension(config.law->response)));
    }
    if (std::isfinite(d.from_s)) entry["from"] = text(d.from_s, second);
    if (std::isfinite(d.to_s)) entry["to"] = text(d.to_s, second);
    return entry;
  });
  j["data"] = std::move(data);
  j["starts"] = {{"count", config.starts}, {"seed", config.seed}};
  j["profile"] = {{"level", config.level}, {"enabled", config.profiles}};
  if (!config.choice) return j;
  const LawChoice& choice = *config.choice;
  j["choice"] = {{"law", choice.law}, {"samples", choice.samples}};
  if (!choice.samples_sha256.empty()) j["choice"]["samples_sha256"] = choice.samples_sha256;
  if (!choice.better.empty()) {
    j["choice"]["better"] = choice.better;
    j["choice"]["better_by"] = choice.better_by;
  }
  if (!choice.not_described.empty()) j["choice"]["not_described"] = choice.not_described;
  if (!choice.conditions.empty()) j["choice"]["conditions"] = choice.conditions;
  return j;
}

bool belongs_to_recording(const LawSpec& spec, const LawParameter& parameter) {
  if (!parameter.nuisance) return false;
  return parameter.name == "offset" || spec.drive != Quantity::relative_length;
}

FitResult fit_placement(const LawSpec& law, std::span<const double> values,
                        const PreparedRecording& recording, const SetupOptions& setup,
                        FittedPlacement what) {
  FitConfig config = recording_config(law, std::span(&recording, 1), setup);
  const std::vector<LawParameter> parameters = law_parameters(law);
  const auto is_fitted = [&](const LawParameter& p) {
    return what == FittedPlacement::slack_too ? p.nuisance : belongs_to_recording(law, p);
  };
  std::erase_if(config.parameters, [&](const EstimatedParameter& p) {
    const bool own = p.drift.has_value() || p.rise.has_value() ||
                     (p.sets.size() == 1 && is_fitted(parameters[p.sets.front().parameter]));
    return !own;
  });
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!is_fitted(parameters[i])) config.fixed[i] = values[i];
  }
  return run_fit(config, data_sets(std::span(&recording, 1)));
}

}  // namespace tpm::fit
