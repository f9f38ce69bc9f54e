#include "tpm/haptics/session/session_phases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::haptics {
namespace {

constexpr double kClearance_m = 0.002;  // in the air, before and after each touch
constexpr double kApproach_s = 1.0;
constexpr double kLoading_s = 1.0;
constexpr double kLongest_s = 12.0 * 3600.0;

/// Puts phases behind each other.
class PhaseList {
 public:
  void add(SessionPhaseKind kind, std::string name, double length_s, double from, double to) {
    slide(kind, std::move(name), length_s, from, to, 0.0, 0.0);
  }
  void slide(SessionPhaseKind kind, std::string name, double length_s, double from, double to,
             double across_from_m, double across_to_m) {
    time_s_ += length_s;
    phases_.push_back({kind, std::move(name), time_s_, from, to, depth_m, rate_m_per_s,
                       across_from_m, across_to_m});
  }
  /// The last phase goes through these depths, evenly spaced in time.
  void follow(std::vector<double> depths_m) { phases_.back().surface_m = std::move(depths_m); }
  double depth_m = 0.0, rate_m_per_s = 0.0;
  [[nodiscard]] std::vector<SessionPhase> take() { return std::move(phases_); }
  [[nodiscard]] double time_s() const { return time_s_; }

 private:
  std::vector<SessionPhase> phases_;
  double time_s_ = 0.0;
};

void add_approach(PhaseList& list) {
  list.add(SessionPhaseKind::approach, "approach", kApproach_s, -kClearance_m, 0.0);
}

/// Back into the air at the rate of the phases, and a rest there.
void add_release(PhaseList& list, std::string name, double depth_m, double rest_s) {
  list.add(SessionPhaseKind::release, std::move(name), (depth_m + kClearance_m) / list.rate_m_per_s,
           depth_m, -kClearance_m);
  list.add(SessionPhaseKind::rest, "rest", rest_s, -kClearance_m, -kClearance_m);
}

void add_indentations(PhaseList& list, const TouchKeys& block, const DocumentPlace& place) {
  for (const ProtocolBlock& one : combinations(ProtocolKind::ramp_hold, block.protocol, place)) {
    const double depth = *one.depth_m, rate = *one.rate_m_per_s;
    const std::string mm = significant(1e3 * depth, 4), speed = significant(1e3 * rate, 4);
    list.depth_m = depth;
    list.rate_m_per_s = rate;
    add_approach(list);
    list.add(SessionPhaseKind::indent, fmt::format("indent to {} mm at {} mm/s", mm, speed),
             depth / rate, 0.0, depth);
    list.add(SessionPhaseKind::hold, fmt::format("hold {} mm after {} mm/s", mm, speed),
             *one.hold_s, depth, depth);
    add_release(list, fmt::format("release from {} mm at {} mm/s", mm, speed), depth, block.rest_s);
  }
  list.depth_m = list.rate_m_per_s = 0.0;
}

void add_slides(PhaseList& list, const SlideKeys& block) {
  const double distance = block.distance_m, rate = block.rate_m_per_s;
  const double press = block.press_m_per_s;
  const std::string far = significant(1e3 * distance, 4), speed = significant(1e3 * rate, 4);
  for (const double depth : block.depths_m) {
    const std::string mm = significant(1e3 * depth, 4), pressed = significant(1e3 * press, 4);
    list.depth_m = depth;
    list.rate_m_per_s = press;
    add_approach(list);
    list.add(SessionPhaseKind::indent, fmt::format("press to {} mm at {} mm/s", mm, pressed),
             depth / press, 0.0, depth);
    list.rate_m_per_s = rate;
    list.slide(SessionPhaseKind::slide,
               fmt::format("slide {} mm at {} mm/s, {} mm deep", far, speed, mm), distance / rate,
               depth, depth, 0.0, distance);
    list.slide(SessionPhaseKind::slide,
               fmt::format("slide back {} mm at {} mm/s, {} mm deep", far, speed, mm),
               distance / rate, depth, depth, distance, 0.0);
    list.rate_m_per_s = press;
    add_release(list, fmt::format("release from {} mm at {} mm/s", mm, pressed), depth,
                block.rest_s);
  }
  list.depth_m = list.rate_m_per_s = 0.0;
}

void add_creep(PhaseList& list, const TouchKeys& block, const DocumentPlace& place) {
  for (const ProtocolBlock& one : combinations(ProtocolKind::creep, block.protocol, place)) {
    const double load = *one.load_N;
    const std::string newton = significant(load, 4);
    add_approach(list);
    list.add(SessionPhaseKind::load, fmt::format("load to {} N", newton), kLoading_s, 0.0, load);
    list.add(SessionPhaseKind::creep, fmt::format("creep under {} N", newton), *one.duration_s,
             load, load);
    list.add(SessionPhaseKind::rest, "rest", block.rest_s, -kClearance_m, -kClearance_m);
  }
}

/// The block with the motion itself.
void add_motion(PhaseList& list, const MotionKeys& block, const DocumentPlace& place) {
  const std::vector<double>& depths = block.depths_m;
  if (depths.empty()) {
    throw bad_input(place.where, "no key 'depths_m'", "a motion, or a recording of one");
  }
  const double length_s = block.spacing_s.value() * static_cast<double>(depths.size() - 1);
  constexpr double kUsualRate_m_per_s = 1e-3;
  const double first = depths.front();
  list.add(SessionPhaseKind::approach, "approach", kApproach_s, -kClearance_m,
           std::min(first, 0.0));
  list.depth_m = std::max(0.0, *std::max_element(depths.begin(), depths.end()));
  list.rate_m_per_s = kUsualRate_m_per_s;
  if (first > 0.0) {  // the recording begins in contact, and the fit took that as equilibrium
    const std::string mm = significant(1e3 * first, 4);
    list.add(SessionPhaseKind::indent, fmt::format("indent to {} mm, where the motion begins", mm),
             first / kUsualRate_m_per_s, 0.0, first);
    list.add(SessionPhaseKind::hold, fmt::format("hold {} mm until equilibrium", mm),
             block.initial_hold_s, first, first);
  }
  list.add(SessionPhaseKind::motion, block.name.value(), length_s, 0.0, 0.0);
  list.follow(depths);
  list.depth_m = list.rate_m_per_s = 0.0;
}

/// The longest relaxation time among the parameters of a law, s; 0 if it has none.
double longest_time_s(const LawFile& law) {
  const std::vector<LawParameter> parameters = law_parameters(law.spec);
  double longest = 0.0;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (parameters[i].dimension == Dimension::time) longest = std::max(longest, law.values[i]);
  }
  return longest;
}

}  // namespace

Json embedded_motion(const std::filesystem::path& file, const LawFile& law, double period_s,
                     const DocumentPlace& place) {
  constexpr double kMostSamples = 20000.0, kRelaxed = 10.0, kLongestWait_s = 600.0;
  const LawModel model(law.spec);
  const double contact_m = law.values[model.index("contact")];
  const double offset_N = law.values[model.index("offset")];
  const Recording recording = read_recording_file(file, {}).recording;
  if (recording.drive_quantity != Quantity::indentation_depth) {
    throw bad_input(place.where,
                    fmt::format("a recording of a {}", quantity_name(recording.drive_quantity)),
                    "one of an indentation depth");
  }
  const Protocol path = measured_history(Drive::displacement, recording.time_s, recording.drive);
  const double length_s = path.end_s() - path.start_s();
  const auto parts = static_cast<std::size_t>(
      std::max(1.0, std::ceil(std::min(length_s / period_s, kMostSamples))));
  const double spacing_s = length_s / static_cast<double>(parts);
  const Protocol forces = measured_history(Drive::force, recording.time_s, recording.response);
  Json depths = Json::array(), measured = Json::array();
  for (std::size_t i = 0; i <= parts; ++i) {
    const double time_s = path.start_s() + static_cast<double>(i) * spacing_s;
    depths.push_back(value_at(path, time_s) - contact_m);
    measured.push_back(value_at(forces, time_s) - offset_N);
  }
  return {{"name", file.filename().string()},
          {"initial_hold_s", std::min(kRelaxed * longest_time_s(law), kLongestWait_s)},
          {"spacing_s", spacing_s},
          {"depths_m", std::move(depths)},
          {"measured_N", std::move(measured)}};
}

std::vector<SessionPhase> phases_of(const SessionKeys& session, const DocumentPlace& place) {
  PhaseList list;
  if (session.indentations) {
    add_indentations(list, *session.indentations, place.key("indentations"));
  }
  if (session.slides) add_slides(list, *session.slides);
  if (session.creep) add_creep(list, *session.creep, place.key("creep"));
  if (session.motion) add_motion(list, *session.motion, place.key("motion"));
  if (list.time_s() > kLongest_s) {
    throw bad_input(place.where + ": keys /indentations, /slides and /creep",
                    fmt::format("the session takes {} s", significant(list.time_s(), 4)),
                    "12 hours at most");
  }
  return list.take();
}

}  // namespace tpm::haptics
