#include "tpm/law/tension_creep.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "tpm/solve/exponential_collocation.hpp"

namespace tpm {
namespace {

constexpr int kCreepNodes = 7;             // of Radau; the begin of the step is one more
constexpr double kCreepTolerance = 3e-9;   // of V at the reference depth
constexpr double kLeastCreepStep = 1e-14;  // of the time that is asked for
constexpr std::array<std::size_t, 3> kLookedAfter{0, 3, 6};  // nodes; halfway to the next

using NodeVector = Eigen::Matrix<double, kCreepNodes, 1>;
using NodeMatrix = Eigen::Matrix<double, kCreepNodes, kCreepNodes>;
using Place = ExponentialCollocation::Place;

std::vector<double> begin_and_radau_nodes() {
  std::vector<double> nodes = radau_nodes(kCreepNodes);
  nodes.insert(nodes.begin(), 0.0);
  return nodes;
}

/// The same for all laws: the nodes, and places between them where the balance is looked at.
struct CreepRule {
  ExponentialCollocation collocation{begin_and_radau_nodes()};
  std::vector<Place> node, between;

  CreepRule() {
    const std::vector<double>& c = collocation.nodes();
    for (std::size_t i = 1; i < c.size(); ++i) node.push_back(collocation.place(c[i]));
    for (const std::size_t i : kLookedAfter) {
      between.push_back(collocation.place(0.5 * (c[i] + c[i + 1])));
    }
  }
};

const CreepRule& creep_rule() {
  static const CreepRule rule;
  return rule;
}

/// How much longer the next step is: the error grows with the power kCreepNodes + 1.
double longer_creep_step(double off) {
  constexpr double kLeast = 0.1;
  constexpr double kMost = 8.0;
  constexpr double kSafety = 0.85;
  if (!std::isfinite(off)) return kLeast;
  return std::clamp(kSafety * std::pow(off, -1.0 / (kCreepNodes + 1)), kLeast, kMost);
}

class CreepSteps {
 public:
  CreepSteps(const LawAtParameters& law, double load, Want want);

  /// The load presses on a surface that gives way.
  [[nodiscard]] bool begins() const { return u_ > 0.0; }
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
  [[nodiscard]] bool find_depths();
  [[nodiscard]] double off_balance() const;
  [[nodiscard]] Slopes kernel_slopes(const KernelShape::Values& k) const;

  const LawAtParameters& law_;
  bool want_slopes_;
  double load_, sum_;  ///< L and A
  double h_ = 0.0;     ///< of the last attempt
  double v_ = 0.0, u_ = 0.0;
  Eigen::ArrayXd w_;
  Eigen::ArrayXXd w_by_;    ///< branches x parameters
  Eigen::ArrayXXd weight_;  ///< of node i and branch j in column i + kCreepNodes * j: begin, nodes
  Eigen::ArrayXXd decay_;   ///< nodes x branches
  NodeMatrix carried_;      ///< sum of k_j times the weights
  NodeVector right_;
  NodeVector depth_, value_;
  Eigen::Matrix<double, kCreepNodes + 1, 1> course_;  ///< V at the begin and at the nodes
  Eigen::MatrixXd course_by_;  ///< its derivatives: (kCreepNodes + 1) x parameters
};

CreepSteps::CreepSteps(const LawAtParameters& law, double load, Want want)
    : law_(law),
      want_slopes_(want == Want::values_and_sensitivity),
      load_(load - law.offset),
      sum_(law.memory.instant()) {
  const Eigen::Index branches = law.memory.stiffness.size();
  ContactHistory at_once(law, law.tension.reference, want);
  at_once.jump_to_load(load);
  u_ = load_ > 0.0 ? at_once.drive() - law.contact : 0.0;
  const KernelShape::Values k = law.kernel.at(u_);
  v_ = k.value;
  w_.setZero(branches);
  weight_.resize(kCreepNodes + 1, kCreepNodes * branches);
  decay_.resize(kCreepNodes, branches);
  if (!want_slopes_) return;
  w_by_.setZero(branches, law.parameter_count);
  Slopes u_by = at_once.drive_slopes();
  u_by[law.place.contact] -= 1.0;
  course_by_.setZero(kCreepNodes + 1, law.parameter_count);
  course_by_.row(0) = (kernel_slopes(k) + k.slope * u_by).matrix().transpose();
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
  const Memory& m = law_.memory;
  carried_.setZero();
  right_.setConstant(load_);
  for (Eigen::Index j = 0; j < w_.size(); ++j) {
    const double z = h * m.rate_per_s[j];
    for (Eigen::Index i = 0; i < kCreepNodes; ++i) {
      const auto node = static_cast<std::size_t>(i);
      auto weight = weight_.col(i + kCreepNodes * j);
      weight = creep_rule().node[node].weights(z).array();
      decay_(i, j) = std::exp(-z * creep_rule().collocation.nodes()[node + 1]);
      carried_.row(i) += m.stiffness[j] * weight.tail<kCreepNodes>().matrix().transpose();
      right_[i] += m.stiffness[j] * (decay_(i, j) * w_[j] + weight[0] * v_);
    }
  }
}

/// Newton's method for the depths at all nodes.
bool CreepSteps::find_depths() {
  constexpr int kMostIterations = 12;
  constexpr double kSettled = 1e-12;
  depth_.setConstant(u_);
  for (int i = 0; i < kMostIterations; ++i) {
    NodeVector slope, pull, pull_slope;
    for (Eigen::Index n = 0; n < kCreepNodes; ++n) {
      const KernelShape::Values k = law_.kernel.at(depth_[n]);
      const TensionShape::Values t = law_.tension.at(depth_[n]);
      value_[n] = k.value;
      slope[n] = k.slope;
      pull[n] = law_.k_tension * t.value;
      pull_slope[n] = law_.k_tension * t.slope;
    }
    const NodeVector excess = sum_ * value_ + pull - right_ - carried_ * value_;
    NodeMatrix by_depth = -carried_ * slope.asDiagonal();
    by_depth.diagonal() += sum_ * slope + pull_slope;
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

/// How far V between the nodes is from what balances there, at most.
double CreepSteps::off_balance() const {
  const Memory& m = law_.memory;
  double most = 0.0;
  const std::vector<double>& c = creep_rule().collocation.nodes();
  for (std::size_t b = 0; b < kLookedAfter.size(); ++b) {
    const Place& place = creep_rule().between[b];
    const double at = 0.5 * (c[kLookedAfter[b]] + c[kLookedAfter[b] + 1]);
    double right = load_;
    for (Eigen::Index j = 0; j < w_.size(); ++j) {
      const double z = h_ * m.rate_per_s[j];
      right += m.stiffness[j] * (std::exp(-z * at) * w_[j] + place.weights(z).dot(course_));
    }
    const double v = place.interpolation().dot(course_);
    const double u = law_.kernel.inverse(v);
    const TensionShape::Values t = law_.tension.at(u);
    const double slope = sum_ + law_.k_tension * t.slope / law_.kernel.at(u).slope;
    most = std::max(most, std::abs(sum_ * v + law_.k_tension * t.value - right) / slope);
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
  if (!want_slopes_) return;
  const Memory& m = law_.memory;
  const KernelPlaces& p = law_.place;
  NodeMatrix by_depth = -carried_;
  Eigen::MatrixXd kernel_by(kCreepNodes, law_.parameter_count);
  Eigen::MatrixXd excess_by(kCreepNodes, law_.parameter_count);
  NodeVector slope;
  for (Eigen::Index i = 0; i < kCreepNodes; ++i) {
    const KernelShape::Values k = law_.kernel.at(depth_[i]);
    const TensionShape::Values t = law_.tension.at(depth_[i]);
    slope[i] = k.slope;
    by_depth(i, i) += sum_ + law_.k_tension * t.slope / k.slope;
    kernel_by.row(i) = kernel_slopes(k).matrix().transpose();
    // At kept depths: what stands at V is put back below.
    excess_by.row(i) = -law_.k_tension * t.slope / k.slope * kernel_by.row(i);
    excess_by(i, p.k_tension) += t.value;
    excess_by(i, p.spacing) += law_.k_tension * t.d_spacing;
    excess_by(i, p.offset) += 1.0;
    for (Eigen::Index j = 0; j < w_.size(); ++j) {
      const auto weight = weight_.col(i + kCreepNodes * j);
      const double w = decay_(i, j) * w_[j] + (weight.matrix().dot(course_));
      for (std::size_t q = 0; q < m.by.size(); ++q) {
        excess_by(i, m.by[q]) += m.d_stiffness(j, static_cast<Eigen::Index>(q)) * (value_[i] - w);
      }
      excess_by.row(i) -=
          m.stiffness[j] * (decay_(i, j) * w_by_.row(j).matrix() + weight[0] * course_by_.row(0));
      const double z = h_ * m.rate_per_s[j];
      const Place& place = creep_rule().node[static_cast<std::size_t>(i)];
      const double c = creep_rule().collocation.nodes()[static_cast<std::size_t>(i) + 1];
      const double by_z = place.weight_slopes(z).dot(course_) - c * decay_(i, j) * w_[j];
      const int tau = m.rate_parameter[static_cast<std::size_t>(j)];
      excess_by(i, tau) += m.stiffness[j] * z * m.rate_per_s[j] * by_z;
    }
    for (std::size_t q = 0; q < m.by.size(); ++q) {
      excess_by(i, m.by[q]) += m.d_constant[static_cast<Eigen::Index>(q)] * value_[i];
    }
  }
  course_by_.bottomRows<kCreepNodes>() = -by_depth.partialPivLu().solve(excess_by);
}

void CreepSteps::go_on() {
  const Memory& m = law_.memory;
  constexpr Eigen::Index kLast = kCreepNodes - 1;
  if (want_slopes_) {
    for (Eigen::Index j = 0; j < w_.size(); ++j) {
      const auto weight = weight_.col(kLast + kCreepNodes * j).matrix();
      const double z = h_ * m.rate_per_s[j];
      const double by_z =
          creep_rule().node.back().weight_slopes(z).dot(course_) - decay_(kLast, j) * w_[j];
      w_by_.row(j) = decay_(kLast, j) * w_by_.row(j) + (weight.transpose() * course_by_).array();
      w_by_(j, m.rate_parameter[static_cast<std::size_t>(j)]) -= z * m.rate_per_s[j] * by_z;
    }
    course_by_.row(0) = course_by_.row(kCreepNodes).eval();
  }
  for (Eigen::Index j = 0; j < w_.size(); ++j) {
    const auto weight = weight_.col(kLast + kCreepNodes * j).matrix();
    w_[j] = decay_(kLast, j) * w_[j] + weight.dot(course_);
  }
  u_ = depth_[kLast];
  v_ = value_[kLast];
}

void CreepSteps::answer(double c, Response& response, Eigen::Index row) const {
  const Eigen::VectorXd at = creep_rule().collocation.interpolation(c);
  const double u = law_.kernel.inverse(at.dot(course_));
  response.value[row] = u + law_.contact;
  if (!want_slopes_) return;
  const KernelShape::Values k = law_.kernel.at(u);
  Eigen::RowVectorXd by = at.transpose() * course_by_;
  by -= kernel_slopes(k).matrix().transpose();
  by /= k.slope;
  by[law_.place.contact] += 1.0;
  response.sensitivity.row(row) = by;
}

}  // namespace

std::optional<Response> creep_with_tension(const LawAtParameters& law, double load,
                                           std::span<const double> times_s, Want want,
                                           int* attempts) {
  const auto& rates = law.memory.rate_parameter;
  const bool fixed_rates = std::find(rates.begin(), rates.end(), -1) != rates.end();
  const bool finite =
      std::all_of(times_s.begin(), times_s.end(), [](double t) { return std::isfinite(t); });
  if (law.place.k_tension < 0 || fixed_rates || law.memory.dashpot > 0.0 || !finite) {
    return std::nullopt;
  }
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
  double at = 0.0;
  double h = end;
  for (std::size_t next = 0; next < order.size();) {
    const double step = std::max(h, kLeastCreepStep * end);
    const double off = steps.attempt(step);
    if (attempts != nullptr) ++*attempts;
    if (off > 1.0) {
      if (step <= kLeastCreepStep * end) return std::nullopt;
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
    h = std::min(step * longer_creep_step(off), end - at > 0.0 ? end - at : step);
  }
  return response;
}

}  // namespace tpm
