#pragma once
#include "tpm/fit/likelihood/bootstrap.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"

namespace tpm::fit {

/// The refits of a configuration for bootstrap(). A reading is a fitted value, a recording one data
/// set of the configuration; bands stay in every refit as they are.
class ExperimentRefit final : public Refittable {
 public:
  /// Keeps a reference.
  explicit ExperimentRefit(const ExperimentResiduals& function);

  [[nodiscard]] std::vector<std::size_t> recording_lengths() const override;
  [[nodiscard]] std::vector<double> standardised_residuals(
      std::span<const double> natural) const override;
  /// Throws Error(bad_input) if a scattered value has no standard deviation under the noise (0
  /// under relative noise).
  [[nodiscard]] std::unique_ptr<ResidualFunction> with_residuals(
      std::span<const double> natural, std::span<const double> z) const override;
  [[nodiscard]] std::unique_ptr<ResidualFunction> with_readings(
      std::span<const std::size_t> readings) const override;

 private:
  const ExperimentResiduals& function_;
  std::vector<std::size_t> readings_;  ///< places in function_.data()
};

/// bootstrap() of a configuration. Throws Error(bad_input) as bootstrap() does, and for whole
/// recordings if a parameter belongs to some of them only: a draw without those cannot tell it.
[[nodiscard]] BootstrapResult bootstrap_experiments(const ExperimentResiduals& function,
                                                    std::span<const FitParameter> parameters,
                                                    const Minimum& minimum,
                                                    const BootstrapOptions& options);

[[nodiscard]] Resampling parse_resampling(std::string_view text, std::string_view where);
[[nodiscard]] std::string_view resampling_name(Resampling resampling) noexcept;

}  // namespace tpm::fit
