#pragma once
// A network whose branches are written out one by one: its own force law, its own balance by a
// dense chord iteration, and the ordinary differential equations of all viscous elongations
// integrated by CVODES. Shares nothing with BondSystem, QuasiStatic and Inertial but spheres and
// bonds.
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <vector>

#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/bonds/constraints.hpp"
#include "tpm/organ/bonds/network.hpp"
#include "tpm/organ/linear/sundials.hpp"
#include "tpmkit/bond_material.hpp"

namespace tpm_test {
using namespace tpm::organ;

/// One spring with its dashpots between two spheres.
struct WrittenBond {
  struct Branch {
    double g, tau;
  };
  std::uint32_t a = 0, b = 0;
  double rest = 0.0;
  bool rope = false;
  double k = 0.0;                                    ///< of the equilibrium force
  double stiffening = 0.0, kernel_stiffening = 0.0;  ///< of cubic functions; 0: linear
  std::vector<Branch> branches;

  static double shape(double l, double s) { return s > 0.0 ? l + l * l * l / (s * s) : l; }
  static double shape_slope(double l, double s) {
    return s > 0.0 ? 1.0 + 3.0 * l * l / (s * s) : 1.0;
  }
  [[nodiscard]] double followed(double l) const { return shape(l, kernel_stiffening); }
};

/// The bonds of a network of one material, without using its laws.
inline std::vector<WrittenBond> written_bonds(const tpm::organ::Network& network,
                                              const tpm::BondMaterial& m, double factor = 1.0) {
  std::vector<WrittenBond> bonds;
  for (const tpm::organ::Bond& joined : network.bonds) {
    const bool radial = joined.kind == tpm::organ::BondKind::radial;
    const double per_Pa = factor * joined.factor * m.A0_m2 / m.l0_m;
    double whole = m.equilibrium_Pa;
    for (const auto& branch : m.branches) whole += branch.modulus_Pa;
    const bool relaxes = radial || m.lateral == tpm::LateralBond::relaxing;
    const double share = radial ? 1.0 : m.lateral_Pa / whole;
    WrittenBond bond;
    bond.a = joined.a;
    bond.b = joined.b;
    bond.rest = joined.rest_length_m;
    bond.rope = !radial && m.lateral == tpm::LateralBond::tension_only;
    bond.k = per_Pa * (relaxes ? share * m.equilibrium_Pa : m.lateral_Pa);
    if (!m.potential.is_linear()) bond.stiffening = m.potential.values()[0];
    if (!m.kernel.is_linear()) bond.kernel_stiffening = m.kernel.values()[0];
    if (relaxes) {
      for (const auto& branch : m.branches) {
        bond.branches.push_back({per_Pa * share * branch.modulus_Pa, branch.relaxation_time_s});
      }
    }
    bonds.push_back(bond);
  }
  return bonds;
}

/// Driven at one sphere by an imposed depth.
class WrittenNetwork {
 public:
  WrittenNetwork(const tpm::organ::Network& network, std::vector<WrittenBond> bonds,
                 const tpm::organ::Constraints& constraints, const tpm::organ::Probe& probe)
      : rest_(network.organ.position), bonds_(std::move(bonds)), probe_(probe) {
    for (std::size_t i = 0; i < network.organ.size(); ++i) {
      Eigen::Matrix3d free = constraints.projector(i);
      if (i == probe.sphere) free -= probe.direction * probe.direction.transpose();
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(free);
      for (int axis = 0; axis < 3; ++axis) {
        if (axes.eigenvalues()[axis] < 0.5) continue;
        free_.push_back({3 * static_cast<Eigen::Index>(i), axes.eigenvectors().col(axis)});
      }
    }
    for (const WrittenBond& bond : bonds_) {
      first_.push_back(states_);
      states_ += static_cast<Eigen::Index>(bond.branches.size());
    }
    q_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(free_.size()));
  }

  [[nodiscard]] Eigen::Index states() const { return states_; }
  [[nodiscard]] Eigen::Index freedoms() const { return q_.size(); }
  [[nodiscard]] const std::vector<WrittenBond>& bonds() const { return bonds_; }

  /// Positions of all spheres with coordinates q under a depth.
  [[nodiscard]] Eigen::Matrix3Xd place(const Eigen::VectorXd& q, double depth) const {
    Eigen::Matrix3Xd x = rest_;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      x.col(free_[i].row / 3) += q[static_cast<Eigen::Index>(i)] * free_[i].axis;
    }
    x.col(static_cast<Eigen::Index>(probe_.sphere)) += depth * probe_.direction;
    return x;
  }

  /// Forces on all spheres.
  [[nodiscard]] Eigen::Matrix3Xd forces(const Eigen::Matrix3Xd& x, const double* m,
                                        Eigen::MatrixXd* stiffness = nullptr) const {
    Eigen::Matrix3Xd f = Eigen::Matrix3Xd::Zero(3, x.cols());
    if (stiffness != nullptr) stiffness->setZero(f.size(), f.size());
    for (std::size_t i = 0; i < bonds_.size(); ++i) {
      const WrittenBond& bond = bonds_[i];
      const Eigen::Vector3d apart = x.col(bond.b) - x.col(bond.a);
      const double length = apart.norm();
      const double l = length - bond.rest;
      if (bond.rope && l < 0.0) continue;
      double pull = bond.k * WrittenBond::shape(l, bond.stiffening);
      double slope = bond.k * WrittenBond::shape_slope(l, bond.stiffening);
      for (std::size_t j = 0; j < bond.branches.size(); ++j) {
        pull +=
            bond.branches[j].g * (bond.followed(l) - m[first_[i] + static_cast<Eigen::Index>(j)]);
        slope += bond.branches[j].g * WrittenBond::shape_slope(l, bond.kernel_stiffening);
      }
      const Eigen::Vector3d n = apart / length;
      f.col(bond.a) += pull * n;
      f.col(bond.b) -= pull * n;
      if (stiffness == nullptr) continue;
      const Eigen::Matrix3d block =
          slope * n * n.transpose() +
          pull / length * (Eigen::Matrix3d::Identity() - n * n.transpose());
      stiffness->block<3, 3>(3 * bond.a, 3 * bond.a) += block;
      stiffness->block<3, 3>(3 * bond.b, 3 * bond.b) += block;
      stiffness->block<3, 3>(3 * bond.a, 3 * bond.b) -= block;
      stiffness->block<3, 3>(3 * bond.b, 3 * bond.a) -= block;
    }
    return f;
  }

  [[nodiscard]] Eigen::VectorXd on_free(const Eigen::Matrix3Xd& f) const {
    Eigen::VectorXd projected(q_.size());
    for (std::size_t i = 0; i < free_.size(); ++i) {
      projected[static_cast<Eigen::Index>(i)] = free_[i].axis.dot(f.col(free_[i].row / 3));
    }
    return projected;
  }

  /// Balances the free spheres; the force of the probe.
  double balance(double depth, const double* m) {
    for (int i = 0; i < 200; ++i) {
      const Eigen::Matrix3Xd x = place(q_, depth);
      const Eigen::Matrix3Xd f = forces(x, m);
      const Eigen::VectorXd left = on_free(f);
      const double size = left.cwiseAbs().maxCoeff();
      if (size < 1e-12 && factored_) {
        return -f.col(static_cast<Eigen::Index>(probe_.sphere)).dot(probe_.direction);
      }
      if (!factored_ || i % 12 == 11) factorise(x, m);
      q_ += factor_.solve(left);
    }
    throw std::runtime_error("the reference finds no balance");
  }

  /// The elongation of each bond where balance() left the spheres.
  [[nodiscard]] std::vector<double> elongations(double depth) const {
    const Eigen::Matrix3Xd x = place(q_, depth);
    std::vector<double> l;
    for (const WrittenBond& bond : bonds_)
      l.push_back((x.col(bond.b) - x.col(bond.a)).norm() - bond.rest);
    return l;
  }

  void rates(double depth, const double* m, double* rate) {
    balance(depth, m);
    rates_of(elongations(depth), m, rate);
  }
  void rates_of(const std::vector<double>& l, const double* m, double* rate) const {
    for (std::size_t i = 0; i < bonds_.size(); ++i) {
      for (std::size_t j = 0; j < bonds_[i].branches.size(); ++j) {
        const auto at = first_[i] + static_cast<Eigen::Index>(j);
        rate[at] = (bonds_[i].followed(l[i]) - m[at]) / bonds_[i].branches[j].tau;
      }
    }
  }

  void factorise(const Eigen::Matrix3Xd& x, const double* m) {
    Eigen::MatrixXd k;
    static_cast<void>(forces(x, m, &k));
    Eigen::MatrixXd reduced(q_.size(), q_.size());
    for (std::size_t i = 0; i < free_.size(); ++i) {
      for (std::size_t j = 0; j < free_.size(); ++j) {
        const Eigen::Matrix3d block = k.block<3, 3>(free_[i].row, free_[j].row);
        reduced(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            free_[i].axis.dot(block * free_[j].axis);
      }
    }
    factor_.compute(reduced);
    factored_ = true;
  }

 private:
  struct Free {
    Eigen::Index row;
    Eigen::Vector3d axis;
  };
  Eigen::Matrix3Xd rest_;
  std::vector<WrittenBond> bonds_;
  tpm::organ::Probe probe_;
  std::vector<Free> free_;
  std::vector<Eigen::Index> first_;
  Eigen::Index states_ = 0;
  Eigen::VectorXd q_;
  Eigen::LDLT<Eigen::MatrixXd> factor_;
  bool factored_ = false;
};

/// y' = rate(t, y) by CVODES from y at t0; `see` gets the state at every time. Adams formulas, or
/// BDF with a dense Jacobian by differences.
inline void integrate(const std::function<void(double, const double*, double*)>& rate,
                      Eigen::VectorXd& y, double t0, const std::vector<double>& times,
                      double relative, double absolute, bool stiff,
                      const std::function<void(double, const Eigen::VectorXd&)>& see) {
  using namespace tpm::organ::sundials;
  const Context context = make_context();
  const Vector state(N_VMake_Serial(y.size(), y.data(), context.get()));
  const Cvodes cvodes(CVodeCreate(stiff ? CV_BDF : CV_ADAMS, context.get()));
  using Rate = std::function<void(double, const double*, double*)>;
  const auto call = [](double t, N_Vector in, N_Vector out, void* data) {
    (*static_cast<const Rate*>(data))(t, N_VGetArrayPointer(in), N_VGetArrayPointer(out));
    return 0;
  };
  Rate own = rate;
  check(CVodeInit(cvodes.get(), call, t0, state.get()), "CVodeInit");
  check(CVodeSStolerances(cvodes.get(), relative, absolute), "CVodeSStolerances");
  check(CVodeSetUserData(cvodes.get(), &own), "CVodeSetUserData");
  check(CVodeSetMaxNumSteps(cvodes.get(), 2'000'000), "CVodeSetMaxNumSteps");
  const Matrix matrix(SUNDenseMatrix(stiff ? y.size() : 1, stiff ? y.size() : 1, context.get()));
  const LinearSolver solver(stiff ? SUNLinSol_Dense(state.get(), matrix.get(), context.get())
                                  : nullptr);
  SUNNonlinearSolver fixed_point = nullptr;
  if (stiff) {
    check(CVodeSetLinearSolver(cvodes.get(), solver.get(), matrix.get()), "CVodeSetLinearSolver");
  } else {
    fixed_point = SUNNonlinSol_FixedPoint(state.get(), 0, context.get());
    check(CVodeSetNonlinearSolver(cvodes.get(), fixed_point), "CVodeSetNonlinearSolver");
  }
  double t = t0;
  for (const double wanted : times) {
    if (wanted > t) {
      check(CVodeSetStopTime(cvodes.get(), wanted), "CVodeSetStopTime");
      check(CVode(cvodes.get(), wanted, state.get(), &t, CV_NORMAL), "CVode");
    }
    see(wanted, y);
  }
  if (fixed_point != nullptr) SUNNonlinSolFree(fixed_point);
}

/// The force of the probe at times while it goes to a depth at a speed and stays; one of the times
/// must be that at which it stops.
inline std::vector<double> written_ramp(WrittenNetwork& network, double depth, double ramp,
                                        const std::vector<double>& times) {
  Eigen::VectorXd m = Eigen::VectorXd::Zero(network.states());
  std::vector<double> force;
  const auto part = [&](double t0, const std::vector<double>& at, const auto& depth_at) {
    integrate([&](double t, const double* y, double* rate) { network.rates(depth_at(t), y, rate); },
              m, t0, at, 1e-9, 1e-12, false,
              [&](double t, const Eigen::VectorXd& y) {
                force.push_back(network.balance(depth_at(t), y.data()));
              });
  };
  std::vector<double> before, after;
  for (const double t : times) (t <= ramp ? before : after).push_back(t);
  part(0.0, before, [&](double t) { return depth * t / ramp; });
  part(ramp, after, [&](double) { return depth; });
  return force;
}

}  // namespace tpm_test
