#include "tpm/organ/run/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/version.hpp"

namespace tpm::organ {
namespace fs = std::filesystem;
namespace {

constexpr const char* kExpected = "a checkpoint of tpm simulate; remove the file to start anew";

void append(std::vector<double>& list, const double* first, Eigen::Index count) {
  list.insert(list.end(), first, first + count);
}

/// States one after the other: time, imposed, response, work, heat, stored; positions; m_j.
void write_states(Hdf5Writer& file, const std::string& group,
                  std::span<const QuasiStaticState> states) {
  std::vector<double> scalars, beside;
  std::vector<double> position;
  std::vector<double> viscous;
  for (const QuasiStaticState& s : states) {
    const QuasiStaticEnergy energy = s.energy.value_or(QuasiStaticEnergy{});
    scalars.insert(scalars.end(), {s.time_s, s.imposed, s.response, energy.work_J,
                                   energy.dissipated_J, energy.stored_J});
    append(position, s.position.data(), s.position.size());
    append(viscous, s.viscous.data(), s.viscous.size());
    beside.insert(beside.end(), s.beside.begin(), s.beside.end());
  }
  file.numbers(group + "/beside", beside);
  file.numbers(group + "/scalars", scalars);
  file.numbers(group + "/position_m", position);
  file.numbers(group + "/viscous_m", viscous);
}

/// Reads lists whose lengths are known to be multiples of a number; 0 stands for any but empty.
class ListReader {
 public:
  ListReader(const Hdf5Reader& file, const fs::path& path) : file_(file), path_(path) {}

  [[nodiscard]] std::vector<double> list(const std::string& name, std::size_t multiple) const {
    std::vector<double> values = file_.numbers(name);
    if (!std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); })) {
      throw bad_input(path_.string(), fmt::format("{} holds a number that is not finite", name),
                      kExpected);
    }
    if (multiple == 0 ? !values.empty() : values.size() % multiple == 0) return values;
    throw bad_input(path_.string(), fmt::format("{} has {} numbers", name, values.size()),
                    kExpected);
  }

  /// A count or a number of a sphere, which is stored as the others are.
  [[nodiscard]] std::size_t whole(double value, const char* what) const {
    constexpr double kMost = 1e9;
    if (value >= 0.0 && value <= kMost && value == std::floor(value)) {
      return static_cast<std::size_t>(value);
    }
    throw bad_input(path_.string(), fmt::format("says {} for {}", value, what), kExpected);
  }

  [[nodiscard]] std::vector<QuasiStaticState> states(const std::string& group, std::size_t spheres,
                                                     std::size_t bonds,
                                                     std::size_t branches) const {
    const std::vector<double> scalars = list(group + "/scalars", 6);
    const std::size_t count = scalars.size() / 6;
    const std::vector<double> position = list(group + "/position_m", 3 * spheres);
    const std::size_t of_state = bonds * branches;
    const std::vector<double> viscous = list(group + "/viscous_m", of_state);
    if (position.size() != 3 * spheres * count || viscous.size() != of_state * count) {
      throw bad_input(path_.string(), fmt::format("{} is not whole", group), kExpected);
    }
    const std::vector<double> beside = list(group + "/beside", 1);
    const std::size_t groups = count > 0 ? beside.size() / count : 0;
    if (beside.size() != groups * count) {
      throw bad_input(path_.string(), fmt::format("{} is not whole", group), kExpected);
    }
    std::vector<QuasiStaticState> states(count);
    for (std::size_t i = 0; i < count; ++i) {
      const double* s = &scalars[6 * i];
      states[i] = {s[0], s[1], s[2], {}, {}, QuasiStaticEnergy{s[3], s[4], s[5]}, {}};
      const auto first = beside.begin() + static_cast<std::ptrdiff_t>(groups * i);
      states[i].beside.assign(first, first + static_cast<std::ptrdiff_t>(groups));
      states[i].position = Eigen::Map<const Positions>(position.data() + 3 * spheres * i, 3,
                                                       static_cast<Eigen::Index>(spheres));
      states[i].viscous = Eigen::Map<const Eigen::MatrixXd>(viscous.data() + of_state * i,
                                                            static_cast<Eigen::Index>(bonds),
                                                            static_cast<Eigen::Index>(branches));
    }
    return states;
  }

 private:
  const Hdf5Reader& file_;
  const fs::path& path_;
};

std::string breach_name(std::size_t limit) {
  return fmt::format("/validity/{}", key_of(static_cast<ValidityLimit>(limit)));
}

void write_validity(Hdf5Writer& file, const Validity& validity) {
  file.numbers("/validity/largest", {validity.deepest_m, validity.most_turned_rad});
  for (std::size_t k = 0; k < kValidityLimits; ++k) {
    const ValidityBreach& breach = validity.breach[k];
    // The time, then the spheres; nothing if the limit is kept.
    std::vector<double> values;
    if (breach.first_time_s) values.push_back(*breach.first_time_s);
    values.insert(values.end(), breach.spheres.begin(), breach.spheres.end());
    file.numbers(breach_name(k), values);
  }
}

Validity read_validity(const ListReader& file) {
  Validity validity;
  const std::vector<double> largest = file.list("/validity/largest", 2);
  validity.deepest_m = largest.at(0);
  validity.most_turned_rad = largest.at(1);
  for (std::size_t k = 0; k < kValidityLimits; ++k) {
    const std::vector<double> values = file.list(breach_name(k), 1);
    if (values.empty()) continue;
    validity.breach[k].first_time_s = values.front();
    for (std::size_t i = 1; i < values.size(); ++i) {
      validity.breach[k].spheres.push_back(file.whole(values[i], "a sphere"));
    }
  }
  return validity;
}

void write_motion(Hdf5Writer& file, const InertialState& s, const InertialEnergy& e) {
  file.numbers("/motion/state", {s.motion.begin(), s.motion.end()});
  file.numbers("/motion/scalars", {s.time_s, s.spent_J[0], s.spent_J[1], s.spent_J[2], s.spent_J[3],
                                   s.impact_work_J, s.stored_at_start_J, s.settled_s});
  file.numbers("/motion/energy",
               {e.work, e.stored, e.kinetic, e.bond_heat, e.damping_heat, e.contact_heat});
}

void write_impacts(Hdf5Writer& file, const std::vector<ProbeImpact>& impacts) {
  std::vector<double> numbers;
  for (const ProbeImpact& b : impacts) {
    numbers.insert(numbers.end(), {b.time_s, b.impulse_N_s, b.impulse_on_tissue_N_s});
  }
  file.numbers("/motion/impacts", numbers);
}

void write_pushes(Hdf5Writer& file, const std::vector<Eigen::VectorXd>& pushes) {
  std::vector<double> numbers;
  for (const Eigen::VectorXd& push : pushes) append(numbers, push.data(), push.size());
  file.numbers("/motion/contact_pushes_N", numbers);
}

/// Those of each output.
std::vector<Eigen::VectorXd> read_pushes(const ListReader& file, std::size_t outputs) {
  if (outputs == 0) return {};
  const std::vector<double> numbers = file.list("/motion/contact_pushes_N", outputs);
  const std::size_t contacts = numbers.size() / outputs;
  std::vector<Eigen::VectorXd> pushes;
  for (std::size_t i = 0; i < outputs; ++i) {
    pushes.emplace_back(Eigen::Map<const Eigen::VectorXd>(numbers.data() + contacts * i,
                                                          static_cast<Eigen::Index>(contacts)));
  }
  return pushes;
}

void read_motion(const ListReader& file, Checkpoint& checkpoint) {
  const std::vector<double> state = file.list("/motion/state", 0);
  const std::vector<double> s = file.list("/motion/scalars", 8);
  const std::vector<double> e = file.list("/motion/energy", 6);
  checkpoint.motion = InertialState{
      s.at(0),
      Eigen::Map<const Eigen::VectorXd>(state.data(), static_cast<Eigen::Index>(state.size())),
      {s.at(1), s.at(2), s.at(3), s.at(4)},
      s.at(5),
      s.at(6),
      s.at(7)};
  checkpoint.record.inertial_energy =
      InertialEnergy{e.at(0), e.at(1), e.at(2), e.at(3), e.at(4), e.at(5)};
  const std::vector<double> impacts = file.list("/motion/impacts", 3);
  for (std::size_t i = 0; i + 3 <= impacts.size(); i += 3) {
    checkpoint.record.impacts.push_back({impacts[i], impacts[i + 1], impacts[i + 2]});
  }
}

}  // namespace

std::string checkpoint_identity(const ExperimentScene& scene) {
  const Positions& at = scene.tissue.network.organ.position;
  std::string bytes =
      fmt::format("{}\n{}\n{}\n", version(), scene.formulation.mass_spring, scene.text);
  bytes.append(reinterpret_cast<const char*>(at.data()),
               sizeof(double) * static_cast<std::size_t>(at.size()));
  // Content of files beside the scene: motions of contacts.
  for (const SceneContact& contact : scene.contacts) {
    if (!contact.protocol) continue;
    const auto knots = contact.protocol->knots();
    bytes.append(reinterpret_cast<const char*>(knots.data()), knots.size_bytes());
  }
  return sha256_hex(bytes);
}

void write_checkpoint(const fs::path& path, const std::string& identity,
                      const Checkpoint& checkpoint) {
  const SimulationRecord& record = checkpoint.record;
  const QuasiStaticState& latest = checkpoint.latest;
  Hdf5Writer file(path);
  file.attribute("/", "checkpoint_of", identity);
  file.numbers("/spheres", {static_cast<double>(latest.position.cols())});
  file.numbers("/bonds", {static_cast<double>(latest.viscous.rows())});
  file.numbers("/branches", {static_cast<double>(latest.viscous.cols())});
  std::vector<double> curve, beside;
  for (const CurvePoint& p : record.curve) {
    beside.insert(beside.end(), p.beside.begin(), p.beside.end());
    curve.insert(curve.end(),
                 {p.time_s, p.imposed, p.response, p.energy.work_J, p.energy.dissipated_J,
                  p.energy.stored_J, static_cast<double>(p.touching), p.overlap_m,
                  p.force_on_tissue_N, p.between ? 1.0 : 0.0, p.settling ? 1.0 : 0.0});
  }
  file.numbers("/curve", curve);
  file.numbers("/curve_beside", beside);
  file.numbers("/error_estimate", {record.error_estimate});
  write_states(file, "/outputs", record.outputs);
  write_states(file, "/latest", {&latest, 1});
  write_validity(file, record.validity);
  if (checkpoint.motion) {
    write_motion(file, *checkpoint.motion, record.inertial_energy.value());
    write_impacts(file, record.impacts);
    write_pushes(file, record.contact_pushes_N);
  }
  file.commit();
}

std::optional<Checkpoint> read_checkpoint(const fs::path& path, const std::string& identity,
                                          const std::function<void(const std::string&)>& note) {
  if (!fs::exists(path)) return std::nullopt;
  const Hdf5Reader file(path);
  if (!file.has_attribute("/", "checkpoint_of")) {
    throw bad_input(path.string(), "is no checkpoint", kExpected);
  }
  if (file.attribute("/", "checkpoint_of") != identity) {
    if (note) {
      note(fmt::format("{}: of another scene or another version of tpm; starting anew",
                       path.string()));
    }
    return std::nullopt;
  }
  if (!file.has_checksum()) {
    throw bad_input(path.string(), "is damaged: it has no check sum", kExpected);
  }
  const ListReader lists(file, path);
  const std::size_t spheres = lists.whole(lists.list("/spheres", 0).front(), "the spheres");
  const std::size_t bonds = lists.whole(lists.list("/bonds", 0).front(), "the bonds");
  const std::size_t branches = lists.whole(lists.list("/branches", 0).front(), "the branches");
  Checkpoint checkpoint;
  constexpr std::size_t kColumns = 11;
  const std::vector<double> curve = lists.list("/curve", kColumns);
  const std::vector<double> beside = lists.list("/curve_beside", 1);
  const std::size_t points = curve.size() / kColumns;
  const std::size_t groups = points > 0 ? beside.size() / points : 0;
  for (std::size_t i = 0; i + kColumns <= curve.size(); i += kColumns) {
    const double* p = &curve[i];
    const auto own = beside.begin() + static_cast<std::ptrdiff_t>(groups * (i / kColumns));
    checkpoint.record.curve.push_back({p[0],
                                       p[1],
                                       p[2],
                                       {p[3], p[4], p[5]},
                                       static_cast<int>(lists.whole(p[6], "the tools that touch")),
                                       p[7],
                                       p[8],
                                       {own, own + static_cast<std::ptrdiff_t>(groups)},
                                       p[9] != 0.0,
                                       p[10] != 0.0});
  }
  checkpoint.record.outputs = lists.states("/outputs", spheres, bonds, branches);
  checkpoint.record.validity = read_validity(lists);
  checkpoint.record.error_estimate = lists.list("/error_estimate", 0).front();
  std::vector<QuasiStaticState> latest = lists.states("/latest", spheres, bonds, branches);
  if (latest.size() != 1) throw bad_input(path.string(), "holds no state", kExpected);
  checkpoint.latest = std::move(latest.front());
  checkpoint.record.contact_pushes_N.resize(checkpoint.record.outputs.size());
  if (file.has("/motion")) {
    read_motion(lists, checkpoint);
    checkpoint.record.contact_pushes_N = read_pushes(lists, checkpoint.record.outputs.size());
  }
  return checkpoint;
}

}  // namespace tpm::organ
