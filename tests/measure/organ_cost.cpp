// Prints the table of reports/networks: processor time of an organ, from its surface to a run, s,
// each the least of five.
//     build/release/tests/measure_organ_cost KIND COUNT [run]
// KIND is shell (two layers) or a lattice of a solid. Beside filling and joining, ten evaluations
// of all forces and stiffnesses; with the third word a ramp over a fifth of a spacing, and a hold.
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <string>
#include <vector>

#include "program.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/liver_surface.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;

namespace {

template <class Work>
double least_of_five_s(Work&& work) {
  constexpr int kTimes = 5;
  double least = 1e9;
  for (int i = 0; i < kTimes; ++i) {
    const std::clock_t begin = std::clock();
    work();
    least = std::min(least, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  return least;
}

Organ filled(const Surface& surface, const std::string& kind, std::size_t count) {
  if (kind == "shell") {
    ShellRequest request;
    request.count = count;
    return fill_shell(surface, request);
  }
  SolidRequest request;
  request.count = count;
  request.lattice = parse_word(kLatticeWords, "lattice", kind, "KIND");
  return fill_solid(surface, request);
}

/// Beyond 60 % of the extent along z nothing moves.
Constraints held_far_side(const Positions& rest) {
  Constraints constraints(static_cast<std::size_t>(rest.cols()));
  const Eigen::RowVectorXd z = rest.row(2);
  const double limit = z.minCoeff() + 0.6 * (z.maxCoeff() - z.minCoeff());
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    if (z[i] > limit) constraints.fix(static_cast<std::size_t>(i));
  }
  return constraints;
}

void measure(const std::string& kind, std::size_t count, bool with_run) {
  const MeshSurface surface = liver_surface({});
  Organ organ;
  const double fill_s = least_of_five_s([&] { organ = filled(surface, kind, count); });
  Network network;
  const double join_s = least_of_five_s([&] { network = build_network(organ, {}, "liver"); });
  const BondSystem bonds(network, TpmParameters{});
  const Positions& rest = network.organ.position;
  const ViscousState fresh{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())), 0.0};
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, rest.cols());
  BlockMatrix stiffness(bonds.pattern());
  constexpr int kEvaluations = 10;
  const double bonds_s = least_of_five_s([&] {
    for (int i = 0; i < kEvaluations; ++i) {
      bonds.add_forces(rest, fresh, force);
      stiffness.set_zero();
      bonds.add_stiffness(rest, fresh, stiffness);
    }
  });
  fmt::print("| {} | {} | {} | {:.4f} | {:.4f} | {:.4f} |", kind, organ.size(),
             network.bonds.size(), fill_s, join_s, bonds_s);
  if (with_run) {
    const double depth_m = 0.2 * network.organ.spacing;
    const Protocol protocol(Drive::displacement, {{0.0, 0.0}, {1.0, depth_m}, {3.0, depth_m}});
    Eigen::Index probe = 0;
    rest.row(2).minCoeff(&probe);
    QuasiStaticOptions options;
    options.tolerance = 1e-5;
    const std::vector<double> times{0.5, 1.0, 3.0};
    const QuasiStatic equations(bonds, rest, held_far_side(rest),
                                Probe{static_cast<std::size_t>(probe), Eigen::Vector3d::UnitZ()},
                                options);
    fmt::print(" {:.4f} |", least_of_five_s([&] { (void)equations.run(protocol, times); }));
  }
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(argc, argv, 2, 3, "measure_organ_cost KIND COUNT [run]",
                        [](const std::vector<std::string>& words) {
                          measure(words[0], std::stoul(words[1]), words.size() > 2);
                        });
}
