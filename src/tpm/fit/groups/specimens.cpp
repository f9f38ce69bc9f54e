#include "tpm/fit/groups/specimens.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/sample_digest.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/select/gate.hpp"
#include "tpm/fit/select/history_before_window.hpp"
#include "tpm/work/give_up.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

/// Evidence for a law over all recordings.
struct Tally {
  LawSpec law;
  double bic = 0.0;
  int parameters = 0;
  int identified = 0;
  int recordings = 0;  ///< that it was fitted to
  int refuted = 0;     ///< by their unloading
};

std::vector<Tally> tally_laws(std::span<const PreparedRecording> recordings,
                              SelectionOptions options) {
  options.held_out = false;
  options.drift_answers = false;
  options.setup.profiles = false;
  std::vector<Tally> tallies;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const Selection selection = select_law(recordings.subspan(i, 1), options);
    for (const Candidate& c : selection.candidates) {
      const auto found = std::ranges::find_if(
          tallies, [&](const Tally& t) { return law_name(t.law) == law_name(c.law); });
      Tally& tally =
          found == tallies.end() ? tallies.emplace_back(Tally{c.law, 0, 0, 0, 0, 0}) : *found;
      if (c.failed) continue;
      tally.bic += c.delta_bic;
      tally.parameters += c.parameters;
      tally.identified += c.identified ? 1 : 0;
      tally.refuted += c.unloading_refutes ? 1 : 0;
      ++tally.recordings;
    }
  }
  return tallies;
}

std::pair<LawSpec, std::string> common_law(std::span<const PreparedRecording> recordings,
                                           const SelectionOptions& options) {
  const std::vector<Tally> tallies = tally_laws(recordings, options);
  const double margin = options.margin * static_cast<double>(recordings.size());
  const auto count = static_cast<int>(recordings.size());
  const double decisive = kDecisiveBic * static_cast<double>(recordings.size());
  const Tally* ahead = nullptr;
  for (const Tally& t : tallies) {
    if (t.recordings == count && (ahead == nullptr || t.bic < ahead->bic)) ahead = &t;
  }
  // As in least_within().
  const bool refuted = ahead != nullptr && 2 * ahead->refuted > count;
  for (const bool only_identified : {true, false}) {
    const auto eligible = [&](const Tally& t) {
      return t.recordings == count && (!only_identified || 2 * t.identified > count) &&
             (!refuted || t.bic - ahead->bic <= decisive);
    };
    double best = std::numeric_limits<double>::infinity();
    for (const Tally& t : tallies) {
      if (eligible(t)) best = std::min(best, t.bic);
    }
    const Tally* chosen = nullptr;
    for (const Tally& t : tallies) {
      if (!eligible(t) || t.bic - best > margin) continue;
      if (chosen == nullptr || t.parameters < chosen->parameters) chosen = &t;
    }
    if (chosen == nullptr) continue;
    std::string preferred;
    if (chosen->bic - ahead->bic > decisive) {
      preferred = fmt::format(
          "; the data prefer {}, by {} in that sum, but identify its parameters in {} of them",
          law_name(ahead->law), significant(chosen->bic - ahead->bic, 3), ahead->identified);
    }
    return {
        chosen->law,
        fmt::format("{} is the simplest law within {} of the least sum of BIC over {} recordings"
                    "{}; its parameters are identified in {} of them{}",
                    law_name(chosen->law), significant(margin, 3), recordings.size(),
                    only_identified ? " among the laws that most of them identify"
                                    : ", but no law is identified in most of them",
                    chosen->identified, preferred)};
  }
  throw Error(ExitCode::numerical, "fit", "no law could be fitted to every recording");
}

std::optional<std::size_t> place_of(const FitResult& fit, const std::string& name) {
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    if (fit.parameters[i].parameter.name == name) return i;
  }
  return std::nullopt;
}

/// See SpecimenRow::place.
std::vector<std::size_t> branches_by_time(const LawSpec& law, const FitResult& fit) {
  std::vector<std::size_t> place(fit.parameters.size());
  std::iota(place.begin(), place.end(), std::size_t{0});
  std::vector<std::pair<std::size_t, std::size_t>> branches;  // places of k and tau
  for (int i = 1; i <= law.branches; ++i) {
    const auto k = place_of(fit, fmt::format("k{}", i));
    const auto tau = place_of(fit, fmt::format("tau{}", i));
    if (k && tau) branches.emplace_back(*k, *tau);
  }
  auto sorted = branches;
  std::ranges::stable_sort(sorted, {},
                           [&](const auto& a) { return fit.parameters[a.second].estimate; });
  for (std::size_t i = 0; i < branches.size(); ++i) {
    place[branches[i].first] = sorted[i].first;
    place[branches[i].second] = sorted[i].second;
  }
  return place;
}

/// @param rows how many specimens share the level of the test of adequacy
SpecimenRow fit_specimen(const LawSpec& law, std::span<const PreparedRecording> one,
                         std::size_t rows, const SetupOptions& setup) {
  SpecimenRow row;
  row.name = one.front().name;
  row.specimen = one.front().specimen;
  row.reason = gave_up([&] {
    row.fit = run_fit(recording_config(law, one, setup), data_sets(one));
    const auto both = give_both_drift_answers(*row.fit, one);
    if (both) row.fit->remarks.push_back({"drift_not_separable", drift_words(*both, *row.fit)});
    doubt_history(*row.fit, History::unread);
    state_adequacy(*row.fit, one, rows);
    state_hysteresis(*row.fit);
    row.place = branches_by_time(law, *row.fit);
  });
  return row;
}

void require_one_reference(const SpecimenRow& first, const SpecimenRow& row) {
  if (!row.fit) return;
  const LawSpec& a = first.fit->config.law.value();
  const LawSpec& b = row.fit->config.law.value();
  if (!depends_on_reference(a) || a.reference == b.reference) return;
  throw bad_input(fmt::format("recording '{}'", row.name),
                  fmt::format("its {}", reference_words(b)),
                  fmt::format("those of '{}': {}", first.name, reference_words(a)));
}

/// Effects on the parameter, from those on theta.
std::string in_natural_words(const PooledParameter& p) {
  constexpr std::string_view kTheta = " in theta";
  std::string words = p.effects.summary;
  const std::string_view si = si_symbol(p.parameter.unit.dimension);
  const std::string natural = p.parameter.scale == Scale::log
                                  ? std::string(" in the natural logarithm")
                                  : fmt::format("{}{} (SI)", si.empty() ? "" : " ", si);
  for (auto at = words.find(kTheta); at != std::string::npos; at = words.find(kTheta, at + 1)) {
    words.replace(at, kTheta.size(), natural);
  }
  return words;
}

}  // namespace

/// The slack length of a stretched strip is its own, but tells about it; contact and offset do not.
bool is_of_recording(const ParameterResult& p) {
  return p.nuisance && p.parameter.name != "slack_length";
}

bool is_not_described(const FitResult& fit) {
  return fit.adequacy && fit.adequacy->is_rejected();
}

std::string pooled_doubt(const std::optional<Remark>& only_without, int not_described) {
  std::string words;
  if (only_without) words = fmt::format("not identified: {}: not separable", only_without->text);
  if (not_described > 0) {
    words += words.empty() ? "" : "; ";
    words += "only if the law described the data";
  }
  return words;
}

void require_distinct_readings(std::span<const PreparedRecording> recordings) {
  std::vector<std::string> seen;
  for (const PreparedRecording& r : recordings) {
    std::string numbers = samples_sha256(r.recording);
    if (const auto same = std::ranges::find(seen, numbers); same != seen.end()) {
      const auto place = static_cast<std::size_t>(same - seen.begin());
      throw bad_input(r.name, fmt::format("has the readings of '{}'", recordings[place].name),
                      "each recording once: a copy is no second specimen");
    }
    seen.push_back(std::move(numbers));
  }
}

ParameterEstimates parameter_estimates(std::span<const SpecimenRow> rows, const SpecimenRow& like,
                                       std::size_t i) {
  ParameterEstimates found;
  found.parameter = like.fit.value().parameters[i].parameter;
  FitParameter& parameter = found.parameter;
  // A stiffness varies between specimens by factors, not by differences.
  parameter.scale = parameter.lower < 0.0 ? Scale::linear : Scale::log;
  std::vector<SpecimenEstimate> doubtful;
  int doubtful_not_described = 0;
  for (const SpecimenRow& row : rows) {
    if (!row.fit) continue;
    const ParameterResult& r = row.parameter(i);
    const bool usable = r.standard_error && !r.at_lower_bound && !r.at_upper_bound &&
                        r.conditional_on.empty() && !r.unconfirmed &&
                        (parameter.scale == Scale::linear || r.estimate > 0.0);
    if (!usable) {
      ++found.left_out;
      continue;
    }
    const double slope = parameter.scale == Scale::log ? r.estimate : 1.0;
    const bool separable = !r.not_separable;
    if (!separable) {
      found.doubt = r.not_separable;
      ++found.not_separable;
    }
    if (r.only_if_described) ++(separable ? found.not_described : doubtful_not_described);
    (separable ? found.estimates : doubtful)
        .push_back(
            {row.name, parameter.theta(r.estimate), *r.standard_error / slope, row.specimen});
  }
  if (found.estimates.empty()) {
    found.estimates = std::move(doubtful);
    found.only_without = found.doubt;
    found.not_described = doubtful_not_described;
  }
  return found;
}

std::vector<PooledParameter> pool_specimens(const std::vector<SpecimenRow>& rows, double level) {
  std::vector<PooledParameter> pooled;
  const auto first = std::find_if(rows.begin(), rows.end(), [](const auto& r) { return !!r.fit; });
  if (first == rows.end()) return pooled;
  for (const SpecimenRow& row : rows) require_one_reference(*first, row);
  for (std::size_t i = 0; i < first->fit->parameters.size(); ++i) {
    if (is_of_recording(first->fit->parameters[i])) continue;
    const ParameterEstimates found = parameter_estimates(rows, *first, i);
    if (found.estimates.empty()) continue;
    PooledParameter p{found.parameter,    random_effects_of_repeats(found.estimates, level),
                      found.left_out,     found.not_separable,
                      found.only_without, found.not_described};
    p.effects.summary = in_natural_words(p);
    if (p.only_without) {
      p.effects.summary +=
          fmt::format("; not identified: {}: not separable in any recording", p.only_without->text);
    } else if (p.not_separable > 0) {
      p.effects.summary +=
          fmt::format("; {} more left out: {}: not separable", p.not_separable, found.doubt->text);
    }
    if (p.not_described > 0) {
      p.effects.summary += fmt::format(
          "; this supposes that the law describes every recording: {} of {} it does not",
          p.not_described, found.estimates.size());
    }
    pooled.push_back(std::move(p));
  }
  return pooled;
}

SpecimenStudy study_specimens(std::span<const PreparedRecording> recordings,
                              const std::optional<LawSpec>& law, SelectionOptions options) {
  require_distinct_readings(recordings);
  SpecimenStudy study;
  if (!options.setup.reference) options.setup.reference = common_reference(recordings);
  if (law) {
    study.law = *law;
    study.why = fmt::format("{} was asked for", law_name(*law));
  } else {
    std::tie(study.law, study.why) = common_law(recordings, options);
  }
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    study.rows.push_back(
        fit_specimen(study.law, recordings.subspan(i, 1), recordings.size(), options.setup));
  }
  study.law.drive = law_drive(recordings.front().recording);
  study.law.response = law_response(recordings.front().recording);
  study.law.reference = *options.setup.reference;
  study.pooled = pool_specimens(study.rows, options.setup.level);
  study.level = options.setup.level;
  return study;
}

Json to_json(const SpecimenStudy& study) {
  Json j{{"law", law_name(study.law)}, {"why", study.why}};
  j[si_key(study.law.drive, "reference")] = rounded(study.law.reference);
  j["coefficients_depend_on_reference"] = depends_on_reference(study.law);
  j["recordings"] = array_json(study.rows, [](const SpecimenRow& row) {
    Json entry{{"recording", row.name}, {"fitted", row.fit.has_value()}};
    if (!row.specimen.empty()) entry["specimen"] = row.specimen;
    if (row.fit) {
      entry["fit"] = to_json(*row.fit);
      Json order = Json::array();
      for (std::size_t i = 0; i < row.place.size(); ++i) {
        order.push_back(row.parameter(i).parameter.name);
      }
      entry["pooled_as"] = std::move(order);
    } else {
      entry["reason"] = row.reason;
    }
    return entry;
  });
  Json pooled = Json::array();
  for (const PooledParameter& p : study.pooled) {
    const RandomEffects& e = p.effects;
    Json entry{{"name", p.parameter.name},
               {"unit", si_symbol(p.parameter.unit.dimension)},
               {"typical_SI", rounded(p.parameter.natural(e.mean))},
               {"interval_SI",
                {rounded(p.parameter.natural(e.interval.lower)),
                 rounded(p.parameter.natural(e.interval.upper))}},
               {"confidence_level", study.level},
               {"specimens", e.specimens},
               {"left_out", p.left_out},
               {"not_separable", p.not_separable},
               {"identified", p.identified()},
               {"summary", e.summary}};
    if (p.only_without) entry["only_without"] = remark_json(*p.only_without);
    if (p.not_described > 0) entry["only_if_described"] = true;
    const char* of = p.parameter.scale == Scale::log ? "of_log" : "SI";
    const auto sd_key = [&](const char* between) {
      return fmt::format("between_{}_sd_{}", between, of);
    };
    if (e.tau_squared) entry[sd_key("specimens")] = rounded(std::sqrt(*e.tau_squared));
    if (e.i_squared) entry["i_squared"] = rounded(*e.i_squared);
    if (e.q_p_value) entry["spread_p_value"] = rounded(*e.q_p_value);
    if (e.repeat_variance) {
      entry[sd_key("repeats")] = rounded(std::sqrt(*e.repeat_variance));
      entry["repeat_degrees_of_freedom"] = e.repeat_degrees;
    }
    if (e.new_specimen) {
      entry["new_specimen_SI"] = {rounded(p.parameter.natural(e.new_specimen->lower)),
                                  rounded(p.parameter.natural(e.new_specimen->upper))};
    }
    pooled.push_back(std::move(entry));
  }
  j["pooled"] = std::move(pooled);
  return j;
}

namespace {

/// Number of recordings that the law does not describe, and of those without a verdict.
std::string adequacy_words(const SpecimenStudy& study) {
  std::string text;
  const auto fitted = std::ranges::count_if(study.rows, [](const auto& r) { return !!r.fit; });
  const auto say = [&](std::string_view verdict, std::string_view words) {
    const auto count = std::ranges::count_if(study.rows, [&](const SpecimenRow& r) {
      return r.fit && r.fit->adequacy && r.fit->adequacy->verdict == verdict;
    });
    if (count > 0) text += fmt::format("{} of {} recordings: {}\n", count, fitted, words);
  };
  say("not_described",
      "no law tried describes them; what is pooled supposes that the law described them");
  say("not_judged",
      "adequacy cannot be judged: the readings before the load are too few, or not at rest");
  return text;
}

std::string shown_name(const SpecimenRow& row) {
  return row.specimen.empty() ? row.name : fmt::format("{} [{}]", row.name, row.specimen);
}

}  // namespace

std::string to_terminal_text(const SpecimenStudy& study) {
  std::string text = adequacy_words(study);
  text += study.why + "\n";
  if (depends_on_reference(study.law)) text += reference_words(study.law) + "\n";
  text += fmt::format("\n{:<32} {:>9}", "recording", "rms/peak");
  const auto first = std::find_if(study.rows.begin(), study.rows.end(),
                                  [](const auto& r) { return r.fit.has_value(); });
  if (first == study.rows.end()) {
    text += "\n";
  } else {
    for (const ParameterResult& p : first->fit->parameters) {
      const std::string& unit = p.parameter.unit.symbol;
      text += fmt::format(" {:>22}", unit.empty() ? p.parameter.name
                                                  : fmt::format("{}, {}", p.parameter.name, unit));
    }
    text += "\n";
  }
  for (const SpecimenRow& row : study.rows) {
    if (!row.fit) {
      text += fmt::format("{:<32} {}\n", shown_name(row), row.reason);
      continue;
    }
    const RecordingFit& r = row.fit->recordings.front();
    text += fmt::format("{:<32} {:>9}", shown_name(row),
                        significant(100.0 * r.rms_residual / r.peak, 3) + " %");
    for (std::size_t i = 0; i < row.place.size(); ++i) {
      const ParameterResult& p = row.parameter(i);
      const double unit = p.parameter.unit.to_si;
      text += fmt::format(
          " {:>22}", p.standard_error ? fmt::format("{} +- {}", significant(p.estimate / unit, 4),
                                                    significant(*p.standard_error / unit, 2))
                                      : significant(p.estimate / unit, 4));
    }
    if (row.fit->adequacy && !row.fit->adequacy->is_adequate()) {
      text += fmt::format("  {}", row.fit->adequacy->summary);
    }
    text += "\n";
  }
  text += fmt::format(
      "+- is one linearised standard error; of the file's rms residual the share of its peak\n\n"
      "pooled (random effects): a typical specimen (its {0:.4g} % interval), and where {0:.4g} % "
      "of "
      "new specimens are expected\n",
      100.0 * study.level);
  if (depends_on_reference(study.law)) text += reference_words(study.law) + "\n";
  for (const PooledParameter& p : study.pooled) {
    const double unit = p.parameter.unit.to_si;
    const auto shown = [&](double theta) {
      return significant(p.parameter.natural(theta) / unit, 4);
    };
    text += fmt::format("{:<14} {} {} ({} .. {})", p.parameter.name, shown(p.effects.mean),
                        p.parameter.unit.symbol, shown(p.effects.interval.lower),
                        shown(p.effects.interval.upper));
    if (p.effects.new_specimen) {
      text += fmt::format(", new: {} .. {} {}", shown(p.effects.new_specimen->lower),
                          shown(p.effects.new_specimen->upper), p.parameter.unit.symbol);
    }
    if (p.left_out > 0) text += fmt::format(", left out: {}", p.left_out);
    text += fmt::format("\n  {}\n", p.effects.summary);
  }
  return text;
}

}  // namespace tpm::fit
