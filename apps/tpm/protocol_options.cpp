#include "protocol_options.hpp"

#include "command.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace {

constexpr std::size_t kRampTimes = 121;

double above_zero(const std::string& text, Dimension dimension, const char* option) {
  const double value = option_quantity(text, dimension, option);
  if (value > 0.0) return value;
  throw Error(ExitCode::usage, option, "'" + printable(text) + "'", "above 0");
}

ProtocolFile ramp_of(const RampOptions& options) {
  if (options.depth.empty() || options.rate.empty() || options.hold.empty()) {
    throw Error(ExitCode::usage, "--depth, --rate, --hold", "not all of them are given",
                "all three, or a file with a protocol");
  }
  Protocol protocol = of_option([&] {
    return ramp_and_hold(above_zero(options.depth, Dimension::length, "--depth"),
                         above_zero(options.rate, Dimension::speed, "--rate"),
                         above_zero(options.hold, Dimension::time, "--hold"));
  });
  std::vector<double> times = times_over(protocol, kRampTimes);
  return {std::move(protocol), std::move(times)};
}

}  // namespace

void add_ramp_options(CLI::App& command, RampOptions& options) {
  command.add_option(
      "--depth", options.depth,
      "Depth of the indentation: instead of a file, a ramp to this depth, such as \"4 mm\"");
  command.add_option("--rate", options.rate, "Speed of the ramp, such as \"2 mm/s\"");
  command.add_option("--hold", options.hold, "Time at depth, such as \"30 s\"");
}

std::optional<ProtocolFile> chosen_protocol(const RampOptions& options,
                                            const std::vector<std::string>& files) {
  if (!options.depth.empty() || !options.rate.empty() || !options.hold.empty()) {
    if (files.empty()) return ramp_of(options);
    throw Error(ExitCode::usage, "--depth, --rate, --hold", "beside a file", "one of the two");
  }
  if (files.empty()) {
    throw Error(ExitCode::usage, "PROTOCOL|RECORDING", "not given",
                "a file, or --depth, --rate and --hold");
  }
  if (!files.front().ends_with(".json")) return std::nullopt;
  const Json document = read_json(files.front());
  require_one_protocol(document, DocumentPlace{files.front()});
  if (!has_protocol(document)) return std::nullopt;
  return parse_protocol_file(document, files.front());
}

}  // namespace tpm::app
