// The component plan alone: the paper's star in a scene, by the closed form and by the network.
#include <cmath>
#include <cstdio>
#include <string>
#include <tpmkit/scene.hpp>

int main() {
  double force_N[2];
  int i = 0;
  for (const std::string kind : {"closed_form", "quasi_static"}) {
    const tpm::organ::Scene scene =
        tpm::organ::Scene::parse(R"({"organ": {"kind": "star", "spacing": "30 mm"},
      "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "40 mm/s", "hold": "1 s"},
      "formulation": {"kind": ")" +
                                 kind + R"("}})");
    force_N[i++] = scene.run({0.1}).response[0];
  }
  std::printf("%.6f N, %.6f N\n", force_N[0], force_N[1]);
  return std::abs(force_N[0] - force_N[1]) < 1e-5 * force_N[0] ? 0 : 1;
}
