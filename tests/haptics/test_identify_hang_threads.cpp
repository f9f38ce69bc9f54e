// A device call that hangs during tpm hil identify: forces are cut while it hangs.
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <memory>
#include <thread>

#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/session/identify_run.hpp"

namespace tpm::haptics {
namespace {

using namespace std::chrono_literals;

/// What the devices of a run see of the hang.
struct HangSeen {
  std::atomic<int> reads{0};
  std::atomic<bool> hanging{false}, cut_while_hanging{false};
};

/// A free handle one of whose reads hangs until forces are cut, or for 20 s.
class HangingHandle final : public VirtualOmega7 {
 public:
  HangingHandle(const PlantSettings& plant, std::shared_ptr<HangSeen> seen)
      : VirtualOmega7(plant, {}), seen_(std::move(seen)) {}
  void await() noexcept override {}  // it has no script
  void begin() noexcept override {}
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override {
    constexpr int kHangsAt = 500;
    if (++seen_->reads == kHangsAt) {
      seen_->hanging = true;
      for (int i = 0; i < 20'000 && !seen_->cut_while_hanging; ++i)
        std::this_thread::sleep_for(1ms);
      seen_->hanging = false;
    }
    return VirtualOmega7::read(position_m);
  }
  void cut_forces() noexcept override {
    if (seen_->hanging) seen_->cut_while_hanging = true;
    VirtualOmega7::cut_forces();
  }

 private:
  std::shared_ptr<HangSeen> seen_;
};

TEST_CASE("A call that hangs during an identification has its forces cut as in a session") {
  HilSession like;
  like.plant.arm = {0.0, 0.0, 0.0, 0.0};
  like.plant.least_watchdog_s = 10.0;  // only the loop's own limit is tried
  const auto seen = std::make_shared<HangSeen>();
  DeviceIdentifyOptions options;
  options.duration_s = 1.0;
  options.real_time = true;
  const IdentifyRun run = run_identification_on(
      [&] { return std::make_shared<HangingHandle>(like.plant, seen); }, {}, like, options);
  CHECK(seen->cut_while_hanging);
  CHECK(run.begun_again >= 1);  // on a new connection, once the call came back
}

}  // namespace
}  // namespace tpm::haptics
