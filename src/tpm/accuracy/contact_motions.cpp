#include "tpm/accuracy/contact_motions.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"
#include "tpm/base/text.hpp"

namespace tpm::accuracy {
namespace {

constexpr double kPressing_m_per_s = 0.020;
constexpr double kSlowest_m_per_s = 1e-3;
constexpr double kFastest_over_slowest = 100.0;

Eigen::Index periods(double time_s, double period_s) {
  return std::max<Eigen::Index>(1, std::llround(time_s / period_s));
}

double random_speed_m_per_s(Random& random) {
  return kSlowest_m_per_s * std::pow(kFastest_over_slowest, random.uniform());
}

/// Straight pieces at given speeds.
class Path {
 public:
  explicit Path(double period_s) : period_s_(period_s) {}

  void go_to(const Eigen::Vector3d& place, double speed_m_per_s) {
    const Eigen::Vector3d from = place_;
    const Eigen::Index count = periods((place - from).norm() / speed_m_per_s, period_s_);
    for (Eigen::Index i = 1; i <= count; ++i) {
      const double done = static_cast<double>(i) / static_cast<double>(count);
      put(from + done * (place - from));
    }
  }
  void hold(double time_s) {
    for (Eigen::Index i = periods(time_s, period_s_); i-- > 0;) put(place_);
  }
  void put(const Eigen::Vector3d& place) {
    place_ = place;
    places_.push_back(place);
  }
  [[nodiscard]] const Eigen::Vector3d& place() const { return place_; }
  [[nodiscard]] Eigen::Index steps() const { return static_cast<Eigen::Index>(places_.size()); }

  [[nodiscard]] ContactMotion motion(std::string name) const {
    ContactMotion motion;
    motion.name = std::move(name);
    motion.period_s = period_s_;
    motion.displacement_m.resize(3, steps());
    for (Eigen::Index i = 0; i < steps(); ++i) {
      motion.displacement_m.col(i) = places_[static_cast<std::size_t>(i)];
    }
    return motion;
  }

 private:
  double period_s_;
  Eigen::Vector3d place_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> places_;
};

/// Depths along a line, by knots at whole periods.
ContactMotion along_line(std::string name, const Eigen::Vector3d& direction,
                         const std::vector<std::pair<Eigen::Index, double>>& knots,
                         double period_s) {
  ContactMotion motion;
  motion.name = std::move(name);
  motion.period_s = period_s;
  motion.direction = direction;
  motion.displacement_m.resize(3, knots.back().first);
  std::vector<Knot> history;
  for (std::size_t k = 0; k < knots.size(); ++k) {
    const auto [at, depth] = knots[k];
    history.push_back({static_cast<double>(at) * period_s, depth});
    if (k == 0) continue;
    const auto [from, before] = knots[k - 1];
    for (Eigen::Index i = from; i < at; ++i) {
      const double done = static_cast<double>(i + 1 - from) / static_cast<double>(at - from);
      motion.displacement_m.col(i) = (before + done * (depth - before)) * direction;
    }
  }
  motion.line = Protocol(Drive::displacement, std::move(history), motion.name);
  return motion;
}

std::string speed_words(double speed_m_per_s) {
  return significant(1e3 * speed_m_per_s, 3) + " mm/s";
}

}  // namespace

ContactAxes contact_axes(const Eigen::Vector3d& into) {
  Eigen::Index least = 0;
  into.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3d first = into.cross(Eigen::Vector3d::Unit(least)).normalized();
  return {into, first, into.cross(first)};
}

ContactMotion ramp_motion(const Eigen::Vector3d& direction, double depth_m, double speed_m_per_s,
                          double hold_s, double period_s) {
  const Eigen::Index up = periods(depth_m / speed_m_per_s, period_s);
  return along_line("ramp at " + speed_words(speed_m_per_s), direction,
                    {{0, 0.0}, {up, depth_m}, {up + periods(hold_s, period_s), depth_m}}, period_s);
}

ContactMotion poke_motion(const Eigen::Vector3d& direction, double depth_m, double speed_m_per_s,
                          double hold_s, double period_s) {
  const Eigen::Index way = periods(depth_m / speed_m_per_s, period_s);
  const Eigen::Index hold = periods(hold_s, period_s);
  return along_line("poke at " + speed_words(speed_m_per_s), direction,
                    {{0, 0.0},
                     {way, depth_m},
                     {way + hold, depth_m},
                     {2 * way + hold, 0.0},
                     {2 * (way + hold), 0.0}},
                    period_s);
}

ContactMotion random_motion(const Eigen::Vector3d& direction, double deepest_m, double duration_s,
                            std::uint64_t seed, double period_s) {
  Random random(seed);
  std::vector<std::pair<Eigen::Index, double>> knots{{0, 0.0}};
  const Eigen::Index end = periods(duration_s, period_s);
  while (knots.back().first < end) {
    const auto [at, depth] = knots.back();
    const double next = deepest_m * random.uniform();
    const double way = std::abs(next - depth);
    knots.emplace_back(at + periods(way / random_speed_m_per_s(random), period_s), next);
    if (random.uniform() > 0.3) continue;
    knots.emplace_back(knots.back().first + periods(0.1 * random.uniform(), period_s), next);
  }
  return along_line("random probing", direction, knots, period_s);
}

ContactMotion sideways_motion(const ContactAxes& axes, double depth_m, double aside_m,
                              double speed_m_per_s, double period_s) {
  Path path(period_s);
  const Eigen::Vector3d pressed = depth_m * axes.into;
  path.go_to(pressed, kPressing_m_per_s);
  path.go_to(pressed + aside_m * axes.first, speed_m_per_s);
  path.hold(0.1);
  path.go_to(pressed - aside_m * axes.first, speed_m_per_s);
  path.hold(0.1);
  return path.motion("sideways at " + speed_words(speed_m_per_s));
}

ContactMotion circling_motion(const ContactAxes& axes, double depth_m, double radius_m,
                              double turns_per_s, double turns, double period_s) {
  Path path(period_s);
  const Eigen::Vector3d pressed = depth_m * axes.into;
  path.go_to(pressed, kPressing_m_per_s);
  path.go_to(pressed + radius_m * axes.first, 0.050);
  const Eigen::Index count = periods(turns / turns_per_s, period_s);
  for (Eigen::Index i = 1; i <= count; ++i) {
    const double angle = 2.0 * std::numbers::pi * turns_per_s * period_s * static_cast<double>(i);
    path.put(pressed + radius_m * (std::cos(angle) * axes.first + std::sin(angle) * axes.second));
  }
  return path.motion(fmt::format("circles at {} Hz", significant(turns_per_s, 3)));
}

ContactMotion random_motion_in_space(const ContactAxes& axes, double deepest_m, double aside_m,
                                     Eigen::Index steps, std::uint64_t seed, double period_s) {
  Random random(seed);
  Path path(period_s);
  const auto place = [&](double depth, double radius, double angle) -> Eigen::Vector3d {
    return depth * axes.into +
           radius * (std::cos(angle) * axes.first + std::sin(angle) * axes.second);
  };
  while (path.steps() < steps) {
    const double depth = deepest_m * random.uniform();
    const double radius = aside_m * std::sqrt(random.uniform());
    double angle = 2.0 * std::numbers::pi * random.uniform();
    path.go_to(place(depth, radius, angle), random_speed_m_per_s(random));
    if (random.uniform() > 0.3 || radius < 0.1 * aside_m) continue;
    const double speed = random_speed_m_per_s(random);
    const double turn = speed * period_s / radius;
    const double way = 6.0 * std::numbers::pi * random.uniform();
    const Eigen::Index count = std::min<Eigen::Index>(steps, static_cast<Eigen::Index>(way / turn));
    for (Eigen::Index i = 0; i < count; ++i) path.put(place(depth, radius, angle += turn));
  }
  ContactMotion motion = path.motion("random motion in space");
  motion.displacement_m.conservativeResize(Eigen::NoChange, steps);
  return motion;
}

ContactMotion refined(ContactMotion motion, int pieces) {
  Eigen::Matrix3Xd places(3, pieces * motion.steps());
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    const Eigen::Index whole = i / pieces;
    const Eigen::Vector3d to = motion.displacement_m.col(whole);
    const double share = static_cast<double>(i % pieces + 1) / pieces;
    places.col(i) = share < 1.0 ? Eigen::Vector3d(from + share * (to - from)) : to;
    if (share == 1.0) from = to;
  }
  motion.displacement_m = std::move(places);
  motion.period_s /= pieces;
  return motion;
}

}  // namespace tpm::accuracy
