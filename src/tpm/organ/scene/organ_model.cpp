#include "tpm/organ/scene/organ_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tpm/base/text.hpp"
#include "tpm/organ/scene/material_directions.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr double kDerivativeTolerance = 1e-5;  // of relative changes, in parts of the largest
constexpr double kDifference = 1e-5;           // of a parameter, where laws are differentiated

/// Similarity of the organ of a scene and one of another spacing.
struct Similarity {
  double size;   ///< of this organ in parts of the scene's
  double power;  ///< forces go with this power of the size

  [[nodiscard]] double force() const { return std::pow(size, power); }
  [[nodiscard]] double of_imposed(Drive drive) const {
    return drive == Drive::displacement ? size : force();
  }
  [[nodiscard]] double of_response(Drive drive) const {
    return drive == Drive::displacement ? force() : size;
  }
};

/// Variables by which a run can be differentiated; moduli in units of E2, so that all have the
/// response's size.
enum Basis : int { by_E1, by_Eprime, by_log_tau, by_log_imposed, kBasis };

/// Derivatives of a response along changes of the parameters, one column for each.
struct Derivatives {
  Eigen::Matrix<double, kBasis, Eigen::Dynamic> of_run;  ///< times those of the run
  Eigen::RowVectorXd of_response;                        ///< times the response itself
};

/// All moduli times a factor, at one relaxation time, multiply the force at a depth and divide the
/// load that a depth needs: that spares the run the derivative by E2.
Derivatives derivatives_along(const Eigen::MatrixXd& change, const TpmParameters& p, Drive drive,
                              double power) {
  const auto row = [&](TpmIndex i) { return change.row(i); };
  const Eigen::RowVectorXd as_E2 = row(kE2) / p.E2_Pa;
  const Eigen::RowVectorXd stiffer = as_E2 + row(kA0) / p.A0_m2 - row(kL0) / p.l0_m;
  const Eigen::RowVectorXd larger = row(kSpacing) / p.spacing_m;
  Derivatives d;
  d.of_run.resize(kBasis, change.cols());
  d.of_run.row(by_E1) = row(kE1) / p.E2_Pa - p.E1_Pa / p.E2_Pa * as_E2;
  d.of_run.row(by_Eprime) = row(kEprime) / p.E2_Pa - p.Eprime_Pa / p.E2_Pa * as_E2;
  d.of_run.row(by_log_tau) = row(kEta1) / p.eta1_Pa_s - (row(kE1) + row(kE2)) / (p.E1_Pa + p.E2_Pa);
  if (drive == Drive::displacement) {
    d.of_run.row(by_log_imposed) = -larger;
    d.of_response = stiffer + power * larger;
  } else {
    d.of_run.row(by_log_imposed) = -stiffer - power * larger;
    d.of_response = larger;
  }
  return d;
}

std::array<TangentDirection, kBasis> basis_directions(const Network& network,
                                                      const TpmParameters& p) {
  const auto [E1, E2, Eprime] =
      material_directions(network, p.E1_Pa, p.E2_Pa, p.modulus_to_stiffness_m());
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(E1.stiffness.size());
  // The relaxation time has a direction of its own.
  return {{{p.E2_Pa * E1.stiffness, p.E2_Pa * E1.relaxing, 0.0, 0.0},
           {p.E2_Pa * Eprime.stiffness, p.E2_Pa * Eprime.relaxing, 0.0, 0.0},
           {zero, zero, 1.0, 0.0},
           {zero, zero, 0.0, 1.0}}};
}

Probe probe_of(const Tissue& tissue) {
  const Organ& organ = tissue.network.organ;
  const auto& unused = tissue.unused_blocks;
  if (std::find(unused.begin(), unused.end(), "loads") != unused.end()) {
    throw bad_input("scene", "has a block 'loads'",
                    "none: as a model the organ starts without loads");
  }
  if (std::find(unused.begin(), unused.end(), "contacts") != unused.end()) {
    throw bad_input("scene", "has a block 'contacts'",
                    "none: as a model the organ is driven at its contact sphere");
  }
  if (!organ.contact) {
    throw bad_input("scene", "the organ has no contact sphere",
                    "one where the probe of the experiments stands");
  }
  return {*organ.contact, -organ.normal.col(static_cast<Eigen::Index>(*organ.contact))};
}

}  // namespace

OrganModel::OrganModel(std::shared_ptr<const Tissue> tissue, double tolerance)
    : tissue_(std::move(tissue)),
      tolerance_(tolerance),
      element_(tissue_->by_constants && tissue_->materials.factor.size() == 0),
      bonds_(tissue_->bonds()),
      constraints_(tissue_->constraints()),
      probe_(probe_of(*tissue_)) {
  require_valid(probe_, constraints_);
  if (element_) {
    table_.assign(kTpmParameterTable.begin(), kTpmParameterTable.end());
    return;
  }
  names_ = parameters_of(tissue_->materials.materials.front());
  for (const MaterialParameter& p : names_) table_.push_back({p.name, p.dimension, p.meaning});
}

std::pair<double, double> OrganModel::range(std::size_t parameter) const {
  if (element_) return Model::range(parameter);
  return {names_[parameter].least, std::numeric_limits<double>::infinity()};
}

std::vector<double> OrganModel::own_values() const {
  if (element_) {
    const TpmVector paper = to_vector({});
    return {paper.begin(), paper.end()};
  }
  std::vector<double> values;
  for (const MaterialParameter& p : names_) {
    values.push_back(*value_of(tissue_->materials.materials.front(), p.name));
  }
  return values;
}

Response OrganModel::respond(const Protocol& protocol, std::span<const double> times_s,
                             std::span<const double> parameters, Want want) const {
  const auto count = static_cast<Eigen::Index>(table_.size());
  const Eigen::Index columns = want == Want::values ? 0 : count;
  Response response =
      respond_along(protocol, times_s, parameters, Eigen::MatrixXd::Identity(count, columns));
  if (want == Want::values) response.sensitivity.resize(0, 0);
  return response;
}

Response OrganModel::respond_along(const Protocol& protocol, std::span<const double> times_s,
                                   std::span<const double> parameters,
                                   const Eigen::MatrixXd& along) const {
  return element_ ? respond_by_element(protocol, times_s, parameters, along)
                  : respond_by_table(protocol, times_s, parameters, along);
}

MaterialField OrganModel::materials_with(std::span<const double> parameters) const {
  MaterialField materials = tissue_->materials;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    set_value(materials.materials.front(), names_[i].name, parameters[i], "organ");
  }
  return materials;
}

Response OrganModel::respond_by_table(const Protocol& protocol, std::span<const double> times_s,
                                      std::span<const double> parameters,
                                      const Eigen::MatrixXd& along) const {
  const Network& network = tissue_->network;
  const BondSystem bonds = bonds_.with_materials(network, materials_with(parameters));
  QuasiStaticOptions options{.tolerance = tolerance_};
  options.derivative_tolerance = kDerivativeTolerance;
  const Eigen::Map<const Eigen::VectorXd> at(parameters.data(), std::ssize(parameters));
  Eigen::VectorXd per_unit = Eigen::VectorXd::Ones(along.cols());
  for (Eigen::Index j = 0; j < along.cols(); ++j) {
    // In units in which the parameter that changes most does so by its own size.
    for (Eigen::Index i = 0; i < at.size(); ++i) {
      if (along(i, j) == 0.0 || at[i] > 0.0) continue;
      throw bad_input("organ", fmt::format("{} = 0", table_[static_cast<std::size_t>(i)].name),
                      "a value above 0, by which it can be differentiated");
    }
    const double fastest = along.col(j).cwiseQuotient(at).cwiseAbs().maxCoeff();
    if (fastest > 0.0) per_unit[j] = 1.0 / fastest;
    const Eigen::VectorXd change = kDifference * per_unit[j] * along.col(j);
    const auto beside = [&](double sign) {
      const Eigen::VectorXd values = at + sign * change;
      return bonds_.with_materials(
          network, materials_with({values.data(), static_cast<std::size_t>(values.size())}));
    };
    options.directions.push_back(
        direction_between(beside(-1.0), bonds, beside(1.0), 2.0 * kDifference));
  }
  const QuasiStaticRun run =
      QuasiStatic(bonds, network.organ.position, constraints_, probe_, options)
          .run(protocol, times_s);
  Response response;
  response.value = run.response;
  response.sensitivity.resize(run.response.size(), along.cols());
  if (along.cols() > 0) {
    response.sensitivity = run.derivative * per_unit.cwiseInverse().asDiagonal();
  }
  return response;
}

Response OrganModel::respond_by_element(const Protocol& protocol, std::span<const double> times_s,
                                        std::span<const double> parameters,
                                        const Eigen::MatrixXd& along) const {
  TpmVector values{};
  std::copy(parameters.begin(), parameters.end(), values.begin());
  const TpmParameters p = from_vector(values);
  require_valid(p, "organ");
  if (!(p.E2_Pa > 0.0)) {
    throw bad_input("organ", fmt::format("E2 = {} Pa", shortest(p.E2_Pa)),
                    "a modulus above 0: nothing would join the layers");
  }
  const Network& network = tissue_->network;
  const bool continuum = network.options.spacing_law == SpacingLaw::continuum;
  const Similarity similarity{p.spacing_m / network.organ.spacing, continuum ? 2.0 : 1.0};
  const Drive drive = protocol.drive();
  const Derivatives wanted = derivatives_along(along, p, drive, similarity.power);
  QuasiStaticOptions options{.tolerance = tolerance_};
  options.derivative_tolerance = kDerivativeTolerance;
  std::vector<Eigen::Index> used;
  if (along.cols() > 0) {
    auto basis = basis_directions(network, p);
    for (int i = 0; i < kBasis; ++i) {
      if (wanted.of_run.row(i).isZero(0.0)) continue;
      used.push_back(i);
      options.directions.push_back(std::move(basis[static_cast<std::size_t>(i)]));
    }
  }
  const BondSystem bonds = bonds_.with_materials(network, p.bonds(tissue_->materials.lateral()));
  const QuasiStaticRun run =
      QuasiStatic(bonds, network.organ.position, constraints_, probe_, options)
          .run(protocol.scaled(1.0 / similarity.of_imposed(drive)), times_s);
  const double factor = similarity.of_response(drive);
  Response response;
  response.value = factor * run.response;
  response.sensitivity = response.value * wanted.of_response;
  if (!used.empty()) {
    response.sensitivity += factor * run.derivative * wanted.of_run(used, Eigen::all);
  }
  return response;
}

std::unique_ptr<Model> OrganModel::surrogate() const {
  if (!element_) return nullptr;
  return make_model("closed_form");
}

}  // namespace tpm::organ
