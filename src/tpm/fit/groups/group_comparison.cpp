#include "tpm/fit/groups/group_comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

std::vector<double> log_depths(const RecordingGroup& group) {
  std::vector<double> logs;
  for (const PreparedRecording& r : group.recordings) {
    if (r.recording.drive_quantity != Quantity::indentation_depth) continue;
    const double depth =
        r.phases.peak_drive - (r.phases.contact_found ? r.phases.contact_drive : 0.0);
    if (depth > 0.0) logs.push_back(std::log(depth));
  }
  return logs;
}

double mean_value(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double squares_around(const std::vector<double>& values, double mean) {
  return std::accumulate(values.begin(), values.end(), 0.0,
                         [&](double sum, double v) { return sum + (v - mean) * (v - mean); });
}

/// The estimates of one quantity in each group.
using TwoGroups = std::array<ParameterEstimates, 2>;

ComparedQuantity compared(const TwoGroups& groups, const std::array<std::string, 2>& names,
                          double level) {
  ComparedQuantity q;
  q.parameter = groups[0].parameter;
  q.si_unit = si_unit(q.parameter);
  std::array<SpecimenMeans, 2> means;
  for (std::size_t g = 0; g < 2; ++g) {
    q.left_out[g] = groups[g].left_out;
    q.not_described[g] = groups[g].not_described;
    if (groups[g].only_without) {
      q.only_without = groups[g].only_without;
    } else {
      q.left_out[g] += groups[g].not_separable;
    }
    if (groups[g].estimates.empty()) continue;
    q.typical[g] = random_effects_of_repeats(groups[g].estimates, level);
    means[g] = specimen_means(groups[g].estimates);
  }
  for (std::size_t g = 0; g < 2; ++g) {
    const std::size_t count = means[g].specimens.size();
    if (count >= 2) continue;
    q.reason += fmt::format("{}{} specimen{} of {} determine{} it", q.reason.empty() ? "" : "; ",
                            count, count == 1 ? "" : "s", names[g], count == 1 ? "s" : "");
  }
  if (q.reason.empty()) {
    q.difference = group_difference(means[0].specimens, means[1].specimens, level);
  }
  return q;
}

std::vector<ComparedQuantity> compared_parameters(std::span<const SpecimenRow> first,
                                                  std::span<const SpecimenRow> second,
                                                  const SpecimenRow& like,
                                                  const std::array<std::string, 2>& names,
                                                  double level) {
  std::vector<ComparedQuantity> all;
  for (std::size_t i = 0; i < like.fit->parameters.size(); ++i) {
    if (is_of_recording(like.fit->parameters[i])) continue;
    const TwoGroups groups{parameter_estimates(first, like, i),
                           parameter_estimates(second, like, i)};
    const bool somewhere = !groups[0].estimates.empty() || !groups[1].estimates.empty();
    if (somewhere) all.push_back(compared(groups, names, level));
  }
  return all;
}

FitParameter as_modulus(const YoungModulus& m) {
  FitParameter p;
  p.name = m.name;
  p.unit = {"k" + m.unit, Dimension::stress, 1e3};
  p.scale = Scale::log;
  return p;
}

/// The estimates of a stiffness as Young's moduli: times a constant.
ParameterEstimates times(ParameterEstimates found, double factor) {
  for (SpecimenEstimate& e : found.estimates) e.estimate += std::log(factor);
  return found;
}

/// The instantaneous coefficient: a sum, of which each fit has its own standard error.
ParameterEstimates sum_estimates(std::span<const SpecimenRow> rows, const std::string& modulus,
                                 const ContactGeometry& probe) {
  ParameterEstimates found;
  for (const SpecimenRow& row : rows) {
    if (!row.fit) continue;
    const YoungModuli moduli = young_moduli(*row.fit, probe, false);
    const auto m = std::ranges::find(moduli.moduli, modulus, &YoungModulus::name);
    if (m == moduli.moduli.end() || !m->standard_error || !(m->estimate > 0.0)) {
      ++found.left_out;
      continue;
    }
    found.estimates.push_back(
        {row.name, std::log(m->estimate), *m->standard_error / m->estimate, row.specimen});
    found.not_described += is_not_described(*row.fit);
  }
  return found;
}

std::vector<ComparedQuantity> compared_moduli(const GroupComparison& c, const SpecimenRow& like,
                                              const ContactGeometry& probe) {
  const std::span rows(c.study.rows);
  const std::array groups{rows.first(c.first), rows.subspan(c.first)};
  const double factor = modulus_Pa(c.study.law, 1.0, probe).value();
  std::vector<ComparedQuantity> all;
  for (const YoungModulus& m : young_moduli(*like.fit, probe, false).moduli) {
    const auto place = std::ranges::find_if(
        like.fit->parameters, [&](const ParameterResult& p) { return p.parameter.name == m.of; });
    TwoGroups found;
    for (std::size_t g = 0; g < 2; ++g) {
      found[g] = place == like.fit->parameters.end()
                     ? sum_estimates(groups[g], m.name, probe)
                     : times(parameter_estimates(
                                 groups[g], like,
                                 static_cast<std::size_t>(place - like.fit->parameters.begin())),
                             factor);
      found[g].parameter = as_modulus(m);
    }
    if (found[0].estimates.empty() && found[1].estimates.empty()) continue;
    all.push_back(compared(found, c.names, c.study.level));
    all.back().si_unit = m.unit;
  }
  return all;
}

/// Holm, Scandinavian Journal of Statistics 6 (1979) 65.
void adjust_by_holm(std::vector<ComparedQuantity>& all) {
  std::vector<ComparedQuantity*> tested;
  for (ComparedQuantity& q : all) {
    if (q.difference) tested.push_back(&q);
  }
  std::ranges::sort(tested, {}, [](const ComparedQuantity* q) { return q->difference->p_value; });
  double least = 0.0;
  for (std::size_t i = 0; i < tested.size(); ++i) {
    const auto left = static_cast<double>(tested.size() - i);
    least = std::max(least, std::min(1.0, left * tested[i]->difference->p_value));
    tested[i]->p_holm = least;
  }
}

}  // namespace

std::string doubt_of(const ComparedQuantity& q) {
  return pooled_doubt(q.only_without, q.not_described[0] + q.not_described[1]);
}

void require_comparable_depths(const RecordingGroup& first, const RecordingGroup& second) {
  const std::vector<double> a = log_depths(first), b = log_depths(second);
  if (a.empty() || b.empty()) return;
  constexpr double kApart = 1.1, kExplained = 0.75;
  const double mean_a = mean_value(a), mean_b = mean_value(b);
  const double within = squares_around(a, mean_a) + squares_around(b, mean_b);
  std::vector<double> all = a;
  all.insert(all.end(), b.begin(), b.end());
  const double total = squares_around(all, mean_value(all));
  const bool apart = std::abs(mean_a - mean_b) > std::log(kApart);
  if (!apart || within > (1.0 - kExplained) * total) return;
  constexpr double kMillimetre = 1e-3;
  throw bad_input(
      fmt::format("groups '{}' and '{}'", printable(first.name), printable(second.name)),
      fmt::format("depth and group are confounded: contact is followed to {} mm in one and {} mm "
                  "in the other (geometric means)",
                  significant(std::exp(mean_a) / kMillimetre, 3),
                  significant(std::exp(mean_b) / kMillimetre, 3)),
      "recordings to the same depths in both groups, or the deeper ones cut (--until) at the depth "
      "that all reach");
}

GroupComparison compare_groups(const RecordingGroup& first, const RecordingGroup& second,
                               const std::optional<LawSpec>& law, const SelectionOptions& options,
                               const std::optional<ContactGeometry>& probe) {
  require_comparable_depths(first, second);
  GroupComparison c;
  c.names = {first.name, second.name};
  c.first = first.recordings.size();
  std::vector<PreparedRecording> all = first.recordings;
  all.insert(all.end(), second.recordings.begin(), second.recordings.end());
  c.study = study_specimens(all, law, options);
  c.study.pooled.clear();  // a typical specimen of both together is nobody
  const auto like =
      std::ranges::find_if(c.study.rows, [](const SpecimenRow& r) { return r.fit.has_value(); });
  if (like == c.study.rows.end()) {
    throw Error(ExitCode::numerical, "fit", "no recording of either group could be fitted");
  }
  const std::span rows(c.study.rows);
  c.parameters = compared_parameters(rows.first(c.first), rows.subspan(c.first), *like, c.names,
                                     c.study.level);
  adjust_by_holm(c.parameters);
  if (probe) c.moduli = compared_moduli(c, *like, *probe);
  return c;
}

}  // namespace tpm::fit
