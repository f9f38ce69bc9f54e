#include "tpm/files/renamed_names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <functional>
#include <string>
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/warning.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

using Kind = RenamedName::Kind;

/// Renamed in 0.2.
constexpr std::array<RenamedName, 11> kRenamed{{
    {"scene", "", Kind::key, "guides", "sliders", "0.3"},
    {"scene", "/outputs/fields", Kind::value, "remembered", "viscous", "0.3"},
    {"protocol", "/outputs/fields", Kind::value, "remembered", "viscous", "0.3"},
    {"design", "", Kind::key, "goal", "criterion", "0.3"},
    {"organ_experiments", "/materials/*", Kind::key, "hold", "fixed", "0.3"},
    {"sweep", "/outputs", Kind::value, "creep_depth_at_once", "instantaneous_creep_depth", "0.3",
     "/outputs/*/formula"},
    {"hil", "/limits", Kind::key, "hang", "cycle_timeout", "0.3"},
    {"hil", "/limits", Kind::key, "untrusted", "outside_validity", "0.3"},
    {"hil", "/start", Kind::key, "still", "at_rest", "0.3"},
    {"hil", "/motion", Kind::key, "relax_s", "initial_hold_s", "0.3"},
    {"hil", "/virtual_device", Kind::key, "limp_at", "arm_set_point", "0.3"},
}};

/// Where a file of one kind may have one of another within it.
struct Within {
  std::string_view schema, place, inner;
};

constexpr std::array<Within, 2> kWithin{{
    {"hil", "/model/scene", "scene"},
    {"sweep", "/scene", "scene"},
}};

/// Where a file has JSON pointers into one of another kind, as a value or as the keys of an object.
struct PointersInto {
  std::string_view schema, place, inner;
};

constexpr std::array<PointersInto, 3> kPointersInto{{
    {"sweep", "/axes/*/parameter", "scene"},
    {"sweep", "/axes/*/together", "scene"},
    {"sweep", "/axes/*/parameters", "scene"},
}};

using Visit = std::function<void(Json& part, const std::string& pointer)>;

/// Calls for each part of a document that a pointer names, in which * stands for any member.
void visit_parts(Json& part, std::string_view place, const std::string& pointer,
                 const Visit& visit) {
  if (place.empty()) return visit(part, pointer);
  const std::size_t end = std::min(place.find('/', 1), place.size());
  const std::string name(place.substr(1, end - 1));
  const std::string_view rest = place.substr(end);
  if (name == "*") {
    if (!part.is_structured()) return;
    for (auto& [key, member] : part.items()) {
      visit_parts(member, rest, fmt::format("{}/{}", pointer, printable(key)), visit);
    }
  } else if (part.is_object() && part.contains(name)) {
    visit_parts(part.at(name), rest, fmt::format("{}/{}", pointer, name), visit);
  }
}

bool is_of_identifier(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

/// A formula in which a variable has another name.
std::string with_variable(const std::string& formula, std::string_view former,
                          std::string_view current) {
  std::string text;
  for (std::size_t i = 0; i < formula.size();) {
    std::size_t end = i;
    while (end < formula.size() && is_of_identifier(formula[end])) ++end;
    if (end == i) {
      text += formula[i++];
      continue;
    }
    const std::string_view word = std::string_view(formula).substr(i, end - i);
    text += word == former ? current : word;
    i = end;
  }
  return text;
}

/// Takes the next part of a pointer off, "" where there is none.
std::string_view next_part(std::string_view& pointer) {
  if (pointer.empty()) return {};
  const std::size_t end = std::min(pointer.find('/', 1), pointer.size());
  const std::string_view part = pointer.substr(1, end - 1);
  pointer.remove_prefix(end);
  return part;
}

/// A pointer into a document of some kind, with the current name of each key.
/// @param until of the last one renamed
std::string with_current_keys(std::string pointer, std::string_view schema,
                              std::string_view& until) {
  for (const RenamedName& name : kRenamed) {
    if (name.schema != schema || name.kind != Kind::key || !pointer.starts_with('/')) continue;
    std::string_view place = name.place, rest = pointer;
    bool within = true;
    while (within && !place.empty()) {
      const std::string_view wanted = next_part(place), found = next_part(rest);
      within = wanted == found || (wanted == "*" && !found.empty());
    }
    const std::size_t begin = pointer.size() - rest.size();
    if (!within || next_part(rest) != name.former) continue;
    pointer.replace(begin + 1, name.former.size(), name.current);
    until = name.until;
  }
  return pointer;
}

Error beside_its_new_name(const std::string& place, std::string_view current) {
  return bad_input(place, fmt::format("stands beside its new name '{}'", current),
                   fmt::format("'{}' alone", current));
}

void tell_former(const std::string& what, std::string_view until, FormerNames former) {
  if (former == FormerNames::silent) return;
  warn(fmt::format("{}; the former name is read until version {}", what, until));
}

class Renaming {
 public:
  Renaming(const RenamedName& name, std::string_view where, FormerNames former)
      : name_(name), where_(where), former_(former) {}

  void apply(Json& document, const std::string& pointer) const {
    visit_parts(document, name_.place, pointer, [&](Json& part, const std::string& at) {
      const bool renamed = name_.kind == Kind::key ? rename_key(part, at) : rename_value(part, at);
      if (renamed && !name_.formulas.empty()) rename_variable(document);
    });
  }

 private:
  [[nodiscard]] bool rename_key(Json& part, const std::string& pointer) const {
    const std::string former(name_.former), current(name_.current);
    if (!part.is_object() || !part.contains(former)) return false;
    const std::string key = fmt::format("{}: key {}/{}", where_, pointer, former);
    if (part.contains(current)) throw both(key);
    Json renamed = Json::object();
    for (auto& [name, member] : part.items()) {
      renamed[name == former ? current : name] = std::move(member);
    }
    part = std::move(renamed);
    tell(fmt::format("{} is now called '{}'", key, current));
    return true;
  }

  [[nodiscard]] bool rename_value(Json& part, const std::string& pointer) const {
    if (!part.is_array()) return false;
    const auto at = std::find(part.begin(), part.end(), name_.former);
    if (at == part.end()) return false;
    const std::string value =
        fmt::format("{}: key {}/{}: '{}'", where_, pointer, at - part.begin(), name_.former);
    if (std::find(part.begin(), part.end(), name_.current) != part.end()) throw both(value);
    *at = name_.current;
    tell(fmt::format("{} is now called '{}'", value, name_.current));
    return true;
  }

  void rename_variable(Json& document) const {
    visit_parts(document, name_.formulas, "", [&](Json& formula, const std::string&) {
      if (!formula.is_string()) return;
      formula = with_variable(formula.get<std::string>(), name_.former, name_.current);
    });
  }

  [[nodiscard]] Error both(const std::string& place) const {
    return beside_its_new_name(place, name_.current);
  }

  void tell(const std::string& what) const { tell_former(what, name_.until, former_); }

  const RenamedName& name_;
  std::string_view where_;
  FormerNames former_;
};

/// The same for pointers to what was renamed: a text, or the keys of an object.
void rename_pointers(Json& part, std::string_view inner, std::string_view where,
                     const std::string& at, FormerNames former) {
  const auto current = [&](const std::string& pointer) {
    std::string_view until;
    std::string now = with_current_keys(pointer, inner, until);
    if (now == pointer) return now;
    const std::string place = fmt::format("{}: key {}: '{}'", where, at, printable(pointer));
    if (part.is_object() && part.contains(now)) throw beside_its_new_name(place, now);
    tell_former(fmt::format("{} is now called '{}'", place, printable(now)), until, former);
    return now;
  };
  if (part.is_string()) part = current(part.get<std::string>());
  if (!part.is_object()) return;
  Json renamed = Json::object();
  for (auto& [pointer, member] : part.items()) renamed[current(pointer)] = std::move(member);
  part = std::move(renamed);
}

void rename_within(Json& document, std::string_view schema, std::string_view where,
                   const std::string& pointer, FormerNames former) {
  for (const RenamedName& name : kRenamed) {
    if (name.schema == schema) Renaming(name, where, former).apply(document, pointer);
  }
  for (const Within& within : kWithin) {
    if (within.schema != schema) continue;
    visit_parts(document, within.place, pointer, [&](Json& part, const std::string& at) {
      rename_within(part, within.inner, where, at, former);
    });
  }
  for (const PointersInto& pointers : kPointersInto) {
    if (pointers.schema != schema) continue;
    visit_parts(document, pointers.place, pointer, [&](Json& part, const std::string& at) {
      rename_pointers(part, pointers.inner, where, at, former);
    });
  }
}

}  // namespace

std::span<const RenamedName> renamed_names() {
  return kRenamed;
}

Json with_current_names(Json document, std::string_view schema, std::string_view where,
                        FormerNames former) {
  rename_within(document, schema, where, "", former);
  return document;
}

Json checked(Json document, std::string_view schema, std::string_view where) {
  Json current = with_current_names(std::move(document), schema, where);
  check_schema(current, schema, where);
  if (current.is_object()) current.erase(kSchemaKey);
  return current;
}

}  // namespace tpm::files
