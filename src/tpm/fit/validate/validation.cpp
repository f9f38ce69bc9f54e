#include "tpm/fit/validate/validation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/lists.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/recording/loading_sense.hpp"
#include "tpm/fit/sample_digest.hpp"
#include "tpm/fit/validate/calibration_covariance.hpp"
#include "tpm/fit/validate/fitted_copy.hpp"
#include "tpm/fit/validate/instrument_effects.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

Applicability motion_of(const PreparedRecording& recording, const RecordingParts& parts,
                        double contact) {
  const Recording& r = recording.recording;
  const std::vector<double>& depth = is_load(r.drive_quantity) ? r.response : r.drive;
  Applicability a;
  const std::size_t last = std::max(parts.hold_last.value_or(parts.ramp_last), parts.loop_last);
  for (std::size_t i = parts.ramp_first; i <= last; ++i) {
    a.depth = std::max(a.depth, depth[i] - contact);
  }
  a.duration_s = r.time_s[last] - r.time_s[parts.ramp_first];
  const double time = r.time_s[parts.ramp_last] - r.time_s[parts.ramp_first];
  if (time > 0.0) a.rate = (depth[parts.ramp_last] - depth[parts.ramp_first]) / time;
  return a;
}

std::string drive_text(double value, const LawSpec& spec) {
  const Unit unit = shown_unit(quantity_dimension(spec.drive));
  return with_unit(significant(value / unit.to_si, 3), unit);
}

void compare_with_calibration(Applicability& a, const ValidationRequest& request) {
  const LawFile& law = request.law;
  a.fitted_depth = law.fitted_to;
  if (law.uncertainty->duration_s > 0.0) a.fitted_duration_s = law.uncertainty->duration_s;
  for (const CalibrationData::File& file : request.calibration.files) {
    if (!file.recording) continue;
    const double rate = motion_of(*file.recording, parts_of(*file.recording), 0.0).rate;
    a.slowest = std::min(a.slowest.value_or(rate), rate);
    a.fastest = std::max(a.fastest.value_or(rate), rate);
  }
  constexpr double kSlack = 1.02;  // a depth is not known better
  if (!a.fitted_depth) {
    a.unknown.push_back("depth");
  } else if (a.depth > kSlack * *a.fitted_depth) {
    a.outside.push_back({"depth", fmt::format("{} deep, {} times the {} of the calibration",
                                              drive_text(a.depth, law.spec),
                                              significant(a.depth / *a.fitted_depth, 2),
                                              drive_text(*a.fitted_depth, law.spec))});
  }
  if (!a.fitted_duration_s) {
    a.unknown.push_back("duration");
  } else if (a.duration_s > kSlack * *a.fitted_duration_s) {
    a.outside.push_back(
        {"duration", fmt::format("lasts {} s, {} times the {} s of the calibration",
                                 significant(a.duration_s, 3),
                                 significant(a.duration_s / *a.fitted_duration_s, 2),
                                 significant(*a.fitted_duration_s, 3))});
  }
  if (!a.fastest) {
    a.unknown.push_back("rate");
  } else if (a.rate > kSlack * *a.fastest || a.rate * kSlack < *a.slowest) {
    const bool fast = a.rate > *a.fastest;
    const double nearest = fast ? *a.fastest : *a.slowest;
    a.outside.push_back(
        {"rate", fmt::format("ramp of {}/s, {} times the {} of the calibration",
                             drive_text(a.rate, law.spec), significant(a.rate / nearest, 2),
                             fast ? "fastest" : "slowest")});
  }
}

bool same_samples(const Recording& a, const Recording& b) {
  return a.time_s == b.time_s && a.drive == b.drive && a.response == b.response;
}

bool was_fitted(const ValidationRequest& request, const PreparedRecording& recording) {
  const std::string& sha256 = recording.recording.header.sha256;
  const std::string numbers = samples_sha256(recording.recording);
  return std::ranges::any_of(request.calibration.files, [&](const CalibrationData::File& file) {
    return (!sha256.empty() && file.sha256 == sha256) || file.samples_sha256 == numbers ||
           (file.recording && same_samples(file.recording->recording, recording.recording));
  });
}

/// The fitted data that contain a recording; empty if none were found.
std::string copy_words(const ValidationRequest& request, const PreparedRecording& recording,
                       const RecordingComparison& compared) {
  constexpr double kMostOfIndependent = 0.5;
  const auto turned = [&](const PreparedRecording& r) {
    return compared.creep ? as_load_imposed(r).recording : r.recording;
  };
  for (const CalibrationData::File& file : request.calibration.files) {
    if (!file.recording) continue;
    const double share =
        share_of_readings(turned(recording), turned(*file.recording), compared.scatter.sigma);
    if (share < kMostOfIndependent) continue;
    return fmt::format("{} % of the readings of {} are those of {}, which the law was fitted to",
                       significant(100.0 * share, 3), recording.name, file.name);
  }
  return {};
}

/// A measured value that is hundreds of times the simulated one, or less; empty: it is not.
std::string unit_words(const RecordingComparison& r) {
  constexpr double kFar = 300.0;
  for (const QuantityComparison& q : r.quantities) {
    if (q.quantity.kind != QuantityKind::peak || q.simulated == 0.0) continue;
    const double ratio = std::abs(q.measured / q.simulated);
    const bool clear = std::abs(q.measured) > q.e.expanded();
    if (ratio < kFar && (ratio * kFar > 1.0 || !clear)) continue;
    return fmt::format("{}: D of the {} is {} times S; look at the units of its columns", r.name,
                       q.name, significant(ratio, 2));
  }
  return {};
}

/// Where --contact-force defines contact here and the fit estimated it; empty: it does not.
std::string threshold_words(const ValidationRequest& request) {
  if (!request.contact_by_threshold) return {};
  const std::vector<LawParameter> table = law_parameters(request.law.spec);
  const LawUncertainty& u = *request.law.uncertainty;
  const bool alone = std::ranges::any_of(
      u.place, [&](std::size_t place) { return table[place].name == "contact"; });
  // Contacts of several recordings are parameters, also where --contact-force holds them.
  bool of_file = false;
  for (std::size_t i = 0; i < u.data.size(); ++i) {
    const FittedFile& file = u.data[i];
    if (!file.contact || std::ranges::find(file.held, "contact") != file.held.end()) continue;
    const auto& files = request.calibration.files;
    const bool found = i < files.size() && files[i].recording;
    if (u.data.size() > 1 && !found) {
      return "whether the law was fitted with --contact-force is not known without its recordings; "
             "if it was not, the difference is in E";
    }
    of_file = of_file || !found || !is_at_threshold(*files[i].recording, *file.contact);
  }
  if (!alone && !of_file) return {};
  return "the law was fitted without --contact-force: its depths count from the onset, those of "
         "the recordings from where the force is passed; the difference is in E";
}

/// Differences of a calibration's recordings from the law, each taken for one specimen. Shares of
/// the law, so it answers in place of an organ.
/// Quantities whose spread between specimens is estimated as 0: how large a one is not excluded.
void add_unseen_spread(Validation& v) {
  std::string names;
  double at_most = 0.0;
  int recordings = 0;
  for (const SpecimenSpread& s : v.specimens) {
    if (s.tau() > 0.0) continue;
    names += fmt::format("{}{}", names.empty() ? "" : ", ",
                         s.creep ? quantity_words(s.quantity, v.spec.response, v.spec.drive)
                                 : quantity_words(s.quantity, v.spec.drive, v.spec.response));
    at_most = std::max(at_most, s.tau_at_most());
    recordings = std::max(recordings, s.recordings);
  }
  if (names.empty()) return;
  v.remarks.push_back(
      {"spread_not_excluded",
       fmt::format(
           "no spread between the {} recordings of the calibration is seen in {}: one of {} "
           "% of S is not excluded",
           recordings, names, significant(100.0 * at_most, 2))});
}

std::vector<SpecimenSpread> spread_of_calibration(const ValidationRequest& request,
                                                  const LawFile& law) {
  const std::vector<CalibrationData::File>& files = request.calibration.files;
  if (!request.presses.empty()) {
    throw Error(ExitCode::usage, "--new-specimen", "with a session",
                "recordings of a specimen that the law was not fitted to");
  }
  constexpr std::size_t kFewest = 2;
  if (files.size() < kFewest) {
    throw Error(ExitCode::usage, "--new-specimen",
                fmt::format("the law was fitted to {} recording{}", files.size(),
                            files.size() == 1 ? "" : "s"),
                "a law fitted to two recordings or more, each of another specimen");
  }
  std::vector<RecordingComparison> compared;
  std::vector<int> readings;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!files[i].recording) {
      throw Error(ExitCode::usage, "--new-specimen",
                  fmt::format("the calibration's {} was not found, or not read", files[i].name),
                  "all recordings of the calibration beside the law, as they were fitted");
    }
    ComparisonOptions options;
    options.quantities = request.quantities;
    options.placement = request.placement;
    if (request.contact_by_threshold) options.known = KnownPlacement::threshold;
    options.calibration_data = true;
    compared.push_back(compare_with_recording(law, *files[i].recording, options));
    const auto& data = law.uncertainty->data;
    readings.push_back(i < data.size() && data[i].readings > 0 ? data[i].readings : 1);
  }
  return specimen_spreads(compared, readings);
}

/// All of them, or none.
std::vector<PreparedRecording> found_recordings(const CalibrationData& calibration) {
  std::vector<PreparedRecording> found;
  for (const CalibrationData::File& file : calibration.files) {
    if (!file.recording) return {};
    found.push_back(*file.recording);
  }
  return found;
}

/// Of several recordings: the verdict on the means and on what only one of them has, by Holm over
/// all of these.
ModelVerdict judge_together(Validation& v, const std::vector<RecordingComparison>& unseen) {
  for (const RecordingComparison& r : unseen) {
    for (QuantityComparison q : r.quantities) {
      const auto has = [&](const RecordingComparison& other) {
        return same_quantity(other, q) != nullptr;
      };
      if (std::ranges::count_if(unseen, has) > 1) continue;
      q.name = fmt::format("{}: {}", r.name, q.name);
      v.alone.push_back(std::move(q));
    }
  }
  std::vector<QuantityComparison> all = v.alone;
  for (const PooledQuantity& p : v.pooled) {
    QuantityComparison q;
    q.verdict = p.verdict;
    q.limit = p.limit;
    q.p_value = p.p_value;
    all.push_back(std::move(q));
  }
  std::vector<double> p_values;
  for (const QuantityComparison& q : all) {
    p_values.push_back(q.verdict == ModelVerdict::no_requirement ? 1.0 : q.p_value);
  }
  const std::vector<bool> rejected = holm_rejects(p_values);
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].rejected = rejected[i];
    if (i < v.alone.size()) {
      v.alone[i].rejected = rejected[i];
    } else {
      v.pooled[i - v.alone.size()].rejected = rejected[i];
    }
  }
  return verdict_of_all(all);
}

/// A requirement in the unit of nothing that is compared says nothing, whatever else is found.
void require_fitting_unit(const Validation& v, const std::optional<Requirement>& requirement) {
  if (!requirement) return;
  std::vector<std::string> units;
  for (const RecordingComparison& r : v.recordings) {
    for (const QuantityComparison& q : r.quantities) {
      if (q.limit) return;
      if (!q.unit.symbol.empty()) units.push_back(q.unit.symbol);
    }
  }
  const std::vector<std::string> each = each_once(units, [](const std::string& u) { return u; });
  throw Error(ExitCode::usage, "--require",
              fmt::format("{} has the unit of no quantity that is compared", requirement->stated),
              fmt::format("a share such as 10%{}{}", each.empty() ? "" : ", or an amount in ",
                          fmt::join(each, " or ")));
}

/// The same readings twice would count as two that agree.
void require_each_once(const std::vector<PreparedRecording>& recordings) {
  std::vector<std::string> seen;
  for (const PreparedRecording& r : recordings) {
    std::string numbers = samples_sha256(r.recording);
    if (const auto same = std::ranges::find(seen, numbers); same != seen.end()) {
      throw bad_input(fmt::format("recording '{}'", r.name),
                      fmt::format("has the readings of '{}'",
                                  recordings[static_cast<std::size_t>(same - seen.begin())].name),
                      "each recording once");
    }
    seen.push_back(std::move(numbers));
  }
}

}  // namespace

std::vector<RenderingError> rendering_errors(const Validation& presses) {
  std::vector<RenderingError> all;
  for (const RecordingComparison& r : presses.recordings) {
    for (const QuantityComparison& q : r.quantities) {
      if (q.simulated == 0.0) continue;
      auto found = std::ranges::find(all, q.quantity, &RenderingError::quantity);
      if (found == all.end()) found = all.insert(all.end(), {q.quantity});
      found->mean += q.measured / q.simulated - 1.0;
      ++found->presses;
    }
  }
  for (RenderingError& e : all) {
    e.mean /= static_cast<double>(e.presses);
    for (const RecordingComparison& r : presses.recordings) {
      for (const QuantityComparison& q : r.quantities) {
        if (q.quantity != e.quantity || q.simulated == 0.0) continue;
        const double own = q.measured / q.simulated - 1.0;
        e.limit = std::max(e.limit, std::abs(e.presses > 1 ? own - e.mean : own));
      }
    }
  }
  return all;
}

namespace {

void require_valid(const ValidationRequest& request) {
  if (!request.law.uncertainty) {
    throw bad_input(request.law_file, "carries no uncertainty of a fit",
                    "a law.json that tpm fit has written; data that determine all parameters");
  }
  if (request.at && std::ranges::find(request.recordings, *request.at, &PreparedRecording::name) ==
                        request.recordings.end()) {
    throw Error(ExitCode::usage, "--at-recording", fmt::format("'{}'", *request.at),
                "the name of one of the recordings");
  }
  if (request.presses.empty()) require_each_once(request.recordings);
}

/// Where the uncertainty of the law's parameters comes from.
/// @param again the covariance was computed again, from the calibration's recordings
std::string input_words(const ValidationRequest& request, const LawFile& law, bool again) {
  std::string words = again ? "the scatter of the calibration's recordings (sandwich)"
                            : "the covariance in the law file";
  if (request.contact_by_threshold && threshold_words(request).empty()) {
    words += again ? ", with one step of the drive at the contact of each"
                   : ", without the step of the drive at the calibration's contact";
  }
  if (request.organ && !request.organ->times_follow() && law.spec.branches > 0) {
    words += "; S follows the relaxation times, which the bonds keep, as the law does";
  }
  if (request.new_specimen) {
    words += fmt::format("; and the spread between its {} recordings, each a specimen",
                         request.calibration.files.size());
  }
  return words;
}

/// What is compared with what, and what the request says of it.
Validation validation_of(const ValidationRequest& request, const LawFile& law) {
  Validation v;
  v.new_specimen = request.new_specimen;
  if (request.new_specimen) v.specimens = spread_of_calibration(request, law);
  v.spec = law.spec;
  v.subject = law_words(law.spec);
  if (request.organ)
    v.subject += fmt::format(", on an organ of {} spheres", request.organ->spheres());
  v.session = request.session;
  v.rendering = request.rendering;
  v.law_file = request.law_file;
  v.law_sha256 = request.law_sha256;
  v.placement = request.placement;
  if (request.requirement) v.requirement = request.requirement->stated;
  v.calibration = request.calibration.files;
  v.remarks = request.remarks;
  v.remarks.insert(v.remarks.end(), request.calibration.remarks.begin(),
                   request.calibration.remarks.end());
  if (!request.presses.empty()) {
    v.remarks.push_back({"forces_rendered",
                         "the forces of a session are what its model answered, not measured ones: "
                         "they tell how well it was rendered, and nothing of the law"});
  }
  add_unseen_spread(v);
  if (const std::string words = threshold_words(request); !words.empty())
    v.remarks.push_back({"contact_by_threshold", words});
  return v;
}

ComparisonOptions comparison_options(const ValidationRequest& request, const Validation& v,
                                     std::size_t i, const OtherFillings* fillings) {
  ComparisonOptions options;
  options.quantities = request.quantities;
  options.requirement = request.requirement;
  options.placement = request.placement;
  options.organ = request.organ.get();
  options.fillings = fillings;
  options.pick = request.pick;
  options.rendering = request.rendering;
  if (!request.presses.empty()) {
    options.motion = request.presses.at(i);
    options.known = KnownPlacement::surface;
  } else if (request.contact_by_threshold) {
    options.known = KnownPlacement::threshold;
  }
  if (i < request.instruments.size()) options.instrument = request.instruments[i];
  options.calibration_instrument = request.calibration.instrument;
  if (request.new_specimen) options.specimens = &v.specimens;
  options.calibration_data = was_fitted(request, request.recordings[i]);
  return options;
}

/// Compares a recording; one that repeats readings of the calibration is none of its own.
RecordingComparison compared(Validation& v, const ValidationRequest& request, const LawFile& law,
                             const PreparedRecording& recording, ComparisonOptions options) {
  RecordingComparison comparison = compare_with_recording(law, recording, options);
  if (!options.calibration_data) {
    const std::string copied = copy_words(request, recording, comparison);
    if (!copied.empty()) {
      v.remarks.push_back({"copied_readings", copied});
      options.calibration_data = true;
      comparison = compare_with_recording(law, recording, options);
    }
  }
  if (const std::string words = unit_words(comparison); !words.empty())
    v.remarks.push_back({"unit_doubtful", words});
  if (const std::string words =
          probe_difference_words(options.instrument, options.calibration_instrument);
      !words.empty()) {
    v.remarks.push_back({"probes_differ", fmt::format("{}: {}", recording.name, words)});
  }
  return comparison;
}

void remark_bounds(Validation& v, const LawFile& law) {
  const std::vector<LawParameter> parameters = law_parameters(law.spec);
  for (const std::string& name : law.uncertainty->at_bound) {
    // Contact and offset of a calibration's recording are none of the law's.
    const bool of_law = std::ranges::any_of(parameters, [&](const LawParameter& p) {
      return p.name == name && !belongs_to_recording(law.spec, p);
    });
    if (!of_law) continue;
    v.remarks.push_back(
        {"parameter_at_bound",
         fmt::format("{} stood on a bound of the fit: its uncertainty is not in u_input", name)});
  }
}

/// Pools the recordings that the law was not fitted to, and decides.
void decide(Validation& v, const ValidationRequest& request, const LawFile& law,
            const std::vector<RecordingComparison>& unseen,
            const std::vector<Applicability>& motions) {
  if (unseen.empty()) {
    v.verdict = ModelVerdict::residual;
    return;
  }
  const PooledOptions pooling{request.requirement, request.at};
  v.pooled = pool_recordings(
      unseen, motions,
      law.uncertainty->degrees_of_freedom.value_or(std::numeric_limits<double>::infinity()),
      pooling);
  const auto limited_at = [](const PooledQuantity& p) { return p.limit_at.value_or(""); };
  for (const std::string& name : each_once(v.pooled, limited_at)) {
    if (name.empty()) continue;
    v.remarks.push_back(
        {"protocols_differ",
         fmt::format(
             "the protocols differ: R is {} at {}, whose S is the largest, as a share of that S",
             v.requirement, name)});
  }
  v.verdict = unseen.size() > 1 ? judge_together(v, unseen) : unseen.front().verdict;
}

}  // namespace

Validation validate(const ValidationRequest& request) {
  require_valid(request);
  const std::optional<LawFile> again =
      with_calibration_covariance(request.law, found_recordings(request.calibration));
  const LawFile& law = again ? *again : request.law;
  Validation v = validation_of(request, law);
  v.u_input_from = input_words(request, law, again.has_value());
  const std::optional<OtherFillings> fillings =
      request.organ ? std::optional(other_fillings(*request.organ)) : std::nullopt;
  std::vector<RecordingComparison> unseen;
  std::vector<Applicability> unseen_motions;
  for (std::size_t i = 0; i < request.recordings.size(); ++i) {
    const PreparedRecording& recording = request.recordings[i];
    if (request.presses.empty()) require_rise(recording);
    RecordingComparison comparison =
        compared(v, request, law, recording,
                 comparison_options(request, v, i, fillings ? &*fillings : nullptr));
    Applicability motion = motion_of(recording, comparison.parts,
                                     comparison.creep ? 0.0 : comparison.placement.contact);
    compare_with_calibration(motion, request);
    if (!comparison.calibration) {
      unseen.push_back(comparison);
      unseen_motions.push_back(motion);
    }
    v.recordings.push_back(std::move(comparison));
    v.applicability.push_back(std::move(motion));
  }
  remark_bounds(v, law);
  require_fitting_unit(v, request.requirement);
  decide(v, request, law, unseen, unseen_motions);
  return v;
}

}  // namespace tpm::fit
