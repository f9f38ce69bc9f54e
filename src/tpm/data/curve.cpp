#include "tpmkit/curve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/data/curve_words.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
using namespace data;

namespace {

void require_quantity(const CurveHeader& header, Quantity found, Quantity wanted) {
  if (found == wanted) return;
  throw bad_input(header.id, fmt::format("the recording holds {}", quantity_name(found)),
                  quantity_name(wanted));
}

}  // namespace

std::string_view provenance_name(Provenance provenance) noexcept {
  return entry_of(kProvenances, provenance).text;
}

Provenance parse_provenance(std::string_view text, std::string_view where) {
  return parse_word(kProvenances, "provenance", text, where);
}

std::string_view quantity_name(Quantity quantity) noexcept {
  return entry_of(kQuantities, quantity).text;
}

Quantity parse_quantity_name(std::string_view text, std::string_view where) {
  return parse_word(kQuantities, "quantity", text, where);
}

Dimension quantity_dimension(Quantity quantity) noexcept {
  return entry_of(kQuantities, quantity).dimension;
}

bool is_answered_by_stress(Quantity drive) noexcept {
  return drive == Quantity::relative_length || drive == Quantity::strain;
}

bool is_step_response(Quantity quantity) noexcept {
  return quantity == Quantity::relaxation_modulus || quantity == Quantity::creep_compliance;
}

std::string_view quantity_short_name(Quantity quantity) noexcept {
  return entry_of(kQuantities, quantity).short_name;
}

std::string si_key(std::string_view name, Dimension dimension) {
  std::string unit;
  for (const char c : si_symbol(dimension)) {
    if (c == '/') {
      unit += "_per_";
    } else if (c == ' ') {
      unit += '_';
    } else if (c != '^') {
      unit += c;
    }
  }
  return unit.empty() ? std::string(name) : fmt::format("{}_{}", name, unit);
}

std::string si_key(Quantity quantity, std::string_view part) {
  std::string name(quantity_short_name(quantity));
  if (!part.empty()) name.append("_").append(part);
  return si_key(name, quantity_dimension(quantity));
}

Quantity observable_quantity(Observable observable) noexcept {
  return observable == Observable::contact_force ? Quantity::contact_force
                                                 : Quantity::indentation_depth;
}

std::string_view time_origin_name(TimeOrigin origin) noexcept {
  return entry_of(kTimeOrigins, origin).text;
}

TimeOrigin parse_time_origin(std::string_view text, std::string_view where) {
  return parse_word(kTimeOrigins, "time origin", text, where);
}

const std::vector<double>& Recording::depth_m() const {
  require_quantity(header, drive_quantity, Quantity::indentation_depth);
  if (drive.empty()) {
    throw bad_input(header.id, "the recording has no depths", "indentation_depth");
  }
  return drive;
}

const std::vector<double>& Recording::force_N() const {
  require_quantity(header, response_quantity, Quantity::contact_force);
  return response;
}

const std::vector<double>& Recording::force_sd_N() const {
  require_quantity(header, response_quantity, Quantity::contact_force);
  return response_sd;
}

SpectrumQuantities spectrum_quantities(Dimension dimension) noexcept {
  if (dimension == Dimension::stress) return {Quantity::storage_modulus, Quantity::loss_modulus};
  return {Quantity::storage_stiffness, Quantity::loss_stiffness};
}

std::optional<RowFault> find_datum_fault(const Datum& datum, Observable observable) {
  struct Number {
    const char* column;
    const std::optional<double>& value;
    bool any_sign;
  };
  const bool force = observable == Observable::contact_force;
  for (const Number& number :
       {Number{"indentation_depth", datum.depth_m, false}, Number{"load", datum.load_N, false},
        Number{"time", datum.time_s, false}, Number{"value", datum.value, true},
        Number{"lower", datum.lower, true}, Number{"upper", datum.upper, true},
        Number{"sd", datum.sd, false}}) {
    if (!number.value) continue;
    if (!std::isfinite(*number.value)) return RowFault{number.column, "not a number", "a number"};
    if (!number.any_sign && *number.value < 0.0) {
      return RowFault{number.column, fmt::format("{} is negative", *number.value), "at least 0"};
    }
  }
  if (datum.lower.has_value() != datum.upper.has_value()) {
    return RowFault{"lower", "only one end of the band is given", "both ends"};
  }
  if (datum.value.has_value() == datum.is_band()) {
    return RowFault{"value", "neither or both of a value and a band", "one of the two"};
  }
  if (datum.is_band() && *datum.lower > *datum.upper) {
    return RowFault{"lower", "the lower end of the band lies above the upper one",
                    "lower <= upper"};
  }
  if (datum.sd && datum.is_band()) {
    return RowFault{"sd", "a band has no standard deviation", "an empty field"};
  }
  // A model can answer only if it knows what was imposed.
  if (!(force ? datum.depth_m : datum.load_N)) {
    return RowFault{force ? "indentation_depth" : "load",
                    force ? "no imposed indentation_depth" : "no imposed load",
                    "the imposed quantity in each row"};
  }
  return std::nullopt;
}

std::optional<RowFault> find_value_fault(const NamedValue& value) {
  if (value.name.empty()) return RowFault{"name", "empty", "a name"};
  for (const auto& number : {value.value, value.lower, value.upper, value.plus_minus}) {
    if (number && !std::isfinite(*number)) return RowFault{"value", "not a number", "a number"};
  }
  if (value.value.has_value() == (value.lower || value.upper)) {
    return RowFault{"value", "neither or both of a value and a range", "one of the two"};
  }
  if (value.lower && value.upper && *value.lower > *value.upper) {
    return RowFault{"lower", "lies above the upper end of the range", "lower <= upper"};
  }
  if ((value.provenance == Provenance::derived) == value.formula.empty()) {
    return RowFault{"formula",
                    value.formula.empty() ? "empty for a derived value"
                                          : "stands beside a value that is not derived",
                    "a formula for derived values and only for them"};
  }
  return std::nullopt;
}

std::optional<SpectrumFault> find_spectrum_fault(const std::vector<double>& frequency,
                                                 const std::vector<double>& storage,
                                                 const std::vector<double>& loss) {
  std::set<double> seen;
  for (std::size_t i = 0; i < frequency.size(); ++i) {
    if (frequency[i] <= 0.0) {
      return SpectrumFault{i, fmt::format("frequency {} is not positive", frequency[i]), "above 0"};
    }
    if (!seen.insert(frequency[i]).second) {
      return SpectrumFault{i, fmt::format("frequency {} stands twice", frequency[i]),
                           "each frequency once: one sweep, of one temperature and one amplitude, "
                           "a file"};
    }
    for (const auto& [name, value] :
         {std::pair{"storage", storage[i]}, std::pair{"loss", loss[i]}}) {
      if (value < 0.0)
        return SpectrumFault{i, fmt::format("{} {} is negative", name, value), "at least 0"};
    }
  }
  return std::nullopt;
}

const NamedValue& ValueSet::at(std::string_view name) const {
  const auto found = std::find_if(values.begin(), values.end(),
                                  [name](const NamedValue& value) { return value.name == name; });
  if (found == values.end()) {
    throw bad_input(header.id, fmt::format("no value '{}'", printable(name)),
                    "a name of its first column");
  }
  return *found;
}

}  // namespace tpm
