// Rebuilds SOFA's beam of springs
// (SofaCUDA/scenes/benchmarks/MeshSpringForceField_beam10x10x40_cpu.scn: implicit Euler with steps
// of 10 ms, at most 20 iterations of conjugate gradients to 1e-6) and compares that setting, and
// others, with a converged solution: build/release/tests/measure_spring_beam beam.json prints the
// table in reports/networks/report.md and writes what draw_spring_beam.py draws.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <stdexcept>
#include <string>
#include <vector>

#include "tpm/files/file.hpp"
#include "tpm/files/json.hpp"
#include "tpm/organ/bonds/bond_system.hpp"
#include "tpm/organ/bonds/constraints.hpp"
#include "tpm/organ/linear/block_ldlt.hpp"

using namespace tpm;
using namespace tpm::organ;

namespace {

constexpr std::uint32_t kAlong = 40, kAcross = 10;  // nodes
constexpr double kStiffness = 1200.0, kMass = 100.0, kGravity = 9.0;
constexpr double kStep_s = 0.01, kEnd_s = 3.0;  // later it buckles, and any difference grows

std::uint32_t node(std::uint32_t i, std::uint32_t j, std::uint32_t k) {
  return i + kAlong * (j + kAcross * k);
}

/// Six tetrahedra in each cell around the diagonal from corner 0 to corner 6, as SOFA's mapping of
/// hexahedra to tetrahedra cuts them: the edges that one cell adds.
std::vector<NeighbourPair> edges() {
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kTetrahedra{
      {{0, 5, 1, 6}, {0, 1, 3, 6}, {1, 3, 6, 2}, {6, 3, 0, 7}, {6, 7, 0, 5}, {7, 5, 4, 0}}};
  std::vector<NeighbourPair> all;
  for (std::uint32_t k = 0; k + 1 < kAcross; ++k) {
    for (std::uint32_t j = 0; j + 1 < kAcross; ++j) {
      for (std::uint32_t i = 0; i + 1 < kAlong; ++i) {
        const std::array<std::uint32_t, 8> corner{node(i, j, k),
                                                  node(i + 1, j, k),
                                                  node(i + 1, j + 1, k),
                                                  node(i, j + 1, k),
                                                  node(i, j, k + 1),
                                                  node(i + 1, j, k + 1),
                                                  node(i + 1, j + 1, k + 1),
                                                  node(i, j + 1, k + 1)};
        for (const auto& t : kTetrahedra) {
          for (std::size_t a = 0; a < 4; ++a) {
            for (std::size_t b = a + 1; b < 4; ++b) {
              all.push_back(
                  {std::min(corner[t[a]], corner[t[b]]), std::max(corner[t[a]], corner[t[b]])});
            }
          }
        }
      }
    }
  }
  const auto key = [](const NeighbourPair& p) { return std::pair(p.first, p.second); };
  std::sort(all.begin(), all.end(), [&](const auto& p, const auto& q) { return key(p) < key(q); });
  all.erase(std::unique(all.begin(), all.end(),
                        [&](const auto& p, const auto& q) { return key(p) == key(q); }),
            all.end());
  return all;
}

Network beam() {
  Organ organ;
  organ.name = "beam";
  organ.position.resize(3, kAlong * kAcross * kAcross);
  for (std::uint32_t k = 0; k < kAcross; ++k) {
    for (std::uint32_t j = 0; j < kAcross; ++j) {
      for (std::uint32_t i = 0; i < kAlong; ++i) {
        organ.position.col(node(i, j, k)) << 16.0 * i / (kAlong - 1), 6.0 + 4.0 * j / (kAcross - 1),
            -2.0 + 4.0 * k / (kAcross - 1);
      }
    }
  }
  organ.normal = Eigen::Matrix3Xd::Zero(3, organ.position.cols());
  organ.normal.row(1).setOnes();
  organ.layer.assign(static_cast<std::size_t>(organ.position.cols()), 0);
  organ.radius = 0.1;
  organ.spacing = 0.4;
  NetworkOptions options;
  options.rule = StiffnessRule::per_bond;
  return join(std::move(organ), edges(), options, "beam");
}

BondMaterial springs() {
  BondMaterial material;
  material.A0_m2 = 1.0;
  material.l0_m = 1.0;
  material.lateral_Pa = kStiffness;
  return material;
}

double processor_s() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct State {
  Eigen::Matrix3Xd x, v;
};

class Beam {
 public:
  Beam() : network_(beam()), bonds_(network_, springs()), constraints_(network_.organ.size()) {
    for (std::uint32_t k = 0; k < kAcross; ++k) {
      for (std::uint32_t j = 0; j < kAcross; ++j) constraints_.fix(node(0, j, k));
    }
    viscous_state_.offset = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds_.size()));
    mass_ = kMass / static_cast<double>(network_.organ.size());
  }

  [[nodiscard]] std::size_t springs_count() const { return bonds_.size(); }
  [[nodiscard]] State start() const {
    return {network_.organ.position, Eigen::Matrix3Xd::Zero(3, network_.organ.position.cols())};
  }
  [[nodiscard]] double mass() const { return mass_; }
  [[nodiscard]] const BondSystem& bonds() const { return bonds_; }
  [[nodiscard]] const Constraints& constraints() const { return constraints_; }
  [[nodiscard]] const ViscousState& viscous_state() const { return viscous_state_; }

  /// Springs and weight on what is free, N.
  void force(const Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& f) const {
    f.setZero(3, x.cols());
    f.row(1).setConstant(-mass_ * kGravity);
    bonds_.add_forces(x, viscous_state_, f);
    constraints_.project(f);
  }
  [[nodiscard]] double energy(const State& s) const {
    return 0.5 * mass_ * s.v.squaredNorm() + bonds_.potential_J(s.x, viscous_state_) +
           mass_ * kGravity * s.x.row(1).sum();
  }

  /// By power iteration at rest, rad/s.
  [[nodiscard]] double highest_frequency() const {
    Eigen::Matrix3Xd mode = Eigen::Matrix3Xd::Ones(3, network_.organ.position.cols()), product;
    for (Eigen::Index i = 0; i < mode.cols(); i += 2) mode.col(i) *= -1.0;
    double eigenvalue = 0.0;
    for (int i = 0; i < 2000; ++i) {
      constraints_.project(mode);
      mode.normalize();
      product.setZero(3, mode.cols());
      bonds_.add_stiffness_times(network_.organ.position, viscous_state_, mode, product);
      eigenvalue = mode.cwiseProduct(product).sum();
      mode = product;
    }
    return std::sqrt(eigenvalue / mass_);
  }

 private:
  Network network_;
  BondSystem bonds_;
  Constraints constraints_;
  ViscousState viscous_state_;
  double mass_ = 0.0;
};

/// The linear system of backward Euler, (M + h^2 K) dv = h (f - h K v), by conjugate gradients.
class BackwardEulerGradients {
 public:
  BackwardEulerGradients(const Beam& beam, int most_iterations, double tolerance)
      : beam_(beam), most_(most_iterations), tolerance_(tolerance) {}

  void operator()(State& s) {
    beam_.force(s.x, r_);
    product_.setZero(3, s.x.cols());
    beam_.bonds().add_stiffness_times(s.x, beam_.viscous_state(), s.v, product_);
    r_ = kStep_s * (r_ - kStep_s * product_);
    beam_.constraints().project(r_);
    dv_.setZero(3, s.x.cols());
    p_ = r_;
    double rr = r_.squaredNorm();
    const double enough = tolerance_ * tolerance_ * rr;
    for (int i = 0; i < most_ && rr > enough; ++i, ++iterations) {
      product_.setZero();
      beam_.bonds().add_stiffness_times(s.x, beam_.viscous_state(), p_, product_);
      product_ = beam_.mass() * p_ + kStep_s * kStep_s * product_;
      beam_.constraints().project(product_);
      const double curvature = p_.cwiseProduct(product_).sum();
      if (!(curvature > 0.0)) break;  // SOFA stops there as well
      const double alpha = rr / curvature;
      dv_ += alpha * p_;
      r_ -= alpha * product_;
      const double next = r_.squaredNorm();
      p_ = r_ + (next / rr) * p_;
      rr = next;
    }
    s.v += dv_;
    s.x += kStep_s * s.v;
  }

  long iterations = 0;

 private:
  const Beam& beam_;
  int most_;
  double tolerance_;
  Eigen::Matrix3Xd r_, p_, product_, dv_;
};

/// One Newton step a step of time of backward Euler (theta = 1) or of the trapezoidal rule
/// (theta = 1/2), (M + theta^2 h^2 K) dv = h (f - theta h K v), by factorisation.
class Factorised {
 public:
  Factorised(const Beam& beam, double theta)
      : beam_(beam),
        theta_(theta),
        matrix_(beam.bonds().pattern()),
        factor_(beam.bonds().pattern()) {}

  void operator()(State& s) {
    const double h = kStep_s;
    beam_.force(s.x, r_);
    product_.setZero(3, s.x.cols());
    beam_.bonds().add_stiffness_times(s.x, beam_.viscous_state(), s.v, product_);
    r_ = h * (r_ - theta_ * h * product_);
    beam_.constraints().project(r_);
    matrix_.set_zero();
    beam_.bonds().add_stiffness(s.x, beam_.viscous_state(), matrix_);
    const double share = theta_ * theta_ * h * h;
    for (Eigen::Matrix3d& block : matrix_.below) block *= share;
    for (Eigen::Matrix3d& block : matrix_.diagonal) {
      block *= share;
      block += beam_.mass() * Eigen::Matrix3d::Identity();
    }
    beam_.constraints().constrain(beam_.bonds(), matrix_);
    if (!factor_.factorise(matrix_)) throw std::runtime_error("the matrix of a step is singular");
    factor_.solve(r_);
    beam_.constraints().project(r_);
    s.x += h * (s.v + theta_ * r_);
    s.v += r_;
  }

 private:
  const Beam& beam_;
  double theta_;
  BlockMatrix matrix_;
  BlockLdlt factor_;
  Eigen::Matrix3Xd r_, product_;
};

/// Velocity Verlet with steps of 10 ms / parts.
class Verlet {
 public:
  Verlet(const Beam& beam, int parts) : beam_(beam), parts_(parts) {}
  void operator()(State& s) {
    const double h = kStep_s / parts_;
    if (f_.cols() == 0) beam_.force(s.x, f_);
    for (int i = 0; i < parts_; ++i) {
      s.v += (0.5 * h / beam_.mass()) * f_;
      s.x += h * s.v;
      beam_.force(s.x, f_);
      s.v += (0.5 * h / beam_.mass()) * f_;
    }
  }

 private:
  const Beam& beam_;
  int parts_;
  Eigen::Matrix3Xd f_;
};

/// The classical Runge-Kutta method of order 4 with steps of 10 ms / parts.
class RungeKutta {
 public:
  RungeKutta(const Beam& beam, int parts) : beam_(beam), parts_(parts) {}
  void operator()(State& s) {
    const double h = kStep_s / parts_, per_mass = 1.0 / beam_.mass();
    for (int i = 0; i < parts_; ++i) {
      beam_.force(s.x, f_);
      a1_ = per_mass * f_;
      v2_ = s.v + 0.5 * h * a1_;
      beam_.force(s.x + 0.5 * h * s.v, f_);
      a2_ = per_mass * f_;
      v3_ = s.v + 0.5 * h * a2_;
      beam_.force(s.x + 0.5 * h * v2_, f_);
      a3_ = per_mass * f_;
      v4_ = s.v + h * a3_;
      beam_.force(s.x + h * v3_, f_);
      s.x += h / 6.0 * (s.v + 2.0 * v2_ + 2.0 * v3_ + v4_);
      s.v += h / 6.0 * (a1_ + 2.0 * a2_ + 2.0 * a3_ + per_mass * f_);
    }
  }

 private:
  const Beam& beam_;
  int parts_;
  Eigen::Matrix3Xd f_, a1_, a2_, a3_, v2_, v3_, v4_;
};

struct Course {
  std::string name;
  std::vector<Eigen::Matrix3Xd> x;  ///< every 10 ms
  std::vector<double> step_s;       ///< processor time of each step of 10 ms
  double energy_drift = 0.0;        ///< largest, in parts of the largest kinetic energy
  [[nodiscard]] double median_ms() const {
    std::vector<double> sorted = step_s;
    std::sort(sorted.begin(), sorted.end());
    return 1e3 * sorted[sorted.size() / 2];
  }
};

/// @param step moves a State by 10 ms
template <class Stepper>
Course run(const Beam& beam, std::string name, Stepper&& step) {
  Course course;
  course.name = std::move(name);
  State s = beam.start();
  const double before = beam.energy(s);
  double kinetic = 0.0, drift = 0.0;
  course.x.push_back(s.x);
  for (int i = 0; i < static_cast<int>(std::lround(kEnd_s / kStep_s)); ++i) {
    const double from = processor_s();
    step(s);
    course.step_s.push_back(processor_s() - from);
    course.x.push_back(s.x);
    kinetic = std::max(kinetic, 0.5 * beam.mass() * s.v.squaredNorm());
    drift = std::max(drift, std::abs(beam.energy(s) - before));
  }
  course.energy_drift = drift / kinetic;
  return course;
}

/// The distance at each instant, root mean square over the nodes, in parts of the largest
/// displacement of the reference.
std::vector<double> errors(const Course& course, const Course& reference) {
  std::vector<double> all;
  double moved = 0.0;
  for (std::size_t i = 0; i < reference.x.size(); ++i) {
    all.push_back((course.x[i] - reference.x[i]).norm());
    moved = std::max(moved, (reference.x[i] - reference.x.front()).norm());
  }
  for (double& value : all) value /= moved;
  return all;
}

double largest(const std::vector<double>& values) {
  return *std::max_element(values.begin(), values.end());
}

}  // namespace

int main(int count, char** words) {
  const Beam beam;
  fmt::print("{} nodes, {} springs, {} s from rest\n", beam.start().x.cols(), beam.springs_count(),
             kEnd_s);
  const double highest = beam.highest_frequency();
  fmt::print(
      "highest angular frequency at rest: {:.4g} rad/s; velocity Verlet is stable there below "
      "{:.3g} ms\n",
      highest, 2e3 / highest);
  const Course reference = run(beam, "reference", RungeKutta(beam, 40));
  const Course coarser = run(beam, "Runge-Kutta 4, 20 a step", RungeKutta(beam, 20));
  fmt::print(
      "reference: Runge-Kutta of order 4, 0.25 ms; energy kept to {:.2g} of the largest kinetic "
      "energy; with 0.5 ms it differs by {:.2g}\n\n",
      reference.energy_drift, largest(errors(coarser, reference)));

  std::vector<Course> all;
  BackwardEulerGradients sofa(beam, 20, 1e-6);
  all.push_back(run(beam, "implicit Euler, 20 gradients (SOFA's)", sofa));
  const double iterations =
      static_cast<double>(sofa.iterations) / static_cast<double>(all.back().step_s.size());
  BackwardEulerGradients solved(beam, 1000, 1e-10);
  all.push_back(run(beam, "implicit Euler, gradients to 1e-10", solved));
  all.push_back(run(beam, "implicit Euler, factorised", Factorised(beam, 1.0)));
  all.push_back(run(beam, "trapezoidal, factorised", Factorised(beam, 0.5)));
  for (const int parts : {6, 10, 20}) {
    all.push_back(run(beam, fmt::format("velocity Verlet, {} a step", parts), Verlet(beam, parts)));
  }
  fmt::print("{:<40} {:>12} {:>12} {:>14}\n", "steps of 10 ms", "ms a step", "error",
             "energy drift");
  for (const Course& course : all) {
    fmt::print("{:<40} {:>12.3g} {:>12.3g} {:>14.3g}\n", course.name, course.median_ms(),
               largest(errors(course, reference)), course.energy_drift);
  }
  fmt::print("\nSOFA's setting: {:.3g} iterations a step\n", iterations);

  if (count > 1) {
    Json methods = Json::array();
    for (const Course& course : all) {
      methods.push_back({{"name", course.name},
                         {"step_ms", course.median_ms()},
                         {"errors", errors(course, reference)}});
    }
    write_file(words[1],
               Json({{"step_s", kStep_s}, {"methods", std::move(methods)}}).dump(1) + "\n");
  }
  return 0;
}
