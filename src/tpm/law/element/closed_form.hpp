#pragma once
#include "tpmkit/model.hpp"

namespace tpm::law {

/// The single contact, exact:
///  - displacement-driven, any piecewise linear history: exact update of the relaxing branch,
///        F = [ P2 e + g (e - w) + lambda1(e) e ] A0/l0,   g = E2^2/(E1+E2),  dw/dt = (e - w)/tau,
///    with the true lambda1(e), because the displacement is known at each instant;
///  - force-driven with frozen lambda1, any piecewise linear history: the same update with the
///    retardation time (Eq. 14 is the special case of a constant load);
///  - force-driven with the true lambda1(e), constant load: time as a quadrature over depth
///    (creep_exact.hpp). Other loads have no closed form: Error(bad_input) names "cvodes".
/// Sensitivities are exact in every case.
class ClosedForm final : public Model {
 public:
  explicit ClosedForm(const ModelOptions& options) : tension_(options.tension) {}

  [[nodiscard]] std::string_view name() const override { return "closed_form"; }
  [[nodiscard]] std::span<const ParameterDescription> parameters() const override {
    return kTpmParameterTable;
  }
  [[nodiscard]] Response respond(const Protocol& protocol, std::span<const double> times_s,
                                 std::span<const double> parameters, Want want) const override;

 private:
  TensionRule tension_;
};

/// Reads and checks a parameter vector of kTpmParameterTable; shared by the formulations.
[[nodiscard]] TpmParameters tpm_parameters(std::span<const double> parameters);

}  // namespace tpm::law
