#include "tpm/data/drive_pieces.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "tpm/data/off_neighbours.hpp"

namespace tpm::data {
namespace {

// In standard deviations of the drive's noise: what a single sample stays within, and what the
// difference of two samples does.
constexpr double kSample = 6.0;
constexpr double kDifference = 10.0;
constexpr double kCorner = 0.005;  // part of the range by which a straight piece may be bent
constexpr std::size_t kBrief = 3;  // fewer intervals than this are no hold

double range_of(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low;
}

/// The sample farthest from the chord between two others, and how far it is.
std::pair<std::size_t, double> farthest(const std::vector<double>& time,
                                        const std::vector<double>& drive, std::size_t first,
                                        std::size_t last) {
  const double slope = (drive[last] - drive[first]) / (time[last] - time[first]);
  std::pair<std::size_t, double> found{first, 0.0};
  for (std::size_t i = first + 1; i < last; ++i) {
    const double distance = std::abs(drive[i] - drive[first] - slope * (time[i] - time[first]));
    if (distance > found.second) found = {i, distance};
  }
  return found;
}

/// The samples at which straight pieces meet (Ramer's and Douglas and Peucker's method), with both
/// ends.
std::vector<std::size_t> corners(const std::vector<double>& time, const std::vector<double>& drive,
                                 double tolerance) {
  std::vector<std::size_t> found = {0, drive.size() - 1};
  std::vector<std::pair<std::size_t, std::size_t>> open = {{0, drive.size() - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    const auto [corner, distance] = farthest(time, drive, first, last);
    if (distance <= tolerance) continue;
    found.push_back(corner);
    open.emplace_back(first, corner);
    open.emplace_back(corner, last);
  }
  std::sort(found.begin(), found.end());
  return found;
}

Motion direction(double change) {
  return change > 0.0 ? Motion::rising : Motion::falling;
}

/// Classifies straight pieces and joins those of one motion.
class Pieces {
 public:
  Pieces(const std::vector<double>& time, const std::vector<double>& drive, double jitter,
         double hold_tolerance)
      : time_(time), drive_(drive), jitter_(jitter), range_(range_of(drive)) {
    const auto ends = corners(time, drive, std::max(kSample * jitter, kCorner * range_));
    const double still = std::max(kDifference * jitter, hold_tolerance * range_);
    for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
      const double change = drive[ends[i + 1]] - drive[ends[i]];
      const bool moves = std::abs(change) > still;
      pieces_.push_back({moves ? direction(change) : Motion::still, ends[i], ends[i + 1]});
    }
  }

  std::vector<DrivePiece> take() {
    calm_drifts();
    settle_brief_pieces();
    join();
    settle_reversals();
    join();
    return std::move(pieces_);
  }

 private:
  [[nodiscard]] double change(const DrivePiece& piece) const {
    return drive_[piece.last] - drive_[piece.first];
  }
  [[nodiscard]] double speed(const DrivePiece& piece) const {
    return std::abs(change(piece)) / (time_[piece.last] - time_[piece.first]);
  }

  /// A machine that holds may creep a little further for long: slow and small is still.
  void calm_drifts() {
    constexpr double kSlow = 0.01;   // of the fastest piece
    constexpr double kSmall = 0.05;  // of the range
    double fastest = 0.0;
    for (const DrivePiece& piece : pieces_) {
      if (piece.motion != Motion::still) fastest = std::max(fastest, speed(piece));
    }
    for (DrivePiece& piece : pieces_) {
      const bool drifts =
          speed(piece) < kSlow * fastest && std::abs(change(piece)) < kSmall * range_;
      if (drifts) piece.motion = Motion::still;
    }
  }

  /// A few samples at a rounded corner or a turning point are no hold: they belong to the motion
  /// beside them.
  void settle_brief_pieces() {
    constexpr double kLeast = 1e-4;  // of the range
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      DrivePiece& piece = pieces_[i];
      if (piece.motion != Motion::still || piece.last - piece.first >= kBrief) continue;
      const Motion before = i > 0 ? pieces_[i - 1].motion : Motion::still;
      const Motion after = i + 1 < pieces_.size() ? pieces_[i + 1].motion : Motion::still;
      const bool moves = std::abs(change(piece)) > kSample * jitter_ + kLeast * range_;
      const Motion own = direction(change(piece));
      if (before != Motion::still && after != Motion::still) {
        piece.motion = own == after ? after : before;
      } else if (moves && (own == before || own == after)) {
        piece.motion = own;
      }
    }
  }

  /// A measured drive wobbles, and overshoots where it stops: a small fall that is made up for, or
  /// that ends in a hold, is no unloading.
  void settle_reversals() {
    constexpr double kSmall = 0.05;  // of the range
    constexpr double kMadeUp = 1.5;  // of the fall: a larger rise is a motion of its own
    for (std::size_t i = 1; i + 1 < pieces_.size(); ++i) {
      DrivePiece& piece = pieces_[i];
      const double fall = -change(piece);
      if (piece.motion != Motion::falling || fall > kSmall * range_) continue;
      const Motion before = pieces_[i - 1].motion;
      DrivePiece& next = pieces_[i + 1];
      if (before == Motion::rising) {
        if (next.motion != Motion::falling) piece.motion = next.motion;
      } else if (before == Motion::still && next.motion == Motion::rising) {
        piece.motion = Motion::still;
        if (change(next) <= kMadeUp * fall) next.motion = Motion::still;
      }
    }
  }

  void join() {
    std::vector<DrivePiece> joined;
    for (const DrivePiece& piece : pieces_) {
      if (!joined.empty() && joined.back().motion == piece.motion) {
        joined.back().last = piece.last;
      } else {
        joined.push_back(piece);
      }
    }
    pieces_ = std::move(joined);
  }

  const std::vector<double>& time_;
  const std::vector<double>& drive_;
  double jitter_;
  double range_;
  std::vector<DrivePiece> pieces_;
};

}  // namespace

double noise_sd(const std::vector<double>& time, const std::vector<double>& values,
                std::size_t first, std::size_t last) {
  constexpr std::size_t kLeast = 8;
  constexpr double kMeanToSd = 1.2533141373155003;  // of a normal distribution
  const std::size_t count = last - first + 1;
  if (count < kLeast) return 0.0;
  const std::vector<double> off = off_neighbours(std::span(time).subspan(first, count),
                                                 std::span(values).subspan(first, count));
  if (const double noise = noise_of(off); noise > 0.0) return noise;
  // Coarsely rounded values repeat, and more than half of the distances are 0.
  double sum = 0.0;
  for (const double distance : off) sum += std::abs(distance);
  return kMeanToSd * sum / static_cast<double>(off.size());
}

std::vector<DrivePiece> drive_pieces(const std::vector<double>& time,
                                     const std::vector<double>& drive, double jitter,
                                     double hold_tolerance) {
  return Pieces(time, drive, jitter, hold_tolerance).take();
}

}  // namespace tpm::data
