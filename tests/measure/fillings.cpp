// Prints the tables of reports/networks: how evenly the surface of a solid ball answers.
//     build/release/tests/measure_fillings [FROM TO [alike]]
//     build/release/tests/measure_fillings directions [SHARE]
// For 20 numbers of spheres (or those between FROM and TO) and each lattice: spheres that were
// added, the least outer support, and over five pushes spread over the surface the largest over the
// smallest stiffness and the smallest over the median, under one sphere and under a rigid patch
// over four spacings; how many spheres such a patch has; and the largest over the smallest under
// patches of 15 spheres each, the number that four spacings span on an even layer, and under an
// even pressure on the disc over four spacings, where a sphere at the rim counts with its share.
// `alike`: the five pushes are one direction turned by symmetries of the lattice, so that they
// differ in the filling alone.
// `directions`: how much of the difference is the lattice's, which has directions. Under the same
// even pressure on the same disc (in mm) a ball of 8,000 spheres answers as the material does;
// beside it the largest over the smallest of five means over eight places that the lattice cannot
// tell from each other. With a SHARE only fcc, whose second neighbours keep that share of their
// stiffness: 0.25 makes the lattice isotropic.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "organ_meshes.hpp"
#include "pressed_ball.hpp"
#include "program.hpp"
#include "tpm/organ/balance/equilibrium.hpp"
#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/bonds/outer_support.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;

namespace {

constexpr double kRadius_m = 0.05;
constexpr double kPatch = 2.0;  // radius in spacings

const std::array<Eigen::Vector3d, 5> kAlike{
    {{0.1, 0.2, 1.0}, {1.0, 0.1, -0.2}, {-0.2, 1.0, 0.1}, {-0.1, 0.2, -1.0}, {-1.0, -0.1, 0.2}}};

constexpr std::size_t kOfPatch = 15;  // 4 pi over sqrt(3)/2: 14.5

struct Stiffness {
  double single = 0.0, patch = 0.0, alike = 0.0, pressed = 0.0;
  std::size_t spheres = 0;
};

/// How far each of some spheres moves along a normal under a force of 1 N on each, m/N.
Eigen::MatrixXd compliance_of(const Equilibrium& equilibrium,
                              const std::vector<Eigen::Index>& spheres,
                              const Eigen::Vector3d& normal, Eigen::Index columns) {
  const auto size = static_cast<Eigen::Index>(spheres.size());
  Eigen::MatrixXd compliance(size, size);
  for (Eigen::Index j = 0; j < size; ++j) {
    Eigen::Matrix3Xd field = Eigen::Matrix3Xd::Zero(3, columns);
    field.col(spheres[static_cast<std::size_t>(j)]) = normal;
    equilibrium.displace(field);
    for (Eigen::Index i = 0; i < size; ++i) {
      compliance(i, j) = normal.dot(field.col(spheres[static_cast<std::size_t>(i)]));
    }
  }
  return compliance;
}

/// Of the first spheres, driven together, N/m.
double driven_together(const Eigen::MatrixXd& compliance, std::size_t spheres) {
  const auto size = static_cast<Eigen::Index>(spheres);
  return compliance.topLeftCorner(size, size).ldlt().solve(Eigen::VectorXd::Ones(size)).sum();
}

/// Force over mean displacement under an even pressure, N/m.
/// @param share of each sphere that lies under it
double pressed(const Eigen::MatrixXd& compliance, const Eigen::VectorXd& share) {
  return share.sum() * share.sum() / share.dot(compliance * share);
}

/// N/m, instantaneous at rest, with the far 30 % of the depth fixed.
Stiffness pushed(Organ organ, const Eigen::Vector3d& towards, const TpmParameters& material) {
  Eigen::Index contact = 0;
  const auto outer = std::count(organ.layer.begin(), organ.layer.end(), 0);
  (organ.position.leftCols(outer).colwise() - kRadius_m * towards.normalized())
      .colwise()
      .squaredNorm()
      .minCoeff(&contact);
  organ.contact = static_cast<std::size_t>(contact);
  const Network network = build_network(std::move(organ), {}, "ball");
  const BondSystem bonds(network, material);
  const Eigen::Vector3d normal = network.organ.normal.col(contact);
  Constraints constraints(network.organ.size());
  for (Eigen::Index i = 0; i < network.organ.position.cols(); ++i) {
    if (normal.dot(network.organ.position.col(i)) < -0.4 * kRadius_m)
      constraints.fix(static_cast<std::size_t>(i));
  }
  Equilibrium equilibrium(bonds, constraints);
  if (!equilibrium.factorise(network.organ.position,
                             {Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())), 0.0}))
    return {};
  std::vector<Eigen::Index> nearest(static_cast<std::size_t>(outer));
  std::iota(nearest.begin(), nearest.end(), Eigen::Index{0});
  const Positions& at = network.organ.position;
  const auto apart = [&](Eigen::Index i) { return (at.col(i) - at.col(contact)).norm(); };
  std::stable_sort(nearest.begin(), nearest.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return apart(a) < apart(b); });
  const double spacing = network.organ.spacing;
  const auto within = [&](double radius) {
    return static_cast<std::size_t>(
        std::count_if(nearest.begin(), nearest.end(),
                      [&](Eigen::Index i) { return apart(i) <= radius * spacing; }));
  };
  Stiffness found;
  found.spheres = within(kPatch);
  nearest.resize(std::max(kOfPatch, within(kPatch + test::kOfSphere)));
  const Eigen::MatrixXd compliance = compliance_of(equilibrium, nearest, normal, at.cols());
  Eigen::VectorXd share(compliance.rows());
  for (Eigen::Index i = 0; i < share.size(); ++i) {
    const double inside = kPatch - apart(nearest[static_cast<std::size_t>(i)]) / spacing;
    share[i] = std::clamp(0.5 + 0.5 * inside / test::kOfSphere, 0.0, 1.0);
  }
  found.single = driven_together(compliance, 1);
  found.patch = driven_together(compliance, found.spheres);
  found.alike = driven_together(compliance, kOfPatch);
  found.pressed = pressed(compliance, share);
  return found;
}

double largest_over_smallest(const std::vector<double>& values) {
  const auto [smallest, largest] = std::minmax_element(values.begin(), values.end());
  return *largest / *smallest;
}

std::string spread(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return fmt::format("{:.2f} | {:.2f}", largest_over_smallest(values),
                     values.front() / values[values.size() / 2]);
}

void measure(std::size_t from, std::size_t to, const std::array<Eigen::Vector3d, 5>& pushes) {
  fmt::print(
      "| lattice | spheres | outer | off the lattice | least outer support | single max/min | "
      "single min/median | patch max/min | patch min/median | spheres of it | 15 spheres max/min "
      "| pressure max/min |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  const test::Sphere ball(kRadius_m);
  const TpmParameters material;
  constexpr int kCounts = 20;
  for (const Lattice lattice : {Lattice::cubic, Lattice::bcc, Lattice::fcc}) {
    for (int i = 0; i < kCounts; ++i) {
      const auto count = static_cast<std::size_t>(std::round(400.0 * std::pow(15.0, i / 19.0)));
      if (count < from || count > to) continue;
      SolidRequest request;
      request.count = count;
      request.lattice = lattice;
      const Organ organ = fill_solid(ball, request);
      const std::vector<double> support = outer_support(build_network(organ, {}, "ball"));
      std::vector<double> single, patch, alike, even;
      std::size_t fewest = organ.size(), most = 0;
      for (const Eigen::Vector3d& towards : pushes) {
        const Stiffness stiffness = pushed(organ, towards, material);
        single.push_back(stiffness.single);
        patch.push_back(stiffness.patch);
        alike.push_back(stiffness.alike);
        even.push_back(stiffness.pressed);
        fewest = std::min(fewest, stiffness.spheres);
        most = std::max(most, stiffness.spheres);
      }
      const std::string& last = organ.assumptions.back().text;
      const std::string added = organ.assumptions.size() > 2 ? last.substr(0, last.find(' ')) : "0";
      fmt::print("| {} | {} | {} | {} | {:.2f} | {} | {} | {} to {} | {:.2f} | {:.2f} |\n",
                 entry_of(kLatticeWords, lattice).text, organ.size(), support.size(), added,
                 *std::min_element(support.begin(), support.end()), spread(single), spread(patch),
                 fewest, most, largest_over_smallest(alike), largest_over_smallest(even));
      std::fflush(stdout);
    }
  }
}

/// @param of_second share of their stiffness that second neighbours of fcc keep
void measure_directions(std::optional<double> of_second) {
  constexpr std::array<std::size_t, 4> kCounts{400, 800, 1600, 3200};
  constexpr std::size_t kFine = 8000;
  constexpr std::size_t kEachThird = 3;  // of 24 turns
  const test::Sphere ball(kRadius_m);
  const std::vector<Eigen::Matrix3d> all = test::turns();
  fmt::print(
      "| lattice | spheres | disc, mm | max/min of five means | the material ({} spheres) | one "
      "over the other |\n|---|---|---|---|---|---|\n",
      kFine);
  const double of_long = of_second.value_or(1.0);
  for (const Lattice lattice : {Lattice::cubic, Lattice::bcc, Lattice::fcc}) {
    if (of_second && lattice != Lattice::fcc) continue;
    SolidRequest request;
    request.lattice = lattice;
    std::vector<Organ> organs;
    std::vector<double> radii_m;
    for (const std::size_t count : kCounts) {
      request.count = count;
      organs.push_back(fill_solid(ball, request));
      radii_m.push_back(kPatch * organs.back().spacing);
    }
    request.count = kFine;
    const Organ fine = fill_solid(ball, request);
    std::vector<std::vector<double>> of_material(kCounts.size());
    for (const Eigen::Vector3d& towards : test::kPushes) {
      const std::vector<double> pressed =
          test::pressed_on_discs(fine, kRadius_m, towards, radii_m, of_long);
      for (std::size_t i = 0; i < kCounts.size(); ++i) of_material[i].push_back(pressed[i]);
    }
    for (std::size_t i = 0; i < kCounts.size(); ++i) {
      std::vector<double> means;
      for (const Eigen::Vector3d& towards : test::kPushes) {
        double sum = 0.0;
        for (std::size_t turn = 0; turn < all.size(); turn += kEachThird) {
          sum += test::pressed_on_discs(organs[i], kRadius_m, all[turn] * towards, {radii_m[i]},
                                        of_long)
                     .front();
        }
        means.push_back(sum);
      }
      const double own = largest_over_smallest(means);
      const double material = largest_over_smallest(of_material[i]);
      fmt::print("| {} | {} | {:.1f} | {:.3f} | {:.3f} | {:.3f} |\n",
                 entry_of(kLatticeWords, lattice).text, kCounts[i], 1e3 * radii_m[i], own, material,
                 own / material);
      std::fflush(stdout);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(
      argc, argv, 0, 3, "measure_fillings [FROM TO [alike]] | directions [SHARE]",
      [](const std::vector<std::string>& words) {
        if (!words.empty() && words[0] == "directions") {
          return measure_directions(words.size() > 1 ? std::optional(std::stod(words[1]))
                                                     : std::nullopt);
        }
        const bool all = words.size() < 2;
        measure(all ? 0 : std::stoul(words[0]), all ? 6000 : std::stoul(words[1]),
                words.size() == 3 && words[2] == "alike" ? kAlike : test::kPushes);
      });
}
