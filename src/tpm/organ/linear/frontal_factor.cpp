#include "tpm/organ/linear/frontal_factor.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstring>

namespace tpm::organ {
namespace {

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
  using Front = EliminationFronts::Front;

  Elimination(const EliminationFronts& fronts, std::span<const Eigen::Matrix3d> diagonal,
              std::span<const EliminationFronts::Edge> edges,
              std::span<const Eigen::Matrix3d> across)
      : fronts_(fronts),
        across_(across),
        pivot_(fronts.nodes()),
        entries_(fronts.nodes()),
        passed_(fronts.fronts().size()) {
    const std::span<const std::uint32_t> place = fronts.place();
    for (std::size_t n = 0; n < fronts.nodes(); ++n) pivot_[place[n]] = diagonal[n];
    std::size_t edge = 0;
    for (const auto& [a, b] : edges) {
      const auto [low, high] = std::minmax(place[a], place[b]);
      entries_[low].push_back({high, low, edge++, place[a] == low});
    }
  }

  /// False if the front's pivot is not positive definite.
  [[nodiscard]] bool eliminate(std::size_t number) {
    const Front& front = fronts_.fronts()[number];
    const auto own = Index{3} * front.own;
    const auto reached = Index{3} * front.count;
    dense_.setZero(own + reached, own + reached);
    add_matrix(front);
    for (const std::uint32_t child : fronts_.child(front)) add_passed(child);
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
  [[nodiscard]] Index place_in(const Front& front, std::uint32_t place) const {
    if (place < front.first + front.own) return Index{3} * (place - front.first);
    const std::span<const std::uint32_t> rows = fronts_.row(front);
    return Index{3} * front.own +
           3 * (std::lower_bound(rows.begin(), rows.end(), place) - rows.begin());
  }

  void add_matrix(const Front& front) {
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

  void add_passed(std::uint32_t child) {
    const std::span<const std::uint32_t> at = fronts_.row_in_parent(fronts_.fronts()[child]);
    const Eigen::MatrixXd& from = passed_[child];
    for (std::size_t j = 0; j < at.size(); ++j) {
      for (std::size_t i = 0; i < at.size(); ++i) {
        dense_.block<3, 3>(Index{3} * at[i], Index{3} * at[j]) +=
            from.block<3, 3>(static_cast<Index>(3 * i), static_cast<Index>(3 * j));
      }
    }
    passed_[child].resize(0, 0);
  }

  const EliminationFronts& fronts_;
  std::span<const Eigen::Matrix3d> across_;
  std::vector<Eigen::Matrix3d> pivot_;       ///< by place
  std::vector<std::vector<Entry>> entries_;  ///< by column
  std::vector<Eigen::MatrixXd> passed_;      ///< by each front, to its parent
  Eigen::MatrixXd dense_;
};

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

FrontalFactor::FrontalFactor(std::shared_ptr<const EliminationFronts> fronts, bool portable)
    : fronts_(std::move(fronts)), kernels_(panel_kernels(portable)) {
  std::size_t words = 0;
  std::size_t most_own = 0;
  std::size_t most_reached = 0;
  for (const EliminationFronts::Front& front : fronts_->fronts()) {
    const std::size_t own = std::size_t{3} * front.own;
    const std::size_t reached = std::size_t{3} * front.count;
    const std::size_t inverse = own * PackedPanel::words_of(own);
    front_.push_back({front.first, front.own, front.rows, front.count, words, words + inverse});
    words += inverse + own * PackedPanel::words_of(reached);
    most_own = std::max(most_own, PackedPanel::filled(own));
    most_reached = std::max(most_reached, PackedPanel::filled(reached));
  }
  words_.assign(words, 0);
  own_.assign(most_own + 1, 0.0F);  // with the padding of copy_node
  reached_.assign(most_reached + 1, 0.0F);
  sum_.assign(std::max(most_own, most_reached) + 1, 0.0F);
}

std::size_t FrontalFactor::blocks_read(const EliminationFronts& fronts) {
  std::size_t blocks = 0;
  for (const EliminationFronts::Front& front : fronts.fronts()) {
    blocks += std::size_t{front.own} * (front.own + 2 * front.count);
  }
  return blocks;
}

PackedPanel FrontalFactor::inverse(const Place& front) const {
  const std::size_t own = std::size_t{3} * front.own;
  return {words_.data() + front.inverse, PackedPanel::filled(own), own};
}

PackedPanel FrontalFactor::passed(const Place& front) const {
  return {words_.data() + front.passed, PackedPanel::filled(std::size_t{3} * front.count),
          std::size_t{3} * front.own};
}

bool FrontalFactor::factorise(std::span<const Eigen::Matrix3d> diagonal,
                              std::span<const Edge> edges,
                              std::span<const Eigen::Matrix3d> across) {
  Elimination elimination(*fronts_, diagonal, edges, across);
  for (std::size_t f = 0; f < front_.size(); ++f) {
    if (!elimination.eliminate(f)) return false;
    const std::span<std::uint32_t> words(words_);
    pack_panel(elimination.inverse, words.subspan(front_[f].inverse));
    pack_panel(elimination.down, words.subspan(front_[f].passed));
  }
  return true;
}

void FrontalFactor::solve(float* x) noexcept {
  const std::uint32_t* const all_rows = fronts_->all_rows().data();
  for (const Place& front : front_) {
    if (front.count == 0) continue;
    for (std::size_t i = 0; i < front.own; ++i) {
      copy_node(x + 4 * (front.first + i), own_.data() + 3 * i);
    }
    kernels_.packed_times(passed(front), own_.data(), sum_.data());
    const std::uint32_t* const row = all_rows + front.rows;
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
    kernels_.packed_times(inverse(front), own_.data(), sum_.data());
    if (front.count > 0) {
      const PackedPanel down = passed(front);
      const std::uint32_t* const row = all_rows + front.rows;
      for (std::size_t i = 0; i < front.count; ++i) {
        copy_node(x + std::size_t{4} * row[i], reached_.data() + 3 * i);
      }
      std::fill(reached_.begin() + std::ptrdiff_t{3} * front.count,
                reached_.begin() + static_cast<std::ptrdiff_t>(down.rows), 0.0F);
      kernels_.subtract_packed_transposed(down, reached_.data(), sum_.data());
    }
    for (std::size_t i = 0; i < front.own; ++i) {
      std::memcpy(x + 4 * (front.first + i), sum_.data() + 3 * i, kNode);
    }
  }
}

}  // namespace tpm::organ
