#include "tpm/accuracy/stability/verdict.hpp"

#include <cmath>
#include <limits>

namespace tpm::accuracy {
namespace {

constexpr double kGrows = 1.1;       // of the largest difference, from the first half to the second
constexpr double kBothSides = 1e-6;  // share of it by which a run goes to its other side too

StabilityClass class_of(MethodEnd end) {
  switch (end) {
    case MethodEnd::completed:
      return StabilityClass::holds;
    case MethodEnd::diverged:
      return StabilityClass::diverged;
    case MethodEnd::newton_failed:
      return StabilityClass::newton_failed;
    case MethodEnd::buckled:
      return StabilityClass::buckled;
    case MethodEnd::too_much_work:
      return StabilityClass::too_much_work;
    case MethodEnd::not_applicable:
      return StabilityClass::not_applicable;
  }
  return StabilityClass::not_applicable;
}

}  // namespace

std::string_view stability_class_name(StabilityClass c) {
  return kStabilityClasses[static_cast<std::size_t>(c)].text;
}

StabilityVerdict classify_run(const MethodRun& run, const Eigen::VectorXd& reference, double peak,
                              bool moves) {
  if (run.end != MethodEnd::completed) {
    return {class_of(run.end), std::numeric_limits<double>::quiet_NaN(), run.reason};
  }
  const Eigen::VectorXd off = (run.response - reference) / peak;
  StabilityVerdict verdict{StabilityClass::holds, off.cwiseAbs().maxCoeff(), {}};
  if (verdict.error <= kHoldsWithin) return verdict;
  const Eigen::Index half = off.size() / 2;
  const double before = off.head(half).cwiseAbs().maxCoeff();
  const double after = off.tail(half).cwiseAbs().maxCoeff();
  const double middle = 0.5 * (off.maxCoeff() + off.minCoeff());
  const double swing = 0.5 * (off.maxCoeff() - off.minCoeff());
  if (after > kGrows * before) {
    verdict.found = moves ? StabilityClass::energy_grew : StabilityClass::diverged;
    verdict.reason = "the difference from the reference still grows";
  } else if (swing > (1.0 + kBothSides) * std::abs(middle)) {
    verdict.found = StabilityClass::oscillates;
  } else {
    verdict.found = StabilityClass::wrong_steady_state;
  }
  return verdict;
}

}  // namespace tpm::accuracy
