#include "tpm/files/keys/types.hpp"

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/keys/more_types.hpp"
#include "tpm/files/keys/placed.hpp"

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

ValueType<Remark> remark() {
  static const Block<Remark> block(
      "remark",
      "what was assumed or is doubtful, or was not asked for; it leaves the exit code as it is",
      {required(key("code", &Remark::code, text(), "its kind, which stays when the text changes")),
       required(key("text", &Remark::text, text(), "in words, with its numbers"))});
  return block.type();
}

ValueType<std::string> text_if_any() {
  ValueType<std::string> type = text();
  type.write = [](const std::string& value) { return value.empty() ? Json() : Json(value); };
  return type;
}

ValueType<Unit> unit_text() {
  return converted<Unit>(
      text_if_any(),
      [](const std::string& value, const DocumentPlace& place) {
        return parse_unit(value, place.where);
      },
      [](const Unit& unit) { return std::string(unit.symbol); });
}

KeyForm optional_key(std::string name, FormPtr form, std::string sentence) {
  return {.name = std::move(name), .form = std::move(form), .sentence = std::move(sentence)};
}

KeyForm required_key(std::string name, FormPtr form, std::string sentence) {
  KeyForm key = optional_key(std::move(name), std::move(form), std::move(sentence));
  key.required = true;
  return key;
}

FormPtr list_form(FormPtr item, std::size_t fewest, std::size_t most) {
  return shared(
      {.type = Form::Type::list, .fewest = fewest, .most = most, .item = std::move(item)});
}

FormPtr map_form(FormPtr item, std::size_t fewest) {
  return shared({.type = Form::Type::map, .fewest = fewest, .item = std::move(item)});
}

FormPtr or_null(const FormPtr& form) {
  Form changed = *form;
  changed.null_too = true;
  return shared(std::move(changed));
}

FormPtr with_others(const FormPtr& object) {
  Form changed = *object;
  changed.others_too = true;
  return shared(std::move(changed));
}

FormPtr either_form(std::vector<FormPtr> forms) {
  return shared({.type = Form::Type::either, .forms = std::move(forms)});
}

FormPtr object_form(std::string name, std::string sentence, std::vector<KeyForm> keys) {
  return shared({.type = Form::Type::block,
                 .name = std::move(name),
                 .sentence = std::move(sentence),
                 .keys = std::move(keys)});
}

ValueType<std::string> one_of(std::vector<std::string> words) {
  ValueType<std::string> type = text_if_any();
  type.form = shared({.type = Form::Type::word, .words = std::move(words)});
  return type;
}

ValueType<std::string> text_like(std::string pattern, std::string what, std::string example) {
  ValueType<std::string> type = text_if_any();
  type.form = shared({.type = Form::Type::text,
                      .sentence = std::move(what),
                      .example = std::move(example),
                      .pattern = std::move(pattern)});
  return type;
}

double StatedQuantity::in(Dimension dimension) const {
  return parse_quantity(text, dimension, place.where);
}

Unit StatedQuantity::unit(Dimension dimension) const {
  return parse_unit(split_quantity(text).unit, dimension, place.where);
}

ValueType<StatedQuantity> stated_quantity() {
  return converted<StatedQuantity>(
      text(1).named("some_quantity", "a number and a unit, such as \"12 kPa\""),
      [](std::string value, const DocumentPlace& place) {
        return StatedQuantity{std::move(value), place};
      },
      [](const StatedQuantity& from) { return from.text; });
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
