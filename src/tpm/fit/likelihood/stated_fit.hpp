#pragma once
// The configuration of a fit as stated (its keys: fit_keys.cpp). Quantities are in the dimensions
// of the model and the data, which config_parts.hpp knows.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tpm/files/keys/placed.hpp"
#include "tpm/fit/likelihood/config.hpp"

namespace tpm::fit {

/// The model that a scene's network is, instead of a formulation.
inline constexpr std::string_view kOrganModel = "organ";

struct StatedLaw {
  Placed<std::string> name;
  Quantity drive = Quantity::indentation_depth;
  StatedQuantity reference;
  DocumentPlace place = {};
};

using FitProtocol = ProtocolChoice::Kind;

struct StatedProtocol {
  FitProtocol kind = FitProtocol::ramp_hold;
  ProtocolChoice choice;  ///< but the kind and the operating depth
  std::optional<StatedQuantity> operating_depth;
  DocumentPlace place = {};
};

/// a or b of sigma = a + b |model|.
struct StatedSigma {
  /// It is estimated under this name; empty: under a usual one.
  std::optional<std::string> estimated;
  double number = 0.0;      ///< b, > 0, unless estimated
  StatedQuantity quantity;  ///< a, unless estimated
};

/// A distribution of the noise as files name it.
struct NoiseDistribution {
  ErrorShape shape = ErrorShape::normal;
  bool log = false;  ///< of the logarithm

  bool operator==(const NoiseDistribution&) const = default;
};

struct StatedNoise {
  std::optional<NoiseKind> kind_alone;  ///< as the file names it
  std::optional<NoiseDistribution> distribution;
  std::optional<double> degrees_of_freedom;
  std::optional<StatedSigma> relative, absolute;
  std::optional<double> angle_rad;
  bool scale_known = true;
  DocumentPlace place = {};

  /// With a kind or the distribution log_normal, which stands for one.
  [[nodiscard]] NoiseKind kind() const {
    return distribution && distribution->log ? NoiseKind::log : kind_alone.value();
  }
  [[nodiscard]] ErrorShape shape() const {
    return distribution ? distribution->shape : ErrorShape::normal;
  }
  [[nodiscard]] bool estimates_sigma() const {
    return (relative && relative->estimated) || (absolute && absolute->estimated);
  }
};

struct StatedData {
  DataChoice choice;  ///< but what the members below say
  StatedProtocol protocol;
  StatedNoise noise;
  std::optional<ImportOptions> import;
  std::optional<Placed<double>> stiffness_per_modulus_m;
  std::optional<Placed<bool>> load_imposed;
  std::optional<StatedQuantity> clipped_above, clipped_below, contact_response;
};

struct StatedPrior {
  StatedQuantity mean, sd;
  std::string from;
  bool measured = true;
};

/// A recording and times of it.
struct StatedDrift {
  Placed<std::string> of;
  double origin_s = 0.0;
};

struct StatedRise {
  Placed<std::string> of;
  double begin_s = 0.0, end_s = 0.0;
};

struct StatedParameter {
  StatedQuantity start, lower, upper;
  std::optional<Scale> scale;
  std::vector<Placed<std::string>> sets, data;  ///< model parameters; data sets
  std::optional<StatedPrior> prior;
  std::optional<StatedDrift> drift;
  std::optional<StatedRise> rise;
  std::optional<Remark> not_separable;
  DocumentPlace place = {};
};

/// Quantities by the names of parameters, in the order of the file.
using StatedValues = std::vector<std::pair<std::string, StatedQuantity>>;

struct StatedHypothesis {
  std::string name;
  StatedValues values;
};

struct StatedBootstrap {
  BootstrapOptions options;
  std::optional<std::uint64_t> seed;  ///< else that of the starts
};

struct StatedFit {
  FitConfig config;  ///< what needs neither the model nor the data
  std::optional<Placed<std::string>> model;
  std::optional<StatedLaw> law;
  std::optional<TensionRule::Kind> tension;
  std::vector<std::pair<std::string, StatedParameter>> parameters;
  StatedValues fixed;
  std::vector<StatedData> data;
  std::optional<StatedBootstrap> bootstrap;
  std::vector<StatedHypothesis> hypotheses;
};

}  // namespace tpm::fit
