#include "tpm/haptics/verify/session_presses.hpp"

#include <fmt/format.h>

#include <algorithm>

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

}  // namespace

std::vector<SessionPress> session_presses(const HilRecording& recording,
                                          const std::string& sha256) {
  const HilSession& session = recording.session;
  if (session.model == "surface") {
    throw bad_input(recording.name, "is a session of a tool that moved in space",
                    "one whose tool moved along its push");
  }
  const RowList rows = moved_rows(recording);
  std::vector<SessionPress> presses;
  for (const PressPhases& of : press_phases(session.phases)) {
    const auto in_press = [&](const ServoRecord* row) {
      return row->phase >= static_cast<std::int32_t>(of.first) &&
             row->phase <= static_cast<std::int32_t>(of.last);
    };
    const auto begin = std::find_if(rows.begin(), rows.end(), in_press);
    const auto end = std::find_if_not(begin, rows.end(), in_press);
    const auto count = static_cast<std::size_t>(end - begin);
    constexpr double kWhole = 0.98;  // of its time
    const double asked_s =
        session.phases[of.last].end_s - (of.first == 0 ? 0.0 : session.phases[of.first - 1].end_s);
    if (static_cast<double>(count) * session.servo.period_s < kWhole * asked_s) continue;
    const std::size_t stride = std::max<std::size_t>(count / kEnoughRows, 1);
    Recording r;
    r.header.id = fmt::format("{}: {}", recording.name, session.phases[of.first].name);
    r.header.sha256 = sha256;
    for (auto row = begin; row < end; row += static_cast<std::ptrdiff_t>(stride)) {
      r.time_s.push_back(recording.time_s(**row));
      r.drive.push_back(depth_of(**row));
      r.response.push_back(recording.commanded_N(**row));
      if (static_cast<std::size_t>(end - row) <= stride) break;
    }
    SessionPress press;
    for (auto row = rows.begin(); row < begin; row += static_cast<std::ptrdiff_t>(stride)) {
      press.earlier.push_back({recording.time_s(**row), depth_of(**row)});
      if (static_cast<std::size_t>(begin - row) <= stride) break;
    }
    std::string name = r.header.id;
    press.recording = fit::prepare_recording(std::move(name), std::move(r));
    presses.push_back(std::move(press));
  }
  if (presses.empty()) {
    throw bad_input(recording.name, "holds no press that was made to its end",
                    "a session with indentations");
  }
  return presses;
}

}  // namespace tpm::haptics
