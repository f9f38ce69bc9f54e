#include "tpm/haptics/session/page_server.hpp"

#include <fmt/format.h>
#include <httplib.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <csignal>
#include <semaphore>
#include <thread>

#include "tpm/files/file.hpp"
#include "tpm/haptics/inverse/web_socket.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

using PageClock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr std::size_t kThreads = 8;         // as many requests at a time
constexpr std::size_t kMostWaiting = 16;    // accepted beside them; more wait with the system
constexpr std::size_t kMostBytes = 16'384;  // of a request
constexpr auto kTimeToAsk = 500ms;          // a browser on the same machine asks at once
constexpr auto kTimeToAnswer = 2s;
constexpr auto kLook = 50ms;  // between looks at whether all is over
constexpr int kNice = 10;     // nice value of the page's threads

/// Of the calling thread and those that it starts: Linux keeps a nice value for each.
void lower_priority() {
  (void)setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
}

/// httplib's pool with a bound: when it is full, no more connections are accepted for a while.
class BoundedQueue final : public httplib::ThreadPool {
 public:
  BoundedQueue() : ThreadPool(kThreads) {}
  void enqueue(std::function<void()> task) override {
    room_.acquire();
    ThreadPool::enqueue([this, task = std::move(task)] {
      room_.release();
      task();
    });
  }

 private:
  std::counting_semaphore<kMostWaiting> room_{kMostWaiting};
};

/// The library's own limits do not do: its timeouts begin anew with each byte, a line has no
/// greatest length until it has ended, and headers no greatest number. So a request is read whole
/// before the library sees it.
class HttpServer final : public httplib::Server {
 public:
  std::atomic<bool> ending{false};

 private:
  /// One request a connection: nobody keeps a thread.
  bool process_and_close_socket(socket_t socket) override {
    const std::string answer = answer_to_request(socket);
    const auto until = PageClock::now() + kTimeToAnswer;
    for (std::string_view left = answer; !left.empty() && !over(until);) {
      const ssize_t count = ::send(socket, left.data(), left.size(), MSG_NOSIGNAL);
      if (failed(count)) break;
      if (count > 0) left.remove_prefix(static_cast<std::size_t>(count));
    }
    // Says that nothing more is sent, and takes what is still under way, a little: closing before
    // would make the system withdraw the answer.
    (void)::shutdown(socket, SHUT_WR);
    (void)received(socket, 8 * kMostBytes, PageClock::now() + 100ms, nullptr);
    (void)::close(socket);
    return true;
  }

  /// A short one of our own where the library is not asked or has none.
  std::string answer_to_request(socket_t socket) {
    const auto until = PageClock::now() + kTimeToAsk;
    try {
      constexpr const char* kEnd = "\n\r\n";
      const std::string request = received(socket, kMostBytes, until, kEnd);
      httplib::detail::BufferStream stream;  // the answer is appended to the request
      (void)stream.write(request.data(), request.size());
      bool closed = true;
      // Compression would cost time, and ranges could ask for the same bytes many times over.
      if (request.find(kEnd) != std::string::npos &&
          process_request(stream, true, closed, [](httplib::Request& asked) {
            asked.ranges.clear();
            asked.headers.erase("Accept-Encoding");
          })) {
        return stream.get_buffer().substr(request.size());
      }
    } catch (const std::exception&) {  // of a stranger's request: nothing of ours is broken
    }
    const std::string_view status = over(until) ? "408 Request Timeout" : "400 Bad Request";
    return fmt::format(
        "HTTP/1.1 {}\r\nConnection: close\r\nContent-Type: text/plain\r\nContent-Length: {}"
        "\r\n\r\n{}\n",
        status, status.size() + 1, status);
  }

  /// Receives until `most` bytes have come, `end` is among them or the time is over.
  std::string received(socket_t socket, std::size_t most, PageClock::time_point until,
                       const char* end) const {
    std::string bytes;
    std::array<char, 4096> block{};
    while (bytes.size() < most && !over(until)) {
      const ssize_t count = ::recv(socket, block.data(), block.size(), 0);
      if (count == 0 || failed(count)) break;
      if (count > 0) bytes.append(block.data(), static_cast<std::size_t>(count));
      if (end != nullptr && bytes.find(end) != std::string::npos) break;
    }
    return bytes;
  }
  /// Not so if nothing could be sent or received for the time that the server's timeouts say.
  static bool failed(ssize_t count) { return count < 0 && errno != EAGAIN && errno != EINTR; }
  [[nodiscard]] bool over(PageClock::time_point until) const {
    return ending || PageClock::now() >= until;
  }
};

/// The library ignores SIGPIPE for the whole process, which is not for it to decide: we send with
/// MSG_NOSIGNAL.
std::unique_ptr<HttpServer> make_http_server() {
  struct sigaction before {};
  (void)sigaction(SIGPIPE, nullptr, &before);
  auto server = std::make_unique<HttpServer>();
  (void)sigaction(SIGPIPE, &before, nullptr);
  return server;
}

std::uint64_t wanted_point(const httplib::Request& request) {
  const std::string text = request.get_param_value("after");
  std::uint64_t point = 0;
  (void)std::from_chars(text.data(), text.data() + text.size(), point);
  return point;
}

}  // namespace

class PageServer::Service {
 public:
  Service(const LiveView& view, int port)
      : page_(read_page("session.html")), http_(make_http_server()) {
    http_->new_task_queue = [] { return new BoundedQueue; };
    // The library would share the port with any other server that asks for it.
    http_->set_socket_options([](socket_t socket) {
      const int yes = 1;
      (void)setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    http_->set_payload_max_length(0);
    http_->set_read_timeout(kLook);
    http_->set_write_timeout(kLook);
    port_ = port == 0 ? http_->bind_to_any_port("127.0.0.1")
                      : (http_->bind_to_port("127.0.0.1", port) ? port : -1);
    if (port_ < 0) {
      throw Error(ExitCode::environment, fmt::format("--page {}", port), "the port cannot be had",
                  "one that is free, or 0 for any");
    }
    answer(view);
    thread_ = std::thread([this] {
      lower_priority();
      (void)http_->listen_after_bind();
    });
    while (!http_->is_running()) std::this_thread::sleep_for(1ms);
  }
  ~Service() {
    http_->ending = true;
    http_->stop();
    thread_.join();
  }
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;
  [[nodiscard]] int port() const noexcept { return port_; }

 private:
  void answer(const LiveView& view) {
    http_->set_default_headers(
        {{"Cache-Control", "no-store"},
         {"X-Content-Type-Options", "nosniff"},
         {"Referrer-Policy", "no-referrer"},
         {"Cross-Origin-Resource-Policy", "same-origin"},
         {"Content-Security-Policy",
          "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
          "connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; "
          "frame-ancestors 'none'"}});
    http_->set_pre_routing_handler(
        [this](const httplib::Request& request, httplib::Response& response) {
          using Handling = httplib::Server::HandlerResponse;
          if (request.method != "GET" && request.method != "HEAD") {
            response.set_header("Allow", "GET, HEAD");
            response.status = 405;
            return Handling::Handled;
          }
          // A page of somebody else whose name was made to point here says another name.
          if (request.get_header_value_count("Host") == 1 &&
              names_this_host(request.get_header_value("Host"), port_)) {
            return Handling::Unhandled;
          }
          response.status = 403;
          return Handling::Handled;
        });
    http_->set_error_handler([](const httplib::Request&, httplib::Response& response) {
      response.set_content(fmt::format("error {}\n", response.status), "text/plain");
    });
    http_->Get("/", [this](const httplib::Request&, httplib::Response& response) {
      response.set_content(page_, "text/html; charset=utf-8");
    });
    http_->Get("/scene.json", [&view](const httplib::Request&, httplib::Response& response) {
      response.set_content(view.scene_json(), "application/json");
    });
    http_->Get("/state.json",
               [&view](const httplib::Request& request, httplib::Response& response) {
                 response.set_content(view.state_json(wanted_point(request)), "application/json");
               });
  }

  std::string page_;
  std::unique_ptr<HttpServer> http_;
  int port_ = -1;
  std::thread thread_;
};

PageServer::PageServer(const LiveView& view, int port)
    : service_(std::make_unique<Service>(view, port)) {}

PageServer::~PageServer() = default;

int PageServer::port() const noexcept {
  return service_->port();
}

std::string PageServer::address() const {
  return fmt::format("http://127.0.0.1:{}/", port());
}

}  // namespace tpm::haptics
