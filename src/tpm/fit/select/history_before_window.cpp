#include "tpm/fit/select/history_before_window.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tpm/base/text.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

constexpr const char* kHistoryBeforeWindow = "history_before_window";
constexpr const char* kPulledHistory = "pulled_history";
constexpr double kForgotten = 5.0;  // relaxation times: exp(-5) is 0.7 %

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

/// The file of a recording with the rows that its reading leaves out before the window.
Recording with_earlier_rows(const FitConfig& config, const DataChoice& choice) {
  ImportOptions all = choice.import;
  all.from_s.reset();
  all.step_time_s.reset();
  Recording recording = read_recording_file(data_path(config, choice.dataset), all).recording;
  return choice.load_imposed ? with_imposed_load(std::move(recording)) : recording;
}

/// When the last load ended that the window leaves out, in the clock of the file.
std::optional<double> last_load_s(const RecordingFit& r, const Recording& whole, double begin_s,
                                  std::optional<double> contact) {
  constexpr double kLoad = 0.02;      // of the largest in the fitted part
  constexpr double kResiduals = 5.0;  // residuals
  const auto load = [contact](double drive) {
    return contact ? std::max(drive - *contact, 0.0) : drive;
  };
  const double start = load(r.drive.front());
  double most = 0.0;
  for (std::size_t i = 0; i < r.drive.size(); ++i) {
    if (r.fitted[i]) most = std::max(most, std::abs(load(r.drive[i]) - start));
  }
  const double seen = std::max(kLoad * r.peak, kResiduals * r.rms_residual);
  std::optional<double> last;
  for (std::size_t i = 0; i < whole.time_s.size() && whole.time_s[i] < begin_s; ++i) {
    const bool loaded = std::abs(load(whole.drive[i]) - start) > kLoad * most;
    if (loaded && std::abs(whole.response[i] - r.observed.front()) > seen) last = whole.time_s[i];
  }
  return last;
}

/// Remark on a recording's missing history; empty if it is complete, or relaxed.
std::string history_words(const FitResult& fit, const RecordingFit& r) {
  const DataChoice& choice = fit.config.data[r.choice];
  if (!choice.import.from_s && !choice.import.step_time_s) return {};
  const LawModel model(*fit.config.law);
  const std::vector<double> values = model_parameters(fit.config, fit.best.natural, r.choice);
  const LongestMemory memory = longest_memory(*fit.config.law, values);
  const auto first = std::ranges::find(r.fitted, true);
  if (!(memory.time_s > 0.0) || first == r.fitted.end()) return {};
  std::optional<double> contact;
  if (r.drive_quantity == Quantity::indentation_depth) contact = values[model.index("contact")];
  const double clock_s = choice.import.step_time_s.value_or(0.0);
  const double fitted_s = clock_s + r.time_s[static_cast<std::size_t>(first - r.fitted.begin())];
  const auto last =
      last_load_s(r, with_earlier_rows(fit.config, choice), clock_s + r.time_s.front(), contact);
  if (!last || fitted_s - *last >= kForgotten * memory.time_s) return {};
  return fmt::format(
      "{}: history before the window is not in the fit: a load ended at {} s of the file, {} s "
      "before the fitted part, and {}; in config.json the key \"from\" of the recording, without "
      "{} in its \"import\", leaves out the same samples and keeps their history, with contact "
      "lost and found again as the law has it",
      choice.dataset, significant(*last, 4), significant(fitted_s - *last, 3),
      std::isfinite(memory.time_s) ? fmt::format("{} = {} s is more than a fifth of that",
                                                 memory.name, significant(memory.time_s, 3))
                                   : memory.name + " has no end",
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

/// What a reader must know of a recording; empty if nothing pulled, or if that is forgotten.
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

bool doubt_history(FitResult& fit) {
  if (!fit.config.law) return false;
  std::vector<Remark> remarks;
  for (const RecordingFit& r : fit.recordings) {
    std::string words = history_words(fit, r);
    if (!words.empty()) remarks.push_back({kHistoryBeforeWindow, std::move(words)});
  }
  if (remarks.empty()) return false;
  std::ranges::move(remarks, std::back_inserter(fit.remarks));
  doubt_material(fit, {kHistoryBeforeWindow, "history before the window is not in the fit"});
  return true;
}

bool doubt_pulled_history(FitResult& fit) {
  if (!fit.config.law) return false;
  std::vector<Remark> remarks;
  for (const RecordingFit& r : fit.recordings) {
    std::string words = pulled_words(fit, r);
    if (!words.empty()) remarks.push_back({kPulledHistory, std::move(words)});
  }
  if (remarks.empty()) return false;
  std::ranges::move(remarks, std::back_inserter(fit.remarks));
  doubt_material(fit, {kPulledHistory, "the specimen pulls where the law has lost contact"});
  return true;
}

}  // namespace tpm::fit
