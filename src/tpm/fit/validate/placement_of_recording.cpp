#include "tpm/fit/validate/placement_of_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/enum_names.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/recording/placement.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr auto kRules = std::to_array<Word<PlacementRule>>({{PlacementRule::held, "held"},
                                                            {PlacementRule::onset, "onset"},
                                                            {PlacementRule::fitted, "fitted"}});
constexpr double kRampPart = 0.75;  // of the travel beyond contact that tells the onset
constexpr double kAgrees = 2.0;     // standard uncertainties
constexpr double kClear = 3.0;      // so far before the onset nothing touches
constexpr double kGuard = 0.02;     // of the travel, between readings of the zero and the onset
constexpr Eigen::Index kFewestOfRamp = 5;

/// Contact and size (and zero, if nothing before contact tells it) by least squares.
class OnsetSearch {
 public:
  OnsetSearch(const LawAlong& law, const Recording& recording, const RecordingParts& parts)
      : law_(law), recording_(recording), parts_(parts) {}

  struct Found {
    double contact = 0.0;
    double size = 1.0;
    Eigen::Index first = 0, count = 0;  ///< samples that tell it
    Eigen::VectorXd by_reading;         ///< d contact / d (reading less zero), of these samples
    Eigen::RowVectorXd by_law;
  };

  /// @param zero none: found with the contact
  [[nodiscard]] std::optional<Found> find(double guess, std::optional<double> zero) const {
    Found f;
    f.contact = guess;
    const double travel = recording_.drive[parts_.ramp_last] - recording_.drive[parts_.ramp_first];
    constexpr int kMost = 40;
    for (int i = 0; i < kMost; ++i) {
      const LawAlong::At s = law_.at(f.contact);
      if (!choose_window(f)) return std::nullopt;
      const Eigen::MatrixXd columns = columns_of(s, f, !zero);
      const Eigen::VectorXd y = readings(f).array() - zero.value_or(0.0);
      if (i == 0) f.size = size_of(columns.col(1), y, !zero);
      const Eigen::MatrixXd at = columns_of(s, f, !zero);
      if (!at.allFinite()) return std::nullopt;
      const Eigen::MatrixXd pseudo = solve_symmetric(at.transpose() * at, at.transpose());
      Eigen::VectorXd miss = y - f.size * s.value.segment(f.first, f.count);
      const Eigen::VectorXd step = pseudo * miss;
      if (!step.allFinite()) return std::nullopt;
      const double moved = std::clamp(step[0], -0.2 * travel, 0.2 * travel);
      f.contact = std::clamp(f.contact + moved, recording_.drive[parts_.ramp_first] - travel,
                             recording_.drive[parts_.ramp_last] - 0.1 * travel);
      f.size += step[1];
      f.by_reading = pseudo.row(0).transpose();
      f.by_law = -f.size * f.by_reading.transpose() * s.by_law.middleRows(f.first, f.count);
      constexpr double kDone = 1e-9;
      if (std::abs(moved) < kDone * travel) return f;
    }
    return f;
  }

 private:
  bool choose_window(Found& f) const {
    const double last = recording_.drive[parts_.ramp_last];
    const double limit = f.contact + kRampPart * (last - f.contact);
    std::size_t end = parts_.ramp_first;
    while (end < parts_.ramp_last && recording_.drive[end + 1] <= limit) ++end;
    f.first = static_cast<Eigen::Index>(parts_.ramp_first);
    f.count = static_cast<Eigen::Index>(end - parts_.ramp_first + 1);
    Eigen::Index touching = 0;
    for (std::size_t i = parts_.ramp_first; i <= end; ++i) {
      touching += recording_.drive[i] > f.contact;
    }
    return touching >= kFewestOfRamp;
  }
  [[nodiscard]] Eigen::VectorXd readings(const Found& f) const {
    return Eigen::VectorXd::Map(recording_.response.data() + f.first, f.count);
  }
  [[nodiscard]] static double size_of(const Eigen::VectorXd& s, const Eigen::VectorXd& y,
                                      bool with_zero) {
    if (!with_zero) return s.squaredNorm() > 0.0 ? s.dot(y) / s.squaredNorm() : 1.0;
    const Eigen::VectorXd c = s.array() - s.mean();
    return c.squaredNorm() > 0.0 ? c.dot(y) / c.squaredNorm() : 1.0;
  }
  [[nodiscard]] static Eigen::MatrixXd columns_of(const LawAlong::At& s, const Found& f,
                                                  bool with_zero) {
    Eigen::MatrixXd columns(f.count, with_zero ? 3 : 2);
    columns.col(0) = f.size * s.by_contact.segment(f.first, f.count);
    columns.col(1) = s.value.segment(f.first, f.count);
    if (with_zero) columns.col(2).setOnes();
    return columns;
  }

  const LawAlong& law_;
  const Recording& recording_;
  const RecordingParts& parts_;
};

/// Number of samples, from the first one on, that lie before contact.
std::size_t samples_before(const Recording& r, const RecordingParts& parts, double contact,
                           double margin, bool at_rest_too) {
  std::size_t n = at_rest_too ? parts.ramp_first + 1 : 0;
  if (n == 0) {
    while (n <= parts.ramp_first && r.drive[n] <= contact - margin) ++n;
    if (n <= parts.ramp_first) return n;
  }
  while (n < parts.ramp_last && r.drive[n] <= contact - margin) ++n;
  return n;
}

void set_zero(ValidationPlacement& p, const Recording& r, std::size_t count) {
  p.zero_readings = count;
  p.zero_by_reading.setZero();
  p.zero = 0.0;
  if (count == 0) return;
  const auto n = static_cast<Eigen::Index>(count);
  p.zero_by_reading.head(n).setConstant(1.0 / static_cast<double>(count));
  p.zero = Eigen::VectorXd::Map(r.response.data(), n).mean();
}

}  // namespace

double ZeroDrift::u(const Eigen::VectorXd& weight, const std::vector<double>& time_s) const {
  const auto time = Eigen::VectorXd::Map(time_s.data(), weight.size());
  return u_per_s * std::abs(weight.dot((time.array() - origin_s).matrix()));
}

std::optional<ZeroDrift> take_out_drift(PreparedRecording& recording) {
  // A short rest with correlated noise knows the uncertainty of its trend badly: at 3 some drifts
  // that are none are taken out, and U holds the error of the peak less often (reports/validation,
  // AR(1) 0.9).
  constexpr double kSeen = 4.0;
  const RestReadings rests = read_rests(recording);
  if (!rests.zero || !rests.drift) return std::nullopt;
  const ZeroDrift drift{rests.drift->value, rests.drift->sd, rests.origin_s};
  if (!(std::abs(drift.per_s) > kSeen * drift.u_per_s)) return std::nullopt;
  Recording& r = recording.recording;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    r.response[i] -= drift.per_s * (r.time_s[i] - drift.origin_s);
  }
  return drift;
}

namespace {

class HeldPlacement {
 public:
  HeldPlacement(const LawAlong& law, const PreparedRecording& recording,
                const RecordingParts& parts, const ReadingScatter& scatter)
      : law_(law),
        prepared_(recording),
        r_(recording.recording),
        parts_(parts),
        scatter_(scatter),
        travel_(r_.drive[parts.ramp_last] - r_.drive[parts.ramp_first]) {
    const auto n = static_cast<Eigen::Index>(r_.response.size());
    p_.contact_by_reading = p_.zero_by_reading = Eigen::VectorXd::Zero(n);
    p_.contact_by_law = p_.zero_by_law = Eigen::RowVectorXd::Zero(law.root().rows());
  }

  ValidationPlacement find(bool always_onset, KnownPlacement known) {
    if (known == KnownPlacement::surface) {
      p_.contact_words = "the session's surface";
      p_.zero_known = true;
    } else if (known == KnownPlacement::no_load) {
      p_.contact_words = "load 0";
      set_zero(p_, r_, zero_count(0.0, 0.0));
    } else if (known == KnownPlacement::threshold) {
      p_.contact = prepared_.phases.contact_drive;
      p_.contact_words = "the sample that passes --contact-force";
      const std::size_t at = prepared_.phases.contact_index;
      if (prepared_.phases.contact_found && at > 0) {
        p_.contact_u_sampled = std::abs(r_.drive[at] - r_.drive[at - 1]) / std::numbers::sqrt3;
      }
      set_zero(p_, r_, samples_before(r_, parts_, p_.contact, kGuard * travel_, false));
    } else if (law_.contact_of_law() || r_.drive_quantity == Quantity::strain) {
      p_.contact = law_.contact_of_law() ? law_.contact_in_law() : 0.0;
      p_.contact_words = law_.contact_of_law() ? "the law's" : "strain 0";
      set_zero(p_, r_, zero_count(p_.contact, 0.0));
    } else {
      find_onset(always_onset);
    }
    return finished();
  }

 private:
  /// At rest nothing touches if contact lies no more than margin before it.
  [[nodiscard]] std::size_t zero_count(double contact, double u) const {
    const double rest = r_.drive[parts_.ramp_first];
    const bool rest_is_before = (parts_.ramp_first > 0 || starts_at_zero()) &&
                                rest <= contact + std::max(kClear * u, 1e-3 * travel_);
    const double margin = std::max(kClear * u, kGuard * travel_);
    return samples_before(r_, parts_, contact, margin, rest_is_before);
  }

  [[nodiscard]] bool starts_at_zero() const {
    return std::abs(r_.drive[parts_.ramp_first]) <=
           std::max(1e-3 * travel_, 3.0 * prepared_.phases.drive_jitter_sd);
  }

  void find_onset(bool always) {
    const OnsetSearch search(law_, r_, parts_);
    const bool found = prepared_.phases.contact_found && !prepared_.phases.preloaded;
    const double rest = r_.drive[parts_.ramp_first];
    double guess = found ? std::max(prepared_.phases.contact_drive, rest) : rest;
    // A recording that begins in motion may begin in contact.
    const bool rests = parts_.ramp_first > 0 || starts_at_zero();
    std::size_t zeros = samples_before(r_, parts_, guess, 2.0 * kGuard * travel_, rests);
    std::optional<OnsetSearch::Found> onset;
    constexpr int kPasses = 4;
    for (int pass = 0; pass < kPasses; ++pass) {
      set_zero(p_, r_, zeros);
      onset = search.find(guess, zeros > 0 ? std::optional(p_.zero) : std::nullopt);
      if (!onset) break;
      take(*onset);
      const std::size_t next = zero_count(*p_.onset, *p_.onset_u);
      if (next == zeros) break;
      zeros = next;
      guess = *p_.onset;
    }
    const bool at_zero = starts_at_zero();
    const bool agrees = !onset || std::abs(*p_.onset) <= kAgrees * *p_.onset_u;
    if (at_zero && agrees && (!always || !onset)) {
      hold_at_zero();
      return;
    }
    if (!onset) {
      throw bad_input(fmt::format("recording '{}'", prepared_.name),
                      "too few samples on the ramp tell where contact begins",
                      "--contact-force, or a depth that is 0 at the surface");
    }
    p_.contact = *p_.onset;
    p_.contact_words = fmt::format("onset, from the ramp up to {} % of its travel",
                                   significant(100.0 * kRampPart, 2));
  }

  void take(const OnsetSearch::Found& f) {
    p_.contact_by_reading.setZero();
    p_.contact_by_reading.segment(f.first, f.count) = f.by_reading;
    p_.contact_by_reading -= f.by_reading.sum() * p_.zero_by_reading;
    p_.contact_by_law = f.by_law;
    p_.onset = f.contact;
    p_.onset_u = scatter_.of(r_.time_s, p_.contact_by_reading);
  }

  void hold_at_zero() {
    p_.contact = 0.0;
    p_.contact_by_reading.setZero();
    p_.contact_by_law.setZero();
    p_.contact_words = "depth 0, where the recording starts";
    if (p_.onset) {
      const Dimension d = quantity_dimension(r_.drive_quantity);
      p_.contact_words += fmt::format(" (the onset, {} with u {}, agrees)",
                                      sized_text(d, *p_.onset, 3), sized_text(d, *p_.onset_u, 3));
    }
    set_zero(p_, r_, parts_.ramp_first + 1);
  }

  ValidationPlacement finished() {
    p_.contact_u = std::hypot(scatter_.of(r_.time_s, p_.contact_by_reading), p_.contact_u_sampled);
    p_.zero_u = scatter_.of(r_.time_s, p_.zero_by_reading);
    p_.rest_in_contact = p_.zero_readings == 0 && !p_.zero_known && parts_.ramp_first > 0 &&
                         r_.drive[parts_.ramp_first] > p_.contact;
    return p_;
  }

  const LawAlong& law_;
  const PreparedRecording& prepared_;
  const Recording& r_;
  const RecordingParts& parts_;
  const ReadingScatter& scatter_;
  double travel_;
  ValidationPlacement p_;
};

/// Contact and zero by least squares of the whole prediction, from the held ones on.
ValidationPlacement fitted_placement(const LawAlong& law, const Recording& r,
                                     const RecordingParts& parts, const ReadingScatter& scatter,
                                     const ValidationPlacement& held) {
  ValidationPlacement p = held;
  const std::size_t last = parts.hold_last.value_or(parts.ramp_last);
  const auto n = static_cast<Eigen::Index>(last + 1);
  const auto y = Eigen::VectorXd::Map(r.response.data(), n);
  const bool contact =
      !law.contact_of_law() && !law.load_imposed() && r.drive_quantity != Quantity::strain;
  const double travel = r.drive[parts.ramp_last] - r.drive[parts.ramp_first];
  constexpr int kMost = 40;
  for (int i = 0; i < kMost; ++i) {
    const LawAlong::At s = law.at(p.contact);
    Eigen::MatrixXd columns(n, contact ? 2 : 1);
    columns.col(0).setOnes();
    if (contact) columns.col(1) = s.by_contact.head(n);
    const Eigen::MatrixXd pseudo =
        solve_symmetric(columns.transpose() * columns, columns.transpose());
    const Eigen::VectorXd miss = y - s.value.head(n);
    const Eigen::VectorXd step = pseudo * (miss.array() - p.zero).matrix();
    if (!step.allFinite()) {
      throw Error(ExitCode::numerical, fmt::format("recording '{}'", r.header.id),
                  "contact and zero cannot be fitted", "--placement held");
    }
    p.zero += step[0];
    p.zero_by_reading.setZero();
    p.zero_by_reading.head(n) = pseudo.row(0).transpose();
    p.zero_by_law = -pseudo.row(0) * s.by_law.topRows(n);
    if (!contact) break;
    p.contact += std::clamp(step[1], -0.2 * travel, 0.2 * travel);
    p.contact_by_reading.setZero();
    p.contact_by_reading.head(n) = pseudo.row(1).transpose();
    p.contact_by_law = -pseudo.row(1) * s.by_law.topRows(n);
    constexpr double kDone = 1e-9;
    if (std::abs(step[1]) < kDone * travel) break;
  }
  p.zero_readings = last + 1;
  p.contact_words = "fitted to this recording, with the zero";
  p.contact_u_sampled = 0.0;
  p.contact_u = scatter.of(r.time_s, p.contact_by_reading);
  p.zero_u = scatter.of(r.time_s, p.zero_by_reading);
  // The noise shared by the fit and the held placement is in both.
  const double between_zeros = scatter.of(r.time_s, p.zero_by_reading - held.zero_by_reading);
  if (held.zero_readings > 0 && between_zeros > 0.0) {
    p.zero_moved = std::abs(p.zero - held.zero) / between_zeros;
  }
  if (contact && held.onset) {
    const double u = std::max(p.contact_u, *held.onset_u);
    if (u > 0.0) p.contact_moved = std::abs(p.contact - held.contact) / u;
  }
  return p;
}

}  // namespace

std::string_view placement_rule_name(PlacementRule rule) noexcept {
  return entry_of(kRules, rule).text;
}

PlacementRule parse_placement_rule(std::string_view text, std::string_view where) {
  return parse_word(kRules, "placement", text, where);
}

ValidationPlacement place_for_validation(const LawAlong& law, const PreparedRecording& recording,
                                         const RecordingParts& parts, const ReadingScatter& scatter,
                                         PlacementRule rule, KnownPlacement known) {
  const ValidationPlacement held =
      HeldPlacement(law, recording, parts, scatter).find(rule == PlacementRule::onset, known);
  if (rule != PlacementRule::fitted || known == KnownPlacement::surface) return held;
  return fitted_placement(law, recording.recording, parts, scatter, held);
}

}  // namespace tpm::fit
