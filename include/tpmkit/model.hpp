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

#include "tpmkit/error.hpp"
#include "tpmkit/protocol.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Response of a model: one value per requested time (N under an imposed depth, m under a load)
/// and, on request, its derivative with respect to each natural parameter. A value that the model
/// does not predict is NaN, and so are its derivatives; each model documents when.
struct Response {
  Eigen::VectorXd value;  ///< size n_times
  RowMatrix sensitivity;  ///< n_times x n_parameters, SI over SI; 0 x 0 unless asked for
};

enum class Want { values, values_and_sensitivity };

/// Form of lambda1. `exact` is lambda1(e(t)); the paper freezes it at one value.
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

/// Computes how the tissue responds to a protocol at given times, for tables, fits, sweeps and
/// plans.
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
  ///        response is that just after it
  /// @param parameters SI values in the order of parameters()
  /// Throws Error(bad_input) for parameters out of range, Error(numerical) if a solver fails.
  [[nodiscard]] virtual Response respond(const Protocol& protocol, std::span<const double> times_s,
                                         std::span<const double> parameters, Want want) const = 0;

  /// The same with derivatives along changes of the parameters: sensitivity is d value / d
  /// parameters times `along` (n_parameters x any). Some models compute a few such columns faster
  /// than the derivatives by every parameter.
  [[nodiscard]] virtual Response respond_along(const Protocol& protocol,
                                               std::span<const double> times_s,
                                               std::span<const double> parameters,
                                               const Eigen::MatrixXd& along) const;

  /// Physical range of a parameter, SI.
  [[nodiscard]] virtual std::pair<double, double> range(std::size_t /*parameter*/) const {
    return {0.0, std::numeric_limits<double>::infinity()};
  }

  /// A much cheaper model with the same parameters and similar best fits, from which a search can
  /// start. Null if this model is cheap.
  [[nodiscard]] virtual std::unique_ptr<Model> surrogate() const { return nullptr; }

  /// True if the response to an imposed displacement is linear in this parameter with the others
  /// fixed. A search can then solve for it.
  [[nodiscard]] virtual bool linear_in(std::size_t /*parameter*/) const { return false; }
};

/// Numerical settings; the closed form has none.
struct ModelOptions {
  TensionRule tension;
  double relative_tolerance = 1e-10;  ///< CVODES, of states and sensitivities
};

/// Makes models of the element: a role of a formulation (tpmkit/formulation.hpp).
class ModelMaker {
 public:
  ModelMaker() = default;
  ModelMaker(const ModelMaker&) = delete;
  ModelMaker& operator=(const ModelMaker&) = delete;
  virtual ~ModelMaker() = default;
  [[nodiscard]] virtual std::unique_ptr<Model> model(const ModelOptions& options) const = 0;
};

/// The model of a formulation of the element. Throws Error(bad_input), naming the known ones, for
/// an unknown name.
[[nodiscard]] std::unique_ptr<Model> make_model(std::string_view name,
                                                const ModelOptions& options = {});

/// The element in closed form, the formulation "closed_form": exact for histories that are linear
/// between knots and for a constant load. It needs only the component `core`.
[[nodiscard]] std::unique_ptr<Model> make_closed_form(const TensionRule& tension = {});

/// Limits of the paper's model that a run has passed, their codes in brackets: indentation above 10
/// mm, its validity (indentation_over_10_mm), or 12 mm, damage (indentation_over_12_mm), a lateral
/// bond turned by more than pi/6 (lateral_bond_turned_over_30_degrees).
/// @param spacing_m of lateral neighbours, > 0
[[nodiscard]] std::vector<Remark> validity_remarks(double spacing_m, double peak_depth_m);

/// Throws Error(bad_input) unless every time lies in the protocol.
void require_times_within(const Protocol& protocol, std::span<const double> times_s);

/// Indices of the times in rising order; equal times keep their order.
[[nodiscard]] std::vector<std::size_t> rising_order(std::span<const double> times_s);

}  // namespace tpm
