#include "tpm/organ/scene/xdmf.hpp"

#include <fmt/format.h>

namespace tpm::organ {
namespace {

std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

}  // namespace

XdmfSource::XdmfSource(std::string_view file) : file_(escaped(file)) {}

std::string XdmfSource::item(std::string_view dataset, std::string_view shape,
                             Number number) const {
  const bool real = number == Number::real;
  return fmt::format(
      "<DataItem Format=\"HDF\" NumberType=\"{}\" Precision=\"{}\" "
      "Dimensions=\"{}\">{}:{}</DataItem>",
      real ? "Float" : "Int", real ? 8 : 4, shape, file_, dataset);
}

std::string XdmfSource::scalar(std::string_view name, std::string_view dataset, Centre centre,
                               std::size_t size, Number number) const {
  return fmt::format(
      "      <Attribute Name=\"{}\" AttributeType=\"Scalar\" Center=\"{}\">{}</Attribute>\n", name,
      centre == Centre::node ? "Node" : "Cell", item(dataset, std::to_string(size), number));
}

std::string XdmfSource::vector(std::string_view name, std::string_view dataset,
                               std::size_t size) const {
  return fmt::format(
      "      <Attribute Name=\"{}\" AttributeType=\"Vector\" Center=\"Node\">{}</Attribute>\n",
      name, item(dataset, fmt::format("{} 3", size), Number::real));
}

std::string XdmfSource::geometry(std::string_view position, std::size_t spheres) const {
  return fmt::format("      <Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
                     item(position, fmt::format("{} 3", spheres), Number::real));
}

std::string XdmfSource::points(std::string_view position, std::size_t spheres) const {
  return fmt::format(
             "      <Topology TopologyType=\"Polyvertex\" NodesPerElement=\"1\" "
             "NumberOfElements=\"{}\">{}</Topology>\n",
             spheres, item("/spheres/index", std::to_string(spheres), Number::whole)) +
         geometry(position, spheres);
}

std::string XdmfSource::lines(std::string_view position, std::size_t spheres,
                              std::size_t bonds) const {
  return fmt::format(
             "      <Topology TopologyType=\"Polyline\" NodesPerElement=\"2\" "
             "NumberOfElements=\"{}\">{}</Topology>\n",
             bonds, item("/bonds/ends", fmt::format("{} 2", bonds), Number::whole)) +
         geometry(position, spheres);
}

}  // namespace tpm::organ
