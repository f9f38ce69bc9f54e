#include "tpm/law/kernel.hpp"

#include <algorithm>
#include <cmath>

namespace tpm::law {

TensionShape::Values TensionShape::at(double u) const {
  if (u <= 0.0) return {0.0, 0.0, 0.0};
  // With y = 1/x, root = sqrt(1 + u^2 y^2) and q = root (root + 1), phi = u^2 y^2 / q: no
  // cancellation, and regular at y = 0.
  const double y = 1.0 / spacing;
  if (y == 0.0) {
    const double ratio2 = (u / reference) * (u / reference);
    return {u * ratio2, 3.0 * ratio2, 0.0};
  }
  const auto root = [y](double v) { return std::sqrt(1.0 + v * v * y * y); };
  const double root_u = root(u);
  const double root_r = root(reference);
  const double q_u = root_u * (root_u + 1.0);
  const double q_r = root_r * (root_r + 1.0);
  const double value = u * (u / reference) * (u / reference) * (q_r / q_u);
  const double stretch_u = (2.0 * root_u + 1.0) / (root_u * q_u);  // d ln q / d(v^2 y^2 / 2)
  const double stretch_r = (2.0 * root_r + 1.0) / (root_r * q_r);
  const double d_log_y = y * (reference * reference * stretch_r - u * u * stretch_u);
  return {value, value * (3.0 / u - u * y * y * stretch_u), -y * y * value * d_log_y};
}

TensionShape::Tangent TensionShape::tangent(double u) const {
  if (u <= 0.0) return {0.0, 0.0};
  // T' = T (3/u - u y^2 S) with S = (2 root + 1)/(root^2 (root + 1)), y = 1/x
  const double y = 1.0 / spacing;
  const Values t = at(u);
  const double root = std::sqrt(1.0 + u * u * y * y);
  const double below = root * root * (root + 1.0);
  const double s = (2.0 * root + 1.0) / below;
  const double ds_droot = (2.0 - s * (3.0 * root * root + 2.0 * root)) / below;
  const double d_factor_dy = -u * y * (2.0 * s + y * ds_droot * u * u * y / root);
  return {t.slope, t.d_spacing * (3.0 / u - u * y * y * s) - y * y * t.value * d_factor_dy};
}

KernelShape::KernelShape(Kernel kernel, double reference, double exponent,
                         std::optional<double> tension_share, double spacing)
    : kernel_(kernel),
      reference_(reference),
      exponent_(kernel == Kernel::linear  ? 1.0
                : kernel == Kernel::hertz ? 1.5
                                          : exponent),
      has_share_(tension_share.has_value()),
      share_(tension_share.value_or(0.0)),
      tension_{reference, spacing} {}

double KernelShape::value(double u) const {
  if (u <= 0.0) return 0.0;
  double w = u;
  if (kernel_ == Kernel::hertz) w = u * std::sqrt(u / reference_);
  if (kernel_ == Kernel::power) w = reference_ * std::exp(exponent_ * std::log(u / reference_));
  return share_ == 0.0 ? w : w + share_ * (tension_.at(u).value - w);
}

KernelShape::Values KernelShape::at(double u) const {
  if (u <= 0.0) return {0.0, kernel_ == Kernel::linear ? 1.0 - share_ : 0.0, 0.0, 0.0, 0.0};
  Values k{u, 1.0, 0.0, 0.0, 0.0};
  if (kernel_ == Kernel::hertz) {
    const double root = std::sqrt(u / reference_);
    k.value = u * root;
    k.slope = 1.5 * root;
  } else if (kernel_ == Kernel::power) {
    const double log_u = std::log(u / reference_);
    k.value = reference_ * std::exp(exponent_ * log_u);
    k.slope = exponent_ * k.value / u;
    k.d_exponent = k.value * log_u;
  }
  if (!has_share_) return k;
  const TensionShape::Values t = tension_.at(u);
  k.d_share = t.value - k.value;
  if (share_ != 0.0) {
    k.value += share_ * (t.value - k.value);
    k.slope += share_ * (t.slope - k.slope);
    k.d_spacing = share_ * t.d_spacing;
    k.d_exponent *= 1.0 - share_;
  }
  return k;
}

KernelShape::Jet KernelShape::jet(double u) const {
  if (has_share_ || u <= 0.0) return {at(u), tangent(u)};
  const Values k = at(u);
  // V = u_ref (u/u_ref)^m: V' = m V/u
  const double by_exponent =
      kernel_ == Kernel::power ? (k.value + exponent_ * k.d_exponent) / u : 0;
  return {k, {k.slope, by_exponent, 0.0, 0.0}};
}

double KernelShape::slope(double u) const {
  double of_kernel = 1.0;
  if (kernel_ == Kernel::hertz) of_kernel = 1.5 * std::sqrt(u / reference_);
  if (kernel_ == Kernel::power) of_kernel = exponent_ * std::pow(u / reference_, exponent_ - 1.0);
  return share_ == 0.0 ? of_kernel : of_kernel + share_ * (tension_.at(u).slope - of_kernel);
}

KernelShape::Tangent KernelShape::tangent(double u) const {
  const auto t = has_share_ ? tension_.tangent(u) : TensionShape::Tangent{0.0, 0.0};
  double of_kernel = 1.0;
  double by_exponent = 0.0;
  if (kernel_ != Kernel::linear) {
    const double power =
        u > 0.0 ? std::pow(u / reference_, exponent_ - 1.0) : (exponent_ == 1.0 ? 1.0 : 0.0);
    of_kernel = exponent_ * power;
    if (kernel_ == Kernel::power && u > 0.0) {
      by_exponent = power * (1.0 + exponent_ * std::log(u / reference_));
    }
  }
  return {(1.0 - share_) * of_kernel + share_ * t.slope, (1.0 - share_) * by_exponent,
          has_share_ ? t.slope - of_kernel : 0.0, share_ * t.d_spacing};
}

double KernelShape::quartic_error(double a, double b) const {
  const double v0 = value(a);
  const double v1 = value(0.75 * a + 0.25 * b);
  const double v2 = value(0.5 * (a + b));
  const double v3 = value(0.25 * a + 0.75 * b);
  const double v4 = value(b);
  const double early = (35.0 * v0 + 140.0 * v1 - 70.0 * v2 + 28.0 * v3 - 5.0 * v4) / 128.0;
  const double late = (-5.0 * v0 + 28.0 * v1 - 70.0 * v2 + 140.0 * v3 + 35.0 * v4) / 128.0;
  return std::max(std::abs(early - value(0.875 * a + 0.125 * b)),
                  std::abs(late - value(0.125 * a + 0.875 * b)));
}

double KernelShape::inverse(double v) const {
  if (v <= 0.0) return 0.0;
  const auto of_kernel = [this](double w) {
    return kernel_ == Kernel::linear ? w : reference_ * std::pow(w / reference_, 1.0 / exponent_);
  };
  if (share_ == 0.0) return of_kernel(v);
  // V is convex and the start is at least as deep as the root: Newton falls monotonically
  // onto it. V >= (1 - share) V0 gives such a start, unless nearly everything is tension.
  double u = reference_;
  if (share_ < 0.999) {
    u = of_kernel(v / (1.0 - share_));
  } else {
    while (value(u) < v) u *= 2.0;
  }
  for (int i = 0; i < 200; ++i) {
    const Values k = at(u);
    const double next = u - (k.value - v) / k.slope;
    if (!(next < u)) break;
    u = next;
  }
  return u;
}

KernelBetween kernel_between(double depth_change, double v0, double slope0, double v1,
                             double slope1) {
  const double m0 = depth_change * slope0;
  const double m1 = depth_change * slope1;
  const double rise = v1 - v0;
  return {{v0 + 0.15625 * rise + 0.140625 * m0 - 0.046875 * m1, v0 + 0.5 * rise + 0.125 * (m0 - m1),
           v0 + 0.84375 * rise + 0.046875 * m0 - 0.140625 * m1},
          {(1.125 * rise + 0.1875 * m0 - 0.3125 * m1) / depth_change,
           (1.5 * rise - 0.25 * (m0 + m1)) / depth_change,
           (1.125 * rise - 0.3125 * m0 + 0.1875 * m1) / depth_change}};
}

}  // namespace tpm::law
