#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tpm::test {

/// Eight bonds side by side, as ServoBonds keeps them.
struct alignas(32) ServoLanes {
  static constexpr std::size_t kWide = 8;
  using Lane = std::array<float, kWide>;
  Lane x, y, z, rest, k, g, least;
  std::array<Lane, 2> offset;
  std::array<std::uint32_t, kWide> a, b;
};

/// Linear bonds with one branch, and the weights of a period.
struct ServoSweep {
  std::vector<ServoLanes> groups;
  float keep = 0.0F, of_start = 0.0F, of_end = 0.0F;
};

/// The work of ServoBonds::advance() on such bonds, by one kernel over a vector type.
struct ServoKernel {
  const char* name;
  void (*advance)(ServoSweep& sweep, const float* u, float* force);
};

/// Over intrinsics first, then over those libraries of xsimd and highway that were there.
/// Empty where the compiler makes no AVX2.
std::vector<ServoKernel> servo_kernels();

}  // namespace tpm::test
