#include "tpm/data/phases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/median.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/data/contact_onset.hpp"
#include "tpm/data/drive_pieces.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::data {
namespace {

void require_finite(const Recording& recording, const std::vector<double>& values,
                    std::string_view what) {
  if (std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) return;
  throw bad_input(recording.header.id, fmt::format("the {} holds a value that is not finite", what),
                  "finite numbers");
}

void require_usable(const Recording& recording) {
  constexpr std::size_t kLeast = 3;
  const std::string& id = recording.header.id;
  const std::size_t size = recording.response.size();
  if (recording.time_s.empty())
    throw bad_input(id, "the recording has no times", "a time column (--time COLUMN)");
  if (recording.drive.empty() && is_step_response(recording.response_quantity)) {
    const bool creep = recording.response_quantity == Quantity::creep_compliance;
    throw bad_input(id,
                    fmt::format("holds a {}, without what was imposed",
                                creep ? "creep compliance" : "relaxation modulus"),
                    "a recording of what was imposed and of the response; tpm fit FILE fits this "
                    "table alone");
  }
  if (recording.drive.empty()) {
    throw bad_input(id, "the recording does not say what was imposed",
                    "a column of the depth or relative length (--drive COLUMN)");
  }
  if (size < kLeast || recording.time_s.size() != size || recording.drive.size() != size) {
    throw bad_input(id,
                    fmt::format("{} times, {} drives and {} responses", recording.time_s.size(),
                                recording.drive.size(), size),
                    "at least 3 samples of each");
  }
  require_finite(recording, recording.time_s, "time");
  require_finite(recording, recording.drive, "drive");
  require_finite(recording, recording.response, "response");
}

double typical_rate(const std::vector<double>& time, const std::vector<double>& drive,
                    const Phase& phase) {
  std::vector<std::pair<double, double>> rates;  // with the time that each lasts
  rates.reserve(phase.last - phase.first);
  for (std::size_t i = phase.first; i < phase.last; ++i) {
    const double step = time[i + 1] - time[i];
    rates.emplace_back((drive[i + 1] - drive[i]) / step, step);
  }
  std::sort(rates.begin(), rates.end());
  double left = 0.5 * (time[phase.last] - time[phase.first]);
  for (const auto& [rate, step] : rates) {
    left -= step;
    if (left <= 0.0) return rate;
  }
  return rates.back().first;
}

double mean_rate(const std::vector<double>& time, const std::vector<double>& drive,
                 const Phase& phase) {
  const auto n = static_cast<double>(phase.last - phase.first + 1);
  double mean_time = 0.0;
  double mean_drive = 0.0;
  for (std::size_t i = phase.first; i <= phase.last; ++i) {
    mean_time += time[i] / n;
    mean_drive += drive[i] / n;
  }
  double covariance = 0.0;
  double spread = 0.0;
  for (std::size_t i = phase.first; i <= phase.last; ++i) {
    covariance += (time[i] - mean_time) * (drive[i] - mean_drive);
    spread += (time[i] - mean_time) * (time[i] - mean_time);
  }
  return covariance / spread;
}

PhaseKind kind_of(Motion motion) noexcept {
  if (motion == Motion::still) return PhaseKind::hold;
  return motion == Motion::rising ? PhaseKind::loading : PhaseKind::unloading;
}

/// Finds everything step by step; each step uses the ones before it.
class Finder {
 public:
  Finder(const Recording& recording, const PhaseOptions& options)
      : time_(recording.time_s),
        drive_(recording.drive),
        response_(recording.response),
        drive_dimension_(quantity_dimension(recording.drive_quantity)),
        response_dimension_(quantity_dimension(recording.response_quantity)),
        indentation_(recording.drive_quantity == Quantity::indentation_depth &&
                     recording.response_quantity == Quantity::contact_force),
        options_(options) {}

  RecordingPhases find() {
    const std::size_t last = response_.size() - 1;
    found_.drive_jitter_sd = noise_sd(time_, drive_, 0, last);
    pieces_ = drive_pieces(time_, drive_, found_.drive_jitter_sd, options_.hold_tolerance);
    for (const DrivePiece& piece : pieces_) {
      found_.phases.push_back({kind_of(piece.motion), piece.first, piece.last, 0.0, 0.0});
    }
    found_.peak_drive = *std::max_element(drive_.begin(), drive_.end());
    found_.peak_response = *std::max_element(response_.begin(), response_.end());
    estimate_noise();
    level_ = without_drift();
    touch_noise_ = std::max(found_.noise_sd_estimate, slow_noise_of_rest());
    find_contact();
    find_creep();
    find_detachments();
    tell_zero_from_preload();
    for (Phase& phase : found_.phases) {
      phase.mean_rate = mean_rate(time_, drive_, phase);
      phase.typical_rate = typical_rate(time_, drive_, phase);
    }
    tell_oddities();
    tell_everything();
    return std::move(found_);
  }

 private:
  [[nodiscard]] TouchSearch search() const {
    // Of a few samples, no more than an eighth can be asked to agree.
    const std::size_t most = std::max<std::size_t>(response_.size() / 8, 1);
    return {drive_, level_, pieces_, touch_noise_,
            std::clamp<std::size_t>(options_.sustained_samples, 1, most)};
  }

  /// Puts one phase in the place of whatever stood from `first` to `last`.
  void relabel(std::size_t first, std::size_t last, PhaseKind kind) {
    if (first >= last) return;
    std::vector<Phase> phases;
    phases.reserve(found_.phases.size() + 2);
    bool placed = false;
    for (const Phase& phase : found_.phases) {
      const bool overlaps = phase.first < last && phase.last > first;
      if (!overlaps) {
        phases.push_back(phase);
        continue;
      }
      if (phase.first < first) phases.push_back({phase.kind, phase.first, first, 0.0, 0.0});
      if (!placed) phases.push_back({kind, first, last, 0.0, 0.0});
      placed = true;
      if (phase.last > last) phases.push_back({phase.kind, last, phase.last, 0.0, 0.0});
    }
    found_.phases = std::move(phases);
  }

  [[nodiscard]] const DrivePiece* longest_hold() const {
    const DrivePiece* longest = nullptr;
    for (const DrivePiece& piece : pieces_) {
      if (piece.motion != Motion::still) continue;
      if (longest == nullptr || piece.last - piece.first > longest->last - longest->first) {
        longest = &piece;
      }
    }
    return longest;
  }

  void estimate_noise() {
    constexpr std::size_t kEnough = 20;
    const DrivePiece* hold = longest_hold();
    const bool long_enough = hold != nullptr && hold->last - hold->first >= kEnough;
    noise_in_hold_ = long_enough;
    found_.noise_sd_estimate = long_enough ? noise_sd(time_, response_, hold->first, hold->last)
                                           : noise_sd(time_, response_, 0, response_.size() - 1);
  }

  /// The response without a drift of its zero, for the search of contact: where the probe rests at
  /// first and the force grows from 0 or away from it, it is no tissue that relaxes.
  [[nodiscard]] std::vector<double> without_drift() const {
    constexpr std::size_t kFewest = 8;
    if (!indentation_ || pieces_.size() < 2 || pieces_.front().motion != Motion::still)
      return response_;
    const std::size_t last = pieces_.front().last;
    if (last + 1 < kFewest) return response_;
    const auto n = static_cast<double>(last + 1);
    double mean_time = 0.0, mean = 0.0, covariance = 0.0, spread = 0.0, rest = 0.0;
    for (std::size_t i = 0; i <= last; ++i) {
      mean_time += time_[i] / n;
      mean += response_[i] / n;
    }
    for (std::size_t i = 0; i <= last; ++i) {
      covariance += (time_[i] - mean_time) * (response_[i] - mean);
      spread += (time_[i] - mean_time) * (time_[i] - mean_time);
    }
    const double slope = covariance / spread;
    for (std::size_t i = 0; i <= last; ++i) {
      rest += std::pow(response_[i] - mean - slope * (time_[i] - mean_time), 2);
    }
    constexpr double kSure = 5.0;  // standard errors of the slope
    const double start = mean + slope * (time_.front() - mean_time);
    const auto [low, high] = std::minmax_element(response_.begin(), response_.end());
    constexpr double kMatters = 2.5e-3;  // of the range: half of what a touch needs
    const double small = kMatters * (*high - *low);
    const bool grows = std::abs(start) <= small || start * slope > 0.0;
    const bool matters = std::abs(slope) * (time_[last] - time_.front()) > small;
    if (!grows || !matters || slope * slope * spread * (n - 2.0) <= kSure * kSure * rest)
      return response_;
    std::vector<double> level = response_;
    for (std::size_t i = 0; i < level.size(); ++i) level[i] -= slope * (time_[i] - time_.front());
    return level;
  }

  /// Standard deviation of the readings at rest before the first movement, where it is well above
  /// that of neighbours: noise that wanders is no touch. 0 elsewhere.
  [[nodiscard]] double slow_noise_of_rest() const {
    constexpr std::size_t kFewest = 10;
    constexpr double kWellAbove = 1.5;
    const DrivePiece& rest = pieces_.front();
    if (!indentation_ || pieces_.size() < 2 || rest.motion != Motion::still) return 0.0;
    const std::size_t n = rest.last + 1;
    if (n < kFewest) return 0.0;
    constexpr double kOfMedian = 1.4826;  // robust: a spoilt reading is no noise that wanders
    std::vector<double> off(level_.begin(), level_.begin() + static_cast<std::ptrdiff_t>(n));
    const double middle = median(off);
    for (double& each : off) each = std::abs(each - middle);
    const double sd = kOfMedian * median(std::move(off));
    return sd > kWellAbove * found_.noise_sd_estimate ? sd : 0.0;
  }

  void find_contact() {
    found_.contact_drive = drive_.front();
    if (!indentation_) return;
    const Touch touch = find_touch(search(), options_.contact_response);
    found_.floor_response = touch.floor;
    found_.contact_found = touch.index.has_value();
    if (!touch.index) {
      const bool moved = pieces_.size() > 1 || pieces_.front().motion != Motion::still;
      if (moved) relabel(0, response_.size() - 1, PhaseKind::before_contact);
      return;
    }
    found_.preloaded = touch.instantaneous && !options_.contact_response &&
                       touch.floor > 0.5 * touch_margin(search());
    found_.contact_index = found_.preloaded ? touch.motion_start : *touch.index;
    found_.contact_drive = drive_[found_.contact_index];
    if (!found_.preloaded) relabel(0, found_.contact_index, PhaseKind::before_contact);
  }

  /// The samples at the end of a phase in which the response stays at one level.
  [[nodiscard]] std::size_t start_of_constant_response(const Phase& phase) const {
    const std::size_t quarter = (phase.last - phase.first) / 4;
    const double level =
        median({response_.begin() + static_cast<std::ptrdiff_t>(phase.last - quarter),
                response_.begin() + static_cast<std::ptrdiff_t>(phase.last) + 1});
    const double band = std::max(5.0 * found_.noise_sd_estimate, 0.02 * std::abs(level));
    std::size_t start = phase.last;
    while (start > phase.first && std::abs(response_[start - 1] - level) <= band) --start;
    return start;
  }

  /// True if noise alone makes readings look constant: the means of their halves are apart, or not
  /// clearly less so than those of a force that rises evenly from contact on.
  [[nodiscard]] bool rises_within_noise(const Phase& phase, std::size_t first) const {
    constexpr double kSure = 4.0, kConstant = 0.02;  // standard deviations; of the level
    const std::size_t last = phase.last, half = (last - first + 1) / 2;
    if (half < 2) return false;
    const auto mean_from = [half](const std::vector<double>& values, std::size_t begin) {
      double sum = 0.0;
      for (std::size_t i = begin; i < begin + half; ++i) sum += values[i];
      return sum / static_cast<double>(half);
    };
    const double late = mean_from(response_, last + 1 - half);
    const double rise = late - mean_from(response_, first);
    const double unsure =
        kSure * found_.noise_sd_estimate * std::sqrt(2.0 / static_cast<double>(half));
    if (rise > std::max(unsure, kConstant * std::abs(late))) return true;
    const std::size_t begin = std::max(phase.first, found_.contact_index);
    if (begin >= first) return false;  // loaded instantaneously
    const double late_s = mean_from(time_, last + 1 - half);
    const double apart_s = late_s - mean_from(time_, first);
    const double rise_on = (late - found_.floor_response) / (late_s - time_[begin]) * apart_s;
    return rise_on - rise <= unsure && found_.noise_sd_estimate > 0.0;
  }

  /// A force that stays constant while the depth grows was held by the machine.
  void find_creep() {
    constexpr double kLeastPart = 0.3;  // of the phase's time
    constexpr std::size_t kLeast = 8;
    if (!found_.contact_found) return;
    const std::vector<Phase> phases = found_.phases;
    for (const Phase& phase : phases) {
      if (phase.kind != PhaseKind::loading || phase.last - phase.first < kLeast) continue;
      const std::size_t start = start_of_constant_response(phase);
      const double part =
          (time_[phase.last] - time_[start]) / (time_[phase.last] - time_[phase.first]);
      if (part > kLeastPart && !rises_within_noise(phase, start)) {
        relabel(start, phase.last, PhaseKind::creep);
      }
    }
  }

  void find_detachments() {
    constexpr double kSmall = 0.25;  // of the peak: less is no new loading
    if (!found_.contact_found) return;
    const std::size_t end = response_.size() - 1;
    std::size_t done = found_.contact_index;
    for (const DrivePiece& piece : pieces_) {
      if (piece.motion != Motion::falling || piece.first < done) continue;
      const auto release = find_release(search(), piece, found_.floor_response);
      if (!release) continue;
      found_.detachment_index = release->index;
      const double margin = touch_margin(search());
      const auto again = first_reaching(level_, release->index, end, release->floor + margin,
                                        options_.sustained_samples);
      done = again.value_or(piece.last);
      relabel(release->index, done, PhaseKind::detached);
      const auto rest = level_.begin() + static_cast<std::ptrdiff_t>(done);
      const double later = *std::max_element(rest, level_.end()) - release->floor;
      if (later > kSmall * (found_.peak_response - release->floor)) continue;
      relabel(done, end, PhaseKind::recovery);
      return;
    }
  }

  /// A force at rest that rises with the first movement is a preload or the error of the zero. If
  /// the probe is withdrawn clear of where it rested and the force stands there as it did at rest,
  /// it is the zero: the rest was in the air, and contact began with the movement.
  void tell_zero_from_preload() {
    constexpr double kClear = 0.1;  // of the travel
    constexpr std::size_t kFewest = 8;
    if (!found_.preloaded) return;
    const double travel = found_.peak_drive - drive_.front();
    const double clear = drive_.front() - kClear * travel;
    const auto deepest = std::ranges::max_element(drive_);
    std::vector<double> withdrawn;
    for (auto i = static_cast<std::size_t>(deepest - drive_.begin()); i < drive_.size(); ++i) {
      if (drive_[i] <= clear) withdrawn.push_back(level_[i]);
    }
    if (withdrawn.size() < kFewest) return;
    // The first half may still recover, or be pulled.
    withdrawn.erase(withdrawn.begin(),
                    withdrawn.begin() + static_cast<std::ptrdiff_t>(withdrawn.size() / 2));
    const double apart = std::abs(median(std::move(withdrawn)) - found_.floor_response);
    if (apart > 0.5 * touch_margin(search())) return;
    found_.preloaded = false;
    relabel(0, found_.contact_index, PhaseKind::before_contact);
  }

  /// Without digits that are only jitter.
  [[nodiscard]] std::string drive_text(double si) const {
    constexpr double kFine = 1e-4;
    return shown(std::abs(si) < kFine * std::abs(found_.peak_drive) ? 0.0 : si, drive_dimension_);
  }
  [[nodiscard]] std::string rate_text(const Phase& phase) const {
    if (phase.kind == PhaseKind::hold) return {};
    return fmt::format(", {}/s", shown(phase.typical_rate, drive_dimension_));
  }
  [[nodiscard]] std::string response_text(double si) const {
    return shown(si, response_dimension_);
  }
  static std::string shown(double si, Dimension dimension) {
    const Unit unit = shown_unit(dimension);
    return with_unit(significant(si / unit.to_si, 4), unit);
  }
  void tell(std::string sentence) { found_.summary.push_back(std::move(sentence)); }

  [[nodiscard]] bool has(PhaseKind kind) const {
    return std::any_of(found_.phases.begin(), found_.phases.end(),
                       [kind](const Phase& phase) { return phase.kind == kind; });
  }

  void tell_oddities() {
    const bool moves = pieces_.size() > 1 || pieces_.front().motion != Motion::still;
    if (!moves) {
      tell("the drive never moves by more than its own jitter: there is no ramp");
    } else if (pieces_.front().motion == Motion::falling ||
               (pieces_.front().motion == Motion::still && pieces_[1].motion == Motion::falling)) {
      tell("the drive falls first: if the machine counts loading negative, --negate-drive");
    }
    const double lowest = *std::min_element(response_.begin(), response_.end());
    if (-lowest > 2.0 * std::max(found_.peak_response, 0.0) && lowest < 0.0) {
      tell(
          "the response is mostly negative: if the machine counts loading negative, "
          "--negate-response");
    }
    if (indentation_ && moves && !found_.contact_found) {
      tell(options_.contact_response ? fmt::format("the response never stays at {}: no contact",
                                                   response_text(*options_.contact_response))
                                     : "the response never rises out of its noise: no contact");
    }
    if (moves && !has(PhaseKind::hold) && !has(PhaseKind::creep)) tell("nothing is held");
    if (found_.noise_sd_estimate == 0.0) {
      tell("no noise can be told from these samples: they are too few or without any");
    }
  }

  void tell_everything() {
    tell_contact();
    for (const Phase& phase : found_.phases) {
      tell(fmt::format("{} from {} s to {} s: {} to {}{}", phase_name(phase.kind),
                       significant(time_[phase.first], 5), significant(time_[phase.last], 5),
                       drive_text(drive_[phase.first]), drive_text(drive_[phase.last]),
                       rate_text(phase)));
    }
    if (found_.noise_sd_estimate > 0.0) {
      tell(fmt::format("the noise of the response is about {} (standard deviation{})",
                       response_text(found_.noise_sd_estimate),
                       noise_in_hold_ ? ", in the longest hold" : ""));
    }
  }

  void tell_contact() {
    if (!found_.contact_found) return;
    if (found_.preloaded) {
      tell(fmt::format(
          "preloaded: {} at rest, and more with the first movement (or the force cell's "
          "zero is off)",
          response_text(found_.floor_response)));
    } else {
      tell(fmt::format("contact at {}, {} s", drive_text(found_.contact_drive),
                       significant(time_[found_.contact_index], 5)));
    }
    if (found_.detachment_index) {
      tell(fmt::format("detached at {} s with {} left",
                       significant(time_[*found_.detachment_index], 5),
                       drive_text(drive_[*found_.detachment_index])));
    }
  }

  const std::vector<double>& time_;
  const std::vector<double>& drive_;
  const std::vector<double>& response_;
  Dimension drive_dimension_;
  Dimension response_dimension_;
  bool indentation_;
  const PhaseOptions& options_;
  std::vector<DrivePiece> pieces_;
  std::vector<double> level_;  ///< the response, without a drift of its zero
  double touch_noise_ = 0.0;   ///< of a reading, for the search of contact
  bool noise_in_hold_ = false;
  RecordingPhases found_;
};

}  // namespace

std::string_view phase_name(PhaseKind kind) noexcept {
  static constexpr auto kNames = std::to_array<Word<PhaseKind>>({
      {PhaseKind::before_contact, "before contact"},
      {PhaseKind::loading, "loading"},
      {PhaseKind::hold, "hold"},
      {PhaseKind::creep, "creep"},
      {PhaseKind::unloading, "unloading"},
      {PhaseKind::detached, "detached"},
      {PhaseKind::recovery, "recovery"},
  });
  return word_for(kNames, kind);
}

RecordingPhases find_phases(const Recording& recording, const PhaseOptions& options) {
  require_usable(recording);
  return Finder(recording, options).find();
}

}  // namespace tpm::data
