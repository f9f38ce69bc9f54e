#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/haptics/session/recording.hpp"

namespace tpm::haptics {

struct VerifyOptions {
  double motion_tolerance_m = 5e-6;  ///< of the decimated motion, > 0; not of a ball in space
  double spacing_s = 0.01;           ///< of the instants compared, >= the period
  double tolerance = 1e-9;           ///< of the reference run, see QuasiStaticOptions
  /// Of the cross-check, from the start; of a tool that moves in space from the first touch; 0:
  /// none.
  double window_s = 10.0;
  double window_tolerance = 1e-9;  ///< of its integrator, relative
};

/// Distance of the forces commanded from the reference over some stretch.
struct ForceFidelity {
  std::size_t instants = 0;
  double rms_N = 0.0, max_N = 0.0, peak_N = 0.0;
};

struct PhaseFidelity {
  SessionPhase phase;
  double start_s = 0.0;
  ForceFidelity force;
  double depth_rms_m = 0.0;  ///< of the tool from the depth asked for; says how well it was guided
};

/// A cross-check on the same motion.
struct CrossCheck {
  std::string name;
  double start_s = 0.0, end_s = 0.0;
  ForceFidelity commanded;  ///< against this cross-check
  double apart_N = 0.0;     ///< between this cross-check and the reference, at most
  bool measured = false;    ///< by an instrument, not computed
};

/// A reading of the experiment beside the session's.
struct BesideExperiment {
  double depth_m = 0.0, rate_m_per_s = 0.0;
  std::string label;  ///< "peak", "end"
  double measured_N = 0.0, commanded_N = 0.0;
  /// Of the reference at the same place of the session; none where it has no equilibrium.
  std::optional<double> reference_N;
  double reached_m = 0.0;   ///< largest depth of the surface in the phases that repeat the reading
  std::uint32_t flags = 0;  ///< of all their cycles (ServoFlag)
};

/// Why a session differs from a reading: a depth that was not reached, a limit that acted, the
/// model in the loop, or the scene's tissue, which the full network shows under the same motion.
[[nodiscard]] std::string cause_of_difference(const BesideExperiment& e,
                                              const std::string& material);

struct Verification {
  std::string reference;
  double end_s = 0.0;
  bool whole = true;  ///< false: the recording is cut off; verified up to there
  ForceFidelity all;
  std::vector<PhaseFidelity> phases;
  std::vector<CrossCheck> others;
  std::vector<BesideExperiment> experiment;
  std::string material;   ///< of the session's scene, as it stands there; for words
  std::size_t knots = 0;  ///< of the motion that the reference was moved through
  /// Largest distance of the recorded motion from the lines between the knots.
  double motion_tolerance_m = 0.0;
  /// Cost of that: times the instantaneous stiffness. None where every instant compared is a
  /// knot: what lies between is then part of the reference's error.
  std::optional<double> motion_error_N;
  double reference_error_N = 0.0;  ///< as the reference run estimates
  double model_error_N = 0.0;      ///< largest estimate of the model itself, in any period
  /// Instants at which the reference finds no equilibrium: left out of everything, and counted.
  std::size_t without_equilibrium = 0;
  std::vector<Remark> remarks;  ///< what could not be compared
  /// At the instants compared; forces against the push.
  std::vector<double> time_s, reference_N, commanded_N, depth_m;
  /// Commanded less reference; of a tool that moves in space the length of the difference, all
  /// three components.
  std::vector<double> error_N;
};

/// A motion through few of its samples, each other within the tolerance of the straight line
/// between its neighbours kept. Returns the indices kept, first and last among them.
[[nodiscard]] std::vector<std::size_t> decimated(const std::vector<double>& time,
                                                 const std::vector<double>& value,
                                                 double tolerance);

/// Feeds the recorded motion of the surface to the full nonlinear quasi-static network of the
/// session's scene and compares its force with the forces commanded. Beside it, over a window,
/// CVODE integrates the viscous elongations, forces balanced at each of its evaluations: the same
/// equations by another integrator, with error control of its own. Like the reference it has no
/// masses. The star's other models are asked as well.
///
/// A tool that moves in space is compared with the full network under the same ball
/// (BallOnNetwork), in all three components, its motion taken as linear between the instants
/// compared; the reference's error is estimated with every second of them. CVODE is asked there as
/// well (ball_forces_by_cvode).
///
/// One contact that answers by a law is compared with the law itself, asked along every sample of
/// the motion (LawModel), and with another quadrature of it (law_forces_by_gauss).
///
/// A session that never touched the tissue is verified, and a remark says that nothing was
/// compared.
///
/// Where the reference has no equilibrium the instant is left out, and it goes on with the next one
/// that it has one for, on a straight line. Throws Error(bad_input) for an empty recording, or
/// fewer than four instants to compare in space, Error(numerical) if less than half of the instants
/// can be compared.
[[nodiscard]] Verification verify(const HilRecording& recording, const VerifyOptions& options = {});

/// Remarks on a recording and on its verification.
[[nodiscard]] std::vector<Remark> all_remarks(const HilRecording& recording,
                                              const Verification& verification);

}  // namespace tpm::haptics
