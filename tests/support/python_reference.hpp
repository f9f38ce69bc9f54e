#pragma once
// Runs the reference programs of scripts/, which are written in Python with numpy and scipy.
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>

#include "tpm/files/json.hpp"

namespace tpm_test {
using namespace tpm::files;

/// A python3 that has scipy: the one on the path may be a version manager's without it.
inline std::string python_with_scipy() {
  for (const char* python : {"python3", "/usr/bin/python3"}) {
    const std::string probe = fmt::format("{} -c 'import scipy' 2>/dev/null", python);
    if (std::system(probe.c_str()) == 0) return python;
  }
  throw std::runtime_error("no python3 with scipy; Debian: python3-scipy");
}

inline std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  if (pipe == nullptr) throw std::runtime_error("cannot run " + command);
  std::string text;
  for (int c = std::fgetc(pipe.get()); c != EOF; c = std::fgetc(pipe.get())) {
    text += static_cast<char>(c);
  }
  return text;
}

/// Output of such a reference.
inline tpm::files::Json python_reference(const std::string& script, const std::string& arguments) {
  const std::string command = fmt::format("{} '{}/scripts/{}' {}", python_with_scipy(),
                                          TPM_TEST_SOURCE_DIR, script, arguments);
  return tpm::files::parse_json(output_of(command), script);
}

}  // namespace tpm_test
