#include "tpm/organ/balance/inertial_integration.hpp"

#include <fmt/format.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunmatrix/sunmatrix_sparse.h>

#include <algorithm>
#include <vector>

#include "tpm/base/text.hpp"

namespace tpm::organ {
namespace {

using sundials::check;
using sundials::view;

InertialEquation& equation(void* user_data) {
  return *static_cast<InertialEquation*>(user_data);
}

extern "C" {
int motion_rate(sunrealtype t, N_Vector y, N_Vector y_dot, void* user_data) {
  auto rate = view(y_dot);
  equation(user_data).rate(t, view(y), rate);
  return rate.allFinite() ? 0 : 1;  // spheres that meet: a shorter step
}

int motion_powers(sunrealtype t, N_Vector y, N_Vector powers, void* user_data) {
  view(powers) = equation(user_data).powers_W(t, view(y));
  return 0;
}

int motion_gaps(sunrealtype t, N_Vector y, sunrealtype* gaps, void* user_data) {
  InertialEquation& motion = equation(user_data);
  motion.gaps(t, view(y),
              Eigen::Map<Eigen::VectorXd>(gaps, std::ssize(motion.tissue().bonds().contacts())));
  return 0;
}

int motion_jacobian(sunrealtype t, N_Vector y, N_Vector /*fy*/, SUNMatrix matrix, void* user_data,
                    N_Vector, N_Vector, N_Vector) {
  const InertialEquation::Sparse j = equation(user_data).jacobian(t, view(y));
  std::copy_n(j.valuePtr(), j.nonZeros(), SUNSparseMatrix_Data(matrix));
  std::copy_n(j.innerIndexPtr(), j.nonZeros(), SUNSparseMatrix_IndexValues(matrix));
  std::copy_n(j.outerIndexPtr(), j.cols() + 1, SUNSparseMatrix_IndexPointers(matrix));
  return 0;
}

int eliminated_setup(sunrealtype t, N_Vector y, N_Vector /*fy*/, SUNMatrix, sunbooleantype /*jok*/,
                     sunbooleantype* is_new, sunrealtype gamma, void* user_data, N_Vector, N_Vector,
                     N_Vector) {
  *is_new = SUNTRUE;
  return equation(user_data).factorise(t, view(y), gamma) ? 0 : 1;
}

int eliminated_solve(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, sunrealtype) {
  auto solution = view(x);
  solution = view(b);
  equation(solver->content).solve(solution);
  return 0;
}
}

}  // namespace

InertialIntegration::InertialIntegration(InertialEquation& eq, const InertialOptions& options,
                                         const Eigen::VectorXd& start, const Eigen::VectorXd& error,
                                         std::optional<double> energy_error,
                                         const Eigen::Vector4d& spent_J)
    : equation_(eq),
      context_(sundials::make_context()),
      state_(N_VNew_Serial(eq.size(), context_.get())),
      error_(N_VClone(state_.get())),
      within_(N_VClone(state_.get())),
      memory_(
          CVodeCreate(options.formula == MotionFormula::bdf ? CV_BDF : CV_ADAMS, context_.get())) {
  view(state_.get()) = start;
  view(error_.get()) = error;
  void* m = memory_.get();
  check(CVodeInit(m, motion_rate, 0.0, state_.get()), "CVodeInit");
  check(CVodeSetUserData(m, &equation_), "CVodeSetUserData");
  check(CVodeSVtolerances(m, 0.0, error_.get()), "CVodeSVtolerances");
  const bool trapezoidal = options.formula == MotionFormula::trapezoidal;
  check(CVodeSetMaxOrd(m, trapezoidal ? 2 : options.highest_order), "CVodeSetMaxOrd");
  check(CVodeSetMaxNumSteps(m, 50'000'000), "CVodeSetMaxNumSteps");
  sundials::mute(m);
  options.newton == NewtonSolver::klu ? use_klu() : use_elimination();
  if (equation_.tissue().bonds().contact_count() > 0) watch_gaps();
  if (!energy_error) return;
  energy_.reset(N_VNew_Serial(spent_J.size(), context_.get()));
  view(energy_.get()) = spent_J;
  check(CVodeQuadInit(m, motion_powers, energy_.get()), "CVodeQuadInit");
  check(CVodeQuadSStolerances(m, 0.0, *energy_error), "CVodeQuadSStolerances");
  check(CVodeSetQuadErrCon(m, SUNTRUE), "CVodeSetQuadErrCon");
}

void InertialIntegration::use_klu() {
  const auto entries = equation_.jacobian(0.0, view(state_.get())).nonZeros();
  matrix_.reset(
      SUNSparseMatrix(equation_.size(), equation_.size(), entries, CSC_MAT, context_.get()));
  solver_.reset(SUNLinSol_KLU(state_.get(), matrix_.get(), context_.get()));
  check(CVodeSetLinearSolver(memory_.get(), solver_.get(), matrix_.get()), "CVodeSetLinearSolver");
  check(CVodeSetJacFn(memory_.get(), motion_jacobian), "CVodeSetJacFn");
}

void InertialIntegration::use_elimination() {
  matrix_ = sundials::custom_matrix(context_.get());
  solver_ = sundials::custom_solver(context_.get(), &equation_, eliminated_solve);
  check(CVodeSetLinearSolver(memory_.get(), solver_.get(), matrix_.get()), "CVodeSetLinearSolver");
  check(CVodeSetLinSysFn(memory_.get(), eliminated_setup), "CVodeSetLinSysFn");
}

void InertialIntegration::watch_gaps() {
  // The residual of Newton's iteration in places appears in contact forces, multiplied by their
  // stiffness.
  const BondSystem& bonds = equation_.tissue().bonds();
  const auto contacts = static_cast<Eigen::Index>(bonds.contact_count());
  const double stiffer = bonds.stiffness().tail(contacts).maxCoeff() /
                         bonds.stiffness().head(bonds.stiffness().size() - contacts).maxCoeff();
  const double newton_tolerance = std::clamp(1.0 / stiffer, 1e-8, 0.1);
  watches_gaps_ = true;
  void* m = memory_.get();
  const auto count = static_cast<int>(contacts);
  check(CVodeRootInit(m, count, motion_gaps), "CVodeRootInit");
  std::vector<int> closing(static_cast<std::size_t>(count), -1);
  check(CVodeSetRootDirection(m, closing.data()), "CVodeSetRootDirection");
  check(CVodeSetNoInactiveRootWarn(m), "CVodeSetNoInactiveRootWarn");
  check(CVodeSetNonlinConvCoef(m, newton_tolerance), "CVodeSetNonlinConvCoef");
}

ToolImpact InertialIntegration::strike(double time_s) {
  return equation_.strike(time_s, view(state_.get()));
}

void InertialIntegration::spend(double work_J, double contact_heat_J) {
  if (!energy_) return;
  view(energy_.get())[0] += work_J;
  view(energy_.get())[3] += contact_heat_J;
}

void InertialIntegration::restart(double time_s, double stop_s) {
  if (started_) before_ = work();
  started_ = true;
  time_s_ = time_s;
  void* m = memory_.get();
  check(CVodeReInit(m, time_s, state_.get()), "CVodeReInit");
  if (energy_) check(CVodeQuadReInit(m, energy_.get()), "CVodeQuadReInit");
  check(CVodeSetStopTime(m, stop_s), "CVodeSetStopTime");
}

InertialIntegration::Reached InertialIntegration::step_towards(double time_s) {
  if (watches_gaps_) check(CVodeSetStopTime(memory_.get(), time_s), "CVodeSetStopTime");
  const int flag = CVode(memory_.get(), time_s, state_.get(), &time_s_, CV_ONE_STEP);
  if (flag < 0) {
    double at = 0.0;
    check(CVodeGetCurrentTime(memory_.get(), &at), "CVodeGetCurrentTime");
    throw Error(ExitCode::numerical, "inertial network",
                fmt::format("CVODES gives up at t = {} s: {}", significant(at, 5),
                            sundials::flag_name(flag)));
  }
  double at = 0.0;
  if (energy_) check(CVodeGetQuad(memory_.get(), &at, energy_.get()), "CVodeGetQuad");
  if (flag == CV_ROOT_RETURN) return Reached::meeting;
  return time_s_ == time_s ? Reached::target : Reached::within;
}

Eigen::Map<const Eigen::VectorXd> InertialIntegration::state_at(double time_s) {
  if (time_s == time_s_) return state();
  check(CVodeGetDky(memory_.get(), time_s, 0, within_.get()), "CVodeGetDky");
  return {NV_DATA_S(within_.get()), equation_.size()};
}

Eigen::Map<const Eigen::VectorXd> InertialIntegration::state() const {
  return {NV_DATA_S(state_.get()), equation_.size()};
}

Eigen::Vector4d InertialIntegration::spent_J() const {
  return view(energy_.get());
}

InertialWork InertialIntegration::work() const {
  InertialWork sum = work_of_piece();
  sum.steps += before_.steps;
  sum.rejected += before_.rejected;
  sum.rates += before_.rates;
  sum.newton_iterations += before_.newton_iterations;
  sum.newton_failures += before_.newton_failures;
  sum.factorisations += before_.factorisations;
  return sum;
}

InertialWork InertialIntegration::work_of_piece() const {
  InertialWork w;
  void* m = memory_.get();
  check(CVodeGetNumSteps(m, &w.steps), "CVodeGetNumSteps");
  check(CVodeGetNumErrTestFails(m, &w.rejected), "CVodeGetNumErrTestFails");
  check(CVodeGetNumRhsEvals(m, &w.rates), "CVodeGetNumRhsEvals");
  check(CVodeGetNumNonlinSolvIters(m, &w.newton_iterations), "CVodeGetNumNonlinSolvIters");
  check(CVodeGetNumNonlinSolvConvFails(m, &w.newton_failures), "CVodeGetNumNonlinSolvConvFails");
  check(CVodeGetNumLinSolvSetups(m, &w.factorisations), "CVodeGetNumLinSolvSetups");
  return w;
}

}  // namespace tpm::organ
