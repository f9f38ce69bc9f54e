#include "tpm/sweep/sweep_reader.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpmkit/error.hpp"

namespace tpm::sweep {
namespace {

std::string path_of(const std::string& name) {
  return fmt::format("/{}", name);
}

}  // namespace

SweepReader::SweepReader(const std::filesystem::path& file) : file_(file) {
  if (!file_.has_attribute("/", "sweep_fingerprint")) {
    throw bad_input(file.string(), "holds no sweep", "a file that tpm sweep has written");
  }
  title_ = file_.attribute("/", "title");
  document_ = parse_json(file_.attribute("/", "sweep_json"), file.string());
  for (const std::string& name : file_.texts("/sweep/axes")) {
    const std::string path = path_of(name);
    const bool own = file_.has_attribute(path, "parameter");
    axes_.push_back({name, own ? file_.attribute(path, "units") : "", file_.numbers(path), {}});
  }
  for (const std::string& name : file_.texts("/sweep/parameters")) {
    axes_[axis(file_.attribute(path_of(name), "axis"))].parameters.push_back(name);
  }
  const auto add = [this](const std::string& name, bool counts) {
    const std::string path = path_of(name), time = fmt::format("/{}_time_s", name);
    variables_.push_back({name, file_.attribute(path, "units"), file_.attribute(path, "long_name"),
                          file_.has(time) ? file_.numbers(time) : std::vector<double>{}, counts});
  };
  for (const std::string& name : file_.texts("/sweep/variables")) add(name, false);
  for (const std::string& name : file_.texts("/sweep/counted")) add("count_" + name, true);
}

const ReadVariable& SweepReader::variable(const std::string& name) const {
  const auto found = std::ranges::find(variables_, name, &ReadVariable::name);
  if (found != variables_.end()) return *found;
  throw unknown_word("sweep", "no variable", name,
                     mapped<std::string>(variables_, &ReadVariable::name));
}

std::size_t SweepReader::axis(const std::string& name) const {
  const auto found = std::ranges::find_if(axes_, [&](const ReadAxis& a) { return a.name == name; });
  if (found != axes_.end()) return static_cast<std::size_t>(found - axes_.begin());
  throw unknown_word("sweep", "no axis", name, mapped<std::string>(axes_, &ReadAxis::name));
}

AxisKeys SweepReader::said_of(const ReadAxis& of) const {
  const std::size_t number = axis(of.name);
  return axis_kinds().read(document_.at("axes").at(number), {"sweep"});
}

std::uint64_t SweepReader::cells() const {
  std::uint64_t cells = 1;
  for (const ReadAxis& axis : axes_) cells *= axis.places.size();
  return cells;
}

CellTally SweepReader::tally() const {
  CellTally tally;
  each({"status"}, [&](const auto& found) {
    for (const double status : found.front()) {
      tally.done += status == 0.0 ? 1 : 0;
      tally.skipped += status == 1.0 ? 1 : 0;
      tally.failed += status == 2.0 ? 1 : 0;
    }
  });
  const auto texts = file_.texts("/reasons");
  tally.reasons.assign(texts.begin() + 1, texts.end());
  return tally;
}

std::vector<double> SweepReader::parameter(const std::string& name) const {
  return file_.numbers(path_of(name));
}

std::string SweepReader::parameter_unit(const std::string& name) const {
  return file_.attribute(path_of(name), "units");
}

std::string SweepReader::parameter_target(const std::string& name) const {
  return file_.attribute(path_of(name), "parameter");
}

std::vector<std::pair<std::string, std::uint64_t>> SweepReader::models() const {
  std::vector<std::pair<std::string, std::uint64_t>> models;
  if (!file_.has("/models")) return models;
  for (const std::string& name : file_.texts("/models")) models.emplace_back(name, 0);
  each({"model"}, [&](const auto& found) {
    for (const double model : found.front()) {
      const auto place = static_cast<std::size_t>(model);
      if (place < models.size()) ++models[place].second;
    }
  });
  return models;
}

std::string SweepReader::choice_of_models() const {
  return file_.has("/models") ? file_.attribute("/", "choice_of_models") : std::string();
}

std::vector<std::uint64_t> SweepReader::start_at(const FixedPlaces& fixed) const {
  std::vector<std::uint64_t> first(axes_.size(), 0);
  for (const auto& [name, place] : fixed) first[axis(name)] = place;
  return first;
}

std::vector<double> SweepReader::slice(const std::string& name,
                                       const std::optional<std::string>& rows,
                                       const std::string& columns, const FixedPlaces& fixed) const {
  if (!variable(name).times_s.empty()) {
    throw bad_input("sweep", fmt::format("'{}' is a curve in each cell", name), "a number");
  }
  std::vector<std::uint64_t> first = start_at(fixed), counts(axes_.size(), 1);
  const std::size_t column = axis(columns);
  first[column] = 0;
  counts[column] = axes_[column].places.size();
  if (!rows) return file_.part(path_of(name), first, counts);
  const std::size_t row = axis(*rows);
  if (row == column) throw bad_input("sweep", "one axis for both directions", "two axes");
  first[row] = 0;
  counts[row] = axes_[row].places.size();
  std::vector<double> values = file_.part(path_of(name), first, counts);
  if (row < column) return values;
  std::vector<double> turned;  // the file has the axis of the columns outside
  turned.reserve(values.size());
  for (std::uint64_t i = 0; i < counts[row]; ++i) {
    for (std::uint64_t j = 0; j < counts[column]; ++j)
      turned.push_back(values[j * counts[row] + i]);
  }
  return turned;
}

std::vector<double> SweepReader::curve(const std::string& name, const FixedPlaces& fixed) const {
  std::vector<std::uint64_t> first = start_at(fixed), counts(axes_.size(), 1);
  first.push_back(0);
  counts.push_back(variable(name).times_s.size());
  return file_.part(path_of(name), first, counts);
}

void SweepReader::each(
    const std::vector<std::string>& names,
    const std::function<void(const std::vector<std::vector<double>>&)>& see) const {
  constexpr std::uint64_t kMostNumbers = 1'000'000;
  const std::uint64_t rows = axes_.front().places.size(), in_row = cells() / rows;
  const std::uint64_t step = std::max<std::uint64_t>(kMostNumbers / in_row, 1);
  std::vector<std::uint64_t> first(axes_.size(), 0), counts;
  for (const ReadAxis& axis : axes_) counts.push_back(axis.places.size());
  for (first[0] = 0; first[0] < rows; first[0] += step) {
    counts[0] = std::min(step, rows - first[0]);
    std::vector<std::vector<double>> found;
    for (const std::string& name : names) found.push_back(file_.part(path_of(name), first, counts));
    see(found);
  }
}

std::vector<FixedValue> other_places(const SweepReader& sweep, const ReadAxis& along,
                                     const FixedPlaces& fixed) {
  std::vector<FixedValue> others;
  for (const ReadAxis& axis : sweep.axes()) {
    const auto named = std::find_if(fixed.begin(), fixed.end(),
                                    [&](const auto& place) { return place.first == axis.name; });
    if (axis.name != along.name) {
      const std::uint64_t place = named == fixed.end() ? 0 : named->second;
      others.push_back({axis.name, axis.places[place], axis.unit});
    } else if (named != fixed.end()) {
      throw Error(ExitCode::usage, "--at",
                  fmt::format("'{}' is the axis that is looked along", axis.name), "another axis");
    }
  }
  return others;
}

}  // namespace tpm::sweep
