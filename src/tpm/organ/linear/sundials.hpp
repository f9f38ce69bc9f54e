#pragma once
// SUNDIALS objects that free themselves, and the one place that knows the differences between its
// major versions.
#include <cvodes/cvodes.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_config.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <Eigen/Core>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>

#include "tpmkit/error.hpp"

namespace tpm::organ::sundials {

struct FreeContext {
  void operator()(SUNContext c) const { SUNContext_Free(&c); }
};
struct FreeVector {
  void operator()(N_Vector v) const { N_VDestroy(v); }
};
struct FreeMatrix {
  void operator()(SUNMatrix m) const { SUNMatDestroy(m); }
};
struct FreeSolver {
  void operator()(SUNLinearSolver s) const { SUNLinSolFree(s); }
};
struct FreeCvodes {
  void operator()(void* memory) const { CVodeFree(&memory); }
};

using Context = std::unique_ptr<std::remove_pointer_t<SUNContext>, FreeContext>;
using Vector = std::unique_ptr<std::remove_pointer_t<N_Vector>, FreeVector>;
using Matrix = std::unique_ptr<std::remove_pointer_t<SUNMatrix>, FreeMatrix>;
using LinearSolver = std::unique_ptr<std::remove_pointer_t<SUNLinearSolver>, FreeSolver>;
using Cvodes = std::unique_ptr<void, FreeCvodes>;

/// "CV_TOO_MUCH_WORK" and the like.
[[nodiscard]] std::string flag_name(int flag);

/// Throws Error(numerical) "CVODES: CALL: FLAG" for a negative return value.
void check(int flag, std::string_view call);

[[nodiscard]] Context make_context();

/// The numbers of a serial vector.
[[nodiscard]] inline Eigen::Map<Eigen::VectorXd> view(N_Vector v) {
  return {NV_DATA_S(v), static_cast<Eigen::Index>(NV_LENGTH_S(v))};
}

/// A matrix that stands for a factorisation inside the problem.
[[nodiscard]] Matrix custom_matrix(SUNContext context);

/// The solver of such a matrix. @param content what `solve` finds in its first argument
[[nodiscard]] LinearSolver custom_solver(SUNContext context, void* content,
                                         int (*solve)(SUNLinearSolver, SUNMatrix, N_Vector,
                                                      N_Vector, sunrealtype));

/// Lets an integrator print nothing: what goes wrong is thrown where its return value is checked.
void mute(void* cvodes);

}  // namespace tpm::organ::sundials
