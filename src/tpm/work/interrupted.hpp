#pragma once
#include <stdexcept>

namespace tpm::work {

/// A computation that was asked to stop; says where it stands.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace tpm::work
