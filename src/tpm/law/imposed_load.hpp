#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "tpm/law/contact_history.hpp"

namespace tpm::law {

/// The depth of a contact under an imposed load in closed form, where the kernel alone carries it
/// (no tension, or one that relaxes with the rest). The balance
///
///     A V = L + sum k_j w_j,   dw_j/dt = (V - w_j)/tau_j,   A = k_inf + sum k_j
///
/// is linear in V(u). With q_j = sqrt(k_j/tau_j) and K = q q'/A - diag(1/tau_j), symmetric and
/// negative semidefinite,
///
///     V(t) = L(t)/A + 1/A^2 integral q' exp(K (t - s)) q L(s) ds
///
/// which is a sum over the eigenvalues of K (less the inverse retardation times). The load is
/// linear between knots, so that the integrals are exact. Derivatives of exp(K t) are divided
/// differences of its eigenvalues (Daleckii and Krein). Then u follows from V.
class LoadedSurface {
 public:
  /// True if the law can be answered so.
  [[nodiscard]] static bool answers(const LawAtParameters& law);

  LoadedSurface(const LawAtParameters& law, Want want);

  /// The load (offset included) was constant for ever.
  void rest_at(double load);
  /// An instantaneous change of the load.
  void jump_to(double load);
  /// The load moves linearly within h > 0.
  void move(double from, double to, double h);

  /// False as soon as the surface would have to follow a load that pulls: the probe leaves it, and
  /// only ContactHistory has the answer. Before its first load a surface stays where it is.
  [[nodiscard]] bool in_contact() const { return in_contact_; }
  /// Drive that the surface answers (contact included), and its derivatives.
  [[nodiscard]] double drive() const { return u_ + law_.contact; }
  [[nodiscard]] Slopes drive_slopes() const;

 private:
  /// Integrals over the load, L * exp(lambda_m t), and their derivatives by lambda_m.
  struct Integrals {
    Eigen::ArrayXd value, by_rate;
  };
  /// Moments of exp(-z x) over 0..1: with 1, x and x^2.
  struct StepMoments {
    double decay;
    std::array<double, 3> of;
  };
  /// Derivatives of A, and of the sum over the eigenvalues, by one parameter.
  struct Direction {
    int parameter;
    double d_sum;          ///< dA
    Eigen::ArrayXd first;  ///< factors of the integrals
    Eigen::MatrixXd both;  ///< factors of their divided differences
  };

  void add_direction(int parameter, double d_sum, const Eigen::VectorXd& d_stiffness,
                     const Eigen::VectorXd& d_rate);
  void set_moments(double h);
  void advance(Integrals& integrals, double from, double to, double h) const;
  void arrive(double load);
  [[nodiscard]] double divided_difference(Eigen::Index m, Eigen::Index l) const;

  const LawAtParameters& law_;
  bool want_slopes_;
  double sum_ = 0.0;  ///< A
  Eigen::VectorXd stiffness_, rate_;
  Eigen::VectorXd q_;
  Eigen::VectorXd eigenvalue_;
  Eigen::MatrixXd eigenvector_;
  Eigen::VectorXd weight_;  ///< q in the eigenvectors
  std::vector<Direction> directions_;
  Integrals under_load_;
  Integrals under_offset_;  ///< of -1 while the load is carried: dL/d offset
  double h_ = -1.0;
  std::vector<StepMoments> moments_;
  bool untouched_ = true;  ///< no load was carried yet
  bool in_contact_ = true;
  double load_ = 0.0;  ///< L now
  double v_ = 0.0, u_ = 0.0;
};

}  // namespace tpm::law
