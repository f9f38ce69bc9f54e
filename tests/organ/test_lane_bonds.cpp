// Several states of a network worked on side by side, against the bonds one by one.
#include <catch2/catch.hpp>
#include <random>

#include "organ_scene.hpp"
#include "tpm/organ/balance/lane_bonds.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using tpm::testing::OrganScene;

TEST_CASE("bonds whose viscous elongations follow the stages pull as each of them does alone") {
  LiverRequest request;
  request.count = 60;
  const OrganScene scene(fill_liver(request));
  const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(0.7));
  const LaneBonds lanes(bonds);
  REQUIRE(lanes.is_linear());
  REQUIRE(lanes.groups().size() == 1);

  std::mt19937 random(0);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  const auto drawn = [&](double most) { return [&, most] { return most * number(random); }; };
  const Positions& rest = scene.network.organ.position;
  LaneMatrix position = LaneMatrix::NullaryExpr(kLanes, rest.size(), drawn(1e-3));
  position.rowwise() += Eigen::Map<const Eigen::RowVectorXd>(rest.data(), rest.size());
  const auto relaxing = static_cast<Eigen::Index>(lanes.relaxing_bonds().size());
  ViscousWeights weights;
  weights.of_stages = LaneSquare::NullaryExpr(drawn(1.0));
  weights.of_start = LaneVector::NullaryExpr(drawn(1.0));
  weights.of_viscous = LaneVector::NullaryExpr(drawn(1.0));
  const Eigen::RowVectorXd start = Eigen::RowVectorXd::NullaryExpr(relaxing, drawn(1e-3));
  const Eigen::RowVectorXd mean = Eigen::RowVectorXd::NullaryExpr(relaxing, drawn(1e-3));
  const LaneMatrix known = weights.of_start * start + weights.of_viscous * mean;

  LaneMatrix elongation(kLanes, relaxing);
  std::vector<Positions> places;
  for (Eigen::Index lane = 0; lane < kLanes; ++lane) {
    const Eigen::RowVectorXd place = position.row(lane);
    places.emplace_back(Eigen::Map<const Positions>(place.data(), 3, rest.cols()));
    Eigen::VectorXd all;
    bonds.elongations(places.back(), all);
    elongation.row(lane) = lanes.of_relaxing(all).transpose();
  }
  const LaneMatrix viscous = weights.of_stages * elongation + known;

  for (const double* const given : {static_cast<const double*>(nullptr), known.data()}) {
    CAPTURE(given == nullptr);
    LaneMatrix followed;
    LaneMatrix force = LaneMatrix::Zero(kLanes, rest.size());
    const LaneBonds::Following following{&weights, start.data(), mean.data(), given};
    lanes.add_forces_of_stages(position, {&following, 1}, followed, force);
    CHECK((followed - elongation).cwiseAbs().maxCoeff() <= 1e-16);
    for (Eigen::Index lane = 0; lane < kLanes; ++lane) {
      ViscousState state{Eigen::VectorXd(Eigen::VectorXd::Zero(bonds.stiffness().size())), 0.0};
      for (Eigen::Index i = 0; i < relaxing; ++i) {
        const std::size_t bond = lanes.relaxing_bonds()[static_cast<std::size_t>(i)];
        state.offset[static_cast<Eigen::Index>(bond)] = viscous(lane, i);
      }
      Eigen::Matrix3Xd alone = Eigen::Matrix3Xd::Zero(3, rest.cols());
      bonds.add_forces(places[static_cast<std::size_t>(lane)], state, alone);
      const Eigen::RowVectorXd row = force.row(lane);
      const Eigen::Map<const Eigen::Matrix3Xd> together(row.data(), 3, rest.cols());
      CHECK((together - alone).norm() <= 1e-13 * alone.norm());
    }
  }
}
