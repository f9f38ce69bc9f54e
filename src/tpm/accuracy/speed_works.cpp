// Declared in tpm/accuracy/speed.hpp.
// The pieces of work that the speed record follows. A name stands for the same work for ever: to
// change one, give it another name.
#include <algorithm>
#include <memory>

#include "tpm/accuracy/speed.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/organ/balance/large_equilibrium.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/body/liver_surface.hpp"
#include "tpm/organ/bonds/local_support.hpp"
#include "tpm/organ/bonds/rigidity.hpp"
#include "tpm/organ/linear/lane_factor.hpp"
#include "tpmkit/bond_element.hpp"
#include "tpmkit/error.hpp"

namespace tpm::accuracy {
namespace {

/// A liver of some spheres in two layers, or solid, that stands on its far side.
struct StandingLiver {
  StandingLiver(std::size_t count, bool solid)
      : network(build_network(organ_of(count, solid), continuum(), "speed record")),
        bonds(network, paper_element()),
        constraints(network.organ.size()) {
    const Positions& rest = network.organ.position;
    const double near = rest.row(2).minCoeff();
    const double far = rest.row(2).maxCoeff();
    for (std::size_t i = 0; i < constraints.size(); ++i) {
      if (rest(2, static_cast<Eigen::Index>(i)) > near + 0.7 * (far - near)) constraints.fix(i);
    }
    right.resize(3, rest.cols());
    Random random(1);
    for (double& value : right.reshaped()) value = random.normal();
    constraints.project(right);
  }

  static NetworkOptions continuum() {
    NetworkOptions options;
    options.spacing_law = SpacingLaw::continuum;
    return options;
  }
  static Organ organ_of(std::size_t count, bool solid) {
    if (!solid) {
      LiverRequest request;
      request.count = count;
      return fill_liver(request);
    }
    SolidRequest request;
    request.count = count;
    Organ organ = fill_solid(liver_surface(LiverShape{}), request);
    Eigen::Index front = 0;
    organ.position.row(2).minCoeff(&front);
    organ.contact = static_cast<std::size_t>(front);
    return organ;
  }
  [[nodiscard]] const Positions& rest() const { return network.organ.position; }
  [[nodiscard]] ViscousState viscous_state() const {
    return {Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())), 0.0};
  }

  Network network;
  BondSystem bonds;
  Constraints constraints;
  Eigen::Matrix3Xd right;  ///< random forces on what is free, N
};

using Run = std::function<void()>;

std::shared_ptr<StandingLiver> standing(std::size_t count, bool solid = false) {
  return std::make_shared<StandingLiver>(count, solid);
}

/// A factor of a liver's stiffness at rest, and what it was made of.
struct Factorised {
  explicit Factorised(std::size_t count)
      : liver(count, false), matrix(liver.bonds.pattern()), factor(liver.bonds.pattern()) {
    liver.bonds.add_stiffness(liver.rest(), liver.viscous_state(), matrix);
    liver.constraints.constrain(liver.bonds, matrix);
    factorise();
  }
  void factorise() {
    if (factor.factorise(matrix)) return;
    throw Error(ExitCode::numerical, "speed record", "the stiffness cannot be factorised");
  }
  StandingLiver liver;
  BlockMatrix matrix;
  BlockLdlt factor;
};

Run fill(std::size_t count) {
  return [count] { (void)StandingLiver::organ_of(count, false); };
}

Run join(std::size_t count) {
  const auto organ = std::make_shared<Organ>(StandingLiver::organ_of(count, false));
  return [organ] { (void)build_network(*organ, StandingLiver::continuum(), "speed record"); };
}

Run check(std::size_t count) {
  const auto liver = standing(count);
  return [liver] {
    (void)zero_energy_modes(liver->bonds, liver->rest(), liver->constraints);
    (void)local_support(liver->bonds, liver->network.organ, liver->constraints);
  };
}

Run order(std::size_t count) {
  const auto liver = standing(count);
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (std::size_t i = 0; i < liver->bonds.size(); ++i) {
    edges.push_back({liver->bonds.end_a()[i], liver->bonds.end_b()[i]});
  }
  return [edges, count] { (void)BlockPattern(count, edges); };
}

Run factorise(std::size_t count) {
  const auto made = std::make_shared<Factorised>(count);
  return [made] { made->factorise(); };
}

Run solve(std::size_t count) {
  const auto made = std::make_shared<Factorised>(count);
  return [made] {
    Eigen::Matrix3Xd x = made->liver.right;
    made->factor.solve(x);
  };
}

Run solve_lanes(std::size_t count) {
  const auto made = std::make_shared<Factorised>(count);
  const auto lanes = std::make_shared<LaneFactor>(made->liver.bonds.pattern());
  lanes->copy(made->factor);
  const LaneMatrix right = made->liver.right.reshaped().transpose().replicate<kLanes, 1>();
  return [made, lanes, right] {
    LaneMatrix x = right;
    lanes->solve(x);
  };
}

Run ramp_and_hold_liver(std::size_t count, int outputs) {
  const auto liver = standing(count);
  const Probe probe{liver->network.organ.contact.value(), Eigen::Vector3d::UnitZ()};
  const double depth_m = 0.4 * liver->network.organ.spacing;
  const auto protocol = std::make_shared<Protocol>(ramp_and_hold(depth_m, 0.5 * depth_m, 29.0));
  std::vector<double> times;
  for (int i = 1; i <= outputs; ++i) times.push_back(31.0 * i / outputs);
  return [liver, probe, protocol, times] {
    (void)QuasiStatic(liver->bonds, liver->rest(), liver->constraints, probe, {.tolerance = 1e-6})
        .run(*protocol, times);
  };
}

Run iterate_solid(std::size_t count) {
  const auto liver = standing(count, true);
  const auto solver =
      std::make_shared<LargeEquilibrium>(liver->bonds, liver->constraints, liver->rest());
  return [liver, solver] {
    Eigen::Matrix3Xd x = liver->right;
    if (solver->solve(liver->rest(), liver->viscous_state(), x, 1e-8) == TangentAnswer::solved)
      return;
    throw Error(ExitCode::numerical, "speed record", "conjugate gradients do not converge");
  };
}

/// A second of the full network at 1 kHz: in to 4 mm and out.
Run servo_second() {
  const auto liver = standing(424);
  const Eigen::Vector3d into = Eigen::Vector3d::UnitZ();
  const auto model = std::make_shared<ServoNetwork>(liver->bonds, liver->rest(), liver->constraints,
                                                    liver->network.organ.contact.value(), into);
  return [liver, model, into] {
    constexpr int kStepsIn = 500;
    model->reset();
    for (int i = 1; i <= 2 * kStepsIn; ++i) {
      const double in = std::min(i, 2 * kStepsIn - i);
      (void)model->step(4e-3 * in / kStepsIn * into);
    }
  };
}

}  // namespace

const std::vector<SpeedWork>& speed_works() {
  static const std::vector<SpeedWork> works{
      {"fill_6800", "spheres of a liver of 6,800 in two layers", [] { return fill(6800); }},
      {"join_6800", "its bonds", [] { return join(6800); }},
      {"check_6800", "its zero-energy modes and the support of each sphere",
       [] { return check(6800); }},
      {"order_6800", "order of elimination and fronts of its stiffness",
       [] { return order(6800); }},
      {"factorise_424", "one factorisation of the stiffness, 424 spheres",
       [] { return factorise(424); }},
      {"factorise_6800", "the same, 6,800 spheres", [] { return factorise(6800); }},
      {"solve_424", "one solution in double precision, 424 spheres", [] { return solve(424); }},
      {"solve_6800", "the same, 6,800 spheres", [] { return solve(6800); }},
      {"lanes_424", "eight solutions side by side in single precision, 424 spheres",
       [] { return solve_lanes(424); }},
      {"lanes_6800", "the same, 6,800 spheres", [] { return solve_lanes(6800); }},
      {"ramp_hold_424", "31 s ramp and hold of 424 spheres at 1e-6, 2 outputs",
       [] { return ramp_and_hold_liver(424, 2); }},
      {"ramp_hold_424_350", "the same with 350 outputs",
       [] { return ramp_and_hold_liver(424, 350); }},
      {"ramp_hold_6800", "the same of 6,800 spheres, 2 outputs",
       [] { return ramp_and_hold_liver(6800, 2); }},
      {"multigrid_solid_4000", "conjugate gradients with multigrid to 1e-8, 4,000 spheres, solid",
       [] { return iterate_solid(4000); }},
      {"servo_second_424", "a second of the full network in the loop at 1 kHz, 424 spheres",
       [] { return servo_second(); }}};
  return works;
}

}  // namespace tpm::accuracy
