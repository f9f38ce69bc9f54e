// How does a method of one's own compare with the network's equations? Adds the formulation
// "spring", the contact as an elastic spring, to those of the library and runs one scene by both.
//
// Prints:
//     quasi_static 2 mm: 0.0737 N, 4 mm: 0.1454 N, held: 0.1454 N
//     spring       2 mm: 0.0794 N, 4 mm: 0.1588 N, held: 0.1588 N
#include <cstdio>
#include <string>
#include <tpmkit/error.hpp>
#include <tpmkit/formulation.hpp>
#include <tpmkit/scene.hpp>

using namespace tpm::organ;

/// F = K D with the equilibrium stiffness K of the contact at rest.
class Spring final : public tpm::Formulation, public SceneRunner {
 public:
  using Formulation::Formulation;
  [[nodiscard]] Trajectory run(const ExperimentScene& asked, const RunNetwork& network,
                               const std::vector<double>& times_s,
                               bool /*with_field*/) const override {
    const Scene scene(asked, network);
    const double stiffness = scene.equilibrium_stiffness_N_per_m();
    Trajectory answer;
    answer.response.resize(static_cast<Eigen::Index>(times_s.size()));
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      answer.response[static_cast<Eigen::Index>(i)] =
          stiffness * value_at(scene.protocol(), times_s[i]);
    }
    answer.steps = static_cast<double>(times_s.size());
    return answer;
  }
};

tpm::Formulations tpm::formulations() {
  static const Spring spring({.name = "spring",
                              .meaning = "the contact as an elastic spring",
                              .can = {.network = true, .depth = true}});
  static const std::vector<const Formulation*> own{&spring};
  static const auto all = joined({shipped_formulations(), own});
  return all;
}

const std::string kBlock = R"({
  "organ": {"kind": "block", "cells": [4, 4, 3], "spacing": "10 mm"},
  "anchors": [{"kind": "inner_layer"}],
  "contacts": [{"kind": "sphere", "number": 13}],
  "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "2 mm/s", "hold": "8 s"},
  "formulation": {"kind": "FORMULATION"}
})";

int main() try {
  for (const std::string name : {"quasi_static", "spring"}) {
    std::string text = kBlock;
    text.replace(text.find("FORMULATION"), 11, name);
    const Trajectory answer = Scene::parse(text).run({1.0, 2.0, 10.0});
    std::printf("%-12s 2 mm: %.4f N, 4 mm: %.4f N, held: %.4f N\n", name.c_str(),
                answer.response[0], answer.response[1], answer.response[2]);
  }
} catch (const tpm::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return static_cast<int>(error.code());
}
