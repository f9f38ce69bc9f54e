#include "hazards/hazard_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"

namespace tpm::haptics {
namespace {

bool was_run(const HazardRow& row) {
  return row.refused.empty();
}

bool stopped(const HazardRow& row) {
  return was_run(row) && row.cause != StopCause::finished;
}

std::string outcome_of(const HazardRow& row) {
  if (!was_run(row)) return "refused: " + row.refused;
  return std::string(to_string(row.cause));
}

std::string in(double value, double scale, bool shown) {
  return shown ? significant(scale * value, 3) : std::string("-");
}

}  // namespace

std::string hazard_text(const HazardStudy& study) {
  const HazardBounds& b = study.bounds;
  std::string text =
      "Hazards on the simulated Omega.7 and operator, in virtual time: no hardware\n\n"
      "| hazard | setting | outcome | largest force, N | largest rise in a period, N | given to "
      "the hand, mJ | to zero force, ms | travel, mm | within bounds |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (const HazardRow& row : study.rows) {
    text +=
        fmt::format("| {} | {}{} | {} | {} | {} | {} | {} | {} | {} |\n", row.hazard, row.setting,
                    row.unchecked ? ", without this check" : "", outcome_of(row),
                    in(row.largest_force_N, 1.0, was_run(row)),
                    in(row.largest_rise_N, 1.0, was_run(row)) + (row.damped ? " (damped)" : ""),
                    in(row.delivered_J, 1e3, was_run(row)), in(row.to_zero_s, 1e3, stopped(row)),
                    in(row.travel_m, 1e3, stopped(row)), row.within ? "yes" : "NO");
  }
  const auto within = std::ranges::count_if(study.rows, &HazardRow::within);
  text += fmt::format(
      "\n{} of {} rows are within bounds: force {} N, rise {} N in a period unless the passivity "
      "controller damps; energy given to the hand {} mJ, of a session that is stopped {} mJ, which "
      "ends within {} ms and {} mm of the first touch, or within {} ms of the fault (after a "
      "stall); nothing passive is refused\n",
      within, study.rows.size(), b.force_N, b.rise_N, 1e3 * b.delivered_J,
      1e3 * b.delivered_stopped_J, 1e3 * b.to_zero_s, 1e3 * b.travel_m, 1e3 * b.fault_to_zero_s);
  return text;
}

std::string clock_hazard_text(const ClockHazardStudy& study) {
  std::string text = fmt::format(
      "Hazards on the clock, on the simulated Omega.7 and operator: no hardware; {}\n\n"
      "| hazard | setting | outcome | consecutive periods missed | largest force, N | from the "
      "fault "
      "to forces off, ms | bound, ms | tries | within bounds |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
      study.scheduling);
  for (const ClockHazardRow& row : study.rows) {
    const bool stopped_by_it = row.expected != StopCause::finished;
    text += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", row.hazard, row.setting,
                        to_string(row.cause), row.consecutive_missed,
                        significant(row.largest_force_N, 3), in(row.to_zero_s, 1e3, stopped_by_it),
                        in(row.bound_s, 1e3, stopped_by_it), row.tries, row.within ? "yes" : "NO");
  }
  const auto within = std::ranges::count_if(study.rows, &ClockHazardRow::within);
  return text + fmt::format(
                    "\n{} of {} rows are within bounds: the end that belongs to the hazard, in "
                    "time, no force above {} N, every missed period counted; other programs can "
                    "stall a session as well, so a row is tried up to {} times\n",
                    within, study.rows.size(), study.force_limit_N, study.most_tries);
}

}  // namespace tpm::haptics
