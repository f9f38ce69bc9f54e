#pragma once
#include <string>
#include <utility>

#include "tpmkit/error.hpp"

namespace tpm::test {

/// The message of the Error that the action throws; "" if it throws none.
template <class Action>
std::string refusal_of(Action&& action) {
  try {
    std::forward<Action>(action)();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace tpm::test
