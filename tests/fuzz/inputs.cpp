#include "fuzz/inputs.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <string>

#include "tpm/files/checksum.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/import/description.hpp"
#include "tpm/files/import/import.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/files/json.hpp"
#include "tpm/files/row_log.hpp"
#include "tpm/fit/design/design.hpp"
#include "tpm/fit/likelihood/config.hpp"
#include "tpm/fit/petab.hpp"
#include "tpm/haptics/inverse/messages.hpp"
#include "tpm/haptics/inverse/web_socket.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/session/session.hpp"
#include "tpm/organ/body/mesh_file.hpp"
#include "tpm/organ/run/checkpoint.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpm/paper/claims/audit.hpp"
#include "tpm/paper/organ_study.hpp"
#include "tpm/plan/operations.hpp"
#include "tpm/sweep/block_log.hpp"
#include "tpm/sweep/sweep.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/units.hpp"

namespace tpm::fuzz {
using namespace haptics;
using namespace sweep;
using namespace paper;

namespace {

using Path = std::filesystem::path;

void quiet(const std::string& /*note*/) {}

void read_any_recording(const Path& path) {
  (void)read_measured_file(path);
}

void read_digitizer_project(const Path& path) {
  (void)import_series(path, ImportOptions{});
}

void read_mesh(const Path& path) {
  (void)read_closed_mesh(path, parse_unit("mm", Dimension::length, "fuzz"));
}

void read_claim_file(const Path& path) {
  (void)run_audit(read_json(path), path.native());
}

void read_scene(const Path& path) {
  (void)read_experiment(path);
}

void read_block_log(const Path& path) {
  static const Sweep sweep = parse_sweep(
      parse_json(R"({"model": "single_contact", "indentation": {"kind": "step_hold"}, "block": 2,
                     "axes": [{"parameter": "depth", "values": ["2 mm", "4 mm", "6 mm"]},
                              {"parameter": "spacing", "values": ["20 mm", "30 mm"]}],
                     "outputs": ["peak_force", "end_force"]})",
                 "fuzz"),
      "fuzz", {});
  (void)BlockLog::to_read(path, sweep, quiet);
}

/// Puts a check sum behind the file: what was changed is read, not refused for its old one.
void sum_again(const Path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  const bool has_checksum = file >= 0 && write_checksum(file, std::filesystem::file_size(path));
  if (file >= 0) ::close(file);
  if (!has_checksum)
    throw Error(ExitCode::environment, path.native(), "cannot be given a check sum", "room");
}

/// As it is, then with a check sum and by the scene that it names.
void read_checkpoint_file(const Path& path) {
  try {
    (void)read_checkpoint(path, "fuzz", quiet);
  } catch (const Error&) {
    sum_again(path);
  }
  const std::string identity = Hdf5Reader(path).attribute("/", "checkpoint_of");
  (void)read_checkpoint(path, identity, quiet);
}

/// Every member of the root and of its groups, as numbers.
void read_hdf5(const Path& path) {
  const Hdf5Reader file(path);
  for (const std::string& name : file.members("/")) {
    try {
      (void)file.extents("/" + name);
      (void)file.numbers("/" + name);
    } catch (const Error&) {  // a group, or no numbers
      continue;
    }
  }
}

/// Kind and payload of what a reader takes from bytes that come in pieces of a size, and its fault.
std::string taken_by(WebSocketSide side, std::string_view bytes, std::size_t piece) {
  constexpr std::size_t kMostBytes = 1000;
  WebSocketReader reader(side, kMostBytes);
  std::string taken;
  for (std::size_t i = 0; i < bytes.size(); i += piece) {
    reader.feed(bytes.substr(i, piece));
    while (const auto message = reader.next()) {
      if (message->payload.size() > kMostBytes) throw std::logic_error("a message is too long");
      taken += std::to_string(static_cast<int>(message->kind)) + message->payload + '\n';
    }
  }
  taken += std::to_string(reader.fault());
  return taken;
}

/// Bytes from the network, as both sides take them: the same in one piece and one by one.
void read_web_socket(const Path& path) {
  const std::string bytes = read_file(path);
  bool taken = false;
  for (const WebSocketSide side : {WebSocketSide::client, WebSocketSide::server}) {
    const std::string whole = taken_by(side, bytes, std::max<std::size_t>(bytes.size(), 1));
    if (whole != taken_by(side, bytes, 1)) throw std::logic_error("pieces are read otherwise");
    taken = taken || whole.ends_with('0');
  }
  if (const auto head = parse_http_head(bytes)) {
    taken = answer_upgrade(*head, 10001, {10001}).upgraded || upgrade_fault(*head, "").empty();
  }
  if (!taken) throw bad_input(path.native(), "is no WebSocket", "frames or a handshake");
}

/// A message as a client, a server and who listens to events take it; what none of them takes is
/// refused by all.
void read_inverse_message(const Path& path) {
  const std::string text = read_file(path);
  bool taken = false;
  const auto attempt = [&](const auto& parse) {
    try {
      parse();
      taken = true;
    } catch (const Error&) {
    }
  };
  attempt([&] { (void)parse_command(text, "049D"); });
  attempt([&] { (void)parse_state(text, "049D"); });
  attempt([&] { (void)parse_inventory(text); });
  attempt([&] { (void)parse_event(text); });
  attempt([&] { (void)format_of_version(parse_version(text)); });
  if (!taken) throw bad_input(path.native(), "is no message of the Inverse service", "one");
}

constexpr Input kInputs[] = {
    {"delimited_text", ".csv", read_any_recording},
    {"curve_description", ".json", [](const Path& p) { (void)read_description(p); }},
    {"digitizer_project", ".json", read_digitizer_project},
    {"jpk", ".jpk-force", read_any_recording},
    {"scene", ".json", read_scene},
    {"fit", ".json", [](const Path& p) { (void)read_fit_config(p); }},
    {"fit_tables", ".json", [](const Path& p) { (void)read_fit_problem(p); }},
    {"session", ".json", [](const Path& p) { (void)read_session(p, {}); }},
    {"sweep", ".json", [](const Path& p) { (void)read_sweep(p); }},
    {"design", ".json", [](const Path& p) { (void)read_design(p); }},
    {"organ_study", ".json", [](const Path& p) { (void)read_organ_study(p); }},
    {"costs", ".json", [](const Path& p) { (void)read_costs(p); }},
    {"law", ".json", [](const Path& p) { (void)read_law(p); }},
    {"claims", ".json", read_claim_file},
    {"stl", ".stl", read_mesh},
    {"obj", ".obj", read_mesh},
    {"recording", ".tpmrec", [](const Path& p) { (void)read_recording(p); }},
    {"row_log", ".rows", [](const Path& p) { (void)read_row_log(p); }},
    {"sweep_log", ".blocks", read_block_log},
    {"checkpoint", ".h5", read_checkpoint_file},
    {"hdf5", ".h5", read_hdf5},
    {"web_socket", ".bytes", read_web_socket},
    {"inverse", ".json", read_inverse_message},
};

}  // namespace

std::span<const Input> inputs() {
  return kInputs;
}

const Input& input_named(std::string_view name) {
  const auto* const found =
      std::ranges::find_if(kInputs, [name](const Input& input) { return input.name == name; });
  if (found == std::end(kInputs)) {
    std::string known;
    for (const Input& input : kInputs) known.append(known.empty() ? "" : ", ").append(input.name);
    throw Error(ExitCode::usage, "TPM_FUZZ", "no input '" + std::string(name) + "'", known);
  }
  return *found;
}

bool reads(const Input& input, const std::filesystem::path& folder, std::string_view bytes) {
  const Path path = folder / ("case" + std::string(input.ending));
  {
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!out.flush())
      throw Error(ExitCode::environment, path.native(), "cannot be written", "room");
  }
  try {
    input.read(path);
    return true;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace tpm::fuzz
