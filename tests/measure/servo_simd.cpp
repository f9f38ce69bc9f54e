// Prints the numbers of reports/haptics/report.md, "Vectors by hand and by a library": one sweep of
// the servo's bonds (ServoBonds::advance, AVX2 by hand) beside the same arithmetic written once
// over a vector type, with intrinsics, xsimd or highway underneath:
//     measure_servo_simd SCENE ROUNDS
// Built without AVX2, or without one of the libraries (libxsimd-dev, libhwy-dev), it leaves those
// rows out.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "program.hpp"
#include "servo_kernels.hpp"
#include "tpm/contact/servo_bonds.hpp"
#include "tpm/organ/linear/aligned_floats.hpp"
#include "tpm/organ/scene/scene.hpp"

using namespace tpm;
using namespace tpm::contact;

namespace {

constexpr std::size_t kWide = test::ServoLanes::kWide;

struct Setup {
  test::ServoSweep sweep;
  ServoWeights weights;
  std::vector<ServoBonds::Choice> chosen;
  std::size_t spheres = 0;
};

Setup setup_of(const BondSystem& bonds, const Positions& rest, double period_s) {
  Setup setup{{}, servo_weights(bonds, period_s), {}, static_cast<std::size_t>(rest.cols())};
  setup.sweep.keep = setup.weights.keep;
  setup.sweep.of_start = setup.weights.of_start;
  setup.sweep.of_end = setup.weights.of_end;
  for (std::size_t i = 0; i + kWide <= bonds.first_contact(); ++i) {
    const auto a = static_cast<std::uint32_t>(bonds.end_a()[i]);
    const auto b = static_cast<std::uint32_t>(bonds.end_b()[i]);
    setup.chosen.push_back({i, a, b});
  }
  setup.chosen.resize(setup.chosen.size() / kWide * kWide);
  setup.sweep.groups.resize(setup.chosen.size() / kWide);
  for (std::size_t n = 0; n < setup.chosen.size(); ++n) {
    test::ServoLanes& lanes = setup.sweep.groups[n / kWide];
    const std::size_t i = n % kWide;
    const auto [bond, a, b] = setup.chosen[n];
    const auto row = static_cast<Eigen::Index>(bond);
    const Eigen::Vector3f apart = (rest.col(b) - rest.col(a)).cast<float>();
    lanes.a[i] = 4 * a;
    lanes.b[i] = 4 * b;
    lanes.x[i] = apart.x();
    lanes.y[i] = apart.y();
    lanes.z[i] = apart.z();
    lanes.rest[i] = static_cast<float>(bonds.rest_length_m()[row]);
    lanes.k[i] = static_cast<float>(bonds.stiffness()[row]);
    lanes.g[i] = static_cast<float>(bonds.relaxing()[row]);
    lanes.least[i] = bonds.is_rope(bond) ? 0.0F : -std::numeric_limits<float>::infinity();
    lanes.offset = {};
  }
  return setup;
}

struct Way {
  std::string name;
  std::function<void(const float* u, float* force)> advance;
  std::vector<double> took_ns;
  AlignedFloats force;
};

void measure(const std::string& file, int rounds) {
  constexpr double kPeriod_s = 1e-3;
  constexpr int kSweeps = 50;
  const Tissue tissue = read_tissue(file);
  const BondSystem bonds = tissue.bonds();
  const Positions& rest = tissue.network.organ.position;
  const Setup setup = setup_of(bonds, rest, kPeriod_s);
  AlignedFloats u(4 * (setup.spheres + 1), 0.0F);
  for (std::size_t i = 0; i < 4 * setup.spheres; ++i) {
    u[i] = i % 4 == 3 ? 0.0F : 1e-4F * std::sin(static_cast<float>(7 * i));
  }
  ServoBonds production(bonds, rest, setup.chosen, static_cast<std::uint32_t>(setup.spheres));
  ServoBonds portable(bonds, rest, setup.chosen, static_cast<std::uint32_t>(setup.spheres), true);
  std::vector<Way> ways;
  const auto add = [&](std::string name, std::function<void(const float*, float*)> advance) {
    ways.push_back(
        {std::move(name), std::move(advance), {}, AlignedFloats(8 * (setup.spheres + 1), 0.0F)});
  };
  add("ServoBonds, AVX2 by hand",
      [&](const float* at, float* force) { production.advance(at, setup.weights, force); });
  add("ServoBonds, portable",
      [&](const float* at, float* force) { portable.advance(at, setup.weights, force); });
  for (const test::ServoKernel& kernel : test::servo_kernels()) {
    add(fmt::format("one kernel over {}", kernel.name),
        [s = setup.sweep, kernel](const float* at, float* f) mutable { kernel.advance(s, at, f); });
  }
  for (int round = 0; round < rounds; ++round) {
    for (Way& way : ways) {
      const auto start = std::chrono::steady_clock::now();
      for (int i = 0; i < kSweeps; ++i) {
        std::fill(way.force.begin(), way.force.end(), 0.0F);
        way.advance(u.data(), way.force.data());
      }
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      way.took_ns.push_back(1e9 * took.count() / kSweeps /
                            static_cast<double>(setup.chosen.size()));
    }
  }
  const Way& first = ways.front();
  fmt::print(
      "{} bonds, {} rounds in turn\n\n| | ns a bond, median | ratio to the first, median | "
      "least | largest difference of a force, of the largest |\n| --- | ---: | ---: | ---: | "
      "---: |\n",
      setup.chosen.size(), rounds);
  for (const Way& way : ways) {
    std::vector<double> ratio, took = way.took_ns;
    for (std::size_t i = 0; i < took.size(); ++i) ratio.push_back(took[i] / first.took_ns[i]);
    std::ranges::sort(took);
    std::ranges::sort(ratio);
    float largest = 0.0F, apart = 0.0F, of_kernel = 0.0F;
    const Way& kernel = ways[std::min<std::size_t>(2, ways.size() - 1)];
    for (std::size_t i = 0; i < 8 * setup.spheres; ++i) {
      if (i % 4 == 3) continue;
      largest = std::max(largest, std::abs(first.force[i]));
      apart = std::max(apart, std::abs(way.force[i] - first.force[i]));
      of_kernel = std::max(of_kernel, std::abs(way.force[i] - kernel.force[i]));
    }
    fmt::print(
        "| {} | {:.3f} | {:.3f} | {:.3f} | {:.1e} (from the kernel over intrinsics {:.1e}) |\n",
        way.name, took[took.size() / 2], ratio[ratio.size() / 2], took.front(),
        static_cast<double>(apart / largest), static_cast<double>(of_kernel / largest));
  }
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(
      argc, argv, 2, 2, "usage: measure_servo_simd SCENE ROUNDS",
      [](const std::vector<std::string>& words) { measure(words[0], std::stoi(words[1])); });
}
