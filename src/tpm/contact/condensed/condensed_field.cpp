#include "tpm/contact/condensed/condensed_field.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cstring>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/wide_vectors.hpp"

namespace tpm::contact {
namespace {

constexpr std::array<int, 3> kFieldDegrees{5, 4, 2};
/// Monomials of the depths that stand beside a tangential one, by the degree of that.
constexpr std::array<int, 3> kBeside{21, 15, 6};
constexpr double kFieldSlopeLength_m = 1e-3;  // an error of a derivative counts over it
constexpr Eigen::Index kGroup = 48;           // numbers: of 16 spheres

/// Monomials of w to degree 2.
template <class Number>
std::array<Number, 10> monomials_of_w(const std::array<Number, 6>& x) {
  const Number p = x[1];
  const Number s = x[4];
  const Number t = x[5];
  return {Number(1), p, s, t, p * p, p * s, p * t, s * s, s * t, t * t};
}

/// Scaled depths of u and w, then tangents.
template <class Number>
std::array<Number, 6> scaled(const CondensedFrame& frame, const Eigen::Vector3d& u,
                             const Eigen::Vector3d& w) {
  const double depth = 1.0 / frame.half_depth_m;
  const double across = 1.0 / frame.tangential_m;
  return {static_cast<Number>((u[0] - frame.middle_depth_m) * depth),
          static_cast<Number>((w[0] - frame.middle_depth_m) * depth),
          static_cast<Number>(u[1] * across),
          static_cast<Number>(u[2] * across),
          static_cast<Number>(w[1] * across),
          static_cast<Number>(w[2] * across)};
}

}  // namespace

CondensedField::CondensedField(const CondensedFrame& frame, const Eigen::Matrix3Xd& rest,
                               std::span<const CondensedSample> samples,
                               std::span<const CondensedMetric> metrics)
    : frame_(frame), spheres_(rest.cols()) {
  const auto monomials = condensed_monomials(kFieldDegrees);
  const auto count = static_cast<Eigen::Index>(monomials.size());
  const auto rows = static_cast<Eigen::Index>(4 * samples.size());
  Eigen::MatrixXd terms(rows, count);
  Eigen::MatrixXd fields(rows, rest.size());
  Eigen::Index row = 0;
  for (const CondensedSample& sample : samples) {
    const CondensedPowers powers(frame, frame.local(sample.u_m), frame.local(sample.w_m));
    for (int k = -1; k < 3; ++k, ++row) {
      const int by = k < 0 ? -1 : kCondensedOfU[static_cast<std::size_t>(k)];
      const double share = k < 0 ? 1.0 : kFieldSlopeLength_m / frame.scale_m(by);
      for (Eigen::Index m = 0; m < count; ++m) {
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

  // The same for q: one fit over the places of w for each of its directions.
  const auto places = static_cast<Eigen::Index>(metrics.size());
  Eigen::MatrixXd of_w(places, kOfW);
  Eigen::MatrixXd answers(places, 3 * rest.size());
  for (Eigen::Index m = 0; m < places; ++m) {
    const CondensedMetric& metric = metrics[static_cast<std::size_t>(m)];
    const auto x =
        monomials_of_w(scaled<double>(frame, Eigen::Vector3d::Zero(), frame.local(metric.w_m)));
    of_w.row(m) = Eigen::Map<const Eigen::RowVectorXd>(x.data(), kOfW);
    answers.row(m) =
        kFieldSlopeLength_m * (metric.second_moves * frame.axes).reshaped().transpose();
  }
  const Eigen::LLT<Eigen::MatrixXd> factor_of_w(of_w.transpose() * of_w);
  const Eigen::MatrixXd second = factor_of_w.matrixL().solve(of_w.transpose() * answers);

  Eigen::MatrixXd coefficients(count + Eigen::Index{3} * kOfW, rest.size());
  coefficients.topRows(count) = factor.matrixL().solve(Eigen::MatrixXd(terms.transpose() * fields));
  for (Eigen::Index k = 0; k < 3; ++k) {
    coefficients.middleRows(count + k * kOfW, kOfW) =
        second.middleCols(k * rest.size(), rest.size());
  }
  const Eigen::MatrixXd strongest =
      symmetric_modes(coefficients * coefficients.transpose()).vectors.rightCols(kModes);
  const Eigen::MatrixXd modes = coefficients.transpose() * strongest;  // 3n x modes
  const auto rows_of = [](const Eigen::MatrixXd& table) {
    std::vector<Amplitudes> all;
    for (Eigen::Index i = 0; i < table.rows(); ++i) {
      std::array<float, 16> numbers{};
      std::transform(table.row(i).begin(), table.row(i).end(), numbers.begin(),
                     [](double x) { return static_cast<float>(x); });
      std::memcpy(&all.emplace_back(), numbers.data(), sizeof numbers);
    }
    return all;
  };
  terms_ = rows_of(factor.matrixL().transpose().solve(strongest.topRows(count)));
  for (Eigen::Index k = 0; k < 3; ++k) {
    const auto some = rows_of(
        factor_of_w.matrixL().transpose().solve(strongest.middleRows(count + k * kOfW, kOfW)) /
        kFieldSlopeLength_m);
    second_.insert(second_.end(), some.begin(), some.end());
  }
  const Eigen::Index groups = (rest.size() + kGroup - 1) / kGroup;
  modes_.assign(static_cast<std::size_t>(groups * kGroup * kModes), 0.0F);
  for (Eigen::Index i = 0; i < rest.size(); ++i) {
    for (Eigen::Index m = 0; m < kModes; ++m) {
      modes_[static_cast<std::size_t>(((i / kGroup) * kModes + m) * kGroup + i % kGroup)] =
          static_cast<float>(modes(i, m));
    }
  }
}

CondensedField::Amplitudes CondensedField::amplitudes(const Eigen::Vector3d& u_m,
                                                      const Eigen::Vector3d& w_m,
                                                      const Eigen::Vector3d& q_m) const noexcept {
  const std::array<float, 6> x = scaled<float>(frame_, u_m, w_m);
  // In the order of condensed_monomials: those of higher degree come later.
  std::array<float, kDepths> depths;
  depths[0] = 1.0F;
  for (std::size_t a = 1, next = 1, before = 0; a <= 5; ++a) {
    for (std::size_t n = 0; n < a; ++n) depths[next + n] = x[0] * depths[before + n];
    depths[next + a] = x[1] * depths[before + a - 1];
    before = next;
    next += a + 1;
  }
  const std::array<float, kTangents> tangents{1.0F,        x[2],        x[3],        x[4],
                                              x[5],        x[2] * x[2], x[2] * x[3], x[2] * x[4],
                                              x[2] * x[5], x[3] * x[3], x[3] * x[4], x[3] * x[5],
                                              x[4] * x[4], x[4] * x[5], x[5] * x[5]};
  const std::array<float, kOfW> of_w = monomials_of_w(x);
  Amplitudes sum{};
  const Amplitudes* term = terms_.data();
  const Amplitudes* second = second_.data();
  run_wide([&]() __attribute__((always_inline)) {
    Amplitudes all{};
    for (std::size_t t = 0; t < kTangents; ++t) {
      const int beside = kBeside[t == 0 ? 0 : t < 5 ? 1 : 2];
      Amplitudes part{};
      for (std::size_t d = 0; d < static_cast<std::size_t>(beside); ++d, ++term) {
        part.add(depths[d], *term);
      }
      all.add(tangents[t], part);
    }
    for (Eigen::Index k = 0; k < 3; ++k) {
      Amplitudes part{};
      for (std::size_t d = 0; d < kOfW; ++d, ++second) part.add(of_w[d], *second);
      all.add(static_cast<float>(q_m[k]), part);
    }
    sum = all;
  });
  return sum;
}

void CondensedField::displacements(const Eigen::Vector3d& u_m, const Eigen::Vector3d& w_m,
                                   const Eigen::Vector3d& q_m,
                                   Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept {
  const Amplitudes all_amplitudes = amplitudes(u_m, w_m, q_m);
  std::array<float, 16> amplitude;
  std::memcpy(amplitude.data(), &all_amplitudes, sizeof amplitude);
  constexpr auto kNumbers = static_cast<std::size_t>(kGroup);
  const float* mode = modes_.data();
  const bool in_a_row = all.outerStride() == 3;
  for (Eigen::Index first = 0; first < spheres_; first += kGroup / 3, mode += kModes * kGroup) {
    const Eigen::Index count = std::min<Eigen::Index>(kGroup / 3, spheres_ - first);
    std::array<double, kNumbers> some;
    double* const out = in_a_row && count == kGroup / 3 ? &all(0, first) : some.data();
    run_wide([&]() __attribute__((always_inline)) {
      std::array<float, kNumbers> sum{};
      for (std::size_t m = 0; m < kModes; ++m) {
        for (std::size_t i = 0; i < kNumbers; ++i) sum[i] += amplitude[m] * mode[m * kNumbers + i];
      }
      for (std::size_t i = 0; i < kNumbers; ++i) out[i] = static_cast<double>(sum[i]);
    });
    if (out != some.data()) continue;
    all.middleCols(first, count) = Eigen::Map<const Eigen::Matrix3Xd>(out, 3, count);
  }
}

}  // namespace tpm::contact
