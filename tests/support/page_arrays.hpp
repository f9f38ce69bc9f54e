#pragma once
// Arrays of numbers in a page of tpm view, read back from its text.
#include <catch2/catch.hpp>
#include <cstring>
#include <string>
#include <vector>

#include "tpm/files/json.hpp"

namespace tpm::test {

/// Of base64, by its definition (RFC 4648), and not by the library that wrote it.
inline std::string decoded(const std::string& text) {
  static const std::string kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  int held = 0;
  for (const char c : text) {
    if (c == '=') break;
    const std::size_t digit = kDigits.find(c);
    REQUIRE(digit != std::string::npos);
    bits = (bits << 6U) | static_cast<unsigned>(digit);
    held += 6;
    if (held >= 8) {
      held -= 8;
      bytes += static_cast<char>((bits >> static_cast<unsigned>(held)) & 0xFFU);
    }
  }
  return bytes;
}

/// An array of the page by its name.
template <class Number>
std::vector<Number> numbers(const std::string& html, const files::Json& name) {
  const std::string begin = "id=\"" + name.get<std::string>() + "\" data-type=\"";
  const std::size_t at = html.find(begin);
  REQUIRE(at != std::string::npos);
  const std::size_t from = html.find('>', at) + 1;
  const std::string bytes = decoded(html.substr(from, html.find('<', from) - from));
  std::vector<Number> values(bytes.size() / sizeof(Number));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(Number));
  return values;
}

}  // namespace tpm::test
