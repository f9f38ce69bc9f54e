#pragma once
#include <Eigen/Core>
#include <vector>

#include "tpm/law/relaxation/exponential_collocation.hpp"
#include "tpm/law/relaxation_sum.hpp"

namespace tpm::law {

inline constexpr int kCreepNodes = 7;  ///< of Radau; the begin of the step is one more
/// The nodes, and three places between them where the balance is checked.
inline constexpr int kCreepPlaces = kCreepNodes + 3;

/// V at the begin of a step and at its nodes.
using CreepCourse = Eigen::Matrix<double, kCreepNodes + 1, 1>;
/// A number for each place of a step.
using CreepPlaces = Eigen::Array<double, kCreepPlaces, 1>;
/// Each column multiplies a CreepCourse to give a number at one place.
using CreepMatrix = Eigen::Matrix<double, kCreepNodes + 1, kCreepPlaces>;

/// One branch over a step with the course V(c): at each place
///
///     V - w = lag' course + decay (y - V) at the begin,   y = V - w
struct BranchWeights {
  CreepMatrix lag;
  CreepPlaces decay;
};

/// The part that all laws share: the places, and their interpolation.
struct CreepRule {
  ExponentialCollocation collocation;
  std::vector<ExponentialCollocation::Place> place;
  CreepPlaces fraction;
  CreepMatrix interpolation;
  CreepMatrix derivative;  ///< by the fraction of the step

  CreepRule();
  /// @param z step over relaxation time, >= 0
  [[nodiscard]] BranchWeights weights(double z) const;
};

[[nodiscard]] const CreepRule& creep_rule();

/// The largest step that is not longer than h and whose products with the rates of every fractional
/// law lie on one lattice: their weights are then known beforehand.
[[nodiscard]] double on_creep_lattice(double h);

/// The weights of all branches of a law for one step.
class CreepWeights {
 public:
  /// @param relaxation must outlive this
  explicit CreepWeights(const RelaxationSum& relaxation);

  void set_step(double h);
  [[nodiscard]] const BranchWeights& operator[](Eigen::Index branch) const {
    return *weights_[static_cast<std::size_t>(branch)];
  }
  /// The derivative of V - w at a node by z, for a branch of a free rate.
  /// @param carried y - V at the begin
  [[nodiscard]] double lag_by_z(Eigen::Index branch, Eigen::Index node, const CreepCourse& course,
                                double carried) const;

 private:
  const RelaxationSum& relaxation_;
  double h_ = 0.0;
  std::vector<long> lattice_;  ///< place of each rate on the lattice
  std::vector<BranchWeights> own_;
  std::vector<const BranchWeights*> weights_;
};

}  // namespace tpm::law
