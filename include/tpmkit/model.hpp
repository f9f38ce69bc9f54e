#pragma once
#include <Eigen/Core>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tpmkit/protocol.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// What a model answers: one value per asked time (N or m, after the protocol's drive) and, where
/// asked for, the derivative of each value with respect to each natural parameter. A value that the
/// model does not predict is NaN, and so are its derivatives; the model says when that happens.
struct Response {
  Eigen::VectorXd value;  ///< size n_times
  RowMatrix sensitivity;  ///< n_times x n_parameters, SI over SI; 0 x 0 unless asked for
};

enum class Want { values, values_and_sensitivity };

/// How lambda1 enters. `exact` is lambda1(e(t)); the paper freezes it at one value.
struct TensionRule {
  enum class Kind { exact, frozen_at_peak, frozen_at_value };
  Kind kind = Kind::exact;
  double lambda1_Pa = 0.0;  ///< used by frozen_at_value

  [[nodiscard]] static TensionRule exact() { return {}; }
  /// lambda1 of the largest imposed displacement, as in Tables 1-4.
  [[nodiscard]] static TensionRule frozen_at_peak() { return {Kind::frozen_at_peak, 0.0}; }
  [[nodiscard]] static TensionRule frozen(double lambda1) {
    return {Kind::frozen_at_value, lambda1};
  }
};

/// The one question that tables, fits, sweeps and plans ask: how does the tissue respond to this
/// protocol at these times?
class Model {
 public:
  Model() = default;
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;
  virtual ~Model() = default;

  [[nodiscard]] virtual std::string_view name() const = 0;

  /// Names, dimensions and order of the parameter vector.
  [[nodiscard]] virtual std::span<const ParameterDescription> parameters() const = 0;

  /// @param times_s any order, each within [protocol.start_s(), protocol.end_s()]; at a jump the
  ///        value just after it is meant
  /// @param parameters SI values in the order of parameters()
  /// Throws Error(bad_input) for parameters out of range, Error(numerical) if a solver fails.
  [[nodiscard]] virtual Response respond(const Protocol& protocol, std::span<const double> times_s,
                                         std::span<const double> parameters, Want want) const = 0;

  /// The same with derivatives along changes of the parameters: sensitivity is d value / d
  /// parameters times `along` (n_parameters x any). Some models find few such columns sooner than
  /// the derivatives by every parameter.
  [[nodiscard]] virtual Response respond_along(const Protocol& protocol,
                                               std::span<const double> times_s,
                                               std::span<const double> parameters,
                                               const Eigen::MatrixXd& along) const;

  /// Physical range of a parameter, SI.
  [[nodiscard]] virtual std::pair<double, double> range(std::size_t /*parameter*/) const {
    return {0.0, std::numeric_limits<double>::infinity()};
  }

  /// A much cheaper model of the same parameters whose best fits lie near those of this one: where
  /// a search can begin. None if this one is cheap.
  [[nodiscard]] virtual std::unique_ptr<Model> surrogate() const { return nullptr; }

  /// The response to an imposed displacement is linear in this parameter while the others are held:
  /// a search can solve for it.
  [[nodiscard]] virtual bool linear_in(std::size_t /*parameter*/) const { return false; }
};

/// Numerical settings; the closed form has none.
struct ModelOptions {
  TensionRule tension;
  double relative_tolerance = 1e-10;  ///< CVODES, of states and sensitivities
};

/// Makes models of the element: a role of a formulation (formulation/formulation.hpp).
class ModelMaker {
 public:
  ModelMaker() = default;
  ModelMaker(const ModelMaker&) = delete;
  ModelMaker& operator=(const ModelMaker&) = delete;
  virtual ~ModelMaker() = default;
  [[nodiscard]] virtual std::unique_ptr<Model> model(const ModelOptions& options) const = 0;
};

/// The model of a formulation of the element. Throws Error(bad_input) naming those there are.
[[nodiscard]] std::unique_ptr<Model> make_model(std::string_view name,
                                                const ModelOptions& options = {});

/// The element in closed form, the formulation "closed_form": exact for histories that are linear
/// between knots and for a constant load. The component `core` is enough for it.
[[nodiscard]] std::unique_ptr<Model> make_closed_form(const TensionRule& tension = {});

/// Limits of the model in the paper that a run has passed (text, one line each): indentation over
/// 10 mm (validity), over 12 mm (damage), a lateral bond turned by more than pi/6.
/// @param spacing_m of lateral neighbours, > 0
[[nodiscard]] std::vector<std::string> validity_flags(double spacing_m, double peak_depth_m);

/// Throws Error(bad_input) unless every time lies in the protocol.
void require_times_within(const Protocol& protocol, std::span<const double> times_s);

/// Indices of the times in rising order; equal times keep theirs.
[[nodiscard]] std::vector<std::size_t> rising_order(std::span<const double> times_s);

}  // namespace tpm
