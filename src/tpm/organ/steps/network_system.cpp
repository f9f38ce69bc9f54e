// Declared in tpm/organ/steps/step_system.hpp.
// A network under its probe, for the step rules.

#include <algorithm>
#include <cmath>

#include "tpm/organ/balance/inertial_equation.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpm/organ/steps/bond_projection.hpp"
#include "tpm/organ/steps/implicit_balance.hpp"
#include "tpm/organ/steps/step_system.hpp"
#include "tpm/organ/steps/viscous_elongations.hpp"

namespace tpm::organ {
namespace {

using Spheres = Eigen::Map<Eigen::Matrix3Xd>;
using ConstSpheres = Eigen::Map<const Eigen::Matrix3Xd>;

/// Common part of networks with and without masses.
class NetworkSystem : public StageSystem, public ProjectionSystem, public NewtonSystem {
 public:
  NetworkSystem(const DrivenNetwork& network, const Protocol& protocol)
      : bonds_(network.bonds),
        rest_(network.rest),
        tissue_(bonds_, rest_, network.constraints, network.probes, protocol.drive()),
        balance_(bonds_, tissue_.constraints(), work()),
        projection_(bonds_, tissue_.constraints()),
        position_(rest_),
        viscous_state_{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds_.size())), 0.0},
        viscous_(bonds_),
        peak_(protocol.peak()) {
    depth_scale_ = depth_scale(protocol);
  }

  [[nodiscard]] Eigen::Index viscous() const override { return viscous_.size(); }
  [[nodiscard]] const Vector& relaxation_times_s() const override { return viscous_.times_s(); }

 protected:
  [[nodiscard]] Eigen::Index columns() const { return rest_.cols(); }

  /// Sets the viscous forces of the bonds at the state y.
  void set_viscous_state(const ConstVector& y) {
    viscous_.set_mean(y, viscous_state_.offset);
    viscous_state_.relaxation_factor = 0.0;
  }
  /// The same where y = offset + relaxation_factor V(l).
  void set_viscous_state(const ConstVector& offset, const ConstVector& relaxation_factor) {
    viscous_.set_mean(offset, viscous_state_.offset);
    viscous_state_.relaxation_factor = viscous_.mean_relaxation_factor(relaxation_factor);
  }

  /// True if both are the value imposed at one time, computed in two ways.
  [[nodiscard]] bool is_same(double a, double b) const {
    constexpr double kRounding = 1e-13;
    return std::abs(a - b) <= kRounding * peak_;
  }

  /// V(l) of each y.
  void find_elongations(const Positions& position, Vector& elongation) {
    bonds_.followed(position, all_);
    viscous_.spread(all_, elongation);
  }

  /// Balances `position_`, in memory_, under an imposed value.
  MethodEnd balance(double imposed) {
    Positions next = position_;
    tissue_.impose(next, imposed);
    tissue_.load(imposed, load_);
    const MethodEnd end = balance_.find(next, viscous_state_, load_, depth_scale_);
    if (end == MethodEnd::completed) position_ = next;
    return end;
  }

  /// The same from the balance at another value, in parts where it takes them.
  MethodEnd follow(double from, double to) {
    constexpr double kLeastPart = 1.0 / 4096.0;
    double done = 0.0;
    double part = 1.0;
    while (done < 1.0) {
      const double aim = std::min(1.0, done + part);
      const MethodEnd end = balance(aim == 1.0 ? to : from + aim * (to - from));
      if (end == MethodEnd::completed) {
        done = aim;
        part *= 2.0;
      } else if ((part *= 0.5) < kLeastPart || from == to) {
        return end;
      }
    }
    return MethodEnd::completed;
  }

  /// Positions with everything relaxed under an imposed value.
  MethodEnd relax_under(double imposed, Vector& y) {
    set_viscous_state(Vector::Zero(viscous()), Vector::Ones(viscous()));
    const MethodEnd end = follow(0.0, imposed);
    find_elongations(position_, y);
    return end;
  }

  /// Bonds pulled sphere by sphere towards what they want, `memory_` in place.
  void sweep(Positions& position, const Eigen::VectorXd& compliance_m_per_N) {
    ++work().rates;
    projection_.sweep(position, viscous_state_, compliance_m_per_N);
  }

  const BondSystem& bonds_;
  const Positions& rest_;
  DrivenTissue tissue_;
  ImplicitBalance balance_;
  BondProjection projection_;
  Positions position_;
  ViscousState viscous_state_;
  ViscousElongations viscous_;  ///< what the y are
  double peak_;                 ///< of what is imposed
  double depth_scale_ = 0.0;
  Eigen::Matrix3Xd load_, force_;
  Eigen::VectorXd all_;

 private:
  /// Depth that may be expected.
  [[nodiscard]] double depth_scale(const Protocol& protocol) {
    const double peak = protocol.peak();
    if (tissue_.depth_driven()) return peak;
    const double relaxed = std::abs(tissue_.linear_response(tissue_.at_rest(0.0), peak));
    // A fluid has no equilibrium: use its instantaneous response and the duration.
    const TissueState rest = tissue_.at_rest(0.0);
    if (!tissue_.equilibrium().factorise(rest.position, rest.viscous_state())) return relaxed;
    const double instantaneous =
        std::abs(tissue_.unit_field(rest, rest.viscous_state()).stiffness) * peak;
    const double lasts = protocol.knots().back().time_s - protocol.start_s();
    const double most = instantaneous * (1.0 + lasts / bonds_.shortest_relaxation_time_s());
    return relaxed > 0.0 ? std::min(relaxed, most) : most;
  }
};

/// Without masses: forces balance at each instant.
class MasslessNetwork final : public NetworkSystem, public BalanceSystem {
 public:
  using NetworkSystem::NetworkSystem;

  [[nodiscard]] Eigen::Index coordinates() const override { return 0; }
  [[nodiscard]] double drag_per_s() const override { return 0.0; }
  [[nodiscard]] Vector scales() const override { return Vector::Constant(viscous(), depth_scale_); }

  MethodEnd start(const Knot& first, bool relaxed, Vector& state) override {
    state.setZero(viscous());
    position_ = rest_;
    known_ = {0.0, state};
    if (!relaxed) return MethodEnd::completed;
    const MethodEnd end = relax_under(first.value, state);
    known_ = {first.value, state};
    return end;
  }

  MethodEnd jump(double imposed, const ConstVector& state) override {
    return balance_at(imposed, state);
  }

  MethodEnd rate(double t, const ConstVector& state, Eigen::Ref<Vector> rate) override {
    const MethodEnd end = elongations(t, state, elongation_);
    rate = (elongation_ - state).cwiseQuotient(relaxation_times_s());
    return end;
  }

  MethodEnd elongations(double t, const ConstVector& state, Vector& elongation) override {
    const MethodEnd end = balance_at(imposed(t), state);
    find_elongations(position_, elongation);
    return end;
  }

  MethodEnd stage(double t, const ImplicitStage& stage, Vector& state) override {
    set_viscous_state(stage.known, stage.relaxation_factor);
    if (const auto end = follow(known_.imposed, imposed(t)); end != MethodEnd::completed)
      return end;
    follow_viscous_state(stage.known, stage.relaxation_factor, imposed(t), state);
    return MethodEnd::completed;
  }

  MethodEnd response(double t, const ConstVector& state, double& response) override {
    const MethodEnd end = balance_at(imposed(t), state);
    ++work().rates;
    set_viscous_state(state);
    tissue_.load(imposed(t), force_);
    bonds_.add_forces(position_, viscous_state_, force_);
    response = tissue_.response(position_, force_);
    return end;
  }

  /// Spheres have no mass: each sweep is a step of a motion that forgets its velocity, of spheres
  /// as heavy as the bonds at them are stiff. Bonds begin with what they pull with, so that what
  /// balances stays.
  MethodEnd project(double t, double h, int sweeps, Vector& state) override {
    const Eigen::ArrayXd ratio = h / relaxation_times_s().array();
    const Vector relaxation_factor = ratio / (1.0 + ratio);
    const Vector offset = state.array() / (1.0 + ratio);
    if (compliance_.size() == 0) set_compliance();
    set_viscous_state(offset, relaxation_factor);
    tissue_.impose(position_, imposed(t));
    tissue_.load(imposed(t), load_);
    for (int i = 0; i < sweeps; ++i) {
      ++work().rates;
      balance_forces(bonds_, position_, viscous_state_, load_, force_);
      tissue_.constraints().project(force_);
      projection_.store_tensions(position_, viscous_state_);
      position_ += force_ * compliance_.asDiagonal();
      sweep(position_, compliance_);
    }
    follow_viscous_state(offset, relaxation_factor, imposed(t), state);
    return MethodEnd::completed;
  }

  MethodEnd factorise(double t, const ConstVector& state, double gamma) override {
    if (const auto end = balance_at(imposed(t), state); end != MethodEnd::completed) return end;
    return factorise_here(state, 1.0 / gamma);
  }

  void solve(Eigen::Ref<Vector> x) override {
    Vector place = Vector::Zero(places());
    x *= per_y_;
    solve_pair(place, x);
  }

  [[nodiscard]] Eigen::Index places() const override { return 3 * columns(); }
  [[nodiscard]] Vector placed() const override {
    Eigen::Matrix3Xd displacement = position_ - rest_;
    tissue_.constraints().project(displacement);
    return displacement.reshaped();
  }

  void imbalance(double t, const ConstVector& place, const ConstVector& y,
                 Eigen::Ref<Vector> imbalance, Vector& elongation) override {
    ++work().rates;
    put(place, t);
    set_viscous_state(y);
    tissue_.load(imposed(t), load_);
    balance_forces(bonds_, put_, viscous_state_, load_, force_);
    tissue_.constraints().project(force_);
    // Constrained components must stay 0.
    Eigen::Matrix3Xd bound = ConstSpheres(place.data(), 3, columns());
    tissue_.constraints().project(bound);
    Spheres left(imbalance.data(), 3, columns());
    left = ConstSpheres(place.data(), 3, columns()) - bound - force_;
    find_elongations(put_, elongation);
  }

  MethodEnd factorise_pair(double t, const ConstVector& place, const ConstVector& y,
                           double per_y) override {
    put(place, t);
    return factorise_at(put_, y, per_y);
  }

  void solve_pair(Eigen::Ref<Vector> place, Eigen::Ref<Vector> y) override {
    // K dx + G dy = rx, per_y dy + (dy - B dx)/tau = ry, with dy eliminated.
    const Eigen::ArrayXd per_s = 1.0 / relaxation_times_s().array();
    const Eigen::ArrayXd sum = per_y_ + per_s;
    Spheres x(place.data(), 3, columns());
    Eigen::Matrix3Xd right = x;
    Eigen::Matrix3Xd bound = x;
    tissue_.constraints().project(bound);
    bound = x - bound;
    viscous_.set_mean((y.array() / sum).matrix(), all_);
    for (const std::size_t bond : viscous_.bonds()) {
      const std::uint32_t a = bonds_.end_a()[bond];
      const std::uint32_t b = bonds_.end_b()[bond];
      const auto row = static_cast<Eigen::Index>(bond);
      const Eigen::Vector3d pull = bonds_.relaxing()[row] * all_[row] *
                                   (factorised_at_.col(b) - factorised_at_.col(a)).normalized();
      right.col(a) -= pull;
      right.col(b) += pull;
    }
    balance_.displace(right);
    bonds_.elongation_changes(factorised_at_, right, all_);
    if (!bonds_.is_linear()) all_.array() *= kernel_slope_.array();
    viscous_.spread(all_, elongation_);
    y = (y.array() + elongation_.array() * per_s) / sum;
    x = right + bound;
  }

  [[nodiscard]] Place place() const override {
    return {position_.reshaped(), known_.imposed, known_.y};
  }
  void set_place(const Place& place) override {
    position_ = ConstSpheres(place.position.data(), 3, columns());
    known_ = {place.imposed, place.y};
  }

 private:
  void set_compliance() {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(columns());
    for (std::size_t i = 0; i < bonds_.size(); ++i) {
      const double k = bonds_.stiffness()[static_cast<Eigen::Index>(i)];
      sum[bonds_.end_a()[i]] += k;
      sum[bonds_.end_b()[i]] += k;
    }
    compliance_ = (sum.array() > 0.0).select(sum.cwiseInverse(), 0.0);
  }

  MethodEnd balance_at(double imposed, const ConstVector& y) {
    if (is_same(known_.imposed, imposed) && known_.y == y) return MethodEnd::completed;
    set_viscous_state(y);
    const MethodEnd end = follow(known_.imposed, imposed);
    if (end == MethodEnd::completed) known_ = {imposed, y};
    return end;
  }

  /// y at the end of a step, where the positions are.
  void follow_viscous_state(const ConstVector& offset, const ConstVector& relaxation_factor,
                            double imposed, Vector& state) {
    find_elongations(position_, elongation_);
    state = offset + relaxation_factor.cwiseProduct(elongation_);
    known_ = {imposed, state};
  }

  void put(const ConstVector& place, double t) {
    put_ = rest_ + ConstSpheres(place.data(), 3, columns());
    tissue_.impose(put_, imposed(t));
  }

  MethodEnd factorise_here(const ConstVector& y, double per_y) {
    return factorise_at(position_, y, per_y);
  }

  MethodEnd factorise_at(const Positions& position, const ConstVector& y, double per_y) {
    per_y_ = per_y;
    factorised_at_ = position;
    const Vector relaxation_factor = 1.0 / (1.0 + per_y * relaxation_times_s().array());
    find_elongations(position, elongation_);
    set_viscous_state(y - relaxation_factor.cwiseProduct(elongation_), relaxation_factor);
    if (!bonds_.is_linear()) bonds_.kernel_slopes(position, kernel_slope_);
    return balance_.factorise(position, viscous_state_);
  }

  struct Known {
    double imposed = 0.0;
    Vector y;
  };
  Known known_;  ///< what position_ belongs to
  Vector elongation_;
  Eigen::VectorXd compliance_;  ///< of XPBD, m/N
  double per_y_ = 0.0;
  Positions put_, factorised_at_;
  Eigen::VectorXd kernel_slope_;  ///< V'(l) there
};

/// With masses.
class NetworkWithMass final : public NetworkSystem {
 public:
  NetworkWithMass(const DrivenNetwork& network, const Protocol& protocol, const MethodMasses& mass)
      : NetworkSystem(network, protocol),
        equation_(tissue_, rest_, Inertia{mass.mass_kg, mass.drag_per_s, {}}),
        speed_scale_(
            depth_scale_ *
            lowest_mode(bonds_, rest_, network.constraints, mass.mass_kg).angular_frequency()) {}

  void set_piece(const Knot& from, const Knot& to) override {
    StepSystem::set_piece(from, to);
    equation_.set_piece(from, to);
  }

  [[nodiscard]] Eigen::Index coordinates() const override { return 3 * columns(); }
  [[nodiscard]] double drag_per_s() const override { return equation_.inertia().drag_per_s; }
  [[nodiscard]] Vector scales() const override {
    Vector scales = Vector::Constant(size(), depth_scale_);
    scales.segment(coordinates(), coordinates()).setConstant(speed_scale_);
    return scales;
  }

  MethodEnd start(const Knot& first, bool relaxed, Vector& state) override {
    state.setZero(size());
    if (!relaxed) return MethodEnd::completed;
    Vector y;
    if (const auto end = relax_under(first.value, y); end != MethodEnd::completed) return end;
    Spheres displacement(state.data(), 3, columns());
    displacement = position_ - rest_;
    tissue_.constraints().project(displacement);
    state.tail(viscous()) = y;
    return MethodEnd::completed;
  }

  MethodEnd jump(double /*imposed*/, const ConstVector& /*state*/) override {
    return MethodEnd::completed;
  }

  MethodEnd rate(double t, const ConstVector& state, Eigen::Ref<Vector> rate) override {
    ++work().rates;
    equation_.rate(t, state, rate);
    return MethodEnd::completed;
  }

  MethodEnd elongations(double t, const ConstVector& state, Vector& elongation) override {
    put(t, state);
    find_elongations(position_, elongation);
    return MethodEnd::completed;
  }

  MethodEnd stage(double t, const ImplicitStage& stage, Vector& state) override {
    const Eigen::Index n = coordinates();
    const double held = 1.0 + stage.c * drag_per_s();
    anchors_.stiffness = equation_.inertia().mass_kg * (held / (stage.c * stage.c));
    const Vector to = stage.known.head(n) + stage.c / held * stage.known.segment(n, n);
    put(t, to);
    anchors_.to = position_;
    put(t, state);
    set_viscous_state(stage.known.tail(viscous()), stage.relaxation_factor);
    tissue_.load(imposed(t), load_);
    if (const auto end = balance_.find(position_, viscous_state_, load_, depth_scale_, &anchors_);
        end != MethodEnd::completed) {
      return end;
    }
    take(stage.known, stage.c, state);
    find_elongations(position_, elongation_);
    state.tail(viscous()) =
        stage.known.tail(viscous()) + stage.relaxation_factor.cwiseProduct(elongation_);
    return MethodEnd::completed;
  }

  MethodEnd response(double t, const ConstVector& state, double& response) override {
    ++work().rates;
    response = equation_.response(t, state);
    return MethodEnd::completed;
  }

  MethodEnd project(double t, double h, int sweeps, Vector& state) override {
    if (h == 0.0) return MethodEnd::completed;
    const Eigen::Index n = coordinates();
    const double held = 1.0 + h * drag_per_s();
    const Eigen::VectorXd compliance = h * h / held * equation_.inertia().mass_kg.cwiseInverse();
    const Eigen::ArrayXd ratio = h / relaxation_times_s().array();
    const Vector relaxation_factor = ratio / (1.0 + ratio);
    const Vector offset = state.tail(viscous()).array() / (1.0 + ratio);
    const Vector ahead = state.head(n) + h / held * state.segment(n, n);
    put(t, ahead);
    tissue_.load(imposed(t), load_);
    tissue_.constraints().project(load_);
    position_ += load_ * compliance.asDiagonal();
    set_viscous_state(offset, relaxation_factor);
    projection_.forget();
    for (int i = 0; i < sweeps; ++i) sweep(position_, compliance);
    take(Vector(state), h, state);
    find_elongations(position_, elongation_);
    state.tail(viscous()) = offset + relaxation_factor.cwiseProduct(elongation_);
    return MethodEnd::completed;
  }

  MethodEnd factorise(double t, const ConstVector& state, double gamma) override {
    ++work().factorisations;
    return equation_.factorise(t, state, gamma) ? MethodEnd::completed : MethodEnd::newton_failed;
  }
  void solve(Eigen::Ref<Vector> x) override {
    ++work().solves;
    equation_.solve(x);
  }

 private:
  /// position_ of the displacements with which a vector begins.
  void put(double t, const ConstVector& state) {
    position_ = rest_ + ConstSpheres(state.data(), 3, columns());
    tissue_.impose(position_, imposed(t));
  }

  /// Displacements at position_, and velocities of x = x* + c v.
  void take(const Vector& known, double c, Vector& state) {
    const Eigen::Index n = coordinates();
    Eigen::Matrix3Xd displacement = position_ - rest_;
    tissue_.constraints().project(displacement);
    state.head(n) = displacement.reshaped();
    state.segment(n, n) = (state.head(n) - known.head(n)) / c;
  }

  InertialEquation equation_;
  double speed_scale_;
  SphereAnchors anchors_;
  Vector elongation_;
};

}  // namespace

std::unique_ptr<StepSystem> network_system(const DrivenNetwork& network, const Protocol& protocol,
                                           const std::optional<MethodMasses>& mass) {
  if (mass) return std::make_unique<NetworkWithMass>(network, protocol, *mass);
  return std::make_unique<MasslessNetwork>(network, protocol);
}

}  // namespace tpm::organ
