#include "tpm/fit/select/material_function.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/select/fixed_times.hpp"
#include "tpm/fit/select/function_starts.hpp"
#include "tpm/fit/select/gate.hpp"
#include "tpm/fit/select/instrument_floor.hpp"
#include "tpm/fit/select/law_choice.hpp"
#include "tpm/fit/select/reading_scatter.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

/// Sizes of a law's parameters, estimated from the readings.
struct FunctionSizes {
  double stiffness = 0.0;  ///< largest, Pa or N/m
  double shortest_s = std::numeric_limits<double>::infinity();
  double longest_s = 0.0;
  bool all_positive = true;
  double largest = 0.0;  ///< reading
  bool compliance = false;
  double least = std::numeric_limits<double>::infinity();

  void see(double reading) {
    all_positive = all_positive && reading > 0.0;
    largest = std::max(largest, std::abs(reading));
    least = std::min(least, reading);
  }
  /// No instrument reads more decades at once: below, a reading's noise is that of this share.
  static constexpr double kSmallestShare = 1e-6;
  [[nodiscard]] bool beyond_instruments() const {
    return all_positive && !compliance && least < kSmallestShare * largest;
  }
  void see_time(double time_s) {
    if (!(time_s > 0.0)) return;
    shortest_s = std::min(shortest_s, time_s);
    longest_s = std::max(longest_s, time_s);
  }
};

FunctionSizes sizes_of_spectrum(const Spectrum& spectrum) {
  FunctionSizes sizes;
  for (std::size_t i = 0; i < spectrum.frequency_Hz.size(); ++i) {
    sizes.see(spectrum.storage[i]);
    sizes.see(spectrum.loss[i]);
    sizes.stiffness = std::max(sizes.stiffness, std::hypot(spectrum.storage[i], spectrum.loss[i]));
    sizes.see_time(0.5 / (std::numbers::pi * spectrum.frequency_Hz[i]));
  }
  return sizes;
}

FunctionSizes sizes_of_step(const Recording& recording) {
  FunctionSizes sizes;
  double least = std::numeric_limits<double>::infinity();  // above 0
  for (std::size_t i = 0; i < recording.response.size(); ++i) {
    sizes.see(recording.response[i]);
    if (recording.response[i] > 0.0) least = std::min(least, recording.response[i]);
    sizes.see_time(recording.time_s[i]);
  }
  sizes.compliance = recording.response_quantity == Quantity::creep_compliance;
  sizes.stiffness = sizes.compliance ? 1.0 / least : sizes.largest;
  return sizes;
}

FunctionSizes sizes_of_function(const MaterialFunction& function) {
  const auto* spectrum = std::get_if<Spectrum>(&function.data);
  const FunctionSizes sizes = spectrum != nullptr
                                  ? sizes_of_spectrum(*spectrum)
                                  : sizes_of_step(std::get<Recording>(function.data));
  if (sizes.stiffness > 0.0 && std::isfinite(sizes.stiffness) && sizes.longest_s > 0.0)
    return sizes;
  throw bad_input(fmt::format("{} '{}'", function.kind(), function.name),
                  "no reading above 0, or no time above 0", "readings of a material");
}

/// @param branch number of the parameter's branch, from 0
FitParameter function_bounds(const LawParameter& p, const FunctionSizes& sizes, int branch,
                             int branches) {
  constexpr double kBeyond = 10.0;  // of the times that were measured
  FitParameter fit;
  fit.name = p.name;
  fit.unit = shown_unit(p.dimension);
  if (p.dimension == Dimension::time) {
    fit.scale = Scale::log;
    fit.lower = sizes.shortest_s / kBeyond;
    fit.upper = sizes.longest_s * kBeyond;
    const double share = (branch + 1.0) / (std::max(branches, 1) + 1.0);
    fit.start = sizes.shortest_s * std::pow(sizes.longest_s / sizes.shortest_s, share);
  } else if (p.dimension == Dimension::dimensionless) {
    fit.scale = Scale::linear;
    fit.lower = p.lower;
    fit.upper = p.upper;
    fit.start = 0.3 * (p.upper + p.lower);
  } else {
    fit.scale = p.linear ? Scale::linear : Scale::log;
    fit.lower = p.linear ? 0.0 : 1e-6 * sizes.stiffness;
    fit.upper = 1e3 * sizes.stiffness;
    fit.start = sizes.stiffness / (branches + 1);
  }
  return readable(std::move(fit));
}

Noise noise_of_function(const MaterialFunction& function, const FunctionSizes& sizes) {
  constexpr double kShare = 0.01;  // its size is estimated
  Noise noise;
  noise.scale_known = false;
  const auto known = [](const std::vector<double>& sd) {
    return !sd.empty() && std::all_of(sd.begin(), sd.end(), [](double s) { return s > 0.0; });
  };
  const auto* spectrum = std::get_if<Spectrum>(&function.data);
  const bool per_row = spectrum != nullptr ? known(spectrum->storage_sd) && known(spectrum->loss_sd)
                                           : known(std::get<Recording>(function.data).response_sd);
  if (per_row) {
    noise.kind = NoiseKind::per_row;
  } else if (function.from_angle) {
    noise.relative = kShare;
    noise.angle_rad = kShare;
  } else if (sizes.all_positive) {
    noise.kind = sizes.beyond_instruments() ? NoiseKind::combined : NoiseKind::relative_to_datum;
    noise.relative = kShare;
    if (sizes.beyond_instruments()) {
      noise.absolute = kShare * FunctionSizes::kSmallestShare * sizes.largest;
    }
  } else {
    noise.kind = NoiseKind::absolute;
    noise.absolute = kShare * sizes.largest;
  }
  return noise;
}

double largest_residual_share(const FitResult& fit) {
  double sum = 0.0, largest = 0.0;
  double count = 0.0;
  for (const FittedDatum& d : fit.data) {
    if (d.datum.held_out) continue;
    sum += std::pow(d.predicted - *d.datum.value, 2);
    largest = std::max(largest, std::abs(*d.datum.value));
    count += 1.0;
  }
  return std::sqrt(sum / count) / largest;
}

constexpr ProtocolSpans kEndlessHold{.hold_s = std::numeric_limits<double>::infinity()};

std::vector<DataSet> data_set_of(const MaterialFunction& function) {
  return {std::visit([](const auto& d) { return DataSet(d); }, function.data)};
}

/// Noise of an instrument whose small readings scatter by more than a share of their size.
/// @param floor see scatter_floor(); none: as function_config() assumes
void add_floor(FitConfig& config, std::optional<double> floor) {
  constexpr double kShare = 0.01;  // its size is estimated
  if (!floor) return;
  Noise& noise = config.data.front().noise;
  noise.kind = NoiseKind::combined;
  noise.relative = kShare;
  noise.absolute = kShare * *floor;
}

/// Limits of the instrument, estimated from the first fits.
struct InstrumentLimits {
  std::optional<double> scatter = std::nullopt;           ///< see scatter_floor()
  std::optional<MagnitudeAndPhase> polar = std::nullopt;  ///< of a spectrum from these
  double to_s = std::numeric_limits<double>::infinity();  ///< behind it readings stand at a floor
};

void set_limits(FitConfig& config, const InstrumentLimits& limits) {
  add_floor(config, limits.scatter);
  if (limits.polar) {
    config.data.front().noise.relative = limits.polar->magnitude;
    config.data.front().noise.angle_rad = limits.polar->phase_rad;
  }
  config.data.front().to_s = limits.to_s;
}

Candidate fit_function(const LawSpec& law, const MaterialFunction& function, SetupOptions setup,
                       const InstrumentLimits& limits) {
  setup.profiles = false;
  // The stiffness of a spring-pot has no value at the step itself: a reading there is a reason
  // against the law, not an error of the file.
  const bool refusal_counts = law.fractional != Fractional::none;
  FitConfig config = function_config(law, function, setup);
  set_limits(config, limits);
  Candidate candidate = fit_candidate(config, data_set_of(function), refusal_counts);
  if (candidate.failed) return candidate;
  candidate.rms_over_peak = largest_residual_share(candidate.fit);
  judge_identified(candidate, kEndlessHold);
  return candidate;
}

/// Assumptions on small readings, and relaxation times outside the measured range.
std::vector<Remark> range_remarks(const FitResult& fit, const FunctionSizes& sizes) {
  std::vector<Remark> remarks;
  if (fit.config.data.front().noise.kind == NoiseKind::combined && sizes.beyond_instruments()) {
    remarks.push_back(
        {"scatter_of_small_readings_assumed",
         fmt::format(
             "the readings span {} decades: those below {} of the largest are taken to scatter as "
             "if "
             "they "
             "had that size, for no instrument reads more decades at once; a column of standard "
             "deviations says otherwise (--sd COLUMN)",
             significant(std::log10(sizes.largest / sizes.least), 2),
             significant(FunctionSizes::kSmallestShare, 1))});
  }
  for (const ParameterResult& p : fit.parameters) {
    if (p.parameter.unit.dimension != Dimension::time) continue;
    const bool early = p.estimate < sizes.shortest_s;
    if (!early && p.estimate <= sizes.longest_s) continue;
    remarks.push_back(
        {"outside_measured_range",
         fmt::format("{} = {} lies outside the measured range ({} s to {} s)", p.parameter.name,
                     in_sized_unit(p, p.estimate), significant(sizes.shortest_s, 3),
                     significant(sizes.longest_s, 3))});
  }
  return remarks;
}

/// A master curve that no law of few branches describes may be a Prony series on stated times, one
/// a decade. A modulus that rises is none.
std::optional<Remark> prony_remark(const MaterialFunction& function, const FitResult& fit,
                                   const SelectionOptions& options) {
  constexpr double kLeastDecades = 3.0, kRise = 0.9;
  constexpr int kMostTimes = 31;
  const auto* step = std::get_if<Recording>(&function.data);
  const FunctionSizes sizes = sizes_of_function(function);
  const bool stated =
      options.only_listed || !options.laws.empty() || !options.setup.times_s.empty();
  const bool described =
      !fit.adequacy || fit.adequacy->verdict != described_name(Described::not_described);
  const bool falls =
      step == nullptr || (!sizes.compliance && step->response.front() >= kRise * sizes.largest);
  const double decades = std::log10(sizes.longest_s / sizes.shortest_s);
  if (stated || described || !falls || decades < kLeastDecades) return std::nullopt;
  const int whole = static_cast<int>(std::lround(decades));
  const auto enough = [&](int times) {
    return times <= kMostTimes && 2 * times <= fit.value_count;
  };
  const int times = enough(2 * whole + 1) ? 2 * whole + 1 : whole + 1;
  if (!enough(times)) return std::nullopt;
  return Remark{"prony_series",
                fmt::format("{} decades of time: a Prony series on stated times may describe "
                            "them: --times \"{} s : {} s : {}\"",
                            significant(decades, 2), significant(sizes.shortest_s, 2),
                            significant(sizes.longest_s, 2), times)};
}

std::vector<LawSpec> linear_family() {
  std::vector<LawSpec> laws;
  constexpr int kMost = 4;
  for (int branches = 0; branches <= kMost; ++branches) {
    LawSpec law;
    law.branches = branches;
    laws.push_back(law);
  }
  for (const Fractional fractional :
       {Fractional::springpot, Fractional::maxwell, Fractional::kelvin_voigt, Fractional::zener,
        Fractional::maxwell_pair, Fractional::kelvin_voigt_pair, Fractional::zener_pair}) {
    LawSpec law;
    law.branches = 0;
    law.fractional = fractional;
    laws.push_back(law);
  }
  return laws;
}

}  // namespace

std::vector<Remark> function_remarks(const FitResult& fit, const DataSet& data) {
  if (const auto* spectrum = std::get_if<Spectrum>(&data))
    return range_remarks(fit, sizes_of_spectrum(*spectrum));
  const auto* step = std::get_if<Recording>(&data);
  if (step == nullptr || !is_step_response(step->response_quantity)) return {};
  return range_remarks(fit, sizes_of_step(*step));
}

std::string MaterialFunction::kind() const {
  if (std::holds_alternative<Spectrum>(data)) return "spectrum";
  return std::get<Recording>(data).response_quantity == Quantity::creep_compliance
             ? "creep compliance"
             : "relaxation modulus";
}

std::optional<MaterialFunction> find_material_function(const std::string& path,
                                                       const ImportOptions& import) {
  MeasuredFile measured = read_measured_file(path, import);
  return material_function_of(path, import, measured);
}

std::optional<MaterialFunction> material_function_of(const std::string& path,
                                                     const ImportOptions& import,
                                                     MeasuredFile& measured) {
  if (auto* spectrum = std::get_if<SpectrumFile>(&measured)) {
    return MaterialFunction{path, std::move(spectrum->spectrum), import,
                            columns_words(spectrum->findings), spectrum->from_angle};
  }
  auto& file = std::get<RecordingFile>(measured);
  if (!is_step_response(file.recording.response_quantity)) return std::nullopt;
  return MaterialFunction{path, std::move(file.recording), import, columns_words(file.findings)};
}

FitConfig function_config(LawSpec law, const MaterialFunction& function,
                          const SetupOptions& options) {
  const FunctionSizes sizes = sizes_of_function(function);
  const auto* spectrum = std::get_if<Spectrum>(&function.data);
  if (law.kernel != Kernel::linear || law.tension != Tension::none) {
    throw bad_input(fmt::format("{} '{}'", function.kind(), function.name),
                    fmt::format("the law {}", law_name(law)),
                    "a law with a linear kernel and no tension: small strains tell no more");
  }
  if (spectrum == nullptr || spectrum->dimension == Dimension::stress) {
    law.drive = Quantity::strain;
    law.response = Quantity::stress;
    law.reference = 1.0;
  }
  const LawModel model(law);
  FitConfig config;
  config.law = law;
  config.title = fmt::format("{}: {}", function.name, law_name(law));
  config.starts = options.starts;
  config.seed = options.seed;
  config.level = options.level;
  config.profiles = options.profiles;
  config.interrupted = options.interrupted;
  int times = 0;
  for (std::size_t i = 0; i < model.law_parameters().size(); ++i) {
    const LawParameter& p = model.law_parameters()[i];
    config.fixed.push_back(p.preset.value_or(0.0));
    if (p.nuisance || p.preset) continue;
    if (const auto time_s = stated_time(p.name, options.times_s)) {
      config.fixed.back() = *time_s;
      continue;
    }
    config.parameters.push_back(
        {function_bounds(p, sizes, times, law.branches), {{i, {}}}, false, {}});
    if (p.dimension == Dimension::time) ++times;
  }
  DataChoice data;
  data.dataset = function.name;
  data.protocol.kind =
      spectrum != nullptr ? ProtocolChoice::Kind::oscillation : ProtocolChoice::Kind::measured;
  data.noise = noise_of_function(function, sizes);
  data.import = function.import;
  config.data.push_back(std::move(data));
  if (const auto* step = std::get_if<Recording>(&function.data)) {
    config.given_starts = function_starts(config, *step);
  }
  return config;
}

namespace {

/// Fits every law under one noise and ranks them.
Selection ranked_laws(const MaterialFunction& function, const SelectionOptions& options,
                      const InstrumentLimits& limits) {
  const std::vector<LawSpec> laws = options.laws.empty() ? linear_family() : options.laws;
  Selection s;
  s.margin = options.margin;
  Progress progress("fitting laws", laws.size());
  for (const LawSpec& law : laws) {
    s.candidates.push_back(fit_function(law, function, options.setup, limits));
    progress.advance();
    const Candidate& made = s.candidates.back();
    const bool branched = law.branches > 0 && law.solid && law.form == BranchForm::parallel;
    if (options.only_listed || made.failed || !branched || !plateau_is_not_told(made.fit)) continue;
    LawSpec fluid = law;
    fluid.solid = false;
    s.candidates.push_back(fit_function(fluid, function, options.setup, limits));
  }
  const auto fitted = std::find_if(s.candidates.begin(), s.candidates.end(),
                                   [](const Candidate& c) { return !c.failed; });
  if (fitted == s.candidates.end()) {
    throw Error(ExitCode::numerical, "fit",
                fmt::format("none of {} laws could be fitted: {}", laws.size(),
                            s.candidates.front().reason));
  }
  s.samples = fitted->fit.value_count;
  s.effective_count = s.samples;
  rank_candidates(s, true);
  return s;
}

}  // namespace

namespace {

std::optional<FloorOfReadings> floor_of(const MaterialFunction& function, const FitResult& fit) {
  const auto* step = std::get_if<Recording>(&function.data);
  const bool modulus = step != nullptr && step->response_quantity == Quantity::relaxation_modulus;
  return modulus ? find_floor(*step, fit) : std::nullopt;
}

}  // namespace

Selection select_law(const MaterialFunction& function, const SelectionOptions& options) {
  InstrumentLimits limits;
  Selection s = ranked_laws(function, options, limits);
  const auto standing = floor_of(function, s.candidates[s.best_bic].fit);
  if (standing) {
    limits.to_s = standing->last_s;
    s = ranked_laws(function, options, limits);
  }
  limits.polar = scatter_of_magnitude_and_phase(s.candidates[s.best_bic].fit);
  if (limits.polar) s = ranked_laws(function, options, limits);
  limits.scatter = scatter_floor(s.candidates[s.best_bic].fit);
  const bool scattered = limits.scatter.has_value();
  if (!scattered && standing) {
    limits.scatter = floor_as_scatter(s.candidates[s.best_bic].fit, *standing);
  }
  const std::optional<double>& floor = limits.scatter;
  if (floor) s = ranked_laws(function, options, limits);
  const auto with_profiles = [&](const LawSpec& law) {
    FitConfig config = function_config(law, function, options.setup);
    set_limits(config, limits);
    return run_fit(config, data_set_of(function));
  };
  settle_choice(s, kEndlessHold, options.setup.profiles ? ProfiledFit(with_profiles) : nullptr);
  for (const auto i : {std::optional(s.recommended), s.preferred}) {
    const bool times_stated = !options.setup.times_s.empty();
    if (!i || !doubt_small_plateau(s.candidates[*i].fit, times_stated)) continue;
    LawSpec fluid = s.candidates[*i].law;
    if (fluid.branches == 0 || fluid.form != BranchForm::parallel) continue;
    fluid.solid = false;
    const Candidate without = fit_function(fluid, function, options.setup, limits);
    if (!without.failed) doubt_what_depends_on_plateau(s.candidates[*i].fit, without.fit);
  }
  state_preferred(s);
  state_scatter(s);
  const Candidate& chosen = s.candidates[s.recommended];
  s.remarks = range_remarks(chosen.fit, sizes_of_function(function));
  auto prony = s.preferred ? std::nullopt : prony_remark(function, chosen.fit, options);
  if (prony) s.remarks.push_back(*std::move(prony));
  if (standing) {
    const Unit unit = shown_unit(quantity_dimension(chosen.fit.data.front().datum.quantity));
    s.remarks.push_back(
        {"floor_of_instrument",
         fmt::format("{} readings are all the least, {}, which rounding does not make: the "
                     "instrument reads nothing below; {} readings behind {} s, from the first of "
                     "them on, are left out",
                     standing->count, with_unit(significant(standing->value / unit.to_si, 4), unit),
                     standing->behind, significant(standing->last_s, 4))});
  }
  if (limits.polar) s.remarks.push_back(limits.polar->remark());
  if (floor && !scattered) {
    s.remarks.push_back({"scatter_near_floor",
                         "readings little above the least are taken to scatter by as much as that, "
                         "beside their share"});
  } else if (floor) {
    const Unit unit = shown_unit(quantity_dimension(chosen.fit.data.front().datum.quantity));
    const bool alike = *floor > sizes_of_function(function).largest;
    s.remarks.push_back(
        {"scatter_of_small_readings",
         alike ? std::string("the readings scatter alike: the noise is taken to be equal for all")
               : fmt::format("small readings scatter by more than their share: the noise is taken "
                             "to be that share of a reading and of {} together",
                             with_unit(significant(*floor / unit.to_si, 2), unit))});
  }
  if (chosen.fit.adequacy) s.summary.push_back(chosen.fit.adequacy->summary);
  s.summary.push_back(fmt::format(
      "{} of {} readings; {} {} ({}): {} parameters, rms residual {} % of the largest "
      "reading",
      function.kind(), s.samples, least_law_words(s, "they"), law_name(chosen.law),
      law_words(chosen.law), chosen.parameters - 1, significant(100.0 * chosen.rms_over_peak, 3)));
  const Candidate& best = s.candidates[s.best_bic];
  if (s.recommended != s.best_bic && !s.preferred) {
    s.summary.push_back(fmt::format("{} has the lowest BIC, by {}{}{}", law_name(best.law),
                                    significant(chosen.delta_bic, 3), best.identified ? "" : "; ",
                                    best.reason));
  }
  keep_choice(s);
  return s;
}

}  // namespace tpm::fit
