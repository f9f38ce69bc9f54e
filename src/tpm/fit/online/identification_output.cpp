// Declared in tpm/fit/online/identification.hpp.
// Output of an identification: JSON and terminal.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/online/identification.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kMostStored = 400;  // samples in the JSON

Json sample_parameters_json(const IdentifiedSample& sample, const LawSpec& law) {
  const std::vector<LawParameter> table = law_parameters(law);
  return array_json(sample.estimate.parameters, [&](const SequentialParameter& p) {
    Json entry{{"name", law_key(table[p.place])},
               {"estimate", or_null(p.estimate)},
               {"lower", or_null(p.at_bound ? NAN : p.lower)},
               {"upper", or_null(p.at_bound ? NAN : p.upper)},
               {"relative_half_width", or_null(p.relative_half_width())},
               {"degrees_of_freedom", or_null(p.degrees_of_freedom)}};
    if (p.nuisance) entry["nuisance"] = true;
    if (p.at_bound) entry["at_bound"] = true;
    return entry;
  });
}

Json sample_json(const Identification& id, const IdentifiedSample& sample) {
  const LawSpec& law = id.laws[sample.law];
  Json json{{"time_s", sample.time_s},
            {"samples", sample.estimate.samples},
            {"law", law_name(law)},
            {"lag_1_correlation", or_null(sample.estimate.phi)},
            {"widest_relative_half_width", or_null(sample.estimate.widest_relative_half_width())}};
  json[law.response == Quantity::stress ? "noise_sd_Pa" : "noise_sd_N"] =
      or_null(sample.estimate.sigma);
  json["parameters"] = sample_parameters_json(sample, law);
  return json;
}

/// The unit in which a parameter is shown with its interval.
Unit shown_in(const SequentialParameter& p) {
  // The width, if it is larger, as of a contact near zero.
  const double width = p.upper - p.lower;
  const double size = std::isfinite(width) ? std::max(std::abs(p.estimate), width) : p.estimate;
  return sized_unit(p.parameter.unit, size);
}

std::string parameter_line(const SequentialParameter& p) {
  const Unit unit = shown_in(p);
  const auto shown = [&](double value) {
    return std::isfinite(value) ? significant(value / unit.to_si, 4) : "open";
  };
  if (p.at_bound) {
    return fmt::format("  {:<14} {:>12} {} (at a bound)\n", p.parameter.name, shown(p.estimate),
                       unit.symbol);
  }
  return fmt::format("  {:<14} {:>12} {:>28} {:<6} +-{} %{}\n", p.parameter.name, shown(p.estimate),
                     fmt::format("{} .. {}", shown(p.lower), shown(p.upper)), unit.symbol,
                     significant(100.0 * p.relative_half_width(), 3),
                     p.nuisance ? " (of the recording)" : "");
}

std::string sample_text(const Identification& id, const IdentifiedSample& sample) {
  const Unit response = shown_unit(quantity_dimension(id.laws[sample.law].response));
  std::string text = fmt::format(
      "{} s after {} samples: {}, noise {}, neighbours correlated by {}\n",
      significant(sample.time_s, 4), sample.estimate.samples, law_name(id.laws[sample.law]),
      sized_text(response, sample.estimate.sigma, 3), significant(sample.estimate.phi, 3));
  for (const SequentialParameter& p : sample.estimate.parameters) text += parameter_line(p);
  return text;
}

}  // namespace

Json to_json(const Identification& id) {
  Json json{{"recording", id.name},
            {"level", id.options.level},
            {"target_relative_half_width", id.options.target},
            {"patience", id.options.patience},
            {"ramp_and_hold_s", {id.begin_s, id.end_s}},
            {"samples", id.samples},
            {"stopped", id.stopped ? sample_json(id, id.history[*id.stopped]) : Json()},
            {"last", sample_json(id, id.history.back())}};
  Json history = Json::array();
  const std::size_t stride = 1 + id.history.size() / kMostStored;
  for (std::size_t i = 0; i < id.history.size(); i += stride) {
    history.push_back(sample_json(id, id.history[i]));
  }
  json["history"] = std::move(history);
  json["remarks"] = remarks_json(id.remarks);
  return json;
}

ShortAnswer short_answer(const Identification& id) {
  const IdentifiedSample& result = id.result();
  const IdentifiedSample& last = id.history.back();
  const auto widest = [](const IdentifiedSample& sample) {
    const double width = sample.estimate.widest_relative_half_width();
    return std::isfinite(width) ? fmt::format("+-{} %", significant(100.0 * width, 3))
                                : std::string("open");
  };
  const auto place = [&](const IdentifiedSample& sample) {
    return fmt::format("{} s after {} samples: {}", significant(sample.time_s, 4),
                       sample.estimate.samples, law_name(id.laws[sample.law]));
  };
  const auto noise = [&](const IdentifiedSample& sample) {
    return fmt::format(
        "noise {}, neighbours correlated by {}",
        sized_text(quantity_dimension(id.laws[sample.law].response), sample.estimate.sigma, 3),
        significant(sample.estimate.phi, 3));
  };
  ShortAnswer answer;
  answer.conclusion = {fmt::format("{}{}, the widest interval of the material {}",
                                   id.stopped ? "stopped at " : "at the end, ", place(result),
                                   widest(result))};
  answer.conclusion.push_back(noise(result));
  const auto row = [](const std::string& name, const std::string& estimate,
                      const std::string& interval, const std::string& unit,
                      const std::string& width) {
    return fmt::format("{:<12} {:>11}  {:<24} {:<8} {}", name, estimate, interval, unit, width);
  };
  answer.head = {row("parameter", "estimate",
                     fmt::format("{:.4g} % interval", 100.0 * id.options.level), "unit",
                     "half width")};
  for (const SequentialParameter& p : result.estimate.parameters) {
    const Unit unit = shown_in(p);
    const auto shown = [&](double value) {
      return std::isfinite(value) ? significant(value / unit.to_si, 4) : std::string("open");
    };
    const std::string share =
        std::isfinite(p.relative_half_width())
            ? fmt::format("+-{} %", significant(100.0 * p.relative_half_width(), 3))
            : std::string("open");
    answer.rows.push_back(
        row(p.parameter.name, shown(p.estimate),
            p.at_bound ? "-" : fmt::format("{} .. {}", shown(p.lower), shown(p.upper)), unit.symbol,
            p.at_bound   ? "at a bound"
            : p.nuisance ? share + " (of the recording)"
                         : share));
  }
  if (id.stopped) {
    answer.limits.push_back(
        fmt::format("at the end, {}, {}; {}", place(last), widest(last), noise(last)));
  }
  answer.warnings = remark_texts(id.remarks);
  return answer;
}

std::string to_terminal_text(const Identification& id) {
  constexpr std::size_t kRows = 10;
  std::string text = fmt::format("{:>9} {:>8} {:>18} {:>12} {:>12}\n", "time s", "samples",
                                 "simplest law", "widest +- %", "correlation");
  const std::size_t n = id.history.size();
  for (std::size_t row = 0; row < std::min(n, kRows); ++row) {
    const IdentifiedSample& s = id.history[n <= kRows ? row : row * (n - 1) / (kRows - 1)];
    const double width = 100.0 * s.estimate.widest_relative_half_width();
    text += fmt::format("{:>9} {:>8} {:>18} {:>12} {:>12}\n", significant(s.time_s, 4),
                        s.estimate.samples, law_name(id.laws[s.law]),
                        std::isfinite(width) ? significant(width, 3) : "open",
                        significant(s.estimate.phi, 3));
  }
  if (id.stopped) text += "\nstopped at " + sample_text(id, id.history[*id.stopped]);
  text += "\nat the end, " + sample_text(id, id.history.back());
  for (const Remark& remark : id.remarks) text += fmt::format("! {}\n", remark.text);
  return text;
}

}  // namespace tpm::fit
