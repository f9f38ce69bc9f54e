#include "tpm/fit/select/law_choice.hpp"

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "tpm/fit/sample_digest.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"

namespace tpm::fit {
namespace {

/// SHA-256 of the readings of each data set: of recordings as law.json has it, of separate readings
/// of what they were read at and as.
std::vector<std::string> digests_of_data(const FitResult& fit) {
  struct Columns {
    std::vector<double> time_s, frequency_Hz, value;
  };
  std::vector<Columns> separate(fit.config.data.size());
  for (const FittedDatum& d : fit.data) {
    Columns& columns = separate.at(d.datum.choice);
    const auto put = [&](double value) {
      columns.time_s.push_back(d.datum.time_s);
      columns.frequency_Hz.push_back(d.datum.frequency_Hz.value_or(0.0));
      columns.value.push_back(value);
    };
    for (const auto& value : {d.datum.value, d.datum.lower, d.datum.upper}) {
      if (value) put(*value);
    }
  }
  std::vector<std::string> digests;
  for (const Columns& c : separate) {
    digests.push_back(c.value.empty() ? std::string()
                                      : samples_sha256(c.time_s, c.frequency_Hz, c.value));
  }
  for (const RecordingFit& r : fit.recordings) {
    digests.at(r.choice) = samples_sha256(r.time_s, r.drive, r.observed);
  }
  return digests;
}

/// Why the choice is not that of this fit; empty if it is.
std::string difference_from_choice(const FitResult& fit, const std::string& law) {
  const LawChoice& choice = *fit.config.choice;
  if (law != choice.law || fit.value_count != choice.samples) {
    return fmt::format("this is {} with {} samples", law, fit.value_count);
  }
  if (choice.samples_sha256.empty()) {
    return "it does not hold the SHA-256 of the readings it was made from (samples_sha256)";
  }
  if (choice.samples_sha256 != digests_of_data(fit)) {
    return fmt::format("the recording differs from the one that chose the law: other SHA-256 of {}",
                       fit.config.data.size() == 1 ? "its readings" : "the readings");
  }
  return {};
}

}  // namespace

void keep_choice(Selection& s) {
  Candidate& chosen = s.candidates[s.recommended];
  LawChoice choice{.law = law_name(chosen.law),
                   .samples = chosen.fit.value_count,
                   .samples_sha256 = digests_of_data(chosen.fit)};
  if (s.preferred) {
    choice.better = law_name(s.candidates[*s.preferred].law);
    choice.better_by = chosen.delta_bic;
  }
  const std::string adequacy = chosen.fit.adequacy ? chosen.fit.adequacy->summary : std::string();
  if (chosen.fit.adequacy && chosen.fit.adequacy->is_rejected()) choice.not_described = adequacy;
  // The sentence that recommends the law is a condition only where it says more than that.
  const bool plain = s.candidates.size() == 1 || (chosen.identified && !s.preferred);
  for (std::size_t i = 0; i < s.summary.size(); ++i) {
    if (s.summary[i] == adequacy || (plain && i == s.recommendation)) continue;
    choice.conditions.push_back(s.summary[i]);
  }
  chosen.fit.config.choice = std::move(choice);
}

void repeat_choice(FitResult& fit) {
  if (!fit.config.choice) return;
  const LawChoice& choice = *fit.config.choice;
  const std::string law = fit.config.law ? law_name(*fit.config.law) : fit.config.model;
  if (const std::string difference = difference_from_choice(fit, law); !difference.empty()) {
    fit.remarks.push_back(
        {"another_choice",
         fmt::format("the choice of {} from {} samples, which the configuration holds, is not "
                     "repeated: {}",
                     choice.law, choice.samples, difference)});
    return;
  }
  const bool rejected = fit.adequacy && fit.adequacy->is_rejected();
  if (rejected && !choice.not_described.empty()) fit.adequacy->summary = choice.not_described;
  if (!choice.better.empty() && !rejected) {
    state_better(fit, law, choice.better, choice.better_by);
  } else if (!choice.not_described.empty() && !rejected) {
    state_as(fit, choice.not_described);
  }
  for (const std::string& words : choice.conditions) {
    fit.remarks.push_back({"condition_of_choice", words});
  }
}

}  // namespace tpm::fit
