// The haptic thread of a CHAI3D 3.x application with a tpmkit tissue: read the device, step the
// tissue, send the force. In CHAI3D a device is a cGenericHapticDevicePtr whose getPosition and
// setForce take a cVector3d, and cPrecisionClock tells the time; this thread uses nothing else of
// it.
//
// Compiled here against a stand-in for these few types (chai3d_stand_in.hpp), as CHAI3D is not a
// dependency of tpmkit: never run with CHAI3D itself or with hardware. With CHAI3D, include
// "chai3d.h" instead and start `haptic_thread` with cThread::start(..., CTHREAD_PRIORITY_HAPTICS).
#include <tpmkit/haptics.h>

#include <atomic>
#include <cstdio>
#include <cstring>

#ifdef TPM_WITH_CHAI3D
#include "chai3d.h"
#else
#include "chai3d_stand_in.hpp"
#endif

/// Runs until `running` is false or the contact stops. Forces end at zero either way.
/// @returns 0, or what the contact or the device said
int haptic_thread(chai3d::cGenericHapticDevicePtr device, tpm_haptics_contact* tissue,
                  const std::atomic<bool>& running) {
  int answer = TPM_HAPTICS_OK;
  chai3d::cVector3d position;
  chai3d::cPrecisionClock clock;
  clock.start(true);
  while (running && answer == TPM_HAPTICS_OK) {
    if (!device->getPosition(position)) break;
    const double position_m[3] = {position.x(), position.y(), position.z()};
    double force_N[3];
    answer = tpm_haptics_step_at(tissue, clock.getCurrentTimeSeconds(), position_m, force_N);
    if (!device->setForce(chai3d::cVector3d(force_N[0], force_N[1], force_N[2]))) break;
  }
  device->setForce(chai3d::cVector3d(0.0, 0.0, 0.0));
  return answer;
}

#ifndef TPM_WITH_CHAI3D
int main(int argc, char** argv) {
  if (argc != 2) return TPM_HAPTICS_USAGE;
  char why[TPM_HAPTICS_MESSAGE];
  tpm_haptics_contact* tissue = nullptr;
  tpm_haptics_options options = TPM_HAPTICS_OPTIONS_INIT;
  // The stand-in has no motors. Of a device: options.device_file, written by `tpm hil identify`.
  std::strcpy(options.device, "virtual");
  const int opened = tpm_haptics_open(argv[1], &options, &tissue, why, sizeof why);
  if (opened != TPM_HAPTICS_OK) {
    std::fprintf(stderr, "chai3d_tool: %s\n", why);
    return opened;
  }
  std::atomic<bool> running{true};
  const auto device = std::make_shared<chai3d::cGenericHapticDevice>();  // ends after its motion
  const int answer = haptic_thread(device, tissue, running);
  std::printf("stand-in for CHAI3D: %d periods, largest force %.4f N along z\n", device->periods(),
              device->largest_N());
  tpm_haptics_close(tissue);
  return answer;
}
#endif
