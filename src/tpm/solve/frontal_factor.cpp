#include "tpm/solve/frontal_factor.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstring>

namespace tpm {
namespace {

constexpr std::size_t kWide = 8;

std::size_t padded(std::size_t size) {
  return (size + kWide - 1) / kWide * kWide;
}

using Index = Eigen::Index;

/// The blocks of the matrix that each front brings in: an entry per edge.
struct Entry {
  std::uint32_t row, column;  ///< places, row >= column
  std::size_t edge;
  bool transposed;
};

/// Dense fronts in double precision.
class Elimination {
 public:
  Elimination(const FrontalPattern& pattern, std::span<const Eigen::Matrix3d> diagonal,
              std::span<const Eigen::Matrix3d> across)
      : pattern_(pattern), across_(across), passed_(pattern.fronts().size()) {
    pivot_.resize(pattern.nodes());
    for (std::size_t n = 0; n < pattern.nodes(); ++n) pivot_[pattern.place()[n]] = diagonal[n];
    entries_.resize(pattern.nodes());
    std::size_t edge = 0;
    for (const auto& [a, b] : pattern.edges()) {
      const std::uint32_t pa = pattern.place()[a];
      const std::uint32_t pb = pattern.place()[b];
      entries_[std::min(pa, pb)].push_back({std::max(pa, pb), std::min(pa, pb), edge++, pa < pb});
    }
  }

  /// False if the front's pivot is not positive definite.
  [[nodiscard]] bool eliminate(std::size_t number) {
    const FrontalPattern::Front& front = pattern_.fronts()[number];
    const auto own = Index{3} * front.own;
    const auto reached = static_cast<Index>(3 * front.rows.size());
    dense_.setZero(own + reached, own + reached);
    add_matrix(front);
    for (const std::size_t child : children_of(number)) add_passed(front, child);
    const Eigen::LLT<Eigen::MatrixXd> pivot(dense_.topLeftCorner(own, own));
    if (pivot.info() != Eigen::Success) return false;
    inverse = pivot.solve(Eigen::MatrixXd::Identity(own, own));
    down = dense_.bottomLeftCorner(reached, own) * inverse;
    passed_[number] = dense_.bottomRightCorner(reached, reached);
    passed_[number].noalias() -= down * dense_.bottomLeftCorner(reached, own).transpose();
    return true;
  }

  Eigen::MatrixXd inverse, down;  ///< of the front eliminated last

 private:
  [[nodiscard]] static Index place_in(const FrontalPattern::Front& front, std::uint32_t place) {
    if (place < front.first + front.own) return Index{3} * (place - front.first);
    const auto at = std::lower_bound(front.rows.begin(), front.rows.end(), place);
    return Index{3} * front.own + 3 * (at - front.rows.begin());
  }

  [[nodiscard]] std::vector<std::size_t> children_of(std::size_t number) const {
    std::vector<std::size_t> children;
    for (std::size_t f = 0; f < number; ++f) {
      if (pattern_.fronts()[f].parent == number) children.push_back(f);
    }
    return children;
  }

  void add_matrix(const FrontalPattern::Front& front) {
    for (std::uint32_t p = front.first; p < front.first + front.own; ++p) {
      const Index column = place_in(front, p);
      dense_.block<3, 3>(column, column) += pivot_[p];
      for (const Entry& entry : entries_[p]) {
        const Index row = place_in(front, entry.row);
        const Eigen::Matrix3d& block = across_[entry.edge];
        const Eigen::Matrix3d lower = entry.transposed ? Eigen::Matrix3d(block.transpose()) : block;
        dense_.block<3, 3>(row, column) += lower;
        dense_.block<3, 3>(column, row) += lower.transpose();
      }
    }
  }

  void add_passed(const FrontalPattern::Front& front, std::size_t child) {
    const auto& rows = pattern_.fronts()[child].rows;
    const Eigen::MatrixXd& from = passed_[child];
    for (std::size_t j = 0; j < rows.size(); ++j) {
      const Index column = place_in(front, rows[j]);
      for (std::size_t i = 0; i < rows.size(); ++i) {
        dense_.block<3, 3>(place_in(front, rows[i]), column) +=
            from.block<3, 3>(static_cast<Index>(3 * i), static_cast<Index>(3 * j));
      }
    }
    passed_[child].resize(0, 0);
  }

  const FrontalPattern& pattern_;
  std::span<const Eigen::Matrix3d> across_;
  std::vector<Eigen::Matrix3d> pivot_;       ///< by place
  std::vector<std::vector<Entry>> entries_;  ///< by column
  std::vector<Eigen::MatrixXd> passed_;      ///< by each front, to its parent
  Eigen::MatrixXd dense_;
};

void put(const Eigen::MatrixXd& matrix, float* to) {
  const std::size_t stride = padded(static_cast<std::size_t>(matrix.rows()));
  for (Index j = 0; j < matrix.cols(); ++j, to += stride) {
    for (Index i = 0; i < matrix.rows(); ++i) to[i] = static_cast<float>(matrix(i, j));
  }
}

constexpr std::size_t kNode = 3 * sizeof(float);

/// Four floats at once are moved much faster than three.
using Four [[gnu::vector_size(4 * sizeof(float))]] = float;

Four four_at(const float* from) {
  Four v;
  std::memcpy(&v, from, sizeof(Four));
  return v;
}

/// Copies a node out of four floats to three, in rising order of nodes: the fourth is written over
/// by the next node, or lies in the padding behind the last.
void copy_node(const float* from, float* to) {
  const Four v = four_at(from);
  std::memcpy(to, &v, sizeof(Four));
}

}  // namespace

FrontalFactor::FrontalFactor(std::shared_ptr<const FrontalPattern> pattern, bool portable)
    : pattern_(std::move(pattern)), kernels_(panel_kernels(portable)) {
  std::size_t numbers = 0;
  std::size_t most_own = 0;
  std::size_t most_reached = 0;
  for (const FrontalPattern::Front& front : pattern_->fronts()) {
    const std::size_t own = std::size_t{3} * front.own;
    const std::size_t reached = 3 * front.rows.size();
    front_.push_back({front.first, front.own, static_cast<std::uint32_t>(row_.size()),
                      static_cast<std::uint32_t>(front.rows.size()), numbers,
                      numbers + own * padded(own)});
    row_.insert(row_.end(), front.rows.begin(), front.rows.end());
    numbers += own * (padded(own) + padded(reached));
    most_own = std::max(most_own, padded(own));
    most_reached = std::max(most_reached, padded(reached));
  }
  numbers_.assign(numbers, 0.0F);
  own_.assign(most_own + 1, 0.0F);  // with the padding of copy_node
  reached_.assign(most_reached + 1, 0.0F);
  sum_.assign(std::max(most_own, most_reached) + 1, 0.0F);
}

FloatPanel FrontalFactor::inverse(const Place& front) const {
  const std::size_t own = std::size_t{3} * front.own;
  return {numbers_.data() + front.inverse, padded(own), own};
}

FloatPanel FrontalFactor::passed(const Place& front) const {
  return {numbers_.data() + front.passed, padded(std::size_t{3} * front.count),
          std::size_t{3} * front.own};
}

bool FrontalFactor::factorise(std::span<const Eigen::Matrix3d> diagonal,
                              std::span<const Eigen::Matrix3d> across) {
  Elimination elimination(*pattern_, diagonal, across);
  for (std::size_t f = 0; f < front_.size(); ++f) {
    if (!elimination.eliminate(f)) return false;
    put(elimination.inverse, numbers_.data() + front_[f].inverse);
    put(elimination.down, numbers_.data() + front_[f].passed);
  }
  return true;
}

void FrontalFactor::solve(float* x) noexcept {
  for (const Place& front : front_) {
    if (front.count == 0) continue;
    for (std::size_t i = 0; i < front.own; ++i) {
      copy_node(x + 4 * (front.first + i), own_.data() + 3 * i);
    }
    kernels_.times(passed(front), own_.data(), sum_.data());
    const std::uint32_t* const row = row_.data() + front.rows;
    for (std::size_t i = 0; i < front.count; ++i) {
      float* const to = x + std::size_t{4} * row[i];
      Four sum = four_at(sum_.data() + 3 * i);
      sum[3] = 0.0F;
      const Four left = four_at(to) - sum;
      std::memcpy(to, &left, sizeof(Four));
    }
  }
  for (std::size_t f = front_.size(); f-- > 0;) {
    const Place& front = front_[f];
    for (std::size_t i = 0; i < front.own; ++i) {
      copy_node(x + 4 * (front.first + i), own_.data() + 3 * i);
    }
    kernels_.times(inverse(front), own_.data(), sum_.data());
    if (front.count > 0) {
      const FloatPanel down = passed(front);
      const std::uint32_t* const row = row_.data() + front.rows;
      for (std::size_t i = 0; i < front.count; ++i) {
        copy_node(x + std::size_t{4} * row[i], reached_.data() + 3 * i);
      }
      std::fill(reached_.begin() + std::ptrdiff_t{3} * front.count,
                reached_.begin() + static_cast<std::ptrdiff_t>(down.stride), 0.0F);
      kernels_.subtract_transposed(down, reached_.data(), sum_.data());
    }
    for (std::size_t i = 0; i < front.own; ++i) {
      std::memcpy(x + 4 * (front.first + i), sum_.data() + 3 * i, kNode);
    }
  }
}

}  // namespace tpm
