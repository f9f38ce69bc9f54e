#include "tpm/fit/validate/functional.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/median.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/data/drive_pieces.hpp"
#include "tpm/show/figure.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kFewestOfLine = 5;
constexpr double kPeakPart = 0.05;    // of the hold, at most as long as the ramp
constexpr double kEndPart = 0.1;      // of the hold
constexpr double kLocalPart = 0.025;  // of the ramp or the hold, on each side of a place
constexpr std::size_t kFewestOfHold = 10;

/// Samples [first, last], both included, of one window.
struct Section {
  std::size_t first, last;
  [[nodiscard]] std::size_t count() const { return last - first + 1; }
};

void add_line(Functional& f, const Eigen::VectorXd& curve, std::span<const double> x,
              const Section& part, double at, double factor = 1.0) {
  const Eigen::VectorXd w = line_weights(x.subspan(part.first, part.count()), at);
  const auto first = static_cast<Eigen::Index>(part.first);
  f.weight.segment(first, w.size()) += factor * w;
  f.value += factor * w.dot(curve.segment(first, w.size()));
}

Functional nothing(const Eigen::VectorXd& curve) {
  return {0.0, Eigen::VectorXd::Zero(curve.size())};
}

/// The samples within a distance of a place, at least kFewestOfLine if the range has them.
Section around(std::span<const double> x, const Section& range, double at, double distance) {
  Section part = range;
  while (part.count() > kFewestOfLine && x[part.first] < at - distance) ++part.first;
  while (part.count() > kFewestOfLine && x[part.last] > at + distance) --part.last;
  return part;
}

Functional peak_of(const RecordingParts& parts, std::span<const double> t,
                   const Eigen::VectorXd& curve) {
  Functional f = nothing(curve);
  if (!parts.has_hold()) {
    const Section ramp{parts.ramp_first, parts.ramp_last};
    const double length = kEndPart * (t[parts.ramp_last] - t[parts.ramp_first]);
    add_line(f, curve, t, around(t, ramp, parts.corner_s, length), parts.corner_s);
    return f;
  }
  Section part{*parts.hold_first, *parts.hold_last};
  const double length = std::min(kPeakPart * (t[part.last] - parts.corner_s),
                                 t[parts.ramp_last] - t[parts.ramp_first]);
  while (part.count() > kFewestOfLine && t[part.last] > parts.corner_s + length) --part.last;
  add_line(f, curve, t, part, parts.corner_s);
  return f;
}

/// The last tenth of the hold.
Section end_window(const RecordingParts& parts, std::span<const double> t) {
  Section part{*parts.hold_first, *parts.hold_last};
  const double from = t[part.last] - kEndPart * (t[part.last] - parts.corner_s);
  while (part.count() > 1 && t[part.first] < from) ++part.first;
  return part;
}

Functional end_of(const RecordingParts& parts, std::span<const double> t,
                  const Eigen::VectorXd& curve) {
  const Section part = end_window(parts, t);
  Functional f = nothing(curve);
  const auto first = static_cast<Eigen::Index>(part.first);
  const auto count = static_cast<Eigen::Index>(part.count());
  f.weight.segment(first, count).setConstant(1.0 / static_cast<double>(part.count()));
  f.value = curve.segment(first, count).mean();
  return f;
}

std::optional<Functional> rate_of(const RecordingParts& parts, std::span<const double> t,
                                  const Eigen::VectorXd& curve) {
  const Section part = end_window(parts, t);
  constexpr std::size_t kFewestOfRate = 3;
  if (part.count() < kFewestOfRate) return std::nullopt;
  Functional f = nothing(curve);
  // Of a line through the window: what it rises by between its ends.
  const double length = t[part.last] - t[part.first];
  add_line(f, curve, t, part, t[part.last], 1.0 / length);
  add_line(f, curve, t, part, t[part.first], -1.0 / length);
  return f;
}

std::optional<Functional> ratio_of(const Functional& peak, const Functional& end) {
  if (peak.value == 0.0) return std::nullopt;
  const double ratio = end.value / peak.value;
  return Functional{ratio, (end.weight - ratio * peak.weight) / peak.value};
}

/// The window about a time of the hold, which is longer where the response is slower.
Section local_window(const RecordingParts& parts, std::span<const double> t, double at) {
  constexpr double kPartOfTime = 0.2;
  return around(t, {*parts.hold_first, *parts.hold_last}, at, kPartOfTime * (at - parts.corner_s));
}

Functional line_in(const Section& window, std::span<const double> t, double at,
                   const Eigen::VectorXd& curve) {
  Functional f = nothing(curve);
  add_line(f, curve, t, window, at);
  return f;
}

std::optional<Functional> half_time_of(const RecordingParts& parts, std::span<const double> t,
                                       const Functional& peak, const Functional& end,
                                       const Eigen::VectorXd& curve) {
  const double level = 0.5 * (peak.value + end.value);
  double early = parts.corner_s, late = t[*parts.hold_last];
  const double sign = peak.value > end.value ? 1.0 : -1.0;  // relaxation, or creep
  if (peak.value == end.value) return std::nullopt;
  constexpr int kHalvings = 50;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (early + late);
    const Functional f = line_in(local_window(parts, t, middle), t, middle, curve);
    (sign * (f.value - level) > 0.0 ? early : late) = middle;
  }
  const double at = 0.5 * (early + late);
  const Section window = local_window(parts, t, at);
  const Functional here = line_in(window, t, at, curve);
  const double slope = line_in(window, t, at + 1.0, curve).value - here.value;  // a line: per s
  if (!(sign * slope < 0.0)) return std::nullopt;
  return Functional{at - parts.corner_s, (0.5 * (peak.weight + end.weight) - here.weight) / slope};
}

std::optional<Functional> work_of(const RecordingParts& parts, std::span<const double> drive,
                                  const Eigen::VectorXd& curve) {
  if (parts.loop_last <= parts.ramp_last) return std::nullopt;
  Functional f = nothing(curve);
  for (std::size_t i = parts.ramp_first; i < parts.loop_last; ++i) {
    const double half = 0.5 * (drive[i + 1] - drive[i]);
    f.weight[static_cast<Eigen::Index>(i)] += half;
    f.weight[static_cast<Eigen::Index>(i + 1)] += half;
  }
  const auto first = static_cast<Eigen::Index>(parts.ramp_first);
  const auto count = static_cast<Eigen::Index>(parts.loop_last - parts.ramp_first + 1);
  f.value = f.weight.segment(first, count).dot(curve.segment(first, count));
  return f;
}

std::optional<Functional> at_time(double at, const RecordingParts& parts, std::span<const double> t,
                                  const Eigen::VectorXd& curve) {
  if (at < t.front() || at > t.back()) return std::nullopt;
  // A line does not reach over a corner.
  Section range{0, t.size() - 1};
  if (at <= t[parts.ramp_first]) {
    range.last = std::max<std::size_t>(parts.ramp_first, 1);
  } else if (at < parts.corner_s || !parts.has_hold()) {
    range = {parts.ramp_first, parts.ramp_last};
    if (at > parts.corner_s) range = {parts.ramp_last, t.size() - 1};
  } else if (at <= t[*parts.hold_last]) {
    range = {*parts.hold_first, *parts.hold_last};
  } else {
    range.first = *parts.hold_last;
  }
  const double length = kLocalPart * (t[range.last] - t[range.first]);
  Functional f = nothing(curve);
  add_line(f, curve, t, around(t, range, at, length), at);
  return f;
}

std::optional<Functional> at_depth(double at, double contact, const RecordingParts& parts,
                                   const Recording& r, const Eigen::VectorXd& curve) {
  const double place = contact + at;
  const Section ramp{parts.ramp_first, parts.ramp_last};
  if (place < r.drive[ramp.first] || place > r.drive[ramp.last]) return std::nullopt;
  const double length = kLocalPart * (r.drive[ramp.last] - r.drive[ramp.first]);
  Functional f = nothing(curve);
  add_line(f, curve, r.drive, around(r.drive, ramp, place, length), place);
  return f;
}

/// Where the lines of ramp and hold meet in the drive.
double corner_of(const Recording& r, const RecordingParts& parts) {
  const double last = r.time_s[parts.ramp_last];
  if (!parts.has_hold()) return last;
  // The later half of the ramp, which the machine's start does not bend.
  const std::size_t from = parts.ramp_first + (parts.ramp_last - parts.ramp_first) / 2;
  const std::size_t to = std::max(parts.ramp_last - 1, from + 1);
  if (to > parts.ramp_last || from + 1 > parts.ramp_last) return last;
  const std::span<const double> t(r.time_s.data() + from, to - from + 1);
  const auto value =
      Eigen::VectorXd::Map(r.drive.data() + from, static_cast<Eigen::Index>(t.size()));
  const double middle = 0.5 * (t.front() + t.back());
  const double slope =
      (line_weights(t, t.back()).dot(value) - line_weights(t, t.front()).dot(value)) /
      (t.back() - t.front());
  double level = 0.0;
  for (std::size_t i = *parts.hold_first + 1; i <= *parts.hold_last; ++i) level += r.drive[i];
  level /= static_cast<double>(*parts.hold_last - *parts.hold_first);
  if (!(slope > 0.0)) return last;
  const double meets = middle + (level - line_weights(t, middle).dot(value)) / slope;
  // A machine that slows down meets its hold later than its line does.
  return std::clamp(meets, t.back(), r.time_s[*parts.hold_first + 1]);
}

void set_corner(RecordingParts& parts, const Recording& r) {
  parts.corner_s = corner_of(r, parts);
  while (parts.has_hold() && *parts.hold_first < *parts.hold_last &&
         r.time_s[*parts.hold_first] < parts.corner_s) {
    ++*parts.hold_first;
  }
}

using PieceIterator = std::vector<DrivePiece>::const_iterator;

/// True if the drive goes on after a piece in which it stood still for a moment.
bool is_pause(PieceIterator piece, PieceIterator end, const RecordingParts& parts,
              const Recording& r) {
  constexpr double kRisesOn = 0.1;  // of the drive's range
  if (end - piece < 2 || piece->motion != Motion::still) return false;
  const DrivePiece& on = *(piece + 1);
  if (on.motion != Motion::rising) return false;
  const auto [low, high] = std::ranges::minmax_element(r.drive);
  if (r.drive[on.last] - r.drive[on.first] < kRisesOn * (*high - *low)) return false;
  const auto lasts = [&](std::size_t first, std::size_t last) {
    return r.time_s[last] - r.time_s[first];
  };
  return lasts(piece->first, piece->last) <
         std::max(lasts(parts.ramp_first, parts.ramp_last), lasts(on.first, on.last));
}

constexpr auto kQuantityWords =
    std::to_array<Word<QuantityKind>>({{QuantityKind::peak, "peak"},
                                       {QuantityKind::end_of_hold, "end"},
                                       {QuantityKind::relaxation_ratio, "ratio"},
                                       {QuantityKind::half_time, "half-time"},
                                       {QuantityKind::rate, "rate"},
                                       {QuantityKind::work, "work"}});

double parse_place(std::string_view text, Quantity drive, std::string_view where,
                   QuantityKind& kind) {
  const std::string expected =
      fmt::format("{}, a time such as \"5 s\" or a depth", listed(kQuantityWords));
  const auto unknown = [&] {
    const auto known = mapped<std::string>(kQuantityWords, [](const auto& w) { return w.text; });
    return bad_input(
        where, fmt::format("unknown quantity '{}'{}", printable(text), did_you_mean(text, known)),
        expected);
  };
  const QuantityText parts = split_quantity(text);
  const Dimension of_drive = quantity_dimension(drive);
  if (!parts.unit.empty() && !is_unit(parts.unit)) {
    throw unknown();
  }
  if (!find_number(parts.number)) {
    throw unknown();
  }
  const bool time =
      !parts.unit.empty() && parse_unit(parts.unit, where).dimension == Dimension::time;
  kind = time ? QuantityKind::at_time : QuantityKind::at_depth;
  return parse_quantity(text, time ? Dimension::time : of_drive, where);
}

}  // namespace

QuantityOfInterest parse_quantity_of_interest(std::string_view text, Quantity drive,
                                              std::string_view where) {
  if (const auto* word = find_entry(kQuantityWords, text)) return {word->meaning};
  QuantityOfInterest q;
  q.at = parse_place(text, drive, where, q.kind);
  return q;
}

bool is_creep(Quantity response) noexcept {
  return response == Quantity::indentation_depth || response == Quantity::strain ||
         response == Quantity::relative_length;
}

std::string quantity_words(const QuantityOfInterest& quantity, Quantity drive, Quantity response) {
  const std::string name(quantity_short_name(response));
  switch (quantity.kind) {
    case QuantityKind::peak:
      return is_creep(response) ? fmt::format("{} at the corner", name)
                                : fmt::format("peak {}", name);
    case QuantityKind::end_of_hold:
      return fmt::format("{} at end of hold", name);
    case QuantityKind::relaxation_ratio:
      return is_creep(response) ? "creep ratio" : "relaxation ratio";
    case QuantityKind::half_time:
      return is_creep(response) ? "creep half time" : "half time";
    case QuantityKind::work:
      return "work of the loop";
    case QuantityKind::rate:
      return fmt::format("rate of {} at end of hold", name);
    case QuantityKind::at_time:
      return fmt::format("{} at {} s", name, significant(quantity.at, 6));
    case QuantityKind::at_depth:
      break;
  }
  const Unit unit = shown_unit(quantity_dimension(drive));
  return fmt::format("{} at {}", name, with_unit(significant(quantity.at / unit.to_si, 6), unit));
}

RecordingParts parts_of(const PreparedRecording& recording) {
  const Recording& r = recording.recording;
  RecordingParts parts;
  std::vector<DrivePiece> pieces;
  if (r.drive.size() == r.response.size() && r.drive.size() >= 2) {
    pieces = drive_pieces(r.time_s, r.drive, recording.phases.drive_jitter_sd,
                          PhaseOptions().hold_tolerance);
  }
  const auto ramp = std::ranges::find(pieces, Motion::rising, &DrivePiece::motion);
  if (ramp == pieces.end()) {
    throw bad_input(fmt::format("recording '{}'", recording.name), "its drive never rises",
                    "a ramp, with a hold or without");
  }
  parts.ramp_first = ramp->first;
  parts.ramp_last = parts.loop_last = ramp->last;
  auto next = ramp + 1;
  for (; is_pause(next, pieces.end(), parts, r); next += 2) {
    parts.ramp_last = parts.loop_last = (next + 1)->last;
  }
  if (next != pieces.end() && next->motion == Motion::still &&
      next->last - next->first >= kFewestOfHold) {
    parts.hold_first = next->first;
    parts.hold_last = next->last;
  }
  set_corner(parts, r);
  const auto falling = std::find_if(
      ramp, pieces.end(), [](const DrivePiece& p) { return p.motion == Motion::falling; });
  if (falling != pieces.end()) parts.loop_last = falling->last;
  return parts;
}

RecordingParts parts_of_press(const PreparedRecording& recording, double hold_asked_s) {
  constexpr double kNear = 0.02, kAway = 0.1;  // of the level
  constexpr double kTremor = 3.0;              // standard deviations of the depth in the hold
  const Recording& r = recording.recording;
  const std::vector<double>& depth = r.drive;
  const auto deepest = std::ranges::max_element(depth);
  if (deepest == depth.end() || !(*deepest > depth.front())) {
    throw bad_input(fmt::format("recording '{}'", recording.name), "its drive never rises",
                    "a press into the tissue");
  }
  const auto place = [&](auto where) { return static_cast<std::size_t>(where - depth.begin()); };
  const auto asked =
      depth.begin() + (std::ranges::lower_bound(r.time_s, hold_asked_s) - r.time_s.begin());
  const double level = asked == depth.end() ? 0.0 : median(std::vector<double>(asked, depth.end()));
  RecordingParts parts;
  parts.ramp_last = place(deepest);
  if (level > 0.0) {
    std::vector<double> away;
    for (auto d = asked; d != depth.end(); ++d) away.push_back(std::abs(*d - level));
    constexpr double kMedianToSd = 1.4826;  // of a normal distribution
    const double near =
        std::clamp(kTremor * kMedianToSd * median(std::move(away)), kNear * level, kAway * level);
    const auto arrived = std::ranges::find_if(depth, [&](double d) { return d >= level - near; });
    const auto left = std::find_if(depth.rbegin(), depth.rend(),
                                   [&](double d) { return d >= level - near - kAway * level; });
    const std::size_t last = depth.size() - 1 - static_cast<std::size_t>(left - depth.rbegin());
    if (place(arrived) + kFewestOfHold <= last) {
      parts.ramp_last = place(arrived);
      parts.hold_first = parts.ramp_last;
      parts.hold_last = last;
    }
  }
  constexpr double kStill = 1e-3;  // of what the ramp reaches
  const double rest = depth.front();
  while (parts.ramp_first + 1 < parts.ramp_last &&
         depth[parts.ramp_first + 1] <= rest + kStill * (depth[parts.ramp_last] - rest)) {
    ++parts.ramp_first;
  }
  parts.loop_last = parts.ramp_last;
  set_corner(parts, r);
  return parts;
}

bool ComparedPart::whole() const {
  constexpr double kMost = 0.9;
  return depth >= kMost * depth_of_all && left_out_s <= (1.0 - kMost) * loaded_s;
}

ComparedPart compared_part(const Recording& recording, const RecordingParts& parts,
                           std::optional<double> hold_asked_s) {
  const std::vector<double>& t = recording.time_s;
  const std::vector<double>& drive = recording.drive;
  const std::size_t last = std::max(parts.hold_last.value_or(parts.ramp_last), parts.loop_last);
  const double rest = drive[parts.ramp_first];
  ComparedPart part;
  part.from_s = t[parts.ramp_first];
  part.corner_s = parts.corner_s;
  part.to_s = t[last];
  const auto begin = drive.begin();
  part.depth = *std::max_element(begin + static_cast<std::ptrdiff_t>(parts.ramp_first),
                                 begin + static_cast<std::ptrdiff_t>(last) + 1) -
               rest;
  part.depth_of_all = *std::ranges::max_element(drive) - rest;
  if (parts.has_hold()) part.hold_s = t[*parts.hold_last] - parts.corner_s;
  if (hold_asked_s) {
    part.hold_asked_s = part.loaded_s = t.back() - *hold_asked_s;
    part.left_out_s = parts.has_hold() ? t.back() - part.to_s : part.loaded_s;
    return part;
  }
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (drive[i] - rest < 0.5 * part.depth_of_all) continue;
    part.loaded_s += t[i] - t[i - 1];
    if (i > last) part.left_out_s += t[i] - t[i - 1];
  }
  return part;
}

std::vector<QuantityOfInterest> default_quantities(const RecordingParts& parts, bool creep) {
  std::vector<QuantityOfInterest> all{{QuantityKind::peak}};
  if (parts.has_hold()) {
    all.push_back({QuantityKind::end_of_hold});
    all.push_back({QuantityKind::relaxation_ratio});
    all.push_back({QuantityKind::half_time});
    if (creep) all.push_back({QuantityKind::rate});
  }
  if (parts.loop_last > parts.ramp_last) all.push_back({QuantityKind::work});
  return all;
}

std::optional<Functional> read_quantity(const QuantityOfInterest& quantity,
                                        const RecordingParts& parts, const Recording& recording,
                                        double contact, const Eigen::VectorXd& curve) {
  const std::span<const double> t = recording.time_s;
  std::optional<Functional> f;
  const bool of_hold = quantity.kind == QuantityKind::end_of_hold ||
                       quantity.kind == QuantityKind::relaxation_ratio ||
                       quantity.kind == QuantityKind::half_time ||
                       quantity.kind == QuantityKind::rate;
  if (of_hold && !parts.has_hold()) return std::nullopt;
  switch (quantity.kind) {
    case QuantityKind::peak:
      f = peak_of(parts, t, curve);
      break;
    case QuantityKind::end_of_hold:
      f = end_of(parts, t, curve);
      break;
    case QuantityKind::relaxation_ratio:
      f = ratio_of(peak_of(parts, t, curve), end_of(parts, t, curve));
      break;
    case QuantityKind::half_time:
      f = half_time_of(parts, t, peak_of(parts, t, curve), end_of(parts, t, curve), curve);
      break;
    case QuantityKind::work:
      f = work_of(parts, recording.drive, curve);
      break;
    case QuantityKind::rate:
      f = rate_of(parts, t, curve);
      break;
    case QuantityKind::at_time:
      f = at_time(quantity.at, parts, t, curve);
      break;
    case QuantityKind::at_depth:
      f = at_depth(quantity.at, contact, parts, recording, curve);
      break;
  }
  if (f && !(std::isfinite(f->value) && f->weight.allFinite())) return std::nullopt;
  return f;
}

double weighted_sum(const Eigen::VectorXd& weight, const Eigen::VectorXd& values) {
  return (weight.array() != 0.0).select(weight.array() * values.array(), 0.0).sum();
}

Eigen::RowVectorXd weighted_sum(const Eigen::VectorXd& weight, const Eigen::MatrixXd& values) {
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(values.cols());
  for (Eigen::Index i = 0; i < weight.size(); ++i) {
    if (weight[i] != 0.0) sum += weight[i] * values.row(i);
  }
  return sum;
}

Eigen::VectorXd line_weights(std::span<const double> x, double at) {
  const auto n = static_cast<Eigen::Index>(x.size());
  const auto places = Eigen::VectorXd::Map(x.data(), n);
  const Eigen::VectorXd centred = places.array() - places.mean();
  const double spread = centred.squaredNorm();
  const double mean_share = 1.0 / static_cast<double>(n);
  if (!(spread > 0.0)) return Eigen::VectorXd::Constant(n, mean_share);
  return (centred * ((at - places.mean()) / spread)).array() + mean_share;
}

}  // namespace tpm::fit
