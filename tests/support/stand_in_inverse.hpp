#pragma once
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tpm/files/json.hpp"
#include "tpm/haptics/device/virtual_plant.hpp"
#include "tpm/haptics/inverse/inverse_device.hpp"
#include "tpm/haptics/loop/real_time.hpp"

namespace tpm::test {
using namespace haptics;

/// Departures of the stand-in from a service that works.
struct StandInFaults {
  std::string version = "3.5.0.0";
  bool simulated = true;               ///< it says so
  bool in_use = false;                 ///< its status and control mode say so
  int close_code = 0;                  ///< of How::close; 0: no close frame
  std::string close_reason;            ///< the same
  bool closes_behind_a_state = false;  ///< in one piece with the close frame
  bool no_inventory = false;           ///< it accepts and is silent
  bool no_events = false;              ///< nobody listens there
  bool names_no_filters = false, names_no_damping = false;
  /// Initial settings; each is set by HTTP, force gate, damping and preset by a message too.
  std::string preset = "defaults", basis = "XYZ";
  double gate = 0.3, damping = 0.0, damping_along_z = 0.0, gravity = 0.0;
  double mount_turned_rad = 0.0, scale = 1.0;  ///< about x; of the mount
  double mounted_m = 0.0;                      ///< along x
  bool torque_scaling = false, names_no_gravity = false, no_inventory_json = false;
  std::string last_event;          ///< name of one that is sent just before `how` acts
  std::vector<std::string> keeps;  ///< names of those that it does not change
  std::vector<std::string> devices = {"049D"};
  std::string wrong_accept;       ///< in place of Sec-WebSocket-Accept
  bool settings_by_http = false;  ///< what a message configures is not heard
  int unasked_states = 0;         ///< behind the inventory, of a hand at kElsewhere_m
  int answers = 1'000'000;        ///< after so many it is silent
  double late_s = 0.0;            ///< from a message to its state
  double jitter_s = 0.0;          ///< at most so much more, in no order
  /// From this message with a force on, what `how` says, a connection is closed once; 0: never.
  int from = 0;
  enum class How {
    silence,
    garbage,
    other_device,
    no_device,  ///< its states list none
    close,
    drop_every_third,
    workspace,
    gate,         ///< it renders, and reports, `rendered` of a force
    gate_unseen,  ///< it renders as much, and reports the command
    no_report     ///< its states name no force
  } how = How::silence;
  double rendered = 0.5;  ///< of a force, of How::gate and How::gate_unseen after `from`
  /// In each state, of How::workspace after `from`.
  std::string transform = R"({"scale":{"x":10,"y":10,"z":10}})";
};

/// A service on loopback with a simulated device, for tests of the client: the codec of the library
/// and a loop of its own, nothing of `tpm hil serve`.
class StandInInverse {
 public:
  /// @param on_the_clock the plant moves with the time; else by a period for each force
  StandInInverse(const PlantSettings& plant, OperatorScript script, bool on_the_clock,
                 StandInFaults faults = {});
  ~StandInInverse();
  StandInInverse(const StandInInverse&) = delete;
  StandInInverse& operator=(const StandInInverse&) = delete;

  [[nodiscard]] int port() const { return port_of(service_); }
  [[nodiscard]] InverseAddress address(std::string id = {}) const {
    return {port(), port_of(events_), port(), std::move(id)};
  }
  /// The script of the hand begins.
  void begin();
  void tell(const InverseEvent& event);
  void press(std::uint32_t buttons) {
    const std::lock_guard<std::mutex> lock(mutex_);
    buttons_ = buttons;
  }
  [[nodiscard]] int forces() const { return forces_; }
  [[nodiscard]] double largest_N();
  [[nodiscard]] Eigen::Vector3d last_N();
  [[nodiscard]] std::string last_profile() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return last_profile_;
  }
  [[nodiscard]] InverseFormat last_format() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return last_format_;
  }
  /// Targets of what was posted.
  [[nodiscard]] std::vector<std::string> posts();
  [[nodiscard]] InverseSettings settings() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return set_;
  }

 private:
  void accept_all();
  void talk(Socket socket, bool events);
  [[nodiscard]] std::string http(const HttpHead& head, const std::string& body);
  void post(const std::string& target, const std::string& body);
  /// The texts that answer; nothing: this connection is over.
  [[nodiscard]] std::optional<std::vector<std::string>> answer(const std::string& text);
  [[nodiscard]] InverseInventory inventory();
  [[nodiscard]] std::string inventory_text();
  [[nodiscard]] bool keeps(std::string_view name) const;
  void live();

  StandInFaults faults_;
  bool on_the_clock_;
  PlantSettings settings_;
  std::atomic<int> answers_left_;
  Socket service_, events_;
  std::mutex mutex_;  ///< of what follows
  VirtualPlant plant_;
  std::int64_t lived_until_ns_ = 0;
  double largest_N_ = 0.0;
  Eigen::Vector3d last_N_ = Eigen::Vector3d::Zero(), rendered_N_ = last_N_;
  std::string last_profile_;
  InverseFormat last_format_ = InverseFormat::vector;
  std::uint32_t buttons_ = 0;
  InverseSettings set_;
  std::vector<std::string> posts_;
  std::vector<int> listeners_;
  std::atomic<int> forces_{0};
  std::atomic<bool> ending_{false}, told_{false};
  std::vector<std::thread> talks_;
  std::thread accepting_;
};

namespace stand_in {

inline const Eigen::Vector3d kCentre_m(0.0, -0.12, 0.15), kElsewhere_m(0.05, 0.0, 0.0);

inline void send_bytes(int socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(count));
    } else if (errno != EAGAIN) {
      return;
    }
  }
}

/// Of a service that has no watchdog of its own.
inline PlantSettings never_cut(PlantSettings plant) {
  plant.watchdog_s = 1e9;
  return plant;
}

inline void send_text(int socket, std::string_view text) {
  send_bytes(socket, frame_bytes(FrameKind::text, text));
}

}  // namespace stand_in

inline StandInInverse::StandInInverse(const PlantSettings& plant, OperatorScript script,
                                      bool on_the_clock, StandInFaults faults)
    : faults_(std::move(faults)),
      on_the_clock_(on_the_clock),
      settings_(plant),
      answers_left_(faults_.answers),
      service_(listen_on_loopback(0)),
      events_(listen_on_loopback(0)),
      plant_(stand_in::never_cut(plant), std::move(script)),
      lived_until_ns_(now_ns()),
      accepting_([this] { accept_all(); }) {
  plant_.await();
  set_.handedness = "left";
  set_.preset = faults_.preset;
  set_.basis = faults_.basis;
  set_.mount_rotation = Eigen::AngleAxisd(faults_.mount_turned_rad, Eigen::Vector3d::UnitX());
  set_.mount_scale *= faults_.scale;
  set_.mount_position_m.x() = faults_.mounted_m;
  set_.torque_scaling = faults_.torque_scaling;
  set_.filters_named = true;
  set_.force_gate_gain = faults_.gate;
  set_.damping = faults_.damping;
  set_.directional_damping.z() = faults_.damping_along_z;
  set_.gravity_compensation = faults_.gravity > 0.0;
  set_.gravity_scaling = faults_.gravity;
}

inline StandInInverse::~StandInInverse() {
  ending_ = true;
  accepting_.join();
  for (std::thread& talk : talks_) talk.join();
}

inline void StandInInverse::begin() {
  const std::lock_guard<std::mutex> lock(mutex_);
  plant_.begin();
}

inline void StandInInverse::tell(const InverseEvent& event) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const int listener : listeners_) stand_in::send_text(listener, event_message(event));
}

inline double StandInInverse::largest_N() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return largest_N_;
}

inline Eigen::Vector3d StandInInverse::last_N() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return last_N_;
}

inline bool StandInInverse::keeps(std::string_view name) const {
  return std::find(faults_.keeps.begin(), faults_.keeps.end(), name) != faults_.keeps.end();
}

inline std::vector<std::string> StandInInverse::posts() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return posts_;
}

inline void StandInInverse::accept_all() {
  while (!ending_) {
    pollfd wanted[] = {{service_.handle(), POLLIN, 0}, {events_.handle(), POLLIN, 0}};
    if (::poll(wanted, 2, 10) <= 0) continue;
    for (const bool events : {false, true}) {
      if (wanted[events ? 1 : 0].revents == 0) continue;
      Socket socket = accepted(events ? events_ : service_);
      if (!socket.open()) continue;
      talks_.emplace_back([this, events, s = std::make_shared<Socket>(std::move(socket))] {
        talk(std::move(*s), events);
      });
    }
  }
}

/// The plant catches up with the clock.
inline void StandInInverse::live() {
  const auto period_ns = static_cast<std::int64_t>(settings_.period_s * 1e9);
  for (const std::int64_t now = now_ns(); on_the_clock_ && lived_until_ns_ + period_ns <= now;
       lived_until_ns_ += period_ns) {
    plant_.advance();
  }
}

inline InverseInventory StandInInverse::inventory() {
  const std::lock_guard<std::mutex> lock(mutex_);
  live();
  InverseInventory all;
  all.session = 7;
  for (const std::string& id : faults_.devices) {
    InverseDeviceEntry entry;
    entry.id = id;
    entry.type = "inverse3";
    entry.simulated = faults_.simulated;
    entry.state.driven = faults_.in_use;
    entry.settings = set_;
    entry.state.position_m = plant_.measured_m();
    if (set_.preset != kCentredPreset) entry.state.position_m += stand_in::kCentre_m;
    all.devices.push_back(entry);
  }
  return all;
}

/// Hardware has a status, too.
inline std::string StandInInverse::inventory_text() {
  if (faults_.no_inventory_json) return R"({"inverse3":[{"device_id":)";
  std::string text = inventory_message(inventory());
  if (faults_.names_no_gravity) text.replace(text.find("\"gravity_comp"), 13, "\"unnamed_");
  const std::string bare = R"("status":{})";
  const std::size_t at = faults_.in_use ? text.find(bare) : text.npos;
  return at == text.npos ? text : text.replace(at, bare.size(), R"("status":{"in_use":true})");
}

inline void StandInInverse::post(const std::string& target, const std::string& body) {
  const std::lock_guard<std::mutex> lock(mutex_);
  posts_.push_back(target);
  const auto sets = [&](const char* name) {
    return target.find(std::string("/") + name) != target.npos && !keeps(name);
  };
  const auto set = files::parse_json(body, "body");
  if (sets("gravity_compensation")) {
    const bool old = faults_.version < "3.5";
    set_.gravity_compensation = set.at(old ? "enable" : "enabled").get<bool>();
    set_.gravity_scaling = set.at(old ? "gravity_scaling_factor" : "scaling_factor").get<double>();
  }
  if (sets("torque_scaling")) set_.torque_scaling = set.at("enabled").get<bool>();
  if (sets("preset")) set_.preset = set.at("preset").get<std::string>();
  if (sets("basis")) set_.basis = set.at("permutation").get<std::string>();
  if (sets("force_gate")) set_.force_gate_gain = set.at("gain").get<double>();
  const auto part = [](const auto& json, const char* key) {
    return json.at(key).template get<double>();
  };
  if (sets("damping")) {
    set_.damping = part(set, "scalar");
    const auto along = set.at("vector");
    set_.directional_damping = {part(along, "x"), part(along, "y"), part(along, "z")};
  }
  if (sets("mount")) {
    const auto rotation = set.at("transform").at("rotation"),
               scale = set.at("transform").at("scale");
    set_.mount_position_m.x() = part(set.at("transform").at("position"), "x");
    set_.mount_rotation = {part(rotation, "w"), part(rotation, "x"), part(rotation, "y"),
                           part(rotation, "z")};
    set_.mount_scale = {part(scale, "x"), part(scale, "y"), part(scale, "z")};
  }
}

inline std::string StandInInverse::http(const HttpHead& head, const std::string& body) {
  if (head.start[0] == "POST") {
    post(head.start[1], body);
    return http_answer("200 OK", "application/json", R"({"ok":true})");
  }
  const std::string path = head.start[1].substr(0, head.start[1].find('?'));
  const bool old = faults_.version < "3.5";
  if (path == (old ? "/3.0/version" : "/version")) {
    return http_answer("200 OK", "application/json",
                       fmt::format(R"({{"project_version":"{}"}})", faults_.version));
  }
  if (path == (old ? "/3.0/devices" : "/devices")) {
    std::string text = inventory_text();
    if (faults_.names_no_filters) {
      const std::size_t at = text.find("\"filters\"");
      text.replace(at, 9, "\"unnamed\"");
    }
    if (faults_.names_no_damping) text.replace(text.find("\"damping\""), 9, "\"unnamed\"");
    return http_answer("200 OK", "application/json", text);
  }
  return http_answer("404 Not Found", "text/plain", "no\n");
}

inline std::optional<std::vector<std::string>> StandInInverse::answer(const std::string& text) {
  using How = StandInFaults::How;
  const std::vector<std::string> none;
  const InverseCommand command = parse_command(text, faults_.devices.at(0));
  InverseState state;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!faults_.settings_by_http) {
      if (command.force_gate_gain && !keeps("force_gate")) {
        set_.force_gate_gain = *command.force_gate_gain;
      }
      if (command.damping && !keeps("damping")) {
        set_.damping = *command.damping;
        set_.directional_damping.setZero();  // the message has both
      }
      if (!command.preset.empty() && !keeps("preset")) set_.preset = command.preset;
    }
    if (!command.profile.empty()) last_profile_ = command.profile;
    live();
    if (command.force_N) {
      ++forces_;
      last_format_ =
          text.find("\"values\"") == text.npos ? InverseFormat::vector : InverseFormat::values;
      last_N_ = *command.force_N;
      largest_N_ = std::max(largest_N_, last_N_.norm());
      const bool gates = faults_.from > 0 && forces_ >= faults_.from &&
                         (faults_.how == How::gate || faults_.how == How::gate_unseen);
      rendered_N_ = gates ? Eigen::Vector3d(faults_.rendered * last_N_) : last_N_;
      (void)plant_.command(rendered_N_);
      if (!on_the_clock_) plant_.advance();
    }
    state.position_m = plant_.measured_m();
    if (set_.preset != kCentredPreset) state.position_m += stand_in::kCentre_m;
    state.velocity_m_per_s = plant_.velocity_m_per_s();
    state.force_N = faults_.how == How::gate_unseen ? last_N_ : rendered_N_;
    state.has_grip = true;
    state.grip = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
    state.buttons = buttons_;
  }
  std::string id = faults_.devices.at(0);
  if (faults_.from > 0 && forces_ >= faults_.from) {
    if (!faults_.last_event.empty() && !told_.exchange(true)) {
      tell({faults_.last_event, "error", id, "", "last words"});
    }
    if (faults_.how == How::no_device) {
      return std::vector<std::string>{R"({"session_id":7,"inverse3":[]})"};
    }
    if (faults_.how == How::silence) return none;
    if (faults_.how == How::close && command.force_N && forces_ == faults_.from) {
      return std::nullopt;
    }
    if (faults_.how == How::garbage) {
      return std::vector<std::string>{R"({"inverse3": [{"device_id": )"};
    }
    if (faults_.how == How::drop_every_third && forces_ % 3 == 0) return none;
    if (faults_.how == How::other_device) id = "FFFF";
  }
  if (--answers_left_ < 0) return none;
  std::string said = state_message(7, id, state, faults_.simulated);
  if (faults_.how == How::workspace && forces_ >= faults_.from) {
    const std::string before = "\"state\":{";
    said.replace(said.find(before), before.size(),
                 before + "\"transform\":" + faults_.transform + ",");
  }
  if (faults_.how == How::no_report) {
    const std::string name = "\"current_cursor_force\"";
    said.replace(said.find(name), name.size(), "\"unnamed\"");
  }
  return std::vector<std::string>{said};
}

inline void StandInInverse::talk(Socket socket, bool events) {
  std::string head;
  WebSocketReader reader(WebSocketSide::server, 65'536);
  bool open = false;
  std::deque<std::pair<std::int64_t, std::string>> late;  // when to send what
  double irregular = 0.0;
  if (events && faults_.no_events) return;
  while (!ending_) {
    for (; !late.empty() && late.front().first <= now_ns(); late.pop_front()) {
      stand_in::send_text(socket.handle(), late.front().second);
    }
    pollfd wanted{socket.handle(), POLLIN, 0};
    if (::poll(&wanted, 1, late.empty() ? 20 : 1) <= 0) continue;
    char block[16'384];
    const ssize_t count = ::recv(socket.handle(), block, sizeof block, 0);
    if (count == 0 || (count < 0 && errno != EAGAIN)) break;
    if (count < 0) continue;
    const std::string_view bytes(block, static_cast<std::size_t>(count));
    if (!open) {
      head.append(bytes);
      const std::size_t end = head.find("\r\n\r\n");
      const auto request =
          parse_http_head(std::string_view(head).substr(0, end == head.npos ? end : end + 4));
      if (!request) continue;
      if (request->count("upgrade") == 0) {
        const std::string length = request->value("content-length");
        const std::string body = head.substr(end + 4);
        if (!length.empty() && body.size() < std::stoul(length)) continue;
        stand_in::send_bytes(socket.handle(), http(*request, body));
        break;
      }
      auto upgrade = answer_upgrade(*request, port_of(events ? events_ : service_), {}).bytes;
      if (!faults_.wrong_accept.empty()) {
        const std::size_t at = upgrade.find("Accept: ") + 8;
        upgrade.replace(at, upgrade.find("\r\n", at) - at, faults_.wrong_accept);
      }
      stand_in::send_bytes(socket.handle(), upgrade);
      open = true;
      if (events) {
        const std::lock_guard<std::mutex> lock(mutex_);
        listeners_.push_back(socket.handle());
      } else if (!faults_.no_inventory) {
        stand_in::send_text(socket.handle(), inventory_text());
        InverseState elsewhere;
        elsewhere.position_m = stand_in::kElsewhere_m;
        for (int i = 0; i < faults_.unasked_states; ++i) {
          stand_in::send_text(socket.handle(),
                              state_message(7, faults_.devices.at(0), elsewhere, true));
        }
      }
      continue;
    }
    reader.feed(bytes);
    bool goes_on = true;
    while (const auto message = reader.next()) {
      if (message->kind == FrameKind::close) goes_on = false;
      if (message->kind == FrameKind::text && !events) {
        const auto texts = answer(message->payload);
        goes_on = texts.has_value();
        if (!goes_on && faults_.close_code != 0) {
          const std::string end =
              close_payload(static_cast<std::uint16_t>(faults_.close_code), faults_.close_reason);
          const std::string state = state_message(7, faults_.devices.at(0), {}, faults_.simulated);
          const bool both = faults_.closes_behind_a_state;
          stand_in::send_bytes(socket.handle(), (both ? frame_bytes(FrameKind::text, state) : "") +
                                                    frame_bytes(FrameKind::close, end));
        }
        for (const std::string& text : texts.value_or(std::vector<std::string>())) {
          if (faults_.late_s > 0.0) {
            irregular += irregular < 0.381966 ? 0.618034 : -0.381966;  // golden section, in [0, 1)
            const double late_s = faults_.late_s + faults_.jitter_s * irregular;
            const std::int64_t due_ns = now_ns() + static_cast<std::int64_t>(late_s * 1e9);
            // States come in the order of the messages.
            late.emplace_back(late.empty() ? due_ns : std::max(due_ns, late.back().first), text);
          } else {
            stand_in::send_text(socket.handle(), text);
          }
        }
      }
      if (!goes_on) break;
    }
    if (!goes_on) break;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  std::erase(listeners_, socket.handle());
}

}  // namespace tpm::test
