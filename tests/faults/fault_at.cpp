// Makes the n-th call of one kind fail in a process: preloaded into `tpm` by fault_table.py and
// kill_table.py. The environment says what fails; without it every call goes through.
//
//   TPM_FAULT_CALL     read, write, sync, rename (and linkat), open (for writing), open_read,
//   truncate, folder,
//                      close (of what was open for writing), memory, thread, process, or change:
//                      any call that changes a file; a write counts twice there, before it and
//                      half-way
//   TPM_FAULT_AT       which call fails, from 1; 0 only counts
//   TPM_FAULT_HOW      ENOSPC, EIO, EMFILE, EINTR, ENOMEM, EAGAIN; short: half of a write;
//                      kill: SIGKILL
//   TPM_FAULT_ONWARD   set: all later calls fail too
//   TPM_FAULT_NO_TMPFILE  set: no file system knows files without a name (O_TMPFILE)
//   TPM_FAULT_UNDER    only files in this folder count
//   TPM_FAULT_PROGRAM  only a program whose file name begins so is touched
//   TPM_FAULT_MARK     file for what became of it: "fired ..." when a call failed, "calls N" at
//                      the end
//
// Calls are counted from main() on, in all threads and child processes together; a child that is
// killed takes its parent with it. Files are reached by system calls, so
// that nothing here needs memory or another library to be ready.
#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <new>
#include <utility>

#include "fault_at.hpp"

namespace {

using fault_at::next;

enum class Call {
  none,
  read,
  write,
  sync,
  rename,
  open,
  open_read,
  truncate,
  folder,
  close,
  memory,
  thread,
  process,
  change
};

struct Fault {
  Call call = Call::none;
  long at = 0;
  int error_number = EIO;
  bool cut_short = false, kill = false, onward = false;
  char under[PATH_MAX] = "";
};

Fault fault;
std::atomic<bool> armed{false};
pid_t counted_process = 0;
bool no_tmpfile = false;

void keep_text(char* to, const char* name) {
  const char* text = getenv(name);
  if (text != nullptr && strlen(text) < PATH_MAX) memcpy(to, text, strlen(text) + 1);
}

/// The mark is a file in memory, which a child can still reach when it may open no more files.
constexpr std::size_t kMarkSize = 1U << 15U;
char* mark = nullptr;

struct Shared {
  std::atomic<long> calls{0};
  std::atomic<std::size_t> marked{0};
};
Shared* shared = nullptr;  ///< with children

void open_mark(const char* name) {
  const auto file = static_cast<int>(
      syscall(SYS_openat, AT_FDCWD, name, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file < 0 || syscall(SYS_ftruncate, file, kMarkSize) != 0) abort();
  void* bytes = mmap(nullptr, kMarkSize, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (bytes == MAP_FAILED) abort();
  mark = static_cast<char*>(bytes);
  (void)syscall(SYS_close, file);
}

void write_mark(const char* text) {
  if (mark == nullptr) return;
  const std::size_t size = strlen(text), place = shared->marked.fetch_add(size);
  if (place + size <= kMarkSize) memcpy(mark + place, text, size);
}

bool is_wanted_program() {
  const char* wanted = getenv("TPM_FAULT_PROGRAM");
  if (wanted == nullptr) return true;
  char program[PATH_MAX] = "";
  const ssize_t size = readlink("/proc/self/exe", program, sizeof program - 1);
  if (size <= 0) return false;
  const char* stroke = strrchr(program, '/');
  return stroke != nullptr && strncmp(stroke + 1, wanted, strlen(wanted)) == 0;
}

void read_environment() {
  const char* call = getenv("TPM_FAULT_CALL");
  if (call == nullptr || !is_wanted_program()) return;
  constexpr std::pair<const char*, Call> kCalls[] = {
      {"read", Call::read},         {"write", Call::write},   {"sync", Call::sync},
      {"rename", Call::rename},     {"open", Call::open},     {"open_read", Call::open_read},
      {"truncate", Call::truncate}, {"folder", Call::folder}, {"close", Call::close},
      {"memory", Call::memory},     {"thread", Call::thread}, {"process", Call::process},
      {"change", Call::change}};
  for (const auto& [name, value] : kCalls) {
    if (strcmp(name, call) == 0) fault.call = value;
  }
  constexpr std::pair<const char*, int> kErrors[] = {{"ENOSPC", ENOSPC}, {"EIO", EIO},
                                                     {"EMFILE", EMFILE}, {"EINTR", EINTR},
                                                     {"ENOMEM", ENOMEM}, {"EAGAIN", EAGAIN}};
  const char* how = getenv("TPM_FAULT_HOW");
  bool known = false;
  for (const auto& [name, value] : kErrors) {
    if (how == nullptr || strcmp(name, how) != 0) continue;
    fault.error_number = value;
    known = true;
  }
  fault.cut_short = how != nullptr && strcmp(how, "short") == 0;
  fault.kill = how != nullptr && strcmp(how, "kill") == 0;
  const char* at = getenv("TPM_FAULT_AT");
  fault.at = at == nullptr ? 0 : strtol(at, nullptr, 10);
  fault.onward = getenv("TPM_FAULT_ONWARD") != nullptr;
  keep_text(fault.under, "TPM_FAULT_UNDER");
  if (const char* name = getenv("TPM_FAULT_MARK"); name != nullptr) open_mark(name);
  if (fault.call == Call::none || !(known || fault.cut_short || fault.kill)) {
    static const char kWords[] = "fault_at: TPM_FAULT_CALL or TPM_FAULT_HOW says nothing known\n";
    (void)syscall(SYS_write, STDERR_FILENO, kWords, sizeof kWords - 1);
    _exit(99);
  }
}

bool counts_path(const char* path) {
  if (fault.under[0] == '\0') return true;
  const std::size_t size = strlen(fault.under);
  if (path[0] == '/') return strncmp(path, fault.under, size) == 0;
  char here[PATH_MAX] = "";
  return syscall(SYS_getcwd, here, sizeof here) > 0 && strncmp(here, fault.under, size) == 0;
}

bool counts_file(int file) {
  if (file == STDERR_FILENO) return false;
  if (fault.under[0] == '\0') return true;
  char link[32] = "", path[PATH_MAX] = "";
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  return readlink(link, path, sizeof path - 1) > 0 && counts_path(path);
}

bool watches(Call call) {
  return armed.load(std::memory_order_relaxed) && fault.call == call;
}

/// Counts a call; true if it is to fail. A killed process does not come back.
bool fails(const char* name, const char* path) {
  const long number = shared->calls.fetch_add(1) + 1;
  if (fault.at == 0 || number < fault.at || (number > fault.at && !fault.onward)) return false;
  if (number == fault.at) {
    char line[PATH_MAX + 80] = "";
    // No formatting of stdio: it may want memory.
    std::size_t size = 0;
    for (const char* part : {"fired ", name, " ", path, "\n"}) {
      for (; *part != '\0' && size + 2 < sizeof line; ++part) line[size++] = *part;
    }
    write_mark(line);
  }
  if (fault.kill) {
    if (getpid() != counted_process) (void)syscall(SYS_kill, counted_process, SIGKILL);
    (void)syscall(SYS_kill, getpid(), SIGKILL);
    for (;;) pause();
  }
  return true;
}

/// @returns true, with errno set, if the call of that kind on the path is to fail
bool fails_on(Call call, const char* name, const char* path) {
  if (!watches(call) || !counts_path(path) || !fails(name, path)) return false;
  errno = fault.error_number;
  return true;
}

bool fails_on(Call call, const char* name, int file) {
  if (!watches(call) || !counts_file(file)) return false;
  char link[32] = "", path[PATH_MAX] = "";
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  (void)!readlink(link, path, sizeof path - 1);
  if (!fails(name, path)) return false;
  errno = fault.error_number;
  return true;
}

void note_change(const char* name, const char* path) {
  (void)fails_on(Call::change, name, path);
}

void note_change(const char* name, int file) {
  (void)fails_on(Call::change, name, file);
}

/// How many bytes of a write are to be written: all, half of them, or -1 for none and an error.
template <class WriteHalf>
ssize_t allowed(int file, std::size_t size, const WriteHalf& write_half) {
  if (watches(Call::change)) {
    note_change("before write", file);
    if (counts_file(file) && fault.at == shared->calls.load() + 1 && size > 1) write_half();
    note_change("within write", file);
  }
  if (fails_on(Call::write, "write", file)) {
    return fault.cut_short ? static_cast<ssize_t>(size > 1 ? size / 2 : size) : -1;
  }
  return static_cast<ssize_t>(size);
}

bool writes(int flags) {
  return (flags & O_ACCMODE) != O_RDONLY;
}

int open_counted(int folder, const char* path, int flags, mode_t mode) {
  if (no_tmpfile && (flags & O_TMPFILE) == O_TMPFILE) {
    errno = EOPNOTSUPP;
    return -1;
  }
  if (writes(flags)) {
    if (fails_on(Call::open, "open", path)) return -1;
    if ((flags & (O_CREAT | O_TRUNC | __O_TMPFILE)) != 0) note_change("open", path);
  } else if (fails_on(Call::open_read, "open", path)) {
    return -1;
  }
  return static_cast<int>(syscall(SYS_openat, folder, path, flags, mode));
}

mode_t mode_of(int flags, va_list arguments) {
  return (flags & (O_CREAT | __O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
}

FILE* fopen_counted(const char* name, const char* path, const char* mode) {
  using Open = FILE* (*)(const char*, const char*);
  if (strpbrk(mode, "wa+") != nullptr) {
    if (fails_on(Call::open, "open", path)) return nullptr;
    note_change("open", path);
  } else if (fails_on(Call::open_read, "open", path)) {
    return nullptr;
  }
  return next<Open>(name)(path, mode);
}

int rename_counted(int from_folder, const char* from, int to_folder, const char* to) {
  if (fails_on(Call::rename, "rename", to)) return -1;
  note_change("rename", to);
  return static_cast<int>(syscall(SYS_renameat2, from_folder, from, to_folder, to, 0));
}

using Main = int (*)(int, char**, char**);
Main program_main = nullptr;

int armed_main(int count, char** arguments, char** environment) {
  armed = true;
  return program_main(count, arguments, environment);
}

__attribute__((constructor)) void begin_counting() {
  void* bytes =
      mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (bytes == MAP_FAILED) abort();
  shared = new (bytes) Shared;
  counted_process = getpid();
  no_tmpfile = getenv("TPM_FAULT_NO_TMPFILE") != nullptr;
  read_environment();
}

__attribute__((destructor)) void end_counting() {
  if (fault.call == Call::none) return;
  armed = false;
  char line[40] = "";
  snprintf(line, sizeof line, "calls %ld\n", shared->calls.load());
  write_mark(line);
}

}  // namespace

namespace fault_at {

bool memory_fails() {
  if (!watches(Call::memory) || !fails("memory", "")) return false;
  errno = ENOMEM;
  return true;
}

bool thread_fails() {
  return watches(Call::thread) && fails("thread", "");
}

int process_error(const char* name, const char* program) {
  return watches(Call::process) && fails(name, program) ? fault.error_number : 0;
}

}  // namespace fault_at

// NOLINTBEGIN(bugprone-reserved-identifier): names of the C library, taken over
extern "C" {

int __libc_start_main(Main main, int count, char** arguments, void (*init)(), void (*fini)(),
                      void (*loader_fini)(), void* stack_end) {
  using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);
  program_main = main;
  return next<Start>("__libc_start_main")(armed_main, count, arguments, init, fini, loader_fini,
                                          stack_end);
}

ssize_t read(int file, void* bytes, std::size_t size) {
  if (fails_on(Call::read, "read", file)) return -1;
  return syscall(SYS_read, file, bytes, size);
}

ssize_t pread(int file, void* bytes, std::size_t size, off_t place) {
  if (fails_on(Call::read, "read", file)) return -1;
  return syscall(SYS_pread64, file, bytes, size, place);
}

ssize_t pread64(int file, void* bytes, std::size_t size, off_t place) {
  return pread(file, bytes, size, place);
}

ssize_t write(int file, const void* bytes, std::size_t size) {
  const ssize_t allow =
      allowed(file, size, [&] { (void)syscall(SYS_write, file, bytes, size / 2); });
  return allow < 0 ? -1 : syscall(SYS_write, file, bytes, allow);
}

ssize_t pwrite(int file, const void* bytes, std::size_t size, off_t place) {
  const ssize_t allow =
      allowed(file, size, [&] { (void)syscall(SYS_pwrite64, file, bytes, size / 2, place); });
  return allow < 0 ? -1 : syscall(SYS_pwrite64, file, bytes, allow, place);
}

ssize_t pwrite64(int file, const void* bytes, std::size_t size, off_t place) {
  return pwrite(file, bytes, size, place);
}

ssize_t writev(int file, const struct iovec* parts, int count) {
  if (count <= 0) return syscall(SYS_writev, file, parts, count);
  const ssize_t allow = allowed(file, 2, [&] { (void)syscall(SYS_writev, file, parts, 1); });
  if (allow < 0) return -1;
  return syscall(SYS_writev, file, parts, allow < 2 ? 1 : count);
}

int fsync(int file) {
  if (fails_on(Call::sync, "fsync", file)) return -1;
  note_change("fsync", file);
  return static_cast<int>(syscall(SYS_fsync, file));
}

int fdatasync(int file) {
  if (fails_on(Call::sync, "fdatasync", file)) return -1;
  note_change("fdatasync", file);
  return static_cast<int>(syscall(SYS_fdatasync, file));
}

int ftruncate(int file, off_t size) {
  if (fails_on(Call::truncate, "ftruncate", file)) return -1;
  note_change("ftruncate", file);
  return static_cast<int>(syscall(SYS_ftruncate, file, size));
}

int ftruncate64(int file, off_t size) {
  return ftruncate(file, size);
}

int posix_fallocate(int file, off_t place, off_t size) {
  using Allocate = int (*)(int, off_t, off_t);
  if (fails_on(Call::truncate, "posix_fallocate", file)) return fault.error_number;
  note_change("posix_fallocate", file);
  return next<Allocate>("posix_fallocate")(file, place, size);
}

int posix_fallocate64(int file, off_t place, off_t size) {
  return posix_fallocate(file, place, size);
}

int rename(const char* from, const char* to) {
  return rename_counted(AT_FDCWD, from, AT_FDCWD, to);
}

int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  return rename_counted(from_folder, from, to_folder, to);
}

int linkat(int from_folder, const char* from, int to_folder, const char* to, int flags) {
  if (fails_on(Call::rename, "linkat", to)) return -1;
  note_change("linkat", to);
  return static_cast<int>(syscall(SYS_linkat, from_folder, from, to_folder, to, flags));
}

int unlink(const char* path) {
  note_change("unlink", path);
  return static_cast<int>(syscall(SYS_unlinkat, AT_FDCWD, path, 0));
}

int remove(const char* path) {
  using Remove = int (*)(const char*);
  note_change("remove", path);
  return next<Remove>("remove")(path);
}

int mkdir(const char* path, mode_t mode) {
  if (fails_on(Call::folder, "mkdir", path)) return -1;
  note_change("mkdir", path);
  return static_cast<int>(syscall(SYS_mkdirat, AT_FDCWD, path, mode));
}

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = mode_of(flags, arguments);
  va_end(arguments);
  return open_counted(AT_FDCWD, path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = mode_of(flags, arguments);
  va_end(arguments);
  return open_counted(AT_FDCWD, path, flags, mode);
}

int openat(int folder, const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = mode_of(flags, arguments);
  va_end(arguments);
  return open_counted(folder, path, flags, mode);
}

int openat64(int folder, const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = mode_of(flags, arguments);
  va_end(arguments);
  return open_counted(folder, path, flags, mode);
}

int __open_2(const char* path, int flags) {
  return open_counted(AT_FDCWD, path, flags, 0);
}

int __open64_2(const char* path, int flags) {
  return open_counted(AT_FDCWD, path, flags, 0);
}

FILE* fopen(const char* path, const char* mode) {
  return fopen_counted("fopen", path, mode);
}

FILE* fopen64(const char* path, const char* mode) {
  return fopen_counted("fopen64", path, mode);
}

int close(int file) {
  if (watches(Call::close)) {
    const long flags = syscall(SYS_fcntl, file, F_GETFL);
    if (flags >= 0 && writes(static_cast<int>(flags)) && fails_on(Call::close, "close", file)) {
      const int error_number = errno;
      (void)syscall(SYS_close, file);
      errno = error_number;
      return -1;
    }
  }
  return static_cast<int>(syscall(SYS_close, file));
}

}  // extern "C"
// NOLINTEND(bugprone-reserved-identifier)
