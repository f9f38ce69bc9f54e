#include "tpm/fit/predict/contact_profile.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

namespace tpm::fit {
namespace {

constexpr double kContactStep = 1.0 / 3.0;  // of contact's standard error
constexpr int kMostContactSteps = 40;       // to each side

/// The minimum over all other parameters at one contact, of theta.
struct AtContact {
  double contact = 0.0;
  double deviance = 0.0;
  Eigen::VectorXd theta;     // of all parameters
  Eigen::VectorXd variance;  // of the others, in units of the residuals' variance
};

class Walker {
 public:
  Walker(const ResidualFunction& residuals, const ContactWalk& walk)
      : residuals_(residuals), walk_(walk) {
    for (const Eigen::Index i : walk.free) {
      if (i != walk.contact) others_.push_back(i);
    }
  }

  [[nodiscard]] Eigen::VectorXd theta_at_minimum() const {
    return theta_of(walk_.parameters, walk_.natural);
  }

  /// Derivatives of the residuals by theta; none where they cannot be computed.
  [[nodiscard]] std::optional<RowMatrix> slopes(const Eigen::VectorXd& theta,
                                                Eigen::VectorXd& residual) const {
    std::vector<double> natural;
    for (Eigen::Index i = 0; i < theta.size(); ++i) {
      natural.push_back(parameter(i).natural(theta[i]));
    }
    RowMatrix jacobian;
    if (!residuals_.evaluate(natural, residual, &jacobian)) return std::nullopt;
    return jacobian * natural_slopes(walk_.parameters, theta).asDiagonal();
  }

  /// One Gauss-Newton step of the others from `theta`, contact kept.
  [[nodiscard]] std::optional<AtContact> at(Eigen::VectorXd theta) const {
    Eigen::VectorXd residual;
    const auto jacobian = slopes(theta, residual);
    if (!jacobian) return std::nullopt;
    const Eigen::MatrixXd columns = (*jacobian)(Eigen::all, others_);
    const Eigen::LLT<Eigen::MatrixXd> normal(columns.transpose() * columns);
    if (normal.info() != Eigen::Success) return std::nullopt;
    const Eigen::VectorXd right = -columns.transpose() * residual;
    const Eigen::VectorXd step = normal.solve(right);
    AtContact result;
    result.contact = theta[walk_.contact];
    result.deviance = residual.squaredNorm() - right.dot(step);
    theta(others_) += step;
    for (const Eigen::Index i : others_) {
      theta[i] = std::clamp(theta[i], parameter(i).theta_lower(), parameter(i).theta_upper());
    }
    result.theta = std::move(theta);
    result.variance =
        normal.solve(Eigen::MatrixXd::Identity(std::ssize(others_), std::ssize(others_)))
            .diagonal();
    if (!std::isfinite(result.deviance)) return std::nullopt;
    return result;
  }

  /// The minimum and the contacts around it, from the lowest on; empty if the walk cannot be made.
  [[nodiscard]] std::vector<AtContact> contacts(double step, double most_squares) const {
    const std::optional<AtContact> middle = at(theta_at_minimum());
    if (!middle) return {};
    std::vector<AtContact> found{*middle};
    const double border = middle->deviance * (1.0 + most_squares);
    for (const double side : {-1.0, 1.0}) {
      Eigen::VectorXd theta = middle->theta;
      for (int k = 0; k < kMostContactSteps; ++k) {
        theta[walk_.contact] += side * step;
        const FitParameter& contact = parameter(walk_.contact);
        if (theta[walk_.contact] < contact.theta_lower() ||
            theta[walk_.contact] > contact.theta_upper()) {
          break;
        }
        std::optional<AtContact> next = at(theta);
        if (!next) return {};
        theta = next->theta;
        const bool beyond = next->deviance > border;
        found.push_back(*std::move(next));
        if (beyond) break;
      }
    }
    return found;
  }

  [[nodiscard]] std::span<const Eigen::Index> others() const { return others_; }

 private:
  [[nodiscard]] const FitParameter& parameter(Eigen::Index i) const {
    return walk_.parameters[static_cast<std::size_t>(i)];
  }

  const ResidualFunction& residuals_;
  const ContactWalk& walk_;
  std::vector<Eigen::Index> others_;
};

}  // namespace

IntervalFactors profile_contact(const ResidualFunction& residuals, const ContactWalk& walk) {
  const auto count = std::ssize(walk.parameters);
  IntervalFactors factors{Eigen::VectorXd::Ones(count), Eigen::VectorXd::Ones(count)};
  const Walker walker(residuals, walk);
  Eigen::VectorXd residual;
  const auto jacobian = walker.slopes(walker.theta_at_minimum(), residual);
  if (!jacobian || walker.others().empty()) return factors;
  const std::vector<Eigen::Index> free(walk.free.begin(), walk.free.end());
  const Eigen::MatrixXd columns = (*jacobian)(Eigen::all, free);
  const auto p = columns.cols();
  const double degrees = static_cast<double>(walk.residual_count - p);
  const Eigen::LLT<Eigen::MatrixXd> normal(columns.transpose() * columns);
  if (normal.info() != Eigen::Success || !(degrees > 0.0)) return factors;
  const Eigen::VectorXd variance =
      normal.solve(Eigen::MatrixXd::Identity(p, p)).diagonal();  // over s^2
  const double s = std::sqrt(residual.squaredNorm() / degrees);
  const auto place = std::find(free.begin(), free.end(), walk.contact) - free.begin();
  const double most = *std::max_element(walk.quantiles.begin(), walk.quantiles.end());
  const std::vector<AtContact> contacts =
      walker.contacts(kContactStep * s * std::sqrt(variance[place]), most * most / degrees);
  if (contacts.empty()) return factors;
  const auto least = std::ranges::min_element(contacts, {}, &AtContact::deviance);
  const double s2 = least->deviance / degrees;
  const Eigen::VectorXd theta = walker.theta_at_minimum();
  for (Eigen::Index k = 0; k < p; ++k) {
    const Eigen::Index i = free[static_cast<std::size_t>(k)];
    const double quantile = walk.quantiles[static_cast<std::size_t>(k)];
    const double plain = quantile * s * std::sqrt(variance[k]);
    const Eigen::Index other = k < place ? k : k - 1;
    double below = 0.0, above = 0.0;
    if (k == place) below = above = plain;  // the walk's last step before the border is less
    for (const AtContact& c : contacts) {
      const double left = quantile * quantile * s2 - (c.deviance - least->deviance);
      if (left < 0.0) continue;
      const double half = k == place ? 0.0 : std::sqrt(left * c.variance[other]);
      below = std::max(below, theta[i] - c.theta[i] + half);
      above = std::max(above, c.theta[i] - theta[i] + half);
    }
    factors.lower[i] = below / plain;
    factors.upper[i] = above / plain;
  }
  return factors;
}

}  // namespace tpm::fit
