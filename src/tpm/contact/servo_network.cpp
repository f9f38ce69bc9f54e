#include "tpm/contact/servo_network.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tpm/base/require.hpp"
#include "tpm/base/text.hpp"
#include "tpm/base/wide_vectors.hpp"
#include "tpm/contact/flush_denormals.hpp"
#include "tpmkit/error.hpp"

namespace tpm::contact {
namespace {

constexpr double kFieldStride_m = 2e-3;
/// Largest error of the fields in use beside the distance from the normal, m.
constexpr double kFieldSlack_m = 0.3e-3;
constexpr double kHold = 0.7;              // of an error, from one step to the next
constexpr double kValidServoError = 0.02;  // error over the largest force
constexpr double kScaleDepth_m = 1e-4;     // at which forces begin to count
constexpr double kAside = 2.0;  // how much faster the fields change across the normal than along it
// Rounding, of the largest force: instantaneous, and of the viscous elongations, a step.
constexpr double kRounding = 3e-7;
constexpr double kViscousRounding = 6e-9;
constexpr double kLongestLag = 1e3;  // steps
constexpr std::size_t kNow = 0, kNext = 4;

/// Vectors of four spheres.
constexpr std::size_t kSixteen = 16;
using Sixteen [[gnu::vector_size(kSixteen * sizeof(float))]] = float;

void require(const ServoNetworkOptions& options, const Eigen::Vector3d& into_tissue) {
  require_number(is_positive(options.period_s), "period_s", options.period_s, "a time above 0");
  require_number(is_positive(options.deepest_m), "deepest_m", options.deepest_m, "a depth above 0");
  require_number(options.frozen_depth_m >= 0.0 && options.frozen_depth_m <= options.deepest_m,
                 "frozen_depth_m", options.frozen_depth_m, "from 0 to deepest_m");
  require_number(options.aside_m > 0.0, "aside_m", options.aside_m, "above 0");
  require_number(options.balance_again_above > 0.0, "balance_again_above",
                 options.balance_again_above, "above 0");
  require_number(options.most_balances >= 1, "most_balances", options.most_balances, "1 or more");
  require_number(std::abs(into_tissue.norm() - 1.0) <= 1e-9, "into_tissue", into_tissue.norm(),
                 "a unit vector");
}

}  // namespace

ServoNetwork::ServoNetwork(const BondSystem& bonds, const Positions& rest,
                           const Constraints& constraints, std::size_t contact,
                           const Eigen::Vector3d& into_tissue, const ServoNetworkOptions& options)
    : options_(options), into_(into_tissue) {
  require(options, into_tissue);
  require_servo_material(bonds, "the network at servo rate");
  PushedContact tissue(bonds, rest, constraints, contact);
  weights_ = servo_weights(bonds, options.period_s);
  instantaneous_ = tissue.fields(rest, tissue.viscous_state(rest, 0.0, 0.0)).stiffness;
  equilibrium_ = tissue.fields(rest, tissue.viscous_state(rest, 0.0, 1.0)).stiffness;
  branch_error_.assign(weights_.branches.size(), Eigen::Vector3d::Zero());
  const double forgotten = 1.0 - static_cast<double>(weights_.longest_kept());
  rounding_ = kRounding + kViscousRounding / std::max(forgotten, 1.0 / kLongestLag);
  spheres_ = std::make_unique<ServoStiffness>(bonds, tissue.constraints());
  contact_ = spheres_->column(contact);
  choose_bonds(tissue);
  const auto relaxed = static_cast<double>(weights_.of_end);
  const auto count = static_cast<int>(std::ceil(options.deepest_m / kFieldStride_m));
  for (int i = 0; i <= count; ++i) {
    const double depth_m = options.deepest_m * i / count;
    add_field(tissue, tissue.at(depth_m * into_, relaxed), depth_m);
  }
  const Positions frozen = tissue.at(options.frozen_depth_m * into_, relaxed);
  factorise(tissue, frozen);
  add_viscous_response(tissue, frozen);
  step_error_ = std::make_unique<StepError>(tissue, frozen, relaxed, options.period_s);
}

void ServoNetwork::choose_bonds(const PushedContact& tissue) {
  const BondSystem& bonds = tissue.bonds();
  std::vector<ServoBonds::Choice> near, far;
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    const std::uint32_t from = bonds.end_a()[b];
    const std::uint32_t to = bonds.end_b()[b];
    const ServoBonds::Choice choice{b, spheres_->column(from), spheres_->column(to)};
    if (from == tissue.contact() || to == tissue.contact()) {
      near.push_back(choice);
    } else if (spheres_->moves(from) || spheres_->moves(to)) {
      far.push_back(choice);
    }
  }
  const std::size_t columns = spheres_->columns();
  const auto filler = static_cast<std::uint32_t>(columns);
  at_contact_ = ServoBonds(bonds, tissue.rest(), near, filler, options_.portable);
  elsewhere_ = ServoBonds(bonds, tissue.rest(), far, filler, options_.portable);
  displacement_.assign(4 * (columns + 1), 0.0F);
  force_.assign(8 * (columns + 4), 0.0F);  // weighed() reads four at once
  change_.assign(4 * (spheres_->free().size() + 1), 0.0F);
}

void ServoNetwork::factorise(PushedContact& tissue, const Positions& position) {
  const auto relaxed = static_cast<double>(weights_.of_end);
  const ViscousState viscous_state = tissue.viscous_state(position, relaxed, relaxed);
  if (spheres_->factorise(tissue.bonds(), tissue.constraints(), position, viscous_state,
                          options_.portable)) {
    return;
  }
  throw Error(ExitCode::numerical, "contact",
              fmt::format("the tissue is not stiff at {} mm of depth",
                          significant(1e3 * options_.frozen_depth_m, 4)));
}

ServoNetwork::Field ServoNetwork::field_of(const std::array<Eigen::Matrix3Xd, 3>& displacement,
                                           double depth_m) const {
  Field field{depth_m, {}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    field.along[axis].assign(kSixteen * ((spheres_->free().size() + 3) / 4), 0.0F);
    for (const std::size_t i : spheres_->free()) {
      const Eigen::Vector3f at = displacement[axis].col(static_cast<Eigen::Index>(i)).cast<float>();
      std::copy_n(at.data(), 3, field.along[axis].data() + std::size_t{4} * spheres_->column(i));
    }
  }
  return field;
}

void ServoNetwork::add_field(PushedContact& tissue, const Positions& position, double depth_m) {
  const auto relaxed = static_cast<double>(weights_.of_end);
  const ViscousState viscous_state = tissue.viscous_state(position, relaxed, relaxed);
  fields_.push_back(field_of(tissue.fields(position, viscous_state).displacement, depth_m));
}

void ServoNetwork::add_viscous_response(PushedContact& tissue, const Positions& position) {
  const auto relaxed = static_cast<double>(weights_.of_end);
  ContactFields fields = tissue.fields(position, tissue.viscous_state(position, relaxed, relaxed));
  for (Eigen::Matrix3Xd& field : fields.displacement) {
    Eigen::Matrix3Xd instantaneous = Eigen::Matrix3Xd::Zero(3, position.cols());
    Eigen::Matrix3Xd in_the_end = instantaneous;
    tissue.bonds().add_stiffness_times(position, tissue.viscous_state(position, relaxed, 0.0),
                                       field, instantaneous);
    tissue.bonds().add_stiffness_times(position, tissue.viscous_state(position, relaxed, 1.0),
                                       field, in_the_end);
    field = instantaneous - in_the_end;
    tissue.displace(field);
  }
  viscous_response_ = field_of(fields.displacement, options_.frozen_depth_m);
}

void ServoNetwork::reset() noexcept {
  at_contact_.forget();
  elsewhere_.forget();
  step_error_->reset();
  std::fill(displacement_.begin(), displacement_.end(), 0.0F);
  std::fill(force_.begin(), force_.end(), 0.0F);
  largest_N_ = held_error_N_ = 0.0;
  viscous_error_.setZero();
  std::fill(branch_error_.begin(), branch_error_.end(), Eigen::Vector3d::Zero());
  viscous_source_.setZero();
  source_.setZero();
}

void ServoNetwork::balance(std::size_t first) noexcept {
  const std::size_t count = spheres_->free().size();
  const float* const force = force_.data() + first;
  float* const right = change_.data();
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t c = 0; c < 4; ++c) right[4 * i + c] = force[8 * i + c];
  }
  spheres_->solve(change_.data());
  for (std::size_t i = 0; i < 4 * spheres_->free().size(); ++i) displacement_[i] += change_[i];
  std::fill(force_.begin(), force_.end(), 0.0F);
  at_contact_.advance_now(displacement_.data(), weights_, force_.data());
  elsewhere_.advance(displacement_.data(), weights_, force_.data());
}

std::array<Eigen::Vector3d, 3> ServoNetwork::weighed(
    const std::array<const Field*, 3>& fields) const noexcept {
  constexpr std::size_t kSums = 9;
  std::array<Sixteen, kSums> sum{};
  run_wide([&] {
    const float* force = force_.data();
    for (std::size_t at = 0; at < 4 * spheres_->free().size(); at += kSixteen) {
      Sixteen four;  // spheres
      for (std::size_t i = 0; i < 4; ++i, force += 8) {
        std::memcpy(reinterpret_cast<float*>(&four) + 4 * i, force, 4 * sizeof(float));
      }
      for (std::size_t s = 0; s < kSums; ++s) {
        Sixteen along;
        std::memcpy(&along, fields[s / 3]->along[s % 3].data() + at, sizeof(Sixteen));
        sum[s] += along * four;
      }
    }
  });
  std::array<Eigen::Vector3d, 3> weighed;
  for (std::size_t s = 0; s < kSums; ++s) {
    const Sixteen& part = sum[s];
    float total = 0.0F;
    for (std::size_t c = 0; c < 3; ++c) {
      total += (part[c] + part[c + 8]) + (part[c + 4] + part[c + 12]);
    }
    weighed[s / 3][static_cast<Eigen::Index>(s % 3)] = static_cast<double>(total);
  }
  return weighed;
}

void ServoNetwork::answer(const Eigen::Vector3d& displacement_m, double step_error_N) noexcept {
  const double depth_m = displacement_m.dot(into_);
  const double aside_m = (displacement_m - depth_m * into_).norm();
  const double stride_m = fields_[1].depth_m;
  const double at = std::clamp(depth_m / stride_m, 0.0, static_cast<double>(fields_.size() - 1));
  const std::size_t low = std::min(static_cast<std::size_t>(at), fields_.size() - 2);
  const double share = at - static_cast<double>(low);
  const auto [above, below, source] =
      weighed({&fields_[low], &fields_[low + 1], &viscous_response_});
  const Eigen::Vector3d change = below - above;
  source_ = source;
  const Eigen::Vector3f at_contact =
      Eigen::Map<const Eigen::Vector3f>(force_.data() + 8 * contact_);
  answer_.force_N = at_contact.cast<double>() + above + share * change;
  largest_N_ = std::max(largest_N_, answer_.force_N.norm());
  const double beyond_m = std::abs(depth_m - at * stride_m);
  const double field_error_N =
      change.norm() * (kAside * aside_m + beyond_m + kFieldSlack_m) / stride_m +
      rounding_ * largest_N_;
  answer_.error_N =
      std::max(field_error_N, kHold * held_error_N_) + viscous_error_.norm() + step_error_N;
  const double scale_N = std::max(largest_N_, kScaleDepth_m * equilibrium_.norm());
  answer_.valid = depth_m <= options_.deepest_m && depth_m >= -options_.deepest_m &&
                  aside_m <= options_.aside_m && answer_.error_N <= kValidServoError * scale_N;
}

ContactAnswer ServoNetwork::step(const ToolPose& tool) noexcept {
  const FlushDenormals flush;
  float* const contact = displacement_.data() + 4 * contact_;
  for (Eigen::Index c = 0; c < 3; ++c) contact[c] = static_cast<float>(tool.displacement_m[c]);
  at_contact_.add_next(displacement_.data(), weights_, force_.data());
  const double step_error_N = step_error_->advance(tool.displacement_m).norm();
  const double scale_N = std::max(largest_N_, kScaleDepth_m * equilibrium_.norm());
  balance(kNext);
  answer(tool.displacement_m, step_error_N);
  const double elsewhere_N = viscous_error_.norm() + step_error_N;
  for (balances_ = 1; balances_ < options_.most_balances; ++balances_) {
    if (answer_.error_N - elsewhere_N <= options_.balance_again_above * scale_N) break;
    held_error_N_ = 0.0;
    balance(kNow);
    answer(tool.displacement_m, step_error_N);
  }
  held_error_N_ = answer_.error_N - elsewhere_N;
  keep_error();
  at_contact_.accept();
  elsewhere_.accept();
  return answer_;
}

void ServoNetwork::keep_error() noexcept {
  const auto after = [&](const auto& by, const Eigen::Vector3d& error) -> Eigen::Vector3d {
    return static_cast<double>(by.keep) * error +
           static_cast<double>(by.of_start) * viscous_source_ +
           static_cast<double>(by.of_end) * source_;
  };
  if (branch_error_.empty()) {
    viscous_error_ = after(weights_, viscous_error_);
  } else {
    viscous_error_.setZero();
    for (std::size_t j = 0; j < branch_error_.size(); ++j) {
      const ServoBranch& branch = weights_.branches[j];
      branch_error_[j] = after(branch, branch_error_[j]);
      viscous_error_ += static_cast<double>(branch.share) * branch_error_[j];
    }
  }
  viscous_source_ = source_;
}

double ServoNetwork::residual_N() const noexcept {
  double square = 0.0;
  for (std::size_t i = 0; i < spheres_->free().size(); ++i) {
    square +=
        static_cast<double>(Eigen::Map<const Eigen::Vector3f>(force_.data() + 8 * i).squaredNorm());
  }
  return std::sqrt(square);
}

BalanceWork ServoNetwork::work() const noexcept {
  constexpr std::size_t kFields = 3;  // two depths' in the answer, and `viscous_response_`
  constexpr std::size_t kAxes = 3, kFloats = 4;
  return {ServoBonds::kWide * (at_contact_.groups() + elsewhere_.groups()), spheres_->blocks_read(),
          kFields * kAxes * kFloats * spheres_->free().size()};
}

// A Ref is a view: what it shows is changed.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
void ServoNetwork::displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept {
  for (Eigen::Index s = 0; s < spheres(); ++s) {
    const std::size_t at = std::size_t{4} * spheres_->column(static_cast<std::size_t>(s));
    all.col(s) = Eigen::Map<const Eigen::Vector3f>(displacement_.data() + at).cast<double>();
  }
}

}  // namespace tpm::contact
