#include "tpm/sweep/sweep_result.hpp"

#include <fmt/format.h>
#include <tbb/parallel_pipeline.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/delimited.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/sweep/workers.hpp"
#include "tpmkit/error.hpp"

namespace tpm::sweep {
namespace {

namespace fs = std::filesystem;
using Number = Hdf5Writer::Number;

CellBlock block_of(const std::vector<const BlockLog*>& logs, std::uint64_t number) {
  for (const BlockLog* log : logs) {
    if (log->has(number)) return log->read(number);
  }
  throw bad_input(logs.empty() ? "sweep" : logs.front()->path().string(),
                  fmt::format("block {} is missing", number), "all shards of the sweep");
}

/// One table of reasons for all blocks, in the order of the cells.
class ReasonTable {
 public:
  std::vector<std::int32_t> numbers_of(const CellBlock& block) {
    std::vector<std::int32_t> global{0};
    for (const std::string& reason : block.reasons) global.push_back(number_of(reason));
    return mapped<std::int32_t>(block.reason, [&](std::uint16_t local) { return global[local]; });
  }
  [[nodiscard]] const std::vector<std::string>& texts() const { return texts_; }

 private:
  std::int32_t number_of(const std::string& reason) {
    const auto found = numbers_.find(reason);
    if (found != numbers_.end()) return found->second;
    const std::string& text = texts_.size() < kMostReasons ? reason : kAnother;
    const auto [place, added] = numbers_.emplace(text, static_cast<std::int32_t>(texts_.size()));
    if (added) texts_.push_back(text);
    return place->second;
  }

  inline static const std::string kAnother = "another reason";
  std::map<std::string, std::int32_t, std::less<>> numbers_;
  std::vector<std::string> texts_{""};
};

std::string path_to(const std::string& dataset) {
  return fmt::format("/{}", dataset);
}

template <class List>
std::vector<std::string> names_of(const List& list) {
  return mapped<std::string>(list, [](const auto& entry) { return entry.name; });
}

/// Bytes of a result, with some to spare for names.
std::uint64_t room_for(const Sweep& sweep) {
  constexpr std::uint64_t kForNames = std::uint64_t{1} << 20U;
  const std::uint64_t cell = 1 + 1 + 4 + 8 + 8 * (sweep.model->counted().size() + sweep.width());
  std::uint64_t bytes = cell * sweep.cells() + kForNames;
  for (const SweepAxis& axis : sweep.axes) bytes += 8 * axis.size;
  for (const SweptParameter& p : sweep.parameters) bytes += 8 * sweep.axes[p.axis].size;
  return bytes;
}

/// Writes the datasets of a sweep.
class ResultWriter {
 public:
  ResultWriter(const Sweep& sweep, const fs::path& file) : sweep_(sweep), out_(file) {
    out_.reserve(room_for(sweep));
    for (const SweepAxis& axis : sweep.axes) shape_.push_back(axis.size);
    out_.attribute("/", "title", sweep.title);
    out_.attribute("/", "description", sweep.description);
    out_.attribute("/", "sweep_json", sweep.document);
    out_.attribute("/", "sweep_fingerprint", sweep.fingerprint);
    out_.texts("/sweep/axes", names_of(sweep.axes));
    out_.texts("/sweep/parameters", names_of(sweep.parameters));
    out_.texts("/sweep/variables", names_of(sweep.variables));
    out_.texts("/sweep/counted", sweep.model->counted());
    write_axes();
    add_array("status", Number::uint8, "", "0 done, 1 skipped, 2 failed");
    add_array("reason", Number::int32, "", "why not done: a place in reasons");
    add_array("error_estimate", Number::float64, "",
              "of the method, in parts of the largest response");
    if (const auto models = sweep.model->models(); !models.empty()) {
      add_array("model", Number::uint8, "", "that the cell ran on: a place in models; 255: none");
      out_.texts("/models", models);
      out_.dimension_scale("/models");
      out_.attribute("/", "choice_of_models", sweep.model->choice_of_models(sweep.swept()));
    }
    for (const std::string& name : sweep.model->counted()) {
      add_array(fmt::format("count_{}", name), Number::int64, "", "operations");
    }
    for (const SweepVariable& variable : sweep.variables) add_variable(variable);
  }

  /// Writes what does not depend on other blocks; any number of threads at once.
  void store(const CellBlock& block) const {
    const std::uint64_t first = block.number * sweep_.block_cells;
    const auto status = mapped<std::uint8_t>(
        block.status, [](CellStatus s) { return static_cast<std::uint8_t>(s); });
    out_.part("/status", first, std::span<const std::uint8_t>(status));
    out_.part("/error_estimate", first, std::span<const double>(block.error_estimate));
    if (!block.model.empty()) {
      out_.part("/model", first, std::span<const std::uint8_t>(block.model));
    }
    const auto counted = sweep_.model->counted();
    for (std::size_t k = 0; k < counted.size(); ++k) {
      out_.part(fmt::format("/count_{}", counted[k]), first,
                std::span<const std::int64_t>(block.counts[k]));
    }
    for (std::size_t v = 0; v < sweep_.variables.size(); ++v) {
      const SweepVariable& variable = sweep_.variables[v];
      out_.part(path_to(variable.name), first * variable.width(),
                std::span<const double>(block.values[v]));
    }
  }

  /// One block after the other, in the order of the cells: it decides on the numbers of reasons.
  void count(const CellBlock& block) {
    for (const CellStatus s : block.status) {
      tally_.done += s == CellStatus::done ? 1 : 0;
      tally_.skipped += s == CellStatus::skipped ? 1 : 0;
      tally_.failed += s == CellStatus::failed ? 1 : 0;
    }
    const auto reasons = reasons_.numbers_of(block);
    out_.part("/reason", block.number * sweep_.block_cells, std::span<const std::int32_t>(reasons));
  }

  CellTally finish() {
    out_.texts("/reasons", reasons_.texts());
    out_.dimension_scale("/reasons");
    out_.commit();
    tally_.reasons.assign(reasons_.texts().begin() + 1, reasons_.texts().end());
    return tally_;
  }

 private:
  /// The coordinates of the axes, and the parameters that change along them under other names.
  void write_axes() {
    for (std::size_t a = 0; a < sweep_.axes.size(); ++a) {
      const std::string name = path_to(sweep_.axes[a].name);
      out_.array(name, Number::float64, {sweep_.axes[a].size});
      const auto own =
          std::ranges::find(sweep_.parameters, sweep_.axes[a].name, &SweptParameter::name);
      write_along(name, a, own == sweep_.parameters.end() ? nullptr : &*own);
      out_.dimension_scale(name);
    }
    for (const SweptParameter& parameter : sweep_.parameters) {
      const SweepAxis& axis = sweep_.axes[parameter.axis];
      if (parameter.name == axis.name) continue;
      const std::string name = path_to(parameter.name);
      out_.array(name, Number::float64, {axis.size});
      write_along(name, parameter.axis, &parameter);
      out_.attach_scale(name, 0, path_to(axis.name));
    }
  }

  /// A parameter's values along its axis, or the numbers of its places.
  void write_along(const std::string& name, std::size_t axis, const SweptParameter* parameter) {
    constexpr std::uint64_t kStretch = 1U << 16U;
    std::vector<double> values;
    for (std::uint64_t first = 0; first < sweep_.axes[axis].size; first += values.size()) {
      values.clear();
      const std::uint64_t end = std::min(first + kStretch, sweep_.axes[axis].size);
      for (std::uint64_t i = first; i < end; ++i) {
        values.push_back(parameter != nullptr ? parameter->values.at(i) : static_cast<double>(i));
      }
      out_.part(name, first, std::span<const double>(values));
    }
    if (parameter == nullptr) return;
    out_.attribute(name, "units", parameter->unit);
    out_.attribute(name, "parameter", parameter->target);
    out_.attribute(name, "axis", sweep_.axes[axis].name);
  }

  void add_array(const std::string& name, Number kind, const std::string& unit,
                 const std::string& meaning) {
    out_.array(path_to(name), kind, shape_);
    describe(name, unit, meaning);
  }

  void add_variable(const SweepVariable& variable) {
    auto shape = shape_;
    if (!variable.times_s.empty()) shape.push_back(variable.times_s.size());
    out_.array(path_to(variable.name), Number::float64, shape);
    describe(variable.name, variable.unit, variable.meaning);
    if (variable.times_s.empty()) return;
    const std::string time = fmt::format("/{}_time_s", variable.name);
    out_.numbers(time, variable.times_s);
    out_.attribute(time, "units", "s");
    out_.dimension_scale(time);
    out_.attach_scale(path_to(variable.name), static_cast<unsigned>(shape_.size()), time);
  }

  void describe(const std::string& name, const std::string& unit, const std::string& meaning) {
    out_.attribute(path_to(name), "units", unit);
    out_.attribute(path_to(name), "long_name", meaning);
    for (std::size_t a = 0; a < sweep_.axes.size(); ++a) {
      out_.attach_scale(path_to(name), static_cast<unsigned>(a), path_to(sweep_.axes[a].name));
    }
  }

  const Sweep& sweep_;
  Hdf5Writer out_;
  std::vector<std::uint64_t> shape_;
  ReasonTable reasons_;
  CellTally tally_;
};

void write_csv_head(const Sweep& sweep, std::string& text) {
  for (const SweptParameter& p : sweep.parameters) {
    text += fmt::format("{}{}{},", p.name, p.unit.empty() ? "" : " ", p.unit);
  }
  text += "status,reason,error_estimate";
  if (!sweep.model->models().empty()) text += ",model";
  for (const std::string& name : sweep.model->counted()) text += fmt::format(",count_{}", name);
  for (const SweepVariable& v : sweep.variables) {
    const char* space = v.unit.empty() ? "" : " ";
    if (v.times_s.empty()) text += fmt::format(",{}{}{}", v.name, space, v.unit);
    for (const double t : v.times_s) {
      text += fmt::format(",{}({} s){}{}", v.name, shortest(t), space, v.unit);
    }
  }
  text += '\n';
}

std::string csv_number(double value) {
  return std::isnan(value) ? "" : shortest(value);
}

void write_csv_row(const Sweep& sweep, const CellBlock& block, std::size_t cell,
                   std::string& text) {
  const auto out = std::back_inserter(text);
  const auto places = sweep.places(block.number * sweep.block_cells + cell);
  for (const SweptParameter& p : sweep.parameters) {
    fmt::format_to(out, "{},", shortest(p.values.at(places[p.axis])));
  }
  constexpr std::array<std::string_view, 3> kWords{"done", "skipped", "failed"};
  const std::uint16_t reason = block.reason[cell];
  fmt::format_to(out, "{},{},{}", kWords[static_cast<std::size_t>(block.status[cell])],
                 reason == 0 ? std::string() : quoted_field(block.reasons[reason - 1U]),
                 csv_number(block.error_estimate[cell]));
  if (!block.model.empty()) {
    const auto models = sweep.model->models();
    fmt::format_to(out, ",{}", block.model[cell] < models.size() ? models[block.model[cell]] : "");
  }
  for (const auto& counts : block.counts) fmt::format_to(out, ",{}", counts[cell]);
  for (std::size_t v = 0; v < block.values.size(); ++v) {
    const std::size_t width = sweep.variables[v].width();
    for (std::size_t i = 0; i < width; ++i) {
      fmt::format_to(out, ",{}", csv_number(block.values[v][cell * width + i]));
    }
  }
  text += '\n';
}

}  // namespace

CellTally write_sweep(const Sweep& sweep, const std::vector<const BlockLog*>& logs,
                      const fs::path& file, int workers) {
  ResultWriter writer(sweep, file);
  FirstFault fault;
  std::uint64_t next = 0;
  const auto number = tbb::make_filter<void, std::uint64_t>(
      tbb::filter_mode::serial_in_order, [&](tbb::flow_control& flow) -> std::uint64_t {
        if (next == sweep.blocks() || fault.seen()) {
          flow.stop();
          return 0;
        }
        return next++;
      });
  const auto store =
      tbb::make_filter<std::uint64_t, CellBlock>(tbb::filter_mode::parallel, [&](std::uint64_t b) {
        CellBlock block;
        fault.guard([&] {
          block = block_of(logs, b);
          writer.store(block);
        });
        return block;
      });
  const auto count = tbb::make_filter<CellBlock, void>(tbb::filter_mode::serial_in_order,
                                                       [&](const CellBlock& block) {
                                                         if (!fault.seen()) writer.count(block);
                                                       });
  const int threads = worker_count(workers);
  CellTally tally;
  on_workers(threads, [&] {
    tbb::parallel_pipeline(2 * static_cast<std::size_t>(threads), number & store & count);
    if (!fault.seen()) tally = writer.finish();
  });
  fault.rethrow();
  return tally;
}

bool write_sweep_csv(const Sweep& sweep, const std::vector<const BlockLog*>& logs,
                     const fs::path& file) {
  const std::uint64_t columns = sweep.parameters.size() + 3 + sweep.model->counted().size() +
                                static_cast<std::uint64_t>(sweep.width());
  if (sweep.cells() > kMostCsvNumbers / columns) return false;
  std::string text;
  write_csv_head(sweep, text);
  for (std::uint64_t b = 0; b < sweep.blocks(); ++b) {
    const CellBlock block = block_of(logs, b);
    for (std::size_t cell = 0; cell < block.cells(); ++cell) {
      write_csv_row(sweep, block, cell, text);
    }
  }
  write_file(file, text);
  return true;
}

std::string fingerprint_of(const fs::path& file) {
  std::error_code ec;
  if (!fs::is_regular_file(file, ec)) return {};
  try {
    const Hdf5Reader reader(file);
    if (!reader.has_attribute("/", "sweep_fingerprint")) return {};
    return reader.attribute("/", "sweep_fingerprint");
  } catch (const Error&) {
    return {};  // damaged, or something else: it is written anew
  }
}

}  // namespace tpm::sweep
