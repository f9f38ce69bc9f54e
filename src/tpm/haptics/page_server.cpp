#include "tpm/haptics/page_server.hpp"

#include <fmt/format.h>
#include <httplib.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <csignal>
#include <thread>

#include "tpm/store/file.hpp"
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
constexpr auto kLook = 50;  // ms between looks at whether all is over
constexpr int kNice = 10;   // nice value of the page's threads

/// Of the calling thread: Linux keeps a nice value for each.
void lower_priority() {
  (void)setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
}

/// One connection, of which so many bytes are read and which has so much time.
class BoundedStream final : public httplib::Stream {
 public:
  BoundedStream(socket_t socket, const std::atomic<bool>& ending)
      : socket_(socket), ending_(ending), deadline_(PageClock::now() + kTimeToAsk) {}

  [[nodiscard]] bool is_readable() const override { return waited(POLLIN); }
  [[nodiscard]] bool is_writable() const override { return waited(POLLOUT); }
  ssize_t read(char* to, size_t size) override {
    if (next_ == filled_ && !fill()) return -1;
    const std::size_t count = std::min(size, filled_ - next_);
    std::copy_n(buffer_.data() + next_, count, to);
    next_ += count;
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* from, size_t size) override {
    if (!answering_ && !late()) deadline_ = PageClock::now() + kTimeToAnswer;
    answering_ = true;
    if (!waited(POLLOUT)) return -1;
    const ssize_t count = ::send(socket_, from, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    answered_ = answered_ || count > 0;
    return count;
  }
  using Stream::write;
  void get_remote_ip_and_port(std::string& ip, int& port) const override {
    ip = "127.0.0.1";
    port = 0;
  }
  void get_local_ip_and_port(std::string& ip, int& port) const override {
    get_remote_ip_and_port(ip, port);
  }
  [[nodiscard]] socket_t socket() const override { return socket_; }

  /// A short answer of our own, where the library has given none. It finds room with the system,
  /// or is not given.
  void refuse_if_unanswered() {
    if (answered_) return;
    const std::string_view status = late() ? "408 Request Timeout" : "400 Bad Request";
    const std::string text = fmt::format(
        "HTTP/1.1 {}\r\nConnection: close\r\nContent-Type: text/plain\r\nContent-Length: {}"
        "\r\n\r\n{}\n",
        status, status.size() + 1, status);
    (void)::send(socket_, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  /// Says that nothing more is sent, and takes what is still under way, a little: closing before
  /// would make the system withdraw the answer.
  void close() {
    (void)::shutdown(socket_, SHUT_WR);
    deadline_ = PageClock::now() + 100ms;
    for (std::size_t taken = 0; taken < 8 * kMostBytes && waited(POLLIN);) {
      const ssize_t count = ::recv(socket_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
      if (count <= 0) break;
      taken += static_cast<std::size_t>(count);
    }
    (void)::close(socket_);
  }

 private:
  [[nodiscard]] bool late() const { return PageClock::now() >= deadline_; }
  [[nodiscard]] bool waited(short what) const {
    while (!late() && !ending_) {
      pollfd wanted{socket_, what, 0};
      const int ready = ::poll(&wanted, 1, kLook);
      if (ready > 0) return true;
      if (ready < 0 && errno != EINTR) return false;
    }
    return false;
  }
  bool fill() {
    if (read_ >= kMostBytes || !waited(POLLIN)) return false;
    const ssize_t count = ::recv(socket_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
    if (count <= 0) return false;
    next_ = 0;
    filled_ = static_cast<std::size_t>(count);
    read_ += filled_;
    return true;
  }

  socket_t socket_;
  const std::atomic<bool>& ending_;
  PageClock::time_point deadline_;
  std::array<char, 4096> buffer_{};
  std::size_t next_ = 0, filled_ = 0, read_ = 0;
  bool answering_ = false, answered_ = false;
};

/// httplib's pool with a bound: when it is full, no more connections are accepted for a while.
class BoundedQueue final : public httplib::TaskQueue {
 public:
  BoundedQueue() {
    for (std::size_t i = 0; i < kThreads; ++i) {
      threads_.emplace_back([this] { work(); });
    }
  }
  void enqueue(std::function<void()> task) override {
    std::unique_lock<std::mutex> lock(mutex_);
    room_.wait(lock, [this] { return tasks_.size() < kMostWaiting; });
    tasks_.push_back(std::move(task));
    more_.notify_one();
  }
  void shutdown() override {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      over_ = true;
    }
    more_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

 private:
  void work() {
    lower_priority();
    for (;;) {
      std::unique_lock<std::mutex> lock(mutex_);
      more_.wait(lock, [this] { return over_ || !tasks_.empty(); });
      if (tasks_.empty()) return;
      const std::function<void()> task = std::move(tasks_.front());
      tasks_.pop_front();
      lock.unlock();
      room_.notify_one();
      task();
    }
  }

  std::mutex mutex_;
  std::condition_variable more_, room_;
  std::deque<std::function<void()>> tasks_;
  std::vector<std::thread> threads_;
  bool over_ = false;
};

class HttpServer final : public httplib::Server {
 public:
  std::atomic<bool> ending{false};

 private:
  /// One request a connection: nobody keeps a thread.
  bool process_and_close_socket(socket_t socket) override {
    BoundedStream stream(socket, ending);
    bool closed = true, answered = false;
    try {
      // Compression would cost time, and ranges could ask for the same bytes many times over.
      answered = process_request(stream, true, closed, [](httplib::Request& request) {
        request.ranges.clear();
        request.headers.erase("Accept-Encoding");
      });
    } catch (const std::exception&) {  // of a stranger's request: nothing of ours is broken
      answered = false;
    }
    stream.refuse_if_unanswered();
    stream.close();
    return answered;
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
          const std::string host = request.get_header_value("Host");
          if (request.get_header_value_count("Host") == 1 &&
              (host == fmt::format("127.0.0.1:{}", port_) ||
               host == fmt::format("localhost:{}", port_))) {
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
