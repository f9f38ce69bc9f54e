#include "tpm/haptics/session/network_beside.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "tpm/contact/pushed_contact.hpp"

namespace tpm::haptics {
namespace {

constexpr double kBesideEvery_s = 5e-3;
constexpr double kStiffnessStride_m = 2e-3;
constexpr std::uint64_t kOldest = 4;  // steps of the network that an answer may be old

}  // namespace

StiffnessByDepth::StiffnessByDepth(const BondSystem& bonds, const Positions& rest,
                                   const Constraints& constraints, std::size_t contact,
                                   const Eigen::Vector3d& into_tissue, double deepest_m)
    : into_(into_tissue) {
  PushedContact tissue(bonds, rest, constraints, contact);
  const auto count = static_cast<int>(std::max(1.0, std::ceil(deepest_m / kStiffnessStride_m)));
  stride_m_ = deepest_m / count;
  for (int i = 0; i <= count; ++i) {
    const Positions position = tissue.at(i * stride_m_ * into_, 1.0);
    stiffness_.push_back(
        tissue.fields(position, tissue.viscous_state(position, 1.0, 0.0)).stiffness);
  }
}

Eigen::Matrix3d StiffnessByDepth::at(const Eigen::Vector3d& displacement_m) const noexcept {
  const double last = static_cast<double>(stiffness_.size() - 1);
  // Written so that a place that is no number leads to the first entry.
  const double wanted = into_.dot(displacement_m) / stride_m_;
  const double place = wanted > 0.0 ? std::min(wanted, last) : 0.0;
  const auto below = static_cast<std::size_t>(std::min(std::floor(place), last - 1.0));
  const double share = place - static_cast<double>(below);
  return (1.0 - share) * stiffness_[below] + share * stiffness_[below + 1];
}

NetworkBeside::NetworkBeside(std::unique_ptr<ServoNetwork> network, StiffnessByDepth stiffness,
                             double period_s, bool threads)
    : network_(std::move(network)),
      stiffness_(std::move(stiffness)),
      period_s_(period_s),
      every_(static_cast<std::uint64_t>(periods_between(period_s))),
      threads_(threads) {
  reset();
  if (threads_) thread_ = std::thread([this] { work(); });
}

NetworkBeside::~NetworkBeside() {
  over_ = true;
  if (thread_.joinable()) thread_.join();
}

int NetworkBeside::periods_between(double period_s) {
  return static_cast<int>(std::max(1.0, std::round(kBesideEvery_s / period_s)));
}

NetworkBeside::Linearised NetworkBeside::at_rest() const noexcept {
  Linearised answer;
  answer.run = run_;
  answer.stiffness = stiffness_.at(Eigen::Vector3d::Zero());
  return answer;
}

void NetworkBeside::reset() noexcept {
  ++run_;
  step_ = 0;
  used_ = next_ = at_rest();
}

NetworkBeside::Linearised NetworkBeside::follow(const Place& place) noexcept {
  if (place.run != reached_.run) {
    network_->reset();
    reached_ = Place{};
    reached_.run = place.run;
    reached_N_.setZero();
  }
  // Places between were overwritten if this thread was late: the motion is taken as linear.
  const std::uint64_t steps = (place.step - reached_.step) / every_;
  ContactAnswer answer;
  for (std::uint64_t i = 1; i <= steps; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(steps);
    answer = network_->step(reached_.displacement_m +
                            share * (place.displacement_m - reached_.displacement_m));
  }
  Linearised result;
  result.run = place.run;
  result.step = place.step;
  result.displacement_m = place.displacement_m;
  result.force_N = answer.force_N;
  result.stiffness = stiffness_.at(place.displacement_m);
  const Eigen::Vector3d moved = place.displacement_m - reached_.displacement_m;
  const double passed_s = static_cast<double>(place.step - reached_.step) * period_s_;
  result.unforeseen_N_per_s =
      (answer.force_N - reached_N_ + stiffness_.at(reached_.displacement_m) * moved).norm() /
      passed_s;
  result.error_N = answer.error_N;
  result.valid = answer.valid;
  reached_ = place;
  reached_N_ = answer.force_N;
  return result;
}

void NetworkBeside::work() noexcept {
  const std::chrono::duration<double> pause(0.1 * kBesideEvery_s);
  while (!over_) {
    if (places_.refresh()) {
      answers_.write(follow(places_.latest()));
    } else {
      std::this_thread::sleep_for(pause);
    }
  }
}

ContactAnswer NetworkBeside::step(const ToolPose& tool) noexcept {
  ++step_;
  const bool due = step_ % every_ == 0;
  const Place place{run_, step_, tool.displacement_m};
  if (threads_) {
    if (due) places_.write(place);
    if (answers_.refresh() && answers_.latest().run == run_) used_ = answers_.latest();
  } else if (due) {
    used_ = next_;
    next_ = follow(place);
  }
  const Eigen::Vector3d moved = tool.displacement_m - used_.displacement_m;
  ContactAnswer answer;
  answer.force_N = used_.force_N - used_.stiffness * moved;
  // What relaxes and curves goes on as it did over the last step of the network; beside it, the
  // curvature along the way since.
  const double curved_N =
      0.5 * ((stiffness_.at(tool.displacement_m) - used_.stiffness) * moved).norm();
  answer.error_N =
      used_.error_N + curved_N + used_.unforeseen_N_per_s * static_cast<double>(age()) * period_s_;
  answer.valid = used_.valid && age() <= kOldest * every_;
  return answer;
}

}  // namespace tpm::haptics
