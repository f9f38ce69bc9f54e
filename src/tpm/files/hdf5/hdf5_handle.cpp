// Declared in tpm/files/hdf5/hdf5.hpp.
#include <utility>

#include "tpm/files/hdf5/hdf5.hpp"

namespace tpm::files {

Hdf5Handle::Hdf5Handle(Hdf5Handle&& other) noexcept
    : id_(std::exchange(other.id_, -1)), closer_(other.closer_) {}

Hdf5Handle& Hdf5Handle::operator=(Hdf5Handle&& other) noexcept {
  if (this != &other) {
    reset();
    id_ = std::exchange(other.id_, -1);
    closer_ = other.closer_;
  }
  return *this;
}

void Hdf5Handle::reset() noexcept {
  if (valid() && closer_ != nullptr) closer_(id_);
  id_ = -1;
}

}  // namespace tpm::files
