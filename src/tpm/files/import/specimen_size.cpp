#include "tpm/files/import/specimen_size.hpp"

#include <fmt/format.h>

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
    series.findings.push_back(ImportFinding::told_of(
        "converted",
        fmt::format("{} to {} by a {} of {} {}", column.unit.symbol, quantity_name(column.quantity),
                    length ? "length at rest" : "cross section",
                    significant(length ? 1e3 * size : 1e6 * size, 6), length ? "mm" : "mm^2")));
    column.unit = parse_unit(si_symbol(wanted), wanted, {});
    column.shifted = true;  // converted: not the digits of the file
  }
}

}  // namespace tpm::files
