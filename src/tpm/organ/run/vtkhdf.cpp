#include "tpm/organ/run/vtkhdf.hpp"

#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/organ/run/step_fields.hpp"

namespace tpm::organ {
namespace {

constexpr std::uint8_t kVtkLine = 3;

std::int64_t as_int64(std::size_t size) {
  return static_cast<std::int64_t>(size);
}

/// k times `rows` for each output k: where its rows begin in a list of all outputs.
std::vector<std::int64_t> offsets(std::size_t outputs, std::size_t rows) {
  std::vector<std::int64_t> list;
  for (std::size_t k = 0; k < outputs; ++k) list.push_back(as_int64(k * rows));
  return list;
}

/// The bonds as lines, the same at all times.
void write_topology(const Network& network, Hdf5Writer& file) {
  std::vector<std::int64_t> ends;
  std::vector<std::int64_t> begins{0};
  std::vector<std::int32_t> kind;
  for (const Bond& bond : network.bonds) {
    ends.push_back(as_int64(bond.a));
    ends.push_back(as_int64(bond.b));
    begins.push_back(as_int64(ends.size()));
    kind.push_back(bond.kind == BondKind::radial ? 0 : 1);
  }
  file.long_integers("/VTKHDF/NumberOfPoints", {as_int64(network.organ.size())});
  file.long_integers("/VTKHDF/NumberOfCells", {as_int64(network.bonds.size())});
  file.long_integers("/VTKHDF/NumberOfConnectivityIds", {as_int64(ends.size())});
  file.long_integers("/VTKHDF/Connectivity", ends);
  file.long_integers("/VTKHDF/Offsets", begins);
  file.bytes("/VTKHDF/Types", std::vector<std::uint8_t>(network.bonds.size(), kVtkLine));
  file.integers("/VTKHDF/CellData/kind", kind, 1);
}

/// Fields that are constant in time: written once, and every time begins at their beginning.
void write_still_fields(const Tissue& tissue, std::size_t outputs, Hdf5Writer& file) {
  const Organ& organ = tissue.network.organ;
  std::vector<std::int32_t> number, layer, constraint(organ.size(), 0);
  for (std::size_t i = 0; i < organ.size(); ++i) {
    number.push_back(static_cast<std::int32_t>(i + 1));
    layer.push_back(organ.layer[i] + 1);
  }
  const Slider* before = nullptr;
  for (const Slider& slider : tissue.sliders) {
    constraint[slider.sphere] = before != nullptr && before->sphere == slider.sphere ? 3 : 1;
    before = &slider;
  }
  for (const std::size_t sphere : tissue.anchors) constraint[sphere] = 2;
  const std::vector<std::int64_t> still(outputs, 0);
  for (const auto& [name, values] :
       {std::pair{"number", &number}, {"layer", &layer}, {"constraint", &constraint}}) {
    file.integers(std::string("/VTKHDF/PointData/") + name, *values, 1);
    file.long_integers(std::string("/VTKHDF/Steps/PointDataOffsets/") + name, still);
  }
  file.long_integers("/VTKHDF/Steps/CellDataOffsets/kind", still);
}

void append(std::vector<StepField>& all, const std::vector<StepField>& more) {
  if (all.empty()) {
    all = more;
    return;
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].values.insert(all[i].values.end(), more[i].values.begin(), more[i].values.end());
  }
}

void write_fields(const std::vector<StepField>& fields, const std::string& where,
                  std::size_t outputs, std::size_t rows, Hdf5Writer& file) {
  for (const StepField& field : fields) {
    const std::string name = "/VTKHDF/" + where + "/" + field.name;
    field.columns == 1 ? file.numbers(name, field.values)
                       : file.table(name, field.values, field.columns);
    file.long_integers("/VTKHDF/Steps/" + where + "Offsets/" + field.name, offsets(outputs, rows));
  }
}

void write_field_series(const ExperimentScene& scene, const RunNetwork& network,
                        const std::vector<QuasiStaticState>& outputs, Hdf5Writer& file) {
  std::vector<double> points;
  std::vector<std::int32_t> validity;
  StepFields all;
  const ValidityWatch watch(scene);
  for (const QuasiStaticState& state : outputs) {
    const Positions spheres = network.spheres(state.position);
    points.insert(points.end(), spheres.data(), spheres.data() + spheres.size());
    const StepFields fields = fields_of(scene, network, watch, state);
    append(all.of_spheres, fields.of_spheres);
    append(all.of_bonds, fields.of_bonds);
    validity.insert(validity.end(), fields.validity.begin(), fields.validity.end());
  }
  const std::size_t n = network.network.organ.size();
  file.table("/VTKHDF/Points", points, 3);
  write_fields(all.of_spheres, "PointData", outputs.size(), n, file);
  write_fields(all.of_bonds, "CellData", outputs.size(), network.network.bonds.size(), file);
  file.integers("/VTKHDF/PointData/validity", validity, 1);
  file.long_integers("/VTKHDF/Steps/PointDataOffsets/validity", offsets(outputs.size(), n));
}

void write_steps(const Network& network, const std::vector<QuasiStaticState>& outputs,
                 Hdf5Writer& file) {
  std::vector<double> times;
  times.reserve(outputs.size());
  for (const QuasiStaticState& state : outputs) times.push_back(state.time_s);
  const std::vector<std::int64_t> still(outputs.size(), 0);
  file.numbers("/VTKHDF/Steps/Values", times);
  file.long_integers("/VTKHDF/Steps/PartOffsets", still);
  file.long_integers("/VTKHDF/Steps/NumberOfParts", std::vector<std::int64_t>(outputs.size(), 1));
  file.long_integers("/VTKHDF/Steps/PointOffsets", offsets(outputs.size(), network.organ.size()));
  file.long_integers("/VTKHDF/Steps/CellOffsets", still);
  file.long_integers("/VTKHDF/Steps/ConnectivityIdOffsets", still);
  file.attribute("/VTKHDF/Steps", "NSteps", std::vector{as_int64(outputs.size())});
}

}  // namespace

void write_vtkhdf(const ExperimentScene& scene, const RunNetwork& network, const SimulationRun& run,
                  const std::filesystem::path& path) {
  const std::vector<QuasiStaticState>& outputs = run.record.outputs;
  Hdf5Writer file(path);
  file.group("/VTKHDF");
  file.attribute("/VTKHDF", "Version", std::vector<std::int64_t>{2, 0});
  file.fixed_text_attribute("/VTKHDF", "Type", "UnstructuredGrid");
  write_topology(network.network, file);
  write_still_fields(scene.tissue, outputs.size(), file);
  write_field_series(scene, network, outputs, file);
  write_steps(network.network, outputs, file);
  file.attribute("/", "scene_sha256", sha256_hex(scene.text));
  file.commit();
}

}  // namespace tpm::organ
