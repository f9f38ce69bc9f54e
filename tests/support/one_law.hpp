#pragma once
// The fit of few laws, as tpm fit --laws NAME makes it.
#include <initializer_list>
#include <span>
#include <string>
#include <utility>

#include "tpm/fit/select/selection.hpp"

namespace tpm::test {

/// @param starts of the search
inline fit::SetupOptions setup_of(std::size_t starts, bool profiles) {
  fit::SetupOptions setup;
  setup.starts = starts;
  setup.profiles = profiles;
  return setup;
}

/// A choice among these laws alone.
inline fit::SelectionOptions only(std::initializer_list<const char*> laws) {
  fit::SelectionOptions options;
  for (const char* law : laws) options.laws.push_back(parse_law_name(law, "test"));
  options.only_listed = true;
  return options;
}

/// The choice with this law alone; nothing is held out.
inline fit::Selection select_one(const std::string& law, const fit::PreparedRecording& recording,
                                 fit::SetupOptions setup = {}) {
  fit::SelectionOptions options = only({law.c_str()});
  options.held_out = false;
  options.setup = std::move(setup);
  return fit::select_law(std::span(&recording, 1), options);
}

}  // namespace tpm::test
