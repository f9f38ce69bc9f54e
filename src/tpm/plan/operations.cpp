#include "tpm/plan/operations.hpp"

#include <cmath>
#include <cstdlib>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/document_place.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/version.hpp"

namespace tpm::plan {
namespace {

constexpr const char* kSeconds = "seconds_per_operation";

}  // namespace

const std::array<OperationEntry, kOperations>& operation_table() {
  // Round figures, estimated, not measured: for a choice that repeats where nothing was
  // calibrated.
  static constexpr std::array<OperationEntry, kOperations> kTable{{
      {Operation::scalar_step, "scalar_step", 5e-9},
      {Operation::scalar_term, "scalar_term", 3e-9},
      {Operation::dense_flop, "dense_flop", 0.3e-9},
      {Operation::lane_bond, "lane_bond", 20e-9},
      {Operation::lane_block, "lane_block", 8e-9},
      {Operation::bond_force, "bond_force", 5e-9},
      {Operation::bond_stiffness, "bond_stiffness", 15e-9},
      {Operation::factor_product, "factor_product", 8e-9},
      {Operation::solve_block, "solve_block", 3e-9},
      {Operation::contact_step, "contact_step", 300e-9},
      {Operation::servo_bond, "servo_bond", 5e-9},
      {Operation::servo_block, "servo_block", 2e-9},
      {Operation::panel_product, "panel_product", 0.2e-9},
      {Operation::condensed_step, "condensed_step", 1.5e-6},
  }};
  return kTable;
}

double OperationCosts::seconds_of(const OperationCount& count) const {
  double sum = 0.0;
  for (const OperationEntry& entry : operation_table()) {
    sum += count[entry.meaning] * seconds[static_cast<std::size_t>(entry.meaning)];
  }
  return sum;
}

OperationCosts nominal_costs() {
  OperationCosts costs{{}, "nominal"};
  for (const OperationEntry& entry : operation_table()) {
    costs.seconds[static_cast<std::size_t>(entry.meaning)] = entry.nominal_s;
  }
  return costs;
}

std::filesystem::path usual_costs_file() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe)
    return std::filesystem::path(value == nullptr ? "" : value);
  };
  const std::filesystem::path cache = variable("XDG_CACHE_HOME");
  if (!cache.empty()) return cache / "tpmkit" / "operations.json";
  const std::filesystem::path home = variable("HOME");
  return home.empty() ? home : home / ".cache" / "tpmkit" / "operations.json";
}

void write_costs(const OperationCosts& costs, const std::filesystem::path& file) {
  Json json{{"written_by", "tpm " + std::string(version())}, {kSeconds, Json::object()}};
  for (const OperationEntry& entry : operation_table()) {
    json[kSeconds][std::string(entry.text)] =
        costs.seconds[static_cast<std::size_t>(entry.meaning)];
  }
  write_file(file, to_text(json));
}

OperationCosts read_costs(const std::filesystem::path& file) {
  const Json json = read_json(file);
  const DocumentPlace place = DocumentPlace{file.string()}.key(kSeconds);
  const bool has = json.is_object() && json.contains(kSeconds) && json.at(kSeconds).is_object();
  if (!has) throw bad_input(place.where, "is missing", "a file that tpm plan --calibrate wrote");
  OperationCosts costs{{}, file.string()};
  for (const OperationEntry& entry : operation_table()) {
    const std::string key(entry.text);
    const Json& block = json.at(kSeconds);
    const bool number = block.contains(key) && block.at(key).is_number();
    const double value = number ? block.at(key).get<double>() : 0.0;
    if (!(value > 0.0 && value < 1.0)) {
      throw bad_input(place.key(key).where, number ? shortest(value) : "is missing",
                      "the seconds that one operation takes, above 0");
    }
    costs.seconds[static_cast<std::size_t>(entry.meaning)] = value;
  }
  return costs;
}

}  // namespace tpm::plan
