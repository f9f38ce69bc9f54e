#include "tpm/fit/online/sequential_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/distributions.hpp"
#include "tpm/fit/likelihood/starts.hpp"
#include "tpm/fit/online/whitened_prefix.hpp"
#include "tpm/fit/predict/contact_profile.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();
constexpr std::size_t kFirstPass = 12;
constexpr std::size_t kKeptStarts = 4;
constexpr double kFirstNoise = 1e-2;  // of the peak, until it is known

double half_width(double degrees, double level) {
  return quick_student_quantile(0.5 + 0.5 * level, degrees);
}

}  // namespace

/// The law linearised about one point, and what the samples have said there so far.
struct SequentialFit::Linearisation {
  explicit Linearisation(LawAtParameters at) : law(std::move(at)) {}
  Linearisation(const Linearisation&) = delete;  // the history refers to the law beside it
  Linearisation& operator=(const Linearisation&) = delete;

  LawAtParameters law;
  std::optional<ContactHistory> history;
  std::vector<FitParameter> parameters;
  std::vector<std::size_t> place;
  std::vector<bool> nuisance;
  Eigen::Index contact = -1;       ///< place of the contact point in `parameters`, if estimated
  std::vector<Eigen::Index> free;  ///< parameters off their bounds
  std::vector<double> natural;     ///< of the point
  std::vector<double> values;      ///< of the whole law there
  double from_s = 0.0;             ///< first sample that counts
  AutoregressiveNoise noise{0.0, 1.0};
  std::optional<AutoregressionEstimate> correlation;
  std::size_t samples_then = 0;  ///< when `correlation` was found
  IntervalFactors wider;         ///< by the profile along the contact point, at the point

  /// Where the linear model has its least squares as seen from the point, when the point was the
  /// minimum; of `free`. 0 unless the deviance has a corner there: contact passes a sample.
  Eigen::VectorXd away_then;

  // Of the whitened rows: residual = reading less answer, by theta.
  Eigen::MatrixXd gram;
  Eigen::VectorXd right;
  double squares = 0.0, log_determinant = 0.0;
  std::size_t samples = 0;
  double last_time_s = 0.0, last_drive = 0.0, last_residual = 0.0;
  Eigen::VectorXd last_slopes;

  void start(double time_s, double drive, double peak_depth) {
    history.emplace(law, peak_depth, Want::values_and_sensitivity);
    history->rest_at_drive(drive);
    const auto n = std::ssize(parameters);
    gram = Eigen::MatrixXd::Zero(n, n);
    right = Eigen::VectorXd::Zero(n);
    last_time_s = time_s;
    last_drive = drive;
  }

  void take(double time_s, double drive, double response) {
    if (time_s > last_time_s) {
      history->move_drive(last_drive, drive, time_s - last_time_s, time_s);
    }
    const double dt = time_s - last_time_s;
    last_time_s = time_s;
    last_drive = drive;
    if (time_s < from_s) return;
    const Slopes by_law = history->force_slopes();
    Eigen::VectorXd slopes(std::ssize(parameters));
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const FitParameter& p = parameters[i];
      slopes[static_cast<Eigen::Index>(i)] =
          by_law[static_cast<Eigen::Index>(place[i])] * p.natural_slope(p.theta(natural[i]));
    }
    const double residual = response - history->force();
    Eigen::VectorXd row = slopes;
    double e = residual;
    if (samples > 0 && noise.phi() > 0.0) {
      const double rho = noise.correlation(dt);
      const double scale = 1.0 / std::sqrt((1.0 - rho) * (1.0 + rho));
      row = scale * (slopes - rho * last_slopes);
      e = scale * (residual - rho * last_residual);
      log_determinant += std::log1p(-rho * rho);
    }
    gram.selfadjointView<Eigen::Lower>().rankUpdate(row);
    right += e * row;
    squares += e * e;
    last_slopes = slopes;
    last_residual = residual;
    ++samples;
  }

  /// A parameter of which nothing is known yet.
  [[nodiscard]] SequentialParameter undetermined(std::size_t i) const {
    SequentialParameter s;
    s.parameter = parameters[i];
    s.place = place[i];
    s.nuisance = nuisance[i];
    s.estimate = natural[i];
    s.standard_error = kUnknown;
    s.lower = s.parameter.lower;
    s.upper = s.parameter.upper;
    return s;
  }

  [[nodiscard]] Eigen::MatrixXd free_gram() const {
    const Eigen::MatrixXd full = gram.selfadjointView<Eigen::Lower>();
    return full(free, free);
  }

  /// Call when all samples have been taken that the point is the minimum of.
  void keep_as_minimum() {
    samples_then = samples;
    away_then = Eigen::VectorXd::Zero(std::ssize(free));
    const Eigen::MatrixXd gram_now = free_gram();
    if (free.empty() || !tells_apart(gram_now)) return;
    away_then = gram_now.llt().solve(right(free));
  }

  /// Call after keep_as_minimum().
  void profile(const WhitenedPrefix& function, double level) {
    const auto count = std::ssize(parameters);
    wider = {Eigen::VectorXd::Ones(count), Eigen::VectorXd::Ones(count)};
    const auto found = std::find(free.begin(), free.end(), contact);
    if (found == free.end() || !correlation || !tells_apart(free_gram())) return;
    const auto n = static_cast<Eigen::Index>(samples);
    std::vector<double> quantiles;
    for (Eigen::Index k = 0; k < std::ssize(free); ++k) {
      quantiles.push_back(
          half_width(satterthwaite_degrees(*correlation, k, n, std::ssize(free)), level));
    }
    wider = profile_contact(function, {.parameters = parameters,
                                       .natural = natural,
                                       .free = free,
                                       .contact = *found,
                                       .quantiles = quantiles,
                                       .residual_count = n});
  }
};

double SequentialParameter::relative_half_width() const {
  if (at_bound || !std::isfinite(standard_error) || !(estimate != 0.0)) return kUnknown;
  return 0.5 * std::abs(upper - lower) / std::abs(estimate);
}

double SequentialEstimate::widest_relative_half_width() const {
  if (!identified) return kUnknown;
  double widest = 0.0;
  for (const SequentialParameter& p : parameters) {
    if (!p.nuisance) widest = std::max(widest, p.relative_half_width());
  }
  return widest;
}

SequentialFit::SequentialFit(const LawSpec& law, Quantity drive, Quantity response,
                             SequentialSettings settings)
    : spec_(law), settings_(settings), next_pass_(kFirstPass), next_search_(kFirstPass) {
  spec_.drive = drive;
  spec_.response = response;
  spec_.reference = settings.reference;
  const bool ting = spec_.kernel == Kernel::hertz && spec_.branches > 0;
  if (spec_.fractional != Fractional::none || ting || spec_.form == BranchForm::series) {
    throw bad_input(fmt::format("law {}", law_name(spec_)), "cannot be fitted sample by sample",
                    "branches in parallel on a linear or power kernel, or an elastic law");
  }
  recording_.drive_quantity = drive;
  recording_.response_quantity = response;
}

SequentialFit::~SequentialFit() = default;
SequentialFit::SequentialFit(SequentialFit&&) noexcept = default;
SequentialFit& SequentialFit::operator=(SequentialFit&&) noexcept = default;

std::optional<SequentialFit::Prefix> SequentialFit::prefix() const {
  SetupOptions setup;
  setup.reference = settings_.reference;
  setup.profiles = false;
  setup.measured = false;  // sample by sample: the rest is among the samples
  try {
    PreparedRecording prepared = prepare_recording("what was recorded so far", recording_);
    keep_baseline(prepared);
    // Where contact seems to be depends on the noise. To fix it there would take an estimate for
    // known, with intervals of the stiffnesses that are too narrow.
    if (spec_.drive != Quantity::strain && !prepared.phases.preloaded) {
      setup.nuisance = Nuisance::offset_and_contact;
    }
    FitConfig config = recording_config(spec_, std::span(&prepared, 1), setup);
    return Prefix{std::move(prepared), std::move(config)};
  } catch (const Error& error) {  // no ramp yet
    if (error.code() != ExitCode::bad_input) throw;
  }
  return std::nullopt;
}

void SequentialFit::add(double time_s, double drive, double response) {
  recording_.time_s.push_back(time_s);
  recording_.drive.push_back(drive);
  recording_.response.push_back(response);
  if (here_) here_->take(time_s, drive, response);
  const std::size_t n = recording_.time_s.size();
  if (here_) describe();
  bool due = n >= next_pass_;
  if (estimate_ && here_ && !due) {
    for (std::size_t i = 0; i < estimate_->parameters.size(); ++i) {
      const SequentialParameter& p = estimate_->parameters[i];
      if (p.at_bound || !std::isfinite(p.standard_error)) continue;
      const double by = p.parameter.theta(p.estimate) - p.parameter.theta(here_->natural[i]);
      due = due || std::abs(by) > settings_.moved * p.standard_error;
    }
  }
  if (due) pass_through_history();
}

std::vector<std::vector<double>> SequentialFit::next_starts(const ResidualFunction& function,
                                                            const FitConfig& config) {
  std::vector<std::vector<double>> starts;
  if (here_) {
    std::vector<double>& last = starts.emplace_back();
    for (const EstimatedParameter& p : config.parameters) {
      const std::size_t place = p.sets.front().parameter;
      last.push_back(estimate_ ? estimate_->values[place] : here_->values[place]);
    }
  }
  const std::size_t n = recording_.time_s.size();
  if (n < next_search_ && here_) return starts;
  next_search_ = 2 * n;
  std::vector<bool> linear;
  for (std::size_t i = 0; i < config.parameters.size(); ++i)
    linear.push_back(function.linear_in(i));
  std::ranges::move(projected_starts(function, searched_parameters(config), linear,
                                     settings_.starts, kKeptStarts, settings_.seed),
                    std::back_inserter(starts));
  return starts;
}

void SequentialFit::pass_through_history() {
  const std::size_t n = recording_.time_s.size();
  const auto more = static_cast<std::size_t>(settings_.grown * static_cast<double>(n));
  next_pass_ = n + std::max<std::size_t>(3, more);
  const std::optional<Prefix> so_far = prefix();
  if (!so_far) return;
  const LawModel model(spec_);
  const FitConfig& config = so_far->config;
  const PreparedRecording* const prepared = &so_far->recording;
  AutoregressiveNoise noise(here_ ? here_->noise.phi() : 0.0, median_step(recording_.time_s));
  const double guess = kFirstNoise * std::max(std::abs(prepared->phases.peak_response), 1e-12);
  const bool known = estimate_ && estimate_->sigma > 0.0;
  WhitenedPrefix function(model, config, *prepared, noise, known ? estimate_->sigma : guess);
  if (function.residual_count() <= std::ssize(config.parameters) + 2) return;
  ++passes_;
  const std::vector<FitParameter> parameters = searched_parameters(config);
  Minimum best = least_of(function, parameters, next_starts(function, config));
  if (!best.usable) return;
  const auto correlation = improve_in_turn(function, parameters, noise, best);

  std::vector<double> values = model_parameters(config, best.natural, 0);
  auto here = std::make_unique<Linearisation>(model.at(values, nullptr));
  for (const EstimatedParameter& p : config.parameters) {
    here->place.push_back(p.sets.front().parameter);
    const LawParameter& known_as = model.law_parameters()[here->place.back()];
    here->nuisance.push_back(known_as.nuisance);
    if (known_as.name == "contact") here->contact = std::ssize(here->place) - 1;
  }
  here->parameters = parameters;
  here->free = off_bounds(parameters, best.natural);
  here->natural = best.natural;
  here->values = std::move(values);
  here->from_s = prepared->from_s;
  here->noise = noise;
  here->correlation = correlation;
  here->start(recording_.time_s.front(), recording_.drive.front(), prepared->phases.peak_drive);
  for (std::size_t i = 0; i < n; ++i) {
    here->take(recording_.time_s[i], recording_.drive[i], recording_.response[i]);
  }
  here->keep_as_minimum();
  here->profile(function, settings_.level);
  here_ = std::move(here);
  describe();
}

namespace {

void set_sequential_interval(SequentialParameter& s, double theta, double standard_error,
                             double degrees, double level, double lower, double upper) {
  theta = std::clamp(theta, s.parameter.theta_lower(), s.parameter.theta_upper());
  s.estimate = s.parameter.natural(theta);
  s.standard_error = standard_error;
  s.degrees_of_freedom = degrees;
  const double half = standard_error * half_width(degrees, level);
  s.lower = s.parameter.natural(theta - half * lower);
  s.upper = s.parameter.natural(theta + half * upper);
}

}  // namespace

void SequentialFit::describe() {
  const Linearisation& l = *here_;
  const auto p = std::ssize(l.free);
  const auto n = static_cast<Eigen::Index>(l.samples);
  if (n <= p + 2) return;
  SequentialEstimate e;
  e.samples = l.samples;
  e.phi = l.noise.phi();
  e.values = l.values;
  const Eigen::MatrixXd gram = l.free_gram();
  const bool told = p > 0 && l.correlation && tells_apart(gram);
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(p);
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(p, p);
  double squares = l.squares;
  if (told) {
    const Eigen::LLT<Eigen::MatrixXd> normal(gram);
    const Eigen::VectorXd right = l.right(l.free);
    moved = normal.solve(right) - l.away_then;
    inverse = normal.solve(Eigen::MatrixXd::Identity(p, p));
    squares = std::max(squares - 2.0 * right.dot(moved) + moved.dot(gram * moved), 0.0);
  }
  const double variance = squares / static_cast<double>(n - p);
  e.sigma = std::sqrt(variance);
  const double count = static_cast<double>(n);
  e.bic = count * std::log(std::max(squares, 1e-300) / count) + l.log_determinant +
          (static_cast<double>(l.parameters.size()) + 2.0) * std::log(count);
  e.covariance = Eigen::MatrixXd::Zero(std::ssize(l.parameters), std::ssize(l.parameters));
  e.identified = told;
  for (std::size_t i = 0; i < l.parameters.size(); ++i) {
    SequentialParameter s = l.undetermined(i);
    const auto found = std::find(l.free.begin(), l.free.end(), static_cast<Eigen::Index>(i));
    s.at_bound = found == l.free.end();
    if (!s.at_bound && told) {
      const auto k = static_cast<Eigen::Index>(found - l.free.begin());
      AutoregressionEstimate now = *l.correlation;
      now.phi_variance *= static_cast<double>(l.samples_then) / count;
      const double theta = s.parameter.theta(l.natural[i]) + moved[k];
      set_sequential_interval(s, theta, std::sqrt(variance * inverse(k, k)),
                              satterthwaite_degrees(now, k, n, p), settings_.level,
                              l.wider.lower[l.free[static_cast<std::size_t>(k)]],
                              l.wider.upper[l.free[static_cast<std::size_t>(k)]]);
      for (Eigen::Index c = 0; c < p; ++c) {
        e.covariance(static_cast<Eigen::Index>(i), l.free[static_cast<std::size_t>(c)]) =
            variance * inverse(k, c);
      }
    }
    e.values[s.place] = s.estimate;
    if (!s.nuisance) e.identified = e.identified && !s.at_bound;
    e.parameters.push_back(std::move(s));
  }
  estimate_ = std::move(e);
}

std::optional<std::size_t> least_law(std::span<const SequentialFit> fits, double margin) {
  for (const bool only_identified : {true, false}) {
    double best = kUnknown;
    const auto eligible = [&](const SequentialFit& fit) {
      return fit.estimate() && (fit.estimate()->identified || !only_identified);
    };
    for (const SequentialFit& fit : fits) {
      if (eligible(fit)) best = std::min(best, fit.estimate()->bic);
    }
    std::optional<std::size_t> chosen;
    for (std::size_t i = 0; i < fits.size(); ++i) {
      if (!eligible(fits[i]) || fits[i].estimate()->bic - best > margin) continue;
      const auto size = [&](std::size_t k) { return fits[k].estimate()->parameters.size(); };
      const bool less =
          !chosen || size(i) < size(*chosen) ||
          (size(i) == size(*chosen) && fits[i].estimate()->bic < fits[*chosen].estimate()->bic);
      if (less) chosen = i;
    }
    if (chosen) return chosen;
  }
  return std::nullopt;
}

}  // namespace tpm::fit
