#include "loaded_oscillator.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <complex>

namespace tpm_test {

Eigen::VectorXd loaded_oscillator(const tpm::BondElement& p, double mass_kg, double drag_per_s,
                                  double load_N, std::span<const double> times_s) {
  const double k = p.instantaneous_Pa() * p.modulus_to_stiffness_m();
  const double g = p.relaxing_Pa() * p.modulus_to_stiffness_m();
  const double tau = p.relaxation_time_s();
  Eigen::MatrixXd a(3, 3);
  a << 0, 1, 0, -k / mass_kg, -drag_per_s, g / mass_kg, 1 / tau, 0, -1 / tau;
  const Eigen::EigenSolver<Eigen::MatrixXd> modes(a);
  const double end = load_N / (k - g);
  const Eigen::MatrixXcd vectors = modes.eigenvectors();
  const Eigen::VectorXcd start =
      vectors.partialPivLu().solve(Eigen::VectorXcd(Eigen::Vector3cd(-end, 0.0, -end)));
  Eigen::VectorXd depth(static_cast<Eigen::Index>(times_s.size()));
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    std::complex<double> x = end;
    for (Eigen::Index m = 0; m < 3; ++m) {
      x += vectors(0, m) * std::exp(modes.eigenvalues()[m] * times_s[i]) * start[m];
    }
    depth[static_cast<Eigen::Index>(i)] = x.real();
  }
  return depth;
}

}  // namespace tpm_test
