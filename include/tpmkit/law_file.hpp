#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tpmkit/curve.hpp"
#include "tpmkit/law.hpp"
#include "tpmkit/law_uncertainty.hpp"

namespace tpm {

/// A law with its parameters, as fits write it and simulations read it (docs/laws.md).
struct LawFile {
  LawSpec spec;
  std::vector<double> values;  ///< in the order of law_parameters(spec), SI
  Provenance provenance = Provenance::assumed;
  std::string note;
  /// Largest depth (or relative length less the slack) of the data that it was fitted to, > 0.
  std::optional<double> fitted_to = std::nullopt;
  /// Uncertainty of the parameters: the block "fit" of the file.
  std::optional<LawUncertainty> uncertainty = std::nullopt;
  /// True if the law describes the data that it was fitted to. None: it was not tested.
  std::optional<LawAdequacy> adequacy = std::nullopt;
};

/// The key of a parameter in files: name and SI unit, "k_inf_N_per_m", "tau1_s", "alpha".
[[nodiscard]] std::string law_key(const LawParameter& parameter);

/// Reads a law file. Throws Error(bad_input) for anything that schemas/law.schema.json or the law
/// does not allow: an unknown law or key, a missing parameter without a preset, a value out of
/// range.
[[nodiscard]] LawFile read_law(const std::filesystem::path& path);
/// Throws Error(environment) if the file cannot be written.
void write_law(const std::filesystem::path& path, const LawFile& law);

}  // namespace tpm
