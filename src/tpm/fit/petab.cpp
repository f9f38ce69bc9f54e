#include "tpm/fit/petab.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <map>
#include <string_view>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/delimited.hpp"
#include "tpm/fit/likelihood/fit_keys.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

namespace fs = std::filesystem;
using Names = std::initializer_list<std::string_view>;

/// A row of a table, asked by column names.
class Row {
 public:
  Row(const std::string& file, const DelimitedRow& header, const DelimitedRow& row)
      : line_(row.line), file_(&file) {
    for (std::size_t i = 0; i < header.fields.size(); ++i) {
      fields_.emplace(header.fields[i], row.fields[i]);
    }
  }

  /// Empty if the column is missing or the field is.
  [[nodiscard]] std::string text(std::string_view column) const {
    const auto found = fields_.find(column);
    return found == fields_.end() ? std::string{} : found->second;
  }
  [[nodiscard]] std::string required(std::string_view column) const {
    std::string value = text(column);
    if (value.empty()) throw bad_input(where(column), "is empty", "a value");
    return value;
  }
  [[nodiscard]] double number(std::string_view column) const {
    return parse_number(required(column), where(column));
  }
  [[nodiscard]] std::string where(std::string_view column) const {
    return fmt::format("{}:{}: column '{}'", *file_, line_, column);
  }
  [[nodiscard]] int line() const { return line_; }

 private:
  int line_;
  const std::string* file_;
  std::map<std::string, std::string, std::less<>> fields_;
};

struct Table {
  std::string file;
  std::vector<Row> rows;
};

/// Reads a table, a header and rows. Columns other than the named ones are refused, but for those
/// of PEtab that only name things.
Table read_table(const fs::path& path, Names needed, Names optional) {
  Table table{path.string(), {}};
  const DelimitedTable raw = read_delimited(path);
  const DelimitedRow& header = raw.rows.front();
  const auto holds = [](Names names, std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  for (const std::string_view name : header.fields) {
    const Names labels{"observableName", "conditionName", "parameterName", "datasetId",
                       "replicateId"};
    if (holds(needed, name) || holds(optional, name) || holds(labels, name)) continue;
    throw bad_input(fmt::format("{}:{}: column '{}'", table.file, header.line, printable(name)),
                    "is not supported",
                    fmt::format("{}, {}", fmt::join(needed, ", "), fmt::join(optional, ", ")));
  }
  for (const std::string_view name : needed) {
    if (std::find(header.fields.begin(), header.fields.end(), name) != header.fields.end()) {
      continue;
    }
    throw bad_input(fmt::format("{}:{}", table.file, header.line),
                    fmt::format("no column '{}'", name),
                    fmt::format("{}", fmt::join(needed, ", ")));
  }
  for (std::size_t i = 1; i < raw.rows.size(); ++i) {
    table.rows.emplace_back(table.file, header, raw.rows[i]);
  }
  return table;
}

/// The rows by their id. Throws for an id that stands twice.
std::map<std::string, const Row*> by_id(const Table& table, std::string_view column) {
  std::map<std::string, const Row*> rows;
  for (const Row& row : table.rows) {
    const std::string id = row.required(column);
    if (rows.emplace(id, &row).second) continue;
    throw bad_input(row.where(column), fmt::format("'{}' stands twice", printable(id)),
                    "each id once");
  }
  return rows;
}

const Row& find_row(const std::map<std::string, const Row*>& rows, const Row& asking,
                    std::string_view column) {
  const std::string id = asking.required(column);
  const auto found = rows.find(id);
  if (found != rows.end()) return *found->second;
  const auto ids = mapped<std::string>(rows, [](const auto& row) { return row.first; });
  throw bad_input(asking.where(column),
                  fmt::format("'{}' is unknown{}", printable(id), did_you_mean(id, ids)),
                  "an id of the table of conditions or observables");
}

std::string scale_of(const Row& row) {
  std::string scale = row.required("parameterScale");
  if (scale == "lin") return "linear";
  if (scale == "log10" || scale == "log") return "log";  // one search: they differ by a factor
  if (scale == "inverse_square") return scale;
  throw bad_input(row.where("parameterScale"), fmt::format("'{}'", printable(scale)),
                  "lin, log, log10 or inverse_square");
}

/// The table of parameters as /parameters and /fixed of a configuration.
void add_parameters(const Table& table, Json& document) {
  document["parameters"] = Json::object();
  Json fixed = Json::object();
  static_cast<void>(by_id(table, "parameterId"));  // each id once
  for (const Row& row : table.rows) {
    const std::string id = row.required("parameterId");
    const auto quantity = [&row](std::string_view column) {
      static_cast<void>(row.number(column));  // a bad number is told with its line
      const std::string unit = row.text("unit");
      return row.required(column) + (unit.empty() ? "" : " " + unit);
    };
    Json targets = Json::array();
    const std::string sets = row.text("sets");
    for (std::size_t at = 0; at < sets.size();) {
      const std::size_t end = std::min(sets.find(' ', at), sets.size());
      if (end > at) targets.push_back(sets.substr(at, end - at));
      at = end + 1;
    }
    const std::string estimate = row.required("estimate");
    if (estimate == "1") {
      Json j{{"start", quantity("nominalValue")}, {"lower", quantity("lowerBound")}};
      j["upper"] = quantity("upperBound");
      j["scale"] = scale_of(row);
      if (!targets.empty()) j["sets"] = std::move(targets);
      document["parameters"][id] = std::move(j);
    } else if (estimate == "0") {
      if (targets.empty()) targets.push_back(id);
      for (const auto& target : targets) {
        fixed[target.get<std::string>()] = quantity("nominalValue");
      }
    } else {
      throw bad_input(row.where("estimate"), fmt::format("'{}'", printable(estimate)), "0 or 1");
    }
  }
  if (!fixed.empty()) document["fixed"] = std::move(fixed);
}

Observable observable_of(const Row& row) {
  const std::string formula = row.required("observableFormula");
  if (formula == "contact_force") return Observable::contact_force;
  if (formula == "indentation_depth") return Observable::indentation_depth;
  throw bad_input(row.where("observableFormula"), fmt::format("'{}'", printable(formula)),
                  "contact_force or indentation_depth: formulas are not supported");
}

/// The noise of an observable: a number, "b * observable", noiseParameter1_ID or a parameter's id.
Json noise_of(const Row& row, const std::string& id, const Json& parameters) {
  const std::string formula = row.required("noiseFormula");
  const std::string distribution = row.text("noiseDistribution");
  const bool log = distribution.starts_with("log-");
  Json noise = Json::object();
  if (distribution == "laplace" || distribution == "log-laplace") {
    noise["distribution"] = "laplace";
  } else if (!distribution.empty() && distribution != "normal" && distribution != "log-normal") {
    throw bad_input(row.where("noiseDistribution"), fmt::format("'{}'", printable(distribution)),
                    "normal, log-normal, laplace or log-laplace");
  }
  const bool estimated = parameters.contains(formula);
  const std::string product = " * " + row.required("observableFormula");
  if (log) {
    noise["kind"] = "log";
    noise["relative"] = estimated ? Json("estimated " + formula)
                                  : Json(parse_number(formula, row.where("noiseFormula")));
  } else if (estimated) {
    noise["kind"] = "absolute";
    noise["absolute"] = "estimated " + formula;
  } else if (formula == "noiseParameter1_" + id) {
    noise["kind"] = "per_row";
  } else if (formula.ends_with(product)) {
    const std::string factor = formula.substr(0, formula.size() - product.size());
    noise["kind"] = "relative_to_model";
    noise["relative"] = parse_number(factor, row.where("noiseFormula"));
  } else {
    static_cast<void>(parse_number(formula, row.where("noiseFormula")));
    noise["kind"] = "absolute";
    noise["absolute"] = formula + " " + row.required("unit");
  }
  return noise;
}

Json protocol_of(const Row& condition) {
  Json protocol{{"kind", condition.required("protocol")}};
  const std::string rate = condition.text("rate");
  if (!rate.empty()) protocol["rate"] = rate;
  const std::string provenance = condition.text("rateProvenance");
  if (!provenance.empty()) protocol["rate_provenance"] = provenance;
  return protocol;
}

Datum datum_of(const Row& measurement, const Row& condition, const Row& observable) {
  Datum d;
  const Dimension dimension = quantity_dimension(observable_quantity(observable_of(observable)));
  const Unit unit = parse_unit(observable.required("unit"), dimension, observable.where("unit"));
  const std::string depth = condition.text("depth");
  const std::string load = condition.text("load");
  if (!depth.empty()) {
    d.depth_m = parse_quantity(depth, Dimension::length, condition.where("depth"));
  }
  if (!load.empty()) d.load_N = parse_quantity(load, Dimension::force, condition.where("load"));
  // PEtab's infinite time is the steady state, which the protocol 'static' asks for.
  if (measurement.required("time") != "inf") d.time_s = measurement.number("time");
  d.value = measurement.number("measurement") * unit.to_si;
  if (!measurement.text("noiseParameters").empty()) {
    d.sd = measurement.number("noiseParameters") * unit.to_si;
  }
  d.label = measurement.text("label");
  const std::string provenance = measurement.text("provenance");
  d.provenance = provenance.empty() ? Provenance::measured
                                    : parse_provenance(provenance, measurement.where("provenance"));
  d.line = measurement.line();
  return d;
}

/// The measurements as data sets: one for each observable and way of imposing.
void add_measurements(const Table& measurements, const Table& conditions, const Table& observables,
                      Json& document, std::vector<DataSet>& data) {
  const auto condition_rows = by_id(conditions, "conditionId");
  const auto observable_rows = by_id(observables, "observableId");
  std::vector<std::string> groups;
  document["data"] = Json::array();
  for (const Row& row : measurements.rows) {
    const Row& condition = find_row(condition_rows, row, "simulationConditionId");
    const Row& observable = find_row(observable_rows, row, "observableId");
    const std::string id = row.required("observableId");
    const Json protocol = protocol_of(condition);
    const std::string group = id + protocol.dump();
    const auto known = std::find(groups.begin(), groups.end(), group);
    const auto place = static_cast<std::size_t>(known - groups.begin());
    if (known == groups.end()) {
      // A way of imposing more than the first is told apart by its number.
      const auto same = std::ranges::count_if(
          groups, [&](const std::string& g) { return g.starts_with(id + "{"); });
      groups.push_back(group);
      PointSet points;
      points.header.id = same == 0 ? id : fmt::format("{} {}", id, same + 1);
      points.observable = observable_of(observable);
      document["data"].push_back({{"dataset", points.header.id},
                                  {"protocol", protocol},
                                  {"noise", noise_of(observable, id, document["parameters"])}});
      data.emplace_back(std::move(points));
    }
    std::get<PointSet>(data[place]).data.push_back(datum_of(row, condition, observable));
  }
}

FitProblem parse_fit_tables(Json document, const fs::path& path) {
  const TableFiles files = take_table_files(document, path.string());
  const auto table = [&](const std::string& file, Names needed, Names optional) {
    return read_table(path.parent_path() / file, needed, optional);
  };
  add_parameters(table(files.parameters,
                       {"parameterId", "parameterScale", "lowerBound", "upperBound", "nominalValue",
                        "estimate"},
                       {"unit", "sets"}),
                 document);
  const Table observables =
      table(files.observables, {"observableId", "observableFormula", "noiseFormula", "unit"},
            {"noiseDistribution"});
  const Table conditions = table(files.conditions, {"conditionId", "protocol"},
                                 {"depth", "load", "rate", "rateProvenance"});
  const Table measurements =
      table(files.measurements, {"observableId", "simulationConditionId", "time", "measurement"},
            {"noiseParameters", "label", "provenance"});
  FitProblem result;
  add_measurements(measurements, conditions, observables, document, result.data);
  result.config = parse_fit_config(document, path.string(), path.parent_path());
  return result;
}

}  // namespace

FitProblem read_fit_problem(const fs::path& path) {
  const Json document = read_json(path);
  if (has_table_files(document)) return parse_fit_tables(document, path);
  FitProblem problem;
  problem.config = parse_fit_config(document, path.string(), path.parent_path());
  return problem;
}

FitResult run_fit(const FitProblem& problem) {
  if (problem.data.empty()) return run_fit(problem.config);
  return run_fit(problem.config, problem.data);
}

}  // namespace tpm::fit
