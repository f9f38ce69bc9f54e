// A stand-in for the vendor's library: the same C interface, an Omega.7 that is simulated, and
// faults on demand. As strict as the original: the drd calls know only a device that drdOpenID
// opened, and drdAutoInit of another answers error 5. The file named in $TPM_STAND_IN_SCRIPT is
// read when devices are counted; its lines are
//   version|com_mode|entries|devices|type|initialised|period|delay_periods|encoder_step NUMBER
//   types NUMBER...   of the devices, where there are several; their serials count from 4711
//   gripper|buttons NUMBER   what the hand does; without `gripper` the device has none
//   wait NUMBER       forces set before the operator begins
//   init_ms NUMBER    that drdAutoInit takes; drdStop ends it, unless stubborn NUMBER is not 0
//   clock 1           it does not say that time passes by calls: virtual time is refused
//   max_force         is an event with the limit in mN behind its name
//   watchdog_by_clock 0   commands need not come in time by the clock: for loops in virtual time,
//   and
//                         for tests about something else on a machine that stalls
//   thread_of_forces_on, thread_of_first_read, threads_when_prepared are events with a number, the
//                     thread or how many there are, in place of a time
//   operator FILE     pieces as written by to_lines(OperatorScript)
//   events FILE       what happened, with the time of the clock: "NAME NANOSECONDS"
//   fault NAME FIRST COUNT   at the calls of dhdGetPosition (dhdSetForce for saturated) numbered
//                            FIRST to FIRST + COUNT - 1, from 0
// Faults: status, time_guard, saturated, communication, not_available, nan; those that stay:
// watchdog, velocity, unplugged; hang sleeps COUNT milliseconds; each slow call takes 3 ms.
#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "operator_lines.hpp"
#include "tpm/haptics/device/virtual_plant.hpp"

namespace {

struct Fault {
  std::string name;
  long first = 0, count = 1;
};

struct StandIn {
  tpm::haptics::PlantSettings plant_settings;
  std::unique_ptr<tpm::haptics::VirtualPlant> plant;
  std::string operator_file, events_file;
  std::vector<Fault> faults;
  int version = 3, com_mode = 0, entries = 17, devices = 1, type = 35;
  std::vector<int> types;
  int index = -1;  // of the device that is open; -1: none
  double gripper_m = -1.0;
  unsigned buttons = 0;
  bool initialised = true, read_once = false, opened_by_drd = false;
  long reads = 0, writes = 0, wait = 0;
  int watchdog_ticks = 0;
  std::atomic<bool> expert{false}, unplugged{false}, init_stopped{false};
  int init_ms = 0;
  bool stubborn = false;
  std::atomic<int> cause{0};
  bool by_clock = true;
  bool without_clock = true;
  std::atomic<long long> last_command_ns{0};  // 0: forces are off
};

std::atomic<bool> a_call_hung{false};

// Those of earlier sessions stay: a call that hung may still be in one, even when the program ends.
struct Connected {
  Connected() = default;
  Connected(const Connected&) = delete;
  Connected& operator=(const Connected&) = delete;
  ~Connected() {
    if (!a_call_hung) delete list;
  }
  std::vector<std::unique_ptr<StandIn>>* list = new std::vector<std::unique_ptr<StandIn>>;
};
Connected connected;
std::atomic<StandIn*> device{nullptr};
thread_local int last_error = 0;

void connect_anew() {
  connected.list->push_back(std::make_unique<StandIn>());
  device = connected.list->back().get();
}

StandIn& here() {
  if (device == nullptr) connect_anew();
  return *device;
}

long long clock_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<long long>(now.tv_sec) * 1'000'000'000LL + now.tv_nsec;
}

void event(const char* name, long long number) {
  if (here().events_file.empty()) return;
  if (std::FILE* file = std::fopen(here().events_file.c_str(), "a")) {
    (void)std::fprintf(file, "%s %lld\n", name, number);
    (void)std::fclose(file);
  }
}

void event(const char* name) {
  event(name, clock_ns());
}

long long threads_of_process() {
  long long threads = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    (void)task;
    ++threads;
  }
  return threads;
}

void read_line(StandIn& s, std::istringstream& words, const std::string& key) {
  if (key == "operator") {
    words >> s.operator_file;
  } else if (key == "events") {
    words >> s.events_file;
  } else if (key == "fault") {
    Fault fault;
    words >> fault.name >> fault.first >> fault.count;
    s.faults.push_back(fault);
  } else if (key == "types") {
    for (int type = 0; words >> type;) s.types.push_back(type);
    s.devices = static_cast<int>(s.types.size());
  } else {
    double value = 0.0;
    words >> value;
    const int whole = static_cast<int>(value);
    if (key == "version") s.version = whole;
    if (key == "com_mode") s.com_mode = whole;
    if (key == "entries") s.entries = whole;
    if (key == "devices") s.devices = whole;
    if (key == "type") s.type = whole;
    if (key == "initialised") s.initialised = whole != 0;
    if (key == "init_ms") s.init_ms = whole;
    if (key == "watchdog_by_clock") s.by_clock = whole != 0;
    if (key == "clock") s.without_clock = whole == 0;
    if (key == "stubborn") s.stubborn = whole != 0;
    if (key == "gripper") s.gripper_m = value;
    if (key == "buttons") s.buttons = static_cast<unsigned>(whole);
    if (key == "wait") s.wait = whole;
    if (key == "period") s.plant_settings.period_s = value;
    if (key == "delay_periods") s.plant_settings.delay_periods = whole;
    if (key == "encoder_step") s.plant_settings.encoder_step_m = value;
  }
}

/// A library of its own is loaded for each session, and forgets nothing of what it was told.
void read_script() {
  connect_anew();
  const char* script = std::getenv("TPM_STAND_IN_SCRIPT");
  if (script == nullptr) return;
  std::ifstream lines(script);
  std::string line;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string key;
    if (words >> key) read_line(here(), words, key);
  }
}

bool due(const char* name, long call) {
  return std::any_of(here().faults.begin(), here().faults.end(), [&](const Fault& f) {
    return f.name == name && call >= f.first && call < f.first + f.count;
  });
}

int failed(int error) {
  last_error = error;
  return -1;
}

void fall(int cause, const char* name) {
  if (here().cause.exchange(cause) == 0) event(name);
}

/// As the electronics of a device do: forces go off when no command came in time by the clock.
void look_at_watchdog(StandIn& s) {
  constexpr long long kTick_ns = 125'000;
  const long long last = s.last_command_ns;
  if (!s.by_clock || s.watchdog_ticks == 0 || last == 0) return;
  if (clock_ns() - last < s.watchdog_ticks * kTick_ns) return;
  s.last_command_ns = 0;
  fall(3, "watchdog");
}

void hang_if_due(long call) {
  for (const Fault& f : here().faults) {
    if (f.name != "hang" || f.first != call) continue;
    a_call_hung = true;
    event("hang");
    std::this_thread::sleep_for(std::chrono::milliseconds(f.count));
    event("hang_over");
  }
}

void dawdle_if_due(long call) {
  for (const Fault& f : here().faults) {
    if (f.name != "slow" || call < f.first || call >= f.first + f.count) continue;
    if (call == f.first) event("slow");
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
  }
}

}  // namespace

extern "C" {

/// Of no library of the vendor's: time passes in dhdSetForce, so that a loop in virtual time may
/// drive this.
int tpm_stand_in_without_clock() {
  return here().without_clock ? 1 : 0;
}

int dhdGetDeviceCount() {
  read_script();
  return here().devices;
}

int dhdOpenID(char index) {
  StandIn& s = here();
  if (index >= s.devices) return failed(15);
  if (s.index >= 0) return failed(20);
  s.index = std::max<int>(index, 0);
  tpm::haptics::OperatorScript script;
  if (!s.operator_file.empty()) script = tpm::haptics::read_operator_script(s.operator_file);
  s.plant = std::make_unique<tpm::haptics::VirtualPlant>(s.plant_settings, std::move(script));
  if (s.wait > 0) s.plant->await();
  event("open");
  return s.index;
}

int dhdClose(char) {
  event("close");
  if (here().index < 0) return failed(5);
  here().index = -1;
  return here().unplugged ? failed(5) : 0;
}

int dhdGetSystemType(char id) {
  const StandIn& s = here();
  if (s.index != id) return failed(5);
  return s.types.empty() ? s.type : s.types[static_cast<std::size_t>(id)];
}
const char* dhdGetSystemName(char) {
  return "omega.7";
}

int dhdGetSerialNumber(unsigned short* number, char id) {
  if (here().index != id) return failed(5);
  *number = static_cast<unsigned short>(4711 + id);
  return 0;
}

bool dhdHasGripper(char) {
  return here().gripper_m >= 0.0;
}

int dhdGetGripperGap(double* gap_m, char) {
  if (here().gripper_m < 0.0) return failed(6);
  *gap_m = here().gripper_m;
  return 0;
}

unsigned int dhdGetButtonMask(char) {
  return here().buttons;
}

int dhdSetEffectorMass(double kg, char) {
  event(("effector_mass_" + std::to_string(std::lround(1e3 * kg))).c_str());
  return 0;
}

int dhdSetBaseAngleXRad(double rad, char) {
  event(("base_angle_x_" + std::to_string(std::lround(1e3 * rad))).c_str());
  return 0;
}

int dhdGetVersion(double* firmware, char) {
  *firmware = 2.5;
  return 0;
}

void dhdGetSDKVersion(int* major, int* minor, int* release, int* revision) {
  read_script();
  *major = here().version;
  *minor = 14;
  *release = *revision = 0;
}

bool dhdIsLeftHanded(char) {
  return here().type == 37;
}
int dhdGetComMode(char) {
  return here().com_mode;
}
int dhdSetGravityCompensation(int, char) {
  return 0;
}
int dhdSetMaxForce(double newton, char) {
  event(("max_force_" + std::to_string(std::lround(1e3 * newton))).c_str());
  return 0;
}
int dhdSetBrakes(int, char) {
  event("threads_when_prepared", threads_of_process());
  return 0;
}

int dhdEnableForce(unsigned char on, char) {
  if (on == 0) event("forces_off");
  here().last_command_ns = on != 0 ? clock_ns() : 0;
  if (on != 0) event("thread_of_forces_on", ::gettid());
  if (here().unplugged) return failed(5);
  here().plant->forces(on != 0);
  return 0;
}

int dhdEnableExpertMode() {
  here().expert = true;
  return 0;
}

int dhdDisableExpertMode() {
  here().expert = false;
  return 0;
}

int dhdSetWatchdog(unsigned char ticks, char) {
  if (!here().expert) return failed(9);
  here().watchdog_ticks = ticks;
  return 0;
}

int dhdGetPosition(double* x, double* y, double* z, char) {
  StandIn& s = here();
  look_at_watchdog(s);
  const long call = s.reads++;
  if (!s.read_once) event("thread_of_first_read", ::gettid());
  s.read_once = true;
  hang_if_due(call);
  dawdle_if_due(call);
  if (due("unplugged", call)) {
    s.unplugged = true;
    fall(5, "unplugged");
  }
  if (s.unplugged) return failed(5);
  if (due("not_available", call)) return failed(6);
  if (due("communication", call)) {
    event("communication");
    return failed(2);
  }
  if (due("watchdog", call)) fall(3, "watchdog");
  if (due("velocity", call)) fall(2, "velocity");
  const Eigen::Vector3d at = s.plant->measured_m();
  *x = at.x();
  *y = at.y();
  *z = due("nan", call) ? std::numeric_limits<double>::quiet_NaN() : at.z();
  if (due("nan", call)) event("nan");
  return due("time_guard", call) ? 1 : 0;
}

int dhdSetForce(double x, double y, double z, char) {
  StandIn& s = here();
  if (s.unplugged) return failed(5);
  look_at_watchdog(s);
  if (s.last_command_ns != 0) s.last_command_ns = clock_ns();
  const bool clipped = s.plant->command({x, y, z});
  if (!s.read_once) return 0;  // still being prepared
  const long call = s.writes++;
  if (call + 1 == s.wait) s.plant->begin();
  s.plant->forces(s.cause == 0);
  s.plant->advance();
  return clipped || due("saturated", call) ? 2 : 0;
}

int dhdSetForceAndTorqueAndGripperForce(double, double, double, double, double, double,
                                        double gripper, char) {
  if (here().unplugged) return failed(5);
  event(("gripper_force_" + std::to_string(std::lround(1e3 * gripper))).c_str());
  return 0;
}

int dhdGetStatus(int* status, char) {
  StandIn& s = here();
  if (s.unplugged) return failed(5);
  look_at_watchdog(s);
  if (due("status", s.reads - 1) || due("status", s.reads - 2)) return failed(2);  // every second
  std::fill(status, status + s.entries, 0);
  if (s.entries > 14) status[14] = s.cause;
  return 0;
}

int dhdStop(char) {
  event("stop");
  return here().unplugged ? failed(5) : 0;
}

int dhdErrorGetLast() {
  return last_error;
}

const char* dhdErrorGetLastStr() {
  switch (last_error) {
    case 0:
      return "no error";
    case 2:
      return "communication error";
    case 5:
      return "no device";
    case 6:
      return "not available";
    case 9:
      return "expert mode disabled";
    default:
      return nullptr;
  }
}

#ifndef STAND_IN_WITHOUT_DRD
int drdOpenID(char index) {
  const int id = dhdOpenID(index);
  here().opened_by_drd = id >= 0;
  return id;
}

int drdClose(char id) {
  here().opened_by_drd = false;
  return dhdClose(id);
}

bool drdIsInitialized(char) {
  return here().opened_by_drd && here().initialised;
}

int drdAutoInit(char) {
  if (!here().opened_by_drd) return failed(5);
  StandIn& s = here();
  event("moved");
  for (int ms = 0; ms < s.init_ms && (s.stubborn || !s.init_stopped); ++ms) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  event("init_over");
  if (s.init_stopped) return failed(7);
  s.initialised = true;
  return 0;
}

#ifndef STAND_IN_WITHOUT_A_SYMBOL
int drdStop(bool keep_force, char) {
  if (!keep_force) {
    here().init_stopped = true;
    event("drd_stop");
  }
  return 0;
}
#endif
#endif

}  // extern "C"
