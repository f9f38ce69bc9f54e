// The component haptics alone: a session with a law at its contact, run on the simulated device and
// verified.
#include <cstdio>
#include <fstream>
#include <tpmkit/session.hpp>

int main() {
  std::ofstream("session.json") << R"({
    "title": "a law", "rate": "1 kHz",
    "model": {"kind": "law", "law": {"law": "linear-1", "drive": "indentation_depth", "response": "contact_force",
      "reference_m": 0.003, "fitted_to_m": 0.003, "provenance": "assumed",
      "parameters": {"k_inf_N_per_m": 60, "k1_N_per_m": 60, "tau1_s": 0.5}}},
    "indentations": {"depths": ["2 mm"], "rates": ["2 mm/s"], "hold": "1 s", "rest": "1 s"}
  })";
  const tpm::haptics::Session session("session.json");
  tpm::haptics::SessionRequest request;
  request.recording = "session.tpmrec";
  request.limits = "virtual";  // what is not measured of an Omega.7 would refuse this law
  const tpm::haptics::SessionSummary run = session.run(session.simulated_device(), request);
  const tpm::haptics::SessionCheck check = tpm::haptics::verify_session(request.recording);
  std::printf("%s, %.1e N of %.3f N\n", run.model.c_str(), check.rms_N, check.peak_N);
  const bool ended = run.outcome.cause == tpm::haptics::StopCause::finished;
  return ended && check.instants > 100 && check.rms_N < 1e-3 * check.peak_N ? 0 : 1;
}
