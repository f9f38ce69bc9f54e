// Passes every call to the vendor's library on to the one in $TPM_TRACED_LIBRARY and writes to
// $TPM_TRACE what was called and answered: a line where an answer differs from the one before, and
// at the end how often each call was made. For scripts/try_vendor_library.sh.
#include <dlfcn.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <mutex>
#include <string>

namespace {

struct Counted {
  long calls = 0;
  double last = 0.0;
};

class Trace {
 public:
  Trace() {
    const char* library = std::getenv("TPM_TRACED_LIBRARY");
    const char* file = std::getenv("TPM_TRACE");
    if (library == nullptr || file == nullptr) return;
    handle_ = dlopen(library, RTLD_NOW | RTLD_LOCAL);
    if (handle_ == nullptr) std::fprintf(stderr, "dhd_trace: %s\n", dlerror());
    out_ = std::fopen(file, "a");
  }
  Trace(const Trace&) = delete;
  Trace& operator=(const Trace&) = delete;
  ~Trace() {
    if (out_ == nullptr) return;
    for (const auto& [name, counted] : counted_) {
      std::fprintf(out_, "%8ld calls of %s, the last answered %g\n", counted.calls, name.c_str(),
                   counted.last);
    }
    std::fclose(out_);
  }

  void* find(const char* name) { return handle_ == nullptr ? nullptr : dlsym(handle_, name); }

  double note(const char* name, double answer) {
    const std::lock_guard<std::mutex> lock(mutex_);
    Counted& counted = counted_[name];
    if (out_ != nullptr && (counted.calls == 0 || counted.last != answer)) {
      std::fprintf(out_, "%s answered %g\n", name, answer);
      std::fflush(out_);
    }
    ++counted.calls;
    counted.last = answer;
    return answer;
  }

 private:
  void* handle_ = nullptr;
  std::FILE* out_ = nullptr;
  std::mutex mutex_;
  std::map<std::string, Counted> counted_;
};

Trace& trace() {
  static Trace traced;
  return traced;
}

template <class Answer, class... Arguments>
Answer pass(const char* name, Answer missing, Arguments... arguments) {
  using Call = Answer (*)(Arguments...);
  const auto call = reinterpret_cast<Call>(trace().find(name));
  const Answer answer = call == nullptr ? missing : call(arguments...);
  trace().note(name, static_cast<double>(answer));
  return answer;
}

const char* words(const char* name, char id, bool with_id) {
  using Of = const char* (*)(char);
  using Last = const char* (*)();
  void* call = trace().find(name);
  if (call == nullptr) return nullptr;
  return with_id ? reinterpret_cast<Of>(call)(id) : reinterpret_cast<Last>(call)();
}

}  // namespace

extern "C" {

/// Of the stand-in; 0 for a library that has no such call, as the vendor's.
int tpm_stand_in_without_clock() {
  void* call = trace().find("tpm_stand_in_without_clock");
  return call == nullptr ? 0 : reinterpret_cast<int (*)()>(call)();
}

int dhdGetDeviceCount() {
  return pass("dhdGetDeviceCount", -1);
}
int dhdOpenID(char index) {
  return pass("dhdOpenID", -1, index);
}
int dhdClose(char id) {
  return pass("dhdClose", -1, id);
}
int dhdGetSystemType(char id) {
  return pass("dhdGetSystemType", -1, id);
}
const char* dhdGetSystemName(char id) {
  return words("dhdGetSystemName", id, true);
}
int dhdGetSerialNumber(unsigned short* number, char id) {
  return pass("dhdGetSerialNumber", -1, number, id);
}
int dhdGetVersion(double* firmware, char id) {
  return pass("dhdGetVersion", -1, firmware, id);
}
void dhdGetSDKVersion(int* a, int* b, int* c, int* d) {
  using Call = void (*)(int*, int*, int*, int*);
  if (void* call = trace().find("dhdGetSDKVersion")) reinterpret_cast<Call>(call)(a, b, c, d);
  trace().note("dhdGetSDKVersion", *a);
}
bool dhdIsLeftHanded(char id) {
  return pass("dhdIsLeftHanded", false, id);
}
int dhdGetComMode(char id) {
  return pass("dhdGetComMode", -1, id);
}
int dhdSetGravityCompensation(int on, char id) {
  return pass("dhdSetGravityCompensation", -1, on, id);
}
int dhdSetMaxForce(double newton, char id) {
  return pass("dhdSetMaxForce", -1, newton, id);
}
int dhdSetBrakes(int on, char id) {
  return pass("dhdSetBrakes", -1, on, id);
}
int dhdEnableForce(unsigned char on, char id) {
  return pass("dhdEnableForce", -1, on, id);
}
int dhdEnableExpertMode() {
  return pass("dhdEnableExpertMode", -1);
}
int dhdDisableExpertMode() {
  return pass("dhdDisableExpertMode", -1);
}
int dhdSetWatchdog(unsigned char ticks, char id) {
  return pass("dhdSetWatchdog", -1, ticks, id);
}
int dhdGetPosition(double* x, double* y, double* z, char id) {
  return pass("dhdGetPosition", -1, x, y, z, id);
}
int dhdSetForce(double x, double y, double z, char id) {
  return pass("dhdSetForce", -1, x, y, z, id);
}
int dhdGetStatus(int* status, char id) {
  return pass("dhdGetStatus", -1, status, id);
}
int dhdStop(char id) {
  return pass("dhdStop", -1, id);
}
int dhdErrorGetLast() {
  return pass("dhdErrorGetLast", 0);
}
const char* dhdErrorGetLastStr() {
  return words("dhdErrorGetLastStr", 0, false);
}
bool dhdHasGripper(char id) {
  return pass("dhdHasGripper", false, id);
}
int dhdGetGripperGap(double* gap_m, char id) {
  return pass("dhdGetGripperGap", -1, gap_m, id);
}
unsigned int dhdGetButtonMask(char id) {
  return pass("dhdGetButtonMask", 0U, id);
}
int drdOpenID(char index) {
  return pass("drdOpenID", -1, index);
}
int drdClose(char id) {
  return pass("drdClose", -1, id);
}
bool drdIsInitialized(char id) {
  return pass("drdIsInitialized", false, id);
}
int drdAutoInit(char id) {
  return pass("drdAutoInit", -1, id);
}
int drdStop(bool keep_force, char id) {
  return pass("drdStop", -1, keep_force, id);
}

}  // extern "C"
