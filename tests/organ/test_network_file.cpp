// What a reader of tpm network's file computes from it alone, with the equations of its page, and
// both sides of a corner in the file of a run with masses.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "simulated_scene.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/organ/scene/network_file.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm::test;
using Catch::Matchers::WithinAbs;

namespace {

/// A shape of docs/materials.md by its name.
double shape(const std::string& name, double s, double l) {
  if (name == "cubic") return l * (1.0 + l * l / (s * s));
  if (name == "sinh") return s * std::sinh(l / s);
  REQUIRE(name == "linear");
  return l;
}

std::vector<std::int32_t> whole(const Hdf5Reader& file, const std::string& name) {
  const std::vector<std::uint64_t> extents = file.extents(name);
  const std::vector<double> numbers =
      file.part(name, std::vector<std::uint64_t>(extents.size(), 0), extents);
  return {numbers.begin(), numbers.end()};
}

/// The network as its file says it.
struct ReadNetwork {
  explicit ReadNetwork(const std::filesystem::path& path)
      : file(path),
        position(file.table("/spheres/position_m")),
        ends(whole(file, "/bonds/ends")),
        rest(file.numbers("/bonds/rest_length_m")),
        stiffness(file.numbers("/bonds/stiffness_N_per_m")),
        relaxing(file.numbers("/bonds/relaxing_N_per_m")),
        law(whole(file, "/bonds/law")),
        rope(whole(file, "/bonds/rope")),
        spring_law(whole(file, "/laws/spring_law")),
        spring_shape(whole(file, "/laws/spring_shape")),
        kernel_shape(whole(file, "/laws/kernel_shape")),
        spring_share(file.numbers("/laws/spring_share")),
        spring_parameters(file.table("/laws/spring_parameters")),
        kernel_parameters(file.table("/laws/kernel_parameters")),
        shapes(file.texts("/laws/shapes")) {}

  /// N of a bond: instantaneous (every m_j is 0), or at equilibrium (every m_j is V).
  [[nodiscard]] double pull(std::size_t bond, double l, bool equilibrium) const {
    if (rope[bond] != 0 && l < 0.0) return 0.0;
    double u = 0.0;
    for (std::size_t i = 0; i < spring_law.size(); ++i) {
      if (spring_law[i] != law[bond]) continue;
      u += spring_share[i] * shape(name(spring_shape[i]), spring_parameters[4 * i], l);
    }
    const auto own = static_cast<std::size_t>(law[bond]);
    const double v = shape(name(kernel_shape[own]), kernel_parameters[4 * own], l);
    return (stiffness[bond] - relaxing[bond]) * u + (equilibrium ? 0.0 : relaxing[bond] * v);
  }
  [[nodiscard]] const std::string& name(std::int32_t number) const {
    return shapes.at(static_cast<std::size_t>(number));
  }

  Hdf5Reader file;
  std::vector<double> position;
  std::vector<std::int32_t> ends;
  std::vector<double> rest, stiffness, relaxing;
  std::vector<std::int32_t> law, rope, spring_law, spring_shape, kernel_shape;
  std::vector<double> spring_share, spring_parameters, kernel_parameters;
  std::vector<std::string> shapes;
};

/// Largest difference of forces over the largest force, at spheres moved at random by up to 2 mm.
double worst_difference(const std::string& material, const std::string& bonds) {
  const Tissue tissue =
      parse_tissue(parse_json(R"({"organ": {"kind": "liver", "count": 60}, "bonds": )" + bonds +
                                  R"(, "material": )" + material + "}",
                              "scene"),
                   "scene", {});
  const TempFolder folder;
  (void)write_network(tissue, folder / "n.h5");
  const ReadNetwork read(folder / "n.h5");
  const BondSystem system = tissue.bonds();
  Positions moved = tissue.network.organ.position;
  Random random(5);
  for (double& x : moved.reshaped()) x += 0.002 * (2.0 * random.uniform() - 1.0);
  double worst = 0.0;
  for (const bool equilibrium : {false, true}) {
    Eigen::Matrix3Xd expected = Eigen::Matrix3Xd::Zero(3, moved.cols());
    const ViscousState state{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(system.size())),
                             equilibrium ? 1.0 : 0.0};
    system.add_forces(moved, state, expected);
    Eigen::Matrix3Xd found = Eigen::Matrix3Xd::Zero(3, moved.cols());
    for (std::size_t bond = 0; bond < read.rest.size(); ++bond) {
      const auto a = static_cast<Eigen::Index>(read.ends[2 * bond]);
      const auto b = static_cast<Eigen::Index>(read.ends[2 * bond + 1]);
      const Eigen::Vector3d along = moved.col(b) - moved.col(a);
      const double length = along.norm();
      const Eigen::Vector3d force =
          read.pull(bond, length - read.rest[bond], equilibrium) / length * along;
      found.col(a) += force;
      found.col(b) -= force;
    }
    worst =
        std::max(worst, (found - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff());
  }
  return worst;
}

}  // namespace

TEST_CASE("forces follow from the file of a network alone") {
  const std::string regions =
      R"("regions": [{"kind": "ball", "below_contact": "10 mm", "radius": "40 mm", "factor": 5}])";
  const std::string branches =
      R"("Einf": "4.8 kPa", "Eprime": "12 kPa",
         "branches": [{"g": "3 kPa", "tau": "1.86 s"}, {"g": "4.2 kPa", "tau": "51.3 s"}])";
  CHECK_THAT(worst_difference("{" + branches + ", " + regions + "}", R"({"lateral": "rope"})"),
             WithinAbs(0.0, 1e-12));
  // Lateral bonds stiffen as radial ones do.
  const std::string cubic = R"("potential": {"shape": "cubic", "stiffening": "5 mm"})";
  for (const std::string lateral : {"elastic", "rope", "relaxing"}) {
    INFO(lateral);
    CHECK_THAT(
        worst_difference("{" + branches + ", " + cubic + "}", R"({"lateral": ")" + lateral + "\"}"),
        WithinAbs(0.0, 1e-12));
  }
  CHECK_THAT(
      worst_difference("{" + branches + R"(, "kernel": {"shape": "sinh", "stiffening": "4 mm"}})",
                       R"({"lateral": "relaxing", "spacing_law": "continuum"})"),
      WithinAbs(0.0, 1e-12));
}

TEST_CASE("an elastic lateral bond pulls as the page of materials says") {
  // w (A0/l0) Eprime W(l), W cubic: the one bond between B and A of the star.
  const Tissue tissue = parse_tissue(
      parse_json(
          R"({"organ": {"kind": "star"}, "material": {"Einf": "4 kPa", "Eprime": "12 kPa",
              "branches": [{"g": "3 kPa", "tau": "2 s"}],
              "potential": {"shape": "cubic", "stiffening": "5 mm"}}})",
          "scene"),
      "scene", {});
  const BondSystem system = tissue.bonds();
  Positions moved = tissue.network.organ.position;
  moved.col(0).x() -= 0.003;
  Eigen::VectorXd tension;
  system.tensions(moved, {Eigen::VectorXd::Zero(static_cast<Eigen::Index>(system.size())), 0.0},
                  tension);
  const double expected = 12e3 * 12.56e-6 / 1e-3 * 0.003 * (1.0 + 0.36);
  CHECK_THAT(tension[0], WithinAbs(expected * tissue.network.bonds[0].factor, 1e-12));
}

TEST_CASE("the largest force of a run with masses does not depend on its outputs", "[heavy]") {
  const auto largest = [](const std::string& outputs) {
    const SimulationRun run = run_of(small_scene(
        R"("protocol": {"kind": "ramp_hold", "depth": "2 mm", "rate": "100 mm/s", "hold": "0.2 s"},
           "formulation": {"kind": "inertial", "damping_ratio": 1}, "outputs": )" +
        outputs));
    double most = 0.0;
    std::size_t corners = 0;
    for (const CurvePoint& point : run.record.curve) {
      most = std::max(most, std::abs(point.response));
      corners += std::abs(point.time_s - 0.02) < 1e-12 ? 1U : 0U;
    }
    CHECK(corners == 2);  // either side
    return most;
  };
  const double few = largest(R"({"count": 3})");
  CHECK(few == Approx(largest(R"({"count": 57})")).epsilon(2e-4));
  CHECK(few == Approx(largest(R"({"times": ["19.99 ms", "20 ms", "0.1 s"]})")).epsilon(2e-4));
}
