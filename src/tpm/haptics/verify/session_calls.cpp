// Declared in tpmkit/session.hpp.
#include "tpm/haptics/device/device_file.hpp"
#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/verify/verify.hpp"
#include "tpmkit/session.hpp"

namespace tpm::haptics {

Session::Session(const std::filesystem::path& file, const std::filesystem::path& law)
    : session_(std::make_shared<const HilSession>(read_session(file, {.law = law, .motion = {}}))) {
}

const std::string& Session::title() const {
  return session_->title;
}

double Session::duration_s() const {
  return session_->duration_s();
}

const SessionServo& Session::servo() const {
  return session_->servo;
}

std::shared_ptr<ContactModel> Session::contact() const {
  return std::move(make_loop_model(*session_).model);
}

std::shared_ptr<HapticDevice> Session::simulated_device() const {
  return make_device(DeviceChoice{}, *session_);
}

SessionSummary Session::run(const std::shared_ptr<HapticDevice>& device,
                            const SessionRequest& request) const {
  SessionRunOptions options;
  options.real_time = request.real_time;
  options.wish = request.wish;
  options.recording = request.recording;
  options.interrupted = request.interrupted;
  options.watcher = request.watcher;
  const bool simulated = dynamic_cast<const VirtualOmega7*>(device.get()) != nullptr;
  const std::string usual = simulated ? "virtual" : "omega7";
  const auto of_file = simulated ? limits_from : limits_of_motors;
  const DeviceLimits limits = request.device_file.empty()
                                  ? limits_of(request.limits.empty() ? usual : request.limits)
                                  : of_file(read_device_file(request.device_file), request.limits);
  DevicePermissions permissions{.may_move = request.may_move};
  if (!simulated) permissions.file = request.device_file;  // else of the device it stands for
  const SessionRun run = run_session_on(*session_, device, limits, permissions, options);
  return {.device = run.device,
          .model = run.model.name,
          .rendering = run.rendering.verdict(),
          .outcome = run.outcome};
}

SessionCheck verify_session(const std::filesystem::path& recording) {
  const HilRecording read = read_recording(recording);
  const Verification check = verify(read);
  return {.reference = check.reference,
          .instants = check.all.instants,
          .rms_N = check.all.rms_N,
          .max_N = check.all.max_N,
          .peak_N = check.all.peak_N,
          .reference_error_N = check.reference_error_N,
          .whole = check.whole,
          .remarks = all_remarks(read, check)};
}

}  // namespace tpm::haptics
