// What changes if the paper's bonds relax twice and stiffen? Compares two materials on one block of
// tissue: the scene's text is made here, the material of its bonds is stated in code, and the force
// of one bond is worked out beside it.
//
// Prints:
//     paper's  peak 0.2484 N, after 2 s 0.2302 N, after 30 s 0.1510 N
//     own      peak 0.2379 N, after 2 s 0.2121 N, after 30 s 0.1713 N
//     one bond 0.7958 N, at equilibrium 0.4944 N
#include <cstdio>
#include <string>
#include <tpmkit/bond_material.hpp>
#include <tpmkit/error.hpp>
#include <tpmkit/scene.hpp>

const std::string kBlock = R"({
  "organ": {"kind": "block", "cells": [4, 4, 3], "spacing": "10 mm"},
  "anchors": [{"kind": "inner_layer"}],
  "material": {"A0": "12.56 mm^2", "l0": "1 mm", "Eprime": "12 kPa", MATERIAL},
  "contacts": [{"kind": "sphere", "number": 13}],
  "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "2 mm/s", "hold": "30 s"},
  "formulation": {"kind": "quasi_static"}
})";

void run(const std::string& name, const std::string& material) {
  std::string text = kBlock;
  text.replace(text.find("MATERIAL"), 8, material);
  const tpm::organ::Trajectory answer = tpm::organ::Scene::parse(text).run({2.0, 4.0, 32.0});
  std::printf("%-8s peak %.4f N, after 2 s %.4f N, after 30 s %.4f N\n", name.c_str(),
              answer.response[0], answer.response[1], answer.response[2]);
}

int main() try {
  run("paper's", R"("E1": "12 kPa", "E2": "12 kPa", "eta1": "240 kPa s")");
  run("own",
      R"("Einf": "6 kPa", "branches": [{"g": "3 kPa", "tau": "1 s"}, {"g": "3 kPa", "tau": "20 s"}],
                "potential": {"shape": "cubic", "stiffening": "5 mm"})");
  // One radial bond of the same material, stretched by 4 mm and held.
  tpm::BondMaterial own;
  own.equilibrium_Pa = 6e3;
  own.branches = {{3e3, 1.0}, {3e3, 20.0}};
  own.potential = tpm::elongation_function("cubic", {5e-3});
  tpm::require_valid(own, "own material");
  const tpm::BondLaw bond = own.radial_law();
  double instantaneous_N = 0.0;
  for (const auto& spring : bond.springs)
    instantaneous_N += spring.stiffness_N_per_m * spring.function.value(4e-3);
  const double equilibrium_N = instantaneous_N;
  for (const auto& branch : bond.branches)
    instantaneous_N += branch.stiffness_N_per_m * bond.kernel.value(4e-3);
  std::printf("one bond %.4f N, at equilibrium %.4f N\n", instantaneous_N, equilibrium_N);
} catch (const tpm::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return static_cast<int>(error.code());
}
