#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

#include "tpm/fit/validate/law_along.hpp"
#include "tpm/fit/validate/reading_scatter.hpp"

namespace tpm::fit {

/// Rule that finds contact and zero of a recording before it is compared.
enum class PlacementRule {
  held,    ///< the depth's own zero where contact begins there, else the onset; zero from before
  onset,   ///< always the onset
  fitted,  ///< both by least squares of the whole prediction: what is judged has then been fitted
};
/// "held", "onset", "fitted".
[[nodiscard]] std::string_view placement_rule_name(PlacementRule rule) noexcept;
[[nodiscard]] PlacementRule parse_placement_rule(std::string_view text, std::string_view where);

/// Knowledge of contact and zero beforehand.
enum class KnownPlacement {
  nothing,    ///< both are found in the recording
  threshold,  ///< contact was defined by a response (--contact-force)
  no_load,    ///< creep: the load is 0 where nothing presses
  surface,    ///< a session: depths count from its surface, where the rendered force is 0
};

/// The zero moves along a straight line.
struct ZeroDrift {
  double per_s = 0.0, u_per_s = 0.0;  ///< SI
  double origin_s = 0.0;              ///< where it is uncorrelated with the zero
  /// Of a sum of readings.
  [[nodiscard]] double u(const Eigen::VectorXd& weight, const std::vector<double>& time_s) const;
};

/// The drift that the readings before contact tell (read_rests), where it is more than four of its
/// standard uncertainties; takes it out of the readings. Less than that stays in them.
[[nodiscard]] std::optional<ZeroDrift> take_out_drift(PreparedRecording& recording);

/// Contact and zero of one recording, and how they follow readings and law to first order.
struct ValidationPlacement {
  double contact = 0.0;  ///< drive, SI
  double zero = 0.0;     ///< response before contact, SI; 0 where nothing tells it
  Eigen::VectorXd contact_by_reading, zero_by_reading;  ///< one a sample
  Eigen::RowVectorXd contact_by_law, zero_by_law;       ///< one a coordinate of the law
  std::size_t zero_readings = 0;  ///< before contact; 0: the recording does not tell the zero
  bool zero_known = false;        ///< it is 0 by definition
  bool rest_in_contact = false;   ///< contact lies above the rest, which then tells no zero
  double contact_u = 0.0, zero_u = 0.0;  ///< standard uncertainties, SI
  /// The part of contact_u that no reading gives: contact by a threshold is the sample that passes
  /// it, up to one step of the drive too late, so rectangular about it.
  double contact_u_sampled = 0.0;
  std::optional<double> onset, onset_u;  ///< where the onset was found, whatever is used
  std::string contact_words;             ///< what it rests on
  std::optional<ZeroDrift> drift;        ///< that was taken out of the readings
  /// Of a fitted placement: how far it lies from the held one, in standard uncertainties of both.
  std::optional<double> contact_moved, zero_moved;
};

/// Held placement. The zero is the mean before contact, with the weights of a plain mean. Contact
/// is where the law's own first loading, its size free, meets that zero:
///
///     reading = zero + A S(t; contact)   on the ramp up to three quarters of its travel,
///
/// so that the stiffness that is judged does not move it. Where the drive starts at 0 with the
/// ramp, and the onset agrees with that within two of its standard uncertainties, contact is at 0
/// as the recording says.
[[nodiscard]] ValidationPlacement place_for_validation(const LawAlong& law,
                                                       const PreparedRecording& recording,
                                                       const RecordingParts& parts,
                                                       const ReadingScatter& scatter,
                                                       PlacementRule rule, KnownPlacement known);

}  // namespace tpm::fit
