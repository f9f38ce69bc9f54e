#include "tpm/files/import/cantilever.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

bool is_height(const MachineColumn& column) {
  return column.meaning && column.meaning->role == ColumnRole::height;
}

/// The position of a stage beside forces of nN is that of a cantilever's base.
bool is_travel(const MachineColumn& column) {
  constexpr int kTravel = 2;  // rank of what is farther from the specimen than a displacement
  return column.meaning && column.meaning->role == ColumnRole::drive &&
         column.meaning->rank >= kTravel;
}

/// The columns of an AFM among those of a series.
struct CantileverSeries {
  std::optional<std::size_t> height, deflection, force;
};

CantileverSeries cantilever_series(const ImportedSeries& series,
                                   const std::vector<CantileverColumn>& columns) {
  constexpr double kSmallForce_N = 1e-9;  // the unit of an AFM
  const bool small =
      std::any_of(series.columns.begin(), series.columns.end(), [](const ImportedColumn& column) {
        return column.quantity == Quantity::contact_force && column.unit.to_si <= kSmallForce_N &&
               column.unit.dimension == Dimension::force;
      });
  CantileverSeries found;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const ImportedColumn& column = series.columns[i];
    if (column.bound != Bound::value) continue;
    const MachineColumn& from = *columns[i].column;
    const bool depth = column.quantity == Quantity::indentation_depth;
    if (depth && (is_height(from) || (small && is_travel(from)))) found.height = i;
    if (column.quantity != Quantity::contact_force) continue;
    (is_deflection(*columns[i].column) ? found.deflection : found.force) = i;
  }
  return found;
}

void require_rising_height(const ImportedSeries& series, std::size_t height, std::size_t force,
                           const MachineColumn& column, const std::string& file) {
  const std::vector<double>& load = series.columns[force].values;
  const std::vector<double>& travel = series.columns[height].values;
  const auto peak =
      static_cast<std::size_t>(std::max_element(load.begin(), load.end()) - load.begin());
  if (travel[peak] >= travel.front()) return;
  throw bad_input(fmt::format("{}: {}", file, column.label()),
                  "the height falls where the force or deflection rises",
                  "--negate-drive if it counts away from the specimen, or --negate-response");
}

void refuse_unused_options(const CantileverSeries& found, bool volts, const std::string& file,
                           const ImportOptions& options) {
  if (options.spring_constant_N_per_m && !found.height && !found.deflection) {
    throw bad_input(file, "no column is recognised as the height of a piezo or a deflection",
                    "--spring-constant only with such a column, or a JPK force file");
  }
  if (options.deflection_sensitivity_m_per_V && !volts) {
    throw bad_input(file, "no deflection in V or mV",
                    "--deflection-sensitivity only with such a column");
  }
}

}  // namespace

bool is_deflection(const MachineColumn& column) {
  return column.meaning && column.meaning->role == ColumnRole::deflection;
}

void resolve_cantilever(ImportedSeries& series, const std::vector<CantileverColumn>& columns,
                        const std::string& file, const ImportOptions& options) {
  const CantileverSeries found = cantilever_series(series, columns);
  const bool volts = std::any_of(columns.begin(), columns.end(),
                                 [](const CantileverColumn& column) { return column.volts; });
  refuse_unused_options(found, volts, file, options);
  if (!found.height && !found.deflection) return;
  if (!options.spring_constant_N_per_m) {
    if (found.deflection) {
      throw bad_input(fmt::format("{}: {}", file, columns[*found.deflection].column->label()),
                      "a deflection without the spring constant of its cantilever",
                      "--spring-constant, such as --spring-constant \"0.05 N/m\"");
    }
    if (!found.force) return;
    series.findings.push_back(ImportFinding::told_of(
        "warning",
        fmt::format("{} is the travel of the cantilever's base, not the depth: the deflection is "
                    "still in it (--spring-constant \"0.05 N/m\" takes force/k away)",
                    columns[*found.height].column->label())));
    return;
  }
  const double stiffness = *options.spring_constant_N_per_m;
  double length_m = 1.0;  // of what the deflection counts
  if (volts) {
    if (!options.deflection_sensitivity_m_per_V) {
      throw bad_input(fmt::format("{}: {}", file, columns[*found.deflection].column->label()),
                      "a deflection in V without its sensitivity",
                      "--deflection-sensitivity, such as --deflection-sensitivity \"50 nm/V\"");
    }
    length_m = *options.deflection_sensitivity_m_per_V;
  }
  const std::size_t answer = found.deflection ? *found.deflection : found.force.value();
  ImportedColumn& force = series.columns[answer];
  if (found.deflection) {
    for (double& value : force.values) value *= stiffness * length_m * force.unit.to_si;
    force.unit = parse_unit("N", Dimension::force, file);
    force.shifted = true;  // converted: not the digits of the file
  }
  std::string words =
      fmt::format("k = {} N/m", significant(stiffness, 6)) +
      (volts ? fmt::format(", sensitivity {} nm/V", significant(1e9 * length_m, 6)) : "");
  if (found.height) {
    require_rising_height(series, *found.height, answer, *columns[*found.height].column, file);
    ImportedColumn& depth = series.columns[*found.height];
    const double to_height = force.unit.to_si / stiffness / depth.unit.to_si;
    for (std::size_t i = 0; i < depth.values.size(); ++i) {
      depth.values[i] -= to_height * force.values[i];
    }
    depth.shifted = true;
    words += "; depth = height - deflection";
  }
  series.findings.push_back(ImportFinding::told_of("converted", words));
}

}  // namespace tpm::files
