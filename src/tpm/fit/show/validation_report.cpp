#include "tpm/fit/show/validation_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/files/file.hpp"
#include "tpm/fit/validate/law_along.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kMostMotionPoints = 500;  // more only make the file heavy

/// E in percent of the measured value, of a quantity whose own size would not fit beside others.
struct ShownError {
  std::string name;
  double error, expanded;
  std::optional<double> limit;
};

std::vector<ShownError> shown_errors(const Validation& v) {
  std::vector<ShownError> shown;
  const auto add = [&](const std::string& name, const ErrorWithUncertainty& e, double size,
                       const std::optional<double>& limit) {
    if (!(std::abs(size) > 0.0)) return;
    const double percent = 100.0 / std::abs(size);
    shown.push_back({name, percent * e.error, percent * e.expanded(),
                     limit ? std::optional(percent * *limit) : std::nullopt});
  };
  for (const PooledQuantity& p : v.pooled) {
    add("mean: " + p.name, p.e, p.relative ? 1.0 : p.measured, p.limit);
  }
  if (!v.pooled.empty()) return shown;
  for (const RecordingComparison& r : v.recordings) {
    for (const QuantityComparison& q : r.quantities) {
      const std::string name =
          v.recordings.size() > 1 ? fmt::format("{}: {}", r.name, q.name) : q.name;
      add(name, q.e, q.measured, q.limit);
    }
  }
  return shown;
}

Figure error_figure(const Validation& v) {
  Figure figure{"validation_error", fmt::format("Model error of a {}", v.subject),
                "E = S - D of each quantity with U (95 %), in percent of the measured value, and "
                "what is allowed."};
  Panel panel{.x = {"", ""}, .y = {"E, of the measured value", "%"}};
  Series range{.kind = Series::Kind::bracket, .label = "E - U to E + U", .provenance = "derived"};
  Series error{.kind = Series::Kind::points, .label = "E", .provenance = "derived"};
  double place = 0.0;
  for (const ShownError& e : shown_errors(v)) {
    place += 1.0;
    panel.x.names.push_back(e.name);
    range.add_range(place, e.error - e.expanded, e.error + e.expanded);
    error.add(place, e.error);
    if (!e.limit) continue;
    constexpr double kHalf = 0.35;
    Series allowed{.kind = Series::Kind::band, .label = "requirement", .provenance = "assumed"};
    allowed.add_range(place - kHalf, -*e.limit, *e.limit);
    allowed.add_range(place + kHalf, -*e.limit, *e.limit);
    panel.series.push_back(std::move(allowed));
  }
  panel.x.lower = 0.5;
  panel.x.upper = place + 0.5;
  add_if_any(panel, line("no error", {0.5, place + 0.5}, {0.0, 0.0}));
  add_if_any(panel, std::move(range));
  add_if_any(panel, std::move(error));
  figure.panels.push_back(std::move(panel));
  figure.note = conclusion_words(v);
  return figure;
}

/// "a.csv", or "a.csv and 4 of its protocol": the figure would show these as one line.
std::vector<std::string> motion_labels(const Validation& v) {
  constexpr double kSame = 0.02;
  const auto close = [](double a, double b) { return std::abs(a - b) <= kSame * std::abs(b); };
  std::vector<std::size_t> first(v.recordings.size());
  std::vector<int> count(v.recordings.size(), 0);
  for (std::size_t i = 0; i < first.size(); ++i) {
    const auto alike = [&](const Applicability& a) {
      const Applicability& b = v.applicability[i];
      return &a == &b || (close(a.depth, b.depth) && close(a.duration_s, b.duration_s) &&
                          close(a.rate, b.rate));
    };
    first[i] = static_cast<std::size_t>(std::ranges::find_if(v.applicability, alike) -
                                        v.applicability.begin());
    ++count[first[i]];
  }
  std::vector<std::string> labels;
  for (const std::size_t k : first) {
    labels.push_back(
        count[k] > 1 ? fmt::format("{} and {} of its protocol", v.recordings[k].name, count[k] - 1)
                     : v.recordings[k].name);
  }
  return labels;
}

Series motion_line(const std::string& label, const Recording& r, double contact, double unit) {
  const std::size_t stride = 1 + r.time_s.size() / kMostMotionPoints;
  Series s{.kind = Series::Kind::line,
           .label = label,
           .provenance = std::string(provenance_name(r.provenance))};
  const std::vector<double>& moved = is_load(r.drive_quantity) ? r.response : r.drive;
  for (std::size_t i = 0; i < r.time_s.size(); i += stride) {
    s.add(r.time_s[i] - r.time_s.front(), (moved[i] - contact) / unit);
  }
  return s;
}

/// Where contact was in the fit: the slack length that strips share, and the contact of a recording
/// that was fitted alone, are the law's.
double contact_in_fit(const LawFile& law, const CalibrationData::File& file) {
  const PreparedRecording& r = file.recording.value();
  if (is_load(r.recording.drive_quantity)) return r.phases.floor_response;
  const auto& data = law.uncertainty->data;
  const bool of_specimen = law.spec.drive == Quantity::relative_length && !has_own_slack(law);
  if (of_specimen || data.size() == 1) {
    return law.values[law.values.size() - 2];
  }
  const auto fitted = std::ranges::find(data, file.sha256, &FittedFile::sha256);
  const bool known = fitted != data.end() && !file.sha256.empty() && fitted->contact;
  return known ? *fitted->contact : r.phases.contact_drive;
}

Figure motion_figure(const ValidationRequest& request, const Validation& v) {
  const Unit unit = shown_unit(quantity_dimension(v.spec.drive));
  Figure figure{"validation_motion", "Where the motion lies beside the calibration",
                "The drive beyond contact of each recording. A law is known where it was fitted."};
  Panel panel{
      .x = {"time", "s"},
      .y = {fmt::format("{} beyond contact", spaced(quantity_name(v.spec.drive))), unit.symbol}};
  const auto found = std::ranges::count_if(
      v.calibration, [](const CalibrationData::File& f) { return f.recording.has_value(); });
  const std::string calibration =
      found > 1 ? fmt::format("calibration, {} recordings", found) : "calibration";
  for (const CalibrationData::File& file : v.calibration) {
    if (!file.recording) continue;
    add_if_any(panel, motion_line(calibration, file.recording->recording,
                                  contact_in_fit(request.law, file), unit.to_si));
  }
  const std::vector<std::string> labels = motion_labels(v);
  for (std::size_t i = 0; i < v.recordings.size(); ++i) {
    const RecordingComparison& compared = v.recordings[i];
    const ValidationPlacement& p = compared.placement;
    add_if_any(panel, motion_line(labels[i], request.recordings[i].recording,
                                  compared.creep ? p.zero : p.contact, unit.to_si));
  }
  if (const auto& depth = v.applicability.front().fitted_depth) {
    double longest = v.applicability.front().fitted_duration_s.value_or(0.0);
    for (const Series& series : panel.series) longest = std::max(longest, series.x.back());
    const double shown = *depth / unit.to_si;
    panel.series.push_back(
        line("deepest of the calibration", {0.0, longest}, {shown, shown}, "derived"));
  }
  figure.panels.push_back(std::move(panel));
  return figure;
}

}  // namespace

std::vector<std::string> write_validation_report(const std::filesystem::path& folder,
                                                 const ValidationRequest& request,
                                                 const Validation& validation) {
  std::vector<std::string> files{"validation.csv", "validation.json"};
  write_file(folder / files[0], to_csv(validation));
  write_file(folder / files[1], to_text(to_json(validation)));
  return write_figures(folder, {error_figure(validation), motion_figure(request, validation)},
                       std::move(files));
}

}  // namespace tpm::fit
