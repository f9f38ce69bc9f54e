#include "tpm/organ/balance/probes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

/// The value that a history comes to a time with, before it jumps there.
double value_before(const Protocol& protocol, double time_s) {
  const auto knots = protocol.knots();
  const auto next = std::lower_bound(knots.begin(), knots.end(), time_s,
                                     [](const Knot& knot, double t) { return knot.time_s < t; });
  if (next == knots.end()) return knots.back().value;
  if (next == knots.begin() || next->time_s == time_s) return next->value;
  const Knot& last = *std::prev(next);
  return last.value +
         (next->value - last.value) * (time_s - last.time_s) / (next->time_s - last.time_s);
}

}  // namespace

Probes::Probes(std::vector<Probe> all, Loading loading)
    : all_(std::move(all)), loading_(std::move(loading)) {
  if (all_.empty()) throw bad_input("probe", "there is none", "a sphere or a tool to be driven");
}

void require_valid(const Probe& probe, const Constraints& constraints) {
  if (!(probe.share > 0.0 && std::isfinite(probe.share))) {
    throw bad_input("probe", fmt::format("a share of {}", shortest(probe.share)), "above 0");
  }
  if (probe.sphere >= constraints.size()) {
    throw bad_input("probe", fmt::format("sphere {}", probe.sphere + 1),
                    fmt::format("a sphere from 1 to {}", constraints.size()));
  }
  const Eigen::Vector3d free = constraints.projector(probe.sphere) * probe.direction;
  if (std::abs(free.norm() - 1.0) > 1e-9) {
    throw bad_input("probe", fmt::format("sphere {} is fixed", probe.sphere + 1),
                    "a sphere that is free to move along the direction of the probe");
  }
}

void require_valid(const Probes& probes, const Constraints& constraints) {
  std::set<std::size_t> driven;
  const auto require = [&](const Probe& probe) {
    require_valid(probe, constraints);
    if (driven.insert(probe.sphere).second) return;
    throw bad_input("probe", fmt::format("sphere {} is driven twice", probe.sphere + 1),
                    "each sphere once");
  };
  for (const Probe& probe : probes) require(probe);
  for (const DriveGroup& group : probes.loading().beside) {
    for (const Probe& probe : group.probes) require(probe);
  }
}

ImposedPath::ImposedPath(const Protocol& first, std::span<const DriveGroup> beside)
    : drives_{first.drive()} {
  const double start_s = first.start_s();
  const double end_s = first.knots().back().time_s;
  if (beside.empty()) {
    knots_.assign(first.knots().begin(), first.knots().end());
    return;
  }
  std::vector<const Protocol*> all{&first};
  for (const DriveGroup& group : beside) {
    all.push_back(&group.protocol);
    drives_.push_back(group.protocol.drive());
  }
  std::vector<double> times;
  for (const Protocol* protocol : all) {
    if (protocol->start_s() != start_s) {
      throw bad_input(
          protocol->name(), fmt::format("begins at {} s", shortest(protocol->start_s())),
          fmt::format("{} s, where the first contact's protocol begins", shortest(start_s)));
    }
    if (protocol->equilibrium_at_start()) {
      throw bad_input(protocol->name(), "begins in equilibrium beside another protocol",
                      "a start from rest");
    }
    for (const Knot& knot : protocol->knots()) {
      if (knot.time_s <= end_s) times.push_back(knot.time_s);
    }
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  values_.resize(all.size());
  const auto add = [&](double time_s, const std::vector<double>& value) {
    knots_.push_back({time_s, static_cast<double>(knots_.size())});
    for (std::size_t g = 0; g < value.size(); ++g) values_[g].push_back(value[g]);
  };
  // From nothing imposed on.
  add(start_s, std::vector<double>(all.size(), 0.0));
  for (const double time_s : times) {
    std::vector<double> before, after;
    for (const Protocol* protocol : all) {
      before.push_back(value_before(*protocol, time_s));
      after.push_back(value_at(*protocol, time_s));
    }
    const bool begins = time_s == start_s;
    if (!begins) add(time_s, before);
    const bool jumps =
        begins ? std::any_of(after.begin(), after.end(), [](double value) { return value != 0.0; })
               : before != after;
    if (jumps) add(time_s, after);
  }
}

std::size_t ImposedPath::piece(double at) const {
  const double last = static_cast<double>(knots_.size()) - 2.0;
  return static_cast<std::size_t>(std::clamp(std::floor(at), 0.0, std::max(last, 0.0)));
}

double ImposedPath::interpolated(std::size_t group, double at) const {
  const std::vector<double>& values = values_[group];
  if (values.size() < 2) return values.front();
  const std::size_t k = piece(at);
  const double along = at - static_cast<double>(k);
  return along >= 1.0 ? values[k + 1] : values[k] + along * (values[k + 1] - values[k]);
}

double ImposedPath::slope_of_piece(std::size_t group, double at) const {
  const std::vector<double>& values = values_[group];
  if (values.size() < 2) return 0.0;
  const std::size_t k = piece(at);
  return values[k + 1] - values[k];
}

double ImposedPath::peak(std::size_t group) const {
  double most = 0.0;
  for (const double value : values_[group]) most = std::max(most, std::abs(value));
  return most;
}

double ImposedPath::coordinate_at(double time_s) const {
  const auto next = std::upper_bound(knots_.begin(), knots_.end(), time_s,
                                     [](double t, const Knot& knot) { return t < knot.time_s; });
  if (next == knots_.begin()) return knots_.front().value;
  const Knot& last = *std::prev(next);
  if (next == knots_.end()) return last.value;
  return last.value + (time_s - last.time_s) / (next->time_s - last.time_s);
}

}  // namespace tpm::organ
