#include "tpm/organ/scene/network_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5_members.hpp"
#include "tpm/organ/scene/bond_laws_file.hpp"
#include "tpm/organ/scene/xdmf.hpp"
#include "tpmkit/version.hpp"

namespace tpm::organ {
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
  // Spheres that slide in a plane have two sliders; the product of their directions is held.
  std::vector<double> held(3 * organ.size(), 0.0);
  const Slider* before = nullptr;
  for (const Slider& slider : tissue.sliders) {
    const bool in_plane = before != nullptr && before->sphere == slider.sphere;
    role[slider.sphere] = in_plane ? 3 : 1;
    if (in_plane) {
      const Eigen::Vector3d normal = before->direction.cross(slider.direction);
      std::copy(normal.begin(), normal.end(), held.begin() + 3 * std::ptrdiff_t(slider.sphere));
    }
    before = &slider;
  }
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
  file.integers("/spheres/constraint", role, 1);
  file.integers("/spheres/contact", contact, 1);
  file.attribute("/spheres/layer", "meaning", "1: outermost");
  file.attribute(
      "/spheres/constraint", "meaning",
      "0: free, 1: slides along its normal, 2: anchored, 3: slides in the plane square to "
      "held_direction");
  if (std::find(role.begin(), role.end(), 3) != role.end()) {
    file.table("/spheres/held_direction", held, 3);
  }
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
  file.attribute("/bonds/factor", "meaning", "times E A0/l0, without material and regions");
}

std::string xdmf(const Network& network, const std::string& file) {
  using Number = XdmfSource::Number;
  using Centre = XdmfSource::Centre;
  const XdmfSource source(file);
  const std::size_t n = network.organ.size();
  const std::size_t m = network.bonds.size();
  const std::string position = "/spheres/position_m";
  std::string text =
      "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n"
      "    <Grid Name=\"spheres\" GridType=\"Uniform\">\n";
  text += source.points(position, n);
  for (const std::string name : {"number", "layer", "constraint", "contact"}) {
    text += source.scalar(name, "/spheres/" + name, Centre::node, n, Number::whole);
  }
  text += source.vector("normal", "/spheres/normal", n);
  text += "    </Grid>\n    <Grid Name=\"bonds\" GridType=\"Uniform\">\n";
  text += source.lines(position, n, m);
  text += source.scalar("kind", "/bonds/kind", Centre::cell, m, Number::whole);
  for (const std::string name :
       {"rest_length_m", "factor", "stiffness_N_per_m", "relaxing_N_per_m"}) {
    text += source.scalar(name, "/bonds/" + name, Centre::cell, m, Number::real);
  }
  return text + "    </Grid>\n  </Domain>\n</Xdmf>\n";
}

}  // namespace

void write_network_datasets(const Tissue& tissue, Hdf5Writer& file) {
  const Organ& organ = tissue.network.organ;
  write_spheres(tissue, file);
  write_bonds(tissue.network, file);
  write_bond_laws(tissue, file);
  write_members(file, "/",
                {{"title", tissue.title},
                 {"version", version()},
                 {"assumptions", remarks_json(organ.assumptions)}});
  file.numbers("/spacing_m", {organ.spacing});
  file.numbers("/radius_m", {organ.radius});
}

fs::path write_network(const Tissue& tissue, const fs::path& path) {
  Hdf5Writer file(path);
  write_network_datasets(tissue, file);
  file.commit();
  fs::path description = path;
  description.replace_extension(".xdmf");
  write_file(description, xdmf(tissue.network, path.filename().string()));
  return description;
}

}  // namespace tpm::organ
