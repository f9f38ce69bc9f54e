// The component law alone: closed form and a law of the family, side by side.
#include <cmath>
#include <cstdio>
#include <tpmkit/law_model.hpp>
#include <tpmkit/tpm_element.hpp>

int main() {
  const tpm::TpmParameters p;
  const double times_s[] = {0.0, 1e-4, 1.0};
  const tpm::Protocol step = tpm::step_and_hold(4e-3, 2.0);
  const tpm::Response element =
      tpm::make_closed_form()->respond(step, times_s, tpm::to_vector(p), tpm::Want::values);
  const tpm::LawModel law(tpm::parse_law_name("linear-1-elastic", "consumer"));
  std::vector<double> values(law.parameters().size(), 0.0);
  const double to_stiffness = p.modulus_to_stiffness_m();
  const double reference = law.spec().reference;
  values[law.index("k_inf")] = p.equilibrium_modulus_Pa() * to_stiffness;
  values[law.index("k1")] = p.relaxing_modulus_Pa() * to_stiffness;
  values[law.index("tau1")] = p.relaxation_time_s();
  values[law.index("k_tension")] =
      tpm::lambda1_Pa(p.Eprime_Pa, reference, p.spacing_m) * to_stiffness;
  values[law.index("spacing")] = p.spacing_m;
  const tpm::Response same = law.respond(step, times_s, values, tpm::Want::values);
  const double apart = (element.value - same.value).cwiseAbs().maxCoeff();
  std::printf("%.4f N, apart %.1e N\n", element.value[0], apart);
  return std::floor(element.value[0] * 1e3) == 613.0 && apart < 1e-9 ? 0 : 1;
}
