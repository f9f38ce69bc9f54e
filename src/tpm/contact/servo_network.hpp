#pragma once
#include <memory>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/contact/servo_stiffness.hpp"
#include "tpm/contact/step_error.hpp"
#include "tpmkit/contact_model.hpp"

namespace tpm::contact {

struct ServoNetworkOptions {
  double period_s = 1e-3;        ///< > 0
  double frozen_depth_m = 4e-3;  ///< along the normal, where the stiffness is factorised; >= 0
  double deepest_m = 10e-3;      ///< answers beyond are not valid; > 0
  double aside_m = 5e-3;         ///< the same across the normal; > 0
  /// Forces are balanced once more while the error estimated is above this part of the largest
  /// force so far, up to `most_balances` times a step.
  double balance_again_above = 5e-4;
  int most_balances = 3;
  bool portable = false;  ///< without vector instructions beyond those of every processor
};

/// The quasi-static network (QuasiStatic), stepped at servo rate in single precision. Over a period
/// elongations are taken as linear and viscous elongations advance exactly; the free spheres
/// are moved by one solution with a stiffness that was factorised beforehand, and the force at the
/// contact is corrected, to first order, for what is left unbalanced.
///
/// `error_N` estimates three things: what is left of that correction, by how the fields that it
/// uses change with the place of the contact; the viscous elongations of places that were not
/// balanced; and what linear elongations cost (StepError). A step whose forces are not finite
/// leaves the model so until reset().
class ServoNetwork final : public ContactModel {
 public:
  /// @param constraints of the tissue without the probe
  /// @param contact a sphere that is free
  /// @param into_tissue unit vector
  /// Throws Error(bad_input) for options out of range and tissues that PushedContact refuses,
  /// Error(numerical) where the tissue buckles before it is as deep as asked for.
  ServoNetwork(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
               std::size_t contact, const Eigen::Vector3d& into_tissue,
               const ServoNetworkOptions& options = {});

  void reset() noexcept override;
  ContactAnswer step(const ToolPose& tool) noexcept override;
  [[nodiscard]] double period_s() const noexcept override { return options_.period_s; }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override {
    return instantaneous_;
  }
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override {
    return equilibrium_;
  }
  [[nodiscard]] Eigen::Index spheres() const noexcept override {
    return static_cast<Eigen::Index>(spheres_->columns());
  }
  void displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept override;

  /// Of the last step: balances, and what is left of the forces, the norm over free spheres, N.
  [[nodiscard]] int balances() const noexcept { return balances_; }
  [[nodiscard]] double residual_N() const noexcept;
  /// Of one balance with its answer.
  [[nodiscard]] BalanceWork work() const noexcept;

 private:
  /// Fields of the contact at a depth, four floats per free sphere, for an even number of them.
  struct Field {
    double depth_m;
    std::array<AlignedFloats, 3> along;
  };
  void choose_bonds(const PushedContact& tissue);
  void factorise(PushedContact& tissue, const Positions& position);
  void add_field(PushedContact& tissue, const Positions& position, double depth_m);
  void add_viscous_response(PushedContact& tissue, const Positions& position);
  [[nodiscard]] Field field_of(const std::array<Eigen::Matrix3Xd, 3>& displacement,
                               double depth_m) const;
  /// Solves for the part of the forces that starts at `first`, and moves the free spheres.
  void balance(std::size_t first) noexcept;
  /// Work of the forces left along each of three fields, N.
  [[nodiscard]] std::array<Eigen::Vector3d, 3> weighed(
      const std::array<const Field*, 3>& fields) const noexcept;
  void answer(const Eigen::Vector3d& displacement_m, double step_error_N) noexcept;
  /// The error of the viscous elongations after a step.
  void keep_error() noexcept;

  ServoNetworkOptions options_;
  Eigen::Vector3d into_;
  ServoWeights weights_;
  std::unique_ptr<ServoStiffness> spheres_;  ///< with the contact fixed
  std::size_t contact_ = 0;                  ///< its column
  ServoBonds at_contact_, elsewhere_;
  std::vector<Field> fields_;  ///< at even depths from rest on
  Field viscous_response_;     ///< what residual forces do through the viscous state
  std::unique_ptr<StepError> step_error_;
  Eigen::Matrix3d instantaneous_, equilibrium_;

  AlignedFloats displacement_, force_, change_;
  ContactAnswer answer_;
  double rounding_ = 0.0;  ///< of forces, in parts of the largest
  double largest_N_ = 0.0, held_error_N_ = 0.0;
  /// Force from the viscous state of positions out of equilibrium, and its source, N.
  Eigen::Vector3d viscous_error_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> branch_error_;  ///< of each branch, where there are several
  Eigen::Vector3d viscous_source_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d source_ = Eigen::Vector3d::Zero();  ///< the same, of the balance just made
  int balances_ = 0;
};

}  // namespace tpm::contact
