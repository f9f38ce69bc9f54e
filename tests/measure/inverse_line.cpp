// Prints the delays found of reports/inverse/report.md, "Delays by the command line", as
// Markdown:
//     measure_inverse_line TPM [TRIES]
// tpm hil identify, run and verify on tpm hil serve, programs of their own and the clock, with
// forces that the served device makes 0, 2 and 5 ms late (TRIES each, default 3).
#include <string>
#include <vector>

#include "inverse_line.hpp"
#include "program.hpp"
#include "tpm/haptics/loop/real_time.hpp"

using namespace tpm;
using namespace tpm::haptics;

namespace {

void print_run(int late_ms, const test::LineRun& run) {
  const auto ms = [](const std::optional<double>& s) {
    return s ? fmt::format("{:.2f}", 1e3 * *s) : std::string("not found");
  };
  const std::string verified =
      run.verified != 0
          ? std::string("-")
          : fmt::format("{:.3f} % of {:.3f} N",
                        1e2 * run.largest_difference_N / std::max(run.peak_N, 1e-9), run.peak_N);
  fmt::print("| {} | {} | {} | {:.0f} | {} | {} | {} |\n", late_ms, ms(run.found_s),
             ms(run.largest_s), 1e3 * run.stalled_s, run.begun_again,
             run.end.empty() ? std::string("not recorded") : run.end, verified);
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(
      argc, argv, 1, 2, "usage: measure_inverse_line TPM [TRIES]",
      [](const std::vector<std::string>& words) {
        const int tries = words.size() > 1 ? std::stoi(words[1]) : 3;
        fmt::print("{}\n\n", host_line());
        fmt::print(
            "| put in / ms | mean found / ms | largest / ms | left out / ms | begun again | "
            "session ended | largest difference |\n| --- | --- | --- | --- | --- | --- | --- |\n");
        for (const int late_ms : {0, 2, 5}) {
          for (int i = 0; i < tries; ++i)
            print_run(late_ms, test::run_on_the_line(words[0], late_ms));
        }
      });
}
