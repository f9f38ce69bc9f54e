#include "tpm/solve/sundials.hpp"

#include <fmt/format.h>

#include <cstdlib>

namespace tpm::sundials {

void check(int flag, std::string_view call) {
  if (flag >= 0) return;
  char* name = CVodeGetReturnFlagName(flag);
  const std::string text = fmt::format("{} returned {}", call, name);
  std::free(name);  // NOLINT(cppcoreguidelines-no-malloc): SUNDIALS allocates it with malloc
  throw Error(ExitCode::numerical, "CVODES", text);
}

Context make_context() {
  SUNContext context = nullptr;
#if SUNDIALS_VERSION_MAJOR >= 7
  const int flag = SUNContext_Create(SUN_COMM_NULL, &context);
#else
  const int flag = SUNContext_Create(nullptr, &context);
#endif
  if (flag != 0) throw Error(ExitCode::numerical, "SUNDIALS", "could not create a context");
  return Context(context);
}

}  // namespace tpm::sundials
