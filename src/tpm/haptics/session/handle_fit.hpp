#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "tpm/haptics/session/device_identification.hpp"

namespace tpm::haptics {

// The fit of device_identification.hpp: equations of motion over windows, solved for every delay.

inline constexpr double kVelocityWindow_s = 0.064, kSearchedDelay_s = 0.050;
inline constexpr double kEdge_N = 0.2;     ///< of the force, to both sides
inline constexpr int kHandleUnknowns = 5;  ///< m, b, c, k, f

/// Measured positions and commands of a handle on a grid of periods.
struct HandleTimeline {
  double period_s = 0.0;
  std::vector<double> at_m;             ///< a period each
  std::vector<std::size_t> gap;         ///< periods of the grid before each that are not known
  std::vector<double> sent_s, force_N;  ///< commands, in their order
  int stalls = 0;
  double stalled_s = 0.0;

  [[nodiscard]] std::size_t size() const { return at_m.size(); }
  /// True if the positions of all periods from `from` to `to` (both included) are known.
  [[nodiscard]] bool covers(std::size_t from, std::size_t to) const {
    return gap[to + 1] == gap[from];
  }
};

/// Positions between readings that are close to each other, and when each command was sent.
[[nodiscard]] HandleTimeline timeline_of(const std::vector<IdentificationSample>& samples,
                                         double period_s);

/// The encoder's step: what nearly all small changes of the position are whole multiples of. Large
/// ones are near a multiple of anything.
[[nodiscard]] std::optional<double> step_of(const std::vector<IdentificationSample>& samples);
/// From third differences, in which a smooth motion is lost: the variance of noise is theirs / 20.
[[nodiscard]] double noise_of(const HandleTimeline& line);
[[nodiscard]] double stroke_of(const std::vector<IdentificationSample>& samples);

/// Of a window and of what is left out at both ends, periods.
struct WindowLengths {
  std::size_t half = 0, margin = 0;
};
[[nodiscard]] WindowLengths window_lengths(double period_s);

struct HandleWindows {
  std::size_t tried = 0;
  std::vector<std::size_t> centre;  ///< periods
  Eigen::MatrixXd motion;           ///< a row each, kHandleUnknowns columns
};
/// Windows of 2 half + 1 periods, `apart` periods from each other, in which nothing stalled.
[[nodiscard]] HandleWindows windows_of(const HandleTimeline& line, std::size_t half,
                                       std::size_t margin, std::size_t apart, double least_m);

struct HandleSolution {
  Eigen::VectorXd value;
  Eigen::MatrixXd spread;  ///< covariance
  double rms = std::numeric_limits<double>::infinity();
};
struct DelayFit {
  double delay_s = 0.0;
  HandleSolution solution;
  double explained = 0.0;  ///< share of the forces that follows from the motion
};
/// The delay with the smallest residual: coarse, then fine.
[[nodiscard]] DelayFit fit_delay(const HandleTimeline& line, const HandleWindows& windows,
                                 std::size_t half);
/// Each edge of the force has a delay of its own, s.
[[nodiscard]] std::vector<double> edge_delays(const HandleTimeline& line, const DelayFit& fit,
                                              const WindowLengths& lengths, double least_m);

}  // namespace tpm::haptics
