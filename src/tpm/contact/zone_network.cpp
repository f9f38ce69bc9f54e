#include "tpm/contact/zone_network.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/base/require.hpp"
#include "tpm/contact/flush_denormals.hpp"
#include "tpmkit/error.hpp"

namespace tpm::contact {
namespace {

constexpr double kValidZoneError = 0.05;    // error over the largest force
constexpr double kZoneScaleDepth_m = 1e-4;  // at which forces begin to count
constexpr double kUnbalanced = 0.1;         // what is left of the correction for what is unbalanced
constexpr std::size_t kZoneNow = 0, kZoneNext = 4;

void require(const ZoneNetworkOptions& options, const Eigen::Vector3d& into_tissue) {
  require_number(is_positive(options.period_s), "period_s", options.period_s, "a time above 0");
  require_number(options.rings >= 1, "rings", options.rings, "1 or more");
  require_number(is_positive(options.deepest_m), "deepest_m", options.deepest_m, "a depth above 0");
  for (const double depth_m : {options.linear_depth_m, options.frozen_depth_m}) {
    require_number(depth_m >= 0.0 && depth_m <= options.deepest_m, "depth", depth_m,
                   "linear_depth_m and frozen_depth_m from 0 to deepest_m");
  }
  require_number(options.aside_m > 0.0, "aside_m", options.aside_m, "above 0");
  require_number(std::abs(into_tissue.norm() - 1.0) <= 1e-9, "into_tissue", into_tissue.norm(),
                 "a unit vector");
}

std::size_t padded(std::size_t size) {
  return (size + 7) / 8 * 8;
}

}  // namespace

ZoneNetwork::ZoneNetwork(const BondSystem& bonds, const Positions& rest,
                         const Constraints& constraints, const PushedSpheres& contact,
                         const Eigen::Vector3d& into_tissue, const ZoneNetworkOptions& options)
    : options_(options),
      into_(into_tissue),
      kernels_(panel_kernels(options.portable)),
      contact_(contact) {
  require(options, into_tissue);
  require_servo_material(bonds, "the zone");
  PushedContact tissue(bonds, rest, constraints, contact);
  weights_ = servo_weights(bonds, options.period_s);
  instantaneous_ = tissue.fields(rest, tissue.viscous_state(rest, 0.0, 0.0)).stiffness;
  equilibrium_ = tissue.fields(rest, tissue.viscous_state(rest, 0.0, 1.0)).stiffness;
  choose_zone(tissue);
  const Parts parts = build(tissue);
  compare(tissue, constraints, parts);
}

void ZoneNetwork::choose_zone(const PushedContact& tissue) {
  const BondSystem& bonds = tissue.bonds();
  zone_role_.assign(bonds.spheres(), 1);
  for (std::size_t i = 0; i < bonds.spheres(); ++i) {
    if (contact_.has(i) || tissue.constraints().is_free(i)) continue;
    if (!tissue.constraints().projector(i).isZero(0.0)) {
      throw bad_input("sliders", "sphere " + std::to_string(i + 1) + " slides along a line",
                      "spheres that are free or fixed");
    }
    zone_role_[i] = 0;
  }
  for (const std::size_t sphere : contact_) zone_role_[sphere] = 2;
  for (int ring = 0; ring < options_.rings; ++ring) {
    std::vector<char> wider = zone_role_;
    for (std::size_t b = 0; b < bonds.size(); ++b) {
      const std::uint32_t from = bonds.end_a()[b];
      const std::uint32_t to = bonds.end_b()[b];
      if (zone_role_[from] == 2 && zone_role_[to] == 1) wider[to] = 2;
      if (zone_role_[to] == 2 && zone_role_[from] == 1) wider[from] = 2;
    }
    zone_role_ = std::move(wider);
  }
  std::vector<char> at_edge(bonds.spheres(), 0);
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    const std::uint32_t from = bonds.end_a()[b];
    const std::uint32_t to = bonds.end_b()[b];
    if (zone_role_[from] == 2 && zone_role_[to] == 1) at_edge[from] = 1;
    if (zone_role_[to] == 2 && zone_role_[from] == 1) at_edge[to] = 1;
  }
  for (const bool edge : {false, true}) {
    for (std::size_t i = 0; i < bonds.spheres(); ++i) {
      if (zone_role_[i] == 2 && !contact_.has(i) && (at_edge[i] != 0) == edge) zone_.push_back(i);
    }
  }
  edge_ = static_cast<std::size_t>(std::count(at_edge.begin(), at_edge.end(), 1));
  const auto held = static_cast<std::uint32_t>(zone_.size() + 1);
  column_.assign(bonds.spheres(), held);
  for (std::size_t i = 0; i < zone_.size(); ++i) column_[zone_[i]] = static_cast<std::uint32_t>(i);
  for (const std::size_t sphere : contact_) {
    column_[sphere] = static_cast<std::uint32_t>(zone_.size());
  }
  for (std::size_t i = 0; i < bonds.spheres(); ++i) {
    if (zone_role_[i] == 1) outside_.push_back(i);
  }
}

void ZoneNetwork::Dense::put(const Eigen::MatrixXd& matrix) {
  stride = padded(static_cast<std::size_t>(matrix.rows()));
  columns = static_cast<std::size_t>(matrix.cols());
  numbers.assign(stride * columns, 0.0F);
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
      numbers[static_cast<std::size_t>(j) * stride + static_cast<std::size_t>(i)] =
          static_cast<float>(matrix(i, j));
    }
  }
}

void ZoneNetwork::Packed::put(const Eigen::MatrixXd& matrix) {
  const auto of_matrix = static_cast<std::size_t>(matrix.rows());
  rows = PackedPanel::filled(of_matrix);
  columns = static_cast<std::size_t>(matrix.cols());
  words.assign(PackedPanel::words_of(of_matrix) * columns, 0);
  pack_panel(matrix, words);
}

void ZoneNetwork::reset() noexcept {
  at_contact_.forget();
  elsewhere_.forget();
  step_error_->reset();
  claim_.reset();
  for (AlignedFloats* const all : {&displacement_, &force_, &moved_, &offset_, &next_offset_,
                                   &pull_, &offset_pull_, &next_pull_}) {
    std::fill(all->begin(), all->end(), 0.0F);
  }
  for (AlignedFloats& offset : branch_offset_) std::fill(offset.begin(), offset.end(), 0.0F);
  largest_N_ = 0.0;
}

void ZoneNetwork::gather(std::size_t first) noexcept {
  for (std::size_t i = 0; i < zone_.size(); ++i) {
    std::copy_n(force_.data() + 8 * i + first, 3, right_.data() + 3 * i);
  }
  const std::size_t inner = 3 * (zone_.size() - edge_);
  std::fill(right_.begin() + static_cast<std::ptrdiff_t>(3 * zone_.size()), right_.end(), 0.0F);
  const AlignedFloats& pull = first == kZoneNow ? pull_ : next_pull_;
  for (std::size_t i = 0; i < stiff_.columns; ++i) right_[inner + i] += pull[i];
}

void ZoneNetwork::add_surroundings() noexcept {
  kernels_.times(stiff_.panel(), moved_.data(), pull_.data());
  if (branch_offset_.empty()) {
    for (std::size_t i = 0; i < stiff_.columns; ++i) {
      const float viscous = offset_[i] + weights_.of_end * moved_[i];
      next_offset_[i] = weights_.keep * viscous + weights_.of_start * moved_[i];
    }
  } else {
    std::fill(next_offset_.begin(), next_offset_.end(), 0.0F);
    for (std::size_t j = 0; j < branch_offset_.size(); ++j) {
      const ServoBranch& branch = weights_.branches[j];
      float* const offset = branch_offset_[j].data();
      for (std::size_t i = 0; i < stiff_.columns; ++i) {
        const float viscous = offset[i] + branch.of_end * moved_[i];
        offset[i] = branch.keep * viscous + branch.of_start * moved_[i];
        next_offset_[i] += branch.share * offset[i];
      }
    }
  }
  kernels_.times(relaxing_.panel(), next_offset_.data(), next_pull_.data());
  for (std::size_t i = 0; i < stiff_.columns; ++i) {
    const float resisted = pull_[i];
    pull_[i] = offset_pull_[i] - resisted;
    offset_pull_[i] = next_pull_[i];
    next_pull_[i] -= resisted;
    offset_[i] = next_offset_[i];
  }
}

ContactAnswer ZoneNetwork::step(const ToolPose& tool) noexcept {
  const FlushDenormals flush;
  const std::size_t contact = zone_.size();
  for (std::size_t c = 0; c < 3; ++c) {
    displacement_[4 * contact + c] =
        static_cast<float>(tool.displacement_m[static_cast<Eigen::Index>(c)]);
  }
  at_contact_.add_next(displacement_.data(), weights_, force_.data());
  gather(kZoneNext);
  kernels_.packed_times(inverse_.panel(), right_.data(), change_.data());
  for (std::size_t i = 0; i < zone_.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) displacement_[4 * i + c] += change_[3 * i + c];
  }
  const std::size_t inner = 3 * (zone_.size() - edge_);
  for (std::size_t i = 0; i < stiff_.columns; ++i) moved_[i] += change_[inner + i];
  std::fill(force_.begin(), force_.end(), 0.0F);
  at_contact_.advance_now(displacement_.data(), weights_, force_.data());
  elsewhere_.advance(displacement_.data(), weights_, force_.data());
  add_surroundings();
  at_contact_.accept();
  elsewhere_.accept();
  gather(kZoneNow);

  ContactAnswer answer;
  Eigen::Vector3d correction;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<float, 8> part{};
    const float* const along = field_[axis].data();
    for (std::size_t i = 0; i < field_[axis].size(); i += 8) {
      for (std::size_t c = 0; c < 8; ++c) part[c] += along[i + c] * right_[i + c];
    }
    float sum = 0.0F;
    for (const float p : part) sum += p;
    correction[static_cast<Eigen::Index>(axis)] = static_cast<double>(sum);
  }
  const Eigen::Vector3f at_contact = Eigen::Map<const Eigen::Vector3f>(force_.data() + 8 * contact);
  answer.force_N = at_contact.cast<double>() + correction;
  largest_N_ = std::max(largest_N_, answer.force_N.norm());

  const double depth_m = tool.displacement_m.dot(into_);
  const double aside_m = (tool.displacement_m - depth_m * into_).norm();
  claim_.advance(depth_m);
  answer.error_N = claim_.at(claim_.place(), aside_m) + kUnbalanced * correction.norm() +
                   step_error_->advance(tool.displacement_m).norm();
  const double scale_N = std::max(largest_N_, kZoneScaleDepth_m * equilibrium_.norm());
  answer.valid = std::abs(depth_m) <= options_.deepest_m && aside_m <= options_.aside_m &&
                 answer.error_N <= kValidZoneError * scale_N;
  return answer;
}

BalanceWork ZoneNetwork::work() const noexcept {
  const auto size = [](const Dense& panel) { return panel.stride * panel.columns; };
  return {ServoBonds::kWide * (2 * at_contact_.groups() + elsewhere_.groups()), 0,
          inverse_.rows * inverse_.columns + size(stiff_) + size(relaxing_)};
}

// A Ref is a view: what it shows is changed.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
void ZoneNetwork::displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept {
  all.setZero();
  for (std::size_t i = 0; i < zone_.size(); ++i) {
    all.col(static_cast<Eigen::Index>(zone_[i])) =
        Eigen::Map<const Eigen::Vector3f>(displacement_.data() + 4 * i).cast<double>();
  }
  for (const std::size_t sphere : contact_) {
    all.col(static_cast<Eigen::Index>(sphere)) =
        Eigen::Map<const Eigen::Vector3f>(displacement_.data() + 4 * zone_.size()).cast<double>();
  }
  const float* column = outer_.numbers.data();
  for (std::size_t j = 0; j < outer_.columns; ++j, column += outer_.stride) {
    for (std::size_t i = 0; i < outside_.size(); ++i) {
      const Eigen::Vector3f part = Eigen::Map<const Eigen::Vector3f>(column + 3 * i) * moved_[j];
      all.col(static_cast<Eigen::Index>(outside_[i])) += part.cast<double>();
    }
  }
}

}  // namespace tpm::contact
