#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/law/contact_geometry.hpp"
#include "tpm/law/prony_table.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::files {

/// The programs that a relaxation can be written for; docs/laws.md has their conventions.
enum class ExportTarget { abaqus, ansys, febio, json };

/// "abaqus", ...
[[nodiscard]] std::vector<std::string> export_targets();
/// Throws Error(bad_input) naming the known words.
[[nodiscard]] ExportTarget parse_export_target(std::string_view text, std::string_view where);

struct ExportOptions {
  ExportTarget target = ExportTarget::abaqus;
  ContactGeometry geometry;
  PronyWindow window;            ///< of a fractional law
  bool relaxation_only = false;  ///< leave out a kernel or tension that the target cannot say
};

/// The relaxation of a law as a text for another program, with its assumptions as comments.
/// Throws Error(bad_input) for a power kernel or tension without relaxation_only, for more terms
/// than the target takes, and for a fluid in FEBio.
[[nodiscard]] std::string export_law(const LawFile& law, const ExportOptions& options);

/// Remarks on all that the written material leaves out or stretches; each stands among its
/// comments, too, and is told to the user.
[[nodiscard]] std::vector<Remark> export_remarks(const LawFile& law, const ExportOptions& options);

}  // namespace tpm::files
