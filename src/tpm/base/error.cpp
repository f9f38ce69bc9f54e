#include "tpmkit/error.hpp"

#include <utf8.h>

#include <iterator>

#include "tpm/base/text.hpp"

namespace tpm {
using namespace base;

namespace {

std::string one_line(std::string_view where, std::string_view what, std::string_view expected) {
  std::string line;
  if (!where.empty()) line.append(where).append(": ");
  line.append(what);
  if (!expected.empty()) line.append("; expected ").append(expected);
  return for_terminal(line, LineEnds::escaped);
}

}  // namespace

Error::Error(ExitCode code, std::string_view where, std::string_view what,
             std::string_view expected)
    : Error(code, ErrorCause::unspecified, where, what, expected) {}

Error::Error(ExitCode code, ErrorCause cause, std::string_view where, std::string_view what,
             std::string_view expected)
    : std::runtime_error(one_line(where, what, expected)),
      code_(code),
      cause_(cause),
      reason_size_(one_line(where, what, {}).size()) {}

Error Error::within(std::string_view outer) const {
  Error whole(code_, cause_, outer, what());
  whole.reason_size_ -= std::string_view(what()).size() - reason_size_;
  return whole;
}

Error Error::with_code(ExitCode code) const {
  Error other = *this;
  other.code_ = code;
  return other;
}

Error bad_input(std::string_view where, std::string_view what, std::string_view expected) {
  return {ExitCode::bad_input, where, what, expected};
}

std::string printable(std::string_view text, std::size_t limit) {
  // Cut first: the text may be a line of a hundred megabytes.
  const bool cut = text.size() > limit;
  std::string_view head = text.substr(0, limit);
  std::string clean;
  utf8::replace_invalid(head.begin(), head.end(), std::back_inserter(clean), U'?');
  for (char& c : clean) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  if (cut) clean += "...";
  return clean;
}

}  // namespace tpm
