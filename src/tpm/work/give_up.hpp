#pragma once
#include <string>

#include "tpmkit/error.hpp"

namespace tpm::work {

/// Does some work. Returns what is said where a solver gave up (Error(numerical)), which is not an
/// error for everybody; empty if the work was done. Other errors pass.
template <class Work>
std::string gave_up(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    if (error.code() != ExitCode::numerical) throw;
    return error.what();
  }
  return {};
}

}  // namespace tpm::work
