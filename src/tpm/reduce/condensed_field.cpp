#include "tpm/reduce/condensed_field.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "tpm/core/wide_vectors.hpp"

namespace tpm {
namespace {

constexpr std::array<int, 3> kFieldDegrees{5, 4, 2};
constexpr double kFieldSlopeLength_m = 1e-3;  // an error of a derivative counts over it
constexpr Eigen::Index kGroup = 48;           // numbers: of 16 spheres

std::size_t place_of(const std::vector<CondensedExponents>& all, const CondensedExponents& e) {
  return static_cast<std::size_t>(std::find(all.begin(), all.end(), e) - all.begin());
}

}  // namespace

CondensedField::CondensedField(const CondensedFrame& frame, const Eigen::Matrix3Xd& rest,
                               std::span<const CondensedSample> samples)
    : frame_(frame), spheres_(rest.cols()) {
  auto monomials = condensed_monomials(kFieldDegrees);
  for (const CondensedExponents& e : monomials) {
    Step step{-1, 0};
    for (int c = 0; c < 6; ++c) {
      if (e[static_cast<std::size_t>(c)] == 0) continue;
      CondensedExponents parent = e;
      --parent[static_cast<std::size_t>(c)];
      step = {static_cast<int>(place_of(monomials, parent)), c};
    }
    steps_.push_back(step);
  }

  const auto rows = static_cast<Eigen::Index>(4 * samples.size());
  Eigen::MatrixXd terms(rows, kTerms);
  Eigen::MatrixXd fields(rows, rest.size());
  Eigen::Index row = 0;
  for (const CondensedSample& sample : samples) {
    const CondensedPowers powers(frame, frame.local(sample.u_m), frame.local(sample.w_m));
    for (int k = -1; k < 3; ++k, ++row) {
      const int by = k < 0 ? -1 : kCondensedOfU[static_cast<std::size_t>(k)];
      const double share = k < 0 ? 1.0 : kFieldSlopeLength_m / frame.scale_m(by);
      for (Eigen::Index m = 0; m < kTerms; ++m) {
        terms(row, m) = share * powers.monomial(monomials[static_cast<std::size_t>(m)], by);
      }
      if (k < 0) {
        fields.row(row) = (sample.position_m - rest).reshaped().transpose();
      } else {
        fields.row(row) = kFieldSlopeLength_m * (sample.moves * frame.axes.col(k)).transpose();
      }
    }
  }
  // With the terms made orthonormal over the samples, T = Q L', the strongest modes of the fitted
  // fields are those of their coefficients.
  Eigen::MatrixXd gram = terms.transpose() * terms;
  gram.diagonal().array() += 1e-12 * gram.diagonal().maxCoeff();
  const Eigen::LLT<Eigen::MatrixXd> factor(gram);
  const Eigen::MatrixXd coefficients =
      factor.matrixL().solve(Eigen::MatrixXd(terms.transpose() * fields));
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> strengths(coefficients *
                                                                 coefficients.transpose());
  const Eigen::MatrixXd strongest = strengths.eigenvectors().rightCols(kMostModes);
  const Eigen::MatrixXd modes = coefficients.transpose() * strongest;  // 3n x modes
  amplitude_ = factor.matrixL().transpose().solve(strongest).transpose().cast<float>();
  const Eigen::Index groups = (rest.size() + kGroup - 1) / kGroup;
  modes_.assign(static_cast<std::size_t>(groups * kGroup * kMostModes), 0.0F);
  for (Eigen::Index i = 0; i < rest.size(); ++i) {
    for (Eigen::Index m = 0; m < kMostModes; ++m) {
      modes_[static_cast<std::size_t>(((i / kGroup) * kMostModes + m) * kGroup + i % kGroup)] =
          static_cast<float>(modes(i, m));
    }
  }
}

void CondensedField::displacements(const Eigen::Vector3d& u_m, const Eigen::Vector3d& w_m,
                                   Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept {
  const double middle = frame_.middle_depth_m;
  const std::array<double, 6> x{(u_m[0] - middle) / frame_.half_depth_m,
                                (w_m[0] - middle) / frame_.half_depth_m,
                                u_m[1] / frame_.tangential_m,
                                u_m[2] / frame_.tangential_m,
                                w_m[1] / frame_.tangential_m,
                                w_m[2] / frame_.tangential_m};
  std::array<float, kTerms> terms;
  terms[0] = 1.0F;
  for (std::size_t m = 1; m < kTerms; ++m) {
    terms[m] = terms[static_cast<std::size_t>(steps_[m].parent)] *
               static_cast<float>(x[static_cast<std::size_t>(steps_[m].coordinate)]);
  }
  std::array<float, kMostModes> amplitude{};
  const float* const table = amplitude_.data();
  run_wide([&]() __attribute__((always_inline)) {
    for (std::size_t m = 0; m < kTerms; ++m) {
      for (std::size_t k = 0; k < kMostModes; ++k) {
        amplitude[k] += terms[m] * table[m * kMostModes + k];
      }
    }
  });
  constexpr auto kNumbers = static_cast<std::size_t>(kGroup);
  for (Eigen::Index first = 0; first < spheres_; first += kGroup / 3) {
    std::array<float, kNumbers> sum{};
    const float* const mode = modes_.data() + 3 * first * kMostModes;
    run_wide([&]() __attribute__((always_inline)) {
      for (std::size_t m = 0; m < kMostModes; ++m) {
        for (std::size_t i = 0; i < kNumbers; ++i) sum[i] += amplitude[m] * mode[m * kNumbers + i];
      }
    });
    const Eigen::Index count = std::min<Eigen::Index>(kGroup / 3, spheres_ - first);
    for (Eigen::Index s = 0; s < count; ++s) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        all(k, first + s) = static_cast<double>(sum[static_cast<std::size_t>(3 * s + k)]);
      }
    }
  }
}

}  // namespace tpm
