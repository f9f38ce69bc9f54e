#include "tpm/organ/run/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/text.hpp"
#include "tpm/organ/run/checkpoint.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr int kWatched = 200;  // parts of the protocol's time

/// Corners of every contact's protocol, within the time of the scene's.
std::vector<double> corners_s(const ExperimentScene& scene) {
  const Protocol& protocol = scene.protocol;
  std::vector<double> times;
  const auto add = [&](const Protocol& of) {
    for (const Knot& knot : of.knots()) {
      if (knot.time_s >= protocol.start_s() && knot.time_s <= protocol.knots().back().time_s) {
        times.push_back(knot.time_s);
      }
    }
  };
  add(protocol);
  for (const SceneContact& contact : scene.contacts) {
    if (contact.protocol) add(*contact.protocol);
  }
  return times;
}

/// The times with those twice at which the rate of what is imposed changes while spheres have mass:
/// the probe's own drag jumps there, and either side may have the largest response.
std::vector<double> with_both_sides(std::vector<double> times, const ExperimentScene& scene) {
  if (!scene.formulation.masses) return times;
  for (const double time : corners_s(scene)) {
    if (time <= scene.protocol.start_s() || time >= scene.protocol.end_s()) continue;
    const auto at = std::lower_bound(times.begin(), times.end(), time);
    const bool twice = std::next(at) != times.end() && *std::next(at) == time;
    if (!twice) times.insert(at, time);
  }
  return times;
}

std::vector<double> sorted_once(std::vector<double> times) {
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

/// Even parts of the protocol and corners.
std::vector<double> times_without_outputs(const ExperimentScene& scene) {
  const Protocol& protocol = scene.protocol;
  std::vector<double> times = corners_s(scene);
  const double length = protocol.end_s() - protocol.start_s();
  for (int i = 0; i < kWatched; ++i) times.push_back(protocol.start_s() + length * i / kWatched);
  return sorted_once(std::move(times));
}

/// Where parts end. The integrator begins afresh there, so outputs must not move them.
std::vector<double> part_ends_s(const ExperimentScene& scene, std::size_t parts) {
  const std::vector<double> times = times_without_outputs(scene);
  const std::vector<double> corners = sorted_once(corners_s(scene));
  const std::size_t length = (times.size() + parts - 1) / parts;
  // As long as nothing has been imposed there is no scale for the tolerance to refer to.
  const auto is_still = [&](double time_s) {
    return history_until(scene.protocol, time_s).peak() == 0.0;
  };
  // A part that ended at a corner would know one side of it only.
  const auto is_corner = [&](double time_s) {
    return scene.formulation.masses && std::binary_search(corners.begin(), corners.end(), time_s);
  };
  std::vector<double> ends;
  for (std::size_t i = length - 1; i + 1 < times.size(); i += length) {
    while (i + 1 < times.size() && is_corner(times[i])) ++i;
    if (i + 1 < times.size() && !is_still(times[i])) ends.push_back(times[i]);
  }
  ends.push_back(times.back());
  return ends;
}

}  // namespace

std::vector<double> times_to_watch(const ExperimentScene& scene) {
  std::vector<double> times = times_without_outputs(scene);
  times.insert(times.end(), scene.outputs.times_s.begin(), scene.outputs.times_s.end());
  return sorted_once(std::move(times));
}

Recorder::Recorder(const ExperimentScene& scene, const RunNetwork& network,
                   const SimulationControls& controls, std::size_t parts)
    : scene_(scene),
      network_(network),
      controls_(controls),
      identity_(checkpoint_identity(scene)),
      watch_(scene),
      times_(with_both_sides(times_to_watch(scene), scene)),
      part_ends_s_(part_ends_s(scene, parts)),
      saved_(Clock::now()) {}

bool Recorder::restore() {
  if (controls_.checkpoint.empty()) return false;
  auto found = read_checkpoint(controls_.checkpoint, identity_, controls_.note);
  if (!found) return false;
  record_ = std::move(found->record);
  watch_.restore(record_.validity);
  for (const CurvePoint& point : record_.curve) {
    extremes_.see(point);
    watched_ += point.between ? 0U : 1U;
  }
  whole_ = {record_.curve.size(), record_.outputs.size(),   watched_,
            record_.validity,     std::move(found->latest), std::move(found->motion)};
  return true;
}

std::span<const double> Recorder::next_part() const {
  const std::size_t begin = std::min(watched_, times_.size());
  if (begin == times_.size()) return {};
  const auto end_s =
      begin == 0 ? part_ends_s_.begin()
                 : std::upper_bound(part_ends_s_.begin(), part_ends_s_.end(), times_[begin - 1]);
  const auto end = std::upper_bound(times_.begin(), times_.end(), *end_s) - times_.begin();
  return std::span(times_).subspan(begin, static_cast<std::size_t>(end) - begin);
}

CurvePoint Recorder::point_of(const QuasiStaticState& state,
                              const Eigen::VectorXd& contact_push_N) const {
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
  point.between = state.between;
  point.settling = state.settling;
  return point;
}

void Recorder::see(const QuasiStaticState& state, const Eigen::VectorXd& contact_push_N) {
  require_within(state);
  require_expected_contacts(network_.driven, state.position, network_.network.organ.radius,
                            state.time_s);
  CurvePoint point = point_of(state, contact_push_N);
  if (state.between && !extremes_.exceeded_by(point)) return;
  extremes_.see(point);
  record_.curve.push_back(std::move(point));
  insert_extremes();
  watch_.see(state.time_s, network_.spheres(state.position));
  record_.validity = watch_.seen();
  if (!state.between) keep(state, contact_push_N);
  if (controls_.interrupted && controls_.interrupted()) stop(state.time_s);
}

void Recorder::follow(const QuasiStaticState& step, const Eigen::VectorXd& contact_push_N) {
  for (CurvePoint& point : extremes_.step(point_of(step, contact_push_N))) {
    found_.push_back(std::move(point));
  }
}

void Recorder::corner() {
  for (CurvePoint& point : extremes_.corner()) found_.push_back(std::move(point));
}

/// Extremes wait for the next watched time, which may be theirs: a corner is watched itself.
void Recorder::insert_extremes() {
  for (CurvePoint& point : found_) {
    if (!extremes_.exceeded_by(point)) continue;
    extremes_.see(point);
    const auto part = record_.curve.begin() + static_cast<std::ptrdiff_t>(whole_.curve);
    const auto at =
        std::lower_bound(part, record_.curve.end(), point.time_s,
                         [](const CurvePoint& p, double time_s) { return p.time_s < time_s; });
    record_.curve.insert(at, std::move(point));
  }
  found_.clear();
}

/// At a watched time.
void Recorder::keep(const QuasiStaticState& state, const Eigen::VectorXd& contact_push_N) {
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
  seen_ = state;
  ++watched_;
  if (controls_.progress) controls_.progress(watched_, times_.size());
}

/// Linear springs carry any load, somewhere.
void Recorder::require_within(const QuasiStaticState& state) const {
  if (scene_.by_depth()) return;
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
  insert_extremes();
  whole_.curve = record_.curve.size();
  whole_.outputs = record_.outputs.size();
  whole_.watched = watched_;
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
