#pragma once
#include <fmt/format.h>

#include <string>
#include <vector>

#include "tpmkit/formulation.hpp"

namespace tpm::test {

/// Materials that ask something of a formulation.
struct Asking {
  bool Capabilities::*capability;
  std::string blocks;
};
inline std::vector<Asking> asking_materials() {
  const auto material = [](const std::string& keys) {
    return R"("material": {"Einf": "6 kPa", "Eprime": "12 kPa", )" + keys + "}";
  };
  const std::string one = R"("branches": [{"g": "6 kPa", "tau": "0.7 s"}])";
  const std::string two =
      R"("branches": [{"g": "3 kPa", "tau": "0.4 s"}, {"g": "3 kPa", "tau": "3 s"}])";
  const auto place = [&](const std::string& what) {
    return material(one + R"(, "regions": [{"kind": "ball", "below_contact": "10 mm",
      "radius": "25 mm", )" +
                    what + "}]");
  };
  const auto shape = [&](const char* key, const char* name) {
    return material(
        fmt::format(R"("{}": {{"shape": "{}", "stiffening": "8 mm"}}, {})", key, name, one));
  };
  return {{&Capabilities::branches, material(two)},
          {&Capabilities::stiffening, shape("potential", "cubic")},
          {&Capabilities::any_potential, shape("potential", "sinh")},
          {&Capabilities::kernels, shape("kernel", "cubic")},
          {&Capabilities::regions, place(R"("factor": 3)")},
          {&Capabilities::mixed, place(R"("material": {"Einf": "8 kPa", "Eprime": "12 kPa",
             "branches": [{"g": "9 kPa", "tau": "2 s"}]})")}};
}

}  // namespace tpm::test
