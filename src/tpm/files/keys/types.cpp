#include "tpm/files/keys/types.hpp"

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"

namespace tpm::files {
namespace {

ValueType<double> quantity_type(Dimension dimension, Range range, bool plain_too) {
  return {shared({.type = Form::Type::quantity,
                  .range = range,
                  .dimension = dimension,
                  .plain_too = plain_too}),
          [dimension](const Json& value, const DocumentPlace& place) {
            return quantity_of(value, dimension, place.where);
          },
          [dimension](const double& value) {
            const Unit unit = shown_unit(dimension);
            return Json(with_unit(shortest(rounded(value / unit.to_si, 12)), unit));
          }};
}

}  // namespace

ValueType<bool> flag() {
  return {shared({.type = Form::Type::flag}),
          [](const Json& value, const DocumentPlace&) { return value.get<bool>(); },
          [](const bool& value) { return Json(value); }};
}

ValueType<std::string> text(std::size_t fewest) {
  return {shared({.type = Form::Type::text, .fewest = fewest}),
          [](const Json& value, const DocumentPlace&) { return value.get<std::string>(); },
          [](const std::string& value) { return Json(value); }};
}

ValueType<double> number(Range range) {
  return {shared({.type = Form::Type::number, .range = range}),
          [](const Json& value, const DocumentPlace&) { return value.get<double>(); },
          [](const double& value) { return Json(value); }};
}

ValueType<double> quantity(Dimension dimension, Range range) {
  return quantity_type(dimension, range, false);
}

ValueType<double> plain_quantity(Dimension dimension, Range range) {
  return quantity_type(dimension, range, true);
}

ValueType<Json> any(std::string sentence) {
  return {shared({.type = Form::Type::any, .sentence = std::move(sentence)}),
          [](const Json& value, const DocumentPlace&) { return value; },
          [](const Json& value) { return value; }};
}

ValueType<std::array<double, 3>> direction() {
  ValueType<std::array<double, 3>> type = three(number());
  Form form = *type.form;
  form.name = "direction";
  form.sentence = "three numbers, not all 0; the length does not count";
  form.not_all_zero = true;
  type.form = shared(std::move(form));
  return type;
}

}  // namespace tpm::files
