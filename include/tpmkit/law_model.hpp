#pragma once
#include <memory>
#include <string>
#include <vector>

#include "tpmkit/law.hpp"
#include "tpmkit/model.hpp"

namespace tpm {

namespace law {
class ExponentialSum;
struct LawAtParameters;
}  // namespace law

/// A law of the family as a Model for tables, fits and plans.
///
/// Displacement-driven: exact in time for a drive that is linear between knots (exponential
/// quadrature of V(u(s)), refined until a polynomial of fourth degree holds to 1e-10 of the peak),
/// in O(n) for each branch. After detachment (the force would become tensile) the surface recovers
/// freely and the response is the offset until the probe meets it again. Force-driven: in
/// closed form where the kernel alone carries the load and the probe stays on the surface
/// (law/imposed_load.hpp), else adaptive implicit steps. At an infinite time the
/// response is fully relaxed.
///
/// A relaxing hertz kernel follows Lee and Radok while the contact grows and Ting (1966) when it
/// shrinks. Without branches any history is possible. The response is not predicted (NaN) from
/// where the contact grows again by more than kContactJitter of the largest depth; with fractional
/// elements or tension, or under an imposed load, from where the depth has fallen by more than
/// that.
///
/// The error of fractional laws at knots and output times is 1e-10 of G at their smallest spacing,
/// times the total variation of the drive (docs/theory.md); of creep 1e-9 of the depth
/// (spring-pots 5e-6). A single step that stays constant uses G(t) and J(t) themselves
/// (law/relaxation.hpp): a step of depth with a linear kernel, a step of load without elastic
/// tension. Any other jump of the depth of a spring-pot throws Error(bad_input). Under a jump of
/// the load a spring-pot does not move at first and then creeps.
class LawModel final : public Model {
 public:
  /// Throws Error(bad_input) as require_valid(spec).
  explicit LawModel(LawSpec spec);

  [[nodiscard]] std::string_view name() const override { return name_; }
  [[nodiscard]] std::span<const ParameterDescription> parameters() const override {
    return descriptions_;
  }
  [[nodiscard]] Response respond(const Protocol& protocol, std::span<const double> times_s,
                                 std::span<const double> parameters, Want want) const override;

  [[nodiscard]] const LawSpec& spec() const { return spec_; }
  [[nodiscard]] const std::vector<LawParameter>& law_parameters() const { return parameters_; }
  /// Index of a parameter in the vector. Throws Error(bad_input) naming the known ones.
  [[nodiscard]] std::size_t index(std::string_view parameter) const;
  /// Throws Error(bad_input) naming the first parameter out of its range, or if their number is
  /// wrong.
  void require_in_range(std::span<const double> values) const;
  /// The law at given parameters, branches in parallel form, as time steppers use it.
  /// @param rates of a fractional law, else unused
  [[nodiscard]] law::LawAtParameters at(std::span<const double> values,
                                        const law::ExponentialSum* rates) const;
  [[nodiscard]] bool linear_in(std::size_t parameter) const override;
  [[nodiscard]] std::pair<double, double> range(std::size_t parameter) const override;

 private:
  struct Prepared;
  /// @param rates of a fractional law, else unused
  [[nodiscard]] Prepared prepare(std::span<const double> values,
                                 const law::ExponentialSum* rates) const;
  void require_no_jump(const Protocol& protocol, double contact) const;

  LawSpec spec_;
  std::string name_;
  std::vector<LawParameter> parameters_;
  std::vector<ParameterDescription> descriptions_;
};

}  // namespace tpm
