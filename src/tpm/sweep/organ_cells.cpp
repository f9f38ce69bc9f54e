// Cells of a sweep over the quasi-static network of a scene.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/plan/plan_scene.hpp"
#include "tpm/scene/blocks.hpp"
#include "tpm/scene/experiment_blocks.hpp"
#include "tpm/sweep/sweep_outputs.hpp"

namespace tpm {
namespace {

using Kind = SweepOutput::Kind;

/// A key of a scene that a sweep changes.
struct SceneKey {
  Json::json_pointer pointer;
  Dimension dimension = Dimension::dimensionless;
  bool quantity = false;  ///< a text with a unit
  bool whole = false;     ///< a whole number
};

/// What a sweep's document says of the organ.
struct OrganSetup {
  Json scene;
  std::filesystem::path folder;
  bool by_depth = true;
  std::vector<SweepOutput> outputs;
};

enum OrganCount : std::size_t { kSteps, kIterations, kFactorisations, kBackSolves, kOrganCounts };

SceneKey find_key(const Json& scene, const std::string& target, std::string_view where) {
  const auto refused = [&](const char* what) {
    return bad_input(where, fmt::format("'{}' {}", printable(target), what),
                     "a JSON pointer to a number of the scene, such as /material/E1");
  };
  SceneKey key;
  try {
    key.pointer = Json::json_pointer(target);
    const Json& value = scene.at(key.pointer);
    key.quantity = value.is_string();
    key.whole = value.is_number_integer();
    if (!key.quantity && !value.is_number()) throw refused("is no number");
    if (!key.quantity) return key;
    const auto text = value.get<std::string>();
    const std::size_t space = text.find(' ');
    if (space == std::string::npos || !find_number(text.substr(0, space))) {
      throw refused("is no number");
    }
    key.dimension = parse_unit(std::string_view(text).substr(space + 1), where).dimension;
    return key;
  } catch (const Json::exception&) {
    throw refused("is not in the scene");
  }
}

void put_value(Json& scene, const SceneKey& key, double value, const std::string& target) {
  if (key.quantity) {
    scene.at(key.pointer) = fmt::format("{} {}", shortest(value), si_symbol(key.dimension));
  } else if (!key.whole) {
    scene.at(key.pointer) = value;
  } else if (value == std::round(value) && std::abs(value) < 1e15) {
    scene.at(key.pointer) = static_cast<std::int64_t>(value);
  } else {
    throw bad_input(target, shortest(value), "a whole number");
  }
}

/// Times, rising and each once, and where the outputs find theirs.
class AskedTimes {
 public:
  AskedTimes(const Protocol& protocol, const std::vector<SweepOutput>& outputs)
      : all_(sampled_times(protocol, kPerPiece, kMost)) {
    watched_ = all_;
    for (const SweepOutput& output : outputs) {
      const auto& times = output.variable.times_s;
      for (const double t : times) all_.push_back(protocol.start_s() + t);
      if (output.kind == Kind::force_at || output.kind == Kind::creep_depth_at) {
        all_.push_back(protocol.start_s() + output.time_s);
      }
    }
    std::sort(all_.begin(), all_.end());
    all_.erase(std::unique(all_.begin(), all_.end()), all_.end());
    require_times_within(protocol, all_);
  }
  [[nodiscard]] const std::vector<double>& all() const { return all_; }
  /// Those at which a largest response is looked for.
  [[nodiscard]] const std::vector<double>& watched() const { return watched_; }
  [[nodiscard]] Eigen::Index place(double time_s) const {
    return std::lower_bound(all_.begin(), all_.end(), time_s) - all_.begin();
  }

 private:
  static constexpr int kPerPiece = 8, kMost = 400;
  std::vector<double> all_, watched_;
};

/// One organ after another.
class OrganCell final : public CellModel {
 public:
  OrganCell(const OrganSetup& setup, const std::vector<std::string>& targets)
      : setup_(setup), targets_(targets) {
    for (const std::string& target : targets) {
      keys_.push_back(find_key(setup.scene, target, "sweep"));
    }
  }

  double run(std::span<const double> swept, std::span<double> values,
             std::span<std::int64_t> counts) override {
    const PlanScene scene(scene_of(swept));
    const AskedTimes times(scene.protocol(), setup_.outputs);
    QuasiStaticOptions options;
    options.tolerance = scene.scene().formulation.tolerance;
    const DrivenNetwork& driven = scene.driven();
    const QuasiStaticRun run =
        QuasiStatic(driven.bonds, driven.rest, driven.freedom, driven.probes, options)
            .run(scene.protocol(), times.all());
    counts[kSteps] = run.work.steps;
    counts[kIterations] = run.work.iterations;
    counts[kFactorisations] = run.work.factorisations;
    counts[kBackSolves] = run.work.back_solves;
    fill(run.response, scene.protocol(), times, values);
    return run.error_estimate / run.response.cwiseAbs().maxCoeff();
  }

 private:
  /// The scene with the cell's values. Finding the spheres and their bonds takes much longer than
  /// a run: they are kept while only the material and the protocol change. They are always those
  /// of the scene's own material and protocol, so that no cell depends on which one was before.
  ExperimentScene scene_of(std::span<const double> swept) {
    Json changed = setup_.scene, structure = setup_.scene;
    for (std::size_t i = 0; i < swept.size(); ++i) {
      put_value(changed, keys_[i], swept[i], targets_[i]);
      const bool light =
          targets_[i].starts_with("/material/") || targets_[i].starts_with("/protocol/");
      if (!light) put_value(structure, keys_[i], swept[i], targets_[i]);
    }
    const std::string key = structure.dump();
    if (!base_ || key != base_key_) {
      base_.reset();
      base_ = parse_experiment(structure, "scene", setup_.folder);
      base_key_ = key;
    }
    ExperimentScene scene = *base_;
    const DocumentPlace place{"scene"};
    scene.tissue.material =
        parse_material(changed.value("material", Json::object()),
                       scene.tissue.network.organ.spacing, place.key("material"));
    scene.protocol = parse_scene_protocol(changed.at("protocol"), place.key("protocol"));
    require_possible(scene.protocol, scene.contacts, scene.tissue, place.key("protocol"));
    return scene;
  }

  void fill(const Eigen::VectorXd& response, const Protocol& protocol, const AskedTimes& times,
            std::span<double> values) const {
    const auto at = [&](double time_s) { return response[times.place(time_s)]; };
    const double start = protocol.start_s();
    std::size_t next = 0;
    for (const SweepOutput& output : setup_.outputs) {
      switch (output.kind) {
        case Kind::peak_force: {
          double peak = 0.0;
          for (const double t : times.watched()) peak = std::max(peak, at(t));
          values[next++] = peak;
          break;
        }
        case Kind::force_at:
        case Kind::creep_depth_at:
          values[next++] = at(start + output.time_s);
          break;
        case Kind::force_over:
        case Kind::creep_depth_over:
          for (const double t : output.variable.times_s) values[next++] = at(start + t);
          break;
        case Kind::creep_depth_at_once:
          values[next++] = at(start);
          break;
        default:
          values[next++] = at(protocol.end_s());
      }
    }
  }

  const OrganSetup& setup_;
  std::vector<std::string> targets_;
  std::vector<SceneKey> keys_;
  std::optional<ExperimentScene> base_;
  std::string base_key_;
};

class OrganSweepModel final : public SweepModel {
 public:
  explicit OrganSweepModel(OrganSetup setup) : setup_(std::move(setup)) {
    for (const SweepOutput& output : setup_.outputs) variables_.push_back(output.variable);
  }

  [[nodiscard]] Dimension dimension_of(const std::string& target,
                                       std::string_view where) const override {
    return find_key(setup_.scene, target, where).dimension;
  }
  [[nodiscard]] const std::vector<SweepVariable>& variables() const override { return variables_; }
  [[nodiscard]] std::vector<std::string> counted() const override {
    return {"steps", "iterations", "factorisations", "back_solves"};
  }
  [[nodiscard]] std::uint64_t usual_block() const override { return 8; }
  [[nodiscard]] std::unique_ptr<CellModel> cell_model(
      const std::vector<std::string>& targets) const override {
    return std::make_unique<OrganCell>(setup_, targets);
  }

 private:
  OrganSetup setup_;
  std::vector<SweepVariable> variables_;
};

void require_outputs(const OrganSetup& setup, const DocumentPlace& place) {
  for (std::size_t i = 0; i < setup.outputs.size(); ++i) {
    const SweepOutput& output = setup.outputs[i];
    const bool right = output.kind != Kind::lambda1 && output.of_creep() != setup.by_depth;
    if (right) continue;
    throw bad_input(place.where,
                    fmt::format("'{}' of a scene that imposes a {}", output.variable.name,
                                setup.by_depth ? "depth" : "load"),
                    setup.by_depth ? "forces" : "depths under the load");
  }
}

}  // namespace

std::shared_ptr<const SweepModel> organ_sweep_model(const Json& document, std::string_view where,
                                                    const std::filesystem::path& folder) {
  const DocumentPlace place{std::string(where)};
  OrganSetup setup{document.at("scene"), folder, true, {}};
  setup.outputs = parse_sweep_outputs(document.at("outputs"), place.key("outputs"));
  const ExperimentScene scene =
      parse_experiment(setup.scene, fmt::format("{}: scene", where), folder);
  if (scene.formulation.kind != FormulationKind::quasi_static || scene.formulation.mass_spring) {
    throw bad_input(place.key("scene").where, "another formulation than quasi_static",
                    "a scene of the quasi-static tissue");
  }
  setup.by_depth = scene.protocol.drive() == Drive::displacement;
  require_outputs(setup, place.key("outputs"));
  return std::make_shared<OrganSweepModel>(std::move(setup));
}

}  // namespace tpm
