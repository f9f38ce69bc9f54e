#include "tpm/organ/linear/block_pattern.hpp"

#include <algorithm>
#include <stdexcept>

namespace tpm::organ {
namespace {

/// About as many parts as this. 4 to 16 take the same time on two processors; each has stacks of
/// its own, so that more take more memory.
constexpr double kParts = 8;

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
  choose_parts();
  lay_out();
}

/// A part is worth a thread of its own, and there are enough of them for a few threads to share.
void BlockPattern::choose_parts() {
  const auto fronts = fronts_.fronts();
  std::vector<double> below(fronts.size(), 0.0);  // products of a front and of all below it
  std::vector<std::uint32_t> first(fronts.size());
  for (std::uint32_t f = 0; f < fronts.size(); ++f) {
    const std::size_t own = fronts[f].own;
    std::size_t products = 0;
    for (std::size_t i = 0; i < own; ++i) {
      const std::size_t left = own - 1 - i + fronts[f].count;
      products += left * (left + 1) / 2;
    }
    products_ += products;
    below[f] = static_cast<double>(products);
    first[f] = f;
    for (const std::uint32_t c : fronts_.child(fronts[f])) {
      below[f] += below[c];
      first[f] = std::min(first[f], first[c]);
    }
  }
  if (products_ >= products_worth_threads()) {
    const auto all = static_cast<double>(products_);
    for (std::uint32_t f = 0; f < fronts.size(); ++f) {
      const bool whole = below[f] <= all / kParts;
      const std::uint32_t parent = fronts[f].parent;
      const bool of_larger = parent != f && below[parent] <= all / kParts;
      if (whole && !of_larger && below[f] >= all / (kParts * kParts)) {
        parts_.push_back({first[f], f + 1});
      }
    }
  }
  std::uint32_t next = 0;
  for (const Part& part : parts_) {
    for (; next < part.first; ++next) after_.push_back(next);
    next = part.end;
  }
  for (; next < fronts.size(); ++next) after_.push_back(next);
}

void BlockPattern::lay_out() {
  layout_.resize(fronts_.fronts().size());
  // The remainder of a part waits until a later front takes it: each has stacks of its own.
  std::array<std::size_t, 2> bottom{};
  for (Part& part : parts_) {
    std::array<std::size_t, 2> top = bottom;
    for (std::uint32_t f = part.first; f < part.end; ++f) {
      lay_out(f, top, bottom);
      part.longest = std::max(part.longest, layout_[f].stride);
    }
    bottom = stack_numbers_;
    panel_numbers_ += 4;  // rounded-up tiles may touch what follows, which is another thread's
  }
  std::array<std::size_t, 2> top = bottom;
  for (const std::uint32_t f : after_) lay_out(f, top, bottom);
}

void BlockPattern::lay_out(std::uint32_t f, std::array<std::size_t, 2>& top,
                           const std::array<std::size_t, 2>& bottom) {
  const EliminationFronts::Front& front = fronts_.fronts()[f];
  const std::size_t own = front.own;
  const std::size_t count = front.count;
  factor_blocks_ += own * (own - 1) / 2 + own * count;
  Layout& layout = layout_[f];
  layout.panel = panel_numbers_;
  layout.stride = up_to_four(3 * (own + count));
  layout.update_stride = up_to_four(3 * count);
  panel_numbers_ += layout.stride * 3 * own;
  longest_front_ = std::max(longest_front_, layout.stride);
  // The children's updates are the last ones on the stack of the other parity.
  const std::size_t parity = front.depth % 2;
  const std::size_t other = 1 - parity;
  layout.update = top[parity];
  top[parity] += layout.update_stride * 3 * count;
  stack_numbers_[parity] = std::max(stack_numbers_[parity], top[parity]);
  for (const std::uint32_t c : fronts_.child(front)) {
    if (layout_[c].update >= bottom[other]) top[other] = std::min(top[other], layout_[c].update);
  }
}

std::size_t BlockPattern::factor_bytes() const {
  std::size_t longest = longest_front_;
  for (const Part& part : parts_) longest += part.longest;
  const std::size_t numbers = panel_numbers_ + stack_numbers_[0] + stack_numbers_[1] +
                              longest * kTogether + longest_front_ + 21 * nodes();
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

}  // namespace tpm::organ
