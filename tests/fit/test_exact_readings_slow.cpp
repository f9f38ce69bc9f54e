// Exact material functions that take longer: many readings, and laws of two exponentials.
#include "support/exact_readings.hpp"

namespace tpm::fit {
namespace {

using test::check_identified;
using test::ExactReadings;
using test::selection_of;

TEST_CASE("exact moduli and compliances of many readings are identified", "[exact]") {
  ExactReadings readings;
  SECTION("3,000 readings of exp(-t)") {
    readings.count = 3000;
    readings.law = [](double t) { return std::exp(-t); };
    check_identified(selection_of(readings), "linear-1-fluid", {{"k1", 1.0}, {"tau1", 1.0}});
  }
  SECTION("two exponentials") {
    readings.law = [](double t) {
      return 1000.0 * std::exp(-t / 0.1) + 500.0 * std::exp(-t / 10.0);
    };
    check_identified(selection_of(readings), "linear-2-fluid",
                     {{"k1", 1000.0}, {"k2", 500.0}, {"tau1", 0.1}, {"tau2", 10.0}});
  }
  SECTION("600 readings of the creep of a solid") {
    readings.title = "J(t) [1/Pa]";
    readings.count = 600;
    readings.law = [](double t) { return 1.0 / 2000.0 + (1.0 - std::exp(-t / 5.0)) / 3000.0; };
    check_identified(selection_of(readings), "linear-1",
                     {{"k_inf", 1200.0}, {"k1", 800.0}, {"tau1", 3.0}});
  }
}

}  // namespace
}  // namespace tpm::fit
