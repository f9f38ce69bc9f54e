// Declared in tpm/sweep/cell_model.hpp.
// Cells of a sweep over the quasi-static network of a scene.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <optional>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/organ/scene/scene_keys.hpp"
#include "tpm/plan/plan_scene.hpp"
#include "tpm/plan/shared_plan.hpp"
#include "tpm/sweep/scene_field.hpp"
#include "tpm/sweep/sweep_keys.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/model.hpp"

namespace tpm::sweep {
namespace {

using Kind = SweepOutput::Kind;

/// The organ in a sweep's document.
struct OrganSetup {
  explicit OrganSetup(const Json& of_scene) : scene(of_scene) {}

  Json scene;
  BondMaterial material;   ///< the scene's first
  ProtocolBlock protocol;  ///< of the scene
  std::filesystem::path folder;
  bool by_depth = true;
  std::optional<double> tolerance = std::nullopt;  ///< of the sweep; none: that of the scene
  std::vector<SweepOutput> outputs;
};

constexpr std::string_view kNetwork = "quasi_static";
constexpr const char* kIntegrator = "integrator";
constexpr double kLeastOfSweep = 1e-6, kMostOfSweep = 0.5;
constexpr double kLeastTolerance = 1e-12;  // of QuasiStaticOptions

enum OrganCount : std::size_t { kSteps, kIterations, kFactorisations, kBackSolves, kOrganCounts };

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

/// Tolerances of the network that a cell may run at, each a tenth of the one before.
constexpr std::array<double, 3> kNetworkShares{1e-1, 1e-2, 1e-3};

std::vector<std::string> names_of_models(double tolerance) {
  std::vector<std::string> names = SharedPlan::models();
  for (const double share : kNetworkShares) {
    names.push_back(fmt::format("collocation_{}", significant(share * tolerance, 2)));
  }
  return names;
}

/// Cost of a grid of claims for the cells that share organ and moduli, against running them.
struct SharedCost {
  double cells = 1.0;  ///< that share them
  double runs = 0.0;   ///< of the network, for the grid
  [[nodiscard]] bool grid_is_cheaper() const { return runs < cells; }
};

/// Least and largest of a quantity of the scene over the sweep, SI.
struct SceneRange {
  double least = 0.0, largest = 0.0;
};

SceneRange range_in_scene(const Json& scene, const std::string& target,
                          const std::vector<SweptTarget>& swept) {
  for (const SweptTarget& s : swept) {
    if (s.target == target) return {s.least, s.largest};
  }
  if (!target.starts_with('/')) return {};
  const Json::json_pointer pointer(target);
  if (!scene.contains(pointer)) return {};
  const auto text = scene.at(pointer).get<std::string>();
  const Unit unit = parse_unit(split_quantity(text).unit, target);
  const double value = parse_quantity(text, unit.dimension, target);
  return {value, value};
}

SharedCost cost_of_sharing(const OrganSetup& setup, const std::vector<SweptTarget>& swept) {
  SharedCost cost;
  const auto is_shared = [&](const std::string& target) {
    return SceneField(setup.scene, setup.material, target, "sweep").is_shared();
  };
  for (const SweptTarget& s : swept) {
    const bool counted = std::any_of(swept.begin(), swept.end(), [&](const SweptTarget& other) {
      return other.axis == s.axis && (!is_shared(other.target) || &other < &s);
    });
    if (!counted) cost.cells *= static_cast<double>(s.places);
  }
  const auto ratio = [&](const char* target) {
    const SceneRange r = range_in_scene(setup.scene, target, swept);
    return r.least > 0.0 ? r.largest / r.least : 1.0;
  };
  const double depths = ratio("/protocol/depth");
  const double lengths = ratio("/protocol/rate") * ratio("/material/eta1") * ratio("material.tau1");
  cost.runs = SharedPlan::cost_in_runs(depths, depths * lengths);
  return cost;
}

/// Plans that cells share, by the organ and the moduli that they are made for.
class SharedPlans {
 public:
  explicit SharedPlans(double tolerance) : tolerance_(tolerance) {}

  std::shared_ptr<SharedPlan> of(const std::string& key, const ExperimentScene& scene) {
    const std::scoped_lock lock(one_at_a_time_);
    constexpr std::size_t kKept = 4;
    const auto found = std::find_if(plans_.begin(), plans_.end(),
                                    [&](const auto& plan) { return plan.first == key; });
    if (found != plans_.end()) {
      std::rotate(plans_.begin(), found, found + 1);
      return plans_.front().second;
    }
    if (plans_.size() == kKept) plans_.pop_back();
    plans_.emplace(plans_.begin(), key, std::make_shared<SharedPlan>(scene, tolerance_));
    return plans_.front().second;
  }

 private:
  double tolerance_;
  std::mutex one_at_a_time_;
  std::vector<std::pair<std::string, std::shared_ptr<SharedPlan>>> plans_;  ///< last used first
};

/// Of the network, in a scene with a cell's values.
QuasiStaticOptions options_of(const Json& changed) {
  QuasiStaticOptions options;
  if (changed.contains(kIntegrator)) {
    options = integrator_block().read(changed.at(kIntegrator), {kIntegrator}, Numbers::also_si);
  }
  options.tolerance = changed.value("tolerance", options.tolerance);
  return options;
}

/// Puts material and protocol of a cell into its scene.
/// @param protocol of the scene as it stands in the file
void set_light(ExperimentScene& scene, const Json& changed, ProtocolBlock protocol,
               const std::vector<SceneField>& fields, std::span<const double> swept) {
  const DocumentPlace place{"scene"};
  const Json said = changed.value("material", Json::object());
  if (said.contains("E")) {
    throw bad_input(place.key("material").key("E").where, "of a scene that is swept",
                    "the moduli of its bonds, which tpm network build prints");
  }
  MaterialBlock material = parse_material(said, scene.tissue.materials.lateral(),
                                          scene.tissue.network.organ, place.key("material"));
  scene.tissue.materials = std::move(material.materials);
  scene.tissue.by_constants = material.by_constants;
  for (std::size_t i = 0; i < swept.size(); ++i) {
    fields[i].set(scene.tissue.materials.materials.front(), swept[i]);
    fields[i].set(protocol, swept[i]);
  }
  scene.protocol = protocol.protocol(place.key("protocol"));
  require_possible(scene.protocol, scene.contacts, scene.tissue, place.key("protocol"));
}

/// One organ after another.
class OrganCell final : public CellModel {
 public:
  /// @param plans none: all cells run on the network
  OrganCell(const OrganSetup& setup, const std::vector<SweptTarget>& swept, SharedPlans* plans)
      : setup_(setup), plans_(plans) {
    for (const SweptTarget& s : swept) {
      if (setup.tolerance && s.target == "/tolerance") {
        throw bad_input("sweep", "sweeps /tolerance and states a tolerance of its own",
                        "one of the two");
      }
      fields_.emplace_back(setup.scene, setup.material, s.target, "sweep");
    }
    if (setup.tolerance && !cost_of_sharing(setup, swept).grid_is_cheaper()) plans_ = nullptr;
  }

  CellAnswer run(std::span<const double> swept, std::span<double> values,
                 std::span<std::int64_t> counts) override {
    Json changed = setup_.scene;
    for (std::size_t i = 0; i < swept.size(); ++i) fields_[i].set(changed, swept[i]);
    std::string structure;
    const ExperimentScene scene = scene_of(swept, changed, structure);
    const AskedTimes times(scene.protocol, setup_.outputs);
    if (scene.formulation.kind != kNetwork) return on_formulation(scene, times, values, counts);
    if (plans_ != nullptr) {
      if (auto answer = on_reduced(scene, structure, times, values, counts)) return *answer;
    }
    return on_network(PlanScene(scene), changed, times, values, counts);
  }

 private:
  std::optional<CellAnswer> on_reduced(const ExperimentScene& scene, const std::string& structure,
                                       const AskedTimes& times, std::span<double> values,
                                       std::span<std::int64_t> counts) {
    if (!scene.tissue.is_element()) return {};    // regions are no part of the key
    if (scene.dead_load_N.size() > 0) return {};  // another sag for each material
    const BondElement p = scene.tissue.element();
    const std::string key = fmt::format("{} {} {} {} {} {}", structure, p.equilibrium_Pa,
                                        p.relaxing_Pa(), p.lateral_Pa, p.A0_m2, p.l0_m);
    if (plan_ == nullptr || key != plan_key_) {
      plan_ = plans_->of(key, scene);
      plan_key_ = key;
    }
    const auto answer = plan_->answer(scene.protocol, p.relaxation_time_s(), times.all());
    if (!answer) return {};
    counts[kSteps] = static_cast<std::int64_t>(answer->steps);
    fill(answer->response, scene.protocol, times, values);
    return CellAnswer{answer->claim, static_cast<std::uint8_t>(answer->model)};
  }

  /// Any formulation that runs scenes.
  CellAnswer on_formulation(const ExperimentScene& scene, const AskedTimes& times,
                            std::span<double> values, std::span<std::int64_t> counts) const {
    const Trajectory answer = run_scene(scene, times.all(), false);
    counts[kSteps] = static_cast<std::int64_t>(answer.steps);
    fill(answer.response, scene.protocol, times, values);
    const double peak = answer.response.cwiseAbs().maxCoeff();
    return {peak > 0.0 ? answer.error_estimate / peak : 0.0, 0};
  }

  CellAnswer on_network(const PlanScene& scene, const Json& changed, const AskedTimes& times,
                        std::span<double> values, std::span<std::int64_t> counts) const {
    QuasiStaticOptions options = options_of(changed);
    const DrivenNetwork& driven = scene.driven();
    const auto run_at = [&](double tolerance) {
      options.tolerance = tolerance;
      QuasiStaticRun run =
          QuasiStatic(driven.bonds, driven.rest, driven.constraints, driven.probes, options)
              .run(scene.protocol(), times.all());
      counts[kSteps] += run.work.steps;
      counts[kIterations] += run.work.iterations;
      counts[kFactorisations] += run.work.factorisations;
      counts[kBackSolves] += run.work.back_solves;
      return run;
    };
    const auto estimate_of = [](const QuasiStaticRun& run) {
      return run.error_estimate / run.response.cwiseAbs().maxCoeff();
    };
    if (!setup_.tolerance) {
      const QuasiStaticRun run = run_at(options.tolerance);
      fill(run.response, scene.protocol(), times, values);
      return {estimate_of(run), 0};
    }
    CellAnswer answer;
    for (std::size_t i = 0; i < kNetworkShares.size(); ++i) {
      const double tolerance = std::max(kNetworkShares[i] * *setup_.tolerance, kLeastTolerance);
      const QuasiStaticRun run = run_at(tolerance);
      // The estimate alone can be far below the error where few iterations were needed.
      answer.error_estimate = std::max(tolerance, estimate_of(run));
      answer.model = static_cast<std::uint8_t>(SharedPlan::models().size() + i);
      if (answer.error_estimate > *setup_.tolerance) continue;
      fill(run.response, scene.protocol(), times, values);
      return answer;
    }
    throw Error(ExitCode::numerical, "network",
                fmt::format("its error is estimated as {} of the peak",
                            significant(answer.error_estimate, 2)),
                "a smaller tolerance");
  }

  /// The scene with the cell's values. Finding the spheres and their bonds takes much longer than
  /// a run: they are kept while only the material and the protocol change. They are always those
  /// of the scene's own material and protocol, so that no cell depends on which one was before.
  ExperimentScene scene_of(std::span<const double> swept, const Json& changed, std::string& key) {
    Json texts = setup_.scene;  // as the schema knows it: with quantities as in the file
    texts.erase(kIntegrator);
    Json structure = texts;
    for (std::size_t i = 0; i < swept.size(); ++i) {
      if (fields_[i].is_light()) continue;
      fields_[i].set(structure, swept[i]);
      if (!fields_[i].is_quantity()) fields_[i].set(texts, swept[i]);
    }
    key = structure.dump();
    ExperimentScene scene = base_of(structure, key, texts);
    set_light(scene, changed, setup_.protocol, fields_, swept);
    return scene;
  }

  /// The last few are kept: a design of sensitivities goes back and forth between two organs.
  const ExperimentScene& base_of(const Json& structure, const std::string& key, const Json& texts) {
    constexpr std::size_t kKept = 4;
    const auto found = std::find_if(bases_.begin(), bases_.end(),
                                    [&](const auto& base) { return base.first == key; });
    if (found != bases_.end()) {
      std::rotate(bases_.begin(), found, found + 1);
      return bases_.front().second;
    }
    if (bases_.size() == kKept) bases_.pop_back();
    (void)checked(texts, scene_kind(), "scene");
    bases_.emplace(bases_.begin(), key,
                   parse_checked_experiment(structure, "scene", setup_.folder));
    return bases_.front().second;
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
        case Kind::instantaneous_creep_depth:
          values[next++] = at(start);
          break;
        default:
          values[next++] = at(protocol.end_s());
      }
    }
  }

  const OrganSetup& setup_;
  SharedPlans* plans_;
  std::shared_ptr<SharedPlan> plan_;
  std::string plan_key_;
  std::vector<SceneField> fields_;
  /// By their structure, the last used first.
  std::vector<std::pair<std::string, ExperimentScene>> bases_;
};

class OrganSweepModel final : public SweepModel {
 public:
  explicit OrganSweepModel(OrganSetup setup)
      : setup_(std::move(setup)), plans_(setup_.tolerance.value_or(0.0)) {
    for (const SweepOutput& output : setup_.outputs) variables_.push_back(output.variable);
  }

  [[nodiscard]] Dimension dimension_of(const std::string& target,
                                       std::string_view where) const override {
    return SceneField(setup_.scene, setup_.material, target, where).dimension();
  }
  [[nodiscard]] const std::vector<SweepVariable>& variables() const override { return variables_; }
  [[nodiscard]] std::vector<std::string> counted() const override {
    return {"steps", "iterations", "factorisations", "back_solves"};
  }
  [[nodiscard]] std::uint64_t usual_block() const override { return 8; }
  [[nodiscard]] std::unique_ptr<CellModel> cell_model(
      const std::vector<SweptTarget>& swept) const override {
    return std::make_unique<OrganCell>(setup_, swept, setup_.tolerance ? &plans_ : nullptr);
  }
  [[nodiscard]] std::vector<std::string> models() const override {
    return setup_.tolerance ? names_of_models(*setup_.tolerance) : std::vector<std::string>{};
  }
  [[nodiscard]] std::string choice_of_models(const std::vector<SweptTarget>& swept) const override {
    if (!setup_.tolerance) return {};
    const SharedCost cost = cost_of_sharing(setup_, swept);
    return fmt::format(
        "{} cells share organ and moduli; claims of reduced models for them cost {} "
        "runs of the network: {}",
        significant(cost.cells, 6), significant(cost.runs, 3),
        cost.grid_is_cheaper() ? "the cheapest model that claims to be within the tolerance"
                               : "the network, at the coarsest tolerance that is enough");
  }

 private:
  OrganSetup setup_;
  mutable SharedPlans plans_;  ///< does not change what is found
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

/// A scene may have more kinds of protocols than those whose numbers a sweep knows by name.
void require_swept_kind(const Json& protocol, const DocumentPlace& place) {
  const auto& kind = protocol.at("kind").get_ref<const std::string&>();
  std::vector<std::string> known;
  for (const auto& word : kProtocolKindWords) known.emplace_back(word.text);
  if (std::find(known.begin(), known.end(), kind) != known.end()) return;
  throw bad_input(place.key("kind").where, fmt::format("a sweep does not vary a '{}'", kind),
                  fmt::format("one of {}", fmt::join(known, ", ")));
}

}  // namespace

std::shared_ptr<const SweepModel> organ_sweep_model(const SweepKeys& keys, std::string_view where,
                                                    const std::filesystem::path& folder) {
  const DocumentPlace place{std::string(where)};
  OrganSetup setup(keys.scene);
  setup.folder = folder;
  setup.tolerance = keys.tolerance;
  const bool stepped = !keys.integrator.is_null();
  if (setup.tolerance && stepped) {
    throw bad_input(place.key("tolerance").where, "beside an integrator", "one of the two");
  }
  setup.outputs = outputs_of(keys.outputs, place.key("outputs"));
  require_one_protocol(setup.scene, place.key("scene"));
  const ExperimentScene scene =
      parse_experiment(setup.scene, fmt::format("{}: scene", where), folder);
  if (scene.formulation.mass_spring) {
    throw bad_input(place.key("scene").where, "runs the mass-spring model",
                    "the tissue: without a comparison");
  }
  require_runnable(scene);
  if (scene.formulation.kind != kNetwork && (setup.tolerance || stepped)) {
    throw bad_input(place.key(setup.tolerance ? "tolerance" : kIntegrator).where,
                    fmt::format("beside the formulation '{}'", scene.formulation.kind),
                    fmt::format("a scene of the formulation '{}'", kNetwork));
  }
  // Of the sweep, not of the scene; here where pointers find it.
  if (stepped) setup.scene[kIntegrator] = keys.integrator;
  const DocumentPlace at_protocol = place.key("scene").key("protocol");
  require_swept_kind(setup.scene.at("protocol"), at_protocol);
  setup.protocol =
      parse_protocol_block(setup.scene.at("protocol"), at_protocol, Openness::complete);
  setup.material = scene.tissue.materials.materials.front();
  setup.by_depth = scene.by_depth();
  require_outputs(setup, place.key("outputs"));
  return std::make_shared<OrganSweepModel>(std::move(setup));
}

}  // namespace tpm::sweep
