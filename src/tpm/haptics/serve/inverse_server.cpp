#include "tpm/haptics/serve/inverse_server.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

#include "tpm/haptics/loop/real_time.hpp"
#include "tpm/haptics/serve/inverse_connection.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

constexpr std::size_t kMostWaitingBytes = 262'144;  // that a client does not read
constexpr std::size_t kMostDiscarded = 16'777'216;  // after the last word to a client
constexpr std::int64_t kTimeToAsk_ns = 2'000'000'000, kTimeToLeave_ns = 2'000'000'000,
                       kTimeToDrive_ns = 2'000'000'000;  ///< of silence, then others may
constexpr int kLook_ms = 50;
constexpr double kFarthest_m = 1.0;  // a place that a hand is asked to go to

bool waits() {
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

}  // namespace

InverseServer::InverseServer(ServedHand& hand, InverseServerSettings settings)
    : hand_(hand),
      settings_(std::move(settings)),
      listening_(listen_on_loopback(settings_.port, "--port")),
      events_(settings_.events_port < 0
                  ? Socket()
                  : listen_on_loopback(settings_.events_port, "--events-port")),
      port_(port_of(listening_)),
      events_port_(events_.open() ? port_of(events_) : -1),
      thread_([this] { serve(); }) {}

InverseServer::~InverseServer() {
  ending_ = true;
  thread_.join();
}

InverseServer::Counts InverseServer::counts() const noexcept {
  return {connected_, refused_, messages_, states_, unreadable_, closed_for_fault_};
}

void InverseServer::say(Connection& c, const std::string& line) {
  if (!settings_.log || ++c.lines > Connection::kMostLines) return;
  const std::string who = c.session == 0 ? "a connection" : fmt::format("client {}", c.session);
  settings_.log(
      fmt::format("{}: {}{}", who, line,
                  c.lines == Connection::kMostLines ? " (its last line but who drives)" : ""));
}

void InverseServer::serve() {
  // Clients' watchdogs count in milliseconds. One that never sleeps would leave nothing to others.
  if (!settings_.poll) (void)become_real_time(RealTimeWish::ignore);
  std::vector<pollfd> wanted;
  while (!ending_) {
    wanted = {{listening_.handle(), POLLIN, 0}, {events_.handle(), POLLIN, 0}};
    for (const auto& c : connections_) {
      const short events = static_cast<short>(POLLIN | (c->out.empty() ? 0 : POLLOUT));
      wanted.push_back({c->socket.handle(), events, 0});
    }
    (void)::poll(wanted.data(), wanted.size(),
                 settings_.poll && !connections_.empty() ? 0 : kLook_ms);
    const std::size_t there = connections_.size();
    for (std::size_t i = 0; i < there; ++i) {
      Connection& c = *connections_[i];
      try {
        if (wanted[i + 2].revents != 0) take_bytes(c);
        look_at(c);
      } catch (const std::exception& error) {  // of a stranger's message: nothing of ours is broken
        say(c, error.what());
        end_of(c);
      }
    }
    if (wanted[0].revents != 0) accept_new(listening_, false);
    if (wanted[1].revents != 0) accept_new(events_, true);
    send_events();
    tell_driver();
    std::erase_if(connections_, [](const auto& c) { return c->stage == Connection::Stage::gone; });
  }
  for (const auto& c : connections_) {
    if (c->stage != Connection::Stage::open) continue;
    send(*c, frame_bytes(FrameKind::close, close_payload(kCloseGoingAway, "the server ends")));
  }
  hand_.let_go();
}

void InverseServer::tell(const InverseEvent& event) {
  const std::lock_guard<std::mutex> lock(mutex_);
  to_tell_.push_back(frame_bytes(FrameKind::text, event_message(event)));
}

void InverseServer::send_events() {
  std::vector<std::string> frames;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    frames.swap(to_tell_);
  }
  for (const std::string& frame : frames) {
    for (const auto& c : connections_) {
      if (c->events && c->stage == Connection::Stage::open) send(*c, frame);
    }
  }
}

void InverseServer::accept_new(const Socket& listening, bool events) {
  Socket socket = accepted(listening);
  if (!socket.open()) return;
  const auto count = [this](bool turned_away) {
    return static_cast<std::size_t>(std::ranges::count_if(connections_, [&](const auto& c) {
      return c->turned_away == turned_away && c->stage != Connection::Stage::gone;
    }));
  };
  if (count(false) >= kMostConnections) {
    ++refused_;
    if (settings_.log && !full_ && ++times_full_ <= Connection::kMostLines) {
      settings_.log(fmt::format("{} connections are open: others are refused", kMostConnections));
    }
    full_ = true;
    if (count(true) >= kMostConnections) return;  // closed without a word
    connections_.push_back(std::make_unique<Connection>(std::move(socket)));
    Connection& c = *connections_.back();
    c.turned_away = true;
    send(c, http_answer("503 Service Unavailable", "text/plain",
                        fmt::format("{} connections are open\n", kMostConnections)));
    return c.enter(Connection::Stage::leaving);
  }
  full_ = false;
  ++connected_;
  connections_.push_back(std::make_unique<Connection>(std::move(socket)));
  connections_.back()->events = events;
}

/// Ends a connection or a drive whose time is over.
void InverseServer::look_at(Connection& c) {
  using Stage = Connection::Stage;
  flush(c);
  const std::int64_t age_ns = now_ns() - c.since_ns;
  if (c.stage == Stage::asking && age_ns > kTimeToAsk_ns) {
    say(c, "asks for nothing");
    end_of(c);
  }
  if (c.stage == Stage::open && driver_ == c.session && c.session != 0 &&
      now_ns() - c.pushed_ns > kTimeToDrive_ns) {
    drive(0);
  }
  if (c.stage != Stage::leaving) return;
  if (c.out.empty() && !c.shut) {
    // Receives the remaining bytes, so that the system does not withdraw the last words.
    (void)::shutdown(c.socket.handle(), SHUT_WR);
    c.shut = true;
  }
  if (age_ns > kTimeToLeave_ns || c.discarded > kMostDiscarded) end_of(c);
}

void InverseServer::take_bytes(Connection& c) {
  using Stage = Connection::Stage;
  std::array<char, 65'536> block;
  const ssize_t count = ::recv(c.socket.handle(), block.data(), block.size(), 0);
  if (count == 0 || (count < 0 && !waits())) return end_of(c);
  if (count < 0) return;
  const std::string_view bytes(block.data(), static_cast<std::size_t>(count));
  if (c.stage == Stage::leaving) {
    c.discarded += bytes.size();
  } else if (c.stage == Stage::asking) {
    c.head.append(bytes);
    take_head(c);
  } else if (c.stage == Stage::open) {
    c.reader.feed(bytes);
    take_messages(c);
  }
}

void InverseServer::take_head(Connection& c) {
  const std::size_t end = c.head.find("\r\n\r\n");
  if (end == std::string::npos && c.head.size() <= kMostHeadBytes) return;
  const std::optional<HttpHead> head = parse_http_head(c.head);
  if (!head) {
    ++refused_;
    say(c, "refused: no request");
    send(c, http_answer("400 Bad Request", "text/plain", "no request\n"));
    return c.enter(Connection::Stage::leaving);
  }
  if (head->count("transfer-encoding") != 0) {
    ++refused_;
    say(c, "refused: a body in chunks");
    send(c, http_answer("501 Not Implemented", "text/plain",
                        "a body in chunks (Transfer-Encoding) is not read\n"));
    return c.enter(Connection::Stage::leaving);
  }
  if (head->count("upgrade") == 0) return answer_http(c, *head);
  const UpgradeAnswer answer = answer_upgrade(*head, c.events ? events_port_ : port_, {port_});
  send(c, answer.bytes);
  if (!answer.upgraded) {
    ++refused_;
    say(c, "refused: " + answer.why);
    return c.enter(Connection::Stage::leaving);
  }
  c.session = next_session_++;
  c.enter(Connection::Stage::open);
  if (!c.events) send(c, frame_bytes(FrameKind::text, inventory_message(inventory(&c))));
  const std::string left = c.head.substr(end + 4);
  c.head.clear();
  c.reader.feed(left);
  take_messages(c);
}

InverseState InverseServer::state_for(const Connection& c) const {
  InverseState state = hand_.state();
  if (!c.centred) state.position_m += settings_.centre_m;
  state.driven = driver_ != 0;
  return state;
}

InverseInventory InverseServer::inventory(const Connection* c) const {
  InverseInventory all;
  all.devices = {settings_.device};
  InverseDeviceEntry& device = all.devices.front();
  if (c != nullptr) {
    all.session = c->session;
    device.state = state_for(*c);
    if (c->centred) device.settings.preset = kCentredPreset;
  } else {
    device.state = hand_.state();
    device.state.position_m += settings_.centre_m;
    device.state.driven = driver_ != 0;
  }
  return all;
}

void InverseServer::answer_http(Connection& c, const HttpHead& head) {
  c.enter(Connection::Stage::leaving);
  const std::string path = head.start[1].substr(0, head.start[1].find('?'));
  const bool simulated = settings_.device.simulated;
  if (!names_this_host(head, port_)) {
    ++refused_;
    say(c, "refused: Host is not this machine");
    return send(c, http_answer("403 Forbidden", "text/plain", "Host is not this machine\n"));
  }
  if (head.count("origin") != 0 && !is_origin_of(head.value("origin"), port_)) {
    ++refused_;
    say(c, "refused: Origin is a page of somebody else");
    return send(c,
                http_answer("403 Forbidden", "text/plain", "Origin is a page of somebody else\n"));
  }
  if (head.start[0] != "GET") {
    return send(
        c, http_answer("405 Method Not Allowed", "text/plain", "GET only\n", "Allow: GET\r\n"));
  }
  if (path == "/version" || path == "/3.0/version") {
    return send(c, http_answer("200 OK", "application/json",
                               version_message(settings_.version, simulated)));
  }
  if (path == "/devices" || path == "/3.0/devices") {
    // "?session=#7", as that session sees it.
    const std::size_t number = head.start[1].find("session=%23");
    const std::string session =
        number == std::string::npos ? "" : head.start[1].substr(number + 11);
    const auto asked = std::ranges::find_if(connections_, [&](const auto& other) {
      return other->session != 0 && std::to_string(other->session) == session;
    });
    return send(
        c, http_answer(
               "200 OK", "application/json",
               inventory_message(inventory(asked == connections_.end() ? nullptr : asked->get()))));
  }
  if (path == "/" && !settings_.page.empty()) {
    return send(
        c, http_answer("200 OK", "text/html; charset=utf-8", settings_.page,
                       "Content-Security-Policy: default-src 'none'; img-src data:; script-src "
                       "'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self' "
                       "ws://127.0.0.1:* ws://localhost:*; base-uri 'none'; form-action "
                       "'none'; frame-ancestors 'none'\r\nReferrer-Policy: no-referrer\r\n"));
  }
  send(c, http_answer("404 Not Found", "text/plain", "nothing here\n"));
}

void InverseServer::take_messages(Connection& c) {
  using Stage = Connection::Stage;
  while (c.stage == Stage::open) {
    const std::optional<WebSocketMessage> message = c.reader.next();
    if (!message) break;
    switch (message->kind) {
      case FrameKind::text:
        take_text(c, message->payload);
        break;
      case FrameKind::binary:
        take_text(c, "");  // is no JSON
        break;
      case FrameKind::ping:
        send(c, frame_bytes(FrameKind::pong, message->payload));
        break;
      case FrameKind::close:
        send(c, frame_bytes(FrameKind::close, close_payload(kCloseNormal, "")));
        c.enter(Stage::leaving);
        release(c);
        break;
      default:
        break;
    }
  }
  if (c.stage == Stage::open && c.reader.fault() != 0) {
    fault(c, c.reader.fault(), c.reader.fault_words());
  }
}

/// Exactly one state, whatever the text.
void InverseServer::take_text(Connection& c, const std::string& text) {
  if (c.events) return;  // read only
  ++messages_;
  try {
    obey(c, parse_command(text, settings_.device.id));
  } catch (const Error& error) {
    ++unreadable_;
    if (driver_ == c.session) hand_.push(Eigen::Vector3d::Zero());
    say(c, error.what());
  }
  ++states_;
  send(c, frame_bytes(FrameKind::text, state_message(c.session, settings_.device.id, state_for(c),
                                                     settings_.device.simulated)));
}

void InverseServer::obey(Connection& c, const InverseCommand& command) {
  if (!command.profile.empty()) say(c, "registers as " + command.profile);
  set(c, command);
  if (command.of_another_device && c.first("another device")) {
    say(c, "speaks to a device that is not here");
  }
  if (command.position_m) move(c, *command.position_m);
  if (command.buttons) {
    presser_ = c.session;
    hand_.press(*command.buttons);
  }
  if (!command.force_N) {
    // Commands are applied once and forgotten.
    if (driver_ == c.session) hand_.push(Eigen::Vector3d::Zero());
    return;
  }
  if (driver_ == 0 && !command.force_N->isZero()) drive(c.session);
  if (driver_ == c.session) {
    c.pushed_ns = now_ns();
    return hand_.push(*command.force_N);
  }
  if (driver_ == 0) return;  // zero, and the hand feels none
  if (c.first("reads")) say(c, fmt::format("reads only, client {} drives", driver_));
}

/// Applies a client's settings. There is neither a gate nor a damping to switch on, and one basis.
void InverseServer::set(Connection& c, const InverseCommand& command) {
  InverseSettings& device = settings_.device.settings;
  const auto stays = [&](const std::string& kind, const std::string& asked, std::string_view kept) {
    if (!c.first(kind)) return;
    say(c, fmt::format("asks for {} {}; it stays {}", kind, printable(asked), kept));
  };
  const std::string& preset = command.preset;
  if (!preset.empty() && (preset == kCentredPreset || preset == device.preset)) {
    c.centred = preset == kCentredPreset;
  } else if (!preset.empty()) {
    stays("the preset", preset, c.centred ? kCentredPreset : std::string_view(device.preset));
  }
  if (!command.basis.empty() && command.basis != device.basis) {
    stays("the basis", command.basis, device.basis);
  }
  if (command.force_gate_gain.value_or(0.0) != 0.0) {
    stays("a force gate of", fmt::format("{}", *command.force_gate_gain),
          fmt::format("{}", device.force_gate_gain));
  } else if (command.force_gate_gain) {
    device.force_gate_gain = 0.0;
  }
  const Eigen::Vector3d& by_direction = command.directional_damping;
  if (command.damping.value_or(0.0) != 0.0 || !by_direction.isZero()) {
    stays("a damping of",
          fmt::format("{}, by direction {} {} {}", command.damping.value_or(0.0), by_direction.x(),
                      by_direction.y(), by_direction.z()),
          fmt::format("{}", device.damping));
  }
  for (const std::string& name : command.unread) {
    if (c.first(name)) say(c, fmt::format("asks for {}, which is not here", name));
  }
}

void InverseServer::move(Connection& c, const Eigen::Vector3d& position_m) {
  if (position_m.norm() > kFarthest_m) {
    if (c.first("far")) {
      say(c, fmt::format("asks for a place {:.3g} m away; expected at most {} m", position_m.norm(),
                         kFarthest_m));
    }
    return;
  }
  if (mover_ == 0) mover_ = c.session;
  if (mover_ != c.session) {
    if (c.first("moves not")) {
      say(c, fmt::format("does not move the hand, client {} does", mover_));
    }
    return;
  }
  hand_.move_to(position_m -
                (c.centred ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : settings_.centre_m));
}

void InverseServer::fault(Connection& c, std::uint16_t code, const std::string& why) {
  ++closed_for_fault_;
  say(c, fmt::format("closed with {}: {}", code, why));
  send(c, frame_bytes(FrameKind::close, close_payload(code, why)));
  c.enter(Connection::Stage::leaving);
  release(c);
}

/// @param session 0: nobody
void InverseServer::drive(std::int64_t session) {
  driver_ = session;
  if (session == 0) hand_.let_go();
  driver_log_.change(session);
  tell_driver();
}

void InverseServer::tell_driver() {
  if (!settings_.log) return;
  if (const std::string line = driver_log_.line(now_ns()); !line.empty()) settings_.log(line);
}

/// Whatever this client held is free again.
void InverseServer::release(Connection& c) {
  if (c.session == 0) return;
  if (driver_ == c.session) drive(0);
  if (mover_ == c.session) {
    mover_ = 0;
    hand_.move_to(std::nullopt);
  }
  if (presser_ == c.session) {
    presser_ = 0;
    hand_.press(0);
  }
}

void InverseServer::end_of(Connection& c) {
  if (c.stage == Connection::Stage::open && c.reader.amid()) {
    say(c, "gone in the middle of a message");
  }
  c.socket.close();
  c.enter(Connection::Stage::gone);
  release(c);
}

void InverseServer::send(Connection& c, std::string_view bytes) {
  if (c.stage == Connection::Stage::gone) return;
  c.out.append(bytes);
  flush(c);
  if (c.out.size() > kMostWaitingBytes) {
    ++closed_for_fault_;
    say(c, "does not read");
    end_of(c);
  }
}

void InverseServer::flush(Connection& c) {
  while (c.stage != Connection::Stage::gone && !c.out.empty()) {
    const ssize_t count = ::send(c.socket.handle(), c.out.data(), c.out.size(), MSG_NOSIGNAL);
    if (count <= 0) {
      if (count < 0 && !waits()) end_of(c);
      return;
    }
    c.out.erase(0, static_cast<std::size_t>(count));
  }
}

}  // namespace tpm::haptics
