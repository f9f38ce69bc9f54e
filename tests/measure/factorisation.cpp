// What one factorisation of a liver's stiffness takes, its parts apart, and the matrix for other
// solvers:
//
//     measure_factorisation KIND COUNT [MATRIX_FILE]
//
// KIND is shell (two layers) or solid; the far side, 60 mm deep, is held. Prints one line of JSON,
// processor times in s, and the time that a factorisation took on all processors. The file: int64
// n, int64 entries; then int32 row and column and double value of each entry of the lower triangle,
// free coordinates alone, by columns. The same source measures earlier versions, which factorised
// held spheres along.
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <string>
#include <vector>

#include "tpm/base/random.hpp"
#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/body/liver_surface.hpp"
#include "tpm/organ/bonds/constraints.hpp"
#include "tpm/organ/linear/lane_factor.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"
#if __has_include("tpm/network/indentation.hpp")
#include "tpm/network/indentation.hpp"
#else
#include "indentation.hpp"
#endif
#if __has_include("tpm/organ/bonds/stiffness_blocks.hpp")
#include "tpm/organ/bonds/stiffness_blocks.hpp"
#else
namespace tpm {
namespace organ {}
/// The whole stiffness matrix.
class StiffnessBlocks {
 public:
  StiffnessBlocks(const BondSystem& bonds, const Constraints& constraints)
      : bonds_(bonds), constraints_(constraints), matrix_(bonds.pattern()) {}
  const BlockMatrix& assemble(const Positions& position, const ViscousState& viscous_state) {
    matrix_.set_zero();
    bonds_.add_stiffness(position, viscous_state, matrix_);
    constraints_.constrain(bonds_, matrix_);
    return matrix_;
  }
  [[nodiscard]] const BlockPattern& pattern() const { return bonds_.pattern(); }

 private:
  const BondSystem& bonds_;
  const Constraints& constraints_;
  BlockMatrix matrix_;
};
}  // namespace tpm
#endif

using namespace tpm;
using namespace tpm::organ;

namespace {

double lap() {
  static std::clock_t last = std::clock();
  const std::clock_t now = std::clock();
  const double taken = static_cast<double>(now - last) / CLOCKS_PER_SEC;
  last = now;
  return taken;
}

double peak_GiB() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1048576.0;
}

/// The size of the paper's liver.
Organ organ_of(const std::string& kind, std::size_t count) {
  const LiverShape shape =
      scaled(LiverShape{}, 0.020 / even_spacing(liver_surface(LiverShape{}), 212));
  if (kind == "shell") {
    LiverRequest request;
    request.count = count;
    request.spacing.reset();
    request.shape = shape;
    return fill_liver(request);
  }
  SolidRequest request;
  request.count = count;
  return fill_solid(liver_surface(shape), request);
}

/// Free coordinates are numbered in the order of the spheres.
void write_matrix(const BondSystem& bonds, const Constraints& constraints, const Positions& rest,
                  const ViscousState& viscous_state, const char* path) {
  std::vector<std::int32_t> number(constraints.size(), -1);
  std::int32_t free = 0;
  for (std::size_t i = 0; i < constraints.size(); ++i) {
    if (!constraints.is_free(i)) continue;
    number[i] = free;
    free += 3;
  }
  struct Entry {
    std::int32_t row, column;
    double value;
  };
  std::vector<Entry> entries;
  const auto add = [&](std::int32_t row, std::int32_t column, const Eigen::Matrix3d& block) {
    for (std::int32_t j = 0; j < 3; ++j) {
      for (std::int32_t i = 0; i < 3; ++i) {
        if (row + i >= column + j) entries.push_back({row + i, column + j, block(i, j)});
      }
    }
  };
  std::vector<Eigen::Matrix3d> diagonal(constraints.size(), Eigen::Matrix3d::Zero());
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    const Eigen::Matrix3d block = bonds.stiffness_block(i, rest, viscous_state);
    diagonal[bonds.end_a()[i]] += block;
    diagonal[bonds.end_b()[i]] += block;
    const std::int32_t a = number[bonds.end_a()[i]];
    const std::int32_t b = number[bonds.end_b()[i]];
    if (a >= 0 && b >= 0) add(std::max(a, b), std::min(a, b), -block);
  }
  for (std::size_t i = 0; i < constraints.size(); ++i) {
    if (number[i] >= 0) add(number[i], number[i], diagonal[i]);
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& x, const Entry& y) {
    return x.column != y.column ? x.column < y.column : x.row < y.row;
  });
  std::FILE* file = std::fopen(path, "wb");
  if (file == nullptr) throw Error(ExitCode::environment, path, "cannot be written");
  const std::int64_t sizes[2] = {free, static_cast<std::int64_t>(entries.size())};
  bool whole = std::fwrite(sizes, sizeof sizes, 1, file) == 1;
  for (const Entry& e : entries) {
    whole = whole && std::fwrite(&e.row, 4, 1, file) == 1 &&
            std::fwrite(&e.column, 4, 1, file) == 1 && std::fwrite(&e.value, 8, 1, file) == 1;
  }
  if (std::fclose(file) != 0 || !whole)
    throw Error(ExitCode::environment, path, "cannot be written");
}

void measure(const std::string& kind, std::size_t count, const char* matrix_file) {
  (void)lap();
  Organ organ = organ_of(kind, count);
  const double fill_s = lap();
  NetworkOptions options;
  options.spacing_law = SpacingLaw::continuum;
  const Network network = build_network(std::move(organ), options, "measure");
  const double join_s = lap();
  const BondSystem bonds(network, TpmParameters{});
  Constraints constraints(network.organ.size());
  for (const std::size_t i : far_side(network.organ, Eigen::Vector3d::UnitZ(), 0.060)) {
    constraints.fix(i);
  }
  (void)lap();
  StiffnessBlocks blocks(bonds, constraints);
  const BlockPattern& pattern = blocks.pattern();
  const double order_s = lap();
  const ViscousState viscous_state{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())),
                                   0.0};
  BlockLdlt factor(pattern);
  (void)lap();
  const BlockMatrix& matrix = blocks.assemble(network.organ.position, viscous_state);
  const double assemble_s = lap();
  if (matrix_file != nullptr) {
    write_matrix(bonds, constraints, network.organ.position, viscous_state, matrix_file);
  }
  (void)lap();
  const bool done = factor.factorise(matrix);
  const double first_s = lap();  // with what the system takes to hand out memory
  const int again = first_s < 1.0 ? 5 : 1;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < again; ++i) (void)factor.factorise(matrix);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
  const double factorise_s = lap() / again;
  Eigen::Matrix3Xd x(3, network.organ.position.cols());
  Random random(1);
  for (double& value : x.reshaped()) value = random.normal();
  constraints.project(x);
  const Eigen::Matrix3Xd right = x;
  (void)lap();
  for (int i = 0; i < again; ++i) {
    x = right;
    factor.solve(x);
  }
  const double solve_s = lap() / again;
  // What is left of the forces, in parts.
  Eigen::Matrix3Xd left = Eigen::Matrix3Xd::Zero(3, x.cols());
  constraints.project(x);
  bonds.add_stiffness_times(network.organ.position, viscous_state, x, left);
  constraints.project(left);
  const double residual = (left - right).norm() / right.norm();
  LaneFactor lanes(pattern);
  (void)lap();
  lanes.copy(factor);
  const double copy_s = lap();
  LaneMatrix side = right.reshaped().transpose().replicate<kLanes, 1>();
  (void)lap();
  for (int i = 0; i < again; ++i) lanes.solve(side);
  const double lanes_s = lap() / again;
  fmt::print(
      "{{\"kind\": \"{}\", \"spheres\": {}, \"bonds\": {}, \"free\": {}, \"fill_s\": {:.4g}, "
      "\"join_s\": {:.4g}, \"order_s\": {:.4g}, \"assemble_s\": {:.4g}, \"factorise_first_s\": "
      "{:.4g}, \"factorise_s\": {:.4g}, \"factorise_elapsed_s\": {:.4g}, \"solve_s\": {:.4g}, "
      "\"lane_copy_s\": {:.4g}, "
      "\"lanes_s\": {:.4g}, \"factor_entries\": {:.5g}, \"operations\": {:.5g}, \"residual\": "
      "{:.2g}, \"definite\": {}, \"peak_GiB\": {:.4g}}}\n",
      kind, network.organ.size(), bonds.size(), constraints.count(), fill_s, join_s, order_s,
      assemble_s, first_s, factorise_s, elapsed.count() / again, solve_s, copy_s, lanes_s,
      9.0 * static_cast<double>(pattern.factor_blocks()),
      54.0 * static_cast<double>(pattern.factor_products()), residual,
      done && factor.negative_count() == 0, peak_GiB());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 4) {
    fmt::print(stderr, "measure_factorisation KIND COUNT [MATRIX_FILE]\n");
    return 2;
  }
  try {
    measure(argv[1], std::strtoul(argv[2], nullptr, 10), argc > 3 ? argv[3] : nullptr);
    return 0;
  } catch (const Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return static_cast<int>(error.code());
  }
}
