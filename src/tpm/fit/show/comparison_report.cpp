#include "tpm/fit/show/comparison_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/files/file.hpp"
#include "tpm/fit/show/fit_csv.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::fit {
namespace {

std::vector<const ComparedQuantity*> drawn_quantities(const GroupComparison& c) {
  std::vector<const ComparedQuantity*> drawn;
  for (const auto* list : {&c.parameters, &c.moduli}) {
    for (const ComparedQuantity& q : *list) {
      if (q.difference && q.parameter.scale == Scale::log) drawn.push_back(&q);
    }
  }
  return drawn;
}

Panel ratio_panel(const GroupComparison& c, const std::vector<const ComparedQuantity*>& drawn) {
  Panel panel{"",
              {"", "", false, 0.5, static_cast<double>(drawn.size()) + 0.5},
              {fmt::format("{} / {}", c.names[1], c.names[0]), "", true}};
  Series ratio{.kind = Series::Kind::points, .label = "ratio", .provenance = "derived"};
  Series interval{.kind = Series::Kind::bracket, .label = "its interval", .provenance = "derived"};
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    const GroupDifference& d = *drawn[i]->difference;
    const auto at = static_cast<double>(i + 1);
    panel.x.names.push_back(drawn[i]->parameter.name);
    ratio.add(at, std::exp(d.difference));
    interval.add_range(at, std::exp(d.interval.lower), std::exp(d.interval.upper));
  }
  Series none =
      line("no difference", {0.5, static_cast<double>(drawn.size()) + 0.5}, {1.0, 1.0}, "derived");
  panel.series = {std::move(none), std::move(interval), std::move(ratio)};
  return panel;
}

/// Recordings spread over the width of their group, in their order.
Panel group_panel(const GroupComparison& c, const ComparedQuantity& q) {
  const double unit = q.parameter.unit.to_si;
  Panel panel{"", {"", "", false, 0.5, 2.5}, {q.parameter.name, q.parameter.unit.symbol, true}};
  panel.x.names = {c.names[0], c.names[1]};
  Series own{
      .kind = Series::Kind::points, .label = "estimate of a recording", .provenance = "derived"};
  Series range{.kind = Series::Kind::bracket,
               .label = "interval of the typical specimen",
               .provenance = "derived"};
  for (std::size_t i = 0; i < c.study.rows.size(); ++i) {
    const SpecimenRow& row = c.study.rows[i];
    if (!row.fit) continue;
    for (std::size_t k = 0; k < row.place.size(); ++k) {
      if (row.fit->parameters[k].parameter.name != q.parameter.name) continue;
      const double estimate = row.parameter(k).estimate;
      if (!(estimate > 0.0)) continue;
      const bool second = i >= c.first;
      const double count = static_cast<double>(second ? c.study.rows.size() - c.first : c.first);
      const double order = static_cast<double>(second ? i - c.first : i);
      own.add((second ? 2.0 : 1.0) + 0.5 * ((order + 0.5) / count - 0.5), estimate / unit);
    }
  }
  for (std::size_t g = 0; g < 2; ++g) {
    if (!q.typical[g]) continue;
    const EffectInterval& e = q.typical[g]->interval;
    range.add_range(static_cast<double>(g + 1) + 0.35, q.parameter.natural(e.lower) / unit,
                    q.parameter.natural(e.upper) / unit);
  }
  if (!range.x.empty()) panel.series.push_back(std::move(range));
  if (!own.x.empty()) panel.series.push_back(std::move(own));
  return panel;
}

}  // namespace

Figure comparison_figure(const GroupComparison& c) {
  const std::vector<const ComparedQuantity*> drawn = drawn_quantities(c);
  Figure figure{
      "comparison", fmt::format("{} against {}: {}", c.names[1], c.names[0], law_name(c.study.law)),
      fmt::format("{} recordings against {}, each fitted by itself with one law and one reference; "
                  "ratios of typical specimens with {:.4g} % intervals (random effects, modified "
                  "Hartung-Knapp).",
                  c.study.rows.size() - c.first, c.first, 100.0 * c.study.level)};
  if (drawn.empty()) return figure;
  figure.panels.push_back(ratio_panel(c, drawn));
  constexpr std::size_t kShown = 2;
  for (const ComparedQuantity& q : c.parameters) {
    if (figure.panels.size() > kShown) break;
    if (q.difference && q.parameter.scale == Scale::log) figure.panels.push_back(group_panel(c, q));
  }
  return figure;
}

std::vector<std::string> write_comparison_report(const std::filesystem::path& folder,
                                                 const GroupComparison& c,
                                                 const std::optional<ContactGeometry>& probe) {
  write_file(folder / "comparison.json", to_text(to_json(c)));
  write_file(folder / "comparison.csv", comparison_csv(c));
  write_file(folder / "specimens.csv", specimens_csv(c.study, probe));
  std::vector<std::string> files{"comparison.json", "comparison.csv", "specimens.csv"};
  const Figure figure = comparison_figure(c);
  if (figure.panels.empty()) return files;
  return write_figures(folder, {figure}, std::move(files));
}

}  // namespace tpm::fit
