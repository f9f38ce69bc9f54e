#include "tpm/fit/select/history_before_window.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "tpm/base/text.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/select/placement_parameters.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

constexpr const char* kPulledHistory = "pulled_history";
constexpr double kForgotten = 5.0;  // relaxation times: exp(-5) is 0.7 %
constexpr double kLoad = 0.02;      // of the largest in the window: a load that counts

/// Longest memory of a law.
struct LongestMemory {
  std::string name;
  double time_s = 0.0;  ///< infinite for a spring-pot; 0 for a law without memory
};

LongestMemory longest_memory(const LawSpec& law, std::span<const double> values) {
  if (law.fractional != Fractional::none) {
    return {"the memory of a spring-pot", std::numeric_limits<double>::infinity()};
  }
  LongestMemory longest;
  const std::vector<LawParameter> parameters = law_parameters(law);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const LawParameter& p = parameters[i];
    if (p.nuisance || p.dimension != Dimension::time || values[i] <= longest.time_s) continue;
    longest = {p.name, values[i]};
  }
  return longest;
}

/// A recording that was read without its first rows, and what counts as a load in these.
struct CutRecording {
  std::string name;
  std::filesystem::path file;
  ImportOptions import;
  Quantity drive = Quantity::indentation_depth;  ///< as it drives the law
  double begin_s = 0.0;  ///< first row that was read, in the recording's clock
  double first_s = 0.0;  ///< first sample that is fitted or compared
  std::optional<double> contact = std::nullopt;  ///< depth from which the probe touches
  double start = 0.0;                            ///< drive at begin_s
  double most = 0.0;      ///< largest load of the samples that are fitted or compared
  double response = 0.0;  ///< at begin_s
  double seen = 0.0;      ///< difference of a response that is seen

  [[nodiscard]] double load(double imposed) const {
    return contact ? std::max(imposed - *contact, 0.0) : imposed;
  }
  [[nodiscard]] bool is_cut() const { return import.from_s || import.step_time_s; }
  /// Seconds of the file at which the recording's clock is 0.
  [[nodiscard]] double clock_s() const { return import.step_time_s.value_or(0.0); }
};

/// The file of a recording with the rows that its reading leaves out before the window.
Recording with_earlier_rows(const CutRecording& cut) {
  ImportOptions all = cut.import;
  all.from_s.reset();
  all.step_time_s.reset();
  Recording recording = read_recording_file(cut.file, all).recording;
  const bool turned = recording.drive_quantity != cut.drive;
  return turned ? with_imposed_load(std::move(recording)) : recording;
}

/// When the last load ended that was not read, in the clock of the file.
std::optional<double> last_load_s(const CutRecording& cut) {
  const Recording whole = with_earlier_rows(cut);
  const double begin_s = cut.clock_s() + cut.begin_s, start = cut.load(cut.start);
  std::optional<double> last;
  for (std::size_t i = 0; i < whole.time_s.size() && whole.time_s[i] < begin_s; ++i) {
    const bool loaded = std::abs(cut.load(whole.drive[i]) - start) > kLoad * cut.most;
    if (loaded && std::abs(whole.response[i] - cut.response) > cut.seen) last = whole.time_s[i];
  }
  return last;
}

/// The load that the history of a law lacks, and what still remembers it; empty if the history is
/// complete, or forgotten.
/// @param what "fitted", "compared": the samples of the window
std::string unread_load_words(const CutRecording& cut, const LawSpec& law,
                              std::span<const double> values, std::string_view what) {
  const LongestMemory memory = longest_memory(law, values);
  if (!(memory.time_s > 0.0)) return {};
  const auto last = last_load_s(cut);
  const double since_s = last ? cut.clock_s() + cut.first_s - *last : 0.0;
  if (!last || since_s >= kForgotten * memory.time_s) return {};
  return fmt::format("a load ended at {} s of the file, {} s before the {} part, and {}",
                     significant(*last, 4), significant(since_s, 3), what,
                     std::isfinite(memory.time_s)
                         ? fmt::format("{} = {} s is more than a fifth of that", memory.name,
                                       significant(memory.time_s, 3))
                         : memory.name + " has no end");
}

/// Remark on a recording's missing history; empty if it is complete, or relaxed.
std::string history_words(const FitResult& fit, const RecordingFit& r) {
  constexpr double kResiduals = 5.0;  // residuals
  const DataChoice& choice = fit.config.data[r.choice];
  CutRecording cut{choice.dataset, data_path(fit.config, choice.dataset), choice.import,
                   r.drive_quantity};
  if (!cut.is_cut()) return {};
  const std::vector<double> values = model_parameters(fit.config, fit.best.natural, r.choice);
  const auto first = std::ranges::find(r.fitted, true);
  if (first == r.fitted.end()) return {};
  cut.begin_s = r.time_s.front();
  cut.first_s = r.time_s[static_cast<std::size_t>(first - r.fitted.begin())];
  if (r.drive_quantity == Quantity::indentation_depth) {
    cut.contact = values[LawModel(*fit.config.law).index("contact")];
  }
  cut.start = r.drive.front();
  for (std::size_t i = 0; i < r.drive.size(); ++i) {
    if (!r.fitted[i]) continue;
    cut.most = std::max(cut.most, std::abs(cut.load(r.drive[i]) - cut.load(cut.start)));
  }
  cut.response = r.observed.front();
  cut.seen = std::max(kLoad * r.peak, kResiduals * r.rms_residual);
  const std::string words = unread_load_words(cut, *fit.config.law, values, "fitted");
  if (words.empty()) return {};
  return fmt::format(
      "{}: history before the window is not in the fit: {}; in config.json the key \"from\" of the "
      "recording, without {} in its \"import\", leaves out the same samples and keeps their "
      "history, with contact lost and found again as the law has it",
      choice.dataset, words,
      choice.import.step_time_s ? "\"step_time\" (times then count as in the file)" : "\"from\"");
}

/// From when to when the force of a recording pulls before the fitted part, and by how much at
/// most.
struct PulledHistory {
  double at_s = 0.0, last_s = 0.0, most = 0.0;
};

/// Readings that lie below the response that is left when the law has lost contact, several in a
/// row and after a load.
std::optional<PulledHistory> pulled_history(const RecordingFit& r) {
  constexpr double kResiduals = 5.0, kOfPeak = 0.01;
  constexpr int kInARow = 3;
  if (r.drive_quantity != Quantity::indentation_depth) return std::nullopt;
  const auto first = std::ranges::find(r.fitted, true);
  const auto end = static_cast<std::size_t>(first - r.fitted.begin());
  double none = std::numeric_limits<double>::infinity();  // without contact
  for (std::size_t i = 0; i < end; ++i) {
    if (std::isfinite(r.predicted[i])) none = std::min(none, r.predicted[i]);
  }
  const double seen = std::max(kResiduals * r.rms_residual, kOfPeak * r.peak);
  std::optional<PulledHistory> found;
  bool loaded = false;
  int count = 0;
  for (std::size_t i = 0; i < end; ++i) {
    loaded = loaded || r.predicted[i] - none > seen;
    const double pull = r.predicted[i] - r.observed[i];
    count = loaded && r.predicted[i] - none <= seen && pull > seen ? count + 1 : 0;
    if (count < kInARow) continue;
    if (!found) found = {r.time_s[i + 1 - kInARow], 0.0, 0.0};
    found->last_s = r.time_s[i];
    found->most = std::max(found->most, pull);
  }
  return found;
}

/// Remark on a history that pulled; empty if nothing did, or if that is forgotten.
std::string pulled_words(const FitResult& fit, const RecordingFit& r) {
  const auto pulled = pulled_history(r);
  if (!pulled) return {};
  const std::vector<double> values = model_parameters(fit.config, fit.best.natural, r.choice);
  const double memory_s = longest_memory(*fit.config.law, values).time_s;
  const auto first = std::ranges::find(r.fitted, true);
  if (first == r.fitted.end()) return {};
  const double fitted_s = r.time_s[static_cast<std::size_t>(first - r.fitted.begin())];
  if (!(memory_s > 0.0) || fitted_s - pulled->last_s >= kForgotten * memory_s) return {};
  return fmt::format(
      "{}: before the fitted part, from {} s on, the force pulls by up to {} % of the peak where "
      "the "
      "law has lost contact: a specimen that is glued, gripped or sticks; the law does not have "
      "the history that the fitted part remembers",
      fit.config.data[r.choice].dataset, significant(pulled->at_s, 4),
      significant(100.0 * pulled->most / r.peak, 3));
}

/// What tells of one recording that the law lacks some of its history.
struct HistoryReader {
  const char* code;                                                   ///< of its remarks
  std::string (*words)(const FitResult& fit, const RecordingFit& r);  ///< empty: nothing is lacking
  const char* why;  ///< no parameter of the material is identified
};

HistoryReader reader_of(History lacking) {
  if (lacking == History::unread) {
    return {kHistoryBeforeWindow, history_words, "history before the window is not in the fit"};
  }
  return {kPulledHistory, pulled_words, "the specimen pulls where the law has lost contact"};
}

/// Calls no parameter of the material identified.
void doubt_material(FitResult& fit, const Remark& why) {
  for (ParameterResult& p : fit.parameters) {
    const bool said = p.verdict == Verdict::failed || p.verdict == Verdict::flat;
    if (p.nuisance || said || p.unconfirmed || p.not_separable) continue;
    p.unconfirmed = why;
    p.summary = parameter_words(p, fit.config.level);
  }
}

}  // namespace

std::optional<Remark> history_before_window(const LawSpec& law, std::span<const double> values,
                                            const PreparedRecording& recording,
                                            std::string_view of) {
  constexpr double kNoise = 5.0;  // standard deviations of a reading
  const Recording& r = recording.recording;
  CutRecording cut{recording.name, recording.name, recording.import, r.drive_quantity};
  if (!cut.is_cut()) return std::nullopt;
  cut.begin_s = r.time_s.front();
  cut.first_s = std::max(recording.from_s, cut.begin_s);
  if (r.drive_quantity == Quantity::indentation_depth) cut.contact = start_drive(recording);
  cut.start = r.drive.front();
  double peak = 0.0;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    if (r.time_s[i] < recording.from_s || r.time_s[i] > recording.to_s) continue;
    cut.most = std::max(cut.most, std::abs(cut.load(r.drive[i]) - cut.load(cut.start)));
    peak = std::max(peak, std::abs(r.response[i]));
  }
  cut.response = r.response.front();
  cut.seen = std::max(kLoad * peak, kNoise * recording.phases.noise_sd_estimate);
  const std::string words = unread_load_words(cut, law, values, "compared");
  if (words.empty()) return std::nullopt;
  return Remark{kHistoryBeforeWindow,
                fmt::format("{}: history before the window is not in {}: {}; without {} the whole "
                            "file is read, and drives the law",
                            recording.name, of, words,
                            recording.import.step_time_s ? "--step-time" : "--from-time")};
}

bool doubt_history(FitResult& fit, History lacking) {
  if (!fit.config.law) return false;
  const HistoryReader reader = reader_of(lacking);
  std::vector<Remark> remarks;
  for (const RecordingFit& r : fit.recordings) {
    std::string words = reader.words(fit, r);
    if (!words.empty()) remarks.push_back({reader.code, std::move(words)});
  }
  if (remarks.empty()) return false;
  std::ranges::move(remarks, std::back_inserter(fit.remarks));
  doubt_material(fit, {reader.code, reader.why});
  return true;
}

}  // namespace tpm::fit
