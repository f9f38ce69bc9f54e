#pragma once
#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/inverse/force_comparison.hpp"
#include "tpm/haptics/inverse/loopback.hpp"
#include "tpm/haptics/inverse/messages.hpp"
#include "tpm/haptics/inverse/unanswered_messages.hpp"
#include "tpm/haptics/loop/triple_buffer.hpp"
#include "tpmkit/device.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {

/// Where a service that is compatible with the Inverse service listens on this machine, and which
/// of its devices is meant.
struct InverseAddress {
  int port = 10001;
  int events_port = 10020;                  ///< of versions from 3.5 on
  int old_http_port = 10000;                ///< of versions before 3.5
  std::string device_id;                    ///< in capitals or small letters; empty: by `index`
  std::optional<int> index = std::nullopt;  ///< in the inventory, from 0; empty: the only one
  double gravity_carried = 1.0;  ///< share of the device's weight that the service is to carry
  bool poll = false;             ///< the thread of the messages looks again and again, for latency
};

/// Devices that the service lists; nothing is commanded. Throws Error(environment) where
/// nobody listens or answers, Error(bad_input) for what is no inventory.
[[nodiscard]] InverseInventory inverse_inventory(const InverseAddress& address);
/// Why no events of the service are heard, without which no session on it begins; empty: they are,
/// or its version has none. Throws Error(environment) where no version is told.
[[nodiscard]] std::string inverse_events_fault(const InverseAddress& address);

/// An Inverse3 through a service that is compatible with the Inverse service: messages over
/// loopback, no vendor library.
///
/// In real time a thread of its own exchanges messages, at least four times a period, and always
/// with the newest force. The loop meets it in two mailboxes and never waits. A force that the loop
/// has not renewed for the watchdog's time is replaced by zero, for good. A state is as old as the
/// message that it answers: older than a period it is no fresh position, older than the watchdog's
/// time a failed read. A connection that stalls or ends is a failed status with what happened, and
/// no word of the device: only an event of the service says that it is unplugged. In virtual time
/// each write is one message and its state, which only a simulated device allows.
///
/// open() makes force gate and damping of the service 0, lets it carry the device's weight, and
/// reads all back; a service in which one of them stays or is not told, or in another scale, is
/// refused. So is a simulated device that another client drives; of hardware that seems to be in
/// use a finding says so, because no service documents what that means. A workspace that is moved,
/// turned or scaled later ends the session. A reported force that is not the commanded one is a
/// finding (ForceComparison).
class InverseDevice final : public HapticDevice {
 public:
  /// @param limits named in the identity with what they are known by
  InverseDevice(InverseAddress address, const DeviceLimits& limits);
  ~InverseDevice() override;

  const DeviceIdentity& open() override;
  void prepare(const DevicePreparation& preparation) override;
  void enable_forces() override;
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override;
  DeviceAnswer write(const Eigen::Vector3d& force_N) noexcept override;
  DeviceStatus status() noexcept override;
  HandState hand() noexcept override;
  std::vector<DeviceFinding> findings() const override;  // from any thread
  void stop() noexcept override;
  bool learn_end() noexcept override;
  void cut_forces() noexcept override;

  /// Round trips of messages since prepare().
  struct Traffic {
    std::uint64_t messages = 0, unanswered = 0, unreadable = 0;
  };
  [[nodiscard]] Traffic traffic() const noexcept { return {sent_, unanswered_, unreadable_}; }

 private:
  struct Order {
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
    std::int64_t at_ns = 0;
  };
  struct Seen {
    InverseState state;
    std::int64_t asked_ns = 0;  ///< when the message was sent that it answers
  };
  void choose(const InverseInventory& inventory);
  void look_for_other_clients();
  void make_neutral();
  void require_neutral() const;
  void learn_settings();
  void notice_settings();
  void identify();
  [[nodiscard]] InverseInventory read_back();
  [[nodiscard]] std::string take_text(double timeout_s);
  void exchange_in_turn() noexcept;
  void ask_for_first_state();
  bool exchange(const std::string& message, double timeout_s);
  void take_state(const std::string& text);
  [[nodiscard]] Eigen::Vector3d force_to_send() noexcept;
  void wait_for_order() noexcept;
  void look_for_events();
  bool take_event(const std::string& text);
  void hear_last_events();
  void lose_connection(std::string_view words);
  [[nodiscard]] Error silence();
  /// Why forces no longer reach the hand. `connection`: nothing is known of the device.
  enum class Fault { none, connection, unplugged, software, watchdog, unknown };
  [[nodiscard]] static std::optional<Fault> end_of(const InverseEvent& event);
  [[nodiscard]] static ForcesOff forces_off(Fault fault) noexcept;
  using FaultWords = std::array<char, sizeof DeviceStatus::error_text>;
  bool fail(Fault fault, std::string_view words) noexcept;
  static void copy_words(FaultWords& to, std::string_view words) noexcept;
  void say_goodbye() noexcept;
  void wake() noexcept;
  [[nodiscard]] std::int64_t session_ns() const noexcept;

  InverseAddress address_;
  const DeviceLimits limits_;
  std::string version_;
  InverseFormat format_ = InverseFormat::vector;
  std::unique_ptr<WebSocketClient> service_, events_;
  std::int64_t session_ = 0;
  InverseDeviceEntry device_;
  std::vector<DeviceFinding> noticed_;  ///< at the opening
  DeviceIdentity identity_;
  DevicePreparation preparation_;
  bool prepared_ = false;
  // Of the loop's thread.
  DeviceStatus status_;
  Seen seen_;
  ForceComparison forces_;
  std::int64_t written_ = 0;  ///< forces
  // Between the loop and the thread of the messages.
  TripleBuffer<Order> order_;
  TripleBuffer<Seen> answer_;
  std::atomic<std::uint32_t> orders_{0};
  std::atomic<bool> forces_on_{false}, cut_{false}, zero_sent_{false}, ending_{false}, over_{false};
  std::atomic<bool> begun_{false};  ///< the thread of the messages has asked once
  std::atomic<bool> failing_{false};
  std::atomic<Fault> fault_{Fault::none};
  FaultWords fault_words_{};  ///< before fault_ is set
  /// Of an event that was read after the connection had been lost: it is the cause.
  std::atomic<Fault> told_fault_{Fault::none};
  FaultWords told_words_{};  ///< before told_fault_ is set
  Socket wake_;              ///< an eventfd
  // Of the thread of the messages.
  std::thread messages_;
  UnansweredMessages waiting_;
  std::optional<Eigen::Vector3d> workspace_m_;  ///< where the service puts it at the first state
  std::atomic<std::uint64_t> sent_{0}, unanswered_{0}, unreadable_{0};
  std::uint32_t orders_seen_ = 0;
  std::int64_t next_look_ns_ = 0;
  int unreadable_in_a_row_ = 0;
};

}  // namespace tpm::haptics
