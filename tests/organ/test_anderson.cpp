#include "tpm/organ/linear/anderson.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>

using namespace tpm;
using namespace tpm::organ;

namespace {

/// x <- x + d(x) of d = b - A x, whose plain iteration diverges: A has the eigenvalues 0.2, 0.9,
/// 1.7 and 2.6, each many times.
struct Linear {
  explicit Linear(Eigen::Index size) : a(Eigen::MatrixXd::Zero(size, size)), b(size) {
    const std::array<double, 4> eigenvalues{0.2, 0.9, 1.7, 2.6};
    // A similarity by a reflection makes it full.
    Eigen::VectorXd v(size);
    for (Eigen::Index i = 0; i < size; ++i) {
      a(i, i) = eigenvalues[static_cast<std::size_t>(i) % 4];
      v[i] = 1.0 + 0.1 * static_cast<double>(i % 7);
      b[i] = std::cos(static_cast<double>(i));
    }
    const Eigen::MatrixXd reflection =
        Eigen::MatrixXd::Identity(size, size) - 2.0 / v.squaredNorm() * v * v.transpose();
    a = (reflection * a * reflection).eval();
    solution = a.partialPivLu().solve(b);
  }
  Eigen::MatrixXd a;
  Eigen::VectorXd b, solution;
};

}  // namespace

TEST_CASE("as many steps are stored as there are eigenvalues: the next is exact, as GMRES is") {
  // Below, at and beyond what is worked on at once, and not a multiple of it.
  for (const Eigen::Index size : {Eigen::Index{5}, Eigen::Index{37}, Eigen::Index{1030}}) {
    CAPTURE(size);
    const Linear problem(size);
    Anderson anderson(size, 4);
    Eigen::VectorXd x = Eigen::VectorXd::Zero(size);
    const auto error = [&] { return (x - problem.solution).norm() / problem.solution.norm(); };
    const auto step = [&] { anderson.step(x, problem.b - problem.a * x); };
    for (int i = 0; i < 4; ++i) step();
    CHECK(error() > 1e-3);
    step();
    CHECK(error() < 1e-4);  // differences are in single precision
    for (int i = 0; i < 12; ++i) step();
    CHECK(error() < 1e-12);  // the solution is not

    SECTION("after a restart nothing of the steps before is used") {
      Anderson fresh(size, 4);
      anderson.restart();
      Eigen::VectorXd again = Eigen::VectorXd::Ones(size);
      Eigen::VectorXd first = again;
      for (int i = 0; i < 3; ++i) {
        anderson.step(again, problem.b - problem.a * again);
        fresh.step(first, problem.b - problem.a * first);
      }
      CHECK(again == first);
    }
  }
}
