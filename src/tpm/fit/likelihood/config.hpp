#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/import/import.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/likelihood/bootstrap.hpp"
#include "tpm/fit/likelihood/noise.hpp"
#include "tpm/fit/likelihood/parameter.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "tpmkit/curve.hpp"
#include "tpmkit/law.hpp"
#include "tpmkit/model.hpp"

namespace tpm::fit {

/// Protocol of the readings of a data set.
struct ProtocolChoice {
  enum class Kind {
    ramp_hold,    ///< to each datum's depth at `rate`, then held; times count from the ramp's end
    step_hold,    ///< jump to each datum's depth, then constant; times count from the step
    static_,      ///< infinitely slow: the equilibrium force at each depth
    creep,        ///< each datum's load applied suddenly and then constant; times count from then
    measured,     ///< the recording's own displacement history
    oscillation,  ///< small oscillations of the spectrum's frequencies, about `operating_depth`
  };
  Kind kind = Kind::ramp_hold;
  double rate_m_per_s = 0.0;                  ///< ramp_hold
  std::optional<Provenance> rate_provenance;  ///< how well the rate is known
  /// oscillation: m or relative length, >= 0; none: the law's reference
  std::optional<double> operating_depth;
};

[[nodiscard]] std::string_view protocol_kind_name(ProtocolChoice::Kind kind) noexcept;

/// Picks readings of a data set. A missing condition matches everything.
struct Selector {
  std::optional<double> depth_m;
  std::optional<double> load_N;
  std::optional<std::string> label;

  [[nodiscard]] bool matches(const Datum& datum) const;
};

/// One data set of a fit.
struct DataChoice {
  std::string dataset;  ///< id of a shipped curve, or a path
  ProtocolChoice protocol;
  Noise noise;
  std::vector<Selector> exclude;   ///< not used at all
  std::vector<Selector> hold_out;  ///< not fitted, but predicted
  ImportOptions import;            ///< what a recording without a description does not say itself
  /// Samples of a recording outside [from_s, to_s] are predicted, not fitted.
  double from_s = -std::numeric_limits<double>::infinity();
  double to_s = std::numeric_limits<double>::infinity();
  /// Limits of the force cell, SI: samples of a recording that stand at them or beyond are censored
  /// (censored_residual).
  std::optional<double> clipped_above, clipped_below;
  /// Of a recording: response at which contact begins (PhaseOptions::contact_response), SI.
  std::optional<double> contact_response;
  /// Of a recording of stress over strain: the stress was imposed and the strain answers (creep).
  bool load_imposed = false;
  /// A0/l0 of a contact, m, > 0: its stiffness over the modulus that a spectrum states.
  std::optional<double> stiffness_per_modulus_m;
  /// Names of the estimated parameters that are a and b of sigma = a + b |model|; empty where the
  /// number of `noise` holds. Data sets that name the same parameter share it.
  std::string sigma_a, sigma_b;

  [[nodiscard]] bool is_clipped_above(double reading) const;
  [[nodiscard]] bool is_clipped_below(double reading) const;
  /// The size of the noise is estimated along with the model's parameters.
  [[nodiscard]] bool estimates_sigma() const { return !sigma_a.empty() || !sigma_b.empty(); }
};

/// A model parameter that takes the value of an estimated one.
struct Target {
  std::size_t parameter = 0;      ///< place in Model::parameters()
  std::vector<std::size_t> data;  ///< places in FitConfig::data that it applies to; empty: all

  [[nodiscard]] bool applies_to(std::size_t choice) const;
};

/// Limits to which automatic bounds may be moved out, SI.
struct WidestBounds {
  double lower = 0.0, upper = 0.0;
};

/// Knowledge of a parameter from a measurement of its own: a normal distribution, SI.
struct Prior {
  double mean = 0.0;
  double sd = 1.0;        ///< > 0
  std::string from = {};  ///< what measured it, in words
  bool measured = true;   ///< else a limit of what is known, which remarks name
};

/// A change of the zero of a recording that is linear in time: slope (t - origin) is added to the
/// model's answer, the slope being the parameter, in the recording's own response per second.
struct DriftTerm {
  std::size_t choice = 0;  ///< place in FitConfig::data
  double origin_s = 0.0;
};

/// A rise of a recording's drive between two samples: the parameter is the delay of its centre
/// against that of the straight line between them, s (with_delays).
struct RiseTerm {
  std::size_t choice = 0;             ///< place in FitConfig::data
  double begin_s = 0.0, end_s = 0.0;  ///< the samples
};

/// An estimated parameter and the model parameters that take its value.
struct EstimatedParameter {
  FitParameter fit;
  std::vector<Target> sets;  ///< empty for a parameter of the noise, a drift and a rise
  /// A noise parameter whose start and bounds follow from the size of the data.
  bool from_data = false;
  /// Set of a material where nobody stated the bounds: run_fit widens them up to these while the
  /// best fit presses on them. Zero, contact and slack length have physical bounds, which stay.
  std::optional<WidestBounds> widest = std::nullopt;
  /// Adds the residual (value - mean) / sd. The prior is absolute: where the size of the noise is
  /// estimated, run_fit weighs it against the noise that it finds.
  std::optional<Prior> prior = std::nullopt;
  std::optional<DriftTerm> drift = std::nullopt;
  std::optional<RiseTerm> rise = std::nullopt;
  /// Effects that these data cannot separate from the parameter; it is then not called identified.
  std::optional<Remark> not_separable = std::nullopt;
};

/// A claim about parameters, tested by holding them: "eta1 = 5 Pa s".
struct Hypothesis {
  std::string name;
  std::vector<std::pair<std::string, double>> values;  ///< estimated parameter, SI value
};

/// Conditions under which a law was chosen among others, for the fits of its configuration.
struct LawChoice {
  std::string law;                               ///< that was chosen
  int samples = 0;                               ///< fitted
  std::vector<std::string> samples_sha256 = {};  ///< of the readings of each data set
  std::string better = {};                   ///< law that the data prefer decisively; empty: none
  double better_by = 0.0;                    ///< in BIC
  std::string not_described = {};            ///< what was said where it does not describe the data
  std::vector<std::string> conditions = {};  ///< sentences of the choice
};

/// Everything that decides the result of a fit (schemas/fit.schema.json).
struct FitConfig {
  std::string title;
  /// Formulation of the paper's element, or "organ"; not used with `law`.
  std::string model = "closed_form";
  std::string scene;                    ///< of the organ, as the configuration names it
  std::shared_ptr<const Tissue> organ;  ///< what the scene says
  TensionRule tension;
  std::optional<LawSpec> law;  ///< a law of the family instead of the paper's element
  std::vector<EstimatedParameter> parameters;
  std::vector<double> fixed;  ///< every model parameter, SI; what no estimated parameter sets
  std::vector<DataChoice> data;
  RobustLoss loss;
  /// Intervals count correlated neighbours of a recording as fewer readings.
  bool adjust_correlation = true;
  std::size_t starts = 50;
  /// Where the search begins, each in the order of `parameters`, if that was found from the data
  /// beforehand. Followed besides starts with solved linear parameters, instead of those anywhere.
  std::vector<std::vector<double>> given_starts;
  std::uint64_t seed = 0;
  double level = 0.95;
  bool profiles = true;
  std::optional<BootstrapOptions> bootstrap;
  std::vector<Hypothesis> hypotheses;
  std::optional<LawChoice> choice;  ///< decides nothing: the fit says it again (repeat_choice)
  std::filesystem::path folder;     ///< where relative paths of data sets are looked up
  /// Asked before each evaluation; true ends the fit with Interrupted. Not part of the result.
  std::function<bool()> interrupted;

  /// True if the size of the noise is known: of all data sets, or of none.
  [[nodiscard]] bool scale_known() const { return data.front().noise.scale_known; }
};

/// The model that the configuration names.
[[nodiscard]] std::unique_ptr<Model> make_model(const FitConfig& config);

/// Parameters that are estimated, without the model parameters that it sets.
[[nodiscard]] std::vector<FitParameter> searched_parameters(const FitConfig& config);

/// Number of estimated parameters that have a prior.
[[nodiscard]] int prior_count(const FitConfig& config);

/// All model parameters for a data set, given the estimated ones.
[[nodiscard]] std::vector<double> model_parameters(const FitConfig& config,
                                                   std::span<const double> natural,
                                                   std::size_t choice);

/// False for a law of the family and for an organ of a material of its own.
[[nodiscard]] bool has_element(const FitConfig& config);

/// The paper's element at estimated parameters, for the first data set. Throws Error(bad_input)
/// unless has_element().
[[nodiscard]] TpmVector fitted_element(const FitConfig& config, std::span<const double> natural);

/// Reads and checks a configuration. Throws Error(bad_input) with the file and the key.
/// @param folder that paths in the document are relative to
[[nodiscard]] FitConfig read_fit_config(const std::filesystem::path& path);
[[nodiscard]] FitConfig parse_fit_config(const Json& document, std::string_view where,
                                         const std::filesystem::path& folder = {});

}  // namespace tpm::fit
