#include "tpm/organ/linear/sundials.hpp"

#include <fmt/format.h>

#include <cstdlib>

namespace tpm::organ::sundials {

extern "C" {
// A custom matrix and its solver hold nothing of their own.
static SUNMatrix_ID custom_matrix_id(SUNMatrix) {
  return SUNMATRIX_CUSTOM;
}

static int custom_matrix_zero(SUNMatrix) {
  return 0;
}

static SUNLinearSolver_Type custom_solver_type(SUNLinearSolver) {
  return SUNLINEARSOLVER_DIRECT;
}

static int custom_solver_free(SUNLinearSolver solver) {
  SUNLinSolFreeEmpty(solver);
  return 0;
}
}

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

Matrix custom_matrix(SUNContext context) {
  Matrix matrix(SUNMatNewEmpty(context));
  matrix->ops->getid = custom_matrix_id;
  matrix->ops->destroy = SUNMatFreeEmpty;
  matrix->ops->zero = custom_matrix_zero;
  return matrix;
}

LinearSolver custom_solver(SUNContext context, void* content,
                           int (*solve)(SUNLinearSolver, SUNMatrix, N_Vector, N_Vector,
                                        sunrealtype)) {
  LinearSolver solver(SUNLinSolNewEmpty(context));
  solver->content = content;
  solver->ops->gettype = custom_solver_type;
  solver->ops->solve = solve;
  solver->ops->free = custom_solver_free;
  return solver;
}

void mute(void* cvodes) {
#if SUNDIALS_VERSION_MAJOR >= 7
  static_cast<void>(cvodes);  // there the context prints, and make_context has told it not to
#else
  const CVErrHandlerFn nothing = [](int, const char*, const char*, char*, void*) {};
  check(CVodeSetErrHandlerFn(cvodes, nothing, nullptr), "CVodeSetErrHandlerFn");
#endif
}

}  // namespace tpm::organ::sundials
