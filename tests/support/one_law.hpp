#pragma once
// The fit of one law to one recording, as tpm fit --laws NAME makes it.
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

/// The choice with this law alone; nothing is held out.
inline fit::Selection select_one(const std::string& law, const fit::PreparedRecording& recording,
                                 fit::SetupOptions setup = {}) {
  fit::SelectionOptions options;
  options.laws = {parse_law_name(law, "test")};
  options.only_listed = true;
  options.held_out = false;
  options.setup = std::move(setup);
  return fit::select_law(std::span(&recording, 1), options);
}

}  // namespace tpm::test
