// A force feedback of SOFA that asks a tpmkit tissue: SOFA's haptic drivers (Geomagic, Haply) call
// ForceFeedback::computeForce in their haptic thread and send what it answers.
//
// Compiled here against a stand-in for the base class (sofa_stand_in.hpp), as SOFA is not a
// dependency of tpmkit: never run inside SOFA or with hardware. In SOFA include
// <sofa/component/haptics/ForceFeedback.h>, and register the class with an ObjectFactory. SOFA's
// scenes are often in mm: pass metres, as here, or scale where it says so.
#include <tpmkit/haptics.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>

#ifdef TPM_WITH_SOFA
#include <sofa/component/haptics/ForceFeedback.h>
#else
#include "sofa_stand_in.hpp"
#endif

class TpmForceFeedback : public sofa::component::haptics::ForceFeedback {
 public:
  /// Throws std::runtime_error with the line of tpmkit. Call it from init(), not in the loop.
  /// @param options those of your device: its `device_file`, written by `tpm hil identify`
  TpmForceFeedback(const std::string& session_or_law, const tpm_haptics_options& options) {
    char why[TPM_HAPTICS_MESSAGE];
    if (tpm_haptics_open(session_or_law.c_str(), &options, &tissue_, why, sizeof why) !=
        TPM_HAPTICS_OK) {
      throw std::runtime_error(why);
    }
  }
  ~TpmForceFeedback() override { tpm_haptics_close(tissue_); }
  TpmForceFeedback(const TpmForceFeedback&) = delete;
  TpmForceFeedback& operator=(const TpmForceFeedback&) = delete;

  /// In the haptic thread, once a period; the orientation of the tool is not used.
  void computeForce(double x, double y, double z, double, double, double, double, double& fx,
                    double& fy, double& fz) override {
    const double position_m[3] = {x, y, z};  // a scene in mm: times 1e-3
    double force_N[3];
    tpm_haptics_step_at(tissue_, now_s(), position_m, force_N);  // zero once it has stopped
    fx = force_N[0];
    fy = force_N[1];
    fz = force_N[2];
  }

 private:
#ifdef TPM_WITH_SOFA
  static double now_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }
#else
  static double now_s() {
    return scripted_time_s();
  }
#endif

  tpm_haptics_contact* tissue_ = nullptr;
};

#ifndef TPM_WITH_SOFA
int main(int argc, char** argv) {
  if (argc != 2) return TPM_HAPTICS_USAGE;
  tpm_haptics_options options = TPM_HAPTICS_OPTIONS_INIT;
  std::strcpy(options.device, "virtual");  // the stand-in has no motors
  try {
    TpmForceFeedback feedback(argv[1], options);
    const double largest_N = run_scripted_driver(feedback);
    std::printf("stand-in for SOFA: %d periods, largest force %.4f N along z\n", kScriptedPeriods,
                largest_N);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "sofa_force_feedback: %s\n", error.what());
    return TPM_HAPTICS_BAD_INPUT;
  }
}
#endif
