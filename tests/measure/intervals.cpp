// measure_intervals STUDY SETS SEED: how many 95 % intervals of tpm fit hold the true value
// (reports/fits/report.md). Each set is a recording of 300 samples with a rest before contact,
// fitted from the true values; the interval holds a value if the deviance, minimised with the
// parameter fixed there, rises by no more than the interval allows. Studies:
//   white, phi0.5, phi0.9   six laws, white noise and autoregressions
//   rounded     a law with one branch, noise of 0.1 to 2 half steps of the readings
//   drift       a law with one branch and a drift of the zero, with rests before and after; where
//               they do not tell the drift the interval holds both answers, as that of tpm fit does
//   outliers    1 % of the readings 20 standard deviations off
//   profiles    of the first three the sets that are fitted as tpm fit does, from its own starts
//   and
//               with profiles walked to their limits: how many answers differ
#include <fmt/format.h>

#include <boost/math/distributions/beta.hpp>
#include <cmath>
#include <cstdlib>
#include <map>

#include "program.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/design/recovery.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/fitted_data.hpp"
#include "tpm/fit/outliers.hpp"
#include "tpm/fit/recording/placement.hpp"
#include "tpm/fit/select/placement_parameters.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpmkit/law_model.hpp"

namespace {

using namespace tpm;
using namespace tpm::fit;

constexpr const char* kLaws[] = {"linear-1", "linear-2",         "hertz-1",
                                 "power-1",  "linear-1-elastic", "linear-fspringpot"};
constexpr double kNoise = 0.01;  // of the peak

/// What is added to the clean readings.
struct Disturbance {
  double phi = 0.0;          ///< of neighbouring samples
  double rounding = 0.0;     ///< step of the readings over the standard deviation of the noise
  double drift_per_s = 0.0;  ///< over the peak
  double outlier_share = 0.0;
};

/// A ramp of 1 s after a rest, a hold of 20 s, 300 samples at equal distances; with `withdrawn` the
/// probe leaves at the end and rests again.
Recording clean_recording(const LawSpec& law, std::span<const double> values, bool withdrawn) {
  constexpr double kDepth_m = 5e-3, kRest_s = 4.0, kHold_s = 20.0, kRamp_s = 1.0;
  constexpr int kSamples = 300;
  const double after_s = withdrawn ? kRamp_s + kRest_s : 0.0;
  const double length_s = kRest_s + kRamp_s + kHold_s + after_s;
  Recording r;
  r.header.id = law_name(law);
  for (int i = 0; i < kSamples; ++i) {
    const double t = -kRest_s + length_s * i / (kSamples - 1.0);
    const double in = std::clamp(t / kRamp_s, -0.5, 1.0);
    const double out = std::clamp((t - kRamp_s - kHold_s) / kRamp_s, 0.0, 1.5);
    r.time_s.push_back(t);
    r.drive.push_back(kDepth_m * std::max(in - out, -0.5));
  }
  Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  history.set_equilibrium_at_start(true);
  const Response response = LawModel(law).respond(history, r.time_s, values, Want::values);
  r.response.assign(response.value.begin(), response.value.end());
  return r;
}

void disturb(Recording& r, double sigma, const Disturbance& d, base::Random& random) {
  const double peak = *std::ranges::max_element(r.response);
  double noise = random.normal();
  for (std::size_t i = 0; i < r.response.size(); ++i) {
    if (i > 0) noise = d.phi * noise + std::sqrt(1.0 - d.phi * d.phi) * random.normal();
    double& reading = r.response[i];
    reading += sigma * noise + d.drift_per_s * peak * r.time_s[i];
    if (d.outlier_share > 0.0 && random.uniform() < d.outlier_share) {
      reading += (random.uniform() < 0.5 ? -20.0 : 20.0) * sigma;
    }
    if (d.rounding > 0.0) reading = std::round(reading / (d.rounding * sigma)) * d.rounding * sigma;
  }
}

struct Count {
  int sets = 0, held = 0;

  /// Clopper and Pearson.
  [[nodiscard]] std::pair<double, double> interval() const {
    using boost::math::beta_distribution;
    const double low =
        held == 0 ? 0.0 : quantile(beta_distribution<>(held, sets - held + 1.0), 0.025);
    const double high =
        held == sets ? 1.0 : quantile(beta_distribution<>(held + 1.0, sets - held), 0.975);
    return {low, high};
  }
  [[nodiscard]] std::string text() const {
    const auto [low, high] = interval();
    return fmt::format("{:.1f} ({:.1f} to {:.1f})", 100.0 * held / std::max(sets, 1), 100.0 * low,
                       100.0 * high);
  }
};

struct Study {
  LawSpec law;
  std::vector<double> values;
  Recording clean;
  double sigma = 0.0;

  Study(const char* name, bool withdrawn)
      : law(parse_law_name(name, "measure_intervals")), values(visible_parameters(law)) {
    law.reference = 5e-3;
    clean = clean_recording(law, values, withdrawn);
    sigma = kNoise * *std::ranges::max_element(clean.response);
  }
};

/// The automatic configuration of a recording, beginning at the true values.
struct Problem {
  std::vector<PreparedRecording> one;
  FitConfig config;
  std::vector<double> truth;
};

void set_truth(Problem& p, const Study& study, const Disturbance& d) {
  const LawModel model(study.law);
  const double peak = *std::ranges::max_element(study.clean.response);
  p.truth.clear();
  for (const EstimatedParameter& e : p.config.parameters) {
    double value = e.drift ? d.drift_per_s * peak : 0.0;
    if (!e.drift) value = study.values[model.index(e.fit.name)];
    // The zero is that at the middle of the rests.
    if (e.fit.name == "offset" && d.drift_per_s != 0.0) {
      for (const EstimatedParameter& other : p.config.parameters) {
        if (other.drift) value += d.drift_per_s * peak * other.drift->origin_s;
      }
    }
    p.truth.push_back(value);
  }
}

/// Contact is held, but for a drift: the onset has its own study (measure_placement).
Problem problem_of(const Study& study, Recording recording, const Disturbance& d) {
  Problem p{{prepare_recording("made", std::move(recording))}, {}, {}};
  SetupOptions setup;
  setup.reference = study.law.reference;
  if (d.drift_per_s == 0.0) setup.contact = 0.0;
  p.config = recording_config(study.law, p.one, setup);
  set_truth(p, study, d);
  return p;
}

bool has_drift(const Problem& p) {
  return std::ranges::any_of(p.config.parameters,
                             [](const EstimatedParameter& e) { return e.drift.has_value(); });
}

/// Whether the interval of each parameter holds the true value.
struct Answer {
  std::vector<bool> held;
  std::vector<double> estimate;
  bool limited = false;
  bool outliers = false;
};

/// Gauss-Newton steps from a point near the minimum, which is all that a simulated set needs: the
/// search of tpm fit from many starts would take most of the time. `profiles` compares the two.
class NearMinimum {
 public:
  NearMinimum(const ExperimentResiduals& function, std::span<const FitParameter> parameters)
      : function_(function), parameters_(parameters) {}

  /// @param fixed parameter that stays, or -1
  /// @return the deviance; infinite where the steps leave the bounds or do not settle
  double run(std::vector<double>& x, Eigen::Index fixed) const {
    constexpr int kMostSteps = 40;
    constexpr double kSettled = 1e-7;  // of the deviance per residual
    constexpr double kNowhere = std::numeric_limits<double>::infinity();
    Eigen::VectorXd r, r_next;
    RowMatrix j;
    for (int step = 0; step < kMostSteps; ++step) {
      if (!function_.evaluate(x, r, &j)) return kNowhere;
      if (fixed >= 0) j.col(fixed).setZero();
      Eigen::VectorXd length = j.colwise().norm();
      for (double& l : length) l = l > 0.0 ? l : 1.0;
      Eigen::MatrixXd scaled = j * length.cwiseInverse().asDiagonal();
      Eigen::MatrixXd gram = scaled.transpose() * scaled;
      if (fixed >= 0) gram(fixed, fixed) = 1.0;
      const Eigen::VectorXd gradient = scaled.transpose() * r;
      const Eigen::VectorXd move = -gram.ldlt().solve(gradient);
      const double least = r.squaredNorm();
      const double expected = -gradient.dot(move);
      if (!std::isfinite(expected)) return kNowhere;
      if (expected <= kSettled * least / static_cast<double>(r.size())) return least;
      double share = 1.0;
      std::vector<double> next = x;
      for (;; share *= 0.5) {
        if (share < 1e-3) return kNowhere;
        for (std::size_t i = 0; i < x.size(); ++i) {
          const auto k = static_cast<Eigen::Index>(i);
          next[i] = k == fixed ? x[i] : x[i] + share * move[k] / length[k];
        }
        if (is_inside(next) && function_.evaluate(next, r_next, nullptr) &&
            r_next.squaredNorm() < least) {
          break;
        }
      }
      x = std::move(next);
    }
    return kNowhere;
  }

 private:
  [[nodiscard]] bool is_inside(const std::vector<double>& x) const {
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (!(x[i] >= parameters_[i].lower && x[i] <= parameters_[i].upper)) return false;
    }
    return true;
  }

  const ExperimentResiduals& function_;
  std::span<const FitParameter> parameters_;
};

/// As quick_answer, by the same steps as fit_experiments: priors weighted by the size of the noise,
/// outliers left out until they stay the same. Nothing where a step did not settle.
std::optional<Answer> quickest_answer(const Problem& p) {
  constexpr int kMostRounds = 40, kMostOutlierRounds = 5;
  constexpr double kLeast = 1e-12, kSettled = 1e-3;
  FitConfig config = p.config;
  const ExperimentResiduals all(config, data_sets(p.one));
  const std::vector<FitParameter> parameters = searched_parameters(all.config());
  std::vector<double> x = p.truth;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!(x[i] >= parameters[i].lower && x[i] <= parameters[i].upper)) return std::nullopt;
  }
  std::unique_ptr<ExperimentResiduals> function = all.copy();
  std::vector<std::size_t> left_out;
  Threshold threshold;
  double deviance = 0.0;
  for (int outer = 0;; ++outer) {
    if (outer > kMostOutlierRounds) return std::nullopt;
    threshold = Threshold{config.level, all.config().scale_known(),
                          function->value_count() + prior_count(all.config()),
                          static_cast<int>(parameters.size())};
    const NearMinimum search(*function, parameters);
    function->set_prior_weight(1.0);
    double weight = 1.0;
    for (int round = 0;; ++round) {
      deviance = search.run(x, -1);
      if (!std::isfinite(deviance)) return std::nullopt;
      threshold.noise = noise_of_estimates(*function, parameters, x);
      threshold.inflation =
          threshold.noise ? threshold.noise->inflation : inflation_at(*function, x);
      const double next =
          std::max(std::sqrt(threshold.inflation * threshold.variance_factor(deviance)), kLeast);
      if (round == kMostRounds || std::abs(next - weight) <= kSettled * weight) break;
      weight = next;
      function->set_prior_weight(weight);
    }
    std::vector<std::size_t> found = isolated_outliers(all, x);
    if (found == left_out) break;
    left_out = std::move(found);
    function = all.copy();
    function->leave_out(left_out);
  }
  Answer answer;
  answer.outliers = !left_out.empty();
  answer.limited = threshold.noise &&
                   threshold.noise->summary.find("limited by resolution") != std::string::npos;
  answer.estimate = x;
  const NearMinimum search(*function, parameters);
  for (std::size_t i = 0; i < x.size(); ++i) {
    std::vector<double> y = x;
    y[i] = p.truth[i];
    const double there = search.run(y, static_cast<Eigen::Index>(i));
    if (!std::isfinite(there)) return std::nullopt;
    answer.held.push_back(there - deviance <= threshold.rise_of(i, deviance));
  }
  return answer;
}

/// With the search of tpm fit from the true values.
Answer searched_answer(const Problem& p) {
  FitConfig config = p.config;
  config.profiles = false;
  config.starts = 1;
  config.given_starts = {p.truth};
  const ExperimentResiduals function(config, data_sets(p.one));
  const FitResult fit = fit_experiments(function);
  const std::vector<FitParameter> parameters = searched_parameters(fit.config);
  const std::unique_ptr<ExperimentResiduals> same = function.copy();
  std::vector<std::size_t> left_out;
  const std::vector<bool>& outlier = fit.recordings.at(0).outlier;
  for (const Experiment& e : function.experiments()) {
    for (std::size_t k = 0; k < e.data.size(); ++k) {
      if (k < outlier.size() && outlier[k]) left_out.push_back(e.data[k]);
    }
  }
  if (!left_out.empty()) same->leave_out(left_out);
  same->set_prior_weight(std::max(std::sqrt(fit.inflation * fit.variance_factor), 1e-12));
  const std::vector<std::vector<double>> starts{fit.best.natural, p.truth};
  std::vector<double> deviance;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    deviance.push_back(profile_deviance(*same, parameters, starts, i, p.truth[i]));
  }
  const Minimum again = minimise_near(*same, parameters, fit.best.natural);
  const double least =
      std::min({fit.best.deviance, again.deviance, *std::ranges::min_element(deviance)});
  const Threshold threshold = threshold_of(fit);
  Answer answer;
  answer.estimate = fit.best.natural;
  answer.outliers = !left_out.empty();
  answer.limited =
      fit.noise && fit.noise->summary.find("limited by resolution") != std::string::npos;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    answer.held.push_back(deviance[i] - least <= threshold.rise_of(i, least));
  }
  return answer;
}

Answer quick_answer(const Problem& p) {
  const std::optional<Answer> quickest = quickest_answer(p);
  return quickest ? *quickest : searched_answer(p);
}

Answer full_answer(const Problem& p) {
  const FitResult fit = run_fit(p.config, data_sets(p.one));
  Answer answer;
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    const ParameterResult& r = fit.parameters[i];
    answer.held.push_back((!r.lower || *r.lower <= p.truth[i]) &&
                          (!r.upper || p.truth[i] <= *r.upper));
  }
  return answer;
}

/// Where the rests do not tell the drift, tpm fit gives intervals of the material that hold both
/// answers, with a drift and without (give_both_drift_answers), k_inf is not identified, and there
/// is no zero that could be right: `offset` and `k_inf` are not asked.
/// @param names of the parameters that are
Answer drift_answer(Problem p, const Study& study, const Disturbance& d,
                    std::vector<std::string>& names) {
  Answer without = quick_answer(p);
  names.clear();
  for (const EstimatedParameter& e : p.config.parameters) names.push_back(e.fit.name);
  if (has_drift(p)) return without;
  const std::vector<double> truth = p.truth;
  add_possible_drift(p.config, p.one.front(), 0);
  if (!has_drift(p)) return without;
  set_truth(p, study, d);
  const Answer with = quick_answer(p);
  Answer both;
  std::vector<std::string> asked;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == "offset" || names[i] == "k_inf") continue;
    const bool between = (without.estimate[i] - truth[i]) * (with.estimate[i] - truth[i]) < 0.0;
    const bool material = names[i] != "contact";
    asked.push_back(names[i]);
    both.held.push_back(without.held[i] || (material && (with.held[i] || between)));
  }
  names = asked;
  return both;
}

void cover(const std::string& what, const Study& study, const Disturbance& d, int sets,
           std::uint64_t seed) {
  base::Random random(seed);
  std::map<std::string, Count> counts;
  std::vector<std::string> order;
  int limited = 0, outliers = 0, told = 0, failed = 0;
  for (int set = 0; set < sets; ++set) {
    Recording recording = study.clean;
    disturb(recording, study.sigma, d, random);
    try {
      const Problem p = problem_of(study, std::move(recording), d);
      std::vector<std::string> names;
      for (const EstimatedParameter& e : p.config.parameters) names.push_back(e.fit.name);
      const bool drifts = d.drift_per_s != 0.0;
      told += has_drift(p);
      const Answer answer = drifts ? drift_answer(p, study, d, names) : quick_answer(p);
      limited += answer.limited;
      outliers += answer.outliers;
      for (std::size_t i = 0; i < answer.held.size(); ++i) {
        if (names[i] == "contact" && !drifts) continue;
        if (!counts.contains(names[i])) order.push_back(names[i]);
        ++counts[names[i]].sets;
        counts[names[i]].held += answer.held[i];
      }
    } catch (const Error&) {
      ++failed;
    }
  }
  Count all;
  std::string text;
  double least = 1.0, most = 0.0;
  for (const std::string& name : order) {
    const Count& c = counts[name];
    all.sets += c.sets;
    all.held += c.held;
    least = std::min(least, static_cast<double>(c.held) / c.sets);
    most = std::max(most, static_cast<double>(c.held) / c.sets);
    text += fmt::format("{}{} {}", text.empty() ? "" : "; ", name, c.text());
  }
  fmt::print("| {} | {} | {} | {:.1f} | {:.1f} to {:.1f} | {} | {} | {} | {} | {} |\n", what,
             law_name(study.law), sets, 100.0 * all.held / std::max(all.sets, 1), 100.0 * least,
             100.0 * most, limited, outliers, told, failed, text);
  std::fflush(stdout);
}

void compare_with_profiles(const Study& study, double phi, int sets, std::uint64_t seed) {
  base::Random random(seed);
  int same = 0, intervals = 0;
  for (int set = 0; set < sets; ++set) {
    Recording recording = study.clean;
    disturb(recording, study.sigma, {.phi = phi}, random);
    const Problem p = problem_of(study, std::move(recording), {.phi = phi});
    const Answer quick = quick_answer(p), full = full_answer(p);
    for (std::size_t i = 0; i < quick.held.size(); ++i) {
      ++intervals;
      same += quick.held[i] == full.held[i];
    }
  }
  fmt::print("| {} | {} | {} of {} answers are the same\n", phi, law_name(study.law), same,
             intervals);
  std::fflush(stdout);
}

std::optional<double> phi_of(const std::string& study) {
  if (study == "white") return 0.0;
  if (study == "phi0.5") return 0.5;
  return study == "phi0.9" ? std::optional(0.9) : std::nullopt;
}

void run(const std::string& study, int sets, std::uint64_t seed) {
  fmt::print(
      "| noise | law | sets | all, % | least and most, % | limited | outliers | drift told | "
      "failed "
      "| each, % (exact 95 % interval) |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  if (const std::optional<double> asked = phi_of(study)) {
    for (const char* law : kLaws) {
      cover(fmt::format("phi {}", *asked), Study(law, false), {.phi = *asked}, sets, seed);
    }
  } else if (study == "rounded") {
    const Study one("linear-1", false);
    for (const double half_steps : {0.1, 0.25, 0.5, 0.8, 1.0, 1.5, 2.0}) {
      cover(fmt::format("{} half steps", half_steps), one, {.rounding = 2.0 / half_steps}, sets,
            seed);
    }
  } else if (study == "drift") {
    for (const double phi : {0.0, 0.5, 0.9}) {
      for (const char* law : {"linear-1", "hertz-1"}) {
        cover(fmt::format("drift, phi {}", phi), Study(law, true),
              {.phi = phi, .drift_per_s = 0.001}, sets, seed);
      }
    }
  } else if (study == "outliers") {
    for (const char* law : kLaws) {
      cover("1 % of 20 sigma", Study(law, false), {.outlier_share = 0.01}, sets, seed);
    }
  } else if (study == "profiles") {
    for (const double phi : {0.0, 0.9}) {
      for (const char* law : kLaws) compare_with_profiles(Study(law, false), phi, sets, seed);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(
      argc, argv, 3, 3,
      "measure_intervals white|phi0.5|phi0.9|rounded|drift|outliers|profiles SETS SEED",
      [](const std::vector<std::string>& words) {
        run(words[0], std::atoi(words[1].c_str()), std::strtoull(words[2].c_str(), nullptr, 10));
      });
}
