// What does a haptic device of one's own have to do? This one has no motors: its handle pushes 3 mm
// into the tissue and comes back. It runs a session in virtual time; the recording is then compared
// with the law itself.
//
//     own_device examples/law_session.json
//
// Prints:
//     a handle on a path, law power-2: power-law kernel, two relaxing branches, no tension
//     11000 cycles, ended: finished, largest force 0.311 N
//     reference: the law over the recorded motion, by its own quadrature (docs/laws.md)
//     apart by 0.000000 N rms, peak 0.311 N
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <tpmkit/error.hpp>
#include <tpmkit/session.hpp>

using namespace tpm::haptics;

/// A handle on a prescribed path: at rest 2 mm above the tissue, then down to a depth and up again.
class PathDevice final : public HapticDevice {
 public:
  explicit PathDevice(const SessionServo& servo) : servo_(servo) {}

  const DeviceIdentity& open() override { return identity_; }
  void prepare(const DevicePreparation& /*preparation*/) override {}
  void begin() noexcept override { begun_ = true; }
  void advance(double seconds) noexcept override { time_s_ += begun_ ? seconds : 0.0; }
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override {
    constexpr double kPause_s = 1.0, kPeriod_s = 8.0, kAbove_m = 2e-3, kDepth_m = 3e-3;
    const double turn = 2.0 * std::numbers::pi * std::max(0.0, time_s_ - kPause_s) / kPeriod_s;
    const double depth_m = -kAbove_m + (kAbove_m + kDepth_m) * 0.5 * (1.0 - std::cos(turn));
    position_m = servo_.surface_m + depth_m * servo_.push;
    return DeviceAnswer::ok;
  }
  DeviceAnswer write(const Eigen::Vector3d& force_N) noexcept override {
    largest_N = std::max(largest_N, force_N.norm());  // here motors would pull
    return DeviceAnswer::ok;
  }
  DeviceStatus status() noexcept override { return {}; }
  void stop() noexcept override {}
  void cut_forces() noexcept override {}

  double largest_N = 0.0;

 private:
  SessionServo servo_;
  DeviceIdentity identity_{.kind = "path",
                           .name = "a handle on a path",
                           .serial = {},
                           .firmware = {},
                           .library = {},
                           .library_version = {},
                           .assumptions = {}};
  double time_s_ = 0.0;
  bool begun_ = false;
};

int main(int argc, char** argv) try {
  if (argc < 2)
    throw tpm::Error(tpm::ExitCode::usage, "own_device", "no session", "own_device FILE");
  const Session session{std::filesystem::path(argv[1])};
  const auto device = std::make_shared<PathDevice>(session.servo());
  SessionRequest request;
  request.recording = "own_device.tpmrec";
  request.limits =
      "virtual";  // a path has no motors; for a real device name it and its device_file
  const SessionSummary run = session.run(device, request);
  std::printf("%s, %s\n%llu cycles, ended: %s, largest force %.3f N\n", run.device.name.c_str(),
              run.model.c_str(), static_cast<unsigned long long>(run.outcome.cycles),
              std::string(to_string(run.outcome.cause)).c_str(), device->largest_N);
  const SessionCheck check = verify_session(request.recording);
  std::printf("reference: %s\napart by %.6f N rms, peak %.3f N\n", check.reference.c_str(),
              check.rms_N, check.peak_N);
} catch (const tpm::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return static_cast<int>(error.code());
}
