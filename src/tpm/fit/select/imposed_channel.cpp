#include "tpm/fit/select/imposed_channel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tpm/base/text.hpp"
#include "tpm/data/off_neighbours.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/likelihood/starts.hpp"
#include "tpm/work/give_up.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

double range_of(std::span<const double> values) {
  const auto [low, high] = std::ranges::minmax_element(values);
  return *high - *low;
}

double average_of(std::span<const double> values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

/// The part of a recording up to where the stress falls back.
std::size_t end_of_load(std::span<const double> stress) {
  constexpr double kFallen = 0.1;  // of the range
  const double range = range_of(stress);
  const auto peak = std::ranges::max_element(stress);
  const auto fallen =
      std::find_if(peak, stress.end(), [&](double s) { return *peak - s > kFallen * range; });
  auto end = static_cast<std::size_t>(fallen - stress.begin());
  while (fallen != stress.end() && end > 1 && stress[end - 1] < stress[end - 2]) --end;
  return end;
}

/// True if a channel stays where it is over the last half of the load, while another goes on.
bool was_held(std::span<const double> held, double held_noise, std::span<const double> other,
              double other_noise) {
  constexpr double kStill = 0.005, kSure = 4.0;
  const std::size_t half = held.size() / 2;
  const auto late = held.subspan(half);
  if (range_of(late) > kStill * range_of(held) + 2.0 * kSure * held_noise) return false;
  const std::size_t quarter = other.size() / 4;
  const double moved =
      std::abs(average_of(other.last(quarter)) - average_of(other.subspan(half, quarter)));
  return moved > kSure * other_noise / std::sqrt(static_cast<double>(quarter));
}

/// True if the load stood still over the last half while the other channel went on by far more of
/// its range than the load: creep, whichever channel has more noise.
bool crept(std::span<const double> load, std::span<const double> other, double other_noise) {
  constexpr double kLeast = 0.01, kMuchLess = 0.2, kSure = 8.0;
  const auto moved = [](std::span<const double> values) {
    const std::size_t quarter = values.size() / 4;
    return average_of(values.last(quarter)) -
           average_of(values.subspan(values.size() / 2, quarter));
  };
  const double by = moved(other);
  const double error = other_noise / std::sqrt(static_cast<double>(other.size() / 4));
  return by > std::max(kLeast * range_of(other), kSure * error) &&
         std::abs(moved(load)) / range_of(load) < kMuchLess * by / range_of(other);
}

/// Where a load reaches its largest value, and whether it stays there to its end.
struct HeldLoad {
  std::size_t from = 0;
  bool held = false;
};

HeldLoad held_load(std::span<const double> load, double load_noise) {
  constexpr double kStill = 0.005, kSure = 4.0;
  constexpr std::size_t kFewest = 20;
  const double least = *std::ranges::max_element(load) - 0.5 * kStill * range_of(load) -
                       kSure * load_noise;  // of a load that is held
  const auto reached = std::ranges::find_if(load, [&](double v) { return v >= least; });
  const auto from = static_cast<std::size_t>(reached - load.begin());
  const auto held = load.subspan(from);
  const double within = kStill * range_of(load) + 2.0 * kSure * load_noise;
  return {from, held.size() >= kFewest && range_of(held) <= within};
}

/// True if most of what the other channel moved by came after the load stood still: creep, also of
/// a solid that came to rest under the load. (A force cell at its limit stands still, too, but for
/// the last part of the motion only.)
bool crept_to_rest(std::span<const double> load, double load_noise, std::span<const double> other,
                   double other_noise) {
  constexpr double kMost = 0.5, kSure = 8.0;
  const HeldLoad hold = held_load(load, load_noise);
  if (!hold.held) return false;
  const double by = average_of(other.last((other.size() - hold.from) / 4)) - other[hold.from];
  return by > std::max(kMost * range_of(other), kSure * other_noise);
}

/// Samples `first` to before `last` in which a channel stands still.
struct StillRun {
  std::size_t first = 0, last = 0;
  double level = 0.0;
};

/// Where a load stands still for a twentieth of the time or longer.
std::vector<StillRun> still_runs(std::span<const double> load, double noise) {
  constexpr double kStill = 0.005, kSure = 4.0;
  constexpr std::size_t kFewest = 10, kShare = 20;
  const double within = kStill * range_of(load) + 2.0 * kSure * noise;
  const std::size_t least = std::max(kFewest, load.size() / kShare);
  std::vector<StillRun> runs;
  for (std::size_t first = 0; first < load.size();) {
    double low = load[first], high = load[first];
    std::size_t last = first;
    while (last < load.size()) {
      low = std::min(low, load[last]);
      high = std::max(high, load[last]);
      if (high - low > within) break;
      ++last;
    }
    if (last - first < least) {
      ++first;
      continue;
    }
    runs.push_back({first, last, average_of(load.subspan(first, last - first))});
    first = last;
  }
  return runs;
}

/// True if the load went up in stairs, and the other channel on under the last one: creep.
bool crept_on_stairs(std::span<const double> load, double load_noise, std::span<const double> other,
                     double other_noise) {
  constexpr double kMostly = 0.85, kApart = 0.1;  // of the samples, and of the range
  const std::vector<StillRun> runs = still_runs(load, load_noise);
  std::size_t still = 0, stairs = 0;
  double before = *std::ranges::min_element(load);
  for (const StillRun& run : runs) {
    still += run.last - run.first;
    if (run.level - before <= kApart * range_of(load)) continue;
    before = run.level;
    ++stairs;
  }
  const auto samples = static_cast<double>(load.size());
  if (stairs < 2 || static_cast<double>(still) < kMostly * samples) return false;
  const StillRun& last = runs.back();
  // crept() looks at the second half of what it is given.
  const std::size_t length = last.last - last.first;
  if (last.last < load.size() || 2 * length > load.size()) return false;
  return crept(load.subspan(load.size() - 2 * length), other.subspan(other.size() - 2 * length),
               other_noise);
}

/// Refuses a strain or depth that recedes from its largest under a load that is held: tissue goes
/// on under a load, and what falls under something held is a force that relaxes. The part of the
/// fall that the first half holds tells relaxation from a drift, which is straight.
void require_no_recession(const PreparedRecording& recording, std::span<const double> load,
                          double load_noise, std::span<const double> answer, double answer_noise) {
  constexpr double kSure = 4.0, kFar = 0.1, kFirst = 0.6;
  const HeldLoad hold = held_load(load, load_noise);
  if (!hold.held) return;
  const auto after = answer.subspan(hold.from);
  const std::size_t tenth = after.size() / 10;
  const auto level = [&](std::size_t at) { return average_of(after.subspan(at, tenth)); };
  const double first = level(0), middle = level((after.size() - tenth) / 2),
               last = level(after.size() - tenth);
  const double fall = first - last;
  if (!(fall > kFar * range_of(answer) && fall > kSure * answer_noise)) return;
  if (!(first - middle > kFirst * fall)) return;
  const Recording& r = recording.recording;
  const std::string_view held_word = load_word(r), falling = answer_word(r);
  throw bad_input(
      fmt::format("recording '{}'", recording.name),
      fmt::format(
          "the {} recedes by {} % of its range while the {} is held, which no passive tissue does",
          falling, significant(100.0 * fall / range_of(answer), 2), held_word),
      fmt::format("the titles of {} and {} the other way round in the file, if they are swapped",
                  held_word, falling));
}

/// Samples that show each phase of the drive: all at its beginning, then every second, fourth, ...
/// of an equal number each, as what relaxes or creeps slows down. The last one is kept.
std::vector<std::size_t> thinned(const std::vector<Phase>& phases, std::size_t end) {
  constexpr std::size_t kEach = 32;  // samples of one distance
  std::vector<std::size_t> kept;
  for (std::size_t i = 0, phase = 0; i < end; ++i) {
    while (phase + 1 < phases.size() && i >= phases[phase + 1].first) ++phase;
    const std::size_t since = phases.empty() ? i : i - phases[phase].first;
    std::size_t stride = 1;
    while (since >= 2 * kEach * stride) stride *= 2;
    if (since % stride == 0 || i + 1 == end) kept.push_back(i);
  }
  return kept;
}

/// Part of a recording of creep, as in its table, for the search for starts: until the load
/// falls, and few samples. A noisy strain that is imposed while it recovers loses contact and finds
/// it again by the hundred, and each time takes steps instead of a closed form: with the recovery
/// of 600 samples this took ten times as long as all other fits of the family.
PreparedRecording with_imposed_strain(PreparedRecording recording) {
  if (!recording.load_imposed) return recording;
  Recording& r = recording.recording;
  const std::size_t end = std::max<std::size_t>(end_of_load(r.drive), 2);
  std::vector<std::size_t> kept = thinned(recording.phases.phases, std::min(end, r.drive.size()));
  recording.to_s = std::min(recording.to_s, r.time_s[kept.back()]);
  for (std::vector<double>* column : {&r.time_s, &r.drive, &r.response}) {
    for (std::size_t k = 0; k < kept.size(); ++k) (*column)[k] = (*column)[kept[k]];
    column->resize(kept.size());
  }
  r.response_sd.clear();
  recording.recording = with_imposed_load(std::move(r));
  recording.load_imposed = false;
  recording.phases = find_phases(recording.recording);
  return recording;
}

}  // namespace

std::vector<std::vector<double>> creep_starts(const FitConfig& config,
                                              std::span<const PreparedRecording> recordings,
                                              const SetupOptions& options) {
  constexpr std::size_t kMost = 5;
  std::vector<PreparedRecording> strained;
  for (const PreparedRecording& r : recordings) strained.push_back(with_imposed_strain(r));
  std::vector<std::vector<double>> starts;
  // Where these fits give up, the search begins anywhere.
  const std::string failure = gave_up([&] {
    FitConfig simple = recording_config(config.law.value(), strained, options);
    simple.profiles = false;
    const FitResult fit = run_fit(simple, data_sets(strained));
    for (const DistinctMinimum& m : fit.minima) {
      if (starts.size() == kMost) break;
      std::vector<double> start = start_values(searched_parameters(config));
      for (std::size_t j = 0; j < start.size(); ++j) {
        const FitParameter& p = config.parameters[j].fit;
        for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
          if (fit.parameters[i].parameter.name != p.name) continue;
          start[j] = std::clamp(m.minimum.natural[i], p.lower, p.upper);
        }
      }
      starts.push_back(std::move(start));
    }
  });
  if (!failure.empty()) starts.clear();
  return starts;
}

namespace {

/// Both channels of a recording of stress and strain, or of force and depth, until the load ends.
struct Channels {
  std::span<const double> time, answer, load;
  double answer_noise = 0.0, load_noise = 0.0;
  bool stretched = false;  ///< stress and strain

  [[nodiscard]] double of_answer() const { return answer_noise / range_of(answer); }
  [[nodiscard]] double of_load() const { return load_noise / range_of(load); }
};

/// Nothing of a recording of other quantities, or too short to tell its noise.
std::optional<Channels> channels_of(const Recording& r) {
  constexpr std::size_t kFewest = 40;
  const bool stretched =
      r.drive_quantity == Quantity::strain && r.response_quantity == Quantity::stress;
  const bool pressed = r.drive_quantity == Quantity::indentation_depth &&
                       r.response_quantity == Quantity::contact_force;
  if (!stretched && !pressed) return std::nullopt;
  if (r.drive.size() != r.response.size() || r.time_s.size() != r.drive.size()) return std::nullopt;
  const std::size_t end = end_of_load(r.response);
  if (end < kFewest) return std::nullopt;
  Channels c{std::span(r.time_s).first(end), std::span(r.drive).first(end),
             std::span(r.response).first(end)};
  c.stretched = stretched;
  if (!(range_of(c.answer) > 0.0 && range_of(c.load) > 0.0)) return std::nullopt;
  c.answer_noise = data::noise_about_neighbours(c.time, c.answer);
  c.load_noise = data::noise_about_neighbours(c.time, c.load);
  return c;
}

}  // namespace

std::optional<Remark> imposed_channel_remark(const std::string& name, const Recording& as_read,
                                             bool load_imposed) {
  constexpr double kNoisy = 2e-3;  // of the range: a channel that is not exact
  const std::optional<Channels> c = channels_of(as_read);
  if (!c) return std::nullopt;
  const bool both_noisy = std::min(c->of_answer(), c->of_load()) > kNoisy;
  if (!load_imposed && !both_noisy) return std::nullopt;
  const std::string load(load_word(as_read));
  const std::string answer(answer_word(as_read));
  const std::string& taken = load_imposed ? load : answer;
  const std::string held = fmt::format("it was held while the {} went on: creep", answer);
  const bool creeps = !load_imposed && crept(c->load, c->answer, c->answer_noise);
  return Remark{
      load_imposed ? "load_imposed" : "both_channels_noisy",
      fmt::format(
          "{}: {}; noise is {} % of the range of the {} and {} % of that of the {}. The fit "
          "takes the {} as exact{}",
          name,
          load_imposed ? fmt::format("the {} was imposed ({})", load, held)
          : creeps     ? fmt::format("both channels are noisy, and the {} is too noisy to be taken "
                                         "as imposed ({})",
                                     load, held)
                       : std::string("both channels are noisy"),
          significant(100.0 * c->of_answer(), 2), answer, significant(100.0 * c->of_load(), 2),
          load, taken,
          both_noisy
              ? fmt::format(": the noise of the {} makes fast branches look weaker and intervals "
                            "too narrow",
                            taken)
              : fmt::format(" and compares the {}", answer))};
}

namespace {

/// Refuses creep that was recorded from after the load: how the strain began is in no sample.
void require_begin_of_creep(const PreparedRecording& recording) {
  constexpr double kStill = 0.005, kMost = 0.5, kSure = 8.0;
  constexpr std::size_t kFewest = 20;
  const Recording& r = recording.recording;
  if (r.drive_quantity != Quantity::strain || r.response_quantity != Quantity::stress) return;
  if (r.drive.size() != r.response.size() || r.time_s.size() != r.drive.size()) return;
  const std::size_t end = end_of_load(r.response);
  if (end < kFewest) return;
  const auto load = std::span(r.response).first(end), strain = std::span(r.drive).first(end);
  const double level = average_of(load);
  if (!(level > 0.0) || range_of(load) > kStill * level) return;
  const double noise = data::noise_about_neighbours(std::span(r.time_s).first(end), strain);
  const double by = average_of(strain.last(end / 4)) - strain.front();
  if (!(by > std::max(kMost * range_of(strain), kSure * noise))) return;
  throw bad_input(
      fmt::format("recording '{}'", recording.name),
      "the stress is the same from the first sample on while the strain goes on: creep without the "
      "samples before its load",
      "the recording from before the load on: one row without a stress is enough");
}

}  // namespace

void find_imposed_channel(PreparedRecording& recording) {
  constexpr double kMuchLess = 3.0;  // times less noise, in parts of the range
  require_begin_of_creep(recording);
  const Recording& r = recording.recording;
  const std::optional<Channels> c = channels_of(r);
  if (!c) return;
  require_no_recession(recording, c->load, c->load_noise, c->answer, c->answer_noise);
  // Not of a contact: with a noisy force imposed, 500 rows were not answered within a minute.
  const bool slower = c->stretched && crept(c->load, c->answer, c->answer_noise);
  const bool stairs =
      c->stretched && crept_on_stairs(c->load, c->load_noise, c->answer, c->answer_noise);
  const bool held = was_held(c->load, c->load_noise, c->answer, c->answer_noise) &&
                    (c->of_answer() > kMuchLess * c->of_load() || slower);
  const bool rested = c->stretched && c->of_answer() >= c->of_load() &&
                      crept_to_rest(c->load, c->load_noise, c->answer, c->answer_noise);
  const bool imposed = held || stairs || rested;
  if (auto remark = imposed_channel_remark(recording.name, r, imposed)) {
    recording.remarks.push_back(*std::move(remark));
  }
  recording.load_imposed = imposed;
  if (imposed) recording.recording = with_imposed_load(std::move(recording.recording));
}

}  // namespace tpm::fit
