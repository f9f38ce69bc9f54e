#pragma once
#include <stdexcept>
#include <string>
#include <string_view>

namespace tpm {

/// Exit code of the program. 1 means that it ran to the end and the answer is no: a data check or a
/// gradient check failed.
enum class ExitCode : int {
  success = 0,
  answer_is_no = 1,
  usage = 2,        ///< the command line itself
  bad_input = 3,    ///< a file or a value in it
  numerical = 4,    ///< a solver gave up
  environment = 5,  ///< something outside: cannot write, missing helper program
};

/// Why a solver gave up, for code that decides what to do about it: a message is for people.
enum class ErrorCause : int {
  unspecified = 0,
  buckled,          ///< the tangent stiffness is no longer positive definite
  snapped_through,  ///< no equilibrium was found near the last one
};

/// An error, printed as one line: "WHERE: WHAT; expected EXPECTED". It may repeat names and titles
/// from files, so control characters and line ends are escaped (for_terminal()).
class Error : public std::runtime_error {
 public:
  /// @param where file, file:line, key or option; may be empty
  /// @param what  what is wrong, without a full stop
  /// @param expected what would have been right; may be empty
  Error(ExitCode code, std::string_view where, std::string_view what,
        std::string_view expected = {});
  Error(ExitCode code, ErrorCause cause, std::string_view where, std::string_view what,
        std::string_view expected = {});

  [[nodiscard]] ExitCode code() const noexcept { return code_; }
  [[nodiscard]] ErrorCause cause() const noexcept { return cause_; }
  /// The message without what was expected.
  [[nodiscard]] std::string_view reason() const noexcept {
    return std::string_view(what()).substr(0, reason_size_);
  }

  /// Adds an outer place in front ("fit.json" before "key 'E'"), for an inner function that does
  /// not know its file.
  [[nodiscard]] Error within(std::string_view outer) const;

  /// The same error with another exit code: a value that a file must not have is a usage error
  /// where it stands on the command line.
  [[nodiscard]] Error with_code(ExitCode code) const;

 private:
  ExitCode code_;
  ErrorCause cause_ = ErrorCause::unspecified;
  std::size_t reason_size_ = 0;
};

/// Shorthand for an Error(bad_input).
[[nodiscard]] Error bad_input(std::string_view where, std::string_view what,
                              std::string_view expected = {});

/// Makes text from a file safe for a one-line message. Control characters and bytes that are not
/// UTF-8 become '?'. Text longer than `limit` characters is cut with "...".
[[nodiscard]] std::string printable(std::string_view text, std::size_t limit = 60);

/// A message about a result that does not change it: a warning, an assumption, a limit that was
/// passed. Programs read the code, people the text. The code is written where the remark is made,
/// in lower case with underscores ("outliers"); it stays when the text or its numbers change.
struct Remark {
  std::string code;
  std::string text;  ///< one sentence

  [[nodiscard]] bool operator==(const Remark&) const = default;
};

}  // namespace tpm
