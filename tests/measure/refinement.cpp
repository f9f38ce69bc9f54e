// Prints the tables of refinement and moduli of reports/networks/report.md:
// build/release/tests/measure_refinement
#include <fmt/format.h>

#include "patch_test.hpp"
#include "punch_on_block.hpp"
#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;

namespace {

constexpr std::array<Word<StiffnessRule>, 2> kRules{
    {{StiffnessRule::per_bond, "per_bond"}, {StiffnessRule::normalised, "normalised"}}};

void print_moduli(std::string_view what, const Elasticity& elasticity, double relaxation_factor,
                  double bond_Pa) {
  const Moduli m = moduli_of(elasticity);
  fmt::print(
      "{:<34} {:<8} E {:6.2f} {:6.2f} kPa  G {:5.2f} {:5.2f} kPa  nu {:5.3f} {:5.3f}  volume "
      "{:5.3f}  "
      "A {:5.3f}  E/E_bond {:5.3f}\n",
      what, relaxation_factor == 0.0 ? "at once" : "relaxed", m.young_Pa[0] * 1e-3,
      m.young_Pa[2] * 1e-3, m.shear_Pa[0] * 1e-3, m.shear_Pa[2] * 1e-3, m.poisson(0, 2),
      m.poisson(2, 0), m.volume_change[2], m.anisotropy, m.young_Pa[2] / bond_Pa);
}

/// Along x and z, xz and xy; x = 20 mm and the default material.
void print_lattices() {
  const TpmParameters material;
  for (const auto& rule : kRules) {
    for (const auto& lattice : kLatticeWords) {
      NetworkOptions options;
      options.rule = rule.meaning;
      const double x = 0.020;
      const int cells = lattice.meaning == Lattice::cubic ? 8 : 6;
      const Network network =
          build_network(block(cells, cells, cells, x, lattice.meaning), options, "block");
      const BondSystem bonds(network, material);
      for (const double relaxation_factor : {0.0, 1.0}) {
        const PatchTest patch =
            affine_patch_test(network, bonds, relaxation_factor, 2.0 * options.support * x,
                              volume_per_sphere(lattice.meaning, x));
        print_moduli(fmt::format("{} {}", lattice.text, rule.text), patch.elasticity,
                     relaxation_factor, material.E2_Pa);
      }
    }
  }
}

/// Averages over the bonds of an organ: estimates from above.
void print_organ(const std::string& name, Organ organ, std::span<const std::size_t> spheres,
                 double volume_m3) {
  NetworkOptions options;
  options.spacing_law = SpacingLaw::continuum;  // as if x were 20 mm
  const Network network = build_network(std::move(organ), options, name);
  const TpmParameters material;
  const BondSystem bonds(network, material);
  for (const double relaxation_factor : {0.0, 1.0}) {
    print_moduli(name, affine_elasticity(network, bonds, relaxation_factor, spheres, volume_m3),
                 relaxation_factor, material.E2_Pa);
  }
}

void print_organs() {
  Organ shell = paper_liver();
  std::vector<std::size_t> all(shell.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  const double area = 212.0 * shell.spacing * shell.spacing * std::sqrt(3.0) / 2.0;
  // A layer stands for a spacing of depth.
  print_organ("paper's liver, all bonds", shell, all, 2.0 * area * shell.spacing);
  SolidRequest request;
  request.spacing = 0.008;
  const LiverShape shape;
  Organ solid = fill_solid(
      liver_surface(scaled(shape, 0.020 / even_spacing(liver_surface(shape), 212))), request);
  std::vector<std::size_t> inside;
  for (std::size_t i = 0; i < solid.size(); ++i) {
    if (solid.layer[i] >= 2) inside.push_back(i);
  }
  const double volume =
      volume_per_sphere(Lattice::fcc, solid.spacing) * static_cast<double>(inside.size());
  print_organ(fmt::format("solid liver, {} spheres inside", inside.size()), solid, inside, volume);
}

void print_levels(const std::string& title, const PunchOnBlock& scene,
                  std::span<const int> levels) {
  fmt::print("{}\n", title);
  std::vector<double> force;
  for (const int cells : levels) {
    force.push_back(punch_stiffness(scene, cells));
    fmt::print("  x {:6.3f} mm  {:>7} spheres  {:10.4f} N/m", scene.side_m / cells * 1e3,
               (cells + 1) * (cells + 1) * (cells + 1), force.back());
    if (force.size() >= 3) {
      const std::size_t n = force.size();
      const Richardson r = richardson(force[n - 3], force[n - 2], force[n - 1], 2.0);
      if (std::isfinite(r.order) && r.order > 0.0) {
        fmt::print("  order {:.3f}  limit {:.3f} N/m", r.order, r.limit);
      } else {
        fmt::print("  no order");
      }
    }
    fmt::print("\n");
    std::fflush(stdout);
  }
}

/// The glued round punch on a half-space (Mossakovskii 1954; Spence 1968):
/// F = 4 G a d ln(3 - 4 nu)/(1 - 2 nu).
void print_closed_form() {
  const TpmParameters material;
  const double reference = NetworkOptions{}.reference_spacing_m;
  const double young = 2.5 * material.E2_Pa * material.modulus_to_stiffness_m() / reference;
  const double nu = 0.25;
  const double shear = young / (2.0 * (1.0 + nu));
  const double radius = 0.02;
  const double exact = 4.0 * shear * radius * std::log(3.0 - 4.0 * nu) / (1.0 - 2.0 * nu);
  fmt::print("round glued punch of radius 20 mm, half-space: {:.4f} N/m\n", exact);
  for (const double side : {0.08, 0.16, 0.32}) {
    PunchOnBlock scene;
    scene.side_m = side;
    scene.punch_m = 2.0 * radius;
    scene.shape = PunchShape::round;
    const int base = static_cast<int>(std::lround(side / 0.08));
    std::vector<double> force;
    for (const int cells : {8 * base, 16 * base}) force.push_back(punch_stiffness(scene, cells));
    const double limit = 2.0 * force[1] - force[0];  // first order
    fmt::print("  cube of {:.0f} mm: x 10 mm {:.4f}, x 5 mm {:.4f}, limit {:.4f}, {:+.1f} %\n",
               side * 1e3, force[0], force[1], limit, 100.0 * (limit / exact - 1.0));
    std::fflush(stdout);
  }
}

}  // namespace

int main() {
  print_lattices();
  print_organs();
  constexpr std::array levels{4, 8, 16, 32, 64};
  PunchOnBlock scene;
  print_levels("square punch of 80 mm on a cube of 160 mm, per_bond", scene, levels);
  scene.rule = StiffnessRule::normalised;
  print_levels("the same, normalised", scene, levels);
  scene.rule = StiffnessRule::per_bond;
  scene.shape = PunchShape::round;
  print_levels("round punch of 80 mm, per_bond", scene, levels);
  print_closed_form();
  return 0;
}
