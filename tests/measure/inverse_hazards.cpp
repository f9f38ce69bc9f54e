// Prints the hazards of --device inverse3 and tpm hil serve, measured on the stand-in service, as
// the table of reports/inverse/report.md:
//     measure_inverse_hazards
#include <fmt/format.h>

#include <algorithm>

#include "inverse_hazards.hpp"
#include "measure/program.hpp"

int main(int argc, char** argv) {
  using namespace tpm;
  return test::measured(
      argc, argv, 0, 0, "usage: measure_inverse_hazards", [](const std::vector<std::string>&) {
        const auto rows = test::inverse_hazard_rows(0.016, 0.010);
        fmt::print("{}\n\n{}", haptics::host_line(), test::inverse_hazard_table(rows));
        if (!std::ranges::all_of(rows, &test::InverseHazardRow::within)) {
          throw Error(ExitCode::answer_is_no, "hazards", "a row is not within its bounds",
                      "each within");
        }
      });
}
