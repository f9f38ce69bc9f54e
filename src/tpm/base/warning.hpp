#pragma once
#include <functional>
#include <string>

namespace tpm::base {

/// Tells the user what does not stop the work: the line "tpm: warning: TEXT" on standard error,
/// once for each text in the life of the program. Callable from several threads.
void warn(const std::string& text);

/// Takes the text of a warning.
using WarningSink = std::function<void(const std::string& text)>;

/// Gives warnings to a function in place of standard error; an empty one gives them back. The
/// function must be callable from several threads. Returns the function that had them before.
WarningSink set_warning_sink(WarningSink sink);

}  // namespace tpm::base
