#include "tpm/fit/adequacy.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "tpm/base/distributions.hpp"
#include "tpm/base/enum_names.hpp"
#include "tpm/base/median.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/residual_jumps.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kFewestAtRest = 8;
constexpr double kFewestDegrees = 4.0;  // of the noise at rest
constexpr double kConfidence = 2.0;     // standard errors of a correlation
constexpr double kMostCorrelation = 0.98;
constexpr double kSure = 1e-3;  // level at which noise under load is more than that at rest

void require_alike(const AdequacyData& data) {
  const auto finite = [](std::span<const double> values) {
    return std::ranges::all_of(values, [](double v) { return std::isfinite(v); });
  };
  if (data.rest.size() != data.rest_time_s.size() || data.reading.size() != data.time_s.size() ||
      data.residual.size() != data.time_s.size()) {
    throw bad_input("adequacy", "times, readings and residuals of unequal number", "one of each");
  }
  if (finite(data.rest) && finite(data.reading) && finite(data.residual)) return;
  throw bad_input("adequacy", "a reading or residual that is not finite", "finite numbers");
}

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double squares_about(std::span<const double> values, double centre) {
  double sum = 0.0;
  for (const double v : values) sum += (v - centre) * (v - centre);
  return sum;
}

/// Lag-1 correlation about a centre; none if all values are the same.
std::optional<double> lag1_about(std::span<const double> values, double centre) {
  const double squares = squares_about(values, centre);
  if (!(squares > 0.0)) return std::nullopt;
  double products = 0.0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    products += (values[i - 1] - centre) * (values[i] - centre);
  }
  return products / squares;
}

/// The straight line of least squares through readings at rest.
struct RestLine {
  double per_s = 0.0;
  double spread = 0.0;      ///< sum of squares of the times about their mean
  std::vector<double> off;  ///< readings less the line
};

RestLine line_through(std::span<const double> time_s, std::span<const double> rest) {
  RestLine line;
  const double mean_time = mean_of(time_s);
  const double mean = mean_of(rest);
  line.spread = squares_about(time_s, mean_time);
  double products = 0.0;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    products += (time_s[i] - mean_time) * (rest[i] - mean);
  }
  if (line.spread > 0.0) line.per_s = products / line.spread;
  line.off.reserve(rest.size());
  for (std::size_t i = 0; i < rest.size(); ++i) {
    line.off.push_back(rest[i] - mean - line.per_s * (time_s[i] - mean_time));
  }
  return line;
}

/// Upper confidence bound of a lag-1 correlation r of n values, 0 .. kMostCorrelation.
double upper_correlation(double r, std::size_t n, bool about_line) {
  const auto count = static_cast<double>(n);
  // Bias of a correlation about an estimated line (about a mean: Kendall's (1 + 3 rho) / n).
  if (about_line) r += (2.0 + 4.0 * std::max(r, 0.0)) / count;
  const double error = std::sqrt(std::max(1.0 - r * r, 0.05) / count);
  return std::clamp(r + kConfidence * error, 0.0, kMostCorrelation);
}

/// First two moments of the sum of squares about a straight line of n values of unit variance with
/// correlation rho^|i-j|, as its expectation and its degrees of freedom.
struct SquaresAboutLine {
  double expectation = 0.0, degrees = 0.0;
};

SquaresAboutLine squares_about_line(std::size_t n, double rho) {
  constexpr std::size_t kMost = 300;  // beyond, both grow with the number
  const auto m = static_cast<Eigen::Index>(std::min(n, kMost));
  Eigen::MatrixXd c(m, m);
  Eigen::MatrixXd line(m, 2);
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      c(i, j) = c(j, i) = std::pow(rho, static_cast<double>(i - j));
    }
    line(i, 0) = 1.0;
    line(i, 1) = static_cast<double>(i) - 0.5 * static_cast<double>(m - 1);
  }
  line.colwise().normalize();
  // M C M with the projection M = 1 - line line'.
  const Eigen::MatrixXd taken = c * line;
  const Eigen::MatrixXd left = c - taken * line.transpose() - line * taken.transpose() +
                               line * (line.transpose() * taken) * line.transpose();
  const double more = static_cast<double>(n) / static_cast<double>(m);
  const double trace = left.trace();
  return {trace * more, trace * trace / left.squaredNorm() * more};
}

/// The noise as the rest and, if the law is right, the residuals tell it.
struct RestNoise {
  double variance = 0.0, degrees = 0.0, correlation = 0.0;
  bool under_load = false;
};

/// Variance of the residuals about the line between their neighbours, as the mean over blocks: a
/// noise may grow with the load. The median in each block leaves out jumps.
/// @return 0 below two blocks
double scatter_under_load(std::span<const double> residual) {
  constexpr std::size_t kBlock = 32;
  constexpr double kOfMedian = 1.4826, kOfLine = 1.5;
  double sum = 0.0, blocks = 0.0;
  for (std::size_t begin = 1; begin + kBlock < residual.size(); begin += kBlock) {
    std::vector<double> off;
    for (std::size_t i = begin; i < begin + kBlock; ++i) {
      off.push_back(std::abs(residual[i] - 0.5 * (residual[i - 1] + residual[i + 1])));
    }
    const double sd = kOfMedian * median(std::move(off));
    sum += sd * sd / kOfLine;
    blocks += 1.0;
  }
  return blocks >= 2.0 ? sum / blocks : 0.0;
}

RestNoise noise_of(const AdequacyData& data) {
  RestNoise noise;
  const RestLine line = line_through(data.rest_time_s, data.rest);
  const auto of_rest = lag1_about(line.off, 0.0);
  const auto of_residual = lag1_about(data.residual, 0.0);
  noise.correlation = kMostCorrelation;
  if (of_rest) noise.correlation = upper_correlation(*of_rest, data.rest.size(), true);
  if (of_residual) {
    noise.correlation =
        std::min(noise.correlation, upper_correlation(*of_residual, data.residual.size(), false));
  }
  // About a line: a drift is no noise.
  const SquaresAboutLine at_rest = squares_about_line(data.rest.size(), noise.correlation);
  noise.degrees = at_rest.degrees;
  noise.variance = squares_about(line.off, 0.0) / at_rest.expectation;
  std::vector<double> all(data.rest.begin(), data.rest.end());
  all.insert(all.end(), data.reading.begin(), data.reading.end());
  const double quantum = quantum_of(all);
  noise.variance += quantum * quantum / 12.0 + data.carried_variance;
  constexpr double kEfficiency = 0.25;  // of a median of second differences, in readings
  const double scatter = scatter_under_load(data.residual);
  const double degrees = kEfficiency * static_cast<double>(data.residual.size());
  noise.under_load = noise.variance > 0.0 && scatter > noise.variance &&
                     fisher_tail(scatter / noise.variance, degrees, noise.degrees) < kSure;
  if (noise.under_load) {
    noise.variance = scatter;
    noise.degrees = degrees;
  }
  return noise;
}

/// p of the mean square of residuals against the noise.
double p_of(std::span<const double> residual, int parameters, const RestNoise& noise) {
  const auto n = static_cast<double>(residual.size());
  const double square = squares_about(residual, 0.0) / std::max(n - parameters, 1.0);
  if (!(noise.variance > 0.0)) return square > 0.0 ? 0.0 : 1.0;
  const double r2 = noise.correlation * noise.correlation;
  const double degrees = std::max(n * (1.0 - r2) / (1.0 + r2) - parameters, 1.0);
  return fisher_tail(square / noise.variance, degrees, noise.degrees);
}

/// True if what should rest scatters by so much more than what a law leaves that it is no noise.
bool is_restless(const AdequacyData& data) {
  constexpr double kRestless = 2.0;  // times the residual
  const auto lag1 = lag1_about(data.residual, 0.0);
  if (!lag1) return false;
  const double r = upper_correlation(*lag1, data.residual.size(), false);
  const auto degrees = [r](double n) { return std::max(n * (1.0 - r * r) / (1.0 + r * r), 1.0); };
  const double of_rest = static_cast<double>(data.rest.size()) - 2.0;
  const double of_residual = static_cast<double>(data.residual.size()) - data.parameters;
  const RestLine line = line_through(data.rest_time_s, data.rest);
  const double ratio =
      (squares_about(line.off, 0.0) / of_rest) / (squares_about(data.residual, 0.0) / of_residual);
  return ratio > kRestless * kRestless &&
         fisher_tail(ratio, degrees(of_rest), degrees(of_residual)) < kSure;
}

std::size_t longest_equal(std::span<const double> values, std::size_t first, std::size_t last,
                          double but) {
  std::size_t longest = 0;
  std::size_t length = 0;
  for (std::size_t i = first; i < last; ++i) {
    length = i > first && values[i] == values[i - 1] ? length + 1 : 1;
    if (values[i] != but) longest = std::max(longest, length);
  }
  return longest;
}

/// The longest run at one value.
EqualRun run_at(std::span<const double> values, double value, bool largest) {
  EqualRun run{0, 0, value, largest};
  std::size_t length = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    length = values[i] == value ? length + 1 : 0;
    if (length > run.length) run = {i + 1 - length, length, value, largest};
  }
  return run;
}

/// Readings that are back at the level of the rest while the law expects a load.
struct LostSignal {
  double at_s = 0.0;
  bool to_the_end = false;  ///< as of a fluid without memory, too, whose force ends with the motion
};

std::optional<LostSignal> signal_lost(const AdequacyData& data, const RestNoise& noise) {
  constexpr int kInARow = 3;
  constexpr double kAtRest = 4.0, kFarOff = 20.0;  // standard deviations of the noise
  const double level = mean_of(data.rest);
  const double sd = std::sqrt(noise.variance);
  const auto at_rest = [&](double reading) { return std::abs(reading - level) <= kAtRest * sd; };
  int count = 0;
  bool loaded = false;  // readings before the load are at rest, too
  for (std::size_t i = 0; i < data.reading.size(); ++i) {
    loaded = loaded || std::abs(data.reading[i] - level) > kFarOff * sd;
    const bool lost =
        loaded && at_rest(data.reading[i]) && std::abs(data.residual[i]) > kFarOff * sd;
    count = lost ? count + 1 : 0;
    if (count < kInARow) continue;
    const auto later = data.reading.subspan(i);
    const auto still = std::ranges::count_if(later, at_rest);
    constexpr double kAll = 0.98;  // some readings lie far off
    return LostSignal{data.time_s[i + 1 - kInARow],
                      static_cast<double>(still) > kAll * static_cast<double>(later.size())};
  }
  return std::nullopt;
}

/// Readings that stand still at any level while those that the law expects move on: longer than
/// rounding makes, and by more than the noise.
std::optional<EqualRun> frozen_run(const AdequacyData& data, const RestNoise& noise) {
  constexpr std::size_t kLeast = 8, kTimes = 3;
  constexpr double kMoved = 6.0;  // standard deviations of the noise
  const std::span<const double> readings = data.reading;
  EqualRun run;
  std::size_t begin = 0, second = 0;
  for (std::size_t i = 1; i <= readings.size(); ++i) {
    if (i < readings.size() && readings[i] == readings[begin]) continue;
    const std::size_t length = i - begin;
    second = std::max(second, std::min(length, run.length));
    if (length > run.length) run = {begin, length, readings[begin], false};
    begin = i;
  }
  if (run.length < kLeast || run.length <= kTimes * second) return std::nullopt;
  const auto [low, high] =
      std::ranges::minmax_element(data.residual.subspan(run.first, run.length));
  if (*high - *low <= kMoved * std::sqrt(noise.variance)) return std::nullopt;
  return run;
}

std::vector<Remark> causes_of(const AdequacyData& data, const RestNoise& noise, double level) {
  std::vector<Remark> causes;
  const double sd = std::sqrt(noise.variance);
  if (const auto run = clipped_run(data.reading, data.rest)) {
    causes.push_back(
        {"clipping",
         fmt::format("clipping: {} readings in a row from {} s on are all the {}, longer than "
                     "rounding makes",
                     run->length, significant(data.time_s[run->first], 4),
                     run->largest ? "largest" : "smallest")});
  }
  if (const auto lost = signal_lost(data, noise)) {
    const bool moves_on = lost->at_s < data.ramp_to_s;
    causes.push_back(
        {lost->to_the_end ? "signal_ends" : "signal_lost",
         fmt::format("{}: from {} s on readings are {} at the level of the rest{}",
                     !lost->to_the_end ? "lost signal"
                     : moves_on        ? "lost signal, or a specimen that broke or slipped out"
                                : "lost signal, or a fluid whose response ends with the motion",
                     significant(lost->at_s, 4), lost->to_the_end ? "to the end" : "back",
                     lost->to_the_end ? "" : " under a load")});
  }
  if (!data.repeated.empty()) causes.push_back({"readings_repeated", data.repeated});
  if (const auto run = frozen_run(data, noise); run && causes.empty()) {
    causes.push_back(
        {"signal_frozen",
         fmt::format("frozen signal: {} readings in a row from {} s on are equal, longer than "
                     "rounding makes",
                     run->length, significant(data.time_s[run->first], 4))});
  }
  if (const auto jump = jump_under_load(data.time_s, data.residual, data.ramp_to_s, sd);
      jump && causes.empty()) {
    causes.push_back(
        {"jump", fmt::format("a slip, or a zero that was set under a load: at {} s readings change "
                             "by {} noises from one to the next",
                             significant(jump->at_s, 4), fixed(std::abs(jump->by) / sd, 0))});
  }
  if (const auto trend = rest_trend(data.rest_time_s, data.rest)) {
    constexpr double kSeen = 4.0, kMatters = 1.0;
    const double moved = std::abs(trend->per_s) * (data.time_s.back() - data.time_s.front());
    if (std::abs(trend->per_s) > kSeen * trend->standard_error && moved > kMatters * sd) {
      causes.push_back(
          {"drift",
           fmt::format("drift: at rest the readings change by {} noises over as long as the "
                       "fitted part lasts",
                       times_text(moved / sd))});
    }
  }
  if (const auto spike = spike_in(data.residual); spike && causes.empty()) {
    causes.push_back(
        {"spike", fmt::format("a spike at {} s: {} {} times the noise off the readings beside",
                              significant(data.time_s[spike->first], 4),
                              spike->length == 1 ? "one reading is" : "two readings are up to",
                              times_text(spike->size / sd))});
  }
  const std::size_t early = std::max<std::size_t>(data.residual.size() / 10, 5);
  if (causes.empty() && data.residual.size() > 3 * early &&
      p_of(data.residual.subspan(early), data.parameters, noise) >= level) {
    // Without its ramp any kernel describes a hold.
    constexpr std::ptrdiff_t kShape = 10;  // samples that show the shape of a ramp
    const auto ramp = std::ranges::upper_bound(data.time_s, data.ramp_to_s) - data.time_s.begin();
    // Too little of it is left to show its shape.
    const bool has_ramp = ramp >= kShape && ramp < static_cast<std::ptrdiff_t>(early) + kShape;
    causes.push_back({has_ramp ? "ramp_or_transient" : "transient",
                      fmt::format("{}: without the first {} samples, to {} s, it would",
                                  has_ramp ? "the shape of the ramp, or a transient" : "transient",
                                  early, significant(data.time_s[early], 4))});
  }
  return causes;
}

}  // namespace

std::string_view described_name(Described described) noexcept {
  static constexpr auto kNames =
      std::to_array<Word<Described>>({{Described::adequate, "adequate"},
                                      {Described::not_described, "not_described"},
                                      {Described::not_judged, "not_judged"}});
  return word_for(kNames, described);
}

std::string times_text(double times) {
  constexpr double kWhole = 10.0;  // from here on whole numbers
  return times < kWhole ? significant(times, 2) : fixed(times, 0);
}

std::optional<EqualRun> clipped_run(std::span<const double> readings,
                                    std::span<const double> rest) {
  constexpr std::size_t kLeast = 4, kTimes = 3;
  if (readings.size() < kLeast) return std::nullopt;
  const auto [low, high] = std::ranges::minmax_element(readings);
  const std::size_t resting = longest_equal(rest, 0, rest.size(), HUGE_VAL);
  const bool rests_on_one_level = resting > 1 && 2 * resting >= rest.size();
  std::optional<EqualRun> longest;
  for (const EqualRun& run : {run_at(readings, *high, true), run_at(readings, *low, false)}) {
    // Rounded readings repeat where the response turns; their neighbours repeat, too.
    const std::size_t reach = kTimes * run.length;
    const std::size_t first = run.first > reach ? run.first - reach : 0;
    const std::size_t last = std::min(run.first + run.length + reach, readings.size());
    std::size_t elsewhere = longest_equal(readings, first, last, run.value);
    if (rests_on_one_level) elsewhere = std::max(elsewhere, resting);
    if (run.length < kLeast || run.length <= kTimes * elsewhere) continue;
    if (!longest || run.length > longest->length) longest = run;
  }
  return longest;
}

std::optional<RestTrend> rest_trend(std::span<const double> time_s, std::span<const double> rest) {
  if (rest.size() < kFewestAtRest) return std::nullopt;
  const RestLine line = line_through(time_s, rest);
  const double squares = squares_about(line.off, 0.0);
  if (!(line.spread > 0.0 && squares > 0.0)) return std::nullopt;
  const double rho = std::clamp(lag1_about(line.off, 0.0).value_or(0.0), 0.0, kMostCorrelation);
  const double variance = squares / static_cast<double>(rest.size() - 2);
  return RestTrend{line.per_s, std::sqrt(variance / line.spread * (1.0 + rho) / (1.0 - rho))};
}

std::optional<RestBend> rest_bend(std::span<const double> time_s, std::span<const double> rest) {
  constexpr std::size_t kFewest = 20;
  if (rest.size() < kFewest) return std::nullopt;
  const double mean_time = mean_of(time_s);
  const double half = 0.5 * (time_s.back() - time_s.front());
  if (!(half > 0.0)) return std::nullopt;
  std::vector<double> square;
  square.reserve(time_s.size());
  for (const double t : time_s) square.push_back(std::pow((t - mean_time) / half, 2));
  const std::vector<double> parabola = line_through(time_s, square).off;
  const RestLine line = line_through(time_s, rest);
  const double spread = squares_about(parabola, 0.0);
  double product = 0.0;
  for (std::size_t i = 0; i < rest.size(); ++i) product += parabola[i] * line.off[i];
  const double bend = product / spread;
  std::vector<double> left = line.off;
  for (std::size_t i = 0; i < left.size(); ++i) left[i] -= bend * parabola[i];
  const auto correlation = lag1_about(left, 0.0);
  if (!correlation) return std::nullopt;
  const double rho = upper_correlation(*correlation, left.size(), true);
  const double variance = squares_about(left, 0.0) / static_cast<double>(left.size() - 3);
  const double independent = (1.0 - rho) / (1.0 + rho);
  const double degrees = std::max(static_cast<double>(left.size()) * independent - 3.0, 1.0);
  const double t2 = bend * bend * spread / variance * independent;
  return RestBend{std::abs(bend) / std::sqrt(variance), fisher_tail(t2, 1.0, degrees)};
}

Adequacy judge_adequacy(const AdequacyData& data, double level) {
  require_alike(data);
  Adequacy result;
  const auto n = static_cast<double>(data.residual.size());
  if (data.rest.size() < kFewestAtRest || !(n > data.parameters)) return result;
  result.restless = is_restless(data);
  if (result.restless) return result;
  const RestNoise noise = noise_of(data);
  result.noise_sd = std::sqrt(noise.variance);
  result.noise_under_load = noise.under_load;
  result.rest_degrees = noise.degrees;
  if (noise.degrees < kFewestDegrees || !(noise.variance > 0.0)) return result;
  const double square = squares_about(data.residual, 0.0) / (n - data.parameters);
  result.residual_over_noise = std::sqrt(square / noise.variance);
  result.p_value = p_of(data.residual, data.parameters, noise);
  result.described = result.p_value < level ? Described::not_described : Described::adequate;
  if (result.described == Described::not_described) result.causes = causes_of(data, noise, level);
  return result;
}

}  // namespace tpm::fit
