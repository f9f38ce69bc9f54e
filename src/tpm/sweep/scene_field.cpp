#include "tpm/sweep/scene_field.hpp"
#include "tpm/base/quantity_text.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::sweep {
namespace {

constexpr std::string_view kOfMaterial = "material.", kProtocol = "/protocol/",
                           kKnots = "/protocol/knots/";

Error no_number(const std::string& target, std::string_view what, std::string_view where) {
  return bad_input(
      where, fmt::format("'{}' {}", printable(target), what),
      "a JSON pointer to a number of the scene, such as /material/E1, or a parameter of "
      "its material by name, such as material.tau1");
}

}  // namespace

SceneField::SceneField(const Json& scene, const BondMaterial& material, const std::string& target,
                       std::string_view where)
    : target_(target) {
  if (target.starts_with(kOfMaterial)) {
    parameter_ = target.substr(kOfMaterial.size());
    std::string names;
    for (const MaterialParameter& p : parameters_of(material)) {
      dimension_ = p.dimension;
      if (p.name == parameter_) return;
      names += fmt::format("{}{}{}", names.empty() ? "" : ", ", kOfMaterial, p.name);
    }
    throw bad_input(where, fmt::format("'{}' is no parameter of the material", printable(target)),
                    "one of " + names);
  }
  try {
    pointer_ = Json::json_pointer(target);
    const Json& value = scene.at(pointer_);
    whole_ = value.is_number_integer();
    if (value.is_number()) return;
    if (!value.is_string()) throw no_number(target, "is no number", where);
    quantity_ = true;
    const auto text = value.get<std::string>();
    const auto [number, unit] = split_quantity(text);
    if (unit.empty() || !find_number(number)) throw no_number(target, "is no number", where);
    dimension_ = parse_unit(unit, where).dimension;
  } catch (const Json::exception&) {
    throw no_number(target, "is not in the scene", where);
  }
}

bool SceneField::of_protocol() const {
  return target_.starts_with(kProtocol);
}

bool SceneField::is_light() const {
  return !parameter_.empty() || of_protocol() || target_.starts_with("/material/") ||
         target_.starts_with("/integrator/") || target_ == "/tolerance";
}

bool SceneField::is_shared() const {
  return of_protocol() || target_ == "/material/eta1" || parameter_ == "tau1";
}

void SceneField::set(Json& scene, double value) const {
  if (!parameter_.empty() || of_protocol()) return;
  if (!whole_) {
    scene.at(pointer_) = value;
  } else if (value == std::round(value) && std::abs(value) < 1e15) {
    scene.at(pointer_) = static_cast<std::int64_t>(value);
  } else {
    throw bad_input(target_, shortest(value), "a whole number");
  }
}

void SceneField::set(BondMaterial& material, double value) const {
  if (!parameter_.empty()) set_value(material, parameter_, value, target_);
}

void SceneField::set(ProtocolBlock& protocol, double value) const {
  if (target_.starts_with(kKnots)) {
    const std::string rest = target_.substr(kKnots.size());
    const std::size_t slash = rest.find('/');
    Knot& knot = protocol.knots.at(std::stoul(rest.substr(0, slash)));
    (rest.substr(slash + 1) == "time" ? knot.time_s : knot.value) = value;
  } else if (of_protocol()) {
    *protocol.find(target_.substr(kProtocol.size())) = value;
  }
}

}  // namespace tpm::sweep
