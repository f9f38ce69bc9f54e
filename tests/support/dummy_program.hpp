#pragma once
// The program that is linked with the worked examples of docs/adding.md.
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cstdio>
#include <string>

#include "tpm/files/json.hpp"

namespace tpm::test {
using namespace files;

/// Its output and exit code.
struct DummyAnswer {
  std::string text;
  int code = 0;
};

inline DummyAnswer dummy_program(const std::string& arguments) {
  const std::string line = std::string(TPM_DUMMY_PROGRAM) + " " + arguments + " 2>&1";
  FILE* const pipe = popen(line.c_str(), "r");
  REQUIRE(pipe != nullptr);
  DummyAnswer answer;
  std::array<char, 4096> part{};
  while (const std::size_t size = fread(part.data(), 1, part.size(), pipe)) {
    answer.text.append(part.data(), size);
  }
  const int status = pclose(pipe);
  answer.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return answer;
}

/// The JSON that a command prints.
inline Json answer_of(const std::string& arguments) {
  const DummyAnswer answer = dummy_program(arguments + " --format json 2>/dev/null");
  CAPTURE(arguments, answer.text);
  return parse_json(answer.text, "answer");
}

/// An entry of a list of objects has this name.
inline bool names(const Json& list, const std::string& name) {
  return std::any_of(list.begin(), list.end(),
                     [&](const Json& entry) { return entry.at("name") == name; });
}

}  // namespace tpm::test
