#pragma once
#include <catch2/catch.hpp>
#include <string>

#include "tpm/fit/fit.hpp"

namespace tpm::fit {
using namespace fit;

/// The result of the parameter of this name.
inline const ParameterResult& find(const FitResult& fit, const std::string& name) {
  for (const ParameterResult& p : fit.parameters) {
    if (p.parameter.name == name) return p;
  }
  FAIL("no parameter " << name);
  return fit.parameters.front();
}
inline double estimate_of(const FitResult& fit, const std::string& name) {
  return find(fit, name).estimate;
}

}  // namespace tpm::fit
