#include "tpm/fit/likelihood/experiment_refit.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/lists.hpp"
#include "tpm/fit/likelihood/fit_words.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

/// A parameter of some data sets only goes unseen in draws that leave them out.
void require_shared_parameters(const FitConfig& config) {
  for (const EstimatedParameter& p : config.parameters) {
    const bool own_target = std::any_of(p.sets.begin(), p.sets.end(),
                                        [](const Target& target) { return !target.data.empty(); });
    const auto named = std::count_if(
        config.data.begin(), config.data.end(),
        [&](const DataChoice& d) { return d.sigma_a == p.fit.name || d.sigma_b == p.fit.name; });
    const bool own_noise = p.sets.empty() && named < static_cast<int>(config.data.size());
    if (!own_target && !own_noise) continue;
    throw bad_input(
        "bootstrap",
        fmt::format("whole recordings are drawn, and '{}' belongs to some data sets only",
                    printable(p.fit.name)),
        "parameters of all data sets, or resampling of residuals or blocks");
  }
}

}  // namespace

std::string_view resampling_name(Resampling resampling) noexcept {
  return entry_of(kResamplingWords, resampling).text;
}

Resampling parse_resampling(std::string_view text, std::string_view where) {
  return parse_word(kResamplingWords, "resampling", text, where);
}

ExperimentRefit::ExperimentRefit(const ExperimentResiduals& function) : function_(function) {
  // data() is in the order of the data sets, and in each in the order of its experiments.
  for (std::size_t i = 0; i < function.data().size(); ++i) {
    const FitDatum& d = function.data()[i];
    if (d.value && !d.held_out) readings_.push_back(i);
  }
}

std::vector<std::size_t> ExperimentRefit::recording_lengths() const {
  std::vector<std::size_t> lengths(function_.config().data.size(), 0);
  for (const std::size_t i : readings_) ++lengths[function_.data()[i].choice];
  std::erase(lengths, std::size_t{0});
  return lengths;
}

std::vector<double> ExperimentRefit::standardised_residuals(std::span<const double> natural) const {
  const Eigen::VectorXd answer = function_.predict(natural, nullptr);
  return mapped<double>(readings_, [&](std::size_t i) {
    // Refittable counts data less answers, a residual the other way round.
    return -function_.standardised(i, answer[static_cast<Eigen::Index>(i)], natural);
  });
}

std::unique_ptr<ResidualFunction> ExperimentRefit::with_residuals(std::span<const double> natural,
                                                                  std::span<const double> z) const {
  const Eigen::VectorXd answer = function_.predict(natural, nullptr);
  auto copy = function_.copy();
  for (std::size_t k = 0; k < readings_.size(); ++k) {
    const std::size_t i = readings_[k];
    const double f = answer[static_cast<Eigen::Index>(i)];
    const ErrorLaw law = error_law(function_.config().data[function_.data()[i].choice].noise);
    copy->set_value(i, scattered(law, f, function_.new_noise_scale(i, f, natural), z[k]));
  }
  return copy;
}

std::unique_ptr<ResidualFunction> ExperimentRefit::with_readings(
    std::span<const std::size_t> readings) const {
  std::vector<int> counts(function_.data().size(), 1);
  for (const std::size_t i : readings_) counts[i] = 0;
  for (const std::size_t reading : readings) ++counts[readings_.at(reading)];
  auto copy = function_.copy();
  copy->set_counts(std::move(counts));
  return copy;
}

BootstrapResult bootstrap_experiments(const ExperimentResiduals& function,
                                      std::span<const FitParameter> parameters,
                                      const Minimum& minimum, const BootstrapOptions& options) {
  if (options.resampling == Resampling::recordings) require_shared_parameters(function.config());
  return bootstrap(ExperimentRefit(function), parameters, minimum, options);
}

}  // namespace tpm::fit
