#pragma once

namespace tpm::law {

/// A number that depends on the order alpha and on a place x on an axis of logarithmic rates.
struct SpectralValue {
  double value = 0.0;
  double d_alpha = 0.0;
  double d_x = 0.0;

  SpectralValue& operator+=(const SpectralValue& other) {
    value += other.value;
    d_alpha += other.d_alpha;
    d_x += other.d_x;
    return *this;
  }
  [[nodiscard]] SpectralValue times(double factor) const {
    return {factor * value, factor * d_alpha, factor * d_x};
  }
};

/// The relaxation spectrum of E_alpha(-(t/tau)^alpha) on the axis x = ln(rate tau):
///
///     E_alpha(-(t/tau)^alpha) = integral w(x) exp(-e^x t/tau) dx
///     w(x) = sin(pi alpha) / (2 pi (cosh(alpha x) + cos(pi alpha))),  integral w dx = 1
///
/// (Gorenflo and Mainardi 1997). w is even, positive, and for alpha = 1 zero except at x = 0. Its
/// poles nearest to the real axis are at x = +- i pole_height().
class RelaxationSpectrum {
 public:
  /// @param alpha 0 < alpha <= 1, not checked
  explicit RelaxationSpectrum(double alpha);

  /// w(x). Within 0.1 of a pole digits are lost in proportion to the distance.
  [[nodiscard]] SpectralValue density(double x) const;
  /// The integral of w from x to infinity.
  [[nodiscard]] SpectralValue beyond(double x) const;
  /// The sum of h w(x + k h) over k = 0, 1, ... : the integral from x - h/2 on, and Gauss's central
  /// differences up to the seventh. For h <= 0.25 and x >= 6 the error is below 1e-10 of the sum
  /// and below 1e-13; it grows with (alpha h)^9 and towards the peak, unless the peak is wide
  /// (small alpha), where any x will do.
  [[nodiscard]] SpectralValue sum_from(double x, double h) const;

  [[nodiscard]] double alpha() const { return alpha_; }
  /// pi (1 - alpha) / alpha.
  [[nodiscard]] double pole_height() const { return pole_height_; }
  /// pi (1 - alpha): the pole's height on the axis alpha x.
  [[nodiscard]] double pole_angle() const { return pole_angle_; }

 private:
  double alpha_;
  double pole_angle_;
  double pole_height_;
  double sine_;    ///< sin(pi alpha), exactly 0 at alpha = 1
  double cosine_;  ///< cos(pi alpha)
  double gap_;     ///< 1 + cos(pi alpha), without cancellation
};

}  // namespace tpm::law
