// Declared in tpm/fit/recording/placement.hpp.
// The onset of contact.
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "tpm/fit/recording/placement.hpp"
#include "tpm/fit/spikes_at_rest.hpp"

namespace tpm::fit {
namespace {

double ramp_travel(const PreparedRecording& r) {
  return r.phases.peak_drive - r.phases.contact_drive;
}

std::size_t deepest_sample(const PreparedRecording& r) {
  const std::vector<double>& drive = r.recording.drive;
  return static_cast<std::size_t>(std::ranges::max_element(drive) - drive.begin());
}

/// The last sample of the loading that begins at contact, or of all if there is none.
std::size_t end_of_loading(const PreparedRecording& r) {
  for (const Phase& phase : r.phases.phases) {
    if (phase.kind == PhaseKind::loading && phase.last > r.phases.contact_index) return phase.last;
  }
  return r.recording.drive.size() - 1;
}

/// Samples of the first part of the ramp with those before it, and the least squares of
/// zero + A x^m + B x^(m+1) for a given contact.
class FirstLoading {
 public:
  /// @param drift of the zero after origin_s, which is taken off
  /// @param reading responses of the recording
  FirstLoading(const PreparedRecording& r, std::span<const double> reading, std::size_t first,
               std::size_t last, double length, double drift, double origin_s)
      : length_(length) {
    constexpr std::size_t kMost = 160;
    const std::size_t block = std::max<std::size_t>((last - first + 1) / kMost, 1);
    for (std::size_t i = first; i + block <= last + 1; i += block) {
      double drive = 0.0, response = 0.0;
      for (std::size_t k = i; k < i + block; ++k) {
        drive += r.recording.drive[k] / static_cast<double>(block);
        const double off = drift * (r.recording.time_s[k] - origin_s);
        response += (reading[k] - off) / static_cast<double>(block);
      }
      drive_.push_back(drive);
      response_.push_back(response);
    }
    block_ = block;
  }

  struct Best {
    double contact = 0.0, squares = std::numeric_limits<double>::infinity();
    double a = 0.0, b = 0.0;
  };

  [[nodiscard]] Best at(double contact, double m, double zero, bool bends) const {
    double pp = 0.0, pq = 0.0, qq = 0.0, py = 0.0, qy = 0.0, yy = 0.0;
    for (std::size_t i = 0; i < drive_.size(); ++i) {
      const double y = response_[i] - zero;
      yy += y * y;
      const double x = (drive_[i] - contact) / length_;
      if (!(x > 0.0)) continue;
      const double p = std::pow(x, m), q = p * x;
      pp += p * p;
      pq += p * q;
      qq += q * q;
      py += p * y;
      qy += q * y;
    }
    Best best{contact, yy, 0.0, 0.0};
    const double determinant = pp * qq - pq * pq;
    if (bends && determinant > 1e-12 * pp * qq) {
      best.a = (py * qq - qy * pq) / determinant;
      best.b = (qy * pp - py * pq) / determinant;
    } else if (pp > 0.0) {
      best.a = py / pp;
    }
    if (best.a <= 0.0) return {contact, yy, 0.0, 0.0};
    best.squares = std::max(yy - best.a * py - best.b * qy, 0.0);
    return best;
  }

  /// The contact of least squares between two drives: a scan, then golden sections.
  [[nodiscard]] Best find(double lower, double upper, double m, double zero, bool bends) const {
    constexpr int kScan = 40, kSections = 30;
    constexpr double kGolden = 0.6180339887498949;
    const double step = (upper - lower) / kScan;
    Best best;
    for (int i = 0; i <= kScan; ++i) {
      const Best here = at(lower + i * step, m, zero, bends);
      if (here.squares < best.squares) best = here;
    }
    double a = std::max(best.contact - step, lower), b = std::min(best.contact + step, upper);
    for (int i = 0; i < kSections; ++i) {
      const Best low = at(b - kGolden * (b - a), m, zero, bends);
      const Best high = at(a + kGolden * (b - a), m, zero, bends);
      (low.squares < high.squares ? b : a) =
          low.squares < high.squares ? high.contact : low.contact;
      for (const Best& each : {low, high}) {
        if (each.squares < best.squares) best = each;
      }
    }
    return best;
  }

  /// Standard deviation of the contact for independent readings of unit variance.
  [[nodiscard]] double spread(const Best& best, double m) const {
    Eigen::MatrixXd g(static_cast<Eigen::Index>(drive_.size()), 3);
    for (std::size_t i = 0; i < drive_.size(); ++i) {
      const double x = std::max((drive_[i] - best.contact) / length_, 0.0);
      const auto row = static_cast<Eigen::Index>(i);
      const double p = x > 0.0 ? std::pow(x, m - 1.0) : 0.0;
      g.row(row) << -(best.a * m * p + best.b * (m + 1.0) * p * x) / length_, p * x, p * x * x;
    }
    const Eigen::Vector3d size = g.colwise().norm();
    if (!(size.minCoeff() > 0.0)) return std::numeric_limits<double>::infinity();
    g *= size.cwiseInverse().asDiagonal();
    const Eigen::Matrix3d normal = g.transpose() * g;
    const Eigen::LDLT<Eigen::Matrix3d> ldlt(normal);
    const double variance = ldlt.solve(Eigen::Vector3d::UnitX())[0];
    return variance > 0.0 ? std::sqrt(variance) / size[0] : std::numeric_limits<double>::infinity();
  }

  /// The same loading as of another part, in this one's length.
  [[nodiscard]] Best rescaled(const Best& best, const FirstLoading& other, double m) const {
    const double ratio = length_ / other.length_;
    return {best.contact, best.squares, best.a * std::pow(ratio, m),
            best.b * std::pow(ratio, m + 1.0)};
  }

  [[nodiscard]] std::size_t size() const { return drive_.size(); }
  /// Samples averaged into one.
  [[nodiscard]] double block() const { return static_cast<double>(block_); }

 private:
  std::vector<double> drive_, response_;
  std::size_t block_ = 1;
  double length_;
};

/// Contact from one part of the ramp, for one exponent.
struct PartOnset {
  Measured drive;
  double expected_sd = 0.0;  ///< as the largest part tells the loading
  double squares = 0.0;      ///< left over
  double variance = 0.0;     ///< of a reading
};

struct PartRange {
  double lower = 0.0, upper = 0.0, noise_sd = 0.0, phi = 0.0;
  Measured zero;
};

/// Distance by which contact may move on one side until the squares have risen, or to the end of
/// the range.
double way_to(const FirstLoading& part, const FirstLoading::Best& best, double end, double m,
              double zero, double squares) {
  constexpr int kHalvings = 40;
  if (part.at(end, m, zero, true).squares < squares) return std::abs(end - best.contact);
  double inside = best.contact;
  double outside = end;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (inside + outside);
    (part.at(middle, m, zero, true).squares < squares ? inside : outside) = middle;
  }
  return std::abs(outside - best.contact);
}

/// The largest part, and where its contact is looked for.
struct LargestPart {
  const FirstLoading* part = nullptr;
  PartRange range;
};

PartOnset onset_of_part(const FirstLoading& part, const PartRange& range,
                        const LargestPart& largest, double m) {
  constexpr double kDeparture = 0.25;  // of what B moves
  const auto best = part.find(range.lower, range.upper, m, range.zero.value, true);
  const auto power = part.find(range.lower, range.upper, m, range.zero.value, false);
  const auto above = part.find(range.lower, range.upper, m, range.zero.value + range.zero.sd, true);
  const auto below = part.find(range.lower, range.upper, m, range.zero.value - range.zero.sd, true);
  const double n = static_cast<double>(part.size());
  PartOnset onset;
  onset.squares = best.squares;
  onset.variance = std::max(best.squares / std::max(n - 3.0, 1.0),
                            range.noise_sd * range.noise_sd / part.block());
  const double correlated = (1.0 + range.phi) / (1.0 - range.phi);
  const double noise = std::sqrt(onset.variance * correlated);
  const PartRange& wide = largest.range;
  const auto shape = largest.part->find(wide.lower, wide.upper, m, wide.zero.value, true);
  const double expected = part.spread(part.rescaled(shape, *largest.part, m), m) * noise;
  // Of a faint onset the squares rise less on the side of the tissue than a parabola would.
  const double risen = best.squares + onset.variance * correlated;
  const double before = way_to(part, best, range.lower, m, range.zero.value, risen);
  const double after = way_to(part, best, range.upper, m, range.zero.value, risen);
  const double of_noise = std::max(expected, std::sqrt(0.5 * (before * before + after * after)));
  const double of_zero = 0.5 * (above.contact - below.contact);
  const double of_shape = kDeparture * (power.contact - best.contact);
  onset.drive = {best.contact, std::hypot(of_noise, of_zero, of_shape)};
  onset.expected_sd = std::hypot(expected, of_zero, of_shape);
  return onset;
}

/// Over exponents that fit: the mean and its standard deviation under equal odds before.
PartOnset onset_of_exponents(const FirstLoading& part, const PartRange& range,
                             const LargestPart& largest) {
  constexpr std::array kExponents{1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0};
  std::vector<PartOnset> all;
  double least = std::numeric_limits<double>::infinity();
  for (const double m : kExponents) {
    all.push_back(onset_of_part(part, range, largest, m));
    least = std::min(least, all.back().squares);
  }
  const double n = static_cast<double>(part.size());
  const double variance =
      std::max(least / std::max(n - 4.0, 1.0), range.noise_sd * range.noise_sd / part.block());
  const double correlated = (1.0 + range.phi) / (1.0 - range.phi);
  double total = 0.0, mean = 0.0, square = 0.0, expected = 0.0;
  for (const PartOnset& each : all) {
    const double weight =
        variance > 0.0 ? std::exp(-0.5 * (each.squares - least) / (variance * correlated)) : 1.0;
    total += weight;
    mean += weight * each.drive.value;
  }
  mean /= total;
  for (const PartOnset& each : all) {
    const double weight =
        variance > 0.0 ? std::exp(-0.5 * (each.squares - least) / (variance * correlated)) : 1.0;
    const double off = each.drive.value - mean;
    square += weight * (off * off + each.drive.sd * each.drive.sd) / total;
    expected += weight * (off * off + each.expected_sd * each.expected_sd) / total;
  }
  return {{mean, std::sqrt(square)}, std::sqrt(expected), least, variance};
}

/// A preload extrapolated back along a power, from its slope at the first movement.
Onset stated_onset(const PreparedRecording& r, std::optional<double> exponent) {
  constexpr double kPart = 0.1;     // of the travel, for the slope
  constexpr double kStated = 0.05;  // of the travel, where there is no preload
  constexpr double kMiddle = 2.0;   // of the exponents 1 to 3
  const std::vector<double>& drive = r.recording.drive;
  const std::vector<double>& response = r.recording.response;
  const double travel = ramp_travel(r);
  const double start =
      r.phases.contact_found && !r.phases.preloaded ? r.phases.contact_drive : drive.front();
  double n = 0.0, su = 0.0, sy = 0.0, suu = 0.0, suy = 0.0;
  for (std::size_t i = 0; i <= deepest_sample(r) && drive[i] <= start + kPart * travel; ++i) {
    const double u = drive[i] - start;
    n += 1.0;
    su += u;
    sy += response[i];
    suu += u * u;
    suy += u * response[i];
  }
  const double spread = n * suu - su * su;
  const double slope = spread > 0.0 ? (n * suy - su * sy) / spread : 0.0;
  Onset onset;
  onset.from_rest = false;
  const double floor = r.phases.floor_response;
  const double way =
      slope > 0.0 ? std::min(exponent.value_or(kMiddle) * std::abs(floor) / slope, travel) : 0.0;
  onset.drive = {start - (floor > 0.0 && r.phases.preloaded ? way : 0.0),
                 std::max(way, kStated * travel)};
  return onset;
}

/// Where the ramp has too few samples to be extrapolated: between two of them, and before the force
/// that was seen by as far as a power stays below what noise hides.
Measured coarse_onset(const PreparedRecording& r, const RestReadings& rests,
                      std::optional<double> exponent) {
  constexpr double kHidden = 5.0;  // standard deviations
  constexpr double kSteepest = 3.0;
  const std::vector<double>& drive = r.recording.drive;
  const std::size_t contact = r.phases.contact_index;
  const std::size_t next = std::min(contact + 1, drive.size() - 1);
  const double step = std::abs(drive[next] - drive[contact > 0 ? contact - 1 : 0]);
  const double risen = std::abs(r.phases.peak_response - r.phases.floor_response);
  const double share = risen > 0.0 ? std::min(kHidden * rests.noise_sd / risen, 1.0) : 1.0;
  const double hidden = ramp_travel(r) * std::pow(share, 1.0 / exponent.value_or(kSteepest));
  return {r.phases.contact_drive - 0.5 * hidden, std::hypot(step / std::sqrt(12.0), 0.5 * hidden)};
}

}  // namespace

Onset find_onset(const PreparedRecording& r, const RestReadings& rests,
                 std::optional<double> exponent) {
  constexpr std::array kParts{0.05, 0.1, 0.15, 0.2, 0.3, 0.5};
  constexpr std::size_t kFewestInContact = 8;
  constexpr double kLeast = 1e-4;  // of the travel: nothing is known better
  if (rests.before == 0 || !rests.zero) return stated_onset(r, exponent);
  const std::vector<double>& drive = r.recording.drive;
  const std::vector<double> reading = without_spikes(r.recording.time_s, r.recording.response);
  const double travel = ramp_travel(r);
  const std::size_t contact = r.phases.contact_index;
  const std::size_t end = end_of_loading(r);
  // A drift that is in the fit moves the zero on to the time of contact.
  const bool drifts = drift_finding(r, rests) == DriftFinding::told;
  const double drift = drifts ? rests.drift->value : 0.0;
  Measured zero = *rests.zero;
  if (drifts) {
    zero.sd = std::hypot(zero.sd, rests.drift->sd * (r.recording.time_s[contact] - rests.origin_s));
  }
  // A part begins where contact is expected: at first where the force is seen, which is late in
  // noise, then where the largest part says that it lies.
  double expected = r.phases.contact_drive;
  const auto passes = [&](double depth) {
    std::size_t i = contact;
    while (i > 0 && drive[i - 1] >= depth) --i;
    while (i < end && drive[i] < depth) ++i;
    return i;
  };
  struct Part {
    FirstLoading loading;
    PartRange range;
    std::size_t inside = 0;
  };
  const auto part_of = [&](double share, double room) -> std::optional<Part> {
    const std::size_t last = passes(expected + share * travel);
    const std::size_t begin = std::min(passes(expected), last);
    const std::size_t inside = last - begin;
    if (inside < kFewestInContact) return std::nullopt;
    // As many samples before the room as within the part, but no long rest, which would be
    // averaged.
    const std::size_t lowest =
        std::max(passes(expected - room), begin > 2 * inside ? begin - 2 * inside : 0);
    const std::size_t first = lowest > inside ? lowest - inside : 0;
    return Part{FirstLoading(r, reading, first, last, share * travel, drift, rests.origin_s),
                {expected - room, expected + room, rests.noise_sd, rests.phi, zero},
                inside};
  };
  const auto onset_of = [&](const Part& part, const Part& largest) {
    const LargestPart whole{&largest.loading, largest.range};
    return exponent ? onset_of_part(part.loading, part.range, whole, *exponent)
                    : onset_of_exponents(part.loading, part.range, whole);
  };
  constexpr double kRoom = 0.8, kSure = 3.0;  // of the part; standard deviations
  const double widest = kRoom * kParts.back() * travel;
  double unsure = 0.0;
  for (int round = 0; round < 2; ++round) {
    const auto part = part_of(kParts.back(), widest);
    if (!part) break;
    const Measured found = onset_of(*part, *part).drive;
    expected = found.value;
    unsure = found.sd;
  }
  // The largest part says what each would tell, and the one that would tell most is taken: of what
  // they tell themselves, the one that noise has made steep looks best, and is late.
  Onset best;
  double least = std::numeric_limits<double>::infinity();
  const auto largest = part_of(kParts.back(), widest);
  for (const double share : kParts) {
    const double room = std::min(std::max(kRoom * share * travel, kSure * unsure), widest);
    const auto part = part_of(share, room);
    if (!part || !largest) continue;
    const PartOnset onset = onset_of(*part, *largest);
    if (!(onset.expected_sd < least)) continue;
    least = onset.expected_sd;
    best = {onset.drive, share, part->inside, true};
  }
  if (best.samples == 0) best.drive = coarse_onset(r, rests, exponent);
  constexpr double kMost = 0.25;  // of the travel
  best.drive.sd = std::clamp(best.drive.sd, kLeast * travel, kMost * travel);
  return best;
}

std::optional<double> first_loading_exponent(const LawSpec& law, std::optional<double> of_probe) {
  switch (law.kernel) {
    case Kernel::linear:
      return 1.0;
    case Kernel::hertz:
      return 1.5;
    default:
      return of_probe;
  }
}

}  // namespace tpm::fit
