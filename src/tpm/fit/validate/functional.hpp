#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/fit/select/recording_setup.hpp"
#include "tpmkit/units.hpp"

namespace tpm::fit {

/// A number that a recording and its simulation are compared by.
enum class QuantityKind {
  peak,              ///< response at the corner between ramp and hold
  end_of_hold,       ///< mean response over the last tenth of the hold
  relaxation_ratio,  ///< end of the hold over peak
  half_time,         ///< from the corner until half of the change from there to the end is done, s
  work,              ///< integral of the response over the drive, of a loop
  at_time,           ///< response at a time of the recording's clock
  at_depth,          ///< response on the first ramp at a depth beyond the contact
  rate,              ///< of the response over the last tenth of the hold, per s
};

struct QuantityOfInterest {
  QuantityKind kind = QuantityKind::peak;
  double at = 0.0;  ///< of at_time s, of at_depth SI of the drive

  bool operator==(const QuantityOfInterest&) const = default;
};

/// "peak", "end", "ratio", "half-time", "rate", "work", "5 s" or "2 mm" (of a strip: "1.1"). Throws
/// Error(bad_input) naming these.
[[nodiscard]] QuantityOfInterest parse_quantity_of_interest(std::string_view text, Quantity drive,
                                                            std::string_view where);

/// Whether a recording is one of creep: its load was imposed, and what it moved was measured.
[[nodiscard]] bool is_creep(Quantity response) noexcept;

/// "peak force", "force at the end of the hold", "stress at 5 s"; of creep "depth at the corner".
[[nodiscard]] std::string quantity_words(const QuantityOfInterest& quantity, Quantity drive,
                                         Quantity response);

/// What the drive tells of a recording: all windows of quantities follow from it, so that a
/// simulation and its recording are read by the same samples.
struct RecordingParts {
  std::size_t ramp_first = 0;                        ///< last sample before the drive moves
  std::size_t ramp_last = 0;                         ///< last sample of the first ramp
  std::optional<std::size_t> hold_first, hold_last;  ///< of the first hold after the ramp
  double corner_s = 0.0;      ///< where the lines of ramp and hold meet in the drive
  std::size_t loop_last = 0;  ///< last sample of the first unloading; ramp_last without one

  [[nodiscard]] bool has_hold() const { return hold_first.has_value(); }
};

/// Throws Error(bad_input) naming the recording if its drive never rises.
[[nodiscard]] RecordingParts parts_of(const PreparedRecording& recording);

/// The quantities that a recording of these parts has: peak, end of the hold, relaxation ratio and
/// half time of a ramp and hold, of creep the rate, too; the work where it is unloaded.
[[nodiscard]] std::vector<QuantityOfInterest> default_quantities(const RecordingParts& parts,
                                                                 bool creep = false);

/// A quantity of one curve, and its derivatives by the curve's samples.
struct Functional {
  double value = 0.0;
  Eigen::VectorXd weight;  ///< d value / d sample
};

/// Reads a quantity from a curve sampled as the recording is.
/// @param contact drive at which contact begins, for at_depth
/// @return none where the curve or the recording does not have it: no hold, a time outside, a curve
///         that does not fall to half, or a sample that is not finite
[[nodiscard]] std::optional<Functional> read_quantity(const QuantityOfInterest& quantity,
                                                      const RecordingParts& parts,
                                                      const Recording& recording, double contact,
                                                      const Eigen::VectorXd& curve);

/// Derivatives by the samples of a straight line of least squares through them, read at a place.
/// Fewer than two different places give the mean.
/// @param x places of the samples
[[nodiscard]] Eigen::VectorXd line_weights(std::span<const double> x, double at);

}  // namespace tpm::fit
