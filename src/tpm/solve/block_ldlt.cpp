#include "tpm/solve/block_ldlt.hpp"

#include <algorithm>
#include <stdexcept>

#include "tpm/core/dense_algebra.hpp"
#include "tpm/core/wide_vectors.hpp"

namespace tpm {
namespace {

constexpr std::size_t kTogether = 48;  // columns eliminated at a time: a multiple of 12
constexpr std::size_t kSlack = 16;     // numbers that rounded-up tiles may touch behind an array

std::size_t up_to_four(std::size_t size) {
  return (size + 3) / 4 * 4;
}

/// v[begin..end) -= the three columns of a node times the values of the node.
[[gnu::always_inline]] inline void subtract_node(const double* column, std::size_t stride,
                                                 std::size_t begin, std::size_t end,
                                                 const double* value, double* __restrict v) {
  const double* const __restrict c0 = column;
  const double* const __restrict c1 = column + stride;
  const double* const __restrict c2 = column + 2 * stride;
  const double v0 = value[0], v1 = value[1], v2 = value[2];
  for (std::size_t i = begin; i < end; ++i) v[i] -= c0[i] * v0 + c1[i] * v1 + c2[i] * v2;
}

/// The products of the three columns of a node with v[begin..end): sums of every fourth row, so
/// that all processors add in one order.
[[gnu::always_inline]] inline void node_products(const double* column, std::size_t stride,
                                                 std::size_t begin, std::size_t end,
                                                 const double* v, double* product) {
  double sum[3][4] = {};
  std::size_t i = begin;
  for (; i + 4 <= end; i += 4) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t k = 0; k < 4; ++k) sum[c][k] += column[c * stride + i + k] * v[i + k];
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    product[c] = (sum[c][0] + sum[c][1]) + (sum[c][2] + sum[c][3]);
    for (std::size_t rest = i; rest < end; ++rest)
      product[c] += column[c * stride + rest] * v[rest];
  }
}

/// Of a symmetric matrix: none if its pivots are positive, else by their values.
std::size_t negative_eigenvalues(const Eigen::Matrix3d& matrix) {
  const double first = matrix(0, 0);
  const double second = matrix(1, 1) - matrix(1, 0) * matrix(1, 0) / first;
  if (first > 0.0 && second > 0.0) {
    const double across = matrix(2, 1) - matrix(2, 0) * matrix(1, 0) / first;
    const double third =
        matrix(2, 2) - matrix(2, 0) * matrix(2, 0) / first - across * across / second;
    if (third > 0.0) return 0;
  }
  return static_cast<std::size_t>((symmetric_eigenvalues(matrix).array() < 0.0).count());
}

}  // namespace

BlockPattern::BlockPattern(std::size_t nodes, std::span<const std::array<std::uint32_t, 2>> edges)
    : fronts_(nodes, edges), node_of_(nodes), column_(nodes + 1, 0) {
  const std::span<const std::uint32_t> order = fronts_.place();
  for (std::uint32_t node = 0; node < nodes; ++node) node_of_[order[node]] = node;
  std::vector<std::array<std::uint32_t, 2>> blocks;  // column, row
  blocks.reserve(edges.size());
  for (const auto& [a, b] : edges) {
    const auto [low, high] = std::minmax(order[a], order[b]);
    blocks.push_back({low, high});
  }
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  row_.reserve(blocks.size());
  for (const auto& [column, row] : blocks) {
    row_.push_back(row);
    ++column_[column + 1];
  }
  for (std::size_t i = 0; i < nodes; ++i) column_[i + 1] += column_[i];
  front_row_.resize(row_.size());
  for (const auto& front : fronts_.fronts()) {
    const std::span<const std::uint32_t> rows = fronts_.row(front);
    for (std::uint32_t p = column_[front.first]; p < column_[front.first + front.own]; ++p) {
      const std::uint32_t end = front.first + front.own;
      front_row_[p] =
          row_[p] < end
              ? row_[p] - front.first
              : front.own + static_cast<std::uint32_t>(
                                std::lower_bound(rows.begin(), rows.end(), row_[p]) - rows.begin());
    }
  }
  lay_out();
}

void BlockPattern::lay_out() {
  std::array<std::size_t, 2> top{};
  for (const auto& front : fronts_.fronts()) {
    const std::size_t own = front.own;
    const std::size_t count = front.count;
    factor_blocks_ += own * (own - 1) / 2 + own * count;
    for (std::size_t i = 0; i < own; ++i) {
      const std::size_t below = own - 1 - i + count;
      products_ += below * (below + 1) / 2;
    }
    Layout layout;
    layout.panel = panel_numbers_;
    layout.stride = up_to_four(3 * (own + count));
    layout.update_stride = up_to_four(3 * count);
    panel_numbers_ += layout.stride * 3 * own;
    longest_front_ = std::max(longest_front_, layout.stride);
    // The children's updates are the last ones on the stack of the other parity.
    std::size_t& here = top[front.depth % 2];
    std::size_t& below = top[(front.depth + 1) % 2];
    layout.update = here;
    here += layout.update_stride * 3 * count;
    stack_numbers_[front.depth % 2] = std::max(stack_numbers_[front.depth % 2], here);
    for (const std::uint32_t c : fronts_.child(front)) {
      below = std::min(below, layout_[c].update);
    }
    layout_.push_back(layout);
  }
}

std::size_t BlockPattern::factor_bytes() const {
  const std::size_t numbers = panel_numbers_ + stack_numbers_[0] + stack_numbers_[1] +
                              longest_front_ * (kTogether + 1) + 21 * nodes();
  return numbers * sizeof(double);
}

BlockPattern::Place BlockPattern::place(std::uint32_t a, std::uint32_t b) const {
  if (std::max(a, b) >= nodes()) throw std::out_of_range("a node that is none");
  const std::span<const std::uint32_t> order = fronts_.place();
  const auto [low, high] = std::minmax(order[a], order[b]);
  const auto begin = row_.begin() + column_[low];
  const auto end = row_.begin() + column_[low + 1];
  const auto found = std::lower_bound(begin, end, high);
  if (found == end || *found != high) throw std::out_of_range("nodes that are not neighbours");
  return {static_cast<std::uint32_t>(found - row_.begin()), order[a] == low};
}

void BlockMatrix::set_zero() {
  std::fill(diagonal.begin(), diagonal.end(), Eigen::Matrix3d::Zero());
  std::fill(below.begin(), below.end(), Eigen::Matrix3d::Zero());
}

BlockLdlt::BlockLdlt(const BlockPattern& pattern, bool portable)
    : pattern_(pattern),
      update_(dense_update(portable)),
      panels_(pattern.panel_numbers_ + kSlack),
      stacks_{ZeroedNumbers(pattern.stack_numbers_[0] + kSlack),
              ZeroedNumbers(pattern.stack_numbers_[1] + kSlack)},
      pivot_(pattern.nodes()),
      inverse_(pattern.nodes()),
      scaled_(pattern.longest_front_ * kTogether + kSlack),
      lower_inverse_(kTogether * kTogether),
      permuted_(3, static_cast<Eigen::Index>(pattern.nodes())),
      local_(pattern.longest_front_) {}

BlockLdlt::Work BlockLdlt::work_on(std::size_t front) {
  const EliminationFronts::Front& f = pattern_.fronts_.fronts()[front];
  const BlockPattern::Layout& layout = pattern_.layout_[front];
  return {{panels_.data() + layout.panel, layout.stride},
          {stacks_[f.depth % 2].data() + layout.update, layout.update_stride},
          f.first,
          std::size_t{3} * f.own,
          std::size_t{3} * f.count};
}

void BlockLdlt::gather(const BlockMatrix& matrix, std::size_t front, const Work& work) {
  std::fill_n(work.panel.numbers, work.panel.stride * work.own, 0.0);
  for (std::size_t j = 0; j < work.reached; ++j) {
    const std::size_t begin = j / 4 * 4;
    double* const column = work.update.numbers + j * work.update.stride;
    std::fill(column + begin, column + work.update.stride, 0.0);
  }
  const EliminationFronts::Front& f = pattern_.fronts_.fronts()[front];
  for (std::uint32_t i = 0; i < f.own; ++i) {
    const auto put = [&](const Eigen::Matrix3d& block, std::uint32_t row) {
      double* to = work.panel.numbers + 3 * (i * work.panel.stride + row);
      for (int column = 0; column < 3; ++column, to += work.panel.stride) {
        std::copy_n(block.data() + 3 * column, 3, to);
      }
    };
    const std::uint32_t place = f.first + i;
    put(matrix.diagonal[pattern_.node_of_[place]], i);
    for (std::uint32_t p = pattern_.column_[place]; p < pattern_.column_[place + 1]; ++p) {
      put(matrix.below[p], pattern_.front_row_[p]);
    }
  }
  for (const std::uint32_t c : pattern_.fronts_.child(f)) {
    add_child(pattern_.fronts_.fronts()[c], work_on(c).update, work);
  }
}

void BlockLdlt::add_child(const EliminationFronts::Front& child, const DensePanel& from,
                          const Work& work) {
  const std::span<const std::uint32_t> at = pattern_.fronts_.row_in_parent(child);
  const auto own = static_cast<std::uint32_t>(work.own / 3);
  for (std::size_t j = 0; j < at.size(); ++j) {
    // A column of the panel takes all rows, one of what is left to the parent only rows behind it.
    const bool to_panel = at[j] < own;
    const DensePanel& into = to_panel ? work.panel : work.update;
    const std::uint32_t first = to_panel ? 0 : own;
    double* column = into.numbers + std::size_t{3} * (at[j] - first) * into.stride;
    const double* source = from.numbers + 3 * j * from.stride;
    for (int k = 0; k < 3; ++k, column += into.stride, source += from.stride) {
      for (std::size_t i = j; i < at.size(); ++i) {
        double* const to = column + std::size_t{3} * (at[i] - first);
        to[0] += source[3 * i];
        to[1] += source[3 * i + 1];
        to[2] += source[3 * i + 2];
      }
    }
  }
}

bool BlockLdlt::invert_pivot(std::uint32_t place) {
  const Eigen::Matrix3d& pivot = pivot_[place];
  if (!pivot.allFinite()) return false;
  negative_ += negative_eigenvalues(pivot);
  bool invertible = false;
  pivot.computeInverseWithCheck(inverse_[place], invertible, 0.0);
  return invertible;
}

/// Eliminates a block on the diagonal within itself: L stands below the 3x3 pivots afterwards.
bool BlockLdlt::eliminate_diagonal(const DensePanel& block, std::size_t size, std::uint32_t place) {
  double* const a = block.numbers;
  const std::size_t stride = block.stride;
  for (std::size_t k = 0; k < size; k += 3, ++place) {
    Eigen::Matrix3d& pivot = pivot_[place];
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t i = 0; i < 3; ++i) {
        // What stands above the diagonal has no meaning.
        pivot(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            a[(k + std::min(i, j)) * stride + k + std::max(i, j)];
      }
    }
    if (!invert_pivot(place)) return false;
    // The columns of the node as they are: L D.
    double* const rest = scaled_.data();
    for (std::size_t j = 0; j < 3; ++j) {
      std::copy_n(a + (k + j) * stride, size, rest + j * kTogether);
    }
    const double* const inverse = inverse_[place].data();
    run_wide([=]() __attribute__((always_inline)) {
      const double* const r0 = rest;
      const double* const r1 = rest + kTogether;
      const double* const r2 = rest + 2 * kTogether;
      for (std::size_t j = 0; j < 3; ++j) {
        double* const l = a + (k + j) * stride;
        const double* const factor = inverse + 3 * j;
        for (std::size_t i = k + 3; i < size; ++i) {
          l[i] = r0[i] * factor[0] + r1[i] * factor[1] + r2[i] * factor[2];
        }
      }
      const double* const l0 = a + k * stride;
      const double* const l1 = l0 + stride;
      const double* const l2 = l1 + stride;
      for (std::size_t j = k + 3; j < size; ++j) {
        double* const to = a + j * stride;
        const double f0 = r0[j], f1 = r1[j], f2 = r2[j];
        for (std::size_t i = j / 3 * 3; i < size; ++i) {
          to[i] -= l0[i] * f0 + l1[i] * f1 + l2[i] * f2;
        }
      }
    });
  }
  return true;
}

/// Minus the inverse of the unit lower triangle with 3x3 blocks on its diagonal, by columns.
void BlockLdlt::invert_lower(const DensePanel& block, std::size_t size) {
  double* const inverse = lower_inverse_.data();
  const double* const l = block.numbers;
  const std::size_t stride = block.stride;
  std::fill(lower_inverse_.begin(), lower_inverse_.end(), 0.0);
  run_wide([=]() __attribute__((always_inline)) {
    for (std::size_t j = 0; j < size; ++j) {
      double* const x = inverse + j * kTogether;
      x[j] = -1.0;
      for (std::size_t k = j / 3 * 3; k + 3 < size; k += 3) {
        const double* const l0 = l + k * stride;
        const double* const l1 = l0 + stride;
        const double* const l2 = l1 + stride;
        const double f0 = x[k], f1 = x[k + 1], f2 = x[k + 2];
        for (std::size_t i = k + 3; i < size; ++i) {
          x[i] -= l0[i] * f0 + l1[i] * f1 + l2[i] * f2;
        }
      }
    }
  });
}

/// Columns of L D times D^-1.
void BlockLdlt::scale_columns(const DensePanel& from, std::size_t rows, std::size_t columns,
                              std::uint32_t place, const DensePanel& to) const {
  const Eigen::Matrix3d* const inverse = inverse_.data() + place;
  run_wide([=]() __attribute__((always_inline)) {
    for (std::size_t k = 0; k < columns; k += 3) {
      const double* const r0 = from.numbers + k * from.stride;
      const double* const r1 = r0 + from.stride;
      const double* const r2 = r1 + from.stride;
      for (std::size_t j = 0; j < 3; ++j) {
        double* const l = to.numbers + (k + j) * to.stride;
        const double* const factor = inverse[k / 3].data() + 3 * j;
        for (std::size_t i = 0; i < rows; ++i) {
          l[i] = r0[i] * factor[0] + r1[i] * factor[1] + r2[i] * factor[2];
        }
      }
    }
  });
}

bool BlockLdlt::eliminate(const Work& work) {
  const std::size_t size = work.own + work.reached;
  const std::size_t stride = work.panel.stride;
  for (std::size_t k = 0; k < work.own; k += kTogether) {
    const std::size_t columns = std::min(kTogether, work.own - k);
    const DensePanel block{work.panel.numbers + k * stride + k, stride};
    const std::uint32_t place = work.first + static_cast<std::uint32_t>(k / 3);
    if (!eliminate_diagonal(block, columns, place)) return false;
    const std::size_t below = size - k - columns;
    if (below == 0) continue;
    invert_lower(block, columns);
    // L D = A L^-T of what is on the diagonal; then L, over A.
    const DensePanel scaled{scaled_.data(), up_to_four(below)};
    const DensePanel lower{block.numbers + columns, stride};
    update_.run({.c = scaled,
                 .a = lower,
                 .b = {lower_inverse_.data(), kTogether},
                 .rows = below,
                 .columns = columns,
                 .depth = columns,
                 .b_triangular = true,
                 .overwrite = true});
    scale_columns(scaled, below, columns, place, lower);
    const std::size_t own_left = work.own - k - columns;
    update_.run({.c = {lower.numbers + columns * stride, stride},
                 .a = lower,
                 .b = scaled,
                 .rows = below,
                 .columns = own_left,
                 .depth = columns,
                 .lower = true});
    update_.run({.c = work.update,
                 .a = {lower.numbers + own_left, stride},
                 .b = {scaled.numbers + own_left, scaled.stride},
                 .rows = work.reached,
                 .columns = work.reached,
                 .depth = columns,
                 .lower = true});
  }
  return true;
}

bool BlockLdlt::factorise(const BlockMatrix& matrix) {
  negative_ = 0;
  for (std::size_t f = 0; f < pattern_.layout_.size(); ++f) {
    const Work work = work_on(f);
    gather(matrix, f, work);
    if (!eliminate(work)) return false;
  }
  return true;
}

// A Ref is a view: what it shows is changed.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
void BlockLdlt::solve(Eigen::Ref<Eigen::Matrix3Xd> x) const {
  const EliminationFronts& fronts = pattern_.fronts_;
  Eigen::Matrix3Xd& permuted = permuted_;
  const auto n = static_cast<std::uint32_t>(pattern_.nodes());
  for (std::uint32_t p = 0; p < n; ++p) permuted.col(p) = x.col(pattern_.node_of_[p]);
  double* const y = permuted.data();
  double* const v = local_.data();
  for (std::size_t f = 0; f < fronts.fronts().size(); ++f) {
    const EliminationFronts::Front& front = fronts.fronts()[f];
    const std::span<const std::uint32_t> rows = fronts.row(front);
    const double* const panel = panels_.data() + pattern_.layout_[f].panel;
    const std::size_t stride = pattern_.layout_[f].stride;
    const std::size_t own = std::size_t{3} * front.own;
    const std::size_t size = own + 3 * rows.size();
    std::copy_n(y + std::size_t{3} * front.first, own, v);
    std::fill(v + own, v + size, 0.0);
    run_wide([=]() __attribute__((always_inline)) {
      for (std::size_t k = 0; k < own; k += 3) {
        subtract_node(panel + k * stride, stride, k + 3, size, v + k, v);
      }
    });
    std::copy_n(v, own, y + std::size_t{3} * front.first);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) y[std::size_t{3} * rows[i] + k] += v[own + 3 * i + k];
    }
  }
  for (std::size_t f = fronts.fronts().size(); f-- > 0;) {
    const EliminationFronts::Front& front = fronts.fronts()[f];
    const std::span<const std::uint32_t> rows = fronts.row(front);
    const double* const panel = panels_.data() + pattern_.layout_[f].panel;
    const std::size_t stride = pattern_.layout_[f].stride;
    const std::size_t own = std::size_t{3} * front.own;
    const std::size_t size = own + 3 * rows.size();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      std::copy_n(y + std::size_t{3} * rows[i], 3, v + own + 3 * i);
    }
    const Eigen::Matrix3d* const inverse = inverse_.data() + front.first;
    double* const to = y + std::size_t{3} * front.first;
    run_wide([=]() __attribute__((always_inline)) {
      for (std::size_t k = own; k > 0;) {
        k -= 3;
        double product[3];
        node_products(panel + k * stride, stride, k + 3, size, v, product);
        const double* const d = inverse[k / 3].data();
        for (std::size_t i = 0; i < 3; ++i) {
          v[k + i] = d[i] * to[k] + d[3 + i] * to[k + 1] + d[6 + i] * to[k + 2] - product[i];
        }
      }
    });
    std::copy_n(v, own, to);
  }
  for (std::uint32_t p = 0; p < n; ++p) x.col(pattern_.node_of_[p]) = permuted.col(p);
}

}  // namespace tpm
