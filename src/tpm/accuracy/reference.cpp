// Declared in tpm/accuracy/problem.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/accuracy/problem.hpp"
#include "tpmkit/error.hpp"

namespace tpm::accuracy {

Eigen::VectorXd sizes_of(const Eigen::VectorXd& response, int components) {
  return response.reshaped(components, response.size() / components).colwise().norm().transpose();
}

double BenchmarkReference::floor_of(const AnsweredPart& part) const {
  if (exact) return floor;
  const Eigen::VectorXd apart = first.response.segment(part.first, part.count) -
                                second.response.segment(part.first, part.count);
  return std::max(10.0 * sizes_of(apart, components).maxCoeff() / peak, kExactFloor);
}

BenchmarkReference checked_reference(BenchmarkAnswer first, BenchmarkAnswer second, bool exact,
                                     double worst_floor, std::string_view where, int components) {
  const auto refused = [&](const std::string& what, const std::string& expected) {
    return Error(ExitCode::numerical, fmt::format("reference of {}", where), what, expected);
  };
  if (first.method == second.method) {
    throw refused(fmt::format("both answers come from {}", first.method), "two methods");
  }
  if (first.response.size() == 0 || first.response.size() != second.response.size() ||
      !first.response.allFinite() || !second.response.allFinite()) {
    throw refused("an answer is missing or not finite", "the response at every time, twice");
  }
  BenchmarkReference reference;
  reference.exact = exact;
  reference.components = components;
  reference.peak = sizes_of(first.response, components).maxCoeff();
  reference.agreement =
      sizes_of(first.response - second.response, components).maxCoeff() / reference.peak;
  const double told = 10.0 * reference.agreement;
  if (!(told <= worst_floor)) {
    throw refused(fmt::format("{} and {} differ by {:.2g} of the peak", first.words, second.words,
                              reference.agreement),
                  fmt::format("at most {:.2g}", 0.1 * worst_floor));
  }
  reference.floor = exact ? kExactFloor : std::max(told, kExactFloor);
  reference.first = std::move(first);
  reference.second = std::move(second);
  return reference;
}

}  // namespace tpm::accuracy
