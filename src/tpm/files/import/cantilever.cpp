#include "tpm/files/import/cantilever.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>

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

constexpr double kSmallForce_N = 1e-9;  // the unit of an AFM

bool is_small_force(const Unit& unit) {
  return unit.dimension == Dimension::force && unit.to_si <= kSmallForce_N;
}

/// The columns of an AFM among those of a series.
struct CantileverSeries {
  std::optional<std::size_t> height, deflection, force;
};

CantileverSeries cantilever_series(const ImportedSeries& series,
                                   const std::vector<CantileverColumn>& columns) {
  const bool small =
      std::any_of(series.columns.begin(), series.columns.end(), [](const ImportedColumn& column) {
        return column.quantity == Quantity::contact_force && is_small_force(column.unit);
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

/// The stiffness, in the units of the columns, by which a force is proportional to a deflection, up
/// to their zeros: what the straight line of least squares leaves is rounding, or noise that
/// differs between neighbours as much as over the recording. None where it is no positive one.
std::optional<double> constant_stiffness(const std::vector<double>& deflection,
                                         const std::vector<double>& force) {
  constexpr std::size_t kFewest = 3;
  constexpr std::size_t kNoisy = 20;  // fewer samples do not tell noise from a curve
  constexpr double kRounding = 1e-3;  // of the force's range: three digits
  constexpr double kWhite = 2.0;      // of white noise the ratio below is 1
  constexpr double kSure = 5.0;       // standard errors of the stiffness
  const std::size_t n = force.size();
  if (n < kFewest) return std::nullopt;
  const auto mean = [n](const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(n);
  };
  const double mean_deflection = mean(deflection), mean_force = mean(force);
  double spread = 0.0, product = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    spread += std::pow(deflection[i] - mean_deflection, 2);
    product += (deflection[i] - mean_deflection) * (force[i] - mean_force);
  }
  const double stiffness = product / spread;
  if (!(stiffness > 0.0)) return std::nullopt;
  const auto left = [&](std::size_t i) {
    return force[i] - mean_force - stiffness * (deflection[i] - mean_deflection);
  };
  double squares = 0.0, differences = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    squares += std::pow(left(i), 2);
    if (i > 0) differences += std::pow(left(i) - left(i - 1), 2);
  }
  const auto count = static_cast<double>(n);
  const double rms = std::sqrt(squares / count);
  const double noise = std::sqrt(0.5 * differences / (count - 1.0));
  const auto [low, high] = std::minmax_element(force.begin(), force.end());
  const double least = kRounding * (*high - *low);
  const double allowed = n < kNoisy ? least : std::max(least, kWhite * noise);
  const bool sure = stiffness * std::sqrt(spread) > kSure * rms;
  if (!sure || rms > allowed) return std::nullopt;
  return stiffness;
}

/// Makes a height the depth of the tip by the deflection that stands beside it, the last column.
void take_deflection_away(ImportedSeries& series, const CantileverSeries& found,
                          const std::vector<CantileverColumn>& columns, const std::string& file) {
  constexpr double kLeast = 0.01;  // of the height's rise: less is no depth
  const MachineColumn& from = *columns.back().column;
  const MachineColumn& travel = *columns[*found.height].column;
  const ImportedColumn bending = std::move(series.columns.back());
  series.columns.pop_back();
  const ImportedColumn& force = series.columns[*found.force];
  ImportedColumn& depth = series.columns[*found.height];
  require_rising_height(series, *found.height, *found.force, travel, file);
  const auto stiffness = constant_stiffness(bending.values, force.values);
  const auto peak = static_cast<std::size_t>(
      std::max_element(force.values.begin(), force.values.end()) - force.values.begin());
  const double rise = depth.values[peak] - depth.values.front();
  const double to_height = bending.unit.to_si / depth.unit.to_si;
  for (std::size_t i = 0; i < depth.values.size(); ++i) {
    depth.values[i] -= to_height * bending.values[i];
  }
  depth.shifted = true;
  const double rise_after = depth.values[peak] - depth.values.front();
  const bool deeper = rise_after > kLeast * rise;
  if (!stiffness || !deeper) {
    throw bad_input(
        fmt::format("{}: {}", file, from.label()),
        stiffness ? "grows as much as the height or more: height - deflection is no depth"
                  : "the force is not proportional to it by one positive stiffness: height - "
                    "deflection may be no depth",
        fmt::format("--drive {} to take the height as the depth, or --spring-constant, such as "
                    "--spring-constant \"0.05 N/m\", which takes force/k away",
                    travel.index + 1));
  }
  series.findings.push_back(ImportFinding::told_of(
      "converted",
      fmt::format("depth = {} - {}, to which the force is proportional: {} N/m", travel.label(),
                  from.label(),
                  significant(*stiffness * force.unit.to_si / bending.unit.to_si, 3))));
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

const MachineColumn* find_deflection_beside(const std::vector<MachineColumn>& columns,
                                            const std::vector<ColumnUse>& uses,
                                            const ImportOptions& options) {
  if (options.spring_constant_N_per_m || !options.drive_column.empty()) return nullptr;
  const auto use_of = [&uses](Quantity quantity) -> const MachineColumn* {
    const auto found = std::ranges::find_if(uses, [quantity](const ColumnUse& use) {
      return use.quantity == quantity && use.bound == Bound::value && !use.dimension;
    });
    return found == uses.end() ? nullptr : found->column;
  };
  const MachineColumn* travel = use_of(Quantity::indentation_depth);
  const MachineColumn* force = use_of(Quantity::contact_force);
  if (travel == nullptr || force == nullptr || !is_unit(force->unit)) return nullptr;
  const bool small = is_small_force(parse_unit(force->unit, {}));
  if (!is_height(*travel) && !(small && is_travel(*travel))) return nullptr;
  const MachineColumn* lone = nullptr;
  for (const MachineColumn& column : columns) {
    const bool length = is_unit(column.unit) && column.unit_readings.empty() &&
                        parse_unit(column.unit, {}).dimension == Dimension::length;
    if (!is_deflection(column) || !length) continue;
    if (lone != nullptr) return nullptr;
    lone = &column;
  }
  return lone;
}

void resolve_cantilever(ImportedSeries& series, const std::vector<CantileverColumn>& columns,
                        const std::string& file, const ImportOptions& options) {
  const CantileverSeries found = cantilever_series(series, columns);
  const bool volts = std::any_of(columns.begin(), columns.end(),
                                 [](const CantileverColumn& column) { return column.volts; });
  refuse_unused_options(found, volts, file, options);
  if (!found.height && !found.deflection) return;
  const bool beside = std::ranges::any_of(columns, &CantileverColumn::taken_away);
  if (beside) {
    take_deflection_away(series, found, columns, file);
    return;
  }
  if (!options.spring_constant_N_per_m) {
    constexpr std::string_view kSensitivity =
        ", and --deflection-sensitivity, such as --deflection-sensitivity \"50 nm/V\"";
    const bool without_sensitivity = volts && !options.deflection_sensitivity_m_per_V;
    if (found.deflection) {
      throw bad_input(fmt::format("{}: {}", file, columns[*found.deflection].column->label()),
                      "a deflection without the spring constant of its cantilever",
                      fmt::format("--spring-constant, such as --spring-constant \"0.05 N/m\"{}",
                                  without_sensitivity ? std::string(kSensitivity) : ""));
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
