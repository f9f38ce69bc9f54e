#include "tpm/haptics/verify/verify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/haptics/verify/verify_parts.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {

void FidelitySum::add(double commanded_N, double reference_N) {
  add_error(commanded_N - reference_N, reference_N);
}

void FidelitySum::add_error(double error, double reference_N) {
  if (std::isnan(reference_N)) return;
  squares_ += error * error;
  result_.max_N = std::max(result_.max_N, std::abs(error));
  result_.peak_N = std::max(result_.peak_N, std::abs(reference_N));
  ++result_.instants;
}

ForceFidelity FidelitySum::take() const {
  ForceFidelity result = result_;
  if (result.instants > 0) {
    result.rms_N = std::sqrt(squares_ / static_cast<double>(result.instants));
  }
  return result;
}

RowList moved_rows(const HilRecording& recording) {
  RowList rows;
  for (const ServoRecord& row : recording.rows) {
    if (row.stop == StopCause::none) rows.push_back(&row);
  }
  if (rows.size() < 2) {
    std::string what = "holds no motion";
    for (const Remark& remark : recording_remarks(recording)) what += "; " + remark.text;
    throw bad_input(recording.name, what, "a session of at least two cycles");
  }
  return rows;
}

std::vector<std::size_t> compared_rows(const HilRecording& recording, std::size_t rows,
                                       double spacing_s) {
  const auto stride = static_cast<std::size_t>(
      std::max(1.0, std::round(spacing_s / recording.session.servo.period_s)));
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < rows; i += stride) chosen.push_back(i);
  return chosen;
}

Verification begun(const HilRecording& recording, const RowList& rows,
                   const std::vector<std::size_t>& compared) {
  Verification v;
  v.whole = recording.whole();
  v.end_s = recording.time_s(*rows.back());
  for (const std::size_t i : compared) {
    v.time_s.push_back(recording.time_s(*rows[i]));
    v.depth_m.push_back(rows[i]->tool_depth_m);
    v.commanded_N.push_back(recording.commanded_N(*rows[i]));
  }
  for (const ServoRecord* row : rows) {
    v.model_error_N = std::max(v.model_error_N, row->model_error_N);
  }
  return v;
}

void compare_phases(Verification& v, const HilRecording& recording, const RowList& rows,
                    const std::vector<std::size_t>& compared,
                    const std::vector<double>& reference_size_N) {
  const std::vector<SessionPhase>& phases = recording.session.phases;
  std::vector<FidelitySum> sums(phases.size());
  std::vector<double> depth_squares(phases.size(), 0.0);
  FidelitySum all;
  OperatorScript script = recording.session.operator_script();
  for (std::size_t k = 0; k < compared.size(); ++k) {
    const ServoRecord& row = *rows[compared[k]];
    const auto p = std::min(static_cast<std::size_t>(row.phase), phases.size() - 1);
    sums[p].add_error(v.error_N[k], reference_size_N[k]);
    all.add_error(v.error_N[k], reference_size_N[k]);
    const OperatorAim aim = script.at(v.time_s[k]);
    if (std::isnan(reference_size_N[k])) continue;
    const bool place = aim.aim == OperatorPiece::Aim::place;  // phases that ask for a push: none
    const double asked = place ? aim.value : row.tool_depth_m;
    depth_squares[p] += (row.tool_depth_m - asked) * (row.tool_depth_m - asked);
  }
  v.all = all.take();
  for (std::size_t p = 0; p < phases.size(); ++p) {
    const ForceFidelity force = sums[p].take();
    if (force.instants == 0) continue;
    v.phases.push_back({phases[p], p == 0 ? 0.0 : phases[p - 1].end_s, force,
                        std::sqrt(depth_squares[p] / static_cast<double>(force.instants))});
  }
}

double apart_from_reference(const Verification& v, const std::vector<double>& time_s,
                            const std::vector<double>& answer_N) {
  double most = 0.0;
  std::size_t i = 0;
  for (std::size_t k = 0; k < v.time_s.size() && v.time_s[k] <= time_s.back(); ++k) {
    while (time_s[i] < v.time_s[k]) ++i;  // the instants of the reference are among them
    if (std::isnan(v.reference_N[k]) || std::isnan(answer_N[i])) continue;
    most = std::max(most, std::abs(answer_N[i] - v.reference_N[k]));
  }
  return most;
}

void ask(Verification& v, const std::string& what, const std::function<void()>& cross_check) {
  const std::size_t others = v.others.size();
  try {
    cross_check();
  } catch (const Error& error) {
    if (error.code() != ExitCode::numerical) throw;
    v.others.resize(others);
    v.remarks.push_back({"cross_check_missing", what + " is missing: " + error.what()});
  }
}

void leave_out_what_has_no_reference(Verification& v) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < v.reference_N.size(); ++k) {
    if (std::isnan(v.reference_N[k])) continue;
    for (auto* column : {&v.time_s, &v.reference_N, &v.commanded_N, &v.depth_m, &v.error_N}) {
      (*column)[kept] = (*column)[k];
    }
    ++kept;
  }
  v.without_equilibrium = v.reference_N.size() - kept;
  if (v.without_equilibrium == 0) return;
  v.remarks.push_back(
      {"no_equilibrium",
       fmt::format("no equilibrium of the reference at {} of {} instants, which are left "
                   "out; what follows them rests on a motion straight across",
                   v.without_equilibrium, v.reference_N.size())});
  if (2 * kept < v.reference_N.size()) {
    throw Error(ExitCode::numerical, v.reference, v.remarks.back().text,
                "a motion that the tissue can bear");
  }
  for (auto* column : {&v.time_s, &v.reference_N, &v.commanded_N, &v.depth_m, &v.error_N}) {
    column->resize(kept);
  }
}

std::vector<Remark> all_remarks(const HilRecording& recording, const Verification& v) {
  std::vector<Remark> remarks = recording_remarks(recording);
  remarks.insert(remarks.end(), v.remarks.begin(), v.remarks.end());
  return remarks;
}

Verification verify(const HilRecording& recording, const VerifyOptions& options) {
  Verification v = recording.session.model == "law"       ? verify_law(recording, options)
                   : recording.session.model == "surface" ? verify_in_space(recording, options)
                                                          : verify_along_push(recording, options);
  const auto touches = [](const ServoRecord& row) { return (row.flags & kTouching) != 0; };
  if (std::ranges::none_of(recording.rows, touches)) {
    v.remarks.push_back(
        {"no_contact", "no contact: the tool never touched the tissue, nothing to compare"});
  }
  return v;
}

}  // namespace tpm::haptics
