#include "tpm/organ/linear/anderson.hpp"

#include <algorithm>
#include <array>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/wide_vectors.hpp"

namespace tpm::organ {
namespace {

constexpr std::size_t kWide = 16;    // sums side by side
constexpr std::size_t kPart = 1024;  // numbers that stay in the first cache meanwhile

using Sums = std::array<double, kWide>;

double total(const Sums& sums) {
  double total = 0.0;
  for (const double sum : sums) total += sum;
  return total;
}

}  // namespace

Anderson::Anderson(Eigen::Index size, Eigen::Index depth)
    : size_(size),
      depth_(depth),
      stride_((size + Eigen::Index{kWide} - 1) / Eigen::Index{kWide} * Eigen::Index{kWide}),
      dg_(static_cast<std::size_t>(stride_ * depth)),
      dd_(dg_.size()),
      gram_(depth, depth),
      aimed_(depth),
      last_x_(size),
      last_d_(Eigen::VectorXd::Zero(stride_)) {}

void Anderson::store(const double* x, const double* d) {
  const auto size = static_cast<std::size_t>(size_);
  const auto stride = static_cast<std::size_t>(stride_);
  const auto slot = static_cast<std::size_t>(known_ % depth_);
  const auto used = static_cast<std::size_t>(std::min(known_ + 1, depth_));
  float* const all = dd_.data();
  float* const dd = all + slot * stride;
  float* const dg = dg_.data() + slot * stride;
  double* const last_x = last_x_.data();
  double* const last_d = last_d_.data();
  std::vector<Sums> of_new(used), of_d(used);
  Sums* const new_sums = of_new.data();
  Sums* const d_sums = of_d.data();
  run_wide([=]() __attribute__((always_inline)) {
    for (std::size_t begin = 0; begin < stride; begin += kPart) {
      const std::size_t end = std::min(begin + kPart, stride);
      const std::size_t filled = std::min(end, size);
      for (std::size_t i = begin; i < filled; ++i) {
        const double change = d[i] - last_d[i];
        dd[i] = static_cast<float>(change);
        dg[i] = static_cast<float>(x[i] - last_x[i] + change);
        last_x[i] = x[i];
        last_d[i] = d[i];
      }
      for (std::size_t k = 0; k < used; ++k) {
        const float* const column = all + k * stride;
        Sums products = new_sums[k];
        Sums aims = d_sums[k];
        for (std::size_t i = begin; i < end; i += kWide) {
          for (std::size_t s = 0; s < kWide; ++s) {
            const auto difference = static_cast<double>(column[i + s]);
            products[s] += difference * static_cast<double>(dd[i + s]);
            aims[s] += difference * last_d[i + s];
          }
        }
        new_sums[k] = products;
        d_sums[k] = aims;
      }
    }
  });
  for (std::size_t k = 0; k < used; ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const auto column = static_cast<Eigen::Index>(slot);
    gram_(row, column) = gram_(column, row) = total(of_new[k]);
    aimed_[row] = total(of_d[k]);
  }
}

// A Ref is a view: what it shows is changed.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
void Anderson::step(Eigen::Ref<Eigen::VectorXd> x, const Eigen::Ref<const Eigen::VectorXd>& d) {
  if (known_ >= 0) {
    store(x.data(), d.data());
  } else {
    last_x_ = x;
    last_d_.head(size_) = d;
  }
  ++known_;
  const Eigen::Index used = std::min(known_, depth_);
  Eigen::VectorXd mix;
  if (used > 0) {
    const Eigen::MatrixXd gram = gram_.topLeftCorner(used, used);
    mix = shortest_least_squares(gram, aimed_.head(used));
  }
  const auto stride = static_cast<std::size_t>(stride_);
  const auto size = static_cast<std::size_t>(size_);
  const auto columns = static_cast<std::size_t>(used);
  const double* const share = mix.data();
  const float* const all = dg_.data();
  const double* const plain = d.data();
  double* const to = x.data();
  run_wide([=]() __attribute__((always_inline)) {
    for (std::size_t begin = 0; begin < size; begin += kPart) {
      const std::size_t end = std::min(begin + kPart, size);
      for (std::size_t i = begin; i < end; ++i) to[i] += plain[i];
      for (std::size_t k = 0; k < columns; ++k) {
        const float* const column = all + k * stride;
        const double part = share[k];
        for (std::size_t i = begin; i < end; ++i) to[i] -= part * static_cast<double>(column[i]);
      }
    }
  });
}

}  // namespace tpm::organ
