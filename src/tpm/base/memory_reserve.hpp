#pragma once
#include <cstddef>

namespace tpm::base {

/// Memory kept back for a library that does not survive a request that fails (it follows a null
/// pointer, or throws where it must not). While a reserve lives, the first request of its thread
/// that `operator new` cannot meet gives the reserve back to the system and is tried again, so
/// that the library comes to an end of its own; require_unused() then says that memory was short:
///
///     MemoryReserve reserve(bytes);
///     { ... the library ... }
///     reserve.require_unused();
///
/// Takes addresses only: a reserve that is never needed costs no memory. Reserves may stand within
/// each other.
class MemoryReserve {
 public:
  /// @param bytes what the library may need to come to its end
  /// Throws std::bad_alloc if there is not so much.
  explicit MemoryReserve(std::size_t bytes);
  ~MemoryReserve();
  MemoryReserve(const MemoryReserve&) = delete;
  MemoryReserve& operator=(const MemoryReserve&) = delete;

  /// Throws std::bad_alloc if the reserve had to be given back.
  void require_unused() const;

 private:
  static void give_back();

  void* bytes_;
  MemoryReserve* outer_;
};

}  // namespace tpm::base
