// Declared in tpmkit/model.hpp.
// Apart from model.cpp: a program that asks for no model by its name is linked without the list of
// formulations.
#include "tpmkit/formulation.hpp"
#include "tpmkit/model.hpp"

namespace tpm {

std::unique_ptr<Model> make_model(std::string_view name, const ModelOptions& options) {
  return formulation_with<ModelMaker>(name, "formulation", "model")
      .as<ModelMaker>()
      ->model(options);
}

}  // namespace tpm
