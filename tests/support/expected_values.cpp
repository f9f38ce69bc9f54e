#include "expected_values.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace tpm::test {
namespace {

constexpr const char* kFile = TPM_TEST_SOURCE_DIR "/tests/expected_values.json";

const nlohmann::json& entry(const char* section, const std::string& name) {
  static const nlohmann::json file = [] {
    std::ifstream stream(kFile);
    if (!stream) throw std::runtime_error(fmt::format("{}: cannot be read", kFile));
    return nlohmann::json::parse(stream);
  }();
  const nlohmann::json& entries = file.at(section);
  const auto found = entries.find(name);
  if (found == entries.end()) {
    throw std::runtime_error(
        fmt::format("tests/expected_values.json: no entry '{}' in '{}'", name, section));
  }
  return *found;
}

}  // namespace

Expected::Expected(std::string name, std::vector<double> numbers, double tolerance,
                   std::string unit)
    : name_(std::move(name)),
      numbers_(std::move(numbers)),
      tolerance_(tolerance),
      unit_(std::move(unit)) {}

double Expected::value() const {
  if (numbers_.size() != 1) {
    throw std::runtime_error(
        fmt::format("tests/expected_values.json: '{}' is a list of {}", name_, numbers_.size()));
  }
  return numbers_.front();
}

bool Expected::match(const double& found) const {
  return std::abs(found - value()) <= tolerance_;
}

std::string Expected::describe() const {
  return fmt::format("is within {} of {} {} ({} in tests/expected_values.json)", tolerance_,
                     value(), unit_, name_);
}

Expected expected(const std::string& name) {
  const nlohmann::json& e = entry("values", name);
  const nlohmann::json& value = e.at("value");
  auto numbers = value.is_array() ? value.get<std::vector<double>>()
                                  : std::vector<double>{value.get<double>()};
  const double tolerance = e.contains("tolerance")
                               ? e.at("tolerance").get<double>()
                               : e.at("relative_tolerance").get<double>() * std::abs(numbers.at(0));
  return {name, std::move(numbers), tolerance, e.at("unit").get<std::string>()};
}

double allowed_error(const std::string& name) {
  return entry("allowed_errors", name).at("at_most").get<double>();
}

double allowed_cost(const std::string& name) {
  return entry("allowed_costs", name).at("at_most").get<double>();
}

}  // namespace tpm::test
