#pragma once
#include <cstdint>
#include <memory>

namespace tpm::base {

/// Points in the unit cube. Every coordinate can be asked for by itself and in any order, so that
/// any number of workers share one set of points and it never stands in memory.
class CubePoints {
 public:
  CubePoints() = default;
  CubePoints(const CubePoints&) = delete;
  CubePoints& operator=(const CubePoints&) = delete;
  virtual ~CubePoints() = default;

  /// In [0, 1). `point` and `dimension` count from 0; both within what the set was made for.
  [[nodiscard]] virtual double coordinate(std::uint64_t point, int dimension) const = 0;
};

/// Independent uniform points; 0 is a valid seed.
[[nodiscard]] std::unique_ptr<CubePoints> random_points(std::uint64_t seed);

/// `count` >= 1 points; along every dimension each of `count` equal intervals holds exactly one of
/// them, at a random place (McKay, Beckman and Conover 1979).
[[nodiscard]] std::unique_ptr<CubePoints> latin_hypercube(std::uint64_t count, std::uint64_t seed);

/// The Sobol sequence with Boost's direction numbers (Joe and Kuo 2008) in the order of the Gray
/// code, from its first point 0. Throws Error unless 1 <= dimensions <= 3667; 2^32 points.
[[nodiscard]] std::unique_ptr<CubePoints> plain_sobol_points(int dimensions);

/// The same with Owen's nested uniform scrambling of its 32 digits (Owen 1995): every point
/// uniform, the even filling of the cube kept, and sets of different seeds independent.
[[nodiscard]] std::unique_ptr<CubePoints> sobol_points(int dimensions, std::uint64_t seed);

}  // namespace tpm::base
