// Prints the measured numbers on the mass-spring model in reports/networks/report.md:
// build/release/tests/measure_mass_spring
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include "far_side.hpp"
#include "tpm/organ/balance/inertial.hpp"
#include "tpm/organ/balance/mass_spring.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/bonds/roughness.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;

namespace {

constexpr double kForever = std::numeric_limits<double>::infinity();

struct Tissue {
  std::string name;
  Network network;
  BondMaterial material;
};

/// Figure 3 of the paper: a load along +z on sphere 71.
class Scene {
 public:
  Scene()
      : liver_(build_network(paper_liver(), {}, "liver")),
        constraints_(tpm_measure::held_on_the_far_side(liver_.organ)),
        probe_{*liver_.organ.contact, Eigen::Vector3d::UnitZ()},
        near_(spheres_around(liver_, probe_.sphere, 2)),
        rim_(free_ones(spheres_at_rim(liver_, 25.0 * std::numbers::pi / 180.0))) {
    fmt::print("near the contact: {} spheres (2 steps); at the rim: {} free ones (25 degrees)\n",
               near_.size(), rim_.size());
    const double relaxed = stiffness(liver_, TpmParameters{}, 1.0);
    TpmParameters unrelaxed;
    unrelaxed.E1_Pa = 1e15;
    TpmParameters one_modulus;  // relaxed radial bonds as stiff as the lateral ones
    one_modulus.Eprime_Pa = one_modulus.equilibrium_modulus_Pa();
    add_msm("MSM, factors of the bonds", SpringRule::like_the_bonds, relaxed);
    add_msm("MSM, equal springs", SpringRule::equal, relaxed);
    tissues_.push_back({"TPM, relaxed", liver_, TpmParameters{}});
    tissues_.push_back({"TPM, before it relaxes", liver_, unrelaxed});
    tissues_.push_back({"TPM, relaxed, E' = P2", liver_, one_modulus});
  }

  void print_static(double load) const {
    fmt::print("\nstatic, {} N\n{:<28} {:>10} {:>10} {:>12} {:>12} {:>12}\n", load, "", "k0 N/m",
               "depth mm", "rough near", "rough rim", "shape");
    std::optional<Eigen::Matrix3Xd> msm;
    for (const Tissue& tissue : tissues_) {
      try {
        print_row(tissue, settled(tissue, load), msm);
      } catch (const Error& e) {
        if (e.code() != ExitCode::numerical) throw;
        fmt::print("{:<28} {}\n", tissue.name, e.what());
      }
    }
  }

  /// The same load put on at once, while the organ swings.
  void print_swinging(double load, double time) const {
    fmt::print("\n{} s after a load of {} N was put on, damping ratio 0.1\n", time, load);
    std::optional<Eigen::Matrix3Xd> msm;
    for (const Tissue& tissue : tissues_) {
      const BondSystem bonds(tissue.network, tissue.material);
      InertialOptions options;
      options.stiffness_share = tissue.name.starts_with("MSM") ? 1.0 : 0.0;
      const InertialRun run = Inertial(bonds, liver_.organ.position, constraints_, probe_,
                                       sphere_masses_kg(liver_.organ), options)
                                  .run(creep(load, time), {});
      print_row(tissue, run.position - liver_.organ.position, msm);
    }
  }

 private:
  [[nodiscard]] std::vector<std::size_t> free_ones(std::vector<std::size_t> spheres) const {
    std::erase_if(spheres, [&](std::size_t i) { return !constraints_.is_free(i); });
    return spheres;
  }

  [[nodiscard]] double stiffness(const Network& network, const BondMaterial& p,
                                 double relaxation_factor) const {
    return contact_stiffness_N_per_m(BondSystem(network, p), liver_.organ.position, constraints_,
                                     probe_, relaxation_factor);
  }

  void add_msm(std::string name, SpringRule rule, double contact_stiffness) {
    Network msm = msm_network(liver_, rule);
    const BondMaterial material = msm_material(msm, constraints_, probe_, contact_stiffness);
    tissues_.push_back({std::move(name), std::move(msm), material});
  }

  [[nodiscard]] Eigen::Matrix3Xd settled(const Tissue& tissue, double load) const {
    const BondSystem bonds(tissue.network, tissue.material);
    const QuasiStaticRun run =
        QuasiStatic(bonds, liver_.organ.position, constraints_, probe_, {1e-6})
            .run(creep(load, kForever), std::span(&kForever, 1));
    return run.position - liver_.organ.position;
  }

  /// @param msm the displacements of the first tissue that has come so far, in unit length
  void print_row(const Tissue& tissue, const Eigen::Matrix3Xd& u,
                 std::optional<Eigen::Matrix3Xd>& msm) const {
    const Eigen::Matrix3Xd shape = u / u.norm();
    if (!msm) msm = shape;
    fmt::print("{:<28} {:>10.3f} {:>10.4f} {:>12.5f} {:>12.5f} {:>12.1e}\n", tissue.name,
               stiffness(tissue.network, tissue.material, 1.0),
               1e3 * u.col(static_cast<Eigen::Index>(probe_.sphere)).dot(probe_.direction),
               roughness(liver_, u, near_), roughness(liver_, u, rim_), (shape - *msm).norm());
  }

  Network liver_;
  Constraints constraints_;
  Probe probe_;
  std::vector<std::size_t> near_, rim_;
  std::vector<Tissue> tissues_;
};

}  // namespace

int main() {
  const Scene scene;
  for (const double load : {2e-5, 0.2, 0.5, 1.0, 2.0}) scene.print_static(load);
  for (const double time : {0.1, 0.3, 20.0}) scene.print_swinging(0.2, time);
  for (const double time : {0.1, 0.3, 20.0}) scene.print_swinging(2.0, time);
  return 0;
}
