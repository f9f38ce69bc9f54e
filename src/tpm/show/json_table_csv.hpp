#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"

namespace tpm::show {

/// A table of a JSON answer as CSV: the same numbers under the same keys, which carry the unit.
/// One line for each row; the keys of an object within a row follow its own with an underscore
/// (`experiment_depth_m`), and a list of numbers or words fills one cell, separated by spaces; but
/// the limits of an interval, band or bounds are two columns, `interval_SI_lower` and `_upper`.
/// Lists of objects are left out, except `spread`: each of its elements has a line of its own, with
/// the rest of the row repeated. A row without a key leaves its cell empty, as does null.
/// @param rows a list of objects
/// @param spread JSON pointer to a list of objects within each row, such as "/parameters"; empty
/// for none
/// @param columns the first ones, which stand in the header of a table without rows, too
[[nodiscard]] std::string json_table_csv(const Json& rows, std::string_view spread = {},
                                         std::vector<std::string> columns = {});

}  // namespace tpm::show
