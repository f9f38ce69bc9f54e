#include "tpm/fit/select/doubtful_contact.hpp"

#include <algorithm>
#include <array>

#include "tpm/fit/conditional.hpp"
#include "tpm/fit/verdict.hpp"

namespace tpm::fit {
namespace {

/// True if the exponent was fitted, and its interval holds that of no probe.
bool has_exponent_of_no_probe(const FitResult& fit) {
  constexpr std::array kOfProbes{1.0, 1.5, 2.0};
  const auto exponent = std::ranges::find_if(
      fit.parameters, [](const ParameterResult& p) { return p.parameter.name == "exponent"; });
  if (exponent == fit.parameters.end()) return false;
  return std::ranges::none_of(kOfProbes, [&](double m) {
    return (!exponent->lower || *exponent->lower <= m) &&
           (!exponent->upper || m <= *exponent->upper);
  });
}

/// True for a coefficient or the exponent of a power of the depth: it is counted from the contact.
bool is_counted_from_contact(const ParameterResult& p) {
  const Dimension dimension = p.parameter.unit.dimension;
  return !p.nuisance && (dimension == Dimension::stiffness || dimension == Dimension::stress ||
                         p.parameter.name == "exponent");
}

/// True if the fit claims to know it much better than what was measured before.
bool is_much_surer(const ParameterResult& p, const Prior& prior) {
  constexpr double kMuchLess = 3.0;  // times the standard error
  return p.standard_error && prior.sd >= kMuchLess * *p.standard_error;
}

}  // namespace

void doubt_contact(FitResult& fit) {
  if (!fit.config.law || fit.config.law->kernel != Kernel::power) return;
  if (!has_exponent_of_no_probe(fit)) return;
  const Remark doubt{kContactOrLoading, "contact or a loading that is no power of the depth"};
  const auto mark = [&](ParameterResult& p) {
    if (p.verdict != Verdict::identified || p.not_separable) return;
    p.not_separable = doubt;
    p.summary = parameter_words(p, fit.config.level);
  };
  bool doubted = false;
  for (std::size_t i = 0; i < fit.parameters.size() && i < fit.config.parameters.size(); ++i) {
    ParameterResult& p = fit.parameters[i];
    const auto& prior = fit.config.parameters[i].prior;
    if (!p.nuisance || !is_contact(fit.config, i) || !prior || p.not_separable) continue;
    // A contact that even the power leaves open, or at the end of its range, is no surer.
    const bool found = p.verdict == Verdict::identified;
    if (found && !is_much_surer(p, *prior)) continue;
    mark(p);
    doubted = true;
  }
  if (!doubted) return;
  for (std::size_t i = 0; i < fit.parameters.size() && i < fit.config.parameters.size(); ++i) {
    ParameterResult& p = fit.parameters[i];
    const auto& prior = fit.config.parameters[i].prior;
    // So is a zero that follows from the power alone.
    const bool zero = p.nuisance && p.parameter.name.starts_with("offset") && prior;
    if (is_counted_from_contact(p) || (zero && is_much_surer(p, *prior))) mark(p);
  }
}

}  // namespace tpm::fit
