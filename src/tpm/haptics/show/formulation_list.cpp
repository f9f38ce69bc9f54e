#include "tpm/haptics/show/formulation_list.hpp"
#include "tpm/organ/steps/study_only.hpp"

#include <fmt/format.h>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/haptics/session/loop_maker.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpm/organ/steps/study_only.hpp"
#include "tpmkit/elongation_function.hpp"
#include "tpmkit/model.hpp"
#include "tpmkit/units.hpp"

namespace tpm::haptics {
namespace {

/// Whom a formulation answers: fits, scenes, sessions.
std::vector<std::string> users_of(const Formulation& f) {
  std::vector<std::string> users;
  if (f.as<ModelMaker>() != nullptr) users.emplace_back("fits");
  if (f.as<SceneRunner>() != nullptr) users.emplace_back("scenes");
  if (f.as<StateRunner>() != nullptr) users.emplace_back("checkpoints");
  if (f.can().planned) users.emplace_back("plans");
  if (for_sessions(f)) users.emplace_back("sessions");
  return users;
}

std::vector<std::string> words_of(const Capabilities& can) {
  std::vector<std::string> words;
  for (const CapabilityEntry& entry : kCapabilities) {
    if (can.*entry.meaning) words.emplace_back(entry.text);
  }
  return words;
}

/// A servo's kernels step the shape, whatever the values of its parameters: tried at 1 of each.
bool runs_at_servo_rate(const ElongationShape& shape) {
  ShapeValues ones;
  ones.fill(1.0);
  return shape.cubic_per_m2(ones).has_value();
}

}  // namespace

Json formulations_json() {
  return array_json(linked_formulations(), [](const Formulation* f) {
    return Json{{"name", f->name()},         {"meaning", f->meaning()},
                {"can", words_of(f->can())}, {"for", users_of(*f)},
                {"keys", f->keys()},         {"study_only", is_study_only(f->name())}};
  });
}

Json shapes_json() {
  Json list = Json::array();
  for (const ElongationShape* shape : elongation_shapes()) {
    Json parameters = array_json(shape->parameters(), [](const MaterialParameter& p) {
      return Json{{"name", p.name},
                  {"unit", si_symbol(p.dimension)},
                  {"range", range_of(p)},
                  {"meaning", p.meaning}};
    });
    list.push_back({{"name", shape->name()},
                    {"meaning", shape->meaning()},
                    {"parameters", std::move(parameters)},
                    {"servo", runs_at_servo_rate(*shape)}});
  }
  return list;
}

std::string shapes_text() {
  std::string text;
  for (const ElongationShape* shape : elongation_shapes()) {
    text += fmt::format("{:<12} {}\n", shape->name(), shape->meaning());
    for (const MaterialParameter& p : shape->parameters()) {
      const std::string_view symbol = si_symbol(p.dimension);
      text += fmt::format("{:<12} {}: {}{}{}, {}\n", "", p.name, p.meaning,
                          symbol.empty() ? "" : ", ", symbol, range_of(p));
    }
    text +=
        fmt::format("{:<12} at servo rate: {}\n", "", runs_at_servo_rate(*shape) ? "yes" : "no");
  }
  return text;
}

std::string formulations_text() {
  std::string text;
  for (const Formulation* f : linked_formulations()) {
    text += fmt::format("{:<20} {}\n{:<20} can: {}\n{:<20} for: {}\n", f->name(), f->meaning(), "",
                        fmt::join(words_of(f->can()), ", "), "", fmt::join(users_of(*f), ", "));
    if (is_study_only(f->name())) {
      text += fmt::format("{:<20} study only: no scene should choose it\n", "");
    }
    if (!f->keys().empty())
      text += fmt::format("{:<20} keys: {}\n", "", fmt::join(f->keys(), ", "));
  }
  return text;
}

}  // namespace tpm::haptics
