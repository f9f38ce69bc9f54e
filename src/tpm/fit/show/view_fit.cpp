#include "tpm/fit/show/view_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/document_place.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/likelihood/parameter.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpm/show/view_parts.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/law_uncertainty.hpp"
#include "tpmkit/units.hpp"

namespace tpm::fit {
namespace {

/// A JSON array of numbers as an array of the page; null and what else is no number is left empty.
std::string put_numbers(ViewPage& page, const Json& list) {
  std::vector<double> numbers;
  for (const Json& v : list) numbers.push_back(v.is_number() ? v.get<double>() : std::nan(""));
  return page.put(numbers);
}

Json series_of(ViewPage& page, const Json& series) {
  Json json{{"kind", series.at("kind")},
            {"label", series.value("label", "")},
            {"provenance", series.value("provenance", "")},
            {"text", series.value("text", "")}};
  for (const char* key : {"x", "y", "lower", "upper"}) {
    if (series.contains(key)) json[key] = put_numbers(page, series.at(key));
  }
  return json;
}

Json axis_of(const Json& axis) {
  Json json{{"quantity", axis.at("quantity")},
            {"unit", axis.at("unit")},
            {"logarithmic", axis.value("logarithmic", false)}};
  for (const char* end : {"lower", "upper"}) {  // what the decision is made on
    if (axis.contains(end)) json[end] = axis.at(end);
  }
  if (axis.contains("names")) json["names"] = axis.at("names");  // at 1, 2, ...
  return json;
}

/// Text below the plots of a figure.
std::string caption_of(const Json& figure) {
  std::string caption = figure.value("caption", "");
  const std::string note = figure.value("note", "");
  if (!caption.empty() && !note.empty()) caption += ' ';
  return caption + note;
}

/// The panels of figures.json as plots. Maps of colours are figures of their own and left out.
void add_figures(ViewPage& page, const Json& figures, const std::string& where) {
  try {
    for (const Json& figure : figures.at("figures")) {
      for (const Json& panel : figure.at("panels")) {
        Json plot{{"title", figure.at("title")},
                  {"caption", caption_of(figure)},
                  {"x", axis_of(panel.at("x"))},
                  {"y", axis_of(panel.at("y"))},
                  {"series", Json::array()}};
        for (const Json& series : panel.at("series")) {
          if (series.at("kind") == "heat") {
            page.fact("left out", fmt::format("a map of colours of '{}'",
                                              figure.at("title").get<std::string>()));
            continue;
          }
          plot["series"].push_back(series_of(page, series));
        }
        if (!plot["series"].empty()) page.description["plots"].push_back(std::move(plot));
      }
    }
  } catch (const Json::exception& e) {
    throw bad_input(where, fmt::format("is no figures.json of tpm ({})", e.what()),
                    "what tpm fit has written");
  }
}

/// The unit in which a parameter is read, from that of SI. A drift ("N/s") is sized as what drifts.
Unit read_unit(const std::string& si_unit, double si) {
  constexpr std::string_view kPerSecond = "/s";
  if (!is_unit(si_unit) && si_unit.ends_with(kPerSecond)) {
    const std::string drifts = si_unit.substr(0, si_unit.size() - kPerSecond.size());
    if (is_unit(drifts)) {
      return sized_unit(per_second(shown_unit(parse_unit(drifts, {}).dimension)), si);
    }
  }
  if (!is_unit(si_unit)) return {si_unit, Dimension::dimensionless, 1.0};
  return sized_unit(shown_unit(parse_unit(si_unit, {}).dimension), si);
}

/// A parameter of a law in the unit of its size; with an uncertainty its linearised standard error,
/// and the interval that is symmetric in the coordinate of the uncertainty.
Json law_row(const LawFile& law, const LawParameter& parameter, std::size_t place) {
  const double value = law.values[place];
  const Unit unit = read_unit(std::string(si_symbol(parameter.dimension)), value);
  const auto shown = [&unit](double si, int digits) {
    return significant(si / unit.to_si, digits);
  };
  std::string error = "fixed", interval = "-";
  const std::optional<LawUncertainty>& u = law.uncertainty;
  const auto at =
      u ? std::ranges::find(u->place, place) : std::vector<std::size_t>::const_iterator();
  if (u && at != u->place.end()) {
    const auto k = at - u->place.begin();
    const Coordinate coordinate = u->coordinate[static_cast<std::size_t>(k)];
    const double sd = std::sqrt(u->covariance(k, k)), theta = to_coordinate(coordinate, value);
    const auto end = [&](double sign) {
      return from_coordinate(coordinate, theta + sign * u->quantile() * sd);
    };
    const auto [low, high] = std::minmax({end(-1.0), end(1.0)});
    error = shown(std::abs(coordinate_slope(coordinate, value)) * sd, kErrorDigits);
    interval = fmt::format("{} .. {}", shown(low, kIntervalDigits), shown(high, kIntervalDigits));
  }
  return Json{parameter.name, shown(value, kEstimateDigits), unit.symbol, error, interval};
}

void add_law(ViewPage& page, const std::filesystem::path& file) {
  const LawFile law = read_law(file);
  const std::string name = law_name(law.spec);
  page.description["title"] = law.note.empty() ? name : law.note;
  page.fact("law", name);
  page.fact("provenance of the parameters", std::string(provenance_name(law.provenance)));
  if (law.adequacy) {
    page.description["lead"] =
        Json::array({{{"text", law.adequacy->summary}, {"doubt", !law.adequacy->is_adequate()}}});
  }
  std::string interval = "interval";
  if (const auto& u = law.uncertainty) {
    interval = significant(100.0 * u->level, 3) + " % interval";
    for (const FittedFile& data : u->data) {
      page.fact("fitted to",
                fmt::format("{}: {} readings, SHA-256 {}", data.name, data.readings, data.sha256));
    }
    for (const std::string& parameter : u->at_bound) page.fact("fixed on a bound", parameter);
    for (const std::string& parameter : u->not_separable) {
      page.fact("not separable", parameter);
    }
    for (const std::string& parameter : u->unconfirmed) {
      page.fact("not identified: minimum not trusted", parameter);
    }
  }
  Json rows = Json::array();
  const std::vector<LawParameter> parameters = law_parameters(law.spec);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    rows.push_back(law_row(law, parameters[i], i));
  }
  page.description["table"] = {
      {"title", law.uncertainty ? "Parameters, errors and intervals linearised" : "Parameters"},
      {"head", {"parameter", "value", "unit", "std. error", interval}},
      {"rows", std::move(rows)}};
}

std::string interval_text(const Json& interval, const Unit& unit) {
  const auto end = [&unit](const Json& v) {
    return v.is_number() ? significant(v.get<double>() / unit.to_si, kIntervalDigits)
                         : std::string("open");
  };
  return interval.is_array() && interval.size() == 2
             ? fmt::format("{} .. {}", end(interval[0]), end(interval[1]))
             : std::string("-");
}

/// A limit of a parameter, SI; none where it is open.
std::optional<double> end_of(const Json& parameter, std::size_t which) {
  const Json interval = parameter.value("interval_SI", Json());
  if (!interval.is_array() || interval.size() != 2 || !interval[which].is_number()) return {};
  return interval[which].get<double>();
}

/// The interval of a parameter; "-" where nothing was profiled, as in the text of tpm fit.
std::string interval_of(const Json& parameter, const Unit& unit) {
  const Json interval = parameter.value("interval_SI", Json());
  const auto is_number = [](const Json& v) { return v.is_number(); };
  const bool open = std::ranges::none_of(interval, is_number);
  const bool profiled = !parameter.value("profile_SI_and_deviance", Json::array()).empty();
  return open && !profiled ? "-" : interval_text(interval, unit);
}

/// The name of the intervals of a fit, "95 % interval".
std::string interval_name_of(const Json& fit, const DocumentPlace& place) {
  const Json level = fit.value("confidence_level", Json());
  const double value = level.is_number() ? level.get<double>() : 0.0;
  if (!(value > 0.0 && value < 1.0)) {
    throw bad_input(place.key("confidence_level").where,
                    level.is_null() ? "is missing" : "is no confidence level",
                    "a number between 0 and 1, the level of the intervals");
  }
  return significant(100.0 * value, 3) + " % interval";
}

/// Profile of the deviance along a parameter, with the interval that is read from it.
void add_profile(ViewPage& page, const Json& parameter, const Unit& unit,
                 const std::string& interval_name) {
  std::vector<double> x, y, ends;
  for (const Json& pair : parameter.value("profile_SI_and_deviance", Json::array())) {
    if (!pair.at(0).is_number() || !pair.at(1).is_number()) continue;  // the model failed there
    x.push_back(pair.at(0).get<double>() / unit.to_si);
    y.push_back(pair.at(1).get<double>());
  }
  if (x.size() < 2) return;
  const double least = *std::ranges::min_element(y);
  for (double& deviance : y) deviance -= least;
  const auto [first, last] = std::ranges::minmax_element(x);
  const std::vector<double> along{*first, *last};
  for (const Json& end : parameter.value("interval_SI", Json())) {
    if (end.is_number()) ends.push_back(end.get<double>() / unit.to_si);
  }
  const std::vector<double> best{parameter.at("estimate_SI").get<double>() / unit.to_si};
  const std::string name = parameter.at("name").get<std::string>();
  Json series = {{{"kind", "line"},
                  {"label", "deviance, all other parameters fitted"},
                  {"x", page.put(x)},
                  {"y", page.put(y)}},
                 {{"kind", "points"},
                  {"label", "best fit"},
                  {"x", page.put(best)},
                  {"y", page.put(std::vector<double>{0.0})}}};
  if (!ends.empty()) {
    series.push_back({{"kind", "upright"}, {"label", interval_name}, {"x", page.put(ends)}});
  }
  if (parameter.contains("deviance_at_limit")) {
    const double rise = parameter.at("deviance_at_limit").get<double>() - least;
    series.push_back({{"kind", "line"},
                      {"label", "limit of the " + interval_name},
                      {"x", page.put(along)},
                      {"y", page.put(std::vector<double>{rise, rise})}});
  }
  page.description["plots"].push_back({{"title", "profile of " + name},
                                       {"x", {{"quantity", name}, {"unit", unit.symbol}}},
                                       {"y", {{"quantity", "rise of the deviance"}, {"unit", ""}}},
                                       {"series", std::move(series)}});
}

/// @param place of the fit in its file
void add_answer(ViewPage& page, const Json& fit, const DocumentPlace& place) {
  page.description["title"] = fit.at("title");
  page.fact("model", fit.at("model").get<std::string>());
  Json rows = Json::array();
  const std::string interval_name = interval_name_of(fit, place);
  for (const Json& p : fit.at("parameters")) {
    const double estimate = p.at("estimate_SI").get<double>();
    const double size = size_of(estimate, end_of(p, 0), end_of(p, 1));
    const Unit unit = read_unit(p.at("SI_unit").get<std::string>(), size);
    rows.push_back({p.at("name"), estimate_text(estimate, size, unit), interval_of(p, unit),
                    unit.symbol, p.value("verdict", "")});
    add_profile(page, p, unit, interval_name);
  }
  page.description["table"] = {
      {"title", "Parameters"},
      {"head", {"parameter", "estimate", interval_name, "unit", "verdict"}},
      {"rows", std::move(rows)}};
  for (const Json& data : fit.value("data", Json::array())) {
    page.fact("reading",
              fmt::format("{}, {}: {}, {}", data.value("dataset", ""), data.value("label", ""),
                          data.value("provenance", ""), data.value("role", "")));
  }
}

/// Adds the conclusion of a law's selection first.
void add_conclusion(ViewPage& page, const Json& answer, const Json& fit) {
  Json& lead = page.description["lead"] = Json::array();
  const auto add = [&lead](const std::string& text, bool doubt) {
    const auto same = [&text](const Json& said) { return said.at("text") == text; };
    if (std::ranges::none_of(lead, same)) lead.push_back({{"text", text}, {"doubt", doubt}});
  };
  const Json adequacy = fit.value("adequacy", Json());
  if (adequacy.is_object()) {
    add(adequacy.at("summary").get<std::string>(), adequacy.at("verdict") != "adequate");
  } else {
    add("whether the law describes the data was not tested", true);
  }
  for (const Json& words : answer.value("summary", Json::array())) {
    add(words.get<std::string>(), false);
  }
  for (const Json* part : {&answer, &fit}) {
    for (const Json& remark : part->value("remarks", Json::array())) {
      add("warning: " + remark.at("text").get<std::string>(), false);
    }
  }
}

/// "0.273817 N"; "-" where nothing was required.
std::string compared_text(const Json& quantity, const char* key, int digits) {
  if (!quantity.contains(key) || !quantity.at(key).is_number()) return "-";
  const double si = quantity.at(key).get<double>();
  const std::string symbol = quantity.at("unit").get<std::string>();
  if (symbol.empty() || symbol == "1") return significant(si, digits);
  const Unit unit = read_unit(symbol, si);
  return significant(si / unit.to_si, digits) + " " + unit.symbol;
}

/// @param name of the recording
Json compared_row(const std::string& name, const Json& quantity) {
  constexpr int kValueDigits = 4;
  std::string verdict = quantity.at("verdict").get<std::string>();
  std::ranges::replace(verdict, '_', ' ');
  const bool share = quantity.at("unit") == "1";
  return {name,
          quantity.at("quantity").get<std::string>() + (share ? ", share of S" : ""),
          verdict,
          compared_text(quantity, "S", kValueDigits),
          compared_text(quantity, "D", kValueDigits),
          compared_text(quantity, "E", kErrorDigits),
          compared_text(quantity, "U", kErrorDigits),
          compared_text(quantity, "R", kErrorDigits)};
}

/// What was compared with the recordings, the conclusion first; the figures beside it.
void add_validation(ViewPage& page, const Json& json, const std::filesystem::path& file) {
  page.description["kind"] = "validation";
  page.description["badge"] = "VALIDATION";
  page.description["title"] = "Validation of " + json.at("law_file").get<std::string>();
  const std::string verdict = json.at("verdict").get<std::string>();
  const bool doubt = verdict != "adequate" && json.at("requirement") != "none";
  Json& lead = page.description["lead"] =
      Json::array({{{"text", json.at("summary")}, {"doubt", doubt}}});
  for (const Json& remark : json.at("remarks")) {
    lead.push_back(
        {{"text", "warning: " + remark.at("text").get<std::string>()}, {"doubt", false}});
  }
  page.fact("law", fmt::format("{}, SHA-256 {}", json.at("law").get<std::string>(),
                               json.at("law_sha256").get<std::string>()));
  page.fact("requirement", json.at("requirement").get<std::string>());
  page.fact("S, D, E, U, R",
            "simulated, measured, E = S - D with its expanded uncertainty U (95 %), and the "
            "largest error that is allowed");
  Json rows = Json::array();
  // Several recordings are decided by their mean.
  for (const Json& q : json.value("pooled", Json::array())) {
    rows.push_back(compared_row(
        fmt::format("mean of {} recordings", q.at("recordings").get<std::size_t>()), q));
  }
  for (const Json& recording : json.at("recordings")) {
    const std::string name = recording.at("recording").get<std::string>();
    page.fact("recording",
              fmt::format("{}, SHA-256 {}", name, recording.at("sha256").get<std::string>()));
    for (const Json& q : recording.at("quantities")) rows.push_back(compared_row(name, q));
  }
  page.description["table"] = {
      {"title", "Compared with the recordings"},
      {"head", {"recording", "quantity", "verdict", "S", "D", "E", "U", "R"}},
      {"rows", std::move(rows)}};
  const std::filesystem::path figures = file.parent_path() / "figures.json";
  if (is_validation_of_folder(file) && std::filesystem::exists(figures)) {
    add_figures(page, read_json(figures), figures.string());
  }
}

bool is_law(const Json& json) {
  return json.contains("law") && json.contains("parameters") && json.contains("response");
}

bool is_answer(const Json& json) {
  return json.contains("parameters") && json.contains("model") && json.contains("chi_square");
}

bool is_validation(const Json& json) {
  return json.contains("law_file") && json.contains("recordings") && json.contains("verdict");
}

const Json& fit_in(const Json& answer) {
  return answer.contains("fit") ? answer.at("fit") : answer;
}

DocumentPlace place_of_fit(const Json& answer, const std::filesystem::path& file) {
  const DocumentPlace whole{file.string()};
  return answer.contains("fit") ? whole.key("fit") : whole;
}

/// A law, with the figures beside it if there are any.
void add_law_and_figures(ViewPage& page, const std::filesystem::path& file) {
  add_law(page, file);
  const std::filesystem::path figures = file.parent_path() / "figures.json";
  if (!std::filesystem::exists(figures)) {
    page.fact("curves", "none: there is no figures.json beside the law");
    return;
  }
  page.fact("curves", "from figures.json beside it, SHA-256 " + sha256_hex(read_file(figures)));
  add_figures(page, read_json(figures), figures.string());
}

/// Fills the page from whatever of a fit the file is.
void add_fit(ViewPage& page, const Json& json, FitFile is, const std::filesystem::path& file) {
  try {
    const Json& fit = fit_in(json);
    if (is == FitFile::figures) {
      page.description["kind"] = "figures";
      page.description["badge"] = "FIGURES";
      const Json& figures = json.at("figures");
      page.description["title"] =
          figures.size() == 1
              ? figures.at(0).at("title").get<std::string>()
              : fmt::format("{}: {} figures",
                            std::filesystem::absolute(file).parent_path().filename().string(),
                            figures.size());
      add_figures(page, json, file.string());
    } else if (is == FitFile::law) {
      add_law_and_figures(page, file);
    } else if (is == FitFile::validation) {
      add_validation(page, json, file);
    } else {
      add_conclusion(page, json, fit);
      const std::filesystem::path figures = file.parent_path() / "figures.json";
      if (is_answer_of_folder(file) && std::filesystem::exists(figures)) {
        add_figures(page, read_json(figures), figures.string());
      }
      add_answer(page, fit, place_of_fit(json, file));
    }
  } catch (const Json::exception& e) {
    throw bad_input(file.string(), fmt::format("is not as tpm writes it ({})", e.what()),
                    "a file that tpm has written, such as its law.json or figures.json");
  }
}

}  // namespace

FitFile fit_file(const Json& document) {
  if (!document.is_object()) return FitFile::none;
  if (document.contains("figures")) return FitFile::figures;
  if (is_law(document)) return FitFile::law;
  if (is_validation(document)) return FitFile::validation;
  return is_answer(fit_in(document)) ? FitFile::answer : FitFile::none;
}

bool is_answer_of_folder(const std::filesystem::path& file) {
  return file.filename() == "selection.json" || file.filename() == "answer.json";
}

bool is_validation_of_folder(const std::filesystem::path& file) {
  return file.filename() == "validation.json";
}

ViewPage fit_page(const Json& answer, const Json& figures, const std::filesystem::path& file) {
  ViewPage page = begun_page("fit", file, read_file(file));
  page.description["badge"] = "FIT";
  const Json& fit = fit_in(answer);
  add_conclusion(page, answer, fit);
  add_figures(page, figures, file.string());
  add_answer(page, fit, place_of_fit(answer, file));
  return page;
}

ViewPage view_fit(const std::filesystem::path& file, std::string_view bytes) {
  const Json json = parse_json(bytes, file.string());
  ViewPage page = begun_page("fit", file, bytes);
  page.description["badge"] = "FIT";
  const FitFile is = fit_file(json);
  if (is == FitFile::none) {
    throw bad_input(file.string(), "is JSON that tpm view does not show",
                    "law.json, figures.json, validation.json or the JSON answer of tpm fit");
  }
  add_fit(page, json, is, file);
  return page;
}

}  // namespace tpm::fit
