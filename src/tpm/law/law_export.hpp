#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/law/law_file.hpp"
#include "tpm/law/prony_table.hpp"

namespace tpm {

/// The programs that a relaxation can be written for; docs/laws.md has their conventions.
enum class ExportTarget { abaqus, ansys, febio, json };

/// Throws Error(bad_input) naming the known words.
[[nodiscard]] ExportTarget parse_export_target(std::string_view text, std::string_view where);
[[nodiscard]] std::vector<std::string> export_target_names();

/// What turns a stiffness in N/m into a modulus in Pa.
struct ContactGeometry {
  std::optional<double> sphere_radius_m;  ///< Hertz: F = 4/3 E/(1 - nu^2) sqrt(R) u^(3/2), at u_ref
  std::optional<double> area_m2;          ///< a bar: F = E A/l u; together with length_m
  std::optional<double> length_m;
  double poisson_ratio = 0.49;  ///< assumed; 0 to below 0.5
};

struct ExportOptions {
  ExportTarget target = ExportTarget::abaqus;
  ContactGeometry geometry;
  PronyWindow window;            ///< of a fractional law
  bool relaxation_only = false;  ///< leave out a kernel or tension that the target cannot say
};

/// E (Pa) of a stiffness at the reference depth; none if the geometry is not given. A strip's
/// stiffness is a modulus already. Throws Error(bad_input) for sizes that are not above 0, for a
/// sphere together with a bar, or half of a bar.
[[nodiscard]] std::optional<double> modulus_Pa(const LawSpec& spec, double stiffness,
                                               const ContactGeometry& geometry);

/// The relaxation of a law as a text for another program, with its assumptions as comments.
/// Throws Error(bad_input) for a power kernel or tension without relaxation_only, for more terms
/// than the target takes, and for a fluid in FEBio.
[[nodiscard]] std::string export_law(const LawFile& law, const ExportOptions& options);

}  // namespace tpm
