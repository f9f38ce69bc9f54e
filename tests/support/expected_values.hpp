// The numbers of tests/expected_values.json: reference values, and the errors and costs that tests
// allow.
#pragma once

#include <catch2/catch.hpp>
#include <string>
#include <vector>

namespace tpm::test {

/// A reference value with its tolerance. CHECK_THAT(found, expected("NAME")) compares with it.
class Expected : public Catch::MatcherBase<double> {
 public:
  Expected(std::string name, std::vector<double> numbers, double tolerance, std::string unit);

  /// In the unit of the file. @throws std::runtime_error if the entry is a list.
  [[nodiscard]] double value() const;

  /// The numbers of an entry that is a list, such as a position.
  [[nodiscard]] const std::vector<double>& numbers() const { return numbers_; }

  /// Largest difference allowed, in the unit of the value.
  [[nodiscard]] double tolerance() const { return tolerance_; }

  bool match(const double& found) const override;
  [[nodiscard]] std::string describe() const override;

 private:
  std::string name_;
  std::vector<double> numbers_;
  double tolerance_;
  std::string unit_;
};

/// An entry of "values". @throws std::runtime_error if the file has none of this name, here and
/// below; the test then fails with that message.
Expected expected(const std::string& name);

/// An entry of "allowed_errors": CHECK(error < allowed_error("NAME")).
double allowed_error(const std::string& name);

/// An entry of "allowed_costs": CHECK(steps <= allowed_cost("NAME")).
double allowed_cost(const std::string& name);

}  // namespace tpm::test
