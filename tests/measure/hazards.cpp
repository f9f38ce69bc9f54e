// What can go wrong in a session, and what becomes of it; prints the tables of hazards in
// reports/haptics/report.md, with --wall-clock those by the clock, which takes half a minute:
//   measure_hazards [--wall-clock]
// Exit code 1 if force, energy, travel or time leave their bounds.
#include "hazards/hazard_report.hpp"
#include "program.hpp"

int main(int argc, char** argv) {
  using namespace tpm::haptics;
  constexpr const char* kUsage = "measure_hazards [--wall-clock]";
  bool safe = true;
  const int code =
      tpm::test::measured(argc, argv, 0, 1, kUsage, [&safe](const std::vector<std::string>& words) {
        if (words.empty()) {
          const HazardStudy study = study_hazards();
          fmt::print("{}", hazard_text(study));
          safe = study.safe();
          return;
        }
        if (words.front() != "--wall-clock") {
          throw tpm::Error(tpm::ExitCode::usage, "measure_hazards", "'" + words.front() + "'",
                           kUsage);
        }
        const ClockHazardStudy study = study_hazards_on_the_clock(true);
        fmt::print("{}", clock_hazard_text(study));
        safe = study.safe();
      });
  return code == 0 && !safe ? 1 : code;
}
