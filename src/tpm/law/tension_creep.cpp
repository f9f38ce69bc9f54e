#include "tpm/law/tension_creep.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "tpm/law/creep_weights.hpp"

namespace tpm::law {
namespace {

constexpr double kCreepTolerance = 3e-9;   // of V at the reference depth
constexpr double kLeastCreepStep = 1e-20;  // of the time that is asked for

using NodeVector = Eigen::Matrix<double, kCreepNodes, 1>;
using NodeMatrix = Eigen::Matrix<double, kCreepNodes, kCreepNodes>;

/// Factor of the next step's length: the error grows with the power kCreepNodes + 1.
double longer_creep_step(double off) {
  constexpr double kLeast = 0.1;
  constexpr double kMost = 8.0;
  constexpr double kSafety = 0.85;
  if (!std::isfinite(off)) return kLeast;
  return std::clamp(kSafety * std::pow(off, -1.0 / (kCreepNodes + 1)), kLeast, kMost);
}

/// The states are y_j = V - w_j, what is left to relax: near V of fast branches w_j would cancel.
class CreepSteps {
 public:
  CreepSteps(const LawAtParameters& law, double load, Want want);

  /// The load presses on a compliant surface.
  [[nodiscard]] bool begins() const { return load_ > 0.0 && (u_ > 0.0 || slow_start_); }
  /// The first step to try, if `end` is the time that is asked for.
  [[nodiscard]] double first_step(double end) const;
  /// Tries a step of h: how far the balance between the nodes is off, in parts of what is allowed;
  /// infinite if no depths were found. The state stays.
  [[nodiscard]] double attempt(double h);
  /// Derivatives at the nodes of the last attempt; needed before answer() and go_on().
  void differentiate();
  /// One row of a response, at the fraction c of the last attempt.
  void answer(double c, Response& response, Eigen::Index row) const;
  /// The end of the last attempt is the begin of the next one.
  void go_on();

 private:
  void set_weights(double h);
  void guess_depths();
  [[nodiscard]] bool find_depths();
  [[nodiscard]] double off_balance() const;
  [[nodiscard]] Slopes kernel_slopes(const KernelShape::Values& k) const;

  const LawAtParameters& law_;
  bool want_slopes_;
  bool slow_start_;  ///< a dashpot does not move instantaneously: the depth begins at 0
  double load_;      ///< L
  double h_ = 0.0;   ///< of the last attempt
  double v_ = 0.0, u_ = 0.0;
  Eigen::ArrayXd y_;
  Eigen::ArrayXXd y_by_;  ///< branches x parameters
  CreepWeights weights_;  ///< of each branch for the step
  BranchWeights sum_;     ///< k_j times these, with spring and dashpot: the force by the course
  CreepPlaces carried_;   ///< the force at each place that comes from the states at the begin
  NodeVector depth_, value_;
  CreepCourse course_;         ///< V at the begin and at the nodes
  Eigen::MatrixXd course_by_;  ///< its derivatives: (kCreepNodes + 1) x parameters
  Eigen::Array<double, Eigen::Dynamic, kCreepNodes> y_at_nodes_;  ///< by branch
};

CreepSteps::CreepSteps(const LawAtParameters& law, double load, Want want)
    : law_(law),
      want_slopes_(want == Want::values_and_sensitivity),
      slow_start_(law.relaxation.dashpot > 0.0),
      load_(load - law.offset),
      weights_(law.relaxation) {
  const Eigen::Index branches = law.relaxation.stiffness.size();
  y_.setZero(branches);
  if (want_slopes_) {
    y_by_.setZero(branches, law.parameter_count);
    course_by_.setZero(kCreepNodes + 1, law.parameter_count);
  }
  if (slow_start_ || !(load_ > 0.0)) return;
  ContactHistory instantaneous(law, law.tension.reference, want);
  instantaneous.jump_to_load(load);
  u_ = instantaneous.drive() - law.contact;
  const KernelShape::Values k = law_.kernel.at(u_);
  v_ = k.value;
  y_.setConstant(v_);
  if (!want_slopes_) return;
  Slopes u_by = instantaneous.drive_slopes();
  u_by[law.place.contact] -= 1.0;
  course_by_.row(0) = (kernel_slopes(k) + k.slope * u_by).matrix().transpose();
  y_by_ = course_by_.row(0).array().replicate(branches, 1);
}

double CreepSteps::first_step(double end) const {
  const RelaxationSum& m = law_.relaxation;
  return slow_start_ ? std::min(end, 1.0 / m.rate_per_s.maxCoeff()) : end;
}

/// Derivatives of V at a kept depth.
Slopes CreepSteps::kernel_slopes(const KernelShape::Values& k) const {
  Slopes slopes = Slopes::Zero(law_.parameter_count);
  const KernelPlaces& p = law_.place;
  if (p.exponent >= 0) slopes[p.exponent] = k.d_exponent;
  if (p.tension_share >= 0) {
    slopes[p.tension_share] = k.d_share;
    slopes[p.spacing] = k.d_spacing;
  }
  return slopes;
}

void CreepSteps::set_weights(double h) {
  h_ = h;
  const RelaxationSum& m = law_.relaxation;
  weights_.set_step(h);
  const CreepRule& rule = creep_rule();
  sum_.lag = m.constant * rule.interpolation + m.dashpot / h * rule.derivative;
  sum_.decay.setZero();
  carried_.setZero();
  for (Eigen::Index j = 0; j < y_.size(); ++j) {
    const BranchWeights& w = weights_[j];
    sum_.lag += m.stiffness[j] * w.lag;
    sum_.decay += m.stiffness[j] * w.decay;
    carried_ += m.stiffness[j] * (y_[j] - v_) * w.decay;
  }
}

/// Where the surface would lie without tension, for a surface that starts from nothing.
void CreepSteps::guess_depths() {
  if (u_ > 0.0) {
    depth_.setConstant(u_);
    return;
  }
  const NodeMatrix lag = sum_.lag.bottomLeftCorner<kCreepNodes, kCreepNodes>().transpose();
  const NodeVector v =
      lag.partialPivLu().solve(NodeVector::Constant(load_) - carried_.head<kCreepNodes>().matrix() -
                               v_ * sum_.lag.topLeftCorner<1, kCreepNodes>().transpose());
  for (Eigen::Index n = 0; n < kCreepNodes; ++n) {
    depth_[n] = v[n] > 0.0 ? law_.kernel.inverse(v[n]) : 0.0;
  }
}

/// Newton's method for the depths at all nodes.
bool CreepSteps::find_depths() {
  constexpr int kMostIterations = 12;
  constexpr double kSettled = 1e-12;
  guess_depths();
  const NodeMatrix lag = sum_.lag.bottomLeftCorner<kCreepNodes, kCreepNodes>().transpose();
  const NodeVector carried = carried_.head<kCreepNodes>().matrix() +
                             v_ * sum_.lag.topLeftCorner<1, kCreepNodes>().transpose();
  for (int i = 0; i < kMostIterations; ++i) {
    if (!(depth_.array() > 0.0).all()) return false;
    NodeVector slope, pull, pull_slope;
    for (Eigen::Index n = 0; n < kCreepNodes; ++n) {
      const KernelShape::Values k = law_.kernel.at(depth_[n]);
      const TensionShape::Values t = law_.tension.at(depth_[n]);
      value_[n] = k.value;
      slope[n] = k.slope;
      pull[n] = law_.k_tension * t.value;
      pull_slope[n] = law_.k_tension * t.slope;
    }
    const NodeVector excess = lag * value_ + carried + pull - NodeVector::Constant(load_);
    NodeMatrix by_depth = lag * slope.asDiagonal();
    by_depth.diagonal() += pull_slope;
    const NodeVector step = by_depth.partialPivLu().solve(excess);
    depth_ -= step;
    if (!(depth_.array() > 0.0).all()) return false;
    if (step.cwiseAbs().maxCoeff() <= kSettled * depth_.maxCoeff()) {
      course_ << v_, value_;
      return true;
    }
  }
  return false;
}

/// Largest error of V between the nodes against equilibrium there. A force that is missing there
/// moves V by it over the stiffness that a part of the step leaves: that at once would be far
/// larger for a spring-pot.
double CreepSteps::off_balance() const {
  const CreepRule& rule = creep_rule();
  double most = 0.0;
  const double soon = law_.relaxation.constant + sum_.decay[kCreepNodes] +
                      law_.relaxation.dashpot / (h_ * rule.fraction[kCreepNodes]);
  for (Eigen::Index b = kCreepNodes; b < kCreepPlaces; ++b) {
    const double v = rule.interpolation.col(b).dot(course_);
    if (!(v > 0.0)) return std::numeric_limits<double>::infinity();
    const double u = law_.kernel.inverse(v);
    const TensionShape::Values t = law_.tension.at(u);
    const double excess =
        sum_.lag.col(b).dot(course_) + carried_[b] + law_.k_tension * t.value - load_;
    const double slope = soon + law_.k_tension * t.slope / law_.kernel.at(u).slope;
    most = std::max(most, std::abs(excess) / slope);
  }
  return most;
}

double CreepSteps::attempt(double h) {
  set_weights(h);
  if (!find_depths()) return std::numeric_limits<double>::infinity();
  return off_balance() / (kCreepTolerance * law_.kernel.value(law_.tension.reference));
}

/// The balance at all nodes, differentiated: one matrix for all parameters.
void CreepSteps::differentiate() {
  const RelaxationSum& m = law_.relaxation;
  y_at_nodes_.resize(y_.size(), kCreepNodes);
  for (Eigen::Index j = 0; j < y_.size(); ++j) {
    const BranchWeights& w = weights_[j];
    y_at_nodes_.row(j) = (w.lag.leftCols<kCreepNodes>().transpose() * course_).array().transpose() +
                         (y_[j] - v_) * w.decay.head<kCreepNodes>().transpose();
  }
  if (!want_slopes_) return;
  const CreepRule& rule = creep_rule();
  const KernelPlaces& p = law_.place;
  NodeMatrix by_value = sum_.lag.bottomLeftCorner<kCreepNodes, kCreepNodes>().transpose();
  // At kept V but for the begin of the step.
  Eigen::MatrixXd excess_by =
      sum_.lag.topLeftCorner<1, kCreepNodes>().transpose() * course_by_.row(0);
  for (Eigen::Index j = 0; j < y_.size(); ++j) {
    const CreepPlaces& decay = weights_[j].decay;
    excess_by += (m.stiffness[j] * decay.head<kCreepNodes>()).matrix() *
                 (y_by_.row(j).matrix() - course_by_.row(0));
    const int tau = m.rate_parameter[static_cast<std::size_t>(j)];
    if (tau < 0) continue;
    const double scale = m.stiffness[j] * h_ * m.rate_per_s[j] * m.rate_per_s[j];
    for (Eigen::Index i = 0; i < kCreepNodes; ++i) {
      excess_by(i, tau) -= scale * weights_.lag_by_z(j, i, course_, y_[j] - v_);
    }
  }
  const NodeVector speed = rule.derivative.leftCols<kCreepNodes>().transpose() * course_ / h_;
  for (std::size_t q = 0; q < m.by.size(); ++q) {
    const auto column = static_cast<Eigen::Index>(q);
    excess_by.col(m.by[q]) += y_at_nodes_.matrix().transpose() * m.d_stiffness.col(column) +
                              m.d_constant[column] * value_ + m.d_dashpot[column] * speed;
  }
  for (Eigen::Index i = 0; i < kCreepNodes; ++i) {
    const KernelShape::Values k = law_.kernel.at(depth_[i]);
    const TensionShape::Values t = law_.tension.at(depth_[i]);
    const double by_v = law_.k_tension * t.slope / k.slope;
    by_value(i, i) += by_v;
    excess_by.row(i) -= by_v * kernel_slopes(k).matrix().transpose();
    excess_by(i, p.k_tension) += t.value;
    excess_by(i, p.spacing) += law_.k_tension * t.d_spacing;
    excess_by(i, p.offset) += 1.0;
  }
  course_by_.bottomRows<kCreepNodes>() = -by_value.partialPivLu().solve(excess_by);
}

void CreepSteps::go_on() {
  const RelaxationSum& m = law_.relaxation;
  constexpr Eigen::Index kLast = kCreepNodes - 1;
  if (want_slopes_) {
    for (Eigen::Index j = 0; j < y_.size(); ++j) {
      const BranchWeights& w = weights_[j];
      y_by_.row(j) = w.decay[kLast] * (y_by_.row(j) - course_by_.row(0).array()) +
                     (w.lag.col(kLast).transpose() * course_by_).array();
      const int tau = m.rate_parameter[static_cast<std::size_t>(j)];
      if (tau < 0) continue;
      y_by_(j, tau) -=
          h_ * m.rate_per_s[j] * m.rate_per_s[j] * weights_.lag_by_z(j, kLast, course_, y_[j] - v_);
    }
    course_by_.row(0) = course_by_.row(kCreepNodes).eval();
  }
  y_ = y_at_nodes_.col(kLast);
  u_ = depth_[kLast];
  v_ = value_[kLast];
}

void CreepSteps::answer(double c, Response& response, Eigen::Index row) const {
  const Eigen::VectorXd at = creep_rule().collocation.interpolation(c);
  const double v = at.dot(course_);
  const double u = v > 0.0 ? law_.kernel.inverse(v) : 0.0;
  response.value[row] = u + law_.contact;
  if (!want_slopes_) return;
  const KernelShape::Values k = law_.kernel.at(u);
  Eigen::RowVectorXd by = Eigen::RowVectorXd::Zero(law_.parameter_count);
  if (u > 0.0) {  // a dashpot that has not begun to move stays at 0 whatever the parameters
    by = at.transpose() * course_by_;
    by -= kernel_slopes(k).matrix().transpose();
    by /= k.slope;
  }
  by[law_.place.contact] += 1.0;
  response.sensitivity.row(row) = by;
}

}  // namespace

std::optional<Response> creep_with_tension(const LawAtParameters& law, double load,
                                           std::span<const double> times_s, Want want,
                                           int* attempts) {
  const bool finite =
      std::all_of(times_s.begin(), times_s.end(), [](double t) { return std::isfinite(t); });
  if (law.place.k_tension < 0 || !finite) return std::nullopt;
  CreepSteps steps(law, load, want);
  if (!steps.begins()) return std::nullopt;
  std::vector<std::size_t> order(times_s.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return times_s[a] < times_s[b]; });
  Response response;
  response.value.resize(std::ssize(times_s));
  if (want == Want::values_and_sensitivity) {
    response.sensitivity.resize(response.value.size(), law.parameter_count);
  }
  const double end = order.empty() ? 0.0 : times_s[order.back()];
  const double least = kLeastCreepStep * end;
  double at = 0.0;
  double h = steps.first_step(end);
  for (std::size_t next = 0; next < order.size();) {
    // The load stays: a step may go beyond the end.
    const double step = end > 0.0 ? on_creep_lattice(std::max(h, least)) : 0.0;
    const double off = steps.attempt(step);
    if (attempts != nullptr) ++*attempts;
    if (!(off <= 1.0)) {
      if (step <= least) return std::nullopt;
      h = step * longer_creep_step(off);
      continue;
    }
    steps.differentiate();
    for (; next < order.size() && times_s[order[next]] <= at + step; ++next) {
      const double since = std::max(times_s[order[next]] - at, 0.0);
      steps.answer(step > 0.0 ? std::min(since / step, 1.0) : 0.0, response,
                   static_cast<Eigen::Index>(order[next]));
    }
    steps.go_on();
    at += step;
    h = step * longer_creep_step(off);
  }
  return response;
}

}  // namespace tpm::law
