#include "tpm/organ/body/known_margins.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace tpm::organ {

namespace {

constexpr double kCoarsest = 2.0;  // cells, in spacings; each next grid is half as wide
constexpr double kRoundingOfSpacing = 1e-9;

}  // namespace

KnownMargins::KnownMargins(const Surface& surface, double spacing)
    : surface_(surface),
      corner_(surface.bounds().min()),
      rounding_(kRoundingOfSpacing * spacing),
      finest_(kCoarsest * spacing / static_cast<double>(1 << (kGrids - 1))) {}

KnownMargins::Cells KnownMargins::cells_of(const Eigen::Vector3d& point) const {
  constexpr int kBits = 21;
  constexpr std::int64_t kMiddle = std::int64_t{1} << (kBits - 1);
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
  Cells cells{};
  for (int axis = 0; axis < 3; ++axis) {
    auto at = static_cast<std::int64_t>(std::floor((point[axis] - corner_[axis]) / finest_));
    for (std::size_t grid = kGrids; grid-- > 0; at >>= 1) {
      cells[grid] = (cells[grid] << kBits) | (static_cast<std::uint64_t>(at + kMiddle) & kMask);
    }
  }
  return cells;
}

std::size_t KnownMargins::Table::slot_of(std::uint64_t cell) const {
  constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15;  // spreads neighbours
  std::size_t slot = (cell * kGolden) >> shift_;
  while (slots_[slot].cell != cell && slots_[slot].cell != kNoCell) {
    slot = (slot + 1) & (slots_.size() - 1);
  }
  return slot;
}

const std::uint32_t* KnownMargins::Table::find(std::uint64_t cell) const {
  if (slots_.empty()) return nullptr;
  const Slot& slot = slots_[slot_of(cell)];
  return slot.cell == cell ? &slot.number : nullptr;
}

void KnownMargins::Table::set(std::uint64_t cell, std::uint32_t number) {
  if (2 * taken_ >= slots_.size()) grow();
  Slot& slot = slots_[slot_of(cell)];
  if (slot.cell == kNoCell) ++taken_;
  slot = {cell, number};
}

void KnownMargins::Table::grow() {
  constexpr std::size_t kFirst = 1024;
  const std::vector<Slot> before = std::move(slots_);
  slots_ = std::vector<Slot>(std::max(kFirst, 2 * before.size()));
  shift_ = 64 - std::countr_zero(slots_.size());
  for (const Slot& slot : before) {
    if (slot.cell != kNoCell) slots_[slot_of(slot.cell)] = slot;
  }
}

double KnownMargins::margin(const Eigen::Vector3d& point, double least) {
  const Cells cells = cells_of(point);
  for (std::size_t grid = 0; grid < kGrids; ++grid) {
    const std::uint32_t* found = last_[grid].find(cells[grid]);
    if (found == nullptr) break;  // nor in a finer one
    const Asked& beside = asked_[*found];
    const double margin = beside.depth - least;
    const double sure = std::abs(margin) - (beside.point - point).norm() - rounding_;
    if (sure > 0.0) return std::copysign(sure, margin);
  }
  const auto number = static_cast<std::uint32_t>(asked_.size());
  asked_.push_back({point, -surface_.signed_distance(point)});
  for (std::size_t grid = 0; grid < kGrids; ++grid) last_[grid].set(cells[grid], number);
  return asked_.back().depth - least;
}

}  // namespace tpm::organ
