#include "tpm/organ/scene/protocol_file.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "tpm/organ/scene/experiment_blocks.hpp"

namespace tpm::organ {
namespace {

struct ProtocolFileKeys {
  ContactMotionKeys protocol;
  OutputKeys outputs;
};

const Block<ProtocolFileKeys>& protocol_file_block() {
  static const Block<ProtocolFileKeys> block(
      "protocol_file", "what is done to a tissue, and when its response is asked for",
      {required(key("protocol", &ProtocolFileKeys::protocol, contact_motion_kinds().type(),
                    "what is imposed")),
       key("outputs", &ProtocolFileKeys::outputs, outputs_block().type(),
           "when the response is told; default 61 times, evenly; fields are of a scene and not "
           "used")});
  return block;
}

}  // namespace

bool has_protocol(const Json& document) {
  return document.is_object() && document.contains("protocol");
}

const FileKind& protocol_kind() {
  static const FileKind kind{
      "protocol", "What is done to a tissue",
      "The blocks protocol and outputs of a scene, as tpm predict reads them from any file that "
      "has them. Quantities are texts of a number and a unit, such as \"4 mm/s\"",
      protocol_file_block().form()};
  return kind;
}

ProtocolFile parse_protocol_file(const Json& document, std::string_view where) {
  Json blocks = Json::object();
  for (const Key<ProtocolFileKeys>& key : protocol_file_block().keys()) {
    const std::string& name = key.form.name;
    if (document.is_object() && document.contains(name)) blocks[name] = document.at(name);
  }
  const DocumentPlace place{std::string(where)};
  const ProtocolFileKeys keys =
      protocol_file_block().made(checked(std::move(blocks), protocol_kind(), where), place);
  Protocol protocol =
      protocol_of(keys.protocol, place.key("protocol"), std::filesystem::path(where).parent_path());
  std::vector<double> times = outputs_of(keys.outputs, protocol, place.key("outputs")).times_s;
  return {std::move(protocol), std::move(times)};
}

std::vector<double> times_over(const Protocol& protocol, std::size_t count) {
  std::vector<double> times;
  times.reserve(count + protocol.knots().size());
  const double length = protocol.end_s() - protocol.start_s();
  for (std::size_t i = 0; i < count; ++i) {
    times.push_back(protocol.start_s() +
                    length * static_cast<double>(i) / static_cast<double>(count - 1));
  }
  times.back() = protocol.end_s();
  for (const Knot& knot : protocol.knots()) times.push_back(knot.time_s);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

}  // namespace tpm::organ
