#include "tpm/organ/run/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/text.hpp"
#include "tpm/organ/run/checkpoint.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr int kWatched = 200;  // parts of the protocol's time

/// The times with those twice at which the rate of what is imposed changes while spheres have mass:
/// the probe's own drag jumps there, and either side may have the largest response.
std::vector<double> with_both_sides(std::vector<double> times, const ExperimentScene& scene) {
  if (!scene.formulation.masses) return times;
  const Protocol& protocol = scene.protocol;
  for (const Knot& knot : protocol.knots()) {
    if (knot.time_s <= protocol.start_s() || knot.time_s >= protocol.end_s()) continue;
    const auto at = std::lower_bound(times.begin(), times.end(), knot.time_s);
    const bool twice = std::next(at) != times.end() && *std::next(at) == knot.time_s;
    if (!twice) times.insert(at, knot.time_s);
  }
  return times;
}

}  // namespace

std::vector<double> times_to_watch(const ExperimentScene& scene) {
  const Protocol& protocol = scene.protocol;
  std::vector<double> times = scene.outputs.times_s;
  const double length = protocol.end_s() - protocol.start_s();
  for (int i = 0; i < kWatched; ++i) times.push_back(protocol.start_s() + length * i / kWatched);
  for (const Knot& knot : protocol.knots()) times.push_back(knot.time_s);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

Recorder::Recorder(const ExperimentScene& scene, const RunNetwork& network,
                   const SimulationControls& controls, std::size_t parts)
    : scene_(scene),
      network_(network),
      controls_(controls),
      parts_(parts),
      identity_(checkpoint_identity(scene)),
      watch_(scene),
      times_(with_both_sides(times_to_watch(scene), scene)),
      saved_(Clock::now()) {}

bool Recorder::restore() {
  if (controls_.checkpoint.empty()) return false;
  auto found = read_checkpoint(controls_.checkpoint, identity_, controls_.note);
  if (!found) return false;
  record_ = std::move(found->record);
  watch_.restore(record_.validity);
  whole_ = {record_.curve.size(), record_.outputs.size(), record_.validity,
            std::move(found->latest), std::move(found->motion)};
  return true;
}

std::span<const double> Recorder::next_part() const {
  const std::size_t length = (times_.size() + parts_ - 1) / parts_;
  const std::size_t begin = std::min(record_.curve.size(), times_.size());
  std::size_t end = std::min((begin / length + 1) * length, times_.size());
  // As long as nothing has been imposed there is no scale for the tolerance to refer to.
  const auto still = [&] { return history_until(scene_.protocol, times_[end - 1]).peak() == 0.0; };
  while (end > begin && end < times_.size() && still()) end = std::min(end + length, times_.size());
  // A part that ended at a corner would know one side of it only.
  const auto at_corner = [&] {
    return times_[end] == times_[end - 1] || (end > 1 && times_[end - 2] == times_[end - 1]);
  };
  while (end > begin && end < times_.size() && at_corner()) ++end;
  return std::span(times_).subspan(begin, end - begin);
}

void Recorder::see(const QuasiStaticState& state, const Eigen::VectorXd& contact_push_N) {
  require_within(state);
  require_expected_contacts(network_.driven, state.position, network_.network.organ.radius,
                            state.time_s);
  CurvePoint point{state.time_s, state.imposed, state.response,
                   state.energy.value_or(QuasiStaticEnergy{})};
  const auto tools = tool_states(network_.driven, state.position, contact_push_N);
  for (const ToolState& tool : tools) {
    point.touching += tool.touching;
    point.overlap_m = std::max(point.overlap_m, tool.overlap_m);
  }
  point.force_on_tissue_N = force_on_tissue_N(network_.driven, tools, scene_.protocol.drive(),
                                              state.imposed, state.response);
  point.beside = state.beside;
  record_.curve.push_back(point);
  const std::vector<double>& wanted = scene_.outputs.times_s;
  if (std::binary_search(wanted.begin(), wanted.end(), state.time_s)) {
    // The second side of a corner: states are continuous, and the later response is stored.
    if (!record_.outputs.empty() && record_.outputs.back().time_s == state.time_s) {
      record_.outputs.pop_back();
      record_.contact_pushes_N.pop_back();
    }
    record_.outputs.push_back(state);
    record_.contact_pushes_N.push_back(contact_push_N);
  }
  watch_.see(state.time_s, network_.spheres(state.position));
  record_.validity = watch_.seen();
  seen_ = state;
  if (controls_.progress) controls_.progress(record_.curve.size(), times_.size());
  if (controls_.interrupted && controls_.interrupted()) stop(state.time_s);
}

/// Linear springs carry any load, somewhere.
void Recorder::require_within(const QuasiStaticState& state) const {
  if (scene_.protocol.drive() == Drive::displacement) return;
  const double room = tissue_behind_m(scene_.tissue.network.organ, scene_.probe());
  if (state.response < room) return;
  throw Error(ExitCode::numerical, "network",
              fmt::format("at t = {} s a load of {} N is {} mm deep, through the {} mm of tissue "
                          "behind sphere {}",
                          significant(state.time_s, 5), significant(state.imposed, 4),
                          significant(1e3 * state.response, 4), significant(1e3 * room, 4),
                          scene_.probe().sphere + 1));
}

void Recorder::close_part(double error_estimate) {
  record_.error_estimate += error_estimate;
  close();
}

void Recorder::close_part(InertialState motion, const InertialEnergy& energy,
                          const std::vector<ProbeImpact>& impacts) {
  record_.impacts.insert(record_.impacts.end(), impacts.begin(), impacts.end());
  record_.inertial_energy = energy;
  whole_.motion = std::move(motion);
  close();
}

void Recorder::close() {
  whole_.curve = record_.curve.size();
  whole_.outputs = record_.outputs.size();
  whole_.validity = record_.validity;
  whole_.state = seen_;
  const std::chrono::duration<double> since = Clock::now() - saved_;
  if (since.count() >= controls_.checkpoint_every_s) save();
}

void Recorder::save() {
  if (controls_.checkpoint.empty() || whole_.curve == 0) return;
  write_checkpoint(controls_.checkpoint, identity_, {record_, whole_.state, whole_.motion});
  saved_ = Clock::now();
}

void Recorder::stop(double time_s) {
  record_.curve.resize(whole_.curve);
  record_.outputs.resize(whole_.outputs);
  record_.contact_pushes_N.resize(whole_.outputs);
  record_.validity = whole_.validity;
  save();
  const bool saved = !controls_.checkpoint.empty() && whole_.curve > 0;
  throw Interrupted(fmt::format(
      "interrupted at t = {} s of {} s; {}", significant(time_s, 4),
      significant(scene_.protocol.end_s(), 4),
      saved ? fmt::format("the same command resumes from t = {} s ({})",
                          significant(whole_.state.time_s, 4), controls_.checkpoint.string())
            : std::string("there is no checkpoint to resume from")));
}

PartOfProtocol::PartOfProtocol(const ExperimentScene& scene, double end_s)
    : protocol(history_until(scene.protocol, end_s)), tolerance(scene.formulation.tolerance) {
  if (protocol.peak() > 0.0) tolerance *= scene.protocol.peak() / protocol.peak();
  tolerance = std::min(tolerance, 0.1);
}

}  // namespace tpm::organ
