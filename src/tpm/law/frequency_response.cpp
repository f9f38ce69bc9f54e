#include "tpm/law/frequency_response.hpp"

#include <fmt/format.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/law/kelvin_chain.hpp"
#include "tpm/law/kernel.hpp"
#include "tpm/law/law_model.hpp"

namespace tpm {
namespace {

using Complex = std::complex<double>;
using ComplexRow = Eigen::RowVectorXcd;

/// A complex stiffness and its derivatives by the parameters of the law.
struct Sloped {
  Complex value;
  ComplexRow by;
};

double angular(double frequency_Hz) {
  return 2.0 * std::numbers::pi * frequency_Hz;
}

void require_frequencies(std::span<const double> frequency_Hz) {
  for (const double f : frequency_Hz) {
    if (f > 0.0 && std::isfinite(f)) continue;
    throw bad_input("spectrum", fmt::format("frequency {} Hz", shortest(f)),
                    "a frequency above 0 Hz");
  }
}

/// G* of k_inf (if solid), k_1.., tau_1.. at the angular frequency `omega`; derivatives into the
/// first entries of `by`.
Sloped branch_stiffness(bool solid, int branches, std::span<const double> parallel, double omega,
                        Eigen::Index parameter_count) {
  Sloped g{0.0, ComplexRow::Zero(parameter_count)};
  const Eigen::Index first = solid ? 1 : 0;
  if (solid) {
    g.value = parallel[0];
    g.by[0] = 1.0;
  }
  for (Eigen::Index j = 0; j < branches; ++j) {
    const double k = parallel[static_cast<std::size_t>(first + j)];
    const double tau = parallel[static_cast<std::size_t>(first + branches + j)];
    const Complex relaxed = 1.0 / (1.0 + Complex(0.0, omega * tau));
    const Complex share = Complex(0.0, omega * tau) * relaxed;
    g.value += k * share;
    g.by[first + j] = share;
    g.by[first + branches + j] = k * share * relaxed / tau;
  }
  return g;
}

Sloped chain_stiffness(int units, std::span<const double> values, double omega,
                       Eigen::Index parameter_count) {
  const auto at = [&](int i) { return values.begin() + i; };
  const KelvinChain chain{
      values[0], {at(1), at(1 + units)}, {at(1 + units), at(1 + 2 * units)}, 0.0};
  const ParallelWithSlopes parallel = to_parallel_with_slopes(chain);
  std::vector<double> flat{parallel.law.k_inf};
  flat.insert(flat.end(), parallel.law.k.begin(), parallel.law.k.end());
  flat.insert(flat.end(), parallel.law.tau_s.begin(), parallel.law.tau_s.end());
  Sloped g = branch_stiffness(true, units, flat, omega, parameter_count);
  const Eigen::Index n = parallel.slopes.rows();
  g.by.head(n) = (g.by.head(n) * parallel.slopes.cast<Complex>()).eval();
  return g;
}

Sloped fractional_stiffness(Fractional law, std::span<const double> values, double omega,
                            Eigen::Index parameter_count) {
  Sloped g{0.0, ComplexRow::Zero(parameter_count)};
  Eigen::Index place = 0;
  if (law == Fractional::kelvin_voigt || law == Fractional::zener) {
    g.value = values[0];
    g.by[place++] = 1.0;
  }
  const double k1 = values[static_cast<std::size_t>(place)];
  const bool relaxes = law == Fractional::maxwell || law == Fractional::zener;
  const double tau = relaxes ? values[static_cast<std::size_t>(place + 1)] : 1.0;
  const Eigen::Index at_alpha = place + (relaxes ? 2 : 1);
  const double alpha = values[static_cast<std::size_t>(at_alpha)];
  const Complex log_s(std::log(omega * tau), 0.5 * std::numbers::pi);
  const Complex power = std::exp(alpha * log_s);
  const Complex relaxed = relaxes ? 1.0 / (1.0 + power) : 1.0;
  const Complex share = power * relaxed;
  const Complex by_log_power = k1 * share * relaxed;  // d(share)/d(ln power)
  g.value += k1 * share;
  g.by[place] = share;
  if (relaxes) g.by[place + 1] = by_log_power * alpha / tau;
  g.by[at_alpha] = by_log_power * log_s;
  return g;
}

Sloped relaxing_stiffness(const LawSpec& spec, std::span<const double> values, double omega) {
  const auto count = static_cast<Eigen::Index>(values.size());
  if (spec.fractional != Fractional::none) {
    return fractional_stiffness(spec.fractional, values, omega, count);
  }
  return spec.form == BranchForm::series
             ? chain_stiffness(spec.branches, values, omega, count)
             : branch_stiffness(spec.solid, spec.branches, values, omega, count);
}

/// What the depth of operation makes of G*: K* = kernel.slope G* + k_tension tension.slope.
struct Operation {
  KernelShape::Tangent kernel;
  TensionShape::Tangent tension;
  double k_tension;
  int exponent, share, place_k_tension, spacing;  ///< places of the parameters, -1 if none
};

Operation operation_at(const LawModel& law, std::span<const double> values, double depth) {
  const auto find = [&](std::string_view name) {
    const auto& parameters = law.law_parameters();
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      if (parameters[i].name == name) return static_cast<int>(i);
    }
    return -1;
  };
  const auto value = [&](int place, double otherwise) {
    return place < 0 ? otherwise : values[static_cast<std::size_t>(place)];
  };
  const LawSpec& spec = law.spec();
  Operation o{};
  o.exponent = find("exponent");
  o.share = find("tension_share");
  o.place_k_tension = find("k_tension");
  o.spacing = find("spacing");
  const double spacing = value(o.spacing, std::numeric_limits<double>::infinity());
  o.kernel =
      KernelShape(spec.kernel, spec.reference, value(o.exponent, 1.0), value(o.share, 0.0), spacing)
          .tangent(depth);
  o.tension = TensionShape{spec.reference, spacing}.tangent(depth);
  o.k_tension = value(o.place_k_tension, 0.0);
  return o;
}

Sloped total_stiffness(const Operation& o, Sloped g) {
  g.by *= o.kernel.slope;
  if (o.exponent >= 0) g.by[o.exponent] += o.kernel.d_exponent * g.value;
  if (o.share >= 0) {
    g.by[o.share] += o.kernel.d_share * g.value;
    g.by[o.spacing] += o.kernel.d_spacing * g.value;
  }
  g.value *= o.kernel.slope;
  if (o.place_k_tension >= 0) {
    g.value += o.k_tension * o.tension.slope;
    g.by[o.place_k_tension] += o.tension.slope;
    g.by[o.spacing] += o.k_tension * o.tension.d_spacing;
  }
  return g;
}

/// @param at the complex stiffness with its derivatives at an angular frequency
template <class At>
SpectrumResponse collect(std::span<const double> frequency_Hz, std::size_t parameters, Want want,
                         const At& at) {
  require_frequencies(frequency_Hz);
  const auto n = static_cast<Eigen::Index>(frequency_Hz.size());
  SpectrumResponse response;
  response.storage.resize(n);
  response.loss.resize(n);
  if (want == Want::values_and_sensitivity) {
    response.storage_by.resize(n, static_cast<Eigen::Index>(parameters));
    response.loss_by.resize(n, static_cast<Eigen::Index>(parameters));
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const Sloped k = at(angular(frequency_Hz[static_cast<std::size_t>(i)]));
    response.storage[i] = k.value.real();
    response.loss[i] = k.value.imag();
    if (want == Want::values) continue;
    response.storage_by.row(i) = k.by.real();
    response.loss_by.row(i) = k.by.imag();
  }
  return response;
}

}  // namespace

Eigen::VectorXd SpectrumResponse::complex_viscosity(std::span<const double> frequency_Hz) const {
  Eigen::VectorXd viscosity(storage.size());
  for (Eigen::Index i = 0; i < viscosity.size(); ++i) {
    viscosity[i] =
        std::hypot(storage[i], loss[i]) / angular(frequency_Hz[static_cast<std::size_t>(i)]);
  }
  return viscosity;
}

Eigen::VectorXd SpectrumResponse::loss_tangent() const {
  return loss.cwiseQuotient(storage);
}

SpectrumResponse respond_spectrum(const LawSpec& spec, std::span<const double> parameters,
                                  std::span<const double> frequency_Hz,
                                  std::optional<double> operating_depth, Want want) {
  const LawModel law(spec);
  law.require_in_range(parameters);
  const double depth = operating_depth.value_or(spec.reference);
  if (!(depth >= 0.0) || !std::isfinite(depth)) {
    throw bad_input("spectrum", fmt::format("operating depth {}", shortest(depth)),
                    "a depth of at least 0");
  }
  const Operation operation = operation_at(law, parameters, depth);
  return collect(frequency_Hz, parameters.size(), want, [&](double omega) {
    return total_stiffness(operation, relaxing_stiffness(spec, parameters, omega));
  });
}

SpectrumResponse element_spectrum(const TpmParameters& p, std::span<const double> frequency_Hz,
                                  Want want) {
  require_valid(p, "spectrum");
  return collect(frequency_Hz, kTpmParameterCount, want, [&](double omega) {
    const Complex part = p.E2_Pa / (p.E1_Pa + Complex(p.E2_Pa, omega * p.eta1_Pa_s));
    Sloped e{p.E2_Pa * (1.0 - part), ComplexRow::Zero(kTpmParameterCount)};
    e.by[kE1] = part * part;
    e.by[kE2] = (1.0 - part) * (1.0 - part);
    e.by[kEta1] = Complex(0.0, omega) * part * part;
    return e;
  });
}

}  // namespace tpm
