#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/document_place.hpp"
#include "tpm/files/json.hpp"
#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/device/virtual_plant.hpp"
#include "tpm/haptics/loop/servo_step.hpp"
#include "tpmkit/contact_model.hpp"
#include "tpmkit/device.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::haptics {

/// A stretch of a session.
enum class SessionPhaseKind {
  approach,
  indent,
  hold,
  slide,
  release,
  rest,
  load,
  creep,
  motion  ///< that of a recording, repeated
};

[[nodiscard]] std::string_view to_string(SessionPhaseKind kind);

/// Instruction to the operator, and its duration.
struct SessionPhase {
  SessionPhaseKind kind = SessionPhaseKind::approach;
  std::string name;             ///< "indent to 4 mm at 2 mm/s"
  double end_s = 0.0;           ///< begins where the one before ends
  double from = 0.0, to = 0.0;  ///< depth, m; of `load` and `creep` the push, N
  double depth_m = 0.0;         ///< of the indentation it belongs to; 0 if none
  double rate_m_per_s = 0.0;
  double across_from_m = 0.0, across_to_m = 0.0;  ///< along HilSession::slide
  /// Depth of the organ's surface at even parts of the phase, both ends included, m: what `from`
  /// and `to` are counted from there. Empty: 0 throughout.
  std::vector<double> surface_m = {};
};

/// The word of a session whose model a plan picks; all others name a formulation.
inline constexpr std::string_view kPlannedModel = "planned";

/// A session as its file says.
struct HilSession {
  std::string title;
  /// Model that the loop steps: a formulation for_sessions(), or kPlannedModel.
  std::string model = std::string(kPlannedModel);
  double tool_radius_m = 0.010;                      ///< of the model `surface`, of its ball
  double contact_stiffness_N_per_m = 1e4;            ///< the same, of ball and sphere
  Eigen::Vector3d slide = Eigen::Vector3d::UnitX();  ///< unit vector, square to the push, device
  std::string tolerance = "1%";  ///< of a planned model, as set_tolerance() takes it
  Json scene;                    ///< of the tissue; needs no file. Null with a law
  DocumentPlace scene_place;     ///< for messages
  Json contact;  ///< which spheres the tool moves, as in a scene; null: the usual one
  DocumentPlace contact_place;
  std::optional<LawFile> law;  ///< of the model `law`
  std::vector<SessionPhase> phases;
  /// Forces of the recording whose motion the last phase is, evenly spaced over it; may be empty.
  std::vector<double> measured_N;
  SessionServo servo;
  DevicePreparation preparation;
  PlantSettings plant;
  /// Friction of the device by the file itself; its delay is in `plant`, 0 if not said.
  std::optional<double> stated_friction_N_s_per_m;
  double cycle_timeout_s = 0.008;
  std::string text;  ///< of the file, for the record

  [[nodiscard]] OperatorScript operator_script() const;
  [[nodiscard]] double duration_s() const { return phases.back().end_s; }
};

/// The deepest place that the phases ask for, m; under a load the depth that is taken for it.
[[nodiscard]] double deepest_asked_m(const HilSession& session, double under_loads_m);

/// Reads a session (schemas/hil.schema.json). Throws Error(bad_input) with the key.
/// @param folder that paths in the session are relative to
/// @param device into whose workspace it has to fit; the simulated one has that of the Omega.7
[[nodiscard]] HilSession parse_session(const Json& json, std::string_view where,
                                       const std::filesystem::path& folder,
                                       const DeviceLimits& device = limits_of("omega7"));
/// The session with a start gate that keeps the hand where the session fits into the workspace of
/// this device.
[[nodiscard]] HilSession on_device(HilSession session, const DeviceLimits& limits);
/// Throws Error(answer_is_no) if the session asks for more than a device can take.
void require_within(const HilSession& session, const DeviceLimits& limits);

/// Replacements that a run makes in its session.
struct SessionChanges {
  std::filesystem::path law;     ///< the model is this law, whatever the file says
  std::filesystem::path motion;  ///< the phases are the motion of this recording of a depth
};
/// The same of a file, slides following the surface (follow_surface).
/// Throws Error(bad_input) for a motion without a law: the depth that it counts from is the law's.
[[nodiscard]] HilSession read_session(const std::filesystem::path& file,
                                      const SessionChanges& changes = {},
                                      const DeviceLimits& device = limits_of("omega7"));

/// The tissue of a session as it is drawn, in the coordinates of its scene.
struct TissueShape {
  Eigen::Matrix3Xd rest_m;                          ///< centres of the spheres at rest
  double radius_m = 0.0;                            ///< of each
  std::size_t contact = 0;                          ///< the sphere that the tool meets
  Eigen::Vector3d push = Eigen::Vector3d::UnitZ();  ///< into the tissue, unit vector
  std::vector<std::pair<std::uint32_t, std::uint32_t>> bonds;
  /// Knows where all spheres are; steps of kDrawnEvery_s. Null: the contact sphere moves alone.
  std::shared_ptr<ContactModel> field;
  /// Of a tool that moves in space; none: it moves along the push. `field` is then a tissue under
  /// that tool.
  std::optional<Eigen::Matrix3d> to_model;
  double tool_radius_m = 0.0;
  Eigen::Vector3d tool_start_m = Eigen::Vector3d::Zero();
};

/// Between two pictures of a session.
inline constexpr double kDrawnEvery_s = 0.04;

/// The model of a session, with what is known of it.
struct LoopModel {
  std::unique_ptr<ContactModel> model;
  Eigen::Vector3d push = Eigen::Vector3d::UnitZ();  ///< into the tissue, in its coordinates
  std::optional<Eigen::Matrix3d> to_model;          ///< as ServoSettings::to_model
  std::string name;                                 ///< for people
  std::string error_bound;         ///< what is known of its distance from the reference, in words
  Json plan;                       ///< null, or what a plan was asked for, considered and picked
  double stiffness_N_per_m = 0.0;  ///< instantaneous, along the push; of a law at its deepest
  std::vector<double> relaxation_times_s;  ///< rising; empty: nothing relaxes
  TissueShape shape;
};

/// Told what is being done while a model is planned, kPlanningSteps times.
using PlanningTold = std::function<void(const std::string& what)>;
inline constexpr std::size_t kPlanningSteps = 5;

/// Throws Error(bad_input) if the scene is not one that the model can stand for; of a planned model
/// Error(answer_is_no) if none is accurate and fast enough, Error(numerical) as make_plan().
[[nodiscard]] LoopModel make_loop_model(const HilSession& session, const PlanningTold& told = {});

}  // namespace tpm::haptics
