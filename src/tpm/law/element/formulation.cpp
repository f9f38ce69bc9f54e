#include "tpmkit/formulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "tpm/base/nearest_word.hpp"
#include "tpmkit/error.hpp"

namespace tpm {

// Whoever knows all formulations stands above this room: the reference is weak, so that this room
// is linked without them.
[[gnu::weak]] Formulations formulations();

Formulations linked_formulations() {
  if (&formulations == nullptr) {
    throw std::logic_error(
        "no list of formulations is linked; expected the component plan or haptics of tpmkit, or a "
        "definition of tpm::formulations()");
  }
  return formulations();
}

bool Formulation::takes(std::string_view key) const {
  return std::find(entry_.keys.begin(), entry_.keys.end(), key) != entry_.keys.end();
}

std::vector<const Formulation*> joined(std::initializer_list<Formulations> lists) {
  std::vector<const Formulation*> all;
  for (const Formulations& list : lists) all.insert(all.end(), list.begin(), list.end());
  std::sort(all.begin(), all.end(), [](const Formulation* a, const Formulation* b) {
    return a->rank() != b->rank() ? a->rank() < b->rank() : a->name() < b->name();
  });
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (all[i]->name() != all[k]->name()) continue;
      throw std::logic_error(fmt::format("two formulations are called '{}'", all[i]->name()));
    }
  }
  return all;
}

const Formulation* find_formulation(std::string_view name) {
  const Formulations all = linked_formulations();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Formulation* f) {
    return f->name() == name || (!name.empty() && f->also() == name);
  });
  return found == all.end() ? nullptr : *found;
}

void refuse_formulation(std::string_view name, std::string_view noun, std::string_view where,
                        const std::string& able) {
  std::vector<std::string> names;
  for (std::size_t begin = 0; begin < able.size();) {
    const std::size_t end = std::min(able.find(", ", begin), able.size());
    names.push_back(able.substr(begin, end - begin));
    begin = end + 2;
  }
  throw base::unknown_word(where, fmt::format("unknown {}", noun), name, names);
}

std::string_view words_of(bool Capabilities::*capability) {
  return std::find_if(kCapabilities.begin(), kCapabilities.end(),
                      [&](const CapabilityEntry& e) { return e.meaning == capability; })
      ->words;
}

void refuse_capability(const Formulation& f, bool Capabilities::*capability, std::string_view where,
                       const std::string& able) {
  throw bad_input(where,
                  fmt::format("'{}' is no formulation that {}", f.name(), words_of(capability)),
                  fmt::format("one of {}", able));
}

}  // namespace tpm
