#include "tpm/fit/likelihood/config.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/lists.hpp"
#include "tpm/fit/likelihood/config_parts.hpp"
#include "tpm/fit/likelihood/experiment_refit.hpp"
#include "tpm/fit/likelihood/fit_keys.hpp"
#include "tpm/organ/scene/organ_model.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/formulation.hpp"
#include "tpmkit/law_model.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::fit {

namespace {

/// A robust loss stands for a likelihood that nobody wrote down: nothing that needs one goes with
/// it.
void require_plain_noise_under_loss(const FitConfig& config, const DocumentPlace& place) {
  if (config.loss.kind == Loss::none) return;
  for (const DataChoice& data : config.data) {
    if (data.noise.shape == ErrorShape::normal && !data.estimates_sigma()) continue;
    throw bad_input(place.key("loss").where,
                    "beside a noise distribution or an estimated standard deviation",
                    "either a loss, or a likelihood such as 'student_t'");
  }
}

constexpr std::string_view kOrganModel = "organ";

BootstrapOptions parse_bootstrap(const Json& j, const FitConfig& config,
                                 const DocumentPlace& place) {
  BootstrapOptions options;
  options.replicates = j.value("replicates", options.replicates);
  options.seed = j.value("seed", config.seed);
  options.level = config.level;
  options.block_length = j.value("block_length", options.block_length);
  options.resampling =
      parse_resampling(j.value("resample", std::string(resampling_name(options.resampling))),
                       place.key("resample").where);
  return options;
}

LawSpec parse_law(const Json& j, const DocumentPlace& place) {
  LawSpec spec = parse_law_name(j.at("name").get<std::string>(), place.key("name").where);
  const std::string drive = j.value("drive", std::string(quantity_name(spec.drive)));
  spec.drive = parse_quantity_name(drive, place.key("drive").where);
  if (is_answered_by_stress(spec.drive)) spec.response = Quantity::stress;
  spec.reference = quantity_at(j, "reference", quantity_dimension(spec.drive), place);
  require_valid(spec, place.where);
  return spec;
}

/// The organ of the scene that the document names, ready for experiments.
void read_organ(const Json& document, FitConfig& config, const std::filesystem::path& folder,
                const DocumentPlace& place) {
  const bool wanted = config.model == kOrganModel;
  if (!wanted && !config.law) {
    const auto makes = [](const Formulation& f) { return f.as<ModelMaker>() != nullptr; };
    const Formulation* found = find_formulation(config.model);
    if (found == nullptr || !makes(*found)) {
      refuse_formulation(config.model, "model", place.key("model").where,
                         fmt::format("{}, {}", formulations_that(makes), kOrganModel));
    }
  }
  if (wanted != document.contains("scene")) {
    throw bad_input(place.key("scene").where, wanted ? "missing" : "without the model 'organ'",
                    "\"model\": \"organ\" and the scene that holds the organ, or neither");
  }
  if (!wanted) return;
  if (config.tension.kind != TensionRule::Kind::exact) {
    throw bad_input(place.key("tension").where, "a rule for lambda1 beside the model 'organ'",
                    "no tension: the bonds of a network pull along themselves");
  }
  config.scene = document.at("scene").get<std::string>();
  const std::filesystem::path path = folder / config.scene;
  auto tissue = std::make_shared<Tissue>(read_tissue(path));
  require_standing(*tissue, path.string());
  config.organ = std::move(tissue);
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

FitConfig parse_fit_config(const Json& written, std::string_view where,
                           const std::filesystem::path& folder) {
  const Json document = checked(written, fit_kind(), where);
  const DocumentPlace place{std::string(where)};
  FitConfig config;
  config.folder = folder;
  config.title = document.at("title").get<std::string>();
  config.model = document.value("model", config.model);
  if (document.value("tension", "exact") == "frozen_at_peak") {
    config.tension = TensionRule::frozen_at_peak();
  }
  read_organ(document, config, folder, place);
  if (document.contains("law")) {
    if (document.contains("model") || document.contains("tension")) {
      throw bad_input(place.key("law").where, "beside 'model' or 'tension'",
                      "either a law of the family or a formulation of the paper's element");
    }
    config.law = parse_law(document.at("law"), place.key("law"));
  }
  std::size_t index = 0;
  for (const auto& j : document.at("data")) {
    config.data.push_back(parse_data(j, config, place.key("data").key(std::to_string(index++))));
  }
  name_noise_parameters(config);
  const std::unique_ptr<Model> model = make_model(config);
  parse_parameters(document, *model, config, place);
  config.fixed = parse_fixed(document, *model, config, place);
  require_each_set_once(config, *model, document, place);
  if (has_element(config)) {
    TpmVector fixed{};
    std::copy(config.fixed.begin(), config.fixed.end(), fixed.begin());
    require_valid(from_vector(fixed), place.key("fixed").where);
  }
  if (document.contains("loss")) {
    const Json& loss = document.at("loss");
    config.loss.kind = parse_loss(loss.at("kind").get<std::string>(), place.key("loss").where);
    config.loss.width = loss.value("width", config.loss.width);
    require_plain_noise_under_loss(config, place);
  }
  config.adjust_correlation = document.value("correlation", "adjust") == "adjust";
  if (document.contains("starts")) {
    config.starts = document.at("starts").value("count", config.starts);
    config.seed = document.at("starts").value("seed", config.seed);
  }
  if (document.contains("profile")) {
    config.level = document.at("profile").value("level", config.level);
    config.profiles = document.at("profile").value("enabled", true);
  }
  if (document.contains("bootstrap")) {
    config.bootstrap = parse_bootstrap(document.at("bootstrap"), config, place.key("bootstrap"));
  }
  if (document.contains("hypotheses")) {
    parse_hypotheses(document.at("hypotheses"), config, place.key("hypotheses"));
  }
  for (const DataChoice& data : config.data) {
    if (data.noise.scale_known == config.scale_known()) continue;
    throw bad_input(place.key("data").where, "some noise scales are known and others estimated",
                    "all known or all estimated");
  }
  return config;
}

FitConfig read_fit_config(const std::filesystem::path& path) {
  return parse_fit_config(read_json(path), path.string(), path.parent_path());
}

}  // namespace tpm::fit
