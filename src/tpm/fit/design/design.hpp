#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpm/fit/likelihood/config.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpm/show/short_answer.hpp"

namespace tpm::fit {

/// An experiment that could be done: one protocol, sampled evenly from its first moment on, on
/// `repeats` fresh sites.
struct PlannedExperiment {
  enum class Kind {
    ramp_hold,  ///< to `depth_m` at `rate_m_per_s`, then held for `hold_s`
    creep,      ///< `load_N` applied instantaneously, held for `hold_s`
  };
  Kind kind = Kind::ramp_hold;
  double depth_m = 0.0;       ///< ramp_hold, > 0
  double rate_m_per_s = 0.0;  ///< ramp_hold, > 0
  double load_N = 0.0;        ///< creep, > 0
  double hold_s = 0.0;        ///< >= 0; creep > 0
  double interval_s = 0.0;    ///< between samples, > 0
  int repeats = 1;            ///< recordings, >= 1

  [[nodiscard]] double ramp_s() const;      ///< 0 for creep
  [[nodiscard]] double duration_s() const;  ///< of one recording
  [[nodiscard]] double total_s() const;     ///< of all repeats
  /// Samples of one recording; huge counts are still exact (a double).
  [[nodiscard]] double samples() const;

  bool operator==(const PlannedExperiment&) const = default;
};

/// "8 mm at 10 mm/s, held 100 s, every 0.1 s, 3 times"
[[nodiscard]] std::string experiment_words(const PlannedExperiment& experiment);

/// Limits of the machine and the tissue. Candidates beyond are left out and counted.
struct MachineLimits {
  double rate_m_per_s = std::numeric_limits<double>::infinity();
  double depth_m = 12e-3;  ///< damage of liver in the paper; holds for creep, too
  double load_N = std::numeric_limits<double>::infinity();
  double duration_s = std::numeric_limits<double>::infinity();  ///< of one recording
  double total_s = std::numeric_limits<double>::infinity();     ///< of all repeats
  double samples = 20000;                                       ///< of one recording
};

/// Scatter of a reading, sigma = absolute + relative |expected reading|.
struct PlannedNoise {
  double absolute = 0.0;  ///< N for a force, m for a depth; > 0
  double relative = 0.0;  ///< >= 0
};

/// Score by which the best design is chosen. Smaller scores are better.
enum class Criterion {
  parameter,  ///< relative standard error of one parameter
  all,        ///< D-optimal: geometric mean of the axes of the confidence ellipsoid, relative
  worst,      ///< largest relative standard error
};

/// Everything that decides a design (schemas/design.schema.json).
struct DesignProblem {
  FitConfig config;  ///< model, material parameters (start: the value taken as true), fixed values
  std::vector<EstimatedParameter> nuisance;  ///< each recording has its own
  std::vector<double> known;  ///< relative standard error known beforehand, parallel to
                              ///< config.parameters; infinite if nothing is known
  PlannedNoise force_noise;
  std::optional<PlannedNoise> depth_noise;  ///< needed for creep
  bool scale_known = true;                  ///< false: sigma is right up to one factor
  double correlation_time_s = 0.0;          ///< of the noise, see inflation()
  MachineLimits limits;
  std::vector<PlannedExperiment> candidates;
  std::vector<PlannedExperiment> previous;  ///< already done: their information is added
  Criterion criterion = Criterion::worst;
  std::size_t criterion_parameter = 0;  ///< place in config.parameters
  double factor = 2.0;  ///< identified: the interval is within value / factor, value factor

  [[nodiscard]] const FitParameter& parameter(std::size_t i) const {
    return config.parameters.at(i).fit;
  }
};

/// Keys of a design file.
[[nodiscard]] const FileKind& design_kind();

/// Reads and checks a design file. Throws Error(bad_input) with the file and the key.
[[nodiscard]] DesignProblem read_design(const std::filesystem::path& path);
[[nodiscard]] DesignProblem parse_design(const Json& document, std::string_view where);

/// Samples per independent sample of noise with correlation exp(-t / correlation_time):
/// coth(interval / (2 correlation_time)), at most `samples`; 1 without correlation.
[[nodiscard]] double inflation(double interval_s, double correlation_time_s, double samples);

/// Information of one recording about the material, its own nuisance parameters projected out.
struct RecordingInformation {
  Eigen::MatrixXd fisher;          ///< in theta of the material parameters, k x k
  double samples = 0.0;            ///< > 0
  double effective_samples = 0.0;  ///< samples / inflation
  double peak_depth_m = 0.0;       ///< imposed, or reached under the load
};

/// Exact sensitivities of the model, divided by sigma.
/// Throws Error(bad_input), Error(numerical) as Model::respond.
[[nodiscard]] RecordingInformation recording_information(const DesignProblem& problem,
                                                         const PlannedExperiment& experiment);

/// Information adds up over recordings.
struct Knowledge {
  Eigen::MatrixXd fisher;  ///< in theta of the material parameters
  double effective_samples = 0.0;
  double recordings = 0.0;

  void add(const RecordingInformation& one, int repeats);
};
[[nodiscard]] Knowledge nothing_known(const DesignProblem& problem);

/// Standard errors from information; infinite where there is none.
struct ThetaCovariance {
  Eigen::VectorXd standard_error;
  Eigen::MatrixXd correlation;   ///< of the informed directions
  double log_determinant = 0.0;  ///< of the information; -infinity if singular
};
[[nodiscard]] ThetaCovariance theta_covariance(const Eigen::MatrixXd& fisher);

/// Expected estimate of one parameter from an experiment. SI.
struct ExpectedParameter {
  std::string name;
  double value = 0.0;
  double theta_standard_error = 0.0;   ///< infinite if nothing would be known
  double relative_error = 0.0;         ///< standard error / |value|; may be infinite
  std::optional<double> lower, upper;  ///< interval; a missing limit lies beyond the bounds
  bool identified = false;
  std::string rival;               ///< the parameter it trades off with most
  double rival_correlation = 0.0;  ///< -1 .. 1
};

/// Expected estimates from a set of experiments.
struct Expectation {
  std::vector<ExpectedParameter> parameters;
  double score = 0.0;              ///< of the criterion; infinite if something needed stays unknown
  double effective_samples = 0.0;  ///< all recordings and previous ones
  [[nodiscard]] bool all_identified() const;
};

[[nodiscard]] Expectation expectation(const DesignProblem& problem, const Knowledge& knowledge);

/// A candidate with what it would tell (together with what is known already).
struct DesignCandidate {
  PlannedExperiment experiment;
  RecordingInformation one;  ///< of one recording
  Expectation expected;
};

/// Two experiments together.
struct DesignPair {
  PlannedExperiment first, second;
  Expectation expected;
};

struct DesignResult {
  DesignProblem problem;
  std::vector<DesignCandidate> ranked;  ///< best first; equal scores: the shorter first
  std::vector<Remark> left_out;         ///< "12 of 96: rate above 20 mm/s"
  std::optional<std::size_t> cheapest;  ///< place in ranked: the least total time that identifies
                                        ///< every parameter
  DesignPair pair;                      ///< the best, and the best beside it
  std::vector<std::string> summary;     ///< for each parameter, and what limits it
};

/// Evaluates all candidates. Throws Error(bad_input) if the limits leave none.
[[nodiscard]] DesignResult plan(DesignProblem problem);

/// The configuration that fits such experiments, and data in memory: each reading is the model's
/// answer, with its standard deviation.
struct PlannedFit {
  FitConfig config;
  std::vector<DataSet> data;
};
[[nodiscard]] PlannedFit planned_fit(const DesignProblem& problem,
                                     std::span<const PlannedExperiment> experiments);

/// Spread of simulated estimates of one parameter against its prediction, in theta.
struct CheckedParameter {
  std::string name;
  double predicted = 0.0;    ///< standard error; may be infinite
  double observed = 0.0;     ///< standard deviation of the estimates
  double ratio = 0.0;        ///< observed / predicted; 0 if that is infinite
  double ratio_error = 0.0;  ///< sampling error of the ratio, ratio / sqrt(2 (sets - 1))
  double bias = 0.0;         ///< mean error in predicted standard errors
  double bias_error = 0.0;   ///< its sampling error
  int covered = 0;           ///< estimates whose expected interval contains the true value
  bool agrees = true;        ///< ratio within 3 sampling errors of 1, and bias of 0
};

/// A design tried on simulated data.
struct DesignCheck {
  std::uint64_t seed = 0;
  int sets = 0;      ///< fitted
  int failed = 0;    ///< not fitted: in no spread
  int at_bound = 0;  ///< a parameter ended on its bound
  std::vector<CheckedParameter> parameters;
  std::vector<Remark> remarks;
};

/// Simulates the experiment (and the previous ones) `sets` (>= 10) times, correlated as declared,
/// fits each from the true values and compares the spread of the estimates with the prediction,
/// which here leaves out what is known beforehand. Deterministic in the seed. Throws
/// Error(bad_input) for too few sets, Error(numerical) if fewer than half can be fitted.
[[nodiscard]] DesignCheck check_design(const DesignProblem& problem,
                                       const PlannedExperiment& experiment, int sets,
                                       std::uint64_t seed);

/// @param check null if the design was not tried
/// @param top how many candidates are listed
[[nodiscard]] Json to_json(const DesignResult& result, const DesignCheck* check, std::size_t top);
[[nodiscard]] std::string to_terminal_text(const DesignResult& result, const DesignCheck* check,
                                           std::size_t top);
/// The best candidates, what each parameter would be known to, and the test on simulated data.
[[nodiscard]] ShortAnswer short_answer(const DesignResult& result, const DesignCheck* check,
                                       std::size_t top);

}  // namespace tpm::fit
