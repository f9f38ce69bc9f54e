#include "tpm/files/contained.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <utility>

namespace tpm::files {
namespace {

constexpr int kFile = 3, kParent = 4;  // descriptors of the child
constexpr char kAnswer = 'a', kError = 'e', kNoMemory = 'm';
constexpr int kLargestMessage = 1 << 16;
/// Answers that may be due. So many short ones fit into the socket, so that neither side waits for
/// the other to read.
constexpr std::size_t kMostDue = 64;

bool send_all(int to, const void* bytes, std::size_t size) {
  const auto* next = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t n = ::send(to, next, size, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    next += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

bool receive_all(int from, void* bytes, std::size_t size) {
  auto* next = static_cast<char*>(bytes);
  while (size > 0) {
    const ssize_t n = ::recv(from, next, size, 0);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    next += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

using Header = std::array<char, 1 + sizeof(std::uint64_t)>;  // a kind, and how many bytes follow

/// A header and the bytes; small ones in one piece, which spares both sides a wait.
bool send_message(int to, char kind, std::string_view bytes) {
  const std::uint64_t size = bytes.size();
  std::array<char, 4096> together{kind};
  std::memcpy(together.data() + 1, &size, sizeof size);
  const std::size_t first = std::min(bytes.size(), together.size() - Header().size());
  std::copy_n(bytes.data(), first, together.data() + Header().size());
  bytes.remove_prefix(first);
  return send_all(to, together.data(), Header().size() + first) &&
         send_all(to, bytes.data(), bytes.size());
}

/// False if nobody is there. In blocks, so that a length that is a lie takes no memory.
bool receive_message(int from, char& kind, std::string& bytes,
                     std::uint64_t most = ~std::uint64_t{0}) {
  Header header{};
  std::uint64_t size = 0;
  bytes.clear();
  if (!receive_all(from, header.data(), header.size())) return false;
  kind = header.front();
  std::memcpy(&size, header.data() + 1, sizeof size);
  if (size > most) return false;
  while (bytes.size() < size) {
    const std::size_t have = bytes.size();
    bytes.resize(have + static_cast<std::size_t>(
                            std::min<std::uint64_t>(size - have, std::uint64_t{1} << 24U)));
    if (!receive_all(from, bytes.data() + have, bytes.size() - have)) return false;
  }
  return true;
}

void set_limit(decltype(RLIMIT_AS) resource, std::uint64_t value) {
  rlimit limit{};
  if (::getrlimit(resource, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max = std::min<rlim_t>(value, limit.rlim_max);
  (void)::setrlimit(resource, &limit);
}

/// Of this process, from the kernel; 0 if it does not say.
std::uint64_t address_space_bytes() {
  std::FILE* file = std::fopen("/proc/self/statm", "re");
  if (file == nullptr) return 0;
  unsigned long long pages = 0;
  const bool read = std::fscanf(file, "%llu", &pages) == 1;
  (void)std::fclose(file);
  return read ? pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) : 0;
}

/// Sanitizers reserve terabytes of addresses, which a limit of them would forbid.
constexpr bool kSanitized =
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    true;
#else
    false;
#endif

/// With all of its checks UBSan looks at memory by a pipe, in whatever HDF5 hands out.
constexpr bool kProbed =
#if defined(TPM_SANITIZE_EVERYTHING)
    true;
#else
    false;
#endif

double cpu_used_s() {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  constexpr double kMicro = 1e-6;
  return static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
         kMicro * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

/// SIGPROF ends the process when it has used so much.
void allow_cpu_until(double total_s) {
  const double left_s = std::max(total_s - cpu_used_s(), 1e-3);
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(left_s);
  timer.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (left_s - std::floor(left_s))) + 1;
  if (timer.it_value.tv_usec > 999'999) timer.it_value.tv_usec = 999'999;
  (void)::setitimer(ITIMER_PROF, &timer, nullptr);
}

/// Gives up all that the child does not need.
void confine(int descriptor, int parent, bool writes, std::uint64_t memory_bytes) {
  for (const int signal : {SIGPROF, SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGTERM, SIGHUP}) {
    (void)std::signal(signal, SIG_DFL);
  }
  (void)std::signal(SIGINT, SIG_IGN);  // Ctrl-C is for the parent, with which the child ends
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  (void)::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);

  // Both at numbers above the places where they are wanted first, so that none takes the other's.
  const int file = ::fcntl(descriptor, F_DUPFD, kParent + 1);
  const int back = ::fcntl(parent, F_DUPFD, kParent + 1);
  const int nothing = ::open("/dev/null", O_RDWR);
  if (file < 0 || back < 0 || nothing < 0) ::_exit(1);
  for (int stream = 0; stream <= 2; ++stream) ::dup2(nothing, stream);
  ::dup2(file, kFile);
  ::dup2(back, kParent);
  (void)::close_range(kParent + 1, ~0U, 0);

  // Nothing else can be opened from here on; where HDF5 writes, UBSan looks at memory by a pipe.
  const std::uint64_t of_sanitizer = kProbed || (kSanitized && writes) ? 2 : 0;
  set_limit(RLIMIT_NOFILE, kParent + 1 + of_sanitizer);
  set_limit(RLIMIT_CORE, 0);
  if (writes) return;
  set_limit(RLIMIT_FSIZE, 0);
  if (!kSanitized && memory_bytes > 0) set_limit(RLIMIT_AS, memory_bytes);
}

/// The life of the child.
[[noreturn]] void serve(const Contained::Start& start, const ContainedLimits& limits) {
  double cpu_s = cpu_used_s() + limits.cpu_s;
  Contained::Answer answer;
  std::string request, reply;
  char kind = 0;
  while (receive_message(kParent, kind, request)) {
    char what = kAnswer;
    allow_cpu_until(limits.writes ? cpu_used_s() + limits.cpu_s : cpu_s);
    try {
      if (!answer) answer = start(kFile);
      reply = answer(request);
    } catch (const Error& error) {
      what = kError;
      reply = static_cast<char>(error.code()) + std::string(error.what());
    } catch (const std::bad_alloc&) {
      what = kNoMemory;
      reply.clear();
    }
    if (!send_message(kParent, what, reply)) break;
    cpu_s += limits.cpu_s_per_megabyte * static_cast<double>(reply.size()) / 1e6;
  }
  ::_exit(0);
}

}  // namespace

Contained::Contained(std::string where, int descriptor, const ContainedLimits& limits,
                     const Start& start)
    : where_(std::move(where)), writes_(limits.writes), most_bytes_(limits.answer_bytes) {
  std::array<int, 2> ends{};
  const auto cannot = [&](const char* what) {
    return Error(ExitCode::environment, where_,
                 fmt::format("cannot be {} in a process of its own: {}: {}",
                             writes_ ? "written" : "read", what, std::strerror(errno)),
                 "a system that can start one more process");
  };
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw cannot("socketpair");
  }
  (void)::setsockopt(ends[1], SOL_SOCKET, SO_SNDBUF, &kLargestMessage, sizeof kLargestMessage);
  const std::uint64_t before = address_space_bytes();
  const std::uint64_t memory_bytes = before > 0 ? before + limits.memory_bytes : 0;
  child_ = ::fork();
  if (child_ == 0) {
    try {
      confine(descriptor, ends[1], limits.writes, memory_bytes);
      serve(start, limits);
    } catch (...) {
      ::_exit(1);
    }
  }
  const int error_number = errno;
  ::close(ends[1]);
  socket_ = ends[0];
  if (child_ > 0) return;
  ::close(socket_);
  errno = error_number;
  throw cannot("fork");
}

Contained::~Contained() {
  ::close(socket_);
  if (!end_.empty()) return;
  ::kill(child_, SIGKILL);
  while (::waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void Contained::report_end() {
  if (end_.empty()) {
    int status = 0;
    ::kill(child_, SIGKILL);  // it has ended or closed its side; of a dead one the status stays
    while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) {
    }
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    if (writes_) {
      end_ = signal != 0 ? fmt::format("cannot write: HDF5 ended by signal {}", signal)
                         : std::string("cannot write: HDF5 ended");
    } else {
      end_ = signal == SIGPROF ? "its content keeps the reader busy without end"
                               : "its content crashes the reader";
    }
  }
  if (writes_) throw Error(ExitCode::environment, where_, end_, "more memory");
  throw bad_input(where_, end_, "a whole file");
}

std::string Contained::ask(std::string_view request) {
  const auto answer = std::make_shared<std::string>();
  tell(request, [answer](std::string_view taken) { *answer = taken; });
  take_answers();
  return std::move(*answer);
}

void Contained::tell(std::string_view request, Taker taker) {
  if (!end_.empty()) report_end();
  if (due_.size() >= kMostDue) take_answers();
  if (!send_message(socket_, kAnswer, request)) report_end();
  due_.push_back(std::move(taker));
}

void Contained::take_answers() {
  while (!due_.empty()) {
    const Taker taker = std::move(due_.front());
    due_.pop_front();
    const std::string answer = next_answer();
    if (taker) taker(answer);
  }
}

std::string Contained::next_answer() {
  char kind = 0;
  std::string reply;
  if (!receive_message(socket_, kind, reply, most_bytes_)) report_end();
  if (kind == kNoMemory) {
    if (writes_) throw std::bad_alloc();
    throw bad_input(where_, "its content asks for too much memory", "a whole file");
  }
  if (kind == kAnswer) return reply;
  const auto code = static_cast<ExitCode>(reply.empty() ? 0 : reply.front());
  throw Error(code, "", std::string_view(reply).substr(std::min<std::size_t>(1, reply.size())));
}

}  // namespace tpm::files
