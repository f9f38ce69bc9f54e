#pragma once
#include <cstdint>
#include <random>

namespace tpm::base {

/// Random numbers that are the same on every machine for the same seed: the distributions of the
/// standard library may differ between implementations, its generators do not. 0 is a valid seed.
class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}

  /// Uniform in [0, 1), 53 bits.
  [[nodiscard]] double uniform();
  /// Standard normal (Box-Muller).
  [[nodiscard]] double normal();
  /// Uniform in 0 .. n-1, n > 0.
  [[nodiscard]] std::size_t below(std::size_t n);

 private:
  std::mt19937_64 generator_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace tpm::base
