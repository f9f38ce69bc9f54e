#pragma once

namespace mu {
class Parser;
}

namespace tpm::fit {

/// Makes the element of tpm_element.hpp callable in formulas, all arguments and results SI:
///
///   tension_modulus(Eprime, depth, x)                                     lambda1, Pa (Eq. 2)
///   step_force(depth, t, lambda1, E1, E2, eta1, A0, l0)                   N, Eq. 11
///   ramp_hold_force(depth, rate, t_after_ramp, E1, E2, Eprime, eta1, x, A0, l0)
///                                             N, ramp at `rate`, then held; 0 is the ramp's end
///   creep_depth(load, t, lambda1, E1, E2, eta1, A0, l0)                   m, Eq. 14
///   creep_depth_true(load, t, E1, E2, Eprime, eta1, x, A0, l0)            m, with lambda1(depth)
///   equilibrium_depth(load, modulus, Eprime, x, A0, l0)                   m, with lambda1(depth)
///
/// A call with parameters out of range throws Error(bad_input).
void define_model_functions(mu::Parser& parser);

}  // namespace tpm::fit
