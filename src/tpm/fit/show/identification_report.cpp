#include "tpm/fit/show/identification_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::fit {
namespace {

constexpr double kWidestDrawn = 3.0;  // of the estimate; wider says nothing

/// A parameter's line in pieces: where another law was the least it has a gap.
struct BrokenLine {
  std::vector<Series> pieces;
  std::size_t last = 0;  ///< sample of its last point

  void add(const std::string& name, std::size_t sample, double x, double y) {
    if (pieces.empty() || sample != last + 1) {
      pieces.push_back(line(name, {}, {}, "derived"));
    }
    pieces.back().add(x, y);
    last = sample;
  }
};

/// Over the samples at which a law was the least.
Panel width_panel(const Identification& id) {
  Panel panel{.x = {"time", "s"}, .y = {"half width of the interval", "% of the estimate", true}};
  const std::size_t law = id.result().law;
  std::map<std::string, BrokenLine> lines;
  std::vector<std::string> order;
  for (std::size_t i = 0; i < id.history.size(); ++i) {
    const IdentifiedSample& sample = id.history[i];
    if (sample.law != law) continue;
    for (const SequentialParameter& p : sample.estimate.parameters) {
      const double width = p.relative_half_width();
      if (p.nuisance || !(width < kWidestDrawn) || !(width > 0.0)) continue;
      const auto [at, added] = lines.try_emplace(p.parameter.name);
      if (added) order.push_back(p.parameter.name);
      at->second.add(p.parameter.name, i, sample.time_s, 100.0 * width);
    }
  }
  for (const std::string& name : order) {
    for (Series& piece : lines.at(name).pieces) panel.series.push_back(std::move(piece));
  }
  if (panel.series.empty()) return panel;
  double least = 100.0 * id.options.target, most = least, from = id.end_s, to = id.begin_s;
  for (const Series& drawn : panel.series) {
    least = std::min(least, *std::min_element(drawn.y.begin(), drawn.y.end()));
    most = std::max(most, *std::max_element(drawn.y.begin(), drawn.y.end()));
    from = std::min(from, drawn.x.front());
    to = std::max(to, drawn.x.back());
  }
  const double target = 100.0 * id.options.target;
  panel.series.push_back(line("target", {from, to}, {target, target}, "assumed"));
  if (id.stopped) {
    const double stop = id.history[*id.stopped].time_s;
    panel.series.push_back(line("stopped", {stop, stop}, {least, most}, "derived"));
  }
  return panel;
}

Panel law_panel(const Identification& id) {
  Panel panel{.x = {"time", "s"},
              .y = {"simplest law", "", false, 0.5, 0.5 + static_cast<double>(id.laws.size())}};
  for (const LawSpec& law : id.laws) panel.y.names.push_back(law_name(law));
  for (std::size_t law = 0; law < id.laws.size(); ++law) {
    Series s{
        .kind = Series::Kind::points, .label = law_name(id.laws[law]), .provenance = "derived"};
    for (const IdentifiedSample& sample : id.history) {
      if (sample.law != law) continue;
      s.add(sample.time_s, static_cast<double>(law + 1));
    }
    if (!s.x.empty()) panel.series.push_back(std::move(s));
  }
  return panel;
}

/// Half width of each parameter's interval over time, and which law was the least.
Figure identification_figure(const Identification& id) {
  const std::string name = std::filesystem::path(id.name).stem().string();
  return {"identification",
          fmt::format("{}, sample by sample", name),
          fmt::format("Half width of the {} % intervals of {} while the recording is replayed, and "
                      "the simplest law at each sample.",
                      significant(100.0 * id.options.level, 3), law_name(id.laws[id.result().law])),
          {width_panel(id), law_panel(id)}};
}

}  // namespace

std::vector<std::string> write_identification_report(const std::filesystem::path& folder,
                                                     const Identification& identification,
                                                     const LawFile& law, const Json& answer) {
  std::vector<std::string> files{"identification.json", "law.json"};
  write_file(folder / files[0], to_text(answer));
  write_law(folder / files[1], law);
  return write_figures(folder, {identification_figure(identification)}, std::move(files));
}

}  // namespace tpm::fit
