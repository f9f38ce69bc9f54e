#include <BulletSoftBody/btSoftBody.h>
#include <fmt/format.h>

#include "peers.hpp"

namespace tpm::peers {
using namespace accuracy;

namespace {

btVector3 bullet(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// A link moves its ends by a share kLST of what its length is off, in each iteration. A spring k
/// moves them by h^2 k (1/m_a + 1/m_b) of it in a step of h: that is the share at one iteration.
/// More iterations make the same links stiffer; the share is at most 1.
class BulletEngine final : public Engine {
 public:
  BulletEngine(const SpringNetwork& n, double step_s, int iterations)
      : step_s_(step_s), driven_(n.driven) {
    world_.m_gravity.setZero();
    world_.air_density = 0.0;
    world_.water_density = 0.0;
    world_.m_sparsesdf.Initialize();
    std::vector<btVector3> places;
    std::vector<btScalar> masses;
    for (Eigen::Index i = 0; i < n.rest.cols(); ++i) {
      const bool moved = i == n.driven || n.held[static_cast<std::size_t>(i)] != 0;
      places.push_back(bullet(n.rest.col(i)));
      masses.push_back(moved ? 0.0 : n.mass_kg[i]);
    }
    body_ = std::make_unique<btSoftBody>(&world_, static_cast<int>(places.size()), places.data(),
                                         masses.data());
    const auto inverse = [&](int i) {
      const double mass = masses[static_cast<std::size_t>(i)];
      return mass > 0.0 ? 1.0 / mass : 0.0;
    };
    for (const SpringNetwork::Spring& s : n.springs) {
      const double compliance = inverse(s.a) + inverse(s.b);
      if (compliance == 0.0) continue;
      btSoftBody::Material* material = body_->appendMaterial();
      material->m_kLST =
          std::min(1.0, step_s * step_s * s.stiffness_N_per_m * compliance / iterations);
      body_->appendLink(s.a, s.b, material);
    }
    body_->m_cfg.piterations = iterations;
    body_->m_cfg.collisions = 0;
    body_->m_cfg.kDP = std::min(1.0, n.drag_per_s * step_s);
    body_->updateLinkConstants();
  }
  void step(const Eigen::Vector3d& driven) override {
    btSoftBody::Node& node = body_->m_nodes[driven_];
    node.m_v = (bullet(driven) - node.m_x) / step_s_;
    body_->predictMotion(step_s_);
    body_->solveConstraints();
    body_->integrateMotion();
  }
  void read(Positions& position) const override {
    for (Eigen::Index i = 0; i < position.cols(); ++i) {
      const btVector3& x = body_->m_nodes[static_cast<int>(i)].m_x;
      position.col(i) << x.x(), x.y(), x.z();
    }
  }

 private:
  double step_s_;
  int driven_;
  btSoftBodyWorldInfo world_;
  std::unique_ptr<btSoftBody> body_;
};

}  // namespace

std::vector<BenchmarkSetting> bullet_settings(const std::shared_ptr<const SpringNetwork>& network,
                                              const std::vector<double>& steps_s) {
  std::vector<BenchmarkSetting> all;
  for (const int iterations : {1, 4}) {
    for (const double step_s : steps_s) {
      all.push_back({"Bullet",
                     iterations == 1 ? "1 iteration" : fmt::format("{} iterations", iterations),
                     "step_s", step_s, step_s, [network, step_s, iterations](bool) -> BenchmarkRun {
                       BulletEngine engine(*network, step_s, iterations);
                       return {run_engine(*network, engine, step_s), {}};
                     }});
    }
  }
  return all;
}

}  // namespace tpm::peers
