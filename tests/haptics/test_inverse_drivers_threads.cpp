// tpm hil serve: the log always says who drives.
#include <algorithm>
#include <catch2/catch.hpp>
#include <mutex>
#include <string>
#include <vector>

#include "inverse_clients.hpp"
#include "tpm/haptics/serve/driver_log.hpp"
#include "tpm/haptics/serve/simulated_hand.hpp"

namespace tpm::haptics {
namespace {

TEST_CASE("Each change of the driver has a line, and quick ones in a row do not fill the log") {
  constexpr std::int64_t kNow_ns = 5'000'000'000'000, kSecond_ns = DriverLog::kAgain_ns;
  DriverLog log;
  CHECK(log.line(kNow_ns).empty());
  for (int i = 0; i < DriverLog::kMost / 2; ++i) {
    log.change(7);
    CHECK(log.line(kNow_ns) == "client 7: drives");
    log.change(0);
    CHECK(log.line(kNow_ns) == "client 7: drives no more");
    CHECK(log.line(kNow_ns).empty());
  }
  for (int i = 0; i < 1000; ++i) {
    log.change(i % 2 == 0 ? 8 + i : 0);
    CHECK(log.line(kNow_ns + 1).empty());
  }
  log.change(4711);
  // The newest one is not lost: it is told as soon as there is room for a line.
  CHECK(log.line(kNow_ns + kSecond_ns) == "client 4711: drives (1000 earlier changes left out)");
  CHECK(log.line(kNow_ns + 2 * kSecond_ns).empty());
  log.change(0);
  CHECK(log.line(kNow_ns + 2 * kSecond_ns) == "client 4711: drives no more");
  // A quiet hour earns no more than the lines of the beginning.
  int lines = 0;
  for (int i = 0; i < 100; ++i) {
    log.change(1 + i);
    lines += log.line(kNow_ns + 3600 * kSecond_ns).empty() ? 0 : 1;
  }
  CHECK(lines == DriverLog::kMost);
}

/// Lines of a server whose only client has said too much before it drives.
std::vector<std::string> lines_of_a_talker(const std::string& before, int times) {
  std::mutex mutex;
  std::vector<std::string> lines;
  SimulatedHand hand{SimulatedHandSettings{}};
  InverseServerSettings settings;
  settings.device.id = "SIMULATED";
  settings.device.simulated = true;
  settings.log = [&](const std::string& line) {
    const std::lock_guard<std::mutex> lock(mutex);
    lines.push_back(line);
  };
  {
    const InverseServer server(hand, std::move(settings));
    const auto client = test::client_of(server);
    for (int i = 0; i < times; ++i) (void)test::answer_to(*client, before);
    (void)test::answer_to(*client,
                          force_message(InverseFormat::vector, "SIMULATED", {0.0, 0.0, 1.0}));
  }
  return lines;
}

TEST_CASE("A client that has used up its lines of the log is still named as the driver") {
  for (const std::string& before : {std::string("x"), neutral_message("SIMULATED", "who")}) {
    const std::vector<std::string> lines = lines_of_a_talker(before, 100);
    CHECK(std::ranges::count(lines, "client 1: drives") == 1);
    CHECK(lines.size() < 30);
    CHECK(std::ranges::count_if(lines, [](const std::string& line) {
            return line.find("(its last line but who drives)") != std::string::npos;
          }) == 1);
  }
}

}  // namespace
}  // namespace tpm::haptics
