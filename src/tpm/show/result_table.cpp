#include "tpm/show/result_table.hpp"

#include <utf8.h>

#include <algorithm>
#include <cstdlib>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"

namespace tpm::show {

Json with_digits(Json value, int digits) {
  if (value.is_number_float() && digits > 0) value = rounded(value.get<double>(), digits);
  return value;
}

std::string csv_cell(const Json& value, int digits) {
  if (value.is_null()) return {};
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) {
    return digits > 0 ? significant(value.get<double>(), digits) : shortest(value.get<double>());
  }
  if (!value.is_array()) return value.dump();
  return listed(
      value, [digits](const Json& item) { return csv_cell(item, digits); }, " ");
}

std::string shown_cell(const Json& value, double unit, int digits) {
  if (value.is_null()) return "-";
  if (!value.is_number_float()) return csv_cell(value, digits);
  return significant(value.get<double>() / unit, digits);
}

std::string aligned_line(const std::vector<Cell>& cells, const std::vector<int>& widths) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::string& cell = cells[i].text;
    if (i > 0) line += widths[i - 1] > 0 && widths[i] <= 0 ? "  " : " ";
    const auto own = static_cast<int>(utf8::unchecked::distance(cell.begin(), cell.end()));
    const std::string space(static_cast<std::size_t>(std::max(std::abs(widths[i]) - own, 0)), ' ');
    line += widths[i] > 0 ? space + cell : cell + space;
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

}  // namespace tpm::show
