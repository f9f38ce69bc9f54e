#include "tpm/haptics/session/recording_export.hpp"

#include <fmt/format.h>

#include <functional>

#include "tpm/files/hdf5/hdf5_members.hpp"
#include "tpmkit/version.hpp"

namespace tpm::haptics {
namespace {

struct FlagWord {
  ServoFlag flag;
  const char* word;
};

constexpr FlagWord kFlagWords[] = {{kTouching, "touching"},   {kTimeGuarded, "time_guarded"},
                                   {kSaturated, "saturated"}, {kForceLimited, "force_limited"},
                                   {kSlipping, "slipped"},    {kRampingIn, "ramping_in"},
                                   {kDamped, "damped"},       {kBeyondModel, "beyond_model"},
                                   {kMarked, "marked"},       {kLate, "late"}};

/// Columns of the rows, each a dataset whose name ends in its unit.
class ColumnWriter {
 public:
  ColumnWriter(Hdf5Writer& file, const HilRecording& recording)
      : file_(file), recording_(recording) {}

  void numbers(const char* name, const char* unit, const char* meaning,
               const std::function<double(const ServoRecord&)>& value) {
    std::vector<double> values;
    values.reserve(recording_.rows.size());
    for (const ServoRecord& row : recording_.rows) values.push_back(value(row));
    file_.numbers(path(name), values);
    describe(name, unit, meaning);
  }
  template <class Number>
  void whole(const char* name, const char* meaning,
             const std::function<Number(const ServoRecord&)>& value) {
    std::vector<Number> values;
    values.reserve(recording_.rows.size());
    for (const ServoRecord& row : recording_.rows) values.push_back(value(row));
    if constexpr (sizeof(Number) == 8) {
      file_.long_integers(path(name), values);
    } else {
      file_.integers(path(name), values, 1);
    }
    describe(name, "1", meaning);
  }

 private:
  [[nodiscard]] static std::string path(const char* name) { return fmt::format("/rows/{}", name); }
  void describe(const char* name, const char* unit, const char* meaning) {
    file_.attribute(path(name), "unit", unit);
    file_.attribute(path(name), "meaning", meaning);
  }

  Hdf5Writer& file_;
  const HilRecording& recording_;
};

void write_rows(Hdf5Writer& file, const HilRecording& recording) {
  file.group("/rows");
  ColumnWriter columns(file, recording);
  columns.numbers("time_s", "s", "since the start, missed periods included",
                  [&](const ServoRecord& row) { return recording.time_s(row); });
  columns.whole<std::int64_t>("cycle", "periods since the start", [](const ServoRecord& row) {
    return static_cast<std::int64_t>(row.cycle);
  });
  columns.whole<std::int32_t>("phase", "row of /phases",
                              [](const ServoRecord& row) { return row.phase; });
  constexpr const char* kAxes[] = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    columns.numbers(fmt::format("position_{}_m", kAxes[k]).c_str(), "m",
                    "of the device, in its coordinates, as read",
                    [k](const ServoRecord& row) { return row.position_m[k]; });
  }
  for (std::size_t k = 0; k < 3; ++k) {
    columns.numbers(fmt::format("commanded_{}_N", kAxes[k]).c_str(), "N",
                    "sent to the device, on the hand, in its coordinates",
                    [k](const ServoRecord& row) { return row.commanded_N[k]; });
  }
  columns.numbers("commanded_N", "N", "sent to the device, against the push",
                  [&](const ServoRecord& row) { return recording.commanded_N(row); });
  columns.numbers("tool_depth_m", "m", "of the tool along the push, from the surface at rest",
                  [](const ServoRecord& row) { return row.tool_depth_m; });
  columns.numbers("surface_depth_m", "m", "of the tissue's surface, given to the model",
                  [](const ServoRecord& row) { return row.surface_depth_m; });
  columns.numbers("model_force_N", "N", "of the tissue against the push, never pulling",
                  [](const ServoRecord& row) { return row.model_force_N; });
  columns.numbers("model_error_N", "N", "error of that force as the model estimates it",
                  [](const ServoRecord& row) { return row.model_error_N; });
  columns.numbers("observed_J", "J", "work of the hand on what is rendered, since the start",
                  [](const ServoRecord& row) { return row.observed_J; });
  columns.numbers("leak_J", "J", "what holding the force within periods has given away so far",
                  [](const ServoRecord& row) { return row.leak_J; });
  columns.numbers("woke_late_s", "s", "after the deadline; 0 in virtual time",
                  [](const ServoRecord& row) { return static_cast<double>(row.woke_late_s); });
  columns.numbers("busy_s", "s", "the cycle's work; 0 in virtual time",
                  [](const ServoRecord& row) { return static_cast<double>(row.busy_s); });
  columns.whole<std::int32_t>("missed", "periods before this one without a command",
                              [](const ServoRecord& row) { return row.missed; });
  columns.whole<std::int32_t>(
      "stop", "0, or in the last row the number of the cause: see /causes",
      [](const ServoRecord& row) { return static_cast<std::int32_t>(row.stop); });
  columns.numbers("gripper_m", "m", "opening of the gripper; not a number: the device has none",
                  [](const ServoRecord& row) { return static_cast<double>(row.gripper_m); });
  columns.whole<std::int64_t>(
      "buttons", "of the device, a bit for each that is pressed",
      [](const ServoRecord& row) { return static_cast<std::int64_t>(row.buttons); });
  constexpr const char* kParts[] = {"w", "x", "y", "z"};
  for (std::size_t k = 0; k < 4; ++k) {
    columns.numbers(fmt::format("grip_{}", kParts[k]).c_str(), "1",
                    "orientation of the grip, a unit quaternion; not a number: the device has none",
                    [k](const ServoRecord& row) { return static_cast<double>(row.grip[k]); });
  }
  for (const FlagWord& flag : kFlagWords) {
    columns.whole<std::int32_t>(flag.word, "1: so in this cycle", [&flag](const ServoRecord& row) {
      return (row.flags & flag.flag) != 0 ? 1 : 0;
    });
  }
}

void write_phases(Hdf5Writer& file, const HilSession& session) {
  std::vector<std::string> names, kinds;
  std::vector<double> starts, ends, from, to;
  double start_s = 0.0;
  for (const SessionPhase& phase : session.phases) {
    names.push_back(phase.name);
    kinds.emplace_back(to_string(phase.kind));
    starts.push_back(start_s);
    ends.push_back(start_s = phase.end_s);
    from.push_back(phase.from);
    to.push_back(phase.to);
  }
  file.group("/phases");
  file.texts("/phases/name", names);
  file.texts("/phases/kind", kinds);
  const auto numbers = [&file](const char* name, const char* unit,
                               const std::vector<double>& values) {
    file.numbers(name, values);
    file.attribute(name, "unit", unit);
  };
  numbers("/phases/start_s", "s", starts);
  numbers("/phases/end_s", "s", ends);
  constexpr const char* kAim = "m of depth; N of push where the kind is load or creep";
  numbers("/phases/from", kAim, from);
  numbers("/phases/to", kAim, to);
}

/// The members of a header that are short: the session with its scene is in /header_json.
Json short_header(const Json& header) {
  Json members;
  for (const char* key : {"version", "time", "simulated_device", "notes"}) {
    if (header.contains(key)) members[key] = header.at(key);
  }
  for (const char* key : {"device", "model"}) {
    for (const auto& [name, value] : header.at(key).items()) {
      if (value.is_primitive()) members[key][name] = value;
    }
  }
  return members;
}

}  // namespace

void export_recording(const HilRecording& recording, std::string_view sha256,
                      const std::filesystem::path& file) {
  Hdf5Writer writer(file);
  Json inputs = Json::array();
  if (!sha256.empty()) inputs.push_back({{"file", recording.name}, {"sha256", sha256}});
  write_members(writer, "/",
                {{"command", "hil export"},
                 {"version", version()},
                 {"inputs", inputs},
                 {"remarks", remarks_json(recording_remarks(recording))},
                 {"title", recording.session.title},
                 {"recording", recording.name},
                 {"simulated_device", recording.simulated()},
                 {"whole", recording.whole()},
                 {"damaged_rows", recording.damaged},
                 {"cause", recording.cause()},
                 {"header", short_header(recording.header)}});
  write_rows(writer, recording);
  write_phases(writer, recording.session);
  std::vector<std::string> causes;
  for (auto i = 0; i <= static_cast<std::int32_t>(StopCause::damping); ++i) {
    causes.emplace_back(to_string(static_cast<StopCause>(i)));
  }
  writer.texts("/causes", causes);
  // Texts of any length: an attribute holds 64 KB at most.
  writer.texts("/header_json", {to_text(recording.header)});
  if (recording.closed) writer.texts("/closing_json", {to_text(recording.closing)});
  writer.commit();
}

}  // namespace tpm::haptics
