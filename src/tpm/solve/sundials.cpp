#include "tpm/solve/sundials.hpp"

#include <fmt/format.h>

#include <cstdlib>

namespace tpm::sundials {

std::string flag_name(int flag) {
  char* name = CVodeGetReturnFlagName(flag);
  std::string text = name;
  std::free(name);  // NOLINT(cppcoreguidelines-no-malloc): SUNDIALS allocates it with malloc
  return text;
}

void check(int flag, std::string_view call) {
  if (flag >= 0) return;
  throw Error(ExitCode::numerical, "CVODES", fmt::format("{} returned {}", call, flag_name(flag)));
}

Context make_context() {
  SUNContext context = nullptr;
#if SUNDIALS_VERSION_MAJOR >= 7
  const int flag = SUNContext_Create(SUN_COMM_NULL, &context);
#else
  const int flag = SUNContext_Create(nullptr, &context);
#endif
  if (flag != 0) throw Error(ExitCode::numerical, "SUNDIALS", "could not create a context");
#if SUNDIALS_VERSION_MAJOR >= 7
  SUNContext_ClearErrHandlers(context);
#endif
  return Context(context);
}

void mute(void* cvodes) {
#if SUNDIALS_VERSION_MAJOR >= 7
  static_cast<void>(cvodes);  // there the context prints, and make_context has told it not to
#else
  const CVErrHandlerFn nothing = [](int, const char*, const char*, char*, void*) {};
  check(CVodeSetErrHandlerFn(cvodes, nothing, nullptr), "CVodeSetErrHandlerFn");
#endif
}

}  // namespace tpm::sundials
