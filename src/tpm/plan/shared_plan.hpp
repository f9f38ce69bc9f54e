#pragma once
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/plan/plan_surrogate.hpp"

namespace tpm::plan {

/// Answer of a shared plan to one protocol.
struct SharedAnswer {
  Eigen::VectorXd response;  ///< N, at each time asked for
  double claim = 0.0;        ///< bound of the error, in parts of the peak
  std::size_t model = 0;     ///< in SharedPlan::models()
  double steps = 0.0;
};

/// The least reduced model for each of many ramps and holds on one contact, where only depth,
/// speed, hold and eta1 differ. In units of the relaxation time they are one family of two numbers:
/// the depth, and the length of the ramp. On a grid of these two every model makes its claim as in
/// a plan (PlanSurrogate::claim_of); a protocol has the larger claim of the two lengths around its
/// own at the next greater depth. What is found depends on the protocol alone, not on what was
/// asked before. Any number of threads may ask.
class SharedPlan {
 public:
  /// @param scene of which organ, contacts, E1, E2 and E' are used; quasi-static
  /// @param tolerance of the response, in parts of its peak
  SharedPlan(const ExperimentScene& scene, double tolerance);

  /// Names of the models that may answer, from the cheapest on.
  [[nodiscard]] static const std::vector<std::string>& models();

  /// None where no reduced model claims to be within the tolerance or claims would take too long,
  /// and for what is no ramp and hold of one sphere.
  /// @param tau_s relaxation time of the bonds
  /// @param times_s rising, within the protocol
  [[nodiscard]] std::optional<SharedAnswer> answer(const Protocol& protocol, double tau_s,
                                                   const std::vector<double>& times_s);

  /// Cost of the grid for a range of protocols, in runs of the network.
  /// @param depths largest over least; @param lengths likewise, of ramps in relaxation times
  [[nodiscard]] static double cost_in_runs(double depths, double lengths);

 private:
  struct OfDepth {
    std::vector<ScalarModel> models;  ///< none: no answer so deep, or not soon
  };
  using Place = std::pair<int, int>;  ///< on the grid: depth, length of the ramp

  const OfDepth& of_depth(int place);
  const std::vector<double>& claims_at(Place place);

  PlanScene scene_;  ///< with a relaxation time of 1 s
  double tolerance_;
  std::mutex one_at_a_time_;
  std::map<int, OfDepth> of_depth_;
  std::map<Place, std::vector<double>> claims_;
};

}  // namespace tpm::plan
