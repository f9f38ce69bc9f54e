#include "tpm/scene/network_file.hpp"

#include <fmt/format.h>

#include <numeric>

#include "tpm/core/text.hpp"
#include "tpm/core/version.hpp"
#include "tpm/store/file.hpp"
#include "tpm/store/hdf5.hpp"

namespace tpm {
namespace fs = std::filesystem;
namespace {

std::vector<double> rows_of(const Eigen::Matrix3Xd& columns) {
  return {columns.data(), columns.data() + columns.size()};
}

void write_spheres(const Tissue& tissue, Hdf5Writer& file) {
  const Organ& organ = tissue.network.organ;
  std::vector<std::int32_t> number(organ.size());
  std::iota(number.begin(), number.end(), 1);
  std::vector<std::int32_t> index(organ.size());
  std::iota(index.begin(), index.end(), 0);
  std::vector<std::int32_t> role(organ.size(), 0);
  for (const Guide& guide : tissue.guides) role[guide.sphere] = 1;
  for (const std::size_t sphere : tissue.anchors) role[sphere] = 2;
  std::vector<std::int32_t> contact(organ.size(), 0);
  if (organ.contact) contact[*organ.contact] = 1;
  std::vector<std::int32_t> layer(organ.layer.begin(), organ.layer.end());
  for (std::int32_t& k : layer) ++k;
  file.table("/spheres/position_m", rows_of(organ.position), 3);
  file.table("/spheres/normal", rows_of(organ.normal), 3);
  file.integers("/spheres/index", index, 1);
  file.integers("/spheres/number", number, 1);
  file.integers("/spheres/layer", layer, 1);
  file.integers("/spheres/held", role, 1);
  file.integers("/spheres/contact", contact, 1);
  file.attribute("/spheres/layer", "meaning", "1: outermost");
  file.attribute("/spheres/held", "meaning", "0: free, 1: guided along its normal, 2: anchored");
}

void write_bonds(const Network& network, Hdf5Writer& file) {
  std::vector<std::int32_t> ends;
  std::vector<std::int32_t> kind;
  std::vector<double> rest_length;
  std::vector<double> factor;
  for (const Bond& bond : network.bonds) {
    ends.push_back(static_cast<std::int32_t>(bond.a));
    ends.push_back(static_cast<std::int32_t>(bond.b));
    kind.push_back(bond.kind == BondKind::radial ? 0 : 1);
    rest_length.push_back(bond.rest_length_m);
    factor.push_back(bond.factor);
  }
  file.integers("/bonds/ends", ends, 2);
  file.integers("/bonds/kind", kind, 1);
  file.numbers("/bonds/rest_length_m", rest_length);
  file.numbers("/bonds/factor", factor);
  file.attribute("/bonds/ends", "meaning", "spheres by /spheres/index, from 0");
  file.attribute("/bonds/kind", "meaning", "0: radial, 1: lateral");
  file.attribute("/bonds/factor", "meaning", "times E A0/l0");
}

std::string item(const std::string& file, std::string_view name, std::string_view shape,
                 bool real) {
  return fmt::format(
      "<DataItem Format=\"HDF\" NumberType=\"{}\" Precision=\"{}\" "
      "Dimensions=\"{}\">{}:{}</DataItem>",
      real ? "Float" : "Int", real ? 8 : 4, shape, file, name);
}

std::string attribute(const std::string& file, std::string_view group, std::string_view name,
                      std::string_view centre, std::size_t size, bool real) {
  return fmt::format(
      "      <Attribute Name=\"{}\" AttributeType=\"Scalar\" Center=\"{}\">{}</Attribute>\n", name,
      centre, item(file, fmt::format("/{}/{}", group, name), std::to_string(size), real));
}

std::string escaped(const std::string& text) {
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

std::string xdmf(const Network& network, const std::string& raw_file) {
  const std::string file = escaped(raw_file);
  const std::size_t n = network.organ.size();
  const std::size_t m = network.bonds.size();
  const std::string geometry =
      fmt::format("      <Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
                  item(file, "/spheres/position_m", fmt::format("{} 3", n), true));
  std::string text =
      "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n"
      "    <Grid Name=\"spheres\" GridType=\"Uniform\">\n";
  text += fmt::format(
      "      <Topology TopologyType=\"Polyvertex\" NodesPerElement=\"1\" "
      "NumberOfElements=\"{}\">{}</Topology>\n",
      n, item(file, "/spheres/index", std::to_string(n), false));
  text += geometry;
  for (const char* name : {"number", "layer", "held", "contact"}) {
    text += attribute(file, "spheres", name, "Node", n, false);
  }
  text += fmt::format(
      "      <Attribute Name=\"normal\" AttributeType=\"Vector\" Center=\"Node\">{}</Attribute>\n",
      item(file, "/spheres/normal", fmt::format("{} 3", n), true));
  text += "    </Grid>\n    <Grid Name=\"bonds\" GridType=\"Uniform\">\n";
  text += fmt::format(
      "      <Topology TopologyType=\"Polyline\" NodesPerElement=\"2\" "
      "NumberOfElements=\"{}\">{}</Topology>\n",
      m, item(file, "/bonds/ends", fmt::format("{} 2", m), false));
  text += geometry;
  text += attribute(file, "bonds", "kind", "Cell", m, false);
  text += attribute(file, "bonds", "rest_length_m", "Cell", m, true);
  text += attribute(file, "bonds", "factor", "Cell", m, true);
  return text + "    </Grid>\n  </Domain>\n</Xdmf>\n";
}

}  // namespace

fs::path write_network(const Tissue& tissue, const fs::path& path) {
  const Organ& organ = tissue.network.organ;
  Hdf5Writer file(path);
  write_spheres(tissue, file);
  write_bonds(tissue.network, file);
  file.attribute("/", "title", tissue.title);
  file.attribute("/", "written_by", fmt::format("tpm {}", version()));
  file.attribute("/", "assumptions", fmt::format("{}", fmt::join(organ.assumptions, "; ")));
  file.numbers("/spacing_m", {organ.spacing});
  file.numbers("/radius_m", {organ.radius});
  file.commit();
  fs::path description = path;
  description.replace_extension(".xdmf");
  write_file(description, xdmf(tissue.network, path.filename().string()));
  return description;
}

}  // namespace tpm
