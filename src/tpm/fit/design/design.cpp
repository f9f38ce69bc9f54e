#include "tpm/fit/design/design.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/distributions.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/design/design_words.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

using ExperimentKind = PlannedExperiment::Kind;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The readings of one recording, without values.
PointSet sampled(const PlannedExperiment& experiment) {
  PointSet points;
  const bool creep = experiment.kind == ExperimentKind::creep;
  points.observable = creep ? Observable::indentation_depth : Observable::contact_force;
  const auto n = static_cast<std::size_t>(experiment.samples());
  points.data.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    Datum& d = points.data[i];
    (creep ? d.load_N : d.depth_m) = creep ? experiment.load_N : experiment.depth_m;
    d.time_s = static_cast<double>(i) * experiment.interval_s - experiment.ramp_s();
    d.value = 0.0;
    d.sd = 1.0;
  }
  return points;
}

DataChoice choice_for(const DesignProblem& problem, const PlannedExperiment& experiment) {
  DataChoice choice;
  choice.dataset = "planned";
  choice.protocol.kind = experiment.kind == ExperimentKind::creep ? ProtocolChoice::Kind::creep
                                                                  : ProtocolChoice::Kind::ramp_hold;
  choice.protocol.rate_m_per_s = experiment.rate_m_per_s;
  choice.noise.kind = NoiseKind::per_row;
  choice.noise.scale_known = problem.scale_known;
  return choice;
}

/// One recording: the material first, then its nuisance parameters.
PlannedFit one_recording(const DesignProblem& problem, const PlannedExperiment& experiment) {
  PlannedFit fit{problem.config, {}};
  fit.config.data = {choice_for(problem, experiment)};
  for (const EstimatedParameter& p : problem.nuisance) fit.config.parameters.push_back(p);
  fit.data.emplace_back(sampled(experiment));
  return fit;
}

const PlannedNoise& noise_for(const DesignProblem& problem, const PlannedExperiment& experiment) {
  if (experiment.kind == ExperimentKind::ramp_hold) return problem.force_noise;
  if (problem.depth_noise) return *problem.depth_noise;
  throw bad_input(fmt::format("design '{}'", printable(problem.config.title)),
                  "creep without the noise of a depth", "it under /noise/depth");
}

Eigen::VectorXd sigmas(const PlannedNoise& noise, const Eigen::VectorXd& expected) {
  return (noise.absolute + noise.relative * expected.array().abs()).matrix();
}

/// The part of the columns that no combination of the nuisance columns imitates.
Eigen::MatrixXd without_nuisance(const Eigen::MatrixXd& jacobian, Eigen::Index material) {
  const Eigen::MatrixXd nuisance = jacobian.rightCols(jacobian.cols() - material);
  Eigen::MatrixXd columns = jacobian.leftCols(material);
  if (nuisance.cols() == 0) return columns;
  return columns - nuisance * shortest_least_squares(nuisance, columns);
}

/// d natural / d theta over |natural|: turns errors in theta into relative ones.
double relative_slope(const FitParameter& p) {
  return std::abs(p.natural_slope(p.theta(p.start)) / p.start);
}

/// Multiplier of the standard error.
double quantile(const DesignProblem& problem, double degrees) {
  const double p = 0.5 * (1.0 + problem.config.level);
  if (problem.scale_known) return normal_quantile(p);
  return student_quantile(p, std::max(degrees, 1.0));
}

/// Natural values of theta -+ reach; limits beyond the bounds are missing.
void set_interval(ExpectedParameter& expected, const FitParameter& p, double reach) {
  const double theta = p.theta(p.start);
  const auto limit = [&](double at) -> std::optional<double> {
    if (!(at >= p.theta_lower() && at <= p.theta_upper())) return std::nullopt;
    return p.natural(at);
  };
  expected.lower = limit(p.reversed() ? theta + reach : theta - reach);
  expected.upper = limit(p.reversed() ? theta - reach : theta + reach);
}

bool is_identified(const ExpectedParameter& p, double factor) {
  if (!p.lower || !p.upper) return false;
  const double a = *p.lower / p.value;
  const double b = *p.upper / p.value;
  return std::min(a, b) >= 1.0 / factor && std::max(a, b) <= factor;
}

void set_rival(ExpectedParameter& expected, const DesignProblem& problem,
               const Eigen::MatrixXd& correlation, Eigen::Index i) {
  for (Eigen::Index j = 0; j < correlation.cols(); ++j) {
    if (j == i || std::abs(correlation(i, j)) <= std::abs(expected.rival_correlation)) continue;
    expected.rival_correlation = correlation(i, j);
    expected.rival = problem.parameter(static_cast<std::size_t>(j)).name;
  }
}

double score_of(const DesignProblem& problem, const Expectation& expected, double log_determinant) {
  const auto k = static_cast<double>(problem.config.parameters.size());
  double largest = 0.0;
  double log_slopes = 0.0;
  for (std::size_t i = 0; i < expected.parameters.size(); ++i) {
    largest = std::max(largest, expected.parameters[i].relative_error);
    log_slopes += std::log(relative_slope(problem.parameter(i)));
  }
  switch (problem.criterion) {
    case Criterion::parameter:
      return expected.parameters[problem.criterion_parameter].relative_error;
    case Criterion::all:
      return std::exp((log_slopes - 0.5 * log_determinant) / k);
    case Criterion::worst:
      break;
  }
  return largest;
}

/// Knowledge before any candidate: previous experiments and known values.
Knowledge known_before(const DesignProblem& problem) {
  Knowledge before = nothing_known(problem);
  for (std::size_t i = 0; i < problem.known.size(); ++i) {
    const double theta_error = problem.known[i] / relative_slope(problem.parameter(i));
    before.fisher.diagonal()[static_cast<Eigen::Index>(i)] += 1.0 / (theta_error * theta_error);
  }
  for (const PlannedExperiment& e : problem.previous) {
    before.add(recording_information(problem, e), e.repeats);
  }
  return before;
}

/// The limit that the protocol itself breaks.
std::optional<Remark> broken_limit(const MachineLimits& limits, const PlannedExperiment& e) {
  const auto said = [](const char* code, const char* words, double limit, int digits = 4) {
    return Remark{code, fmt::format(fmt::runtime(words), significant(limit, digits))};
  };
  if (e.rate_m_per_s > limits.rate_m_per_s) {
    return said("rate", "rate above {} mm/s", limits.rate_m_per_s * 1e3);
  }
  if (e.depth_m > limits.depth_m) return said("depth", "depth above {} mm", limits.depth_m * 1e3);
  if (e.load_N > limits.load_N) return said("load", "load above {} N", limits.load_N);
  if (e.duration_s() > limits.duration_s) {
    return said("duration", "a recording longer than {} s", limits.duration_s);
  }
  if (e.total_s() > limits.total_s) {
    return said("total_time", "all repeats longer than {} s", limits.total_s);
  }
  if (e.samples() > limits.samples) {
    return said("samples", "more than {} samples", limits.samples, 6);
  }
  return std::nullopt;
}

bool same_recording(const PlannedExperiment& a, PlannedExperiment b) {
  b.repeats = a.repeats;
  return a == b;
}

void evaluate_candidates(DesignResult& result, const Knowledge& before) {
  const DesignProblem& problem = result.problem;
  std::map<std::string, std::pair<std::string, int>> broken;  // by text: code and candidates
  Progress progress("evaluating candidates", problem.candidates.size());
  for (const PlannedExperiment& e : problem.candidates) {
    progress.advance();
    std::optional<Remark> limit = broken_limit(problem.limits, e);
    if (!limit) {
      // Candidates that differ only in their repeats stand side by side.
      const bool again =
          !result.ranked.empty() && same_recording(result.ranked.back().experiment, e);
      DesignCandidate candidate{
          e, again ? result.ranked.back().one : recording_information(problem, e), {}};
      if (candidate.one.peak_depth_m <= problem.limits.depth_m) {
        Knowledge all = before;
        all.add(candidate.one, e.repeats);
        candidate.expected = expectation(problem, all);
        result.ranked.push_back(std::move(candidate));
        continue;
      }
      limit = Remark{"depth_under_load", fmt::format("the load presses deeper than {} mm",
                                                     significant(problem.limits.depth_m * 1e3, 4))};
    }
    auto& [code, count] = broken[limit->text];
    code = limit->code;
    ++count;
  }
  for (const auto& [text, found] : broken) {
    const auto& [code, count] = found;
    result.left_out.push_back(
        {code, fmt::format("{} of {}: {}", count, problem.candidates.size(), text)});
  }
  if (!result.ranked.empty()) return;
  throw bad_input(fmt::format("design '{}'", printable(problem.config.title)),
                  fmt::format("no candidate is within the limits ({})",
                              fmt::join(remark_texts(result.left_out), "; ")),
                  "at least one of /candidates within /limits");
}

void rank(DesignResult& result) {
  std::ranges::stable_sort(result.ranked, [](const DesignCandidate& a, const DesignCandidate& b) {
    if (a.expected.score != b.expected.score) {
      return a.expected.score < b.expected.score;
    }
    return a.experiment.total_s() < b.experiment.total_s();
  });
  for (std::size_t i = 0; i < result.ranked.size(); ++i) {
    if (!result.ranked[i].expected.all_identified()) continue;
    if (!result.cheapest || result.ranked[i].experiment.total_s() <
                                result.ranked[*result.cheapest].experiment.total_s()) {
      result.cheapest = i;
    }
  }
}

void find_pair(DesignResult& result, const Knowledge& before) {
  const DesignCandidate& best = result.ranked.front();
  Knowledge with_best = before;
  with_best.add(best.one, best.experiment.repeats);
  bool first = true;
  for (const DesignCandidate& candidate : result.ranked) {
    Knowledge all = with_best;
    all.add(candidate.one, candidate.experiment.repeats);
    Expectation expected = expectation(result.problem, all);
    if (!first && !(expected.score < result.pair.expected.score)) continue;
    first = false;
    result.pair = {best.experiment, candidate.experiment, std::move(expected)};
  }
}

}  // namespace

double PlannedExperiment::ramp_s() const {
  return kind == ExperimentKind::creep ? 0.0 : depth_m / rate_m_per_s;
}

double PlannedExperiment::duration_s() const {
  return ramp_s() + hold_s;
}

double PlannedExperiment::total_s() const {
  return repeats * duration_s();
}

double PlannedExperiment::samples() const {
  // A last sample that only rounding puts outside still counts.
  return std::floor(duration_s() / interval_s * (1.0 + 1e-12)) + 1.0;
}

bool Expectation::all_identified() const {
  return std::ranges::all_of(parameters, [](const ExpectedParameter& p) { return p.identified; });
}

double inflation(double interval_s, double correlation_time_s, double samples) {
  if (!(correlation_time_s > 0.0)) return 1.0;
  return std::min(1.0 / std::tanh(0.5 * interval_s / correlation_time_s), samples);
}

RecordingInformation recording_information(const DesignProblem& problem,
                                           const PlannedExperiment& experiment) {
  const PlannedFit fit = one_recording(problem, experiment);
  const ExperimentResiduals function(fit.config, fit.data);
  const std::vector<FitParameter> parameters = searched_parameters(fit.config);
  const std::vector<double> natural = start_values(parameters);
  RowMatrix sensitivity;
  const Eigen::VectorXd expected = function.predict(natural, &sensitivity);
  Eigen::MatrixXd jacobian =
      sigmas(noise_for(problem, experiment), expected).cwiseInverse().asDiagonal() * sensitivity;
  jacobian = jacobian * natural_slopes(parameters, theta_of(parameters, natural)).asDiagonal();
  const Eigen::MatrixXd seen =
      without_nuisance(jacobian, static_cast<Eigen::Index>(problem.config.parameters.size()));
  RecordingInformation information;
  information.samples = experiment.samples();
  const double per_sample =
      inflation(experiment.interval_s, problem.correlation_time_s, information.samples);
  information.fisher = seen.transpose() * seen / per_sample;
  information.effective_samples = information.samples / per_sample;
  information.peak_depth_m =
      experiment.kind == ExperimentKind::creep ? expected.maxCoeff() : experiment.depth_m;
  return information;
}

ThetaCovariance theta_covariance(const Eigen::MatrixXd& fisher) {
  const Eigen::Index k = fisher.rows();
  // Unit diagonal first, so that the rank does not depend on the parameters' units.
  const Eigen::VectorXd scale =
      fisher.diagonal().unaryExpr([](double d) { return d > 0.0 ? std::sqrt(d) : 1.0; });
  const Eigen::MatrixXd scaled =
      scale.cwiseInverse().asDiagonal() * fisher * scale.cwiseInverse().asDiagonal();
  const SymmetricModes modes = symmetric_modes(scaled);
  constexpr double kNothing = 1e-12;  // of the largest eigenvalue: below is rounding
  const double least = kNothing * std::max(modes.values[k - 1], 1e-300);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(k, k);
  Eigen::VectorXd unseen = Eigen::VectorXd::Zero(k);
  ThetaCovariance result;
  for (Eigen::Index i = 0; i < k; ++i) {
    const double value = modes.values[i];
    const Eigen::VectorXd direction = modes.vectors.col(i);
    if (value > least) {
      covariance += direction * direction.transpose() / value;
      result.log_determinant += std::log(value) + 2.0 * std::log(scale[i]);
    } else {
      unseen += direction.cwiseAbs2();
      result.log_determinant = -kInfinity;
    }
  }
  const Eigen::VectorXd sd = covariance.diagonal().cwiseMax(1e-300).cwiseSqrt();
  result.correlation = sd.cwiseInverse().asDiagonal() * covariance * sd.cwiseInverse().asDiagonal();
  result.standard_error = sd.cwiseQuotient(scale);
  constexpr double kTouches = 1e-8;  // squared component along a direction nobody sees
  for (Eigen::Index i = 0; i < k; ++i) {
    if (unseen[i] > kTouches) result.standard_error[i] = kInfinity;
  }
  return result;
}

Knowledge nothing_known(const DesignProblem& problem) {
  const auto k = static_cast<Eigen::Index>(problem.config.parameters.size());
  return {Eigen::MatrixXd::Zero(k, k)};
}

void Knowledge::add(const RecordingInformation& one, int repeats) {
  fisher += repeats * one.fisher;
  effective_samples += repeats * one.effective_samples;
  recordings += repeats;
}

Expectation expectation(const DesignProblem& problem, const Knowledge& knowledge) {
  const ThetaCovariance covariance = theta_covariance(knowledge.fisher);
  const double estimated = static_cast<double>(problem.config.parameters.size()) +
                           knowledge.recordings * static_cast<double>(problem.nuisance.size());
  const double multiplier = quantile(problem, knowledge.effective_samples - estimated);
  Expectation result;
  result.effective_samples = knowledge.effective_samples;
  for (Eigen::Index i = 0; i < covariance.standard_error.size(); ++i) {
    const FitParameter& p = problem.parameter(static_cast<std::size_t>(i));
    ExpectedParameter expected;
    expected.name = p.name;
    expected.value = p.start;
    expected.theta_standard_error = covariance.standard_error[i];
    expected.relative_error = expected.theta_standard_error * relative_slope(p);
    set_interval(expected, p, multiplier * expected.theta_standard_error);
    expected.identified = is_identified(expected, problem.factor);
    set_rival(expected, problem, covariance.correlation, i);
    result.parameters.push_back(std::move(expected));
  }
  result.score = score_of(problem, result, covariance.log_determinant);
  return result;
}

DesignResult plan(DesignProblem problem) {
  DesignResult result;
  result.problem = std::move(problem);
  const Knowledge before = known_before(result.problem);
  evaluate_candidates(result, before);
  rank(result);
  find_pair(result, before);
  result.summary = design_words(result);
  return result;
}

PlannedFit planned_fit(const DesignProblem& problem,
                       std::span<const PlannedExperiment> experiments) {
  PlannedFit fit{problem.config, {}};
  fit.config.data.clear();
  for (const PlannedExperiment& e : experiments) {
    const PlannedFit one = one_recording(problem, e);
    const ExperimentResiduals function(one.config, one.data);
    const Eigen::VectorXd expected =
        function.predict(start_values(searched_parameters(one.config)), nullptr);
    const Eigen::VectorXd sigma = sigmas(noise_for(problem, e), expected);
    PointSet points = std::get<PointSet>(one.data.front());
    for (std::size_t i = 0; i < points.data.size(); ++i) {
      points.data[i].value = expected[static_cast<Eigen::Index>(i)];
      points.data[i].sd = sigma[static_cast<Eigen::Index>(i)];
    }
    for (int repeat = 0; repeat < e.repeats; ++repeat) {
      const std::size_t place = fit.data.size();
      fit.config.data.push_back(one.config.data.front());
      fit.data.emplace_back(points);
      for (EstimatedParameter own : problem.nuisance) {
        own.fit.name += fmt::format(" {}", place + 1);
        for (Target& target : own.sets) target.data = {place};
        fit.config.parameters.push_back(std::move(own));
      }
    }
  }
  return fit;
}

}  // namespace tpm::fit
