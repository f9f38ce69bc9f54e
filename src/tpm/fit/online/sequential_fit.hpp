#pragma once
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/likelihood/parameter.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpm/law/contact_history.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {

/// Settings of a fit sample by sample.
struct SequentialSettings {
  double level = 0.95;
  double reference = 1e-3;  ///< depth that coefficients refer to: the planned one
  /// The history is gone through again when the estimate has moved by so many standard errors from
  /// where the law was linearised, or the number of samples has grown by this part.
  double moved = 0.25;
  double grown = 0.1;
  std::size_t starts = 30;  ///< of a search from anywhere, each time the samples have doubled
  std::uint64_t seed = 0;
};

/// Estimate of one parameter after some samples; SI.
struct SequentialParameter {
  FitParameter parameter;
  std::size_t place = 0;  ///< in law_parameters()
  bool nuisance = false;
  double estimate = 0.0;
  double standard_error = 0.0;  ///< of theta; infinite where the data do not tell
  double degrees_of_freedom = 1.0;
  double lower = 0.0, upper = 0.0;
  bool at_bound = false;

  /// Half the width of the interval in parts of the estimate; infinite at a bound.
  [[nodiscard]] double relative_half_width() const;
};

/// Estimate of a law after some samples.
struct SequentialEstimate {
  std::size_t samples = 0;     ///< that count, from shortly before contact on
  double phi = 0.0;            ///< lag-1 correlation of the noise
  double sigma = 0.0;          ///< standard deviation of one reading, SI
  double bic = 0.0;            ///< -2 ln L of the whitened residuals + k ln n, k with phi and sigma
  std::vector<double> values;  ///< of the whole law, SI
  std::vector<SequentialParameter> parameters;
  Eigen::MatrixXd covariance;  ///< of theta, in the order of `parameters`; rows at bounds are 0
  bool identified = false;     ///< material parameters off their bounds, all intervals finite

  /// The widest of the material parameters; infinite unless identified.
  [[nodiscard]] double widest_relative_half_width() const;
};

/// Fits one law while a recording is made: sequential Gauss-Newton steps on the whitened residuals.
/// The law's response and its exact derivatives at the point of linearisation come from
/// ContactHistory step by step; a sample costs O(branches * parameters + parameters^2). Where the
/// estimate has moved the history is gone through again: bounds from what has been recorded so far,
/// a search from nearby, the correlation of the noise by REML. Nothing of the future is used.
class SequentialFit {
 public:
  /// Throws Error(bad_input) for fractional laws and relaxing Hertz kernels, whose answers are no
  /// recursion.
  SequentialFit(const LawSpec& law, Quantity drive, Quantity response, SequentialSettings settings);
  ~SequentialFit();
  SequentialFit(SequentialFit&&) noexcept;
  SequentialFit& operator=(SequentialFit&&) noexcept;

  /// @param time_s later than the sample before
  void add(double time_s, double drive, double response);
  /// None until a ramp has been seen and more samples than parameters.
  [[nodiscard]] const std::optional<SequentialEstimate>& estimate() const { return estimate_; }
  [[nodiscard]] const LawSpec& law() const { return spec_; }
  /// Number of times that the history was gone through again.
  [[nodiscard]] int passes() const { return passes_; }

 private:
  struct Linearisation;
  /// Samples recorded so far, ready to be fitted.
  struct Prefix {
    PreparedRecording recording;
    FitConfig config;
  };

  [[nodiscard]] std::optional<Prefix> prefix() const;
  [[nodiscard]] std::vector<std::vector<double>> next_starts(const ResidualFunction& function,
                                                             const FitConfig& config);
  void pass_through_history();
  void describe();

  LawSpec spec_;
  SequentialSettings settings_;
  Recording recording_;
  std::unique_ptr<Linearisation> here_;
  std::optional<SequentialEstimate> estimate_;
  std::size_t next_pass_ = 0;    ///< number of samples that make one due
  std::size_t next_search_ = 0;  ///< and a search from anywhere
  int passes_ = 0;
};

/// The simplest law among estimates: of those identified (if none is, of all) the one with the
/// fewest parameters whose BIC is within the margin of their least. None if there are no estimates.
[[nodiscard]] std::optional<std::size_t> least_law(std::span<const SequentialFit> fits,
                                                   double margin);

}  // namespace tpm::fit
