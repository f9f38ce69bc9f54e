// Declared in tpm/fit/likelihood/config_parts.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/files/blocks/protocol_block.hpp"
#include "tpm/fit/likelihood/config_parts.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

/// The common protocols, and what only data can say. A fit's file gives a common protocol without
/// the numbers that its readings hold.
constexpr auto kFitProtocolWords = std::to_array<Word<FitProtocol>>(
    {{FitProtocol::ramp_hold, entry_of(kProtocolKindWords, ProtocolKind::ramp_hold).text},
     {FitProtocol::step_hold, entry_of(kProtocolKindWords, ProtocolKind::step_hold).text},
     {FitProtocol::static_, "static"},
     {FitProtocol::creep, entry_of(kProtocolKindWords, ProtocolKind::creep).text},
     {FitProtocol::measured, "measured"},
     {FitProtocol::oscillation, "oscillation"}});

/// The unit of what the file states follows from the law.
ProtocolChoice protocol_of(const StatedProtocol& stated, const std::optional<LawSpec>& law) {
  ProtocolChoice protocol = stated.choice;
  protocol.kind = stated.kind;
  if (protocol.kind != FitProtocol::oscillation) return protocol;
  if (!law) {
    throw bad_input(stated.place.where, "'oscillation' with the paper's element",
                    "a law of the family under /law");
  }
  if (!stated.operating_depth) return protocol;
  protocol.operating_depth = stated.operating_depth->in(quantity_dimension(law->drive));
  if (*protocol.operating_depth >= 0.0) return protocol;
  throw bad_input(stated.operating_depth->place.where, "below 0",
                  "a depth of the tissue such as \"2 mm\"");
}

/// A0/l0 of a spectrum of moduli under a contact.
double stiffness_per_modulus(const Placed<double>& stated, const FitConfig& config,
                             FitProtocol protocol) {
  const bool strip = config.law && is_answered_by_stress(config.law->drive);
  if (protocol == FitProtocol::oscillation && !strip) return stated.value;
  throw bad_input(stated.place.where,
                  strip ? "beside a law of stress"
                        : fmt::format("beside protocol '{}'", protocol_kind_name(protocol)),
                  "it only with oscillation and a law of contact force over indentation depth");
}

/// True if the response was imposed, as in creep.
bool response_is_imposed(const Placed<bool>& stated, const FitConfig& config,
                         FitProtocol protocol) {
  const bool answers = config.law && (config.law->drive == Quantity::strain ||
                                      config.law->drive == Quantity::indentation_depth);
  if (!stated.value || (protocol == FitProtocol::measured && answers)) return stated.value;
  throw bad_input(stated.place.where,
                  "'response' without a recording of stress over strain or force over depth",
                  "it only with the protocol 'measured' and a law of one of these");
}

double positive_sigma(const StatedQuantity& stated, Dimension readings) {
  const double sigma = stated.in(readings);
  if (sigma > 0.0) return sigma;
  throw bad_input(stated.place.where, "a standard deviation that is not above 0", "a positive one");
}

Noise noise_of(const StatedNoise& stated, Dimension readings) {
  Noise noise;
  noise.kind = stated.kind();
  noise.shape = stated.shape();
  noise.scale_known = stated.scale_known;
  noise.degrees_of_freedom = stated.degrees_of_freedom.value_or(noise.degrees_of_freedom);
  noise.angle_rad = stated.angle_rad;
  if (stated.relative && !stated.relative->estimated) noise.relative = stated.relative->number;
  if (stated.absolute && !stated.absolute->estimated) {
    noise.absolute = positive_sigma(stated.absolute->quantity, readings);
  }
  return noise;
}

DataChoice choice_of(const StatedData& stated, const FitConfig& config) {
  DataChoice data = stated.choice;
  data.protocol = protocol_of(stated.protocol, config.law);
  const FitProtocol protocol = data.protocol.kind;
  if (stated.stiffness_per_modulus_m) {
    data.stiffness_per_modulus_m =
        stiffness_per_modulus(*stated.stiffness_per_modulus_m, config, protocol);
  }
  if (stated.load_imposed) {
    data.load_imposed = response_is_imposed(*stated.load_imposed, config, protocol);
  }
  if (stated.import) data.import = *stated.import;
  const Dimension readings = reading_dimension(config, data);
  data.noise = noise_of(stated.noise, readings);
  if (stated.clipped_above) data.clipped_above = stated.clipped_above->in(readings);
  if (stated.contact_response) data.contact_response = stated.contact_response->in(readings);
  if (stated.clipped_below) data.clipped_below = stated.clipped_below->in(readings);
  return data;
}

/// The name of an estimated part of sigma; empty if there is none.
std::string name_of_sigma(const std::optional<StatedSigma>& stated, const std::string& usual) {
  const std::string name = stated ? stated->estimated.value_or("") : "";
  return name.empty() && stated && stated->estimated ? usual : name;
}

}  // namespace

Dimension reading_dimension(const FitConfig& config, const DataChoice& data) {
  if (data.protocol.kind == FitProtocol::creep) return Dimension::length;
  if (data.load_imposed) return quantity_dimension(config.law->drive);
  const Dimension response =
      config.law ? quantity_dimension(config.law->response) : Dimension::force;
  if (data.protocol.kind != FitProtocol::oscillation) return response;
  const bool modulus = response == Dimension::stress || data.stiffness_per_modulus_m.has_value();
  return modulus ? Dimension::stress : Dimension::stiffness;
}

std::vector<DataChoice> data_of(const std::vector<StatedData>& stated, const FitConfig& config) {
  const auto several = std::ranges::count_if(stated, [](const StatedData& data) {
                         return data.noise.estimates_sigma();
                       }) > 1;
  return mapped<DataChoice>(stated, [&](const StatedData& one) {
    DataChoice data = choice_of(one, config);
    const std::string after = several ? " " + data.dataset : std::string{};
    data.sigma_a = name_of_sigma(one.noise.absolute, "sigma_a" + after);
    data.sigma_b = name_of_sigma(one.noise.relative, "sigma_b" + after);
    return data;
  });
}

namespace {

/// A limit may have gone through a unit and back.
constexpr double kSameReading = 1e-9;

}  // namespace

bool DataChoice::is_clipped_above(double reading) const {
  return clipped_above && reading >= *clipped_above - kSameReading * std::abs(*clipped_above);
}

bool DataChoice::is_clipped_below(double reading) const {
  return clipped_below && reading <= *clipped_below + kSameReading * std::abs(*clipped_below);
}

std::string_view protocol_kind_name(FitProtocol kind) noexcept {
  return entry_of(kFitProtocolWords, kind).text;
}

bool Selector::matches(const Datum& datum) const {
  const auto close = [](double a, double b) { return std::abs(a - b) <= 1e-9 * std::abs(b); };
  if (depth_m && !(datum.depth_m && close(*datum.depth_m, *depth_m))) return false;
  if (load_N && !(datum.load_N && close(*datum.load_N, *load_N))) return false;
  return !label || datum.label == *label;
}

}  // namespace tpm::fit
