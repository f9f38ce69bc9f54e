// The line of progress on a terminal.
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tpm/work/progress.hpp"

using namespace tpm;
using Catch::Matchers::Contains;

namespace {

/// Standard error is a terminal as long as this lives.
class TerminalOfErrors {
 public:
  TerminalOfErrors() : master_(posix_openpt(O_RDWR | O_NOCTTY)) {
    REQUIRE(master_ >= 0);
    REQUIRE(grantpt(master_) == 0);
    REQUIRE(unlockpt(master_) == 0);
    const int terminal = open(ptsname(master_), O_RDWR | O_NOCTTY);  // NOLINT: one thread
    REQUIRE(terminal >= 0);
    std::fflush(stderr);
    saved_ = dup(STDERR_FILENO);
    dup2(terminal, STDERR_FILENO);
    close(terminal);
    fcntl(master_, F_SETFL, O_NONBLOCK);
  }
  ~TerminalOfErrors() {
    std::fflush(stderr);
    dup2(saved_, STDERR_FILENO);
    close(saved_);
    close(master_);
  }
  TerminalOfErrors(const TerminalOfErrors&) = delete;
  TerminalOfErrors& operator=(const TerminalOfErrors&) = delete;

  /// What was written since the last call.
  [[nodiscard]] std::string shown() const {
    std::fflush(stderr);
    std::array<char, 4096> text{};
    const ssize_t got = read(master_, text.data(), text.size());
    return {text.data(), got > 0 ? static_cast<std::size_t>(got) : 0};
  }

 private:
  int master_ = -1, saved_ = -1;
};

}  // namespace

TEST_CASE("progress of a step does not overwrite the progress of the whole", "[work]") {
  const TerminalOfErrors terminal;
  {
    work::Progress whole("simulating and fitting", 2);
    CHECK_THAT(terminal.shown(), Contains("simulating and fitting: 0 of 2"));
    {
      work::Progress step("fitting from several starts", 5);
      step.advance();
      CHECK_FALSE(step.is_shown());
    }
    CHECK(terminal.shown().empty());
    whole.advance();
    CHECK_THAT(terminal.shown(), Contains("simulating and fitting: 1 of 2"));
  }
  CHECK(terminal.shown() == "\r\033[K");
  const work::Progress next("profiling", 3);
  CHECK_THAT(terminal.shown(), Contains("profiling: 0 of 3"));
}
