#include "hil_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "option_kinds.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/files/require_exists.hpp"
#include "tpm/haptics/device/device_file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

/// Chooses one of several devices by its number or text.
void choose_device(DeviceChoice& choice, const DeviceOptions& options) {
  const bool asked = !options.serial.empty() || options.index >= 0;
  if (asked && (choice.kind == "virtual" || choice.kind == "replay")) {
    throw Error(ExitCode::usage, options.serial.empty() ? "--index" : "--serial",
                fmt::format("with --device {}, of which there is one", choice.kind),
                "a device of which there may be several");
  }
  if (choice.kind != "inverse3") {
    constexpr std::uint64_t kMostSerial = 65535;
    if (!options.serial.empty()) {
      choice.which.serial =
          static_cast<int>(parse_whole_number(options.serial, "--serial", 0, kMostSerial));
    }
    if (options.index >= 0) choice.which.index = options.index;
    return;
  }
  std::string& id = choice.inverse.device_id;
  if (!id.empty() && !options.serial.empty() && id != options.serial) {
    throw Error(ExitCode::usage, "--serial", printable(options.serial),
                fmt::format("the same as --inverse-id, '{}', or one of both", printable(id)));
  }
  if (id.empty()) id = options.serial;
  if (options.index >= 0) choice.inverse.index = options.index;
  if (!id.empty() && choice.inverse.index) {
    throw Error(ExitCode::usage, "--index", fmt::format("with --serial {}", printable(id)),
                "one of both");
  }
}

/// Throws Error(usage) for a file that only another kind of device would read.
void require_kind(const DeviceChoice& choice, const std::filesystem::path& file, const char* option,
                  const char* kind) {
  if (file.empty() || choice.kind == kind) return;
  throw Error(ExitCode::usage, option, fmt::format("with --device {}", choice.kind),
              fmt::format("--device {}", kind));
}

}  // namespace

void require_libraries(const DeviceOptions& options) {
  for (const std::string& file : {options.plugin, options.library}) {
    if (!file.empty()) require_exists(file);
  }
}

void add_dhd_library(CLI::App& command, DeviceOptions& options) {
  command.add_option("--dhd-library", options.library,
                     "libdrd.so.3 or libdhd.so.3 of the Force Dimension SDK, version 3");
}

void add_inverse_ports(CLI::App& command, DeviceOptions& options, const char* of) {
  InverseAddress& address = options.choice.inverse;
  const auto add_port = [&command](const char* name, int& port, const std::string& what) {
    command.add_option(name, port, what)->check(CLI::Range(1, 65535))->capture_default_str();
  };
  add_port("--inverse-port", address.port,
           fmt::format("Port of the Inverse service: its simulation channel{}", of));
  add_port("--inverse-events-port", address.events_port,
           "Port of the Inverse service's events, of versions from 3.5 on");
  add_port("--inverse-http-port", address.old_http_port,
           "Port of the Inverse service's HTTP, of versions before 3.5");
}

void add_device_options(CLI::App& command, DeviceOptions& options) {
  command
      .add_option("--device", options.choice.kind,
                  "Device: virtual, replay, plugin, omega7, inverse3 or another with a file in "
                  "configs/devices")
      ->check([](const std::string& kind) {
        if (kind == "plugin") return std::string();
        std::vector<std::string> kinds = device_kinds();
        if (std::find(kinds.begin(), kinds.end(), kind) != kinds.end()) return std::string();
        kinds.emplace_back("plugin");
        return fmt::format("unknown device '{}'{}; expected one of {}", printable(kind),
                           did_you_mean(kind, kinds), fmt::join(kinds, ", "));
      })
      ->capture_default_str();
  command.add_option("--serial", options.serial,
                     "Serial number of the device, where there are several; of --device inverse3 "
                     "its id");
  command
      .add_option("--index", options.index, "Place of the device in the list of tpm hil devices")
      ->check(CLI::Range(0, 127));
  add_dhd_library(command, options);
  command.add_option(
      "--plugin", options.plugin,
      "Library of a device plugin, after tpmkit/haptic_device.h: of --device plugin");
  command.add_option("--device-file", options.file,
                     "File with limits and measured properties of the device (tpm hil identify; "
                     "schemas/device.schema.json); "
                     "without it hardware counts as 20 ms late and free of friction");
  add_inverse_ports(command, options, ", of --device inverse3");
  command.add_option(
      "--inverse-id", options.choice.inverse.device_id,
      "Identifier of the device at the service, where there are several: as --serial");
  command
      .add_option("--inverse-gravity", options.choice.inverse.gravity_carried,
                  "Share of the device's weight that the service is to carry")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command.add_option("--device-recording", options.replay,
                     "Recording whose motion --device replay plays");
  command.add_flag("--may-move", options.choice.may_move,
                   "The device may move by itself to initialise");
  command.add_flag("--take-as-ready", options.choice.take_as_ready,
                   "The device is initialised, where the library cannot tell");
  command
      .add_option("--real-time", options.real_time,
                  "Real-time scheduling that is refused is an error, or said and ignored")
      ->check(one_of_words({"enforce", "ignore"}))
      ->capture_default_str();
}

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  char text[32];
  return std::string(text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc));
}

void warn_of_finding(const DeviceFinding& finding) {
  tell_user("tpm: warning: {}\n", finding.text);
}

DeviceChoice chosen_device(const DeviceOptions& options) {
  DeviceChoice choice = options.choice;
  choice.library = options.library;
  choose_device(choice, options);
  choice.replay = options.replay;
  choice.plugin = options.plugin;
  choice.file = options.file;
  require_kind(choice, choice.replay, "--device-recording", "replay");
  require_kind(choice, choice.plugin, "--plugin", "plugin");
  require_libraries(options);
  if (!choice.file.empty()) (void)read_device_file(choice.file);  // also where nothing asks for it
  return choice;
}

RealTimeWish chosen_wish(const DeviceOptions& options) {
  return options.real_time == "enforce" ? RealTimeWish::enforce : RealTimeWish::ignore;
}

std::string device_arguments(const DeviceOptions& options) {
  std::string text;
  const auto add = [&](const char* option, const std::string& value) {
    if (!value.empty()) text += fmt::format(" {} {}", option, shell_word(value));
  };
  if (options.choice.kind != "virtual") add("--device", options.choice.kind);
  add("--serial", options.serial);
  if (options.index >= 0) add("--index", std::to_string(options.index));
  add("--dhd-library", options.library);
  add("--plugin", options.plugin);
  add("--device-recording", options.replay);
  add("--device-file", options.file);
  return text;
}

}  // namespace tpm::app
