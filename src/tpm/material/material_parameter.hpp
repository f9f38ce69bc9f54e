#pragma once
#include <string>

#include "tpm/core/units.hpp"

namespace tpm {

/// A parameter of a material: what files, fits, sweeps and reports address by its name.
struct MaterialParameter {
  std::string name;
  Dimension dimension;
  double least;         ///< SI
  bool least_excluded;  ///< the value is above `least`, not at it
  std::string meaning;
  [[nodiscard]] bool allows(double value) const {
    return least_excluded ? value > least : value >= least;
  }
};

/// "above 0", "0 or above".
[[nodiscard]] std::string range_of(const MaterialParameter& parameter);

}  // namespace tpm
