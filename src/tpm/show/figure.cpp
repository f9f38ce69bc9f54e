#include "tpm/show/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::show {
namespace {

std::string_view kind_name(Series::Kind kind) {
  static constexpr auto kNames = std::to_array<Word<Series::Kind>>({
      {Series::Kind::line, "line"},
      {Series::Kind::points, "points"},
      {Series::Kind::band, "band"},
      {Series::Kind::bracket, "bracket"},
      {Series::Kind::mark, "mark"},
      {Series::Kind::trail, "trail"},
      {Series::Kind::failed, "failed"},
      {Series::Kind::upright, "upright"},
      {Series::Kind::level, "level"},
      {Series::Kind::heat, "heat"},
  });
  return word_for(kNames, kind);
}

Json numbers(const std::vector<double>& values) {
  return array_json(values, [](double v) { return rounded(v); });
}

/// Of a map of colours, with null where there is nothing.
Json numbers_or_null(const std::vector<double>& values) {
  return array_json(values, [](double v) { return std::isnan(v) ? Json() : Json(rounded(v)); });
}

/// The arrays that a kind needs are as long as each other.
bool matching(const Series& s) {
  const std::size_t n = s.x.size();
  const bool ranges = s.lower.size() == n && s.upper.size() == n;
  switch (s.kind) {
    case Series::Kind::band:
    case Series::Kind::bracket:
      return ranges;
    case Series::Kind::trail:
      return s.y.size() == n && (ranges || (s.lower.empty() && s.upper.empty()));
    case Series::Kind::failed:
    case Series::Kind::upright:
      return s.y.empty();
    case Series::Kind::level:
      return n == 0;
    case Series::Kind::heat:
      return n * s.y.size() == s.z.size();
    default:
      return s.y.size() == n;
  }
}

void require_drawable(const Series& s, const std::string& where) {
  const std::size_t n = s.x.size();
  if (!matching(s) || (!s.sd.empty() && s.sd.size() != n)) {
    throw Error(ExitCode::numerical, where, "the arrays of a series differ in length");
  }
  for (const auto* values : {&s.x, &s.y, &s.sd, &s.lower, &s.upper}) {
    for (const double v : *values) {
      if (!std::isfinite(v)) throw Error(ExitCode::numerical, where, "a value is not finite");
    }
  }
}

Json axis_json(const Axis& axis) {
  Json json{{"quantity", axis.quantity}, {"unit", axis.unit}, {"logarithmic", axis.logarithmic}};
  if (axis.lower) json["lower"] = rounded(*axis.lower);
  if (axis.upper) json["upper"] = rounded(*axis.upper);
  if (!axis.names.empty()) json["names"] = axis.names;
  return json;
}

Json series_json(const Series& s) {
  Json json{{"kind", kind_name(s.kind)}, {"label", s.label}, {"provenance", s.provenance}};
  if (!s.assumed.empty()) json["assumed"] = s.assumed;
  if (!s.text.empty()) json["text"] = s.text;
  json["x"] = numbers(s.x);
  for (const auto& [key, values] : {std::pair{"y", &s.y}, std::pair{"sd", &s.sd},
                                    std::pair{"lower", &s.lower}, std::pair{"upper", &s.upper}}) {
    if (!values->empty()) json[key] = numbers(*values);
  }
  if (!s.z.empty()) json["z"] = numbers_or_null(s.z);
  return json;
}

Json panel_json(const Panel& panel, const std::string& where) {
  Json series = array_json(panel.series, [&](const Series& s) {
    require_drawable(s, fmt::format("{}, '{}'", where, s.label));
    return series_json(s);
  });
  return Json{{"title", panel.title},
              {"x", axis_json(panel.x)},
              {"y", axis_json(panel.y)},
              {"series", std::move(series)}};
}

}  // namespace

std::string figure_id(std::string_view beginning, std::string_view name) {
  constexpr std::size_t kLongest = 64, kCheckSum = 8;
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.";
  std::string id = fmt::format("{}_{}", beginning, name);
  if (id.size() <= kLongest && id.find_first_not_of(kPlain) == std::string::npos) return id;
  const std::string check_sum = sha256_hex(name).substr(0, kCheckSum);
  id = id.substr(0, kLongest - kCheckSum - 1);
  for (char& c : id) {
    if (kPlain.find(c) == std::string_view::npos) c = '_';
  }
  return fmt::format("{}_{}", id, check_sum);
}

Json to_json(const std::vector<Figure>& figures) {
  Json list = Json::array();
  for (const Figure& figure : figures) {
    Json panels = array_json(figure.panels, [&](const Panel& panel) {
      return panel_json(panel, fmt::format("figure {}", figure.id));
    });
    list.push_back(Json{{"id", figure.id},
                        {"title", figure.title},
                        {"caption", figure.caption},
                        {"panels", std::move(panels)}});
    if (!figure.note.empty()) list.back()["note"] = figure.note;
  }
  return Json{{"figures", std::move(list)}};
}

Series line(std::string label, std::vector<double> x, std::vector<double> y,
            std::string provenance) {
  return {.kind = Series::Kind::line,
          .label = std::move(label),
          .provenance = std::move(provenance),
          .x = std::move(x),
          .y = std::move(y)};
}

void add_if_any(Panel& panel, Series series) {
  if (!series.x.empty()) panel.series.push_back(std::move(series));
}

std::string spaced(std::string_view name) {
  std::string words(name);
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

}  // namespace tpm::show
