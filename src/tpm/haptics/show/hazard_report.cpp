#include "tpm/haptics/show/hazard_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/text.hpp"

namespace tpm::haptics {
namespace {

constexpr int kHazardDigits = 4;

bool ran(const HazardRow& row) {
  return row.refused.empty();
}

bool stopped(const HazardRow& row) {
  return ran(row) && row.cause != StopCause::finished;
}

std::string outcome_of(const HazardRow& row) {
  if (!ran(row)) return "refused: " + row.refused;
  return std::string(word_of(row.cause));
}

std::string in(double value, double scale, bool shown) {
  return shown ? significant(scale * value, 3) : std::string("-");
}

}  // namespace

Json hazard_json(const HazardStudy& study) {
  const HazardBounds& b = study.bounds;
  Json rows = array_json(study.rows, [](const HazardRow& row) {
    const auto number = [&](double value, bool shown) {
      return shown ? Json(rounded(value, kHazardDigits)) : Json();
    };
    return Json{{"hazard", row.hazard},
                {"setting", row.setting},
                {"accepted_unstable", row.accepted},
                {"refused", ran(row) ? Json() : Json(row.refused)},
                {"cause", ran(row) ? Json(word_of(row.cause)) : Json()},
                {"largest_force_N", number(row.largest_force_N, ran(row))},
                {"largest_rise_N", number(row.largest_rise_N, ran(row))},
                {"delivered_to_hand_J", number(row.delivered_J, ran(row))},
                {"to_zero_force_s", number(row.to_zero_s, stopped(row))},
                {"travel_m", number(row.travel_m, stopped(row))},
                {"passive", row.passive},
                {"within_bounds", row.within}};
  });
  return {{"simulated_device", true},
          {"safe", study.safe()},
          {"bounds",
           {{"force_N", b.force_N},
            {"rise_in_a_period_N", b.rise_N},
            {"delivered_to_hand_J", b.delivered_J},
            {"delivered_to_hand_stopped_J", b.delivered_stopped_J},
            {"travel_m", b.travel_m},
            {"to_zero_force_s", b.to_zero_s},
            {"fault_to_zero_force_s", b.fault_to_zero_s}}},
          {"rows", std::move(rows)}};
}

std::string hazard_text(const HazardStudy& study) {
  const HazardBounds& b = study.bounds;
  std::string text =
      "Hazards on the simulated Omega.7 and operator, in virtual time: no hardware\n\n"
      "| hazard | setting | outcome | largest force, N | largest rise in a period, N | given to "
      "the hand, mJ | to zero force, ms | travel, mm | within bounds |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (const HazardRow& row : study.rows) {
    text += fmt::format("| {} | {}{} | {} | {} | {} | {} | {} | {} | {} |\n", row.hazard,
                        row.setting, row.accepted ? ", accepted as unstable" : "", outcome_of(row),
                        in(row.largest_force_N, 1.0, ran(row)),
                        in(row.largest_rise_N, 1.0, ran(row)) + (row.damped ? " (damped)" : ""),
                        in(row.delivered_J, 1e3, ran(row)), in(row.to_zero_s, 1e3, stopped(row)),
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

Json clock_hazard_json(const ClockHazardStudy& study) {
  Json rows = array_json(study.rows, [](const ClockHazardRow& row) {
    const bool stopped_by_it = row.expected != StopCause::finished;
    return Json{
        {"hazard", row.hazard},
        {"setting", row.setting},
        {"cause", word_of(row.cause)},
        {"expected_cause", word_of(row.expected)},
        {"consecutive_missed_periods", row.consecutive_missed},
        {"largest_force_N", rounded(row.largest_force_N, kHazardDigits)},
        {"to_zero_force_s", stopped_by_it ? Json(rounded(row.to_zero_s, kHazardDigits)) : Json()},
        {"to_zero_force_bound_s", stopped_by_it ? Json(row.bound_s) : Json()},
        {"tries", row.tries},
        {"within_bounds", row.within}};
  });
  return {{"simulated_device", true},       {"scheduling", study.scheduling},
          {"most_tries", study.most_tries}, {"force_limit_N", study.force_limit_N},
          {"safe", study.safe()},           {"rows", std::move(rows)}};
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
                        word_of(row.cause), row.consecutive_missed,
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
