#pragma once
#include "tpmkit/model.hpp"

namespace tpm::organ {

/// The single contact as an initial value problem in the paper's own state e1, integrated by
/// CVODES (BDF) with forward sensitivities under error control:
///     eta1 de1/dt = E2 e - (E1 + E2) e1
/// with e imposed, or e the root of E2 (e - e1) + lambda1(e) e = load l0/A0. Restarted at every
/// knot of the protocol, because integrating across a kink loses order. Covers every protocol and
/// both the true and a frozen lambda1; a cross-check on the closed form, and the formulation
/// for changing loads.
class CvodesElement final : public Model {
 public:
  /// options.relative_tolerance in [1e-13, 1e-2]; the absolute tolerance is 1e-3 of
  /// that fraction of the largest depth. Throws Error(bad_input).
  explicit CvodesElement(const ModelOptions& options);

  [[nodiscard]] std::string_view name() const override { return "cvodes"; }
  [[nodiscard]] std::span<const ParameterDescription> parameters() const override {
    return kTpmParameterTable;
  }
  [[nodiscard]] Response respond(const Protocol& protocol, std::span<const double> times_s,
                                 std::span<const double> parameters, Want want) const override;

 private:
  ModelOptions options_;
};

}  // namespace tpm::organ
