#pragma once
#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "tpm/law/contact_history.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::law {

/// A depth that falls, or a contact that grows again, by less than this part of the largest depth
/// is taken for the jitter of a measured drive. The force is off by a term of second order in it.
inline constexpr double kContactJitter = 0.01;

/// Notices when a contact under a load has begun to shrink.
class ShrinkWatch {
 public:
  explicit ShrinkWatch(bool active) : active_(active) {}
  void see(double depth) {
    deepest_ = std::max(deepest_, depth);
    shrunk_ = shrunk_ || (active_ && depth < (1.0 - kContactJitter) * deepest_);
  }
  [[nodiscard]] bool shrunk() const { return shrunk_; }

 private:
  bool active_;
  double deepest_ = 0.0;
  bool shrunk_ = false;
};

/// Where an imposed depth turns back for the first time, by more than the jitter.
struct Turn {
  std::size_t knot = 0;    ///< of the largest depth before; the contact grows up to there
  double peak_s = 0.0;     ///< its time
  double noticed_s = 0.0;  ///< time of the last knot that is still within the jitter of it
};

/// @param contact drive at which contact begins
[[nodiscard]] std::optional<Turn> find_turn(const Protocol& protocol, double contact);

/// The edge of a shrinking contact. The surface that leaves the probe at time t was met at t1, and
/// carries no load any more (Ting 1966): the integral from t1 to t of G(t - s) du(s), the `pull`,
/// is 0. The force is the integral from the beginning to t1 of G(t - s) dV(u(s)), plus V'(u(t1))
/// times the pull: to first order it does not depend on t1, which gives exact derivatives without
/// those of t1, and forgives a jitter of the drive.
struct ContactEdge {
  enum class State {
    touching,
    lost,     ///< nothing touches any more: no force
    unknown,  ///< the contact has grown again, which Ting's solution does not cover
  };
  State state = State::touching;
  double met_s = 0.0;      ///< t1
  double met_drive = 0.0;  ///< drive at t1
  bool at_rest = false;    ///< met before the first knot, under which everything has relaxed
  double later_s = 0.0;    ///< t - t1
  double pull = 0.0;       ///< 0 but for jitter, N/m times the drive
  Slopes pull_by;
};

/// The edge at each of `times_s`.
/// @param law not fractional, without tension
/// @param times_s rising, after turn.peak_s
[[nodiscard]] std::vector<ContactEdge> contact_edges(const LawAtParameters& law,
                                                     const Protocol& protocol, const Turn& turn,
                                                     std::span<const double> times_s, Want want);

}  // namespace tpm::law
