#pragma once
// Boundary conditions of a network: driven spheres with their histories, and constant loads.
#include <span>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/bonds/constraints.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::organ {

/// A sphere or tool that the protocol drives, and where to.
struct Probe {
  std::size_t sphere = 0;                                ///< column of positions
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit vector into the tissue
  double share = 1.0;                                    ///< of what is imposed; see Probes
};

/// Probes that one history drives beside the first group; shares as in Probes.
struct DriveGroup {
  std::vector<Probe> probes;
  Protocol protocol;
};

/// Actions on a network besides the probes of its first group.
struct Loading {
  /// Groups with histories of their own, depths or loads. They begin when the first group's
  /// begins; beyond their ends their last values remain.
  std::vector<DriveGroup> beside = {};
  /// Forces that keep size and direction, N, one column per sphere and tool; none if empty. The
  /// network then starts in equilibrium with them, everything relaxed: its positions at rest are
  /// those of that equilibrium, from which depths count.
  Eigen::Matrix3Xd dead_N = {};
  Positions unloaded = {};  ///< positions without them; empty as `dead_N` is
};

/// Spheres and tools that a protocol drives, one or several at a time. An imposed depth D moves
/// each by share D, and the response is the sum of share times contact force. A load F pushes each
/// with share F / (sum of shares), and the response is the mean depth, weighted by the shares.
/// Either way what is imposed and the response are conjugate: their product is the work.
class Probes {
 public:
  // NOLINTNEXTLINE(google-explicit-constructor): one is the usual case
  Probes(Probe probe) : all_{std::move(probe)} {}
  /// Throws Error(bad_input) if there is none.
  explicit Probes(std::vector<Probe> all, Loading loading = {});

  [[nodiscard]] auto begin() const { return all_.begin(); }
  [[nodiscard]] auto end() const { return all_.end(); }
  [[nodiscard]] const Probe& front() const { return all_.front(); }
  [[nodiscard]] std::size_t size() const { return all_.size(); }
  [[nodiscard]] const Loading& loading() const { return loading_; }

 private:
  std::vector<Probe> all_;
  Loading loading_;
};

/// Throws Error(bad_input) unless the probe's sphere exists and is free to move along its
/// direction, and its share is above 0.
void require_valid(const Probe& probe, const Constraints& constraints);
/// The same for each of all groups, and none may be driven twice.
void require_valid(const Probes& probes, const Constraints& constraints);

/// Histories that all groups of probes impose, as functions of one coordinate that never falls.
/// With one group the coordinate is the imposed value itself. With several the corners of all
/// histories are merged and the coordinate is their number, from 0: it rises by 1 over a piece, in
/// which every imposed value is linear, and over an instant at which some jump.
class ImposedPath {
 public:
  /// Of one group.
  explicit ImposedPath(Drive drive) : drives_{drive} {}
  /// Up to the end of the first history. Throws Error(bad_input) for histories beside it that
  /// begin at another time or, beside others, in equilibrium.
  ImposedPath(const Protocol& first, std::span<const DriveGroup> beside);

  [[nodiscard]] std::size_t groups() const { return drives_.size(); }
  [[nodiscard]] bool single() const { return groups() == 1; }
  [[nodiscard]] Drive drive(std::size_t group) const { return drives_[group]; }
  [[nodiscard]] bool by_depth(std::size_t group) const {
    return drives_[group] == Drive::displacement;
  }
  /// The corners with their coordinates as values. Of a path that was made of a protocol.
  [[nodiscard]] std::span<const Knot> knots() const { return knots_; }
  /// Value that a group imposes, m or N.
  [[nodiscard]] double value(std::size_t group, double at) const {
    return single() ? at : interpolated(group, at);
  }
  /// Its change with the coordinate in the piece that holds a place.
  [[nodiscard]] double slope(std::size_t group, double at) const {
    return single() ? 1.0 : slope_of_piece(group, at);
  }
  /// The largest absolute value of a group of several.
  [[nodiscard]] double peak(std::size_t group) const;
  /// The coordinate at a time, all jumps at it over.
  [[nodiscard]] double coordinate_at(double time_s) const;

 private:
  [[nodiscard]] std::size_t piece(double at) const;
  [[nodiscard]] double interpolated(std::size_t group, double at) const;
  [[nodiscard]] double slope_of_piece(std::size_t group, double at) const;

  std::vector<Drive> drives_;
  std::vector<Knot> knots_;
  std::vector<std::vector<double>> values_;  ///< of each group at each corner, where several are
};

}  // namespace tpm::organ
