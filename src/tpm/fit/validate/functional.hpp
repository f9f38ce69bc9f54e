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

/// True if a recording is one of creep: its load was imposed, and what it moved was measured.
[[nodiscard]] bool is_creep(Quantity response) noexcept;

/// "peak force", "force at the end of the hold", "stress at 5 s"; of creep "depth at the corner".
[[nodiscard]] std::string quantity_words(const QuantityOfInterest& quantity, Quantity drive,
                                         Quantity response);

/// Parts of a recording by its drive: all windows of quantities follow from it, so that a
/// simulation and its recording are read by the same samples.
struct RecordingParts {
  std::size_t ramp_first = 0;                        ///< last sample before the drive moves
  std::size_t ramp_last = 0;                         ///< last sample of the first ramp
  std::optional<std::size_t> hold_first, hold_last;  ///< of the first hold after the ramp
  double corner_s = 0.0;      ///< where the lines of ramp and hold meet in the drive
  std::size_t loop_last = 0;  ///< last sample of the first unloading; ramp_last without one

  [[nodiscard]] bool has_hold() const { return hold_first.has_value(); }
};

/// The first ramp and the hold after it. A pause on the way is part of the ramp: it is shorter than
/// a motion beside it, and the drive rises on by a tenth of its range or more. Throws
/// Error(bad_input) naming the recording if its drive never rises.
[[nodiscard]] RecordingParts parts_of(const PreparedRecording& recording);

/// The same of a press by a hand that was asked to hold from a time on. A hand may start early or
/// late, pause, tremble, overshoot and slip: the level is the median of the depth from that time
/// on, the ramp ends where the depth first comes near it, and the hold lasts until the hand leaves
/// it for good.
/// @param hold_asked_s of the recording's clock; the recording ends with the hold
[[nodiscard]] RecordingParts parts_of_press(const PreparedRecording& recording,
                                            double hold_asked_s);

/// Part of a recording that its quantities are read from.
struct ComparedPart {
  double from_s = 0.0, corner_s = 0.0, to_s = 0.0;  ///< of the recording's clock
  double depth = 0.0;                               ///< largest drive within it, SI
  double depth_of_all = 0.0;                        ///< largest drive of the recording, SI
  double hold_s = 0.0;
  std::optional<double> hold_asked_s;  ///< how long a hand was asked to hold
  double loaded_s = 0.0;    ///< how long the drive stays above half of its largest, or was asked to
  double left_out_s = 0.0;  ///< of that, after to_s

  /// Nine tenths of the largest drive, and of the time under load. A hand that comes late makes a
  /// longer ramp.
  [[nodiscard]] bool whole() const;
};

/// @param hold_asked_s see parts_of_press
[[nodiscard]] ComparedPart compared_part(const Recording& recording, const RecordingParts& parts,
                                         std::optional<double> hold_asked_s);

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

/// Sum of weights times values (of each column); samples that the law does not predict, which are
/// not finite, have no weight.
[[nodiscard]] double weighted_sum(const Eigen::VectorXd& weight, const Eigen::VectorXd& values);
[[nodiscard]] Eigen::RowVectorXd weighted_sum(const Eigen::VectorXd& weight,
                                              const Eigen::MatrixXd& values);

/// Derivatives by the samples of a straight line of least squares through them, read at a place.
/// Fewer than two different places give the mean.
/// @param x places of the samples
[[nodiscard]] Eigen::VectorXd line_weights(std::span<const double> x, double at);

}  // namespace tpm::fit
