// Declared in tpm/organ/steps/step_system.hpp.
// One sphere on the paper's element, for the step rules.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/organ/steps/step_system.hpp"

namespace tpm::organ {
namespace {

constexpr double kDepthResolution = 4.0 * std::numeric_limits<double>::epsilon();

/// The force of the element along its normal, k e - g y + tension(e), N, where y = offset +
/// following e.
class ElementForce {
 public:
  explicit ElementForce(const BondElement& p)
      : unit_(p.modulus_to_stiffness_m()),
        stiffness_(p.instantaneous_Pa() * unit_),
        relaxing_(p.relaxing_Pa() * unit_),
        tension_(p.tension()) {}

  [[nodiscard]] double relaxing() const { return relaxing_; }
  [[nodiscard]] double force(double e, double offset, double relaxation_factor) const {
    return (stiffness_ - relaxation_factor * relaxing_) * e - relaxing_ * offset +
           unit_ * tension_.value(e);
  }
  [[nodiscard]] double slope(double e, double relaxation_factor) const {
    return stiffness_ - relaxation_factor * relaxing_ + unit_ * tension_.slope(e);
  }

 private:
  double unit_, stiffness_, relaxing_;
  TensionLaw tension_;
};

/// A spring that draws the sphere to a place: what inertia is in an implicit stage.
struct Drawn {
  double stiffness = 0.0, to = 0.0;
};

class ElementSystem final : public StageSystem,
                            public ProjectionSystem,
                            public NewtonSystem,
                            public BalanceSystem {
 public:
  ElementSystem(const BondElement& p, const Protocol& protocol,
                const std::optional<MethodMasses>& mass)
      : law_(p),
        tau_(p.relaxation_time_s()),
        times_s_(Vector::Constant(1, tau_)),
        peak_(protocol.peak()),
        depth_driven_(protocol.drive() == Drive::displacement),
        mass_(mass ? mass->mass_kg[0] : 0.0),
        drag_(mass ? mass->drag_per_s : 0.0),
        moves_(mass && !depth_driven_),
        depth_scale_(depth_scale(p, protocol)),
        speed_scale_(moves_ ? depth_scale_ * std::sqrt(law_.slope(depth_scale_, 0.0) / mass_)
                            : 0.0) {}

  [[nodiscard]] Eigen::Index coordinates() const override { return moves_ ? 1 : 0; }
  [[nodiscard]] Eigen::Index viscous() const override { return 1; }
  [[nodiscard]] const Vector& relaxation_times_s() const override { return times_s_; }
  [[nodiscard]] double drag_per_s() const override { return drag_; }
  [[nodiscard]] Vector scales() const override {
    Vector scales(size());
    if (moves_) {
      scales << depth_scale_, speed_scale_, depth_scale_;
    } else {
      scales << depth_scale_;
    }
    return scales;
  }

  MethodEnd start(const Knot& first, bool relaxed, Vector& state) override {
    state.setZero(size());
    e_ = 0.0;
    if (!relaxed) return MethodEnd::completed;
    e_ = first.value;
    if (!depth_driven_) {
      if (const auto end = balance(first.value, 0.0, 1.0, {}, e_); end != MethodEnd::completed)
        return end;
    }
    if (moves_) state[0] = e_;
    state[size() - 1] = e_;
    known_ = {first.value, e_};
    return MethodEnd::completed;
  }

  MethodEnd jump(double imposed, const ConstVector& state) override {
    return moves_ ? MethodEnd::completed : place_at(imposed, state[0]);
  }

  MethodEnd rate(double t, const ConstVector& state, Eigen::Ref<Vector> rate) override {
    if (!moves_) {
      const MethodEnd end = place_at(imposed(t), state[0]);
      rate[0] = (e_ - state[0]) / tau_;
      if (depth_driven_) ++work().rates;
      return end;
    }
    ++work().rates;
    rate[0] = state[1];
    rate[1] = (imposed(t) - law_.force(state[0], state[2], 0.0)) / mass_ - drag_ * state[1];
    rate[2] = (state[0] - state[2]) / tau_;
    return MethodEnd::completed;
  }

  MethodEnd elongations(double t, const ConstVector& state, Vector& elongation) override {
    const MethodEnd end = moves_ ? MethodEnd::completed : place_at(imposed(t), state[0]);
    elongation.setConstant(1, moves_ ? state[0] : e_);
    return end;
  }

  MethodEnd stage(double t, const ImplicitStage& stage, Vector& state) override {
    const double offset = stage.known[size() - 1];
    if (!moves_) {
      if (depth_driven_) {
        ++work().rates;
        e_ = imposed(t);
      } else if (const auto end = balance(imposed(t), offset, stage.relaxation_factor[0], {}, e_);
                 end != MethodEnd::completed) {
        return end;
      }
      state[0] = offset + stage.relaxation_factor[0] * e_;
      known_ = {imposed(t), state[0]};
      return MethodEnd::completed;
    }
    const double held = 1.0 + stage.c * drag_;
    const Drawn inertia{mass_ * held / (stage.c * stage.c),
                        stage.known[0] + stage.c * stage.known[1] / held};
    double e = state[0];
    if (const auto end = balance(imposed(t), offset, stage.relaxation_factor[0], inertia, e);
        end != MethodEnd::completed) {
      return end;
    }
    state << e, (e - stage.known[0]) / stage.c, offset + stage.relaxation_factor[0] * e;
    return MethodEnd::completed;
  }

  MethodEnd response(double t, const ConstVector& state, double& response) override {
    if (moves_) {
      response = state[0];
      return MethodEnd::completed;
    }
    const MethodEnd end = place_at(imposed(t), state[0]);
    response = depth_driven_ ? law_.force(e_, state[0], 0.0) + drag_ * mass_ * imposed_rate() : e_;
    return end;
  }

  MethodEnd project(double t, double h, int sweeps, Vector& state) override {
    const double ratio = h / tau_;
    const double relaxation_factor = ratio / (1.0 + ratio);
    const double offset = state[size() - 1] / (1.0 + ratio);
    double weight = 0.0;  // how far the sphere goes under a force, m/N
    double force = 0.0;   // of the constraint
    double e = 0.0;
    if (moves_) {
      if (h == 0.0) return MethodEnd::completed;
      const double held = 1.0 + h * drag_;
      weight = h * h / (mass_ * held);
      e = state[0] + h * state[1] / held + weight * imposed(t);
    } else if (depth_driven_) {
      ++work().rates;
      e = imposed(t);
    } else {
      e = e_;
    }
    for (int i = 0; i < sweeps && !depth_driven_; ++i) {
      if (!moves_) {  // the mass is made up: that of the stiffness itself
        weight = 1.0 / law_.slope(e, 0.0);
        force = law_.force(e, offset, relaxation_factor);
        e += weight * (imposed(t) - force);
      }
      ++work().rates;
      const double more = (law_.force(e, offset, relaxation_factor) - force) /
                          (1.0 + law_.slope(e, relaxation_factor) * weight);
      e -= weight * more;
      force += more;
    }
    if (moves_) {
      const double speed = (e - state[0]) / h;
      state << e, speed, offset + relaxation_factor * e;
      return MethodEnd::completed;
    }
    e_ = e;
    state[0] = offset + relaxation_factor * e;
    known_ = {imposed(t), state[0]};
    return MethodEnd::completed;
  }

  MethodEnd factorise(double t, const ConstVector& state, double gamma) override {
    if (!moves_) {
      if (const auto end = place_at(imposed(t), state[0]); end != MethodEnd::completed) return end;
      const Vector place = Vector::Constant(places(), e_);
      return factorise_pair(t, place, state, 1.0 / gamma);
    }
    ++work().factorisations;
    gamma_ = gamma;
    relaxation_factor_ = gamma / tau_ / (1.0 + gamma / tau_);
    pivot_ =
        mass_ * (1.0 + gamma * drag_) + gamma * gamma * law_.slope(state[0], relaxation_factor_);
    return pivot_ != 0.0 ? MethodEnd::completed : MethodEnd::newton_failed;
  }

  void solve(Eigen::Ref<Vector> x) override {
    if (!moves_) {
      Vector place = Vector::Zero(places());
      x *= per_y_;
      solve_pair(place, x);
      return;
    }
    ++work().solves;
    const double ratio = gamma_ / tau_;
    const double held = 1.0 + gamma_ * drag_;
    const double u = (mass_ * (held * x[0] + gamma_ * x[1]) +
                      gamma_ * gamma_ * law_.relaxing() * x[2] / (1.0 + ratio)) /
                     pivot_;
    x[1] = (u - x[0]) / gamma_;
    x[0] = u;
    x[2] = (x[2] + ratio * u) / (1.0 + ratio);
  }

  [[nodiscard]] Eigen::Index places() const override { return depth_driven_ ? 0 : 1; }
  [[nodiscard]] Vector placed() const override { return Vector::Constant(places(), e_); }

  void imbalance(double t, const ConstVector& place, const ConstVector& y,
                 Eigen::Ref<Vector> imbalance, Vector& elongation) override {
    ++work().rates;
    const double e = depth_driven_ ? imposed(t) : place[0];
    elongation.setConstant(1, e);
    if (!depth_driven_) imbalance[0] = law_.force(e, y[0], 0.0) - imposed(t);
  }

  MethodEnd factorise_pair(double /*t*/, const ConstVector& place, const ConstVector& /*y*/,
                           double per_y) override {
    ++work().factorisations;
    per_y_ = per_y;
    const double relaxation_factor = 1.0 / (1.0 + per_y * tau_);
    pivot_ = depth_driven_ ? 1.0 : law_.slope(place[0], relaxation_factor);
    return pivot_ != 0.0 ? MethodEnd::completed : MethodEnd::newton_failed;
  }

  void solve_pair(Eigen::Ref<Vector> place, Eigen::Ref<Vector> y) override {
    ++work().solves;
    const double sum = per_y_ + 1.0 / tau_;
    double e = 0.0;
    if (!depth_driven_) {
      e = (place[0] + law_.relaxing() * y[0] / sum) / pivot_;
      place[0] = e;
    }
    y[0] = (y[0] + e / tau_) / sum;
  }

  [[nodiscard]] Place place() const override {
    return {Vector::Constant(1, e_), known_.imposed, Vector::Constant(1, known_.y)};
  }
  void set_place(const Place& place) override {
    e_ = place.position[0];
    known_ = {place.imposed, place.y[0]};
  }

 private:
  /// Depth that may be expected.
  static double depth_scale(const BondElement& p, const Protocol& protocol) {
    const double peak = protocol.peak();
    if (protocol.drive() == Drive::displacement) return peak;
    if (p.equilibrium_Pa > 0.0 || p.lateral_Pa > 0.0) {
      return std::abs(equilibrium_depth_m(p, p.equilibrium_Pa, peak));
    }
    // A Maxwell fluid flows for as long as it is pushed; with neither spring it is free.
    constexpr double kSoft_Pa = 12e3;
    const double modulus = p.relaxing_Pa() > 0.0 ? p.relaxing_Pa() : kSoft_Pa;
    const double lasts = protocol.knots().back().time_s - protocol.start_s();
    return peak / (modulus * p.modulus_to_stiffness_m()) * (1.0 + lasts / p.relaxation_time_s());
  }

  /// Where the element and what draws it carry a load.
  MethodEnd balance(double load, double offset, double relaxation_factor, const Drawn& drawn,
                    double& at) {
    constexpr int kMost = 100;
    double e = at;
    for (int i = 0; i < kMost; ++i) {
      ++work().rates;
      ++work().factorisations;
      ++work().solves;
      const double left =
          law_.force(e, offset, relaxation_factor) + drawn.stiffness * (e - drawn.to) - load;
      const double slope = law_.slope(e, relaxation_factor) + drawn.stiffness;
      // Where nothing resists at rest, tension does further on.
      const double step = slope > 0.0 ? left / slope : std::copysign(depth_scale_, left);
      if (!std::isfinite(step)) return MethodEnd::newton_failed;
      e -= step;
      if (std::abs(step) <= kDepthResolution * std::max(std::abs(e), 1e-3 * depth_scale_)) {
        at = e;
        return MethodEnd::completed;
      }
    }
    return MethodEnd::newton_failed;
  }

  /// Without masses: puts the sphere where it is for what is imposed and its viscous elongation.
  MethodEnd place_at(double imposed, double y) {
    // The value imposed at one time may have been computed in two ways.
    constexpr double kRounding = 1e-13;
    const bool same = std::abs(known_.imposed - imposed) <= kRounding * peak_;
    if (same && known_.y == y) return MethodEnd::completed;
    if (depth_driven_) {
      e_ = imposed;
    } else if (const auto end = balance(imposed, y, 0.0, {}, e_); end != MethodEnd::completed) {
      return end;
    }
    known_ = {imposed, y};
    return MethodEnd::completed;
  }

  ElementForce law_;
  double tau_;
  Vector times_s_;
  double peak_;  ///< of what is imposed
  bool depth_driven_;
  double mass_, drag_;
  bool moves_;
  double depth_scale_, speed_scale_;

  double e_ = 0.0;  ///< without masses: depth
  struct Known {
    double imposed, y;
  };
  Known known_{0.0, 0.0};  ///< what it belongs to

  double gamma_ = 0.0, per_y_ = 0.0, relaxation_factor_ = 0.0, pivot_ = 0.0;
};

}  // namespace

std::unique_ptr<StepSystem> element_system(const BondElement& material, const Protocol& protocol,
                                           const std::optional<MethodMasses>& mass) {
  return std::make_unique<ElementSystem>(material, protocol, mass);
}

}  // namespace tpm::organ
