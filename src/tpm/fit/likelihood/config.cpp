#include "tpm/fit/likelihood/config.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/lists.hpp"
#include "tpm/fit/likelihood/config_parts.hpp"
#include "tpm/fit/likelihood/fit_keys.hpp"
#include "tpm/organ/scene/organ_model.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/formulation.hpp"
#include "tpmkit/law_model.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::fit {

namespace {

LawSpec law_of(const StatedLaw& stated) {
  LawSpec spec = parse_law_name(stated.name.value, stated.name.place.where);
  spec.drive = stated.drive;
  if (is_answered_by_stress(spec.drive)) spec.response = Quantity::stress;
  spec.reference = stated.reference.in(quantity_dimension(spec.drive));
  require_valid(spec, stated.place.where);
  return spec;
}

/// The organ of the scene that a configuration names, ready for experiments.
std::shared_ptr<const Tissue> organ_of(const std::filesystem::path& scene) {
  auto tissue = std::make_shared<Tissue>(read_tissue(scene));
  require_standing(*tissue, scene.string());
  require_free_contact(*tissue, scene.string());
  return tissue;
}

/// The model: a law, an organ or a formulation of the paper's element.
void set_model(const StatedFit& stated, FitConfig& config) {
  if (stated.law) {
    config.law = law_of(*stated.law);
    return;
  }
  config.tension = {stated.tension.value_or(config.tension.kind), 0.0};
  if (!stated.model) return;
  config.model = stated.model->value;
  if (config.model == kOrganModel) {
    config.organ = organ_of(config.folder / config.scene);
    return;
  }
  const auto makes = [](const Formulation& f) { return f.as<ModelMaker>() != nullptr; };
  const Formulation* found = find_formulation(config.model);
  if (found != nullptr && makes(*found)) return;
  refuse_formulation(config.model, "model", stated.model->place.where,
                     fmt::format("{}, {}", formulations_that(makes), kOrganModel));
}

void require_sound_element(const FitConfig& config, const DocumentPlace& place) {
  if (!has_element(config)) return;
  TpmVector fixed{};
  std::copy(config.fixed.begin(), config.fixed.end(), fixed.begin());
  require_valid(from_vector(fixed), place.key("fixed").where);
}

BootstrapOptions bootstrap_of(const StatedBootstrap& stated, const FitConfig& config) {
  BootstrapOptions options = stated.options;
  options.seed = stated.seed.value_or(config.seed);
  options.level = config.level;
  return options;
}

}  // namespace

bool Target::applies_to(std::size_t choice) const {
  return data.empty() || std::find(data.begin(), data.end(), choice) != data.end();
}

std::unique_ptr<Model> make_model(const FitConfig& config) {
  if (config.law) return std::make_unique<LawModel>(*config.law);
  if (config.organ) return std::make_unique<OrganModel>(config.organ);
  return tpm::make_model(config.model, {config.tension, 1e-10});
}

std::vector<FitParameter> searched_parameters(const FitConfig& config) {
  return mapped<FitParameter>(config.parameters, &EstimatedParameter::fit);
}

int prior_count(const FitConfig& config) {
  return static_cast<int>(std::ranges::count_if(
      config.parameters, [](const EstimatedParameter& p) { return p.prior.has_value(); }));
}

std::vector<double> model_parameters(const FitConfig& config, std::span<const double> natural,
                                     std::size_t choice) {
  std::vector<double> values = config.fixed;
  for (std::size_t i = 0; i < config.parameters.size(); ++i) {
    for (const Target& target : config.parameters[i].sets) {
      if (target.applies_to(choice)) values[target.parameter] = natural[i];
    }
  }
  return values;
}

bool has_element(const FitConfig& config) {
  return !config.law && (!config.organ || OrganModel(config.organ).has_element());
}

TpmVector fitted_element(const FitConfig& config, std::span<const double> natural) {
  if (!has_element(config)) {
    throw bad_input("fit", "the model is not the paper's element", "E1, E2, Eprime and eta1");
  }
  const std::vector<double> values = model_parameters(config, natural, 0);
  TpmVector vector{};
  std::copy(values.begin(), values.end(), vector.begin());
  return vector;
}

FitConfig parse_fit_config(const Json& document, std::string_view where,
                           const std::filesystem::path& folder) {
  const StatedFit stated = stated_fit(document, where);
  const DocumentPlace place{std::string(where)};
  FitConfig config = stated.config;
  config.folder = folder;
  set_model(stated, config);
  config.data = data_of(stated.data, config);
  const std::unique_ptr<Model> model = make_model(config);
  config.parameters = parameters_of(stated, *model, config);
  config.fixed = fixed_values(stated.fixed, *model, config);
  require_each_set_once(config, *model, stated.fixed, place);
  require_sound_element(config, place);
  if (stated.bootstrap) config.bootstrap = bootstrap_of(*stated.bootstrap, config);
  config.hypotheses = hypotheses_of(stated.hypotheses, config);
  return config;
}

FitConfig read_fit_config(const std::filesystem::path& path) {
  return parse_fit_config(read_json(path), path.string(), path.parent_path());
}

}  // namespace tpm::fit
