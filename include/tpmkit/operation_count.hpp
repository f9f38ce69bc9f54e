#pragma once
// Cost of models, counted in operations. The machine determines only how long each takes.
#include <array>
#include <cstddef>

namespace tpm::organ {

/// Kinds of operations.
enum class Operation : std::size_t {
  scalar_step,     ///< a step of a model of one contact with no more than a few numbers, fixed part
  scalar_term,     ///< an exponential, a curve or a root of such a step
  dense_flop,      ///< a multiplication and addition in a dense matrix times a vector
  lane_bond,       ///< force of a bond in all lanes of a collocation together
  lane_block,      ///< a 3x3 block of a factor in a back-solve of all lanes, single precision
  bond_force,      ///< force of a bond, one state
  bond_stiffness,  ///< stiffness of a bond put into the matrix
  factor_product,  ///< product of two 3x3 blocks in a factorisation
  solve_block,     ///< a 3x3 block of a factor in a back-solve, one state
  // Models at servo rate, in single precision and portable instructions.
  contact_step,    ///< a step of a network seen from its contact, fixed part
  servo_bond,      ///< force of a bond, now and at the end of the next period
  servo_block,     ///< a 3x3 block of a factor in fronts in a back-solve
  panel_product,   ///< a multiplication and addition in a dense panel times a vector
  condensed_step,  ///< a step of the condensed model
};
inline constexpr std::size_t kOperations = 14;

/// Count of each operation.
class OperationCount {
 public:
  [[nodiscard]] double operator[](Operation kind) const { return n_[index(kind)]; }
  OperationCount& add(Operation kind, double times) {
    n_[index(kind)] += times;
    return *this;
  }
  OperationCount& operator+=(const OperationCount& other) {
    for (std::size_t i = 0; i < n_.size(); ++i) n_[i] += other.n_[i];
    return *this;
  }
  [[nodiscard]] OperationCount times(double factor) const {
    OperationCount result = *this;
    for (double& n : result.n_) n *= factor;
    return result;
  }

 private:
  [[nodiscard]] static std::size_t index(Operation kind) { return static_cast<std::size_t>(kind); }
  std::array<double, kOperations> n_{};
};

}  // namespace tpm::organ
