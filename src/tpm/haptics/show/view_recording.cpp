#include "tpm/haptics/show/view_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/show/view_parts.hpp"

namespace tpm::haptics {
namespace {

using Value = double (*)(const HilRecording&, const ServoRecord&);

/// The cycles that the page shows: of the session, not of the wait before it.
std::span<const ServoRecord> shown_rows(const HilRecording& recording) {
  const auto begin = std::find_if(recording.rows.begin(), recording.rows.end(),
                                  [](const ServoRecord& row) { return row.phase >= 0; });
  return {begin, recording.rows.end()};
}

/// Curves over the cycles of a recording: every sample, or the least and the largest value of
/// `part` samples where there are more than the page holds.
class RowCurves {
 public:
  RowCurves(const HilRecording& recording, std::size_t most_samples, ViewPage& page)
      : recording_(recording),
        page_(page),
        rows_(shown_rows(recording)),
        part_((rows_.size() + most_samples - 1) / most_samples) {
    part_ = std::max<std::size_t>(part_, 1);
    std::vector<std::uint32_t> cycles;
    for (std::size_t i = 0; i < rows_.size(); i += part_) {
      cycles.push_back(static_cast<std::uint32_t>(rows_[i].cycle));
    }
    time_ = {{"whole", page_.put(cycles)}, {"times", recording.session.servo.period_s}};
  }
  [[nodiscard]] std::size_t part() const { return part_; }
  [[nodiscard]] std::size_t samples() const { return rows_.size(); }

  [[nodiscard]] Json series(const char* label, Value value, double scale) const {
    std::vector<float> least, most;
    for (std::size_t i = 0; i < rows_.size(); i += part_) {
      double low = value(recording_, rows_[i]), high = low;
      for (std::size_t k = i + 1; k < std::min(i + part_, rows_.size()); ++k) {
        const double v = value(recording_, rows_[k]);
        low = std::fmin(low, v);
        high = std::fmax(high, v);
      }
      least.push_back(static_cast<float>(scale * low));
      most.push_back(static_cast<float>(scale * high));
    }
    Json json{{"kind", "line"}, {"label", label}, {"x", time_}};
    json["y"] = page_.put(least);
    if (part_ > 1) json["most"] = page_.put(most);
    return json;
  }

 private:
  const HilRecording& recording_;
  ViewPage& page_;
  std::span<const ServoRecord> rows_;
  std::size_t part_;
  Json time_;
};

/// When the hand felt most: the first cycle of the largest force sent to the device.
std::optional<double> time_of_largest_force(const HilRecording& recording) {
  std::optional<double> time_s;
  double largest_N = -1.0;
  for (const ServoRecord& row : shown_rows(recording)) {
    const double force_N = std::abs(recording.commanded_N(row));
    if (!(force_N > largest_N)) continue;
    largest_N = force_N;
    time_s = recording.time_s(row);
  }
  return time_s;
}

void add_curves(const HilRecording& recording, std::size_t most_samples, ViewPage& page) {
  constexpr double kMilli = 1e3, kMicro = 1e6;
  const RowCurves curves(recording, most_samples, page);
  page.plot_over_time(
      "depth", "mm",
      {curves.series(
           "tool", [](const HilRecording&, const ServoRecord& row) { return row.tool_depth_m; },
           kMilli),
       curves.series(
           "tissue's surface",
           [](const HilRecording&, const ServoRecord& row) { return row.surface_depth_m; },
           kMilli)});
  page.plot_over_time(
      "force", "N",
      {curves.series(
           "sent to the device",
           [](const HilRecording& r, const ServoRecord& row) { return r.commanded_N(row); }, 1.0),
       curves.series(
           "of the model",
           [](const HilRecording&, const ServoRecord& row) { return row.model_force_N; }, 1.0)});
  page.plot_over_time(
      "work of the hand", "mJ",
      {curves.series(
          "work", [](const HilRecording&, const ServoRecord& row) { return row.observed_J; },
          kMilli)});
  if (recording.opened.time == "real") {
    page.plot_over_time("time of a cycle's work", "us",
                        {curves.series(
                            "work",
                            [](const HilRecording&, const ServoRecord& row) {
                              return static_cast<double>(row.busy_s);
                            },
                            kMicro)});
  }
  page.description["samples"] = curves.samples();
  page.description["samples_per_value"] = curves.part();
}

/// The pictures of the organ that the model of the session makes of the recorded motion, as the
/// live page does (LiveView): one each kDrawnEvery_s, of which every `stride`-th is kept.
class RecordedOrgan {
 public:
  RecordedOrgan(const HilRecording& recording, const ViewOptions& options)
      : recording_(recording), options_(options), shape_(make_loop_model(recording.session).shape) {
    displacement_m_ = Eigen::Matrix3Xd::Zero(3, shape_.rest_m.cols());
  }
  [[nodiscard]] bool known() const { return shape_.rest_m.cols() > 0; }

  void compute() {
    const std::span<const ServoRecord> rows = shown_rows(recording_);
    const double period_s = recording_.session.servo.period_s;
    const auto every =
        static_cast<std::uint64_t>(std::max(1.0, std::round(kDrawnEvery_s / period_s)));
    const std::size_t pictures = rows.empty() ? 0 : rows.back().cycle / every + 1;
    constexpr std::size_t kMostPictures = 600;
    const std::size_t stride =
        std::max((pictures + kMostPictures - 1) / kMostPictures,
                 shown_stride(pictures, static_cast<std::size_t>(displacement_m_.size()),
                              options_.most_numbers));
    std::uint64_t next = 0;
    for (const ServoRecord& row : rows) {
      if (row.stop != StopCause::none || !std::isfinite(row.surface_depth_m)) continue;
      for (; row.cycle >= next * every; ++next) take(row, next, stride, pictures);
    }
    said_ = fmt::format("{}; recomputed from the recorded motion, {} pictures of {} s",
                        shape_.field ? "all spheres as the model in the loop places them"
                                     : "the contact sphere as recorded; the others are fixed",
                        times_s_.size(),
                        significant(static_cast<double>(stride * every) * period_s, 3));
  }

  void put(ViewPage& page) const {
    const auto spheres = static_cast<std::size_t>(shape_.rest_m.cols());
    const Eigen::Matrix3Xf rest = shape_.rest_m.cast<float>();
    std::vector<std::uint32_t> ends;
    for (const auto& [a, b] : shape_.bonds) ends.insert(ends.end(), {a, b});
    Json organ{{"spheres", spheres},
               {"radius_m", shape_.radius_m},
               {"contact", shape_.contact},
               {"push", {shape_.push.x(), shape_.push.y(), shape_.push.z()}},
               {"shown", said_}};
    organ["rest_m"] = page.put({rest.data(), static_cast<std::size_t>(rest.size())});
    organ["bonds"] = page.put(ends);
    organ["time_s"] = page.put(times_s_);
    organ["displacement_m"] = page.put(shown_m_);
    page.description["organ"] = std::move(organ);
  }

 private:
  [[nodiscard]] Eigen::Vector3d moved(const ServoRecord& row) const {
    const Eigen::Map<const Eigen::Vector3d> at_m(row.position_m);
    if (!shape_.to_model) return shape_.push * row.surface_depth_m;
    return *shape_.to_model * (at_m - recording_.session.servo.surface_m);
  }
  void take(const ServoRecord& row, std::uint64_t picture, std::size_t stride,
            std::size_t pictures) {
    const Eigen::Vector3d moved_m = moved(row);
    if (shape_.field) (void)shape_.field->step(moved_m);
    if (options_.progress) options_.progress(picture + 1, pictures);
    if (picture % stride != 0) return;
    if (shape_.field) shape_.field->displacements(displacement_m_);
    if (!shape_.to_model) displacement_m_.col(static_cast<Eigen::Index>(shape_.contact)) = moved_m;
    for (const double v : displacement_m_.reshaped()) shown_m_.push_back(static_cast<float>(v));
    times_s_.push_back(recording_.time_s(row));
  }

  const HilRecording& recording_;
  const ViewOptions& options_;
  TissueShape shape_;
  Eigen::Matrix3Xd displacement_m_;
  std::vector<float> shown_m_;
  std::vector<double> times_s_;
  std::string said_;
};

void add_phases(const HilRecording& recording, ViewPage& page) {
  Json phases = Json::array();
  double start_s = 0.0;
  for (const SessionPhase& phase : recording.session.phases) {
    phases.push_back({{"name", phase.name}, {"start_s", start_s}, {"end_s", phase.end_s}});
    start_s = phase.end_s;
  }
  page.description["phases"] = std::move(phases);
}

void add_session_facts(const HilRecording& recording, ViewPage& page) {
  const RecordingHeader& header = recording.opened;
  page.fact("device", device_line(recording));
  page.fact("model in the loop", header.model.name);
  page.fact("error of the model", header.model.error_bound);
  page.fact("time", header.time);
  page.fact("recorded by", fmt::format("tpm {}", header.version));
  page.fact("date", header.notes.date);
  page.fact("operator", header.notes.operator_code);
  page.fact("subject", header.notes.subject_code);
  page.fact("end", recording.cause());
  for (const Remark& remark : recording_remarks(recording)) page.fact("note", remark.text);
  const std::size_t waiting = recording.rows.size() - shown_rows(recording).size();
  if (waiting > 0) page.fact("before the session", fmt::format("{} cycles, not shown", waiting));
}

}  // namespace

ViewPage view_recording(const std::filesystem::path& file, std::string_view bytes,
                        const ViewOptions& options) {
  const HilRecording recording = read_recording(file);
  ViewPage page = begun_page("recording", file, bytes);
  page.description["title"] = recording.session.title;
  page.description["simulated"] = recording.simulated();
  page.description["badge"] = recording.simulated() ? "SIMULATED DEVICE" : "HARDWARE";
  add_session_facts(recording, page);
  add_phases(recording, page);
  if (const auto peak = time_of_largest_force(recording)) page.description["start_s"] = *peak;
  add_curves(recording, options.most_samples, page);
  if (!options.organ) {
    page.fact("organ", "not recomputed (--no-organ)");
    return page;
  }
  RecordedOrgan organ(recording, options);
  if (!organ.known()) {
    page.fact("organ", "none: the session has a law, not a network");
    return page;
  }
  organ.compute();
  organ.put(page);
  return page;
}

}  // namespace tpm::haptics
