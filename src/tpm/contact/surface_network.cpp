#include "tpm/contact/surface_network.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "tpm/base/require.hpp"
#include "tpm/base/wide_vectors.hpp"
#include "tpm/contact/flush_denormals.hpp"
#include "tpm/law/relaxation/relaxation_filter.hpp"
#include "tpmkit/error.hpp"

namespace tpm::contact {
namespace {

constexpr double kNearBy_m = 0.2e-3;  // beyond the way of the ball in a period
constexpr int kMostSearches = 12;
constexpr double kPressed = 1e-7;         // of the largest force
constexpr double kLeastForce_N = 1e-10;   // that is told from none
constexpr double kHoldError = 0.7;        // from one step to the next
constexpr double kValidError = 0.02;      // over the largest force
constexpr double kForceRounding = 3e-7;   // of the largest force
constexpr double kScaleAtDepth_m = 1e-4;  // at which forces begin to count
constexpr double kStartOverlap_m = 1e-9;
constexpr double kRestLengthOff = 1e-9;
constexpr std::size_t kForceNow = 0, kForceNext = 4;

using Lanes8 [[gnu::vector_size(8 * sizeof(float))]] = float;
constexpr int kMostUnknowns = 3 * SurfaceNetwork::kMostTouched;
using PressMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostUnknowns, kMostUnknowns>;
using PressVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostUnknowns, 1>;

void require_valid(const SurfaceNetworkOptions& options, const BallTool& ball) {
  const auto positive = [](std::string_view key, double value) {
    require_number(is_positive(value), key, value, "above 0");
  };
  positive("period_s", options.period_s);
  positive("deepest_m", options.deepest_m);
  positive("balance_again_above", options.balance_again_above);
  positive("most_balances", options.most_balances);
  positive("radius_m", ball.radius_m);
  positive("stiffness_N_per_m", ball.stiffness_N_per_m);
}

void require_touching_nothing(const BallTool& ball, const Positions& rest) {
  for (Eigen::Index i = 0; i < rest.cols(); ++i) {
    const double overlap_m = ball.reach_m() - (rest.col(i) - ball.start_m).norm();
    if (overlap_m <= kStartOverlap_m) continue;
    throw bad_input("ball", fmt::format("overlaps sphere {} at its start", i + 1),
                    "a ball that touches the organ at most");
  }
}

void require_unstretched(const BondSystem& bonds, const Positions& rest) {
  Eigen::VectorXd elongation;
  bonds.elongations(rest, elongation);
  const auto limit = kRestLengthOff * bonds.rest_length_m().array();
  if (bonds.contact_count() == 0 && (elongation.cwiseAbs().array() <= limit).all()) return;
  throw bad_input("rest", "bonds do not have their rest length there, or touch tools",
                  "a tissue without tension");
}

}  // namespace

SurfaceNetwork::SurfaceNetwork(const BondSystem& bonds, const Positions& rest,
                               const Constraints& constraints, BallTool ball,
                               const SurfaceNetworkOptions& options)
    : options_(options), ball_(std::move(ball)), rest_(rest), stiffness_(bonds, constraints) {
  require_valid(options, ball_);
  require_servo_material(bonds, "the network under a ball at servo rate");
  require_unstretched(bonds, rest);
  require_touching_nothing(ball_, rest);
  weights_ = servo_weights(bonds, options.period_s);
  std::vector<ServoBonds::Choice> chosen;
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    const std::uint32_t from = bonds.end_a()[b];
    const std::uint32_t to = bonds.end_b()[b];
    if (!stiffness_.moves(from) && !stiffness_.moves(to)) continue;
    chosen.push_back({b, stiffness_.column(from), stiffness_.column(to)});
  }
  const std::size_t columns = stiffness_.columns();
  bonds_ = ServoBonds(bonds, rest, chosen, static_cast<std::uint32_t>(columns), options.portable);
  displacement_.assign(4 * (columns + 1), 0.0F);
  force_.assign(8 * (columns + 1), 0.0F);
  stride_ = 8 * ((stiffness_.free().size() + 1) / 2);
  change_.assign(stride_, 0.0F);
  const auto relaxed = static_cast<double>(weights_.of_end);
  const ViscousState viscous_state{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())),
                                   relaxed};
  if (!stiffness_.factorise(bonds, constraints, rest, viscous_state, options.portable)) {
    throw Error(ExitCode::numerical, "tissue", "it is not stiff at rest");
  }
  add_surface();
  find_stiffness(bonds, constraints);
  // An elongation that bends by b between periods lies b v (1 - v)/2 off the line, v from the end;
  // what it leaves in the viscous state is the integral of that over exp(-z v) z dv.
  const double lasting =
      instantaneous_.norm() > 0.0 ? equilibrium_.norm() / instantaneous_.norm() : 1.0;
  // Not all of a bond relaxes: all of its force is taken.
  const double z = options.period_s / bonds.longest_relaxation_time_s();
  bend_kept_ = std::exp(-lasting * z);
  bend_ = 0.0;
  for (const double time_s : bonds.relaxation_times_s()) {
    // The fastest branch leaves most: of several all are taken to be that.
    const double x = options.period_s / time_s;
    const RelaxationWeights w = relaxation_weights(x);
    bend_ = std::max(bend_, (w.w1 - w.w0) / (2.0 * x));
  }
}

void SurfaceNetwork::add_surface() {
  const std::size_t moving = stiffness_.free().size();
  fields_.assign(3 * stride_ * ball_.touchable.size(), 0.0F);
  float* field = fields_.data();
  std::vector<char> touchable(static_cast<std::size_t>(rest_.cols()), 0);
  for (const std::size_t sphere : ball_.touchable) {
    touchable[sphere] = 1;
    const std::size_t column = stiffness_.column(sphere);
    const bool moves = stiffness_.moves(sphere);
    const Eigen::Vector3d rest_m = rest_.col(static_cast<Eigen::Index>(sphere)) - ball_.start_m;
    surface_.push_back({.column = column,
                        .rest_m = rest_m,
                        .fields = moves ? field : nullptr,
                        .pushed_N = Eigen::Vector3d::Zero()});
    for (std::size_t axis = 0; moves && axis < 3; ++axis, field += stride_) {
      field[4 * column + axis] = 1.0F;
      stiffness_.solve(field);
      for (std::size_t i = 0; i < moving; ++i) field[4 * i + 3] = 0.0F;
    }
  }
  for (std::size_t sphere = 0; sphere < touchable.size(); ++sphere) {
    if (touchable[sphere] == 0) inside_.push_back(sphere);
  }
}

void SurfaceNetwork::find_stiffness(const BondSystem& bonds, const Constraints& constraints) {
  const SurfaceSphere* nearest = nullptr;
  std::size_t sphere = 0;
  for (std::size_t i = 0; i < surface_.size(); ++i) {
    if (nearest != nullptr && surface_[i].rest_m.norm() >= nearest->rest_m.norm()) continue;
    nearest = &surface_[i];
    sphere = ball_.touchable[i];
  }
  instantaneous_.setZero();
  equilibrium_.setZero();
  if (nearest == nullptr) return;
  const Eigen::Vector3d normal = nearest->rest_m.normalized();
  Equilibrium equilibrium(bonds, constraints);
  for (const double relaxation_factor : {0.0, 1.0}) {
    const ViscousState viscous_state{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())),
                                     relaxation_factor};
    Eigen::Matrix3Xd push = Eigen::Matrix3Xd::Zero(3, rest_.cols());
    push.col(static_cast<Eigen::Index>(sphere)) = normal;
    if (!equilibrium.factorise(rest_, viscous_state)) {
      throw Error(ExitCode::numerical, "tissue", "it is not stiff at rest");
    }
    equilibrium.displace(push);
    const double compliance = normal.dot(push.col(static_cast<Eigen::Index>(sphere)));
    (relaxation_factor > 0.0 ? equilibrium_ : instantaneous_) =
        normal * normal.transpose() / (compliance + 1.0 / ball_.stiffness_N_per_m);
  }
}

void SurfaceNetwork::reset() noexcept {
  bonds_.forget();
  std::fill(displacement_.begin(), displacement_.end(), 0.0F);
  std::fill(force_.begin(), force_.end(), 0.0F);
  for (SurfaceSphere& candidate : surface_) {
    candidate.pushed_N.setZero();
    candidate.before_N.setZero();
    candidate.change_N.setZero();
    candidate.linearisation_N.setZero();
  }
  ball_at_.setZero();
  largest_N_ = held_error_N_ = linear_error_N_ = 0.0;
}

Eigen::Vector3d SurfaceNetwork::displacement_of(std::size_t column) const noexcept {
  return Eigen::Map<const Eigen::Vector3f>(displacement_.data() + 4 * column).cast<double>();
}

Eigen::Vector3d SurfaceNetwork::from_ball(const SurfaceSphere& candidate) const noexcept {
  return candidate.rest_m - ball_at_ + displacement_of(candidate.column);
}

Eigen::Matrix3d SurfaceNetwork::compliance(const SurfaceSphere& of,
                                           const SurfaceSphere& under) const noexcept {
  Eigen::Matrix3d c = Eigen::Matrix3d::Zero();
  if (of.fields == nullptr || under.fields == nullptr) return c;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const float* const field = under.fields + static_cast<std::size_t>(axis) * stride_;
    c.col(axis) = Eigen::Map<const Eigen::Vector3f>(field + 4 * of.column).cast<double>();
  }
  return c;
}

void SurfaceNetwork::find_near(double way_m) noexcept {
  const double within_m = ball_.reach_m() + kNearBy_m + way_m;
  near_count_ = 0;
  too_many_ = false;
  for (std::size_t s = 0; s < surface_.size(); ++s) {
    const SurfaceSphere& candidate = surface_[s];
    const Eigen::Vector3d apart = from_ball(candidate);
    const bool pushed = !candidate.pushed_N.isZero(0.0);
    if (!pushed && !(apart.squaredNorm() <= within_m * within_m)) continue;
    if (near_count_ < kMostTouched) {
      near_[static_cast<std::size_t>(near_count_++)] = {s, apart, candidate.pushed_N};
    } else {
      too_many_ = true;
    }
  }
}

void SurfaceNetwork::press() noexcept {
  const auto count = static_cast<std::size_t>(near_count_);
  std::array<std::array<Eigen::Matrix3d, kMostTouched>, kMostTouched> yields;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) {
      yields[i][j] = compliance(surface_[near_[i].candidate], surface_[near_[j].candidate]);
    }
  }
  std::array<Eigen::Vector3d, kMostTouched> left;
  std::array<Eigen::Matrix3d, kMostTouched> slope;
  std::array<std::size_t, kMostTouched> closed;
  pressed_ = false;
  for (int search = 0; search < kMostSearches; ++search) {
    std::size_t closed_count = 0;
    double scale_N = 0.0, left_N = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      Eigen::Vector3d apart = near_[i].free_m;
      for (std::size_t j = 0; j < count; ++j) apart += yields[i][j] * near_[j].pushed_N;
      const double distance_m = apart.norm();
      const double overlap_m = ball_.reach_m() - distance_m;
      const double k = ball_.stiffness_N_per_m;
      const Eigen::Vector3d away = apart / distance_m;
      const double pressed_N = away.dot(near_[i].pushed_N);
      // Closed if it would press after a step of Newton's method of its own: the overlap alone,
      // over so stiff a contact, makes the search run in circles.
      const double resists = 1.0 / k + away.dot(yields[i][i] * away);
      left[i] = -near_[i].pushed_N;
      slope[i].setZero();
      if (pressed_N + (overlap_m - pressed_N / k) / resists > 0.0) {
        const Eigen::Matrix3d along = away * away.transpose();
        left[i] += k * overlap_m * away;
        slope[i] = pressed_N / distance_m * (Eigen::Matrix3d::Identity() - along) - k * along;
        closed[closed_count++] = i;
      }
      scale_N = std::max(scale_N, near_[i].pushed_N.norm());
      left_N = std::max(left_N, left[i].norm());
    }
    if (left_N <= kPressed * scale_N + kLeastForce_N) {
      pressed_ = true;
      break;
    }
    // Where it does not touch the force becomes 0 at once; the others are solved for together.
    PressMatrix matrix(3 * static_cast<Eigen::Index>(closed_count),
                       3 * static_cast<Eigen::Index>(closed_count));
    PressVector right(3 * static_cast<Eigen::Index>(closed_count));
    for (std::size_t a = 0; a < closed_count; ++a) {
      const std::size_t i = closed[a];
      const auto row = 3 * static_cast<Eigen::Index>(a);
      Eigen::Vector3d given_up = Eigen::Vector3d::Zero();
      for (std::size_t j = 0; j < count; ++j) {
        if (slope[j].isZero(0.0)) given_up += yields[i][j] * left[j];
      }
      right.segment<3>(row) = left[i] + slope[i] * given_up;
      for (std::size_t b = 0; b < closed_count; ++b) {
        Eigen::Matrix3d block = -slope[i] * yields[i][closed[b]];
        if (a == b) block += Eigen::Matrix3d::Identity();
        matrix.block<3, 3>(row, 3 * static_cast<Eigen::Index>(b)) = block;
      }
    }
    if (closed_count > 0) right = matrix.partialPivLu().solve(right).eval();
    for (std::size_t i = 0; i < count; ++i) {
      if (slope[i].isZero(0.0)) near_[i].pushed_N.setZero();
    }
    for (std::size_t a = 0; a < closed_count; ++a) {
      near_[closed[a]].pushed_N += right.segment<3>(3 * static_cast<Eigen::Index>(a));
    }
  }
  for (std::size_t i = 0; i < count; ++i) surface_[near_[i].candidate].pushed_N = near_[i].pushed_N;
}

Eigen::Vector3d SurfaceNetwork::total_N() const noexcept {
  Eigen::Vector3d total = Eigen::Vector3d::Zero();
  for (int i = 0; i < near_count_; ++i) total -= near_[static_cast<std::size_t>(i)].pushed_N;
  return total;
}

void SurfaceNetwork::balance(std::size_t first, double way_m) noexcept {
  const std::size_t moving = stiffness_.free().size();
  for (std::size_t i = 0; i < moving; ++i) {
    std::copy_n(force_.data() + 8 * i + first, 4, change_.data() + 4 * i);
  }
  stiffness_.solve(change_.data());
  find_near(way_m);
  for (int i = 0; i < near_count_; ++i) {
    Near& near = near_[static_cast<std::size_t>(i)];
    const SurfaceSphere& candidate = surface_[near.candidate];
    if (candidate.fields == nullptr) continue;
    near.free_m +=
        Eigen::Map<const Eigen::Vector3f>(change_.data() + 4 * candidate.column).cast<double>();
  }
  press();
  for (int i = 0; i < near_count_; ++i) {
    const Near& near = near_[static_cast<std::size_t>(i)];
    const float* const field = surface_[near.candidate].fields;
    if (field == nullptr || near.pushed_N.isZero(0.0)) continue;
    const Eigen::Vector3f push = near.pushed_N.cast<float>();
    run_wide([&] {
      float* const change = change_.data();
      for (std::size_t at = 0; at < stride_; ++at) {
        change[at] +=
            push[0] * field[at] + push[1] * field[stride_ + at] + push[2] * field[2 * stride_ + at];
      }
    });
  }
  for (std::size_t i = 0; i < 4 * moving; ++i) displacement_[i] += change_[i];
  std::fill(force_.begin(), force_.end(), 0.0F);
  bonds_.advance(displacement_.data(), weights_, force_.data());
  moved_with_N_ = total_N();
}

Eigen::Vector3d SurfaceNetwork::weighed(const float* fields) const noexcept {
  Eigen::Vector3d sums;
  run_wide([&] {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* const field = fields + axis * stride_;
      Lanes8 sum{};
      for (std::size_t at = 0; at < stride_; at += 8) {
        Lanes8 a, b;
        std::memcpy(&a, field + at, sizeof a);
        std::memcpy(&b, change_.data() + at, sizeof b);
        sum += a * b;
      }
      sums[static_cast<Eigen::Index>(axis)] = static_cast<double>(
          ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7])));
    }
  });
  return sums;
}

void SurfaceNetwork::answer() noexcept {
  const std::size_t moving = stiffness_.free().size();
  float sum = 0.0F;
  for (std::size_t i = 0; i < moving; ++i) {
    std::copy_n(force_.data() + 8 * i + kForceNow, 3, change_.data() + 4 * i);
    change_[4 * i + 3] = 0.0F;
    sum += change_[4 * i] + change_[4 * i + 1] + change_[4 * i + 2];
  }
  find_near(0.0);
  bool held = false;
  double deepest_m = 0.0;
  for (int i = 0; i < near_count_; ++i) {
    Near& near = near_[static_cast<std::size_t>(i)];
    const SurfaceSphere& candidate = surface_[near.candidate];
    if (candidate.fields != nullptr) near.free_m += weighed(candidate.fields);
  }
  press();
  for (int i = 0; i < near_count_; ++i) {
    const Near& near = near_[static_cast<std::size_t>(i)];
    if (near.pushed_N.isZero(0.0)) continue;
    held = held || surface_[near.candidate].fields == nullptr;
    deepest_m = std::max(deepest_m, displacement_of(surface_[near.candidate].column).norm());
  }
  // Written so that a force that is no number is passed on, and found.
  answer_.force_N = total_N() + 0.0 * Eigen::Vector3d::Constant(static_cast<double>(sum));
  largest_N_ = std::max(largest_N_, answer_.force_N.norm());
  const double left_N = (answer_.force_N - moved_with_N_).norm() + kForceRounding * largest_N_;
  answer_.error_N = std::max(left_N, kHoldError * held_error_N_);
  answer_.valid = pressed_ && !too_many_ && !held && deepest_m <= options_.deepest_m &&
                  answer_.error_N <= kValidError * scale_N();
}

void SurfaceNetwork::add_linear_error() noexcept {
  linear_error_N_ = 0.0;
  for (SurfaceSphere& candidate : surface_) {
    const Eigen::Vector3d change_N = candidate.pushed_N - candidate.before_N;
    candidate.linearisation_N =
        bend_kept_ * candidate.linearisation_N + bend_ * (change_N - candidate.change_N);
    candidate.before_N = candidate.pushed_N;
    candidate.change_N = change_N;
    linear_error_N_ += candidate.linearisation_N.norm();
  }
  answer_.error_N += linear_error_N_;
  if (!(answer_.error_N <= kValidError * scale_N())) answer_.valid = false;
}

double SurfaceNetwork::scale_N() const noexcept {
  return std::max(largest_N_, kScaleAtDepth_m * equilibrium_.norm());
}

bool SurfaceNetwork::has_fallen_in() const noexcept {
  const double reach2 = ball_.reach_m() * ball_.reach_m();
  for (const std::size_t sphere : inside_) {
    const Eigen::Vector3d apart = rest_.col(static_cast<Eigen::Index>(sphere)) - ball_.start_m -
                                  ball_at_ + displacement_of(stiffness_.column(sphere));
    if (apart.squaredNorm() < reach2) return true;
  }
  return false;
}

ContactAnswer SurfaceNetwork::step(const ToolPose& tool) noexcept {
  const FlushDenormals flush;
  if (!tool.displacement_m.allFinite()) {
    return {Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()), 0.0, false};
  }
  const double way_m = (tool.displacement_m - ball_at_).norm();
  ball_at_ = tool.displacement_m;
  balance(kForceNext, way_m);
  answer();
  for (balances_ = 1; balances_ < options_.most_balances; ++balances_) {
    if (answer_.error_N <= options_.balance_again_above * scale_N()) break;
    held_error_N_ = 0.0;
    balance(kForceNow, 0.0);
    answer();
  }
  held_error_N_ = answer_.error_N;
  add_linear_error();
  if (has_fallen_in()) answer_.valid = false;
  bonds_.accept();
  return answer_;
}

int SurfaceNetwork::touching() const noexcept {
  int touching = 0;
  for (int i = 0; i < near_count_; ++i) {
    touching += near_[static_cast<std::size_t>(i)].pushed_N.isZero(0.0) ? 0 : 1;
  }
  return touching;
}

// A Ref is a view: what it shows is changed.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
void SurfaceNetwork::displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept {
  for (Eigen::Index s = 0; s < all.cols(); ++s) {
    all.col(s) = displacement_of(stiffness_.column(static_cast<std::size_t>(s)));
  }
}

}  // namespace tpm::contact
