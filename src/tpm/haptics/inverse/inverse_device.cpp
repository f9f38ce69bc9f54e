#include "tpm/haptics/inverse/inverse_device.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#include "tpm/haptics/inverse/service_terms.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

constexpr double kMessagesPerPeriod = 4.0;
constexpr double kMostUnanswered_s = 0.004;  // after which another message is sent
constexpr int kMostUnreadable = 20;          // in a row
constexpr std::int64_t kLookForEvents_ns = 2'000'000;
constexpr double kMoved_m = 1e-6;
/// For events that were sent just before a connection ended.
constexpr double kLastEvents_s = 0.05;
constexpr int kMostLastEvents = 1000;

double seconds_between(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

Eigen::Vector3d limited(const Eigen::Vector3d& force_N, double most_N) noexcept {
  const double size_N = force_N.norm();
  return size_N <= most_N ? force_N : Eigen::Vector3d(force_N * (most_N / size_N));
}

std::string words_of(const InverseEvent& event) {
  return event.safety_type.empty() ? event.name
                                   : fmt::format("{}: {}", event.name, event.safety_type);
}

}  // namespace

InverseDevice::InverseDevice(InverseAddress address, const DeviceLimits& limits)
    : address_(std::move(address)),
      limits_(limits),
      wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

InverseDevice::~InverseDevice() {
  stop();
  if (messages_.joinable()) messages_.join();
}

/// The fault if an event means that forces no longer reach the hand.
std::optional<InverseDevice::Fault> InverseDevice::end_of(const InverseEvent& event) {
  if (event.name == "device-disconnected") return Fault::unplugged;
  if (event.name == "device-busy") return Fault::software;
  if (event.name != "device-safety-triggered") return std::nullopt;
  const bool harmless = event.safety_type == "ebrake_released" || event.level == "info";
  return harmless ? std::nullopt : std::optional(Fault::software);
}

void InverseDevice::prepare(const DevicePreparation& preparation) {
  if (!preparation.real_time && identity_.hardware) {
    throw service_fault("a device keeps the clock", "--clock real");
  }
  preparation_ = preparation;
  prepared_ = true;
  preparation_.max_force_N = std::min(preparation.max_force_N, limits_.force_N);
  status_ = {};
  if (preparation.real_time) {
    messages_ = std::thread([this] { exchange_in_turn(); });
    // Its stack is locked before it begins, which takes longer than a watchdog forgives.
    constexpr timespec kLook{0, 100'000};
    while (!begun_ && !over_) (void)::nanosleep(&kLook, nullptr);
  } else {
    ask_for_first_state();
  }
  if (!answer_.refresh()) {
    stop();
    (void)learn_end();
    const std::string why = status().error_text;
    throw service_fault(why.empty() ? "the service sends no state" : why,
                        "a service that answers each message");
  }
  seen_ = answer_.latest();
  written_ = 0;
  forces_.begin(session_ns());
}

/// A position of now: open() may be long ago.
void InverseDevice::ask_for_first_state() {
  while (service_->receive(0.0)) {
  }
  waiting_ = {};
  workspace_m_.reset();
  if (!exchange(probe_message(device_.id), kPatience_s)) {
    lose_connection("the service sends no state");
  }
}

void InverseDevice::enable_forces() {
  order_.write({Eigen::Vector3d::Zero(), now_ns()});
  forces_on_ = true;
}

void InverseDevice::copy_words(FaultWords& to, std::string_view words) noexcept {
  const std::size_t size = std::min(words.size(), to.size() - 1);
  std::memcpy(to.data(), words.data(), size);
  to[size] = '\0';
}

/// False if something else had failed before.
bool InverseDevice::fail(Fault fault, std::string_view words) noexcept {
  if (failing_.exchange(true)) return false;  // the first one counts, of whichever thread
  copy_words(fault_words_, words);
  fault_.store(fault, std::memory_order_release);
  return true;
}

/// An event that has come already is the cause; one that comes a little later completes it.
void InverseDevice::lose_connection(std::string_view words) {
  if (events_ != nullptr) {
    while (const std::optional<std::string> text = events_->receive(0.0)) {
      if (take_event(*text)) break;
    }
  }
  (void)fail(Fault::connection, words);
}

Eigen::Vector3d InverseDevice::force_to_send() noexcept {
  (void)order_.refresh();
  const Order& order = order_.latest();
  if (!forces_on_ || cut_ || ending_ || fault_ != Fault::none) return Eigen::Vector3d::Zero();
  // In virtual time nobody counts the time between two commands.
  if (preparation_.real_time && seconds_between(order.at_ns, now_ns()) > preparation_.watchdog_s) {
    fail(Fault::watchdog, "no command in the watchdog's time");
    return Eigen::Vector3d::Zero();
  }
  return limited(order.force_N, preparation_.max_force_N);
}

/// One message and the states that come; false if none came in time or the connection is over.
bool InverseDevice::exchange(const std::string& message, double timeout_s) {
  ++sent_;
  const std::int64_t asked_ns = now_ns();
  if (preparation_.real_time) {
    waiting_.forget_before(asked_ns - static_cast<std::int64_t>(preparation_.watchdog_s * 1e9));
  }
  waiting_.sent(asked_ns);
  if (!service_->send(message)) {
    lose_connection(service_->over());
    return false;
  }
  std::optional<std::string> text = service_->receive(timeout_s, address_.poll);
  if (!text) {
    ++unanswered_;
    if (!service_->over().empty()) lose_connection(service_->over());
    return false;
  }
  for (; text; text = service_->receive(0.0)) take_state(*text);
  if (service_->over().empty()) return true;
  lose_connection(service_->over());  // behind the state came the end
  return false;
}

void InverseDevice::take_state(const std::string& text) {
  const std::optional<std::int64_t> asked_ns = waiting_.answered();
  try {
    const InverseState state = parse_state(text, device_.id);
    unreadable_in_a_row_ = 0;
    if (!workspace_m_) workspace_m_ = state.workspace_position_m;
    if (!is_scaled_as_device(state) || !is_turned_as_device(state) ||
        !((state.workspace_position_m - *workspace_m_).norm() < kMoved_m)) {
      // Another program may set the workspace of this session: the surface would be elsewhere.
      fail(Fault::software, "the service has moved, turned or scaled the workspace");
      return;
    }
    if (asked_ns) answer_.write({state, *asked_ns});  // else it came after all patience
  } catch (const Error&) {
    ++unreadable_;
    if (++unreadable_in_a_row_ >= kMostUnreadable) {
      fail(Fault::unknown, lists_device(text, device_.id)
                               ? "the service sends what is no state"
                               : "the service sends what is no state: device is listed no more");
    }
  }
}

void InverseDevice::look_for_events() {
  if (events_ == nullptr || now_ns() < next_look_ns_) return;
  next_look_ns_ = now_ns() + kLookForEvents_ns;
  while (const std::optional<std::string> text = events_->receive(0.0)) (void)take_event(*text);
  if (!events_->over().empty()) fail(Fault::connection, "events: " + events_->over());
}

/// True if it ends the session.
bool InverseDevice::take_event(const std::string& text) {
  try {
    const InverseEvent event = parse_event(text);
    const bool ours = event.device_id.empty() || same_id(event.device_id, device_.id);
    const std::optional<Fault> end = end_of(event);
    if (!ours || !end) return false;
    const std::string words = words_of(event);
    if (!fail(*end, words) && told_fault_ == Fault::none) {
      copy_words(told_words_, words);
      told_fault_.store(*end, std::memory_order_release);
    }
    return true;
  } catch (const Error&) {
    ++unreadable_;  // an event of a kind that nobody knows ends nothing
    return false;
  }
}

/// A service may say why it closes or falls silent, on a channel of its own: waits for it a little.
void InverseDevice::hear_last_events() {
  if (events_ == nullptr) return;
  const std::int64_t until_ns = now_ns() + static_cast<std::int64_t>(kLastEvents_s * 1e9);
  for (int i = 0; i < kMostLastEvents; ++i) {
    const double left_s = std::max(0.0, seconds_between(now_ns(), until_ns));
    const std::optional<std::string> text = events_->receive(left_s);
    if (!text || take_event(*text)) return;
  }
}

/// Until the loop has written another force, or a fraction of a period is over.
void InverseDevice::wait_for_order() noexcept {
  const double wait_s = preparation_.period_s / kMessagesPerPeriod;
  if (address_.poll) {
    const std::int64_t until_ns = now_ns() + static_cast<std::int64_t>(wait_s * 1e9);
    while (orders_.load(std::memory_order_acquire) == orders_seen_ && now_ns() < until_ns &&
           !ending_) {
    }
  } else {
    pollfd wanted{wake_.handle(), POLLIN, 0};
    const timespec time{0, static_cast<long>(wait_s * 1e9)};
    if (::ppoll(&wanted, 1, &time, nullptr) > 0) {
      std::uint64_t count = 0;
      (void)!::read(wake_.handle(), &count, sizeof count);
    }
  }
  orders_seen_ = orders_.load(std::memory_order_acquire);
}

void InverseDevice::exchange_in_turn() noexcept {
  try {
    if (!address_.poll) (void)become_real_time(RealTimeWish::ignore);
    ask_for_first_state();
    begun_ = true;
    while (!ending_ && service_->over().empty()) {
      const bool cut = cut_;  // before the force: what is cut later is not in this message
      const Eigen::Vector3d force_N = force_to_send();
      (void)exchange(force_message(format_, device_.id, force_N), kMostUnanswered_s);
      if (cut) zero_sent_ = true;
      look_for_events();
      wait_for_order();
    }
  } catch (const std::exception& error) {
    fail(Fault::unknown, error.what());
  } catch (...) {
    fail(Fault::unknown, "something that is no error was thrown");
  }
  say_goodbye();
  over_ = true;
}

/// A zero force, and the end of both connections. Of a connection that was lost the last events are
/// heard, which takes kLastEvents_s at most.
void InverseDevice::say_goodbye() noexcept {
  try {
    if (prepared_ && service_->over().empty()) {
      (void)service_->send(force_message(format_, device_.id, Eigen::Vector3d::Zero()), 0.002);
    }
  } catch (...) {  // no memory: the connection closes below
  }
  if (service_->over().empty()) service_->close();
  try {
    const Fault fault = fault_;
    const bool being_set = failing_ && fault == Fault::none;  // by the thread of the loop
    if (fault == Fault::connection || being_set) hear_last_events();
  } catch (...) {  // no memory: the cause stays that of the connection
  }
  if (events_ != nullptr) events_->close();
}

DeviceAnswer InverseDevice::read(Eigen::Vector3d& position_m) noexcept {
  const bool newer = answer_.refresh();
  if (newer) {
    seen_ = answer_.latest();
    if (!seen_.state.force_named) {
      forces_.no_report();
    } else {
      forces_.report(seen_.state.force_N, session_ns());
    }
  }
  const double age_s = seconds_between(seen_.asked_ns, now_ns());
  if (preparation_.real_time && age_s > preparation_.watchdog_s) {
    fail(Fault::connection, "no state of the service in the watchdog's time");
    return DeviceAnswer::failed;
  }
  position_m = seen_.state.position_m;
  const bool fresh = newer && age_s <= preparation_.period_s;
  if (fresh || !preparation_.real_time) return DeviceAnswer::ok;
  ++status_.time_guards;
  return DeviceAnswer::time_guard;
}

DeviceAnswer InverseDevice::write(const Eigen::Vector3d& force_N) noexcept {
  if (cut_ || fault_ != Fault::none) return DeviceAnswer::failed;
  const bool clipped = force_N.norm() > preparation_.max_force_N;
  if (clipped) ++status_.saturations;
  ++written_;
  forces_.command(limited(force_N, preparation_.max_force_N), session_ns());
  order_.write({force_N, now_ns()});
  if (preparation_.real_time) {
    orders_.fetch_add(1, std::memory_order_release);
    if (!address_.poll) wake();
  } else {
    try {
      if (!exchange(force_message(format_, device_.id, force_to_send()), kPatience_s)) {
        lose_connection("the service is silent");
        return DeviceAnswer::failed;
      }
      look_for_events();
    } catch (...) {
      fail(Fault::unknown, "no memory for a message");
      return DeviceAnswer::failed;
    }
  }
  return clipped ? DeviceAnswer::saturated : DeviceAnswer::ok;
}

DeviceStatus InverseDevice::status() noexcept {
  Fault fault = fault_.load(std::memory_order_acquire);
  const FaultWords* words = &fault_words_;
  if (const Fault told = told_fault_.load(std::memory_order_acquire);
      fault == Fault::connection && told != Fault::none) {
    fault = told;
    words = &told_words_;
  }
  status_.failed = fault == Fault::connection;
  status_.forces_off = forces_off(fault);
  if (fault == Fault::none && cut_) status_.forces_off = ForcesOff::software;
  if (fault != Fault::none) {
    status_.error = 1;
    std::memcpy(status_.error_text, words->data(), sizeof status_.error_text);
  }
  return status_;
}

ForcesOff InverseDevice::forces_off(Fault fault) noexcept {
  switch (fault) {
    case Fault::none:
    case Fault::connection:
      return ForcesOff::none;
    case Fault::unplugged:
      return ForcesOff::unplugged;
    case Fault::software:
      return ForcesOff::software;
    case Fault::watchdog:
      return ForcesOff::watchdog;
    case Fault::unknown:
      break;
  }
  return ForcesOff::unknown;
}

/// Time for the comparison of forces. In virtual time the clock says nothing.
std::int64_t InverseDevice::session_ns() const noexcept {
  if (preparation_.real_time) return now_ns();
  return static_cast<std::int64_t>(static_cast<double>(written_) * preparation_.period_s * 1e9);
}

std::vector<DeviceFinding> InverseDevice::findings() const {
  std::vector<DeviceFinding> found = noticed_;
  for (DeviceFinding& finding : forces_.findings()) found.push_back(std::move(finding));
  return found;
}

HandState InverseDevice::hand() noexcept {
  HandState hand;
  hand.buttons = seen_.state.buttons;
  if (seen_.state.has_grip) {
    const Eigen::Quaterniond& grip = seen_.state.grip;
    const double wxyz[4] = {grip.w(), grip.x(), grip.y(), grip.z()};
    std::transform(std::begin(wxyz), std::end(wxyz), hand.grip,
                   [](double v) { return static_cast<float>(v); });
  }
  return hand;
}

void InverseDevice::wake() noexcept {
  const std::uint64_t one = 1;
  (void)!::write(wake_.handle(), &one, sizeof one);
}

/// Waits for the last zero a little and never for the thread of the messages: the loop may be in
/// its last cycle. The destructor waits.
void InverseDevice::stop() noexcept {
  forces_on_ = false;
  if (ending_.exchange(true)) return;
  wake();
  if (!messages_.joinable()) {
    if (service_ != nullptr) say_goodbye();
    return;
  }
  constexpr timespec kLook{0, 100'000};
  constexpr int kLooks = 30;
  for (int i = 0; i < kLooks && !over_; ++i) (void)::nanosleep(&kLook, nullptr);
}

/// Until the thread of the messages has heard the last events and is over.
bool InverseDevice::learn_end() noexcept {
  constexpr timespec kLook{0, 1'000'000};
  constexpr int kLooks = 2000;
  for (int i = 0; i < kLooks && messages_.joinable() && !over_; ++i) {
    (void)::nanosleep(&kLook, nullptr);
  }
  return true;
}

void InverseDevice::cut_forces() noexcept {
  // The thread of the messages is not the one that is stuck: it sends zero from now on.
  cut_ = true;
  wake();
  constexpr timespec kLook{0, 100'000};
  constexpr int kLooks = 50;
  for (int i = 0; i < kLooks && messages_.joinable() && !zero_sent_; ++i) {
    (void)::nanosleep(&kLook, nullptr);
  }
}

}  // namespace tpm::haptics
