#include "tpm/haptics/verify/session_presses.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/text.hpp"
#include "tpm/data/phases.hpp"
#include "tpm/haptics/verify/verify_parts.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

constexpr std::size_t kEnoughRows = 2000;

/// Phases [first, last] that make one press.
struct PressPhases {
  std::size_t first, last;
};

std::vector<PressPhases> press_phases(const std::vector<SessionPhase>& phases) {
  std::vector<PressPhases> presses;
  for (std::size_t i = 0; i < phases.size(); ++i) {
    if (phases[i].kind == SessionPhaseKind::motion) presses.push_back({i, i});
    if (phases[i].kind != SessionPhaseKind::indent) continue;
    const bool held = i + 1 < phases.size() && phases[i + 1].kind == SessionPhaseKind::hold;
    presses.push_back({i, held ? i + 1 : i});
  }
  return presses;
}

double depth_of(const ServoRecord& row) {
  // In the air a tissue answers nothing.
  return std::max(row.tool_depth_m, 0.0);
}

/// A motion of the hand, which no other program has touched: nothing in it is censored or turned.
fit::PreparedRecording press_recording(Recording r) {
  fit::PreparedRecording press;
  press.name = r.header.id;
  press.phases = find_phases(r);
  press.from_s = r.time_s.front();
  press.to_s = r.time_s.back();
  press.recording = std::move(r);
  return press;
}

/// Takes a session apart.
class PressReader {
 public:
  PressReader(const HilRecording& recording, const std::string& sha256)
      : recording_(recording),
        session_(recording.session),
        sha256_(sha256),
        rows_(moved_rows(recording)) {}

  SessionPresses read() {
    for (const PressPhases& of : press_phases(session_.phases)) add(of);
    return std::move(presses_);
  }

 private:
  [[nodiscard]] double begin_s(std::size_t phase) const {
    return phase == 0 ? 0.0 : session_.phases[phase - 1].end_s;
  }

  void add(const PressPhases& of) {
    const auto in_press = [&](const ServoRecord* row) {
      return row->phase >= static_cast<std::int32_t>(of.first) &&
             row->phase <= static_cast<std::int32_t>(of.last);
    };
    const auto begin = std::find_if(rows_.begin(), rows_.end(), in_press);
    const auto end = std::find_if_not(begin, rows_.end(), in_press);
    const auto count = static_cast<std::size_t>(end - begin);
    SessionPress press;
    press.motion.session = recording_.name;
    press.motion.press = session_.phases[of.first].name;
    const std::string name = fmt::format("{}: {}", press.motion.session, press.motion.press);
    constexpr double kWhole = 0.98;  // of its time
    const double asked_s = session_.phases[of.last].end_s - begin_s(of.first);
    const double made_s = static_cast<double>(count) * session_.servo.period_s;
    if (made_s < kWhole * asked_s) {
      presses_.left_out.push_back(
          {"press_left_out", fmt::format("{} is not compared: {} s of its {} s were recorded", name,
                                         significant(made_s, 3), significant(asked_s, 3))});
      return;
    }
    const std::size_t stride = std::max<std::size_t>(count / kEnoughRows, 1);
    Recording r;
    r.header.id = name;
    r.header.sha256 = sha256_;
    for (auto row = begin; row < end; row += static_cast<std::ptrdiff_t>(stride)) {
      r.time_s.push_back(recording_.time_s(**row));
      r.drive.push_back(depth_of(**row));
      r.response.push_back(recording_.commanded_N(**row));
      if (static_cast<std::size_t>(end - row) <= stride) break;
    }
    const auto add_knot = [&](const ServoRecord& row) {
      press.motion.knots.push_back({recording_.time_s(row), depth_of(row)});
    };
    for (auto row = rows_.begin(); row < begin; row += static_cast<std::ptrdiff_t>(stride)) {
      add_knot(**row);
      if (static_cast<std::size_t>(begin - row) <= stride) break;
    }
    // Of the press every row: what the hand did between samples is in the force of the next.
    for (auto row = begin; row < end; ++row) add_knot(**row);
    if (of.last > of.first) press.motion.hold_asked_s = begin_s(of.last);
    press.recording = press_recording(std::move(r));
    presses_.made.push_back(std::move(press));
  }

  const HilRecording& recording_;
  const HilSession& session_;
  const std::string& sha256_;
  RowList rows_;
  SessionPresses presses_;
};

}  // namespace

SessionPresses session_presses(const HilRecording& recording, const std::string& sha256) {
  if (recording.session.model == "surface") {
    throw bad_input(recording.name, "is a session of a tool that moved in space",
                    "one whose tool moved along its push");
  }
  SessionPresses presses = PressReader(recording, sha256).read();
  if (presses.made.empty()) {
    throw bad_input(recording.name, "holds no press that was made to its end",
                    "a session with indentations");
  }
  return presses;
}

}  // namespace tpm::haptics
