#include "tpm/organ/scene/protocol_file.hpp"

#include <algorithm>
#include <utility>

#include "tpm/files/blocks/protocol_block.hpp"
#include "tpm/files/renamed_names.hpp"
#include "tpm/organ/scene/experiment_blocks.hpp"

namespace tpm::organ {

bool has_protocol(const Json& document) {
  return document.is_object() && document.contains("protocol");
}

ProtocolFile parse_protocol_file(const Json& document, std::string_view where) {
  Json blocks = Json::object();
  for (const char* key : {"protocol", "outputs"}) {
    if (document.is_object() && document.contains(key)) blocks[key] = document.at(key);
  }
  blocks = checked(std::move(blocks), "protocol", where);
  const DocumentPlace place{std::string(where)};
  const DocumentPlace at = place.key("protocol");
  Protocol protocol =
      parse_protocol_block(blocks.at("protocol"), at, Openness::complete).protocol(at);
  const Json outputs = blocks.value("outputs", Json::object());
  std::vector<double> times = parse_outputs(outputs, protocol, place.key("outputs")).times_s;
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
