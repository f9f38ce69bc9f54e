#include "tpm/law/contact_retreat.hpp"

#include <algorithm>
#include <cmath>

namespace tpm::law {
namespace {

/// The depth u and, for each branch, h = integral of exp(-rate (t - s)) du(s): what a kernel that
/// is a straight line would depend on, without regard to the sign of its force.
struct StraightHistory {
  double time_s = 0.0;
  double drive = 0.0;
  double u = 0.0;
  Eigen::ArrayXd h;
  Eigen::ArrayXd by_rate, by_contact;  ///< dh; empty unless wanted
};

/// The mean of exp(-z x) over x in [0, 1] and its derivative by z.
struct MeanDecay {
  double value, slope;
};

MeanDecay mean_decay(double z) {
  if (z < 1e-3) {
    return {1.0 - z / 2.0 + z * z / 6.0 - z * z * z / 24.0,
            -0.5 + z / 3.0 - z * z / 8.0 + z * z * z / 30.0};
  }
  const double r = std::exp(-z);
  return {(1.0 - r) / z, (r * z - (1.0 - r)) / (z * z)};
}

/// A stretch of the growth in which the depth passes `from` to `to` for the first time.
struct Growth {
  StraightHistory begin;
  double end_s = 0.0;
  double end_u = 0.0;
  double from = 0.0;
  double to = 0.0;
  bool at_rest = false;
};

/// Follows the depth through a protocol and finds the edge of the contact.
class EdgeFinder {
 public:
  EdgeFinder(const LawAtParameters& law, bool want_slopes) : law_(law), want_slopes_(want_slopes) {
    now_.h.setZero(law.relaxation.stiffness.size());
    if (!want_slopes) return;
    now_.by_rate = now_.h;
    now_.by_contact = now_.h;
  }

  void begin(const Knot& first, bool relaxed) {
    now_.time_s = first.time_s;
    now_.drive = relaxed ? first.value : law_.contact;
    now_.u = relaxed ? depth(first.value) : 0.0;
    largest_ = now_.u;
    if (largest_ > 0.0) {
      growth_.push_back({now_, now_.time_s, largest_, 0.0, largest_, true});
    }
    if (!relaxed) move_to(first);
  }

  /// To the next knot or moment (a jump if it is at the same time).
  void move_to(const Knot& to) {
    for (const Knot& part : parts(to)) step(part);
  }

  /// Ends the growth: the parts met from here on belong to a contact that has been larger.
  void end_growth() {
    place_ = growth_.size() - 1;
    least_ = largest_;
    margin_ = kContactJitter * largest_;
  }

  /// The edge of now. Once unknown it stays so.
  ContactEdge edge() {
    ContactEdge edge;
    if (unknown_) {
      edge.state = ContactEdge::State::unknown;
      return edge;
    }
    while (place_ > 0 && pull(growth_[place_], growth_[place_].from) < 0.0) --place_;
    while (place_ + 1 < growth_.size() && pull(growth_[place_], growth_[place_].to) > 0.0) {
      ++place_;
    }
    const Growth& part = growth_[place_];
    const bool lost = place_ == 0 && pull(part, part.from) < 0.0;
    const double u = lost ? 0.0 : passed(part);
    unknown_ = u > least_ + margin_;
    least_ = std::min(least_, u);
    if (unknown_ || lost) {
      edge.state = unknown_ ? ContactEdge::State::unknown : ContactEdge::State::lost;
      return edge;
    }
    const StraightHistory met = at(part, u);
    edge.met_s = met.time_s;
    edge.met_drive = met.drive;
    edge.at_rest = part.at_rest;
    edge.later_s = now_.time_s - met.time_s;
    edge.pull = pull(part, u);
    if (want_slopes_) edge.pull_by = pull_by(part, met);
    return edge;
  }

  [[nodiscard]] const StraightHistory& now() const { return now_; }
  void return_to(StraightHistory state) { now_ = std::move(state); }

 private:
  [[nodiscard]] double depth(double drive) const { return std::max(drive - law_.contact, 0.0); }

  /// The way to a knot, cut where the probe passes the undeformed surface.
  [[nodiscard]] std::vector<Knot> parts(const Knot& to) const {
    const double before = now_.drive - law_.contact;
    const double after = to.value - law_.contact;
    if (!(before * after < 0.0)) return {to};
    const double share = before / (before - after);
    return {{now_.time_s + share * (to.time_s - now_.time_s), law_.contact}, to};
  }

  /// Over a part of the way. Where the probe meets or leaves the undeformed surface, the depth
  /// begins or ceases to follow `contact`.
  void step(const Knot& to) {
    const bool meets = now_.u == 0.0 && depth(to.value) > 0.0;
    const bool leaves = now_.u > 0.0 && depth(to.value) == 0.0;
    if (want_slopes_ && meets) now_.by_contact -= 1.0;
    if (depth(to.value) > largest_) {
      growth_.push_back({now_, to.time_s, depth(to.value), largest_, depth(to.value), false});
      largest_ = depth(to.value);
    }
    now_ = advanced(now_, to);
    if (want_slopes_ && leaves) now_.by_contact += 1.0;
  }

  [[nodiscard]] StraightHistory advanced(const StraightHistory& from, const Knot& to) const {
    StraightHistory s = from;
    s.time_s = to.time_s;
    s.drive = to.value;
    s.u = depth(to.value);
    const double step = to.time_s - from.time_s;
    const double du = s.u - from.u;
    for (Eigen::Index j = 0; j < s.h.size(); ++j) {
      if (!(step > 0.0)) {
        s.h[j] += du;
        continue;
      }
      const double z = step * law_.relaxation.rate_per_s[j];
      const double r = std::exp(-z);
      const MeanDecay mean = std::isinf(step) ? MeanDecay{0.0, 0.0} : mean_decay(z);
      s.h[j] = r * from.h[j] + du * mean.value;
      if (!want_slopes_) continue;
      const double aged = std::isinf(step) ? 0.0 : step * (du * mean.slope - r * from.h[j]);
      s.by_rate[j] = r * from.by_rate[j] + aged;
      s.by_contact[j] = r * from.by_contact[j];
    }
    return s;
  }

  /// The history when the depth u was passed for the first time.
  [[nodiscard]] StraightHistory at(const Growth& part, double u) const {
    const StraightHistory& b = part.begin;
    if (part.at_rest) {
      StraightHistory s = b;
      s.u = u;
      s.drive = u + law_.contact;
      return s;
    }
    const double share = (u - b.u) / (part.end_u - b.u);
    return advanced(b, {b.time_s + share * (part.end_s - b.time_s), u + law_.contact});
  }

  /// exp(-rate (t - t1)); 0 for what was met under rest, all of which has relaxed
  [[nodiscard]] Eigen::ArrayXd kept(const Growth& part, const StraightHistory& met) const {
    const double later = now_.time_s - met.time_s;
    if (part.at_rest) return Eigen::ArrayXd::Zero(met.h.size());
    return (-law_.relaxation.rate_per_s.array() * later).exp();
  }

  /// The integral of G(t - s) du(s) from the moment at which u was met to now; falls with u.
  [[nodiscard]] double pull(const Growth& part, double u) const {
    const StraightHistory met = at(part, u);
    const auto k = law_.relaxation.stiffness.array();
    return law_.relaxation.constant * (now_.u - u) + (k * (now_.h - kept(part, met) * met.h)).sum();
  }

  [[nodiscard]] Slopes pull_by(const Growth& part, const StraightHistory& met) const {
    const RelaxationSum& m = law_.relaxation;
    const Eigen::ArrayXd decay = kept(part, met);
    const double later = now_.time_s - met.time_s;
    const auto k = m.stiffness.array();
    Slopes by = Slopes::Zero(law_.parameter_count);
    for (std::size_t q = 0; q < m.by.size(); ++q) {
      const auto c = static_cast<Eigen::Index>(q);
      by[m.by[q]] += m.d_constant[c] * (now_.u - met.u) +
                     (m.d_stiffness.col(c).array() * (now_.h - decay * met.h)).sum();
    }
    for (std::size_t j = 0; j < m.rate_parameter.size(); ++j) {
      const auto row = static_cast<Eigen::Index>(j);
      const double rate = m.rate_per_s[row];
      const double then =
          decay[row] > 0.0 ? decay[row] * (met.by_rate[row] - later * met.h[row]) : 0.0;
      by[m.rate_parameter[j]] -= k[row] * rate * rate * (now_.by_rate[row] - then);
    }
    by[law_.place.contact] += m.constant * (now_.u > 0.0 ? 0.0 : 1.0) +
                              (k * (now_.by_contact - decay * met.by_contact)).sum();
    return by;
  }

  /// The depth in `part` at which the pull is 0, or the end that is nearest to it. Newton, whose
  /// slope -G(t - t1) is known, within a bracket.
  [[nodiscard]] double passed(const Growth& part) const {
    double low = part.from;
    double high = part.to;
    if (pull(part, low) <= 0.0) return low;
    if (pull(part, high) >= 0.0) return high;
    constexpr double kClose = 1e-14;  // of the largest depth
    double u = 0.5 * (low + high);
    for (int i = 0; i < 100; ++i) {
      const double p = pull(part, u);
      (p > 0.0 ? low : high) = u;
      const double g = law_.relaxation.constant +
                       (law_.relaxation.stiffness.array() * kept(part, at(part, u))).sum();
      double next = u + p / g;
      if (!(next > low && next < high)) next = 0.5 * (low + high);
      const bool close = std::abs(next - u) <= kClose * largest_;
      u = next;
      if (close) break;
    }
    return u;
  }

  const LawAtParameters& law_;
  bool want_slopes_;
  StraightHistory now_;
  std::vector<Growth> growth_;
  double largest_ = 0.0;  ///< depth so far
  std::size_t place_ = 0;
  double least_ = 0.0;   ///< depth met at the edge when the contact was smallest
  double margin_ = 0.0;  ///< of depth, by which it may seem to have grown again
  bool unknown_ = false;
};

}  // namespace

std::optional<Turn> find_turn(const Protocol& protocol, double contact) {
  const auto knots = protocol.knots();
  const auto depth = [&](const Knot& k) { return std::max(k.value - contact, 0.0); };
  double deepest = 0.0;
  for (const Knot& k : knots) deepest = std::max(deepest, depth(k));
  const double jitter = kContactJitter * deepest;
  Turn turn;
  for (std::size_t i = 0; i < knots.size(); ++i) {
    if (depth(knots[i]) >= depth(knots[turn.knot])) turn.knot = i;
    if (depth(knots[i]) >= depth(knots[turn.knot]) - jitter) continue;
    turn.peak_s = knots[turn.knot].time_s;
    turn.noticed_s = knots[i - 1].time_s;
    return turn;
  }
  return std::nullopt;
}

std::vector<ContactEdge> contact_edges(const LawAtParameters& law, const Protocol& protocol,
                                       const Turn& turn, std::span<const double> times_s,
                                       Want want) {
  const auto knots = protocol.knots();
  EdgeFinder finder(law, want == Want::values_and_sensitivity);
  finder.begin(knots.front(), protocol.equilibrium_at_start());
  for (std::size_t i = 1; i <= turn.knot; ++i) finder.move_to(knots[i]);
  finder.end_growth();
  std::vector<ContactEdge> edges;
  edges.reserve(times_s.size());
  for (std::size_t i = turn.knot; edges.size() < times_s.size(); ++i) {
    const bool last = i + 1 == knots.size();
    while (edges.size() < times_s.size() && (last || times_s[edges.size()] < knots[i + 1].time_s)) {
      const double time = times_s[edges.size()];
      const double h = last ? 0.0 : knots[i + 1].time_s - knots[i].time_s;
      const double share = h > 0.0 ? (time - knots[i].time_s) / h : 0.0;
      const double drive =
          last ? knots[i].value : knots[i].value + share * (knots[i + 1].value - knots[i].value);
      StraightHistory at_knot = finder.now();
      finder.move_to({time, drive});
      edges.push_back(finder.edge());
      finder.return_to(std::move(at_knot));
    }
    if (last) break;
    finder.move_to(knots[i + 1]);
    // The contact may grow again where nobody asks.
    if (edges.size() < times_s.size()) static_cast<void>(finder.edge());
  }
  return edges;
}

}  // namespace tpm::law
