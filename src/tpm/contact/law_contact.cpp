#include "tpm/contact/law_contact.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::contact {
namespace {

constexpr double kRoom = 1.2;  // a hand overshoots; a law may be followed so far beyond its data
constexpr double kFractionalTolerance = 1e-8;

LawAtParameters law_in_loop(const LawFile& file, const LawContactSettings& settings) {
  const LawSpec& spec = file.spec;
  if (spec.drive != Quantity::indentation_depth || spec.response != Quantity::contact_force) {
    throw bad_input(
        fmt::format("law {}", law_name(spec)),
        fmt::format("{} over {}", quantity_name(spec.response), quantity_name(spec.drive)),
        "a contact force over an indentation depth: no other can be felt");
  }
  const auto positive = [](double value, const char* what) {
    if (value > 0.0 && std::isfinite(value)) return;
    throw bad_input("law in a loop", fmt::format("{} = {}", what, shortest(value)), "above 0");
  };
  positive(settings.period_s, "period");
  positive(settings.deepest_m, "deepest place");
  positive(settings.deepest_valid_m, "valid depth");
  const LawModel model(spec);
  model.require_in_range(file.values);
  std::optional<ExponentialSum> rates;
  if (spec.fractional != Fractional::none) {
    rates.emplace(settings.period_s, std::max(settings.longest_s, settings.period_s),
                  kFractionalTolerance);
  }
  LawAtParameters law = model.at(file.values, rates ? &*rates : nullptr);
  law.contact = law.offset = 0.0;
  return law;
}

}  // namespace

LawContact::LawContact(const LawFile& law, const LawContactSettings& settings)
    : settings_(settings), law_(law_in_loop(law, settings)) {
  const Eigen::ArrayXd z = law_.relaxation.rate_per_s.array() * settings_.period_s;
  decay_ = (-z).exp();
  gain_ = (z > 0.0).select(-(-z).unaryExpr([](double x) { return std::expm1(x); }) / z, 1.0);
  y_ = Eigen::VectorXd::Zero(z.size());
}

void LawContact::reset() noexcept {
  y_.setZero();
  depth_m_ = kernel_m_ = 0.0;
}

void LawContact::take_over(double depth_m, double relaxed_kernel_m) noexcept {
  depth_m_ = depth_m;
  kernel_m_ = law_.kernel.value(std::max(depth_m, 0.0));
  y_.setConstant(kernel_m_ - relaxed_kernel_m);
}

ContactAnswer LawContact::step(const ToolPose& tool) noexcept {
  const double depth = tool.displacement_m.z();
  const double u = std::max(depth, 0.0);
  const double kernel = law_.kernel.value(u);
  const double moved = kernel - kernel_m_;
  y_ = decay_.cwiseProduct(y_) + moved * gain_;
  double force = law_.relaxation.constant * kernel + law_.relaxation.stiffness.dot(y_) +
                 law_.relaxation.dashpot * moved / settings_.period_s;
  if (law_.k_tension != 0.0) force += law_.k_tension * law_.tension.at(u).value;
  ContactAnswer answer;
  answer.force_N.z() = -force;
  // V is taken as linear within a period: this is how far it is from that.
  const double between = law_.kernel.value(0.5 * (std::max(depth_m_, 0.0) + u));
  answer.error_N = law_.relaxation.stiffness.sum() * std::abs(between - 0.5 * (kernel + kernel_m_));
  answer.valid = depth <= settings_.deepest_valid_m;
  depth_m_ = depth;
  kernel_m_ = kernel;
  return answer;
}

Eigen::Matrix3d LawContact::along_push(double stiffness_N_per_m) const noexcept {
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
  const double tension = law_.k_tension == 0.0
                             ? 0.0
                             : law_.k_tension * law_.tension.tangent(settings_.deepest_m).slope;
  stiffness(2, 2) = stiffness_N_per_m * law_.kernel.tangent(settings_.deepest_m).slope + tension;
  return stiffness;
}

Eigen::Matrix3d LawContact::instantaneous_stiffness() const noexcept {
  return along_push(law_.relaxation.instant() + law_.relaxation.dashpot / settings_.period_s);
}

Eigen::Matrix3d LawContact::equilibrium_stiffness() const noexcept {
  return along_push(law_.relaxation.constant);
}

std::vector<double> LawContact::relaxation_times_s() const {
  // Faster ones are over within a period, slower ones do not relax in a session.
  const double shortest_s = 0.1 * settings_.period_s, longest_s = 1e6;
  double fastest_s = longest_s, slowest_s = 0.0;
  for (Eigen::Index j = 0; j < law_.relaxation.rate_per_s.size(); ++j) {
    if (!(law_.relaxation.stiffness[j] > 0.0) || !(law_.relaxation.rate_per_s[j] > 0.0)) continue;
    const double time_s = std::clamp(1.0 / law_.relaxation.rate_per_s[j], shortest_s, longest_s);
    fastest_s = std::min(fastest_s, time_s);
    slowest_s = std::max(slowest_s, time_s);
  }
  if (slowest_s == 0.0) return {};
  if (fastest_s == slowest_s) return {fastest_s};
  return {fastest_s, slowest_s};
}

double valid_depth_m(const LawFile& law, double deepest_m) {
  return kRoom * (law.fitted_to ? *law.fitted_to : deepest_m);
}

}  // namespace tpm::contact
