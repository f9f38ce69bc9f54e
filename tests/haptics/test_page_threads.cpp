// The page of a session: what it says, to whom, and that nobody who asks gets in the way.
#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <thread>

#include "expected_values.hpp"
#include "hil_scenes.hpp"
#include "raw_client.hpp"
#include "temp_folder.hpp"
#include "tpm/haptics/session/page_server.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/session/session_run.hpp"

// After Eigen: it brings <resolv.h> along, whose macros have the names of Eigen's parameters.
#include <httplib.h>

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using Catch::Matchers::WithinAbs;
using namespace std::chrono_literals;
using test::RawClient;

/// A view of a session of which so many cycles have passed.
class PageOf {
 public:
  explicit PageOf(std::uint64_t cycles)
      : session_(test::parsed(test::short_session())), view_(session_, true) {
    DeviceIdentity device;
    device.kind = device.name = "stands for one";
    view_.opened(device, make_loop_model(session_));
    for (std::uint64_t i = 0; i < cycles; ++i) view_.see(row(i));
  }
  static ServoRecord row(std::uint64_t cycle) {
    ServoRecord row;
    row.cycle = cycle;
    row.tool_depth_m = row.surface_depth_m = 1e-6 * static_cast<double>(cycle);
    row.model_force_N = 0.5;
    row.commanded_N[2] = cycle == 70 ? 0.9 : 0.4;  // the push is along -z
    row.busy_s = 20e-6F;
    return row;
  }
  [[nodiscard]] LiveView& view() { return view_; }
  [[nodiscard]] Json state(std::uint64_t after = 0) const {
    return Json::parse(view_.state_json(after));
  }

 private:
  HilSession session_;
  LiveView view_;
};

TEST_CASE("The view tells the last cycle, the target, the counts, and each point once") {
  PageOf page(1200);
  const Json scene = Json::parse(page.view().scene_json());
  CHECK(scene.at("simulated_device") == true);
  CHECK(scene.at("rate_Hz") == 1000.0);
  CHECK(scene.at("tissue").at("spheres") == 4);
  CHECK(scene.at("phases").size() == 9);
  CHECK_THAT(scene.at("phases")[1].at("instruction").get<std::string>(),
             Contains("Push in to 4 mm at 4 mm/s"));

  const Json state = page.state();
  CHECK(state.at("cycle") == 1199);
  CHECK_THAT(state.at("time_s").get<double>(), WithinAbs(1.199, 1e-12));
  CHECK(state.at("commanded_N") == 0.4);
  const auto hand_N = state.at("hand_N").get<std::vector<double>>();
  CHECK(std::hypot(hand_N[0], hand_N[1], hand_N[2]) == Approx(0.4));
  // The tool is 1.199 mm deep, and the force on the hand points out of the tissue.
  const auto tool_m = state.at("tool_m").get<std::vector<double>>();
  CHECK(std::hypot(tool_m[0], tool_m[1], tool_m[2]) == Approx(1.199e-3));
  const double along = tool_m[0] * hand_N[0] + tool_m[1] * hand_N[1] + tool_m[2] * hand_N[2];
  CHECK(along == Approx(-1.199e-3 * 0.4));
  CHECK(state.at("over") == false);
  CHECK(state.at("counts").at("late") == 0);
  CHECK_THAT(state.at("loop").at("busy_p99_s").get<double>(), WithinAbs(20e-6, 1.1e-6));
  // Points every 40 ms: the last one at 1.16 s, 0.16 s into the way to 4 mm at 4 mm/s.
  const Json& trace = state.at("trace");
  REQUIRE(trace.at("time_s").size() == 30);
  CHECK_THAT(trace.at("target_depth_m")[29].get<double>(), WithinAbs(4e-3 * 0.16, 1e-9));
  CHECK(trace.at("target_force_N")[29].is_null());
  // What lies between two points is not lost.
  CHECK(trace.at("most_commanded_N")[2] == 0.9);
  CHECK(trace.at("commanded_N")[2] == 0.4);
  // The contact sphere of the star went with the surface, into the tissue.
  CHECK(state.at("displacement_um").size() == 12);
  CHECK(state.at("displacement_um")[3 * 1 + 2] == -1160);

  CHECK(page.state(30).at("trace").at("time_s").empty());
  page.view().see(PageOf::row(1200));
  const Json more = page.state(30).at("trace");
  CHECK(more.at("first") == 30);
  CHECK(more.at("time_s").size() == 1);
}

TEST_CASE("The view counts what was missed, what was lost, and keeps the cause of the end") {
  PageOf page(500);
  ServoRecord late = PageOf::row(507);  // after six that went by without a command and one lost
  late.missed = 6;
  late.flags = kLate | kTimeGuarded;
  page.view().see(late);
  ServoRecord last;
  last.cycle = 508;
  last.stop = StopCause::watchdog;
  page.view().see(last);
  ServoOutcome outcome;
  outcome.cause = StopCause::watchdog;
  page.view().ended(outcome);
  const Json state = page.state();
  CHECK(state.at("counts").at("missed") == 6);
  CHECK(state.at("counts").at("late") == 1);
  CHECK(state.at("counts").at("time_guards") == 1);
  CHECK(state.at("counts").at("most_consecutive_missed") == 6);
  CHECK(state.at("counts").at("most_late_of_1000") == 1);
  CHECK(state.at("loop").at("lost_records") == 1);
  CHECK(state.at("over") == true);
  CHECK(state.at("cause") == to_string(StopCause::watchdog));
  CHECK(state.at("tool_depth_m") == late.tool_depth_m);  // the row of the stop has none
}

TEST_CASE("The view tells the most periods missed in a row, and the most late cycles of 1000") {
  PageOf page(1);
  std::uint64_t cycle = 1;
  const auto seen = [&](int rows, int missed) {
    for (int i = 0; i < rows; ++i) {
      cycle += static_cast<std::uint64_t>(missed);
      ServoRecord row = PageOf::row(cycle++);
      row.missed = missed;
      page.view().see(row);
    }
  };
  seen(3, 2);
  CHECK(page.state().at("counts").at("most_consecutive_missed") == 2);
  CHECK(page.state().at("counts").at("most_late_of_1000") == 3);
  seen(1, 7);
  seen(998, 0);
  seen(2, 1);  // the first of the four are more than 1000 cycles ago
  CHECK(page.state().at("counts").at("most_consecutive_missed") == 7);
  CHECK(page.state().at("counts").at("most_late_of_1000") == 4);
  seen(5, 1);
  CHECK(page.state().at("counts").at("most_late_of_1000") == 7);
  CHECK(page.state().at("loop").at("lost_records") == 0);
}

TEST_CASE("A number that is not finite is null on the page") {
  PageOf page(1);
  ServoRecord row = PageOf::row(40);
  row.model_error_N = std::nan("");
  row.tool_depth_m = row.surface_depth_m = std::numeric_limits<double>::infinity();
  page.view().see(row);
  const Json state = page.state();
  CHECK(state.at("model_error_N").is_null());
  CHECK(state.at("tool_depth_m").is_null());
}

TEST_CASE("The server hands out the page, the scene and the state, and nothing else") {
  PageOf page(100);
  const PageServer server(page.view(), 0);
  CHECK(server.address() == "http://127.0.0.1:" + std::to_string(server.port()) + "/");
  httplib::Client client("127.0.0.1", server.port());
  const auto html = client.Get("/");
  REQUIRE(html);
  CHECK(html->status == 200);
  CHECK_THAT(html->get_header_value("Content-Type"), StartsWith("text/html"));
  CHECK_THAT(html->get_header_value("Content-Security-Policy"), StartsWith("default-src 'none'"));
  CHECK_FALSE(html->has_header("Access-Control-Allow-Origin"));
  // One file with all it needs: no address of another machine stands in it.
  CHECK(html->body.find("http://") == std::string::npos);
  CHECK(html->body.find("https://") == std::string::npos);
  CHECK_FALSE(page.view().watched());
  const auto state = client.Get("/state.json?after=2");
  REQUIRE(state);
  CHECK(page.view().watched());
  CHECK(Json::parse(state->body).at("trace").at("time_s").size() == 1);
  CHECK(Json::parse(client.Get("/scene.json")->body).at("title") == "short");
  CHECK(Json::parse(client.Get("/state.json?after=-3x")->body).at("trace").at("first") == 0);
  CHECK(client.Get("/session.html")->status == 404);
  const auto head = client.Head("/");
  REQUIRE(head);
  CHECK(head->body.empty());
}

TEST_CASE("A port that is taken is told, also when an earlier page has it") {
  PageOf page(1);
  const PageServer server(page.view(), 0);
  CHECK_THROWS_WITH(PageServer(page.view(), server.port()),
                    Contains("--page " + std::to_string(server.port())) && Contains("cannot be"));
}

TEST_CASE("Hostile requests get a short error") {
  PageOf page(100);
  const PageServer server(page.view(), 0);
  const std::string host = "Host: 127.0.0.1:" + std::to_string(server.port()) + "\r\n";
  struct Request {
    std::string bytes;
    const char* status;
  };
  const std::string big(200'000, 'a');
  std::string ranges = "Range: bytes=0-1";
  while (ranges.size() < 8000) ranges += ",0-9";
  const std::vector<Request> requests{
      {"GET / HTTP/1.1\r\n\r\n", "403"},
      {"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n", "403"},
      {"GET / HTTP/1.1\r\nHost: 127.0.0.1:1\r\n\r\n", "403"},
      {"GET / HTTP/1.1\r\n" + host + "Host: evil.example\r\n\r\n", "403"},
      {"POST /state.json HTTP/1.1\r\n" + host + "Content-Length: 200000\r\n\r\n" + big, "405"},
      {"DELETE / HTTP/1.1\r\n" + host + "\r\n", "405"},
      {"OPTIONS / HTTP/1.1\r\n" + host + "Origin: null\r\n\r\n", "405"},
      {"CONNECT evil.example:80 HTTP/1.1\r\n" + host + "\r\n", "405"},
      {"BREW / HTTP/1.1\r\n" + host + "\r\n", "400"},
      {"GET /../../etc/passwd HTTP/1.1\r\n" + host + "\r\n", "404"},
      {"GET /%2e%2e/%2e%2e/etc/passwd HTTP/1.1\r\n" + host + "\r\n", "404"},
      {"GET http://evil.example/ HTTP/1.1\r\n" + host + "\r\n", "404"},
      {"GET /state.json%00.html HTTP/1.1\r\n" + host + "\r\n", "404"},
      {"GET /" + big + " HTTP/1.1\r\n" + host + "\r\n", "400"},
      {"GET / HTTP/1.1\r\n" + host + "X: " + big + "\r\n\r\n", "400"},
      {std::string("\x16\x03\x01\x02\0\x01", 6) + "\r\n\r\n", "400"},
      {"\r\n\r\n", "400"},
      {big, "400"}};
  for (const Request& request : requests) {
    const RawClient client(server.port());
    REQUIRE(client.connected());
    client.send(request.bytes);
    const std::string answer = client.answer();
    INFO(request.bytes.substr(0, 80) << " -> " << answer.substr(0, 300));
    CHECK(answer.substr(0, 12) == std::string("HTTP/1.1 ") + request.status);
    CHECK(answer.size() < 1500);
  }
  // Ranges are not served: they could ask for the same bytes many times over.
  const RawClient client(server.port());
  client.send("GET / HTTP/1.1\r\n" + host + ranges + "\r\n\r\n");
  const std::string answer = client.answer();
  CHECK(answer.size() < 60'000);
  CHECK(answer.substr(0, 12) != "HTTP/1.1 206");
}

TEST_CASE("Clients that never finish are given up, and keep nobody else out") {
  PageOf page(100);
  auto server = std::make_unique<PageServer>(page.view(), 0);
  std::vector<std::unique_ptr<RawClient>> stuck;
  for (int i = 0; i < 4; ++i) {
    stuck.push_back(std::make_unique<RawClient>(server->port()));
    stuck.back()->send("GET / HTTP/1.1\r\nHost: ");
  }
  httplib::Client client("127.0.0.1", server->port());
  for (int i = 0; i < 5; ++i) {
    const auto state = client.Get("/state.json");
    REQUIRE(state);
    CHECK(state->status == 200);
  }
  for (const auto& slow : stuck) CHECK_THAT(slow->answer(), StartsWith("HTTP/1.1 408"));
  // As many as may be are stuck when it ends: it does not wait for them.
  stuck.clear();
  for (int i = 0; i < 30; ++i) {
    stuck.push_back(std::make_unique<RawClient>(server->port()));
    stuck.back()->send("G");
  }
  const auto start = std::chrono::steady_clock::now();
  server.reset();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  CHECK(took.count() < test::allowed_cost("page.end_with_stuck_clients"));
}

TEST_CASE("A session on the clock is served while it runs, to friends and others, and is whole") {
  const test::TempFolder folder;
  Json json = test::short_session();
  json.erase("creep");
  json["indentations"]["rates"] = {"20 mm/s"};
  json["indentations"]["hold"] = "0.3 s";
  json["indentations"]["rest"] = "0.1 s";
  json["limits"] = {{"watchdog", "16 ms"}, {"cycle_timeout", "1 s"}, {"late_cycles", 1000}};
  HilSession session = test::parsed(json);
  session.servo.most_missed = 1'000'000;
  session.cycle_timeout_s = 10.0;
  LiveView view(session, true);
  PageServer server(view, 0);
  std::atomic<bool> over{false};
  double last_s = 0.0;
  int rose = 0;
  std::thread friendly([&] {
    httplib::Client client("127.0.0.1", server.port());
    std::uint64_t after = 0;
    while (!over) {
      if (const auto answer = client.Get("/state.json?after=" + std::to_string(after))) {
        const Json state = Json::parse(answer->body);
        const Json& trace = state.at("trace");
        after = trace.at("first").get<std::uint64_t>() + trace.at("time_s").size();
        if (state.at("time_s").get<double>() > last_s) ++rose;
        last_s = state.at("time_s").get<double>();
      }
      std::this_thread::sleep_for(40ms);
    }
  });
  std::thread hostile([&] {
    while (!over) {
      const RawClient client(server.port());
      client.send("GET /../../etc/passwd HTTP/1.1\r\nHost: evil.example\r\n\r\n");
      (void)client.answer(0.1);
    }
  });
  SessionRunOptions options;
  options.real_time = true;
  options.recording = folder / "r";
  options.opened = [&](const DeviceIdentity& device, const LoopModel& model) {
    view.opened(device, model);
  };
  options.watcher = [&](const ServoRecord& row) { view.see(row); };
  const SessionRun run = run_session(session, {}, options);
  view.ended(run.outcome);
  over = true;
  friendly.join();
  hostile.join();
  CHECK(read_recording(folder / "r").closed);
  // A machine that is stalled for longer than the watchdog waits ends the session early.
  CHECK((run.outcome.cause == StopCause::finished || run.outcome.cause == StopCause::watchdog));
  if (run.outcome.cause == StopCause::finished) CHECK(rose >= 2);
  const Json state = Json::parse(view.state_json(0));
  CHECK(state.at("cause") == to_string(run.outcome.cause));
  CHECK(state.at("counts").at("missed") == run.outcome.counts.missed);
}

}  // namespace
}  // namespace tpm::haptics
