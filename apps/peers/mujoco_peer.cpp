#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <cstring>

#include "peers.hpp"
#include "tpmkit/error.hpp"

namespace tpm::peers {
using namespace accuracy;

namespace {

struct FreeModel {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
struct FreeData {
  void operator()(mjData* data) const { mj_deleteData(data); }
};
using Model = std::unique_ptr<mjModel, FreeModel>;

/// MJCF: a body on three slides for a free sphere, a site of the world for a held one, a body that
/// is moved from outside for the driven one; every spring a tendon between two sites.
std::string mjcf(const SpringNetwork& n, const std::string& integrator) {
  std::string bodies, tendons;
  for (Eigen::Index i = 0; i < n.rest.cols(); ++i) {
    const std::string place =
        fmt::format("{:.17g} {:.17g} {:.17g}", n.rest(0, i), n.rest(1, i), n.rest(2, i));
    if (n.held[static_cast<std::size_t>(i)] != 0) {
      bodies += fmt::format("<site name=\"s{}\" pos=\"{}\"/>\n", i, place);
    } else if (i == n.driven) {
      bodies +=
          fmt::format("<body mocap=\"true\" pos=\"{}\"><site name=\"s{}\"/></body>\n", place, i);
    } else {
      bodies += fmt::format(
          "<body pos=\"{}\"><inertial pos=\"0 0 0\" mass=\"{:.17g}\" diaginertia=\"1e-6 1e-6 "
          "1e-6\"/>",
          place, n.mass_kg[i]);
      for (const char* axis : {"1 0 0", "0 1 0", "0 0 1"}) {
        bodies += fmt::format("<joint type=\"slide\" axis=\"{}\" damping=\"{:.17g}\"/>", axis,
                              n.drag_per_s * n.mass_kg[i]);
      }
      bodies += fmt::format("<site name=\"s{}\"/></body>\n", i);
    }
  }
  for (const SpringNetwork::Spring& s : n.springs) {
    tendons += fmt::format(
        "<spatial stiffness=\"{:.17g}\" springlength=\"{:.17g}\"><site site=\"s{}\"/><site "
        "site=\"s{}\"/></spatial>\n",
        s.stiffness_N_per_m, s.rest_length_m, s.a, s.b);
  }
  // Of the scratch memory that MuJoCo would guess, a network of tendons needs many times as much.
  return fmt::format(
      "<mujoco><size nstack=\"60000000\"/><option gravity=\"0 0 0\" integrator=\"{}\"><flag "
      "contact=\"disable\" "
      "constraint=\"disable\"/></option><worldbody>\n{}</worldbody><tendon>\n{}</tendon></mujoco>",
      integrator, bodies, tendons);
}

Model load(const std::string& text) {
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  if (mj_makeEmptyFileVFS(files.get(), "network.xml", static_cast<int>(text.size())) != 0) {
    throw Error(ExitCode::environment, "MuJoCo", "cannot keep the model in memory");
  }
  std::memcpy(files->filedata[0], text.data(), text.size());
  std::array<char, 1000> message{};
  Model model(mj_loadXML("network.xml", files.get(), message.data(), message.size()));
  mj_deleteVFS(files.get());
  if (!model) throw Error(ExitCode::environment, "MuJoCo", message.data());
  return model;
}

class MujocoEngine final : public Engine {
 public:
  MujocoEngine(const SpringNetwork& network, const mjModel& model, double step_s)
      : model_(mj_copyModel(nullptr, &model)), data_(mj_makeData(model_.get())) {
    model_->opt.timestep = step_s;
    mj_resetData(model_.get(), data_.get());
    for (int i = 0; i < network.rest.cols(); ++i) {
      sites_.push_back(mj_name2id(model_.get(), mjOBJ_SITE, fmt::format("s{}", i).c_str()));
    }
  }
  void step(const Eigen::Vector3d& driven) override {
    mj_step(model_.get(), data_.get());
    // The springs of the next step begin where the driven sphere is then.
    for (int k = 0; k < 3; ++k) data_->mocap_pos[k] = driven[k];
  }
  void read(Positions& position) const override {
    mj_kinematics(model_.get(), data_.get());
    for (Eigen::Index i = 0; i < position.cols(); ++i) {
      const int site = sites_[static_cast<std::size_t>(i)];
      for (int k = 0; k < 3; ++k) position(k, i) = data_->site_xpos[3 * site + k];
    }
  }

 private:
  Model model_;
  std::unique_ptr<mjData, FreeData> data_;
  std::vector<int> sites_;
};

}  // namespace

std::vector<BenchmarkSetting> mujoco_settings(const std::shared_ptr<const SpringNetwork>& network,
                                              const std::vector<double>& steps_s) {
  std::vector<BenchmarkSetting> all;
  for (const char* integrator : {"Euler", "RK4", "implicit"}) {
    const std::shared_ptr<const mjModel> model(load(mjcf(*network, integrator)));
    for (const double step_s : steps_s) {
      // It answers as Euler does, whose damping is implicit too, and takes fifty times as long.
      constexpr double kLeastImplicit_s = 2.5e-3;
      if (std::strcmp(integrator, "implicit") == 0 && step_s < kLeastImplicit_s) continue;
      all.push_back({"MuJoCo", integrator, "step_s", step_s, step_s,
                     [network, model, step_s](bool) -> BenchmarkRun {
                       MujocoEngine engine(*network, *model, step_s);
                       return {run_engine(*network, engine, step_s), {}};
                     }});
    }
  }
  return all;
}

}  // namespace tpm::peers
