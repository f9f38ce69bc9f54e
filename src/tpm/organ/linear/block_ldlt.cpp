#include "tpm/organ/linear/block_ldlt.hpp"

#include <algorithm>
#include <stdexcept>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/wide_vectors.hpp"
#include "tpm/work/parallel.hpp"

namespace tpm::organ {
namespace {

constexpr std::size_t kSlack = 16;  // numbers that rounded-up tiles may touch behind an array
constexpr std::size_t kWorthThreads = 2'000'000;  // multiplications of a product

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

/// Minus the inverse of the unit lower triangle with 3x3 blocks on its diagonal, by columns.
void invert_lower(const DensePanel& block, std::size_t size, const DensePanel& to) {
  double* const inverse = to.numbers;
  const std::size_t columns = to.stride;
  const double* const l = block.numbers;
  const std::size_t stride = block.stride;
  std::fill_n(inverse, columns * columns, 0.0);
  run_wide([=]() __attribute__((always_inline)) {
    for (std::size_t j = 0; j < size; ++j) {
      double* const x = inverse + j * columns;
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

}  // namespace

BlockLdlt::BlockLdlt(const BlockPattern& pattern, bool portable)
    : pattern_(pattern),
      update_(dense_update(portable)),
      panels_(pattern.panel_numbers_ + kSlack),
      stacks_{ZeroedNumbers(pattern.stack_numbers_[0] + kSlack),
              ZeroedNumbers(pattern.stack_numbers_[1] + kSlack)},
      pivot_(pattern.nodes()),
      inverse_(pattern.nodes()),
      permuted_(3, static_cast<Eigen::Index>(pattern.nodes())),
      local_(pattern.longest_front_) {
  for (const BlockPattern::Part& part : pattern.parts_) scratch_.emplace_back(part.longest);
  scratch_.emplace_back(pattern.longest_front_);
}

BlockLdlt::Scratch::Scratch(std::size_t longest)
    : scaled(longest * BlockPattern::kTogether + kSlack),
      lower_inverse(BlockPattern::kTogether * BlockPattern::kTogether) {}

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
      for (std::ptrdiff_t column = 0; column < 3; ++column, to += work.panel.stride) {
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

bool BlockLdlt::invert_pivot(std::uint32_t place, Scratch& scratch) {
  const Eigen::Matrix3d& pivot = pivot_[place];
  if (!pivot.allFinite()) return false;
  scratch.negative += negative_eigenvalues(pivot);
  bool invertible = false;
  pivot.computeInverseWithCheck(inverse_[place], invertible, 0.0);
  return invertible;
}

/// Eliminates a block on the diagonal within itself: L stands below the 3x3 pivots afterwards.
bool BlockLdlt::eliminate_diagonal(const DensePanel& block, std::size_t size, std::uint32_t place,
                                   Scratch& scratch) {
  double* const a = block.numbers;
  const std::size_t stride = block.stride;
  for (std::size_t k = 0; k < size; k += 3, ++place) {
    Eigen::Matrix3d& pivot = pivot_[place];
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t i = 0; i < 3; ++i) {
        // Entries above the diagonal have no meaning.
        pivot(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            a[(k + std::min(i, j)) * stride + k + std::max(i, j)];
      }
    }
    if (!invert_pivot(place, scratch)) return false;
    // The columns of the node as they are: L D.
    double* const rest = scratch.scaled.data();
    for (std::size_t j = 0; j < 3; ++j) {
      std::copy_n(a + (k + j) * stride, size, rest + j * BlockPattern::kTogether);
    }
    const double* const inverse = inverse_[place].data();
    run_wide([=]() __attribute__((always_inline)) {
      const double* const r0 = rest;
      const double* const r1 = rest + BlockPattern::kTogether;
      const double* const r2 = rest + 2 * BlockPattern::kTogether;
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

/// Calls f(first, end) for stretches of rows that begin at multiples of DenseUpdate::kRows, on more
/// threads than one if there are multiplications enough.
template <class Function>
void BlockLdlt::for_rows(std::size_t rows, std::size_t multiplications, const Function& f) const {
  if (pattern_.parts_.empty() || multiplications < kWorthThreads) return f(std::size_t{0}, rows);
  constexpr std::size_t kRows = DenseUpdate::kRows;
  for_each_in_parallel((rows + kRows - 1) / kRows,
                       [&](std::size_t i) { f(i * kRows, std::min((i + 1) * kRows, rows)); });
}

/// Each number of the product is computed as by one thread.
void BlockLdlt::multiply(const DenseUpdate::Product& product) const {
  for_rows(product.rows, product.rows * product.columns * product.depth,
           [&](std::size_t first, std::size_t end) {
             DenseUpdate::Product rows = product;
             rows.first_row = first;
             rows.rows = end;
             update_.run(rows);
           });
}

bool BlockLdlt::eliminate(const Work& work, Scratch& scratch) {
  const std::size_t size = work.own + work.reached;
  const std::size_t stride = work.panel.stride;
  const DensePanel inverse{scratch.lower_inverse.data(), BlockPattern::kTogether};
  for (std::size_t k = 0; k < work.own; k += BlockPattern::kTogether) {
    const std::size_t columns = std::min(BlockPattern::kTogether, work.own - k);
    const DensePanel block{work.panel.numbers + k * stride + k, stride};
    const std::uint32_t place = work.first + static_cast<std::uint32_t>(k / 3);
    if (!eliminate_diagonal(block, columns, place, scratch)) return false;
    const std::size_t below = size - k - columns;
    if (below == 0) continue;
    invert_lower(block, columns, inverse);
    // L D = A L^-T of what is on the diagonal; then L, over A.
    const DensePanel scaled{scratch.scaled.data(), BlockPattern::up_to_four(below)};
    const DensePanel lower{block.numbers + columns, stride};
    for_rows(below, below * columns * columns, [&](std::size_t first, std::size_t end) {
      update_.run({.c = scaled,
                   .a = lower,
                   .b = inverse,
                   .first_row = first,
                   .rows = end,
                   .columns = columns,
                   .depth = columns,
                   .b_triangular = true,
                   .overwrite = true});
      scale_columns({scaled.numbers + first, scaled.stride}, end - first, columns, place,
                    {lower.numbers + first, stride});
    });
    const std::size_t own_left = work.own - k - columns;
    multiply({.c = {lower.numbers + columns * stride, stride},
              .a = lower,
              .b = scaled,
              .rows = below,
              .columns = own_left,
              .depth = columns,
              .lower = true});
    multiply({.c = work.update,
              .a = {lower.numbers + own_left, stride},
              .b = {scaled.numbers + own_left, scaled.stride},
              .rows = work.reached,
              .columns = work.reached,
              .depth = columns,
              .lower = true});
  }
  return true;
}

void BlockLdlt::eliminate_front(const BlockMatrix& matrix, std::size_t front, Scratch& scratch) {
  const Work work = work_on(front);
  gather(matrix, front, work);
  scratch.done = eliminate(work, scratch);
}

bool BlockLdlt::factorise(const BlockMatrix& matrix) {
  negative_ = 0;
  for (Scratch& scratch : scratch_) {
    scratch.negative = 0;
    scratch.done = true;
  }
  const auto& parts = pattern_.parts_;
  if (!parts.empty()) {
    for_each_in_parallel(parts.size(), [&](std::size_t p) {
      for (std::uint32_t f = parts[p].first; f < parts[p].end && scratch_[p].done; ++f) {
        eliminate_front(matrix, f, scratch_[p]);
      }
    });
  }
  const auto done = [](const Scratch& scratch) { return scratch.done; };
  if (!std::all_of(scratch_.begin(), scratch_.end(), done)) return false;
  Scratch& last = scratch_.back();
  for (const std::uint32_t f : pattern_.after_) {
    eliminate_front(matrix, f, last);
    if (!last.done) return false;
  }
  for (const Scratch& scratch : scratch_) negative_ += scratch.negative;
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

}  // namespace tpm::organ
