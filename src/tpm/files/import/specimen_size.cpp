#include "tpm/files/import/specimen_size.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"

namespace tpm::files {

void divide_by_size(ImportedSeries& series, const ImportOptions& options) {
  for (ImportedColumn& column : series.columns) {
    const Dimension wanted = quantity_dimension(column.quantity);
    if (column.unit.dimension == wanted) continue;
    const bool length = column.unit.dimension == Dimension::length;
    if (!length && column.unit.dimension != Dimension::force) continue;
    const double size = length ? options.rest_length_m.value() : options.area_m2.value();
    for (double& value : column.values) value *= column.unit.to_si / size;
    series.findings.push_back(
        {"converted",
         fmt::format("{} to {} by a {} of {} {}", column.unit.symbol,
                     quantity_name(column.quantity), length ? "length at rest" : "cross section",
                     significant(length ? 1e3 * size : 1e6 * size, 6), length ? "mm" : "mm^2")});
    column.unit = parse_unit(si_symbol(wanted), wanted, {});
    column.shifted = true;  // converted: not the digits of the file
  }
}

void resolve_kept_step(ImportedSeries& series) {
  constexpr double kKept = 0.02;  // of its mean, from the smallest to the largest
  const auto column = [&](Quantity quantity) {
    return std::find_if(series.columns.begin(), series.columns.end(), [&](const auto& c) {
      return c.quantity == quantity && c.bound == Bound::value;
    });
  };
  const auto time = column(Quantity::time);
  const auto strain = column(Quantity::strain);
  const auto stress = column(Quantity::stress);
  const auto end = series.columns.end();
  const bool sd =
      std::any_of(series.columns.begin(), end, [](const auto& c) { return c.bound == Bound::sd; });
  if (time == end || strain == end || stress == end || sd || time->values.front() < 0.0) return;
  const auto kept = [](const std::vector<double>& values) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    return *low * *high > 0.0 && *high - *low <= kKept * std::abs(0.5 * (*low + *high));
  };
  const bool relaxation = kept(strain->values);
  if (!relaxation && !kept(stress->values)) return;
  ImportedColumn& answer = relaxation ? *stress : *strain;
  const ImportedColumn& step = relaxation ? *strain : *stress;
  for (std::size_t i = 0; i < answer.values.size(); ++i) {
    answer.values[i] *= answer.unit.to_si / (step.values[i] * step.unit.to_si);
  }
  answer.quantity = relaxation ? Quantity::relaxation_modulus : Quantity::creep_compliance;
  const Dimension dimension = quantity_dimension(answer.quantity);
  answer.unit = parse_unit(si_symbol(dimension), dimension, {});
  answer.shifted = true;
  series.findings.push_back(
      {"converted", relaxation ? "stress over the strain that is kept, to a relaxation modulus; "
                                 "the times count from the step"
                               : "strain over the stress that is kept, to a creep compliance; the "
                                 "times count from the step"});
  series.columns.erase(relaxation ? strain : stress);
}

}  // namespace tpm::files
