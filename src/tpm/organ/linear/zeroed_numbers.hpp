#pragma once
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

namespace tpm::organ {

/// Numbers that are 0 at first. Unlike a vector it does not write them: large memory that the
/// system hands out is 0, and is not touched before it is used.
class ZeroedNumbers {
 public:
  /// Throws std::bad_alloc.
  explicit ZeroedNumbers(std::size_t size)
      : numbers_(static_cast<double*>(std::calloc(size + 1, sizeof(double)))) {
    if (!numbers_) throw std::bad_alloc();
  }
  [[nodiscard]] double* data() { return numbers_.get(); }
  [[nodiscard]] const double* data() const { return numbers_.get(); }

 private:
  struct Free {
    void operator()(double* numbers) const { std::free(numbers); }
  };
  std::unique_ptr<double[], Free> numbers_;
};

}  // namespace tpm::organ
