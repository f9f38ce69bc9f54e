#include "tpm/fit/recording/unseen_rises.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/conditional.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"

namespace tpm::fit {
namespace {

/// Motion of the drive between two samples: it rises (1), falls (-1) or hardly moves.
class Motions {
 public:
  explicit Motions(const PreparedRecording& r)
      : r_(r.recording), jitter_(r.phases.drive_jitter_sd) {
    const auto [low, high] = std::ranges::minmax_element(r_.drive);
    range_ = *high - *low;
  }

  [[nodiscard]] int direction(std::size_t i) const {
    constexpr double kMoves = 0.02, kSure = 8.0;  // of the range; standard deviations
    const double change = r_.drive[i + 1] - r_.drive[i];
    if (!(std::abs(change) > std::max(kMoves * range_, kSure * jitter_))) return 0;
    return change > 0.0 ? 1 : -1;
  }

  [[nodiscard]] double speed(std::size_t i) const {
    return std::abs(r_.drive[i + 1] - r_.drive[i]) / (r_.time_s[i + 1] - r_.time_s[i]);
  }

  /// Number of intervals, those from `first` to `end` among them, that move one way at a quarter of
  /// their fastest speed or more: a ramp whose steps lie about the threshold of direction() is cut
  /// into pieces by its noise, or by rounding.
  [[nodiscard]] std::size_t intervals_of_ramp(std::size_t first, std::size_t end) const {
    constexpr double kAlike = 0.25;  // of the speed
    double fastest = 0.0;
    for (std::size_t i = first; i < end; ++i) fastest = std::max(fastest, speed(i));
    const bool rises = r_.drive[end] > r_.drive[first];
    const auto goes_on = [&](std::size_t i) {
      return (r_.drive[i + 1] > r_.drive[i]) == rises && speed(i) >= kAlike * fastest;
    };
    while (first > 0 && goes_on(first - 1)) --first;
    while (end + 1 < r_.drive.size() && goes_on(end)) ++end;
    return end - first;
  }

 private:
  const Recording& r_;
  double jitter_, range_ = 0.0;
};

}  // namespace

double UnseenRise::u_s() const {
  return (latest_s - earliest_s) / std::sqrt(12.0);
}

double UnseenRise::prior_sd_s(std::size_t rises) const {
  // With n delays of equal effect at the same end, the bias is n half intervals, and n such
  // deviations add up to sqrt(n) of one.
  return 0.5 * (latest_s - earliest_s) * std::sqrt(static_cast<double>(rises));
}

std::vector<UnseenRise> unseen_rises(const PreparedRecording& r) {
  constexpr std::size_t kCorners = 5;                // intervals of a rise
  constexpr std::size_t kMost = 16;                  // rises of one recording
  constexpr double kAnywhere = 0.5, kBlunt = 0.025;  // of an interval
  const std::vector<double>& time = r.recording.time_s;
  const Motions motions(r);
  std::vector<UnseenRise> rises;
  const std::size_t touched = r.phases.contact_found ? r.phases.contact_index : 0;
  for (std::size_t i = 0; i + 1 < time.size() && time[i + 1] <= r.to_s;) {
    const int direction = motions.direction(i);
    std::size_t end = i + 1;
    if (direction == 0) {
      i = end;
      continue;
    }
    while (end + 1 < time.size() && motions.direction(end) == direction) ++end;
    const std::size_t count = end - i;
    if (motions.intervals_of_ramp(i, end) > kCorners) {
      i = end;
      continue;
    }
    const auto add = [&](std::size_t at, double earliest, double latest) {
      const double lasts_s = time[at + 1] - time[at];
      if (at + 1 < touched || time[at + 1] > r.to_s) return;
      rises.push_back({time[at], time[at + 1], earliest * lasts_s, latest * lasts_s});
    };
    double fastest = 0.0;
    for (std::size_t at = i; at < end; ++at) fastest = std::max(fastest, motions.speed(at));
    const double late = 0.5 * (1.0 - motions.speed(i) / fastest);
    const double early = 0.5 * (1.0 - motions.speed(end - 1) / fastest);
    const bool blunt = std::max(late, early) > kBlunt;
    if (count == 1) {
      add(i, -kAnywhere, kAnywhere);
    } else if (count == 2 && blunt) {
      add(i, late, kAnywhere);
      add(end - 1, -kAnywhere, -early);
    } else if (count <= kCorners && blunt) {
      if (late > kBlunt) add(i, 0.0, late);
      if (early > kBlunt) add(end - 1, -early, 0.0);
    }
    i = end;
  }
  if (rises.size() > kMost) rises.clear();  // a course of its own, which its samples describe
  return rises;
}

void end_before_unseen_motion(PreparedRecording& r) {
  constexpr std::size_t kAround = 5;   // intervals on each side
  constexpr double kMany = 20.0;       // times the longest of them
  constexpr double kRamp = 0.1;        // of the range of the drive
  constexpr std::size_t kCorners = 5;  // intervals of a rise
  const std::vector<double>& time = r.recording.time_s;
  const std::vector<double>& drive = r.recording.drive;
  const Motions motions(r);
  const auto [low, high] = std::ranges::minmax_element(drive);
  double highest = drive.front();
  for (std::size_t i = 0; i + kAround + 1 < time.size() && time[i + 1] <= r.to_s; ++i) {
    highest = std::max(highest, drive[i]);
    const bool ramped = highest - drive.front() > kRamp * (*high - *low);
    if (i < kAround || !ramped || !(time[i] > r.from_s) || motions.direction(i) == 0) continue;
    double longest = 0.0;
    for (std::size_t k = 1; k <= kAround; ++k) {
      longest = std::max({longest, time[i + 1 - k] - time[i - k], time[i + 1 + k] - time[i + k]});
    }
    if (time[i + 1] - time[i] < kMany * longest) continue;
    if (motions.intervals_of_ramp(i, i + 1) > kCorners) continue;
    r.to_s = time[i];
    r.remarks.push_back(
        {"motion_in_gap",
         fmt::format("{}: the fit ends at {} s: no sample is recorded from there to {} s, and the "
                     "drive moves meanwhile; how is not known, and the tissue remembers it",
                     r.name, significant(time[i], 6), significant(time[i + 1], 6))});
    return;
  }
}

void add_rise_delays(FitConfig& config, const PreparedRecording& r, std::size_t i,
                     const std::string& suffix) {
  const std::vector<UnseenRise> rises = unseen_rises(r);
  for (std::size_t k = 0; k < rises.size(); ++k) {
    const UnseenRise& rise = rises[k];
    const double lasts_s = rise.end_s - rise.begin_s;
    EstimatedParameter p;
    p.fit = {fmt::format("rise_delay{}{}", rises.size() > 1 ? std::to_string(k + 1) : "", suffix),
             shown_unit(Dimension::time),
             Scale::linear,
             rise.expected().delay_s,
             -0.5 * lasts_s,
             0.5 * lasts_s};
    p.prior = Prior{p.fit.start, rise.prior_sd_s(rises.size()),
                    fmt::format("anywhere between the samples at {} and {} s",
                                significant(rise.begin_s, 6), significant(rise.end_s, 6))};
    p.rise = RiseTerm{i, rise.begin_s, rise.end_s};
    config.parameters.push_back(std::move(p));
  }
}

std::string unseen_rise_words(const PreparedRecording& r) {
  const std::vector<UnseenRise> rises = unseen_rises(r);
  if (rises.empty()) return {};
  const UnseenRise& first = rises.front();
  const std::string_view what = r.load_imposed ? load_word(r.recording) : "drive";
  return fmt::format(
      "{}: when the {} changed between the samples at {} and {} s{} is not known; the fit allows "
      "for it (rise_delay), and faster sampling or a slower ramp would tell",
      r.name, what, significant(first.begin_s, 6), significant(first.end_s, 6),
      rises.size() > 1 ? fmt::format(" and in {} more such intervals", rises.size() - 1) : "");
}

namespace {

/// The samples between which the drive jumps into the tissue.
struct JumpIntoContact {
  std::size_t before = 0, after = 0;
};

/// None if the drive goes on beyond contact by small steps, or as in a ramp of few samples.
std::optional<JumpIntoContact> jump_into_contact(const PreparedRecording& r) {
  constexpr double kJump = 0.1;      // of the travel: coefficients are as uncertain
  constexpr double kMuchOfIt = 0.3;  // of the travel: a jump, whatever follows
  constexpr double kLikeARamp = 0.5;
  const std::vector<double>& drive = r.recording.drive;
  const std::size_t contact = r.phases.contact_index;
  if (contact + 1 >= drive.size()) return std::nullopt;
  const double begin =
      *std::min_element(drive.begin(), drive.begin() + static_cast<std::ptrdiff_t>(contact) + 1);
  const double travel = r.phases.peak_drive - begin;
  const double jump = drive[contact + 1] - drive[contact];
  const double next = contact + 2 < drive.size() ? drive[contact + 2] - drive[contact + 1] : 0.0;
  const bool of_a_ramp = jump <= kMuchOfIt * travel && next > kLikeARamp * jump;
  if (!(jump > kJump * travel) || of_a_ramp) return std::nullopt;
  return JumpIntoContact{contact, contact + 1};
}

}  // namespace

std::string contact_in_jump_words(const PreparedRecording& r, const FitConfig& config) {
  const bool pressed = r.recording.drive_quantity == Quantity::indentation_depth &&
                       r.recording.response_quantity == Quantity::contact_force;
  if (!pressed || r.load_imposed || r.contact_held || !r.phases.contact_found) return {};
  const auto jump = jump_into_contact(r);
  if (!jump) return {};
  const auto depth = [&r](std::size_t i) {
    return sized_text(Dimension::length, r.recording.drive[i], 4);
  };
  const std::string start = depth(jump->before);
  bool searched = false;
  for (std::size_t i = 0; i < config.parameters.size(); ++i) {
    searched = searched || is_contact(config, i);
  }
  return fmt::format(
      "{}: contact lies within a jump of the drive, from {} at {} s to {} at {} s, and no sample "
      "tells where: {}; --contact \"{}\" states that the probe touched before the jump",
      r.name, start, significant(r.recording.time_s[jump->before], 6), depth(jump->after),
      significant(r.recording.time_s[jump->after], 6),
      searched ? "contact is fitted from what follows"
               : fmt::format("every coefficient supposes {}", start),
      start);
}

}  // namespace tpm::fit
