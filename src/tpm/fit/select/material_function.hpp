#pragma once
#include <optional>
#include <string>
#include <variant>

#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/select/selection.hpp"

namespace tpm::fit {

/// Function of a linear material that a rheometer measures, whatever the specimen: storage and loss
/// over frequency, a relaxation modulus G(t) or a creep compliance J(t).
struct MaterialFunction {
  std::string name;  ///< a path where the configuration is to be rerun
  std::variant<Spectrum, Recording> data;
  ImportOptions import;  ///< with which it was read, for the configuration
  std::string
      read_as;  ///< how its columns and units were understood; empty for a file with a description
  bool from_angle =
      false;  ///< of a spectrum: a magnitude (or the storage) and a phase were measured

  /// "spectrum", "relaxation modulus" or "creep compliance".
  [[nodiscard]] std::string kind() const;
};

/// The material function that a file holds (read_measured_file); none if it
/// holds a recording with a drive. Throws as these do.
[[nodiscard]] std::optional<MaterialFunction> find_material_function(const std::string& path,
                                                                     const ImportOptions& import);

/// The same of a file that was read; `measured` is moved from if it holds one.
[[nodiscard]] std::optional<MaterialFunction> material_function_of(const std::string& path,
                                                                   const ImportOptions& import,
                                                                   MeasuredFile& measured);

/// The configuration that fits one law with a linear kernel: of stress over strain for moduli and
/// compliances, of force over depth for dynamic stiffnesses. Noise in parts of each reading (or the
/// file's standard deviations), its size estimated; bounds from the readings.
[[nodiscard]] FitConfig function_config(LawSpec law, const MaterialFunction& function,
                                        const SetupOptions& options);

/// The warnings of select_law() about a material function, for the fit of one data set: relaxation
/// times outside what was measured, and what was assumed of small readings. Nothing of other data.
[[nodiscard]] std::vector<Remark> function_remarks(const FitResult& fit, const DataSet& data);

/// Fits every law and recommends the least, as select_law does for recordings; without held-out
/// errors. The readings count as independent.
/// @param options laws empty: linear kernels with 0 to 4 branches, and the laws with one or two
///        spring-pots
[[nodiscard]] Selection select_law(const MaterialFunction& function,
                                   const SelectionOptions& options);

}  // namespace tpm::fit
