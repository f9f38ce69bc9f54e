// Declared in tpm/haptics/verify/verify_parts.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tpm/haptics/verify/law_reference.hpp"
#include "tpm/haptics/verify/verify_parts.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::haptics {
namespace {

/// Depth of the model's tool: of a tool that touches that of the surface, slip included.
std::vector<double> touched_depth_m(const RowList& rows) {
  std::vector<double> depth;
  depth.reserve(rows.size());
  for (const ServoRecord* row : rows) {
    const bool touching = (row->flags & kTouching) != 0;
    depth.push_back(touching ? row->surface_depth_m
                             : std::min(row->tool_depth_m, row->surface_depth_m));
  }
  return depth;
}

CrossCheck cross_check_of(const Verification& v, std::string name,
                          const std::vector<double>& time_s, const std::vector<double>& answer_N,
                          const HilRecording& recording, const RowList& rows) {
  FidelitySum sum;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    sum.add(recording.commanded_N(*rows[i]), answer_N[i]);
  }
  return {std::move(name), time_s.front(), time_s.back(), sum.take(),
          apart_from_reference(v, time_s, answer_N)};
}

/// The force that was measured along the motion of the last phase, N; none before it.
std::optional<double> measured_at(const HilSession& session, double time_s) {
  const std::vector<double>& measured_N = session.measured_N;
  const double start_s =
      session.phases.size() < 2 ? 0.0 : session.phases[session.phases.size() - 2].end_s;
  const double spacing_s =
      (session.duration_s() - start_s) / static_cast<double>(measured_N.size() - 1);
  const double part = (time_s - start_s) / spacing_s;
  if (part < 0.0) return std::nullopt;
  const auto i = std::min(static_cast<std::size_t>(part), measured_N.size() - 2);
  return measured_N[i] + (part - static_cast<double>(i)) * (measured_N[i + 1] - measured_N[i]);
}

/// Puts the commanded force and that of the law beside the recording.
void put_beside_recording(Verification& v, const HilRecording& recording, const RowList& rows) {
  const HilSession& session = recording.session;
  if (session.measured_N.size() < 2) return;
  CrossCheck& cross_check = v.others.emplace_back();
  cross_check.measured = true;
  cross_check.name =
      fmt::format("MEASURED: the recording {}, its offset taken off", session.phases.back().name);
  FidelitySum sum;
  for (const ServoRecord* row : rows) {
    const auto measured_N = measured_at(session, recording.time_s(*row));
    if (!measured_N) continue;
    if (cross_check.end_s == 0.0) cross_check.start_s = recording.time_s(*row);
    cross_check.end_s = recording.time_s(*row);
    sum.add(recording.commanded_N(*row), *measured_N);
  }
  cross_check.commanded = sum.take();
  for (std::size_t k = 0; k < v.time_s.size(); ++k) {
    const auto measured_N = measured_at(session, v.time_s[k]);
    if (!measured_N || std::isnan(v.reference_N[k])) continue;
    cross_check.apart_N = std::max(cross_check.apart_N, std::abs(*measured_N - v.reference_N[k]));
  }
}

}  // namespace

/// A law is asked along every sample of the motion. A Hertz contact that shrinks follows Ting in
/// LawModel and the integral over the whole history in the loop: there the latter is the reference,
/// and how far Ting is stands beside it.
Verification verify_law(const HilRecording& recording, const VerifyOptions& options) {
  const RowList rows = moved_rows(recording);
  const std::vector<std::size_t> compared =
      compared_rows(recording, rows.size(), options.spacing_s);
  const LawFile& law = recording.session.law.value();
  Verification v = begun(recording, rows, compared);
  v.knots = rows.size();
  const std::vector<double> depth_m = touched_depth_m(rows);
  std::vector<double> time_s;
  time_s.reserve(rows.size());
  for (const ServoRecord* row : rows) time_s.push_back(recording.time_s(*row));
  const LawModel model(law.spec);
  std::vector<double> values = law.values;
  for (const char* name : {"contact", "offset"}) values[model.index(name)] = 0.0;
  const Response response = model.respond(measured_history(Drive::displacement, time_s, depth_m),
                                          time_s, values, Want::values);
  const std::vector<double> by_model(response.value.begin(), response.value.end());
  const bool branches = law.spec.fractional == Fractional::none;
  const std::vector<double> by_gauss =
      branches ? law_forces_by_gauss(law, time_s, depth_m) : std::vector<double>();
  const bool integral = law.spec.kernel == Kernel::hertz && branches;
  v.reference = integral ? "the law's integral over the recorded motion, by Gauss's rule"
                         : "the law over the recorded motion, by its own quadrature (docs/laws.md)";
  for (const std::size_t i : compared) v.reference_N.push_back((integral ? by_gauss : by_model)[i]);
  for (std::size_t k = 0; k < compared.size(); ++k) {
    v.error_N.push_back(v.commanded_N[k] - v.reference_N[k]);
  }
  compare_phases(v, recording, rows, compared, v.reference_N);
  if (integral) {
    v.others.push_back(cross_check_of(v, "Ting's solution, as far as it answers", time_s, by_model,
                                      recording, rows));
  } else if (branches) {
    v.others.push_back(
        cross_check_of(v, "the law's integral by Gauss's rule", time_s, by_gauss, recording, rows));
  }
  if (!v.others.empty() && !integral) v.reference_error_N = v.others.front().apart_N;
  put_beside_recording(v, recording, rows);
  leave_out_what_has_no_reference(v);
  return v;
}

}  // namespace tpm::haptics
