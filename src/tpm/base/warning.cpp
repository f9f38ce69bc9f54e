#include "tpm/base/warning.hpp"

#include <cstdio>
#include <mutex>
#include <set>
#include <utility>

#include "tpm/base/text.hpp"

namespace tpm::base {
namespace {

struct Warnings {
  std::mutex mutex;
  std::set<std::string> told;
  WarningSink sink;
};

/// Made at the first use and never destroyed: threads may warn while the program ends.
Warnings& warnings() {
  static Warnings& all = *new Warnings;
  return all;
}

}  // namespace

void warn(const std::string& text) {
  WarningSink sink;
  {
    Warnings& all = warnings();
    const std::lock_guard lock(all.mutex);
    if (!all.told.insert(text).second) return;
    sink = all.sink;
  }
  // Without the lock: a sink may wait for a lock of its own, such as Python's.
  if (sink) return sink(text);
  const std::string line = for_terminal("tpm: warning: " + text, LineEnds::escaped) + "\n";
  (void)std::fputs(line.c_str(), stderr);
}

WarningSink set_warning_sink(WarningSink sink) {
  Warnings& all = warnings();
  const std::lock_guard lock(all.mutex);
  return std::exchange(all.sink, std::move(sink));
}

}  // namespace tpm::base
