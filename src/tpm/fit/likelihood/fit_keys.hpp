#pragma once
#include <string>
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpm/fit/likelihood/stated_fit.hpp"

namespace tpm::fit {

/// Keys of the configuration of a fit.
[[nodiscard]] const FileKind& fit_kind();

/// The same with tables in place of parameters, fixed values and data.
[[nodiscard]] const FileKind& fit_tables_kind();

/// The contents of a configuration. Throws Error(bad_input), at the key, for what has not the form
/// or breaks a rule about several keys.
[[nodiscard]] StatedFit stated_fit(const Json& document, std::string_view where);

/// The tables of a problem, relative to its file.
struct TableFiles {
  std::string parameters, observables, conditions, measurements;
};

/// True if a document names one of them.
[[nodiscard]] bool has_table_files(const Json& document);

/// Takes them out of the document. Throws Error(bad_input), at the key, unless it has the form of
/// fit_tables_kind().
[[nodiscard]] TableFiles take_table_files(Json& problem, std::string_view where);

/// Keys of a data set in a fit.
[[nodiscard]] const Block<StatedData>& data_block();

}  // namespace tpm::fit
