// The component files alone: a law written and read back, and the curves that are shipped.
#include <cstdio>
#include <tpmkit/curve_file.hpp>
#include <tpmkit/law_file.hpp>

int main() {
  tpm::LawFile law;
  law.spec = tpm::parse_law_name("linear-1", "consumer");
  for (const tpm::LawParameter& parameter : tpm::law_parameters(law.spec)) {
    law.values.push_back(parameter.name == "tau1" ? 2.0 : 60.0);
  }
  law.spec.reference = 0.003;
  law.fitted_to = 0.004;
  tpm::write_law("law.json", law);
  const bool same = tpm::read_law("law.json").values == law.values;
  const std::size_t shipped = tpm::list_curves().size();
  std::printf("%zu curves\n", shipped);
  return same && shipped > 0 ? 0 : 1;
}
