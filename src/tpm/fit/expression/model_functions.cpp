#include "tpm/fit/expression/model_functions.hpp"

#include <muParser.h>

#include <array>

#include "tpm/base/namespaces.hpp"
#include "tpm/law/relaxation/creep_exact.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/model.hpp"

namespace tpm::fit {
namespace {

double tension_modulus(double Eprime, double depth, double spacing) {
  return lambda1_Pa(Eprime, depth, spacing);
}

TpmParameters without_tension(double E1, double E2, double eta1, double A0, double l0) {
  TpmParameters p;
  p.E1_Pa = E1;
  p.E2_Pa = E2;
  p.eta1_Pa_s = eta1;
  p.A0_m2 = A0;
  p.l0_m = l0;
  return p;
}

double step_force(double depth, double time, double lambda1, double E1, double E2, double eta1,
                  double A0, double l0) {
  const TpmParameters p = without_tension(E1, E2, eta1, A0, l0);
  require_valid(p, "step_force");
  return step_relaxation_force_N(p, lambda1, depth, time);
}

double ramp_hold_force(double depth, double rate, double time_after_ramp, double E1, double E2,
                       double Eprime, double eta1, double spacing, double A0, double l0) {
  if (!(time_after_ramp >= 0.0)) {
    throw bad_input("ramp_hold_force", "a time before the end of the ramp", "a time of at least 0");
  }
  const Protocol protocol = ramp_and_hold(depth, rate, time_after_ramp);
  const TpmVector parameters = to_vector({E1, E2, Eprime, eta1, spacing, A0, l0});
  const std::array times{protocol.end_s()};
  return tpm::make_model("closed_form")
      ->respond(protocol, times, parameters, Want::values)
      .value[0];
}

double creep_depth(double load, double time, double lambda1, double E1, double E2, double eta1,
                   double A0, double l0) {
  const TpmParameters p = without_tension(E1, E2, eta1, A0, l0);
  require_valid(p, "creep_depth");
  return creep_depth_m(p, lambda1, load, time);
}

double creep_depth_true(double load, double time, double E1, double E2, double Eprime, double eta1,
                        double spacing, double A0, double l0) {
  return CreepUnderConstantLoad({E1, E2, Eprime, eta1, spacing, A0, l0}, load).depth_m(time);
}

double equilibrium_depth(double load, double modulus, double Eprime, double spacing, double A0,
                         double l0) {
  TpmParameters p;
  p.Eprime_Pa = Eprime;
  p.spacing_m = spacing;
  p.A0_m2 = A0;
  p.l0_m = l0;
  require_valid(p, "equilibrium_depth");
  return equilibrium_depth_m(p, modulus, load);
}

}  // namespace

void define_model_functions(mu::Parser& parser) {
  parser.DefineFun("tension_modulus", tension_modulus);
  parser.DefineFun("step_force", step_force);
  parser.DefineFun("ramp_hold_force", ramp_hold_force);
  parser.DefineFun("creep_depth", creep_depth);
  parser.DefineFun("creep_depth_true", creep_depth_true);
  parser.DefineFun("equilibrium_depth", equilibrium_depth);
}

}  // namespace tpm::fit
