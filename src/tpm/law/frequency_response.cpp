#include "tpmkit/frequency_response.hpp"

#include <fmt/format.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/kernel.hpp"
#include "tpm/law/operational_stiffness.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm {
using namespace law;

namespace {

using Complex = std::complex<double>;
using ComplexRow = Eigen::RowVectorXcd;

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

/// Effect of the operating depth on G*: K* = kernel.slope G* + k_tension tension.slope.
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

ComplexStiffness total_stiffness(const Operation& o, ComplexStiffness g) {
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
    const ComplexStiffness k = at(angular(frequency_Hz[static_cast<std::size_t>(i)]));
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
  const OperationalStiffness stiffness(spec, parameters);
  return collect(frequency_Hz, parameters.size(), want, [&](double omega) {
    return total_stiffness(operation, stiffness.at({std::log(omega), 0.5 * std::numbers::pi}));
  });
}

SpectrumResponse element_spectrum(const TpmVector& parameters, std::span<const double> frequency_Hz,
                                  Want want) {
  require_valid(from_vector(parameters), "spectrum");
  const double E1 = parameters[kE1], E2 = parameters[kE2], eta1 = parameters[kEta1];
  return collect(frequency_Hz, kTpmParameterCount, want, [&](double omega) {
    const Complex part = E2 / (E1 + Complex(E2, omega * eta1));
    ComplexStiffness e{E2 * (1.0 - part), ComplexRow::Zero(kTpmParameterCount)};
    e.by[kE1] = part * part;
    e.by[kE2] = (1.0 - part) * (1.0 - part);
    e.by[kEta1] = Complex(0.0, omega) * part * part;
    return e;
  });
}

}  // namespace tpm
