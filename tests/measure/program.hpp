#pragma once
#include <fmt/format.h>

#include <exception>
#include <string>
#include <vector>

#include "tpmkit/error.hpp"

namespace tpm::test {

/// The main function of a program that measures: says its usage unless it is given from `least` to
/// `most` words, and prints an error.
template <class Work>
int measured(int argc, char** argv, std::size_t least, std::size_t most, const char* usage,
             const Work& work) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() < least || words.size() > most) {
    fmt::print(stderr, "{}\n", usage);
    return 2;
  }
  try {
    work(words);
    return 0;
  } catch (const Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return static_cast<int>(error.code());
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 3;
  }
}

}  // namespace tpm::test
