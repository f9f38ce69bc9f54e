#include "tpm/files/import/contact.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

const ImportedColumn* column_of(const ImportedSeries& series, Quantity quantity) {
  const auto found =
      std::find_if(series.columns.begin(), series.columns.end(), [quantity](const auto& column) {
        return column.quantity == quantity && column.bound == Bound::value;
      });
  return found == series.columns.end() ? nullptr : &*found;
}

std::string reading(const ImportedColumn& column, std::size_t row) {
  return fmt::format("{} {} {}", quantity_short_name(column.quantity),
                     significant(column.values[row], 4), column.unit.symbol);
}

/// Leaves out the first `count` samples.
void drop_samples(std::vector<RecordedSegment>& segments, std::size_t count) {
  while (!segments.empty() && count > 0) {
    const std::size_t dropped = std::min(count, segments.front().samples);
    count -= dropped;
    segments.front().samples -= dropped;
    if (segments.front().samples == 0) segments.erase(segments.begin());
  }
}

}  // namespace

void start_at_contact(ImportedSeries& series, const std::string& file,
                      const ImportOptions& options) {
  if (!options.contact_force_N) {
    series.findings.push_back({"contact", "not searched for; time and depth as in the file"});
    return;
  }
  const ImportedColumn* force = column_of(series, Quantity::contact_force);
  if (force == nullptr)
    throw bad_input(file, "has no force to find contact with", "a force column");
  const double threshold = *options.contact_force_N / force->unit.to_si;
  const auto contact = std::search_n(force->values.begin(), force->values.end(),
                                     options.contact_samples, threshold, std::greater_equal<>());
  if (contact == force->values.end()) {
    throw bad_input(file,
                    fmt::format("the force never stays at {} N for {} samples",
                                significant(*options.contact_force_N, 6), options.contact_samples),
                    "a smaller contact force, or --negate-response if compression counts negative");
  }
  const auto row = static_cast<std::size_t>(contact - force->values.begin());
  std::string found = fmt::format("{} {}, {}", series.segments.empty() ? "line" : "sample",
                                  series.lines[row], reading(*force, row));
  for (ImportedColumn& column : series.columns) {
    const double first = column.values[row];
    const bool zeroed =
        column.quantity == Quantity::time || column.quantity == Quantity::indentation_depth;
    if (zeroed) found += ", " + reading(column, row);
    column.values.erase(column.values.begin(),
                        column.values.begin() + static_cast<std::ptrdiff_t>(row));
    if (!zeroed) continue;
    column.shifted = true;
    for (double& value : column.values) value -= first;
  }
  drop_samples(series.segments, row);
  series.lines.erase(series.lines.begin(), series.lines.begin() + static_cast<std::ptrdiff_t>(row));
  series.findings.push_back(
      {"contact",
       fmt::format("{}; counted from there, {} samples before it left out", found, row)});
}

}  // namespace tpm::files
