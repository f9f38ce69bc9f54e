#include "tpm/fit/design/design_words.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"

namespace tpm::fit {
namespace {

/// One thing about a protocol that a person can turn.
struct Knob {
  const char* unit;
  double to_si;
  double PlannedExperiment::*value;
  const char* phrase;  ///< with {} for the number and its unit
};

constexpr std::array kKnobs{
    Knob{"mm/s", 1e-3, &PlannedExperiment::rate_m_per_s, "at {}"},
    Knob{"mm", 1e-3, &PlannedExperiment::depth_m, "to a depth of {}"},
    Knob{"N", 1.0, &PlannedExperiment::load_N, "under {}"},
    Knob{"s", 1.0, &PlannedExperiment::hold_s, "with a hold of {}"},
    Knob{"s", 1.0, &PlannedExperiment::interval_s, "sampled every {}"},
};

std::string knob_words(const Knob& knob, const PlannedExperiment& e) {
  const std::string number =
      fmt::format("{} {}", significant(e.*knob.value / knob.to_si, 4), knob.unit);
  return fmt::format(fmt::runtime(knob.phrase), number);
}

/// The one knob in which two experiments differ, or null.
const Knob* only_difference(const PlannedExperiment& a, const PlannedExperiment& b) {
  if (a.kind != b.kind || a.repeats != b.repeats) return nullptr;
  const Knob* found = nullptr;
  for (const Knob& knob : kKnobs) {
    if (a.*knob.value == b.*knob.value) continue;
    if (found != nullptr) return nullptr;
    found = &knob;
  }
  return found;
}

/// A time that the parameter decides, s: its own value, or the relaxation time of its dashpot.
std::optional<double> characteristic_time(const DesignProblem& problem, std::size_t i) {
  const FitParameter& p = problem.parameter(i);
  if (p.unit.dimension == Dimension::time) return p.start;
  if (p.unit.dimension != Dimension::viscosity || problem.config.law) return {};
  const std::vector<double> starts = start_values(searched_parameters(problem.config));
  return from_vector(fitted_element(problem.config, starts)).relaxation_time_s();
}

/// Reason why a protocol hides a relaxation time; empty if none is obvious.
std::string hidden_time(double tau_s, const PlannedExperiment& e) {
  const std::string tau = significant(tau_s, 3);
  constexpr double kFew = 2.0;
  if (e.ramp_s() > kFew * tau_s) {
    return fmt::format("the ramp of {} s hides a relaxation of {} s", significant(e.ramp_s(), 3),
                       tau);
  }
  if (e.hold_s < kFew * tau_s) {
    return fmt::format("the hold of {} s ends before a relaxation of {} s",
                       significant(e.hold_s, 3), tau);
  }
  if (e.interval_s > tau_s) {
    return fmt::format("samples every {} s skip a relaxation of {} s", significant(e.interval_s, 3),
                       tau);
  }
  return {};
}

/// In the unit that fits the true value, as the limits beside it.
std::string in_sized_unit(const FitParameter& p, double si) {
  const Unit unit = sized_unit(p.unit, p.start);
  return with_unit(significant(si / unit.to_si, 4), unit);
}

std::string limit_words(const DesignResult& result, std::size_t i, const DesignCandidate& c) {
  const ExpectedParameter& p = c.expected.parameters[i];
  if (const auto tau = characteristic_time(result.problem, i)) {
    std::string hidden = hidden_time(*tau, c.experiment);
    if (!hidden.empty()) return hidden;
  }
  constexpr double kStrong = 0.95;
  if (std::abs(p.rival_correlation) > kStrong) {
    return fmt::format("it trades off with {} (correlation {})", p.rival,
                       fixed(p.rival_correlation, 3));
  }
  return {};
}

/// The candidate that differs from the best in one knob and has the largest (smallest) error.
const DesignCandidate* neighbour(const DesignResult& result, std::size_t i, bool worse) {
  const DesignCandidate& best = result.ranked.front();
  const DesignCandidate* found = nullptr;
  for (const DesignCandidate& c : result.ranked) {
    if (only_difference(c.experiment, best.experiment) == nullptr) continue;
    const double error = c.expected.parameters[i].relative_error;
    const double so_far = found == nullptr ? error : found->expected.parameters[i].relative_error;
    if (found == nullptr || (worse ? error > so_far : error < so_far)) found = &c;
  }
  return found;
}

/// "; at 10 mm/s it would be 0.28-0.33 s (reason)" if that differs by the factor.
std::string neighbour_words(const DesignResult& result, std::size_t i, bool worse, double factor) {
  const DesignCandidate* other = neighbour(result, i, worse);
  if (other == nullptr) return {};
  const DesignCandidate& best = result.ranked.front();
  const double here = best.expected.parameters[i].relative_error;
  const double there = other->expected.parameters[i].relative_error;
  if (worse ? !(there > factor * here) : !(there * factor < here)) return {};
  const std::string reason = worse ? limit_words(result, i, *other) : std::string{};
  return fmt::format(
      "; {} it would be {}{}",
      knob_words(*only_difference(other->experiment, best.experiment), other->experiment),
      interval_words(result.problem.parameter(i), other->expected.parameters[i]),
      reason.empty() ? "" : fmt::format(" ({})", reason));
}

std::string parameter_sentence(const DesignResult& result, std::size_t i) {
  const DesignCandidate& best = result.ranked.front();
  const ExpectedParameter& expected = best.expected.parameters[i];
  const FitParameter& p = result.problem.parameter(i);
  std::string text = fmt::format("{} = {}: {} expected, {}", p.name, in_sized_unit(p, p.start),
                                 interval_words(p, expected),
                                 expected.identified ? "identified" : "not identified");
  if (!expected.identified) {
    const std::string limit = limit_words(result, i, best);
    text +=
        fmt::format(": {}", limit.empty() ? "the noise is too large for so few readings" : limit);
  }
  constexpr double kBetter = 1.1;
  constexpr double kWorse = 1.5;
  text += neighbour_words(result, i, false, kBetter);
  text += neighbour_words(result, i, true, kWorse);
  return text;
}

}  // namespace

std::string experiment_words(const PlannedExperiment& e) {
  const std::string times = e.repeats == 1 ? "once" : fmt::format("{} times", e.repeats);
  const std::string rest = fmt::format("held {} s, every {} s, {}", significant(e.hold_s, 4),
                                       significant(e.interval_s, 4), times);
  if (e.kind == PlannedExperiment::Kind::creep) {
    return fmt::format("creep under {} N, {}", significant(e.load_N, 4), rest);
  }
  return fmt::format("{} mm at {} mm/s, {}", significant(e.depth_m * 1e3, 4),
                     significant(e.rate_m_per_s * 1e3, 4), rest);
}

std::string interval_words(const FitParameter& p, const ExpectedParameter& expected) {
  if (!expected.lower && !expected.upper) return "any value";
  if (!expected.lower) return fmt::format("below {}", in_sized_unit(p, *expected.upper));
  if (!expected.upper) return fmt::format("above {}", in_sized_unit(p, *expected.lower));
  const Unit unit = sized_unit(p.unit, p.start);
  return fmt::format("{} .. {}", significant(*expected.lower / unit.to_si, 4),
                     with_unit(significant(*expected.upper / unit.to_si, 4), unit));
}

std::string criterion_words(const DesignProblem& problem) {
  switch (problem.criterion) {
    case Criterion::parameter:
      return fmt::format("relative standard error of {}",
                         problem.parameter(problem.criterion_parameter).name);
    case Criterion::all:
      return "geometric mean of the relative axes of the confidence ellipsoid (D-optimal)";
    case Criterion::worst:
      break;
  }
  return "largest relative standard error";
}

std::vector<std::string> design_words(const DesignResult& result) {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < result.problem.config.parameters.size(); ++i) {
    words.push_back(parameter_sentence(result, i));
  }
  return words;
}

}  // namespace tpm::fit
