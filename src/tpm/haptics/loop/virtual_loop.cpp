// Declared in tpmkit/servo_loop.hpp.
#include <exception>

#include "tpm/haptics/device/forces_off_guard.hpp"
#include "tpm/haptics/loop/servo_step.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {
namespace {

constexpr std::uint64_t kAskEvery = 1024;

}  // namespace

ServoOutcome run_in_virtual_time(HapticDevice& device, ContactModel& model,
                                 const ServoSettings& settings, const RecordSink& sink,
                                 const std::function<bool()>& interrupted) {
  const ForcesOffGuard guard(device);
  const SignalStack signal_stack;
  ServoOutcome outcome;
  ServoStep step(device, model, settings);
  ServoRecord row;
  try {
    device.enable_forces();
  } catch (...) {
    device.stop();
    throw;
  }
  try {
    StopCause cause = StopCause::none;
    for (std::uint64_t i = 0; cause == StopCause::none; ++i) {
      const bool asked = i % kAskEvery == 0;
      if (asked && (ForcesOffGuard::ended_by_signal() || (interrupted && interrupted()))) {
        step.stop(StopCause::signal);
        break;
      }
      cause = step.cycle(0, row);
      sink(row);
      device.advance(settings.period_s);
    }
  } catch (const std::exception& error) {
    step.stop(StopCause::exception);
    outcome.detail = error.what();
  } catch (...) {
    step.stop(StopCause::exception);
    outcome.detail = "something that is no error was thrown by whoever records";
  }
  step.complete_cause();
  if (outcome.detail.empty()) outcome.detail = step.detail();
  outcome.cause = step.cause();
  outcome.cycles = step.cycles();
  outcome.counts = step.counts();
  outcome.device = step.device_status();
  return outcome;
}

}  // namespace tpm::haptics
