#include "tpm/base/point_set.hpp"

#include <algorithm>
#include <bit>
#include <boost/random/sobol.hpp>
#include <string>
#include <vector>

#include "tpmkit/error.hpp"

namespace tpm::base {
namespace {

constexpr int kDigits = 32;
constexpr int kLargestDimensions = 3667;  // of Boost's table
constexpr double kTwoToMinus32 = 1.0 / 4294967296.0;
constexpr double kTwoToMinus53 = 1.0 / 9007199254740992.0;

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): every bit of the argument moves about
/// half of the bits of the result.
std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

std::uint64_t keyed(std::uint64_t key, std::uint64_t number) {
  return mixed(key + 0x9e3779b97f4a7c15ULL * (number + 1));
}

double uniform(std::uint64_t bits) {
  return kTwoToMinus53 * static_cast<double>(bits >> 11);
}

class RandomPoints final : public CubePoints {
 public:
  explicit RandomPoints(std::uint64_t seed) : key_(mixed(seed + 1)) {}
  double coordinate(std::uint64_t point, int dimension) const override {
    return uniform(keyed(keyed(key_, static_cast<std::uint64_t>(dimension)), point));
  }

 private:
  std::uint64_t key_;
};

class LatinHypercube final : public CubePoints {
 public:
  LatinHypercube(std::uint64_t count, std::uint64_t seed)
      : count_(count),
        half_bits_(std::max(1, (static_cast<int>(std::bit_width(count - 1)) + 1) / 2)),
        key_(mixed(seed + 2)) {}

  double coordinate(std::uint64_t point, int dimension) const override {
    const std::uint64_t key = keyed(key_, static_cast<std::uint64_t>(dimension));
    const double place = uniform(keyed(mixed(key), point));
    const double x =
        (static_cast<double>(permuted(point, key)) + place) / static_cast<double>(count_);
    return std::min(x, 1.0 - kTwoToMinus53);
  }

 private:
  /// A permutation of 0 .. count-1 by a Feistel network over the next power of four; what falls
  /// outside goes through it again.
  std::uint64_t permuted(std::uint64_t number, std::uint64_t key) const {
    constexpr int kRounds = 6;
    const std::uint64_t mask = (std::uint64_t{1} << half_bits_) - 1;
    do {
      std::uint64_t left = number >> half_bits_;
      std::uint64_t right = number & mask;
      for (std::uint64_t round = 0; round < kRounds; ++round) {
        const std::uint64_t next = left ^ (keyed(key + round, right) & mask);
        left = right;
        right = next;
      }
      number = (left << half_bits_) | right;
    } while (number >= count_);
    return number;
  }

  std::uint64_t count_;
  int half_bits_;
  std::uint64_t key_;
};

/// Direction numbers, those of dimension j at j * 32 .. j * 32 + 31. Boost's engine gives points
/// only; the point whose Gray code has one bit is the direction number of that bit.
std::vector<std::uint32_t> direction_numbers(int dimensions) {
  if (dimensions < 1 || dimensions > kLargestDimensions)
    throw bad_input("a Sobol sequence", "has " + std::to_string(dimensions) + " dimensions",
                    "1 to " + std::to_string(kLargestDimensions));
  const auto count = static_cast<std::size_t>(dimensions);
  boost::random::sobol_engine<std::uint32_t, kDigits> engine(count);
  std::vector<std::uint32_t> directions(count * kDigits);
  for (std::size_t bit = 0; bit < kDigits; ++bit) {
    // The engine begins with the second point of the sequence, which it calls 0.
    engine.seed(static_cast<std::uint32_t>((std::uint64_t{2} << bit) - 2));
    for (std::size_t j = 0; j < count; ++j) directions[j * kDigits + bit] = engine();
  }
  return directions;
}

std::uint32_t net_digits(const std::vector<std::uint32_t>& directions, std::uint64_t point,
                         int dimension) {
  const std::uint32_t* of_dimension =
      directions.data() + static_cast<std::size_t>(dimension) * kDigits;
  std::uint32_t digits = 0;
  for (std::uint64_t code = point ^ (point >> 1); code != 0; code &= code - 1)
    digits ^= of_dimension[std::countr_zero(code)];
  return digits;
}

class PlainSobol final : public CubePoints {
 public:
  explicit PlainSobol(int dimensions) : directions_(direction_numbers(dimensions)) {}
  double coordinate(std::uint64_t point, int dimension) const override {
    return kTwoToMinus32 * net_digits(directions_, point, dimension);
  }

 private:
  std::vector<std::uint32_t> directions_;
};

class ScrambledSobol final : public CubePoints {
 public:
  ScrambledSobol(int dimensions, std::uint64_t seed)
      : directions_(direction_numbers(dimensions)), key_(mixed(seed + 3)) {}

  double coordinate(std::uint64_t point, int dimension) const override {
    const std::uint32_t digits = net_digits(directions_, point, dimension);
    const std::uint64_t key = keyed(key_, static_cast<std::uint64_t>(dimension));
    // Each digit is flipped or not by a coin of its own for each value of the digits before it. A
    // leading 1 makes the digits before it, and how many they are, one number.
    std::uint64_t flips = 0;
    for (int i = 0; i < kDigits; ++i) {
      const std::uint64_t before =
          (std::uint64_t{1} << i) | (std::uint64_t{digits} >> (kDigits - i));
      flips = (flips << 1) | (keyed(key, before) >> 63);
    }
    const auto scrambled = digits ^ static_cast<std::uint32_t>(flips);
    // Below the net's digits: as random as in the sequence's limit.
    const double below = uniform(keyed(mixed(key), digits));
    return std::min(kTwoToMinus32 * (scrambled + below), 1.0 - kTwoToMinus53);
  }

 private:
  std::vector<std::uint32_t> directions_;
  std::uint64_t key_;
};

}  // namespace

std::unique_ptr<CubePoints> random_points(std::uint64_t seed) {
  return std::make_unique<RandomPoints>(seed);
}

std::unique_ptr<CubePoints> latin_hypercube(std::uint64_t count, std::uint64_t seed) {
  if (count == 0) throw bad_input("a Latin hypercube", "has no points", "1 or more");
  return std::make_unique<LatinHypercube>(count, seed);
}

std::unique_ptr<CubePoints> plain_sobol_points(int dimensions) {
  return std::make_unique<PlainSobol>(dimensions);
}

std::unique_ptr<CubePoints> sobol_points(int dimensions, std::uint64_t seed) {
  return std::make_unique<ScrambledSobol>(dimensions, seed);
}

}  // namespace tpm::base
