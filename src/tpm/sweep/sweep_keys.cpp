#include "tpm/sweep/sweep_keys.hpp"

#include "tpm/files/blocks/protocol_block.hpp"
#include "tpm/files/keys/more_types.hpp"
#include "tpm/sweep/sweep_outputs.hpp"

namespace tpm::sweep {
namespace {

constexpr double kLargestWhole = 9007199254740991.0;  // 2^53 - 1

FormPtr quantity_form(Dimension dimension, Range range = {}) {
  return files::quantity(dimension, range).form;
}

FormPtr name_form() {
  return text_like("^[A-Za-z_][A-Za-z0-9_]*$", "letters, digits and _, no digit first", "E1")
      .named("sweep_name", "letters, digits and _, no digit first")
      .form;
}

/// Of a parameter whose dimension the model knows.
FormPtr value_form() {
  static const FormPtr form = shared(
      {.type = Form::Type::either,
       .name = "value",
       .sentence = "a number and a unit, such as \"20 mm\", or a number where there is no unit",
       .forms = {text(1).form, number().form}});
  return form;
}

FormPtr scale_form() {
  return one_of({"linear", "log"}).form;
}

/// The keys of a list or of a range of values.
std::vector<KeyForm> value_keys(const FormPtr& value) {
  return {optional_key("values", list_form(value, 1), "one after the other"),
          optional_key("from", value, "the first"), optional_key("to", value, "the last"),
          optional_key("count", whole<std::uint64_t>(1, 1e12).form, "how many from end to end"),
          optional_key("scale", scale_form(), "how they lie between the ends; default linear")};
}

std::vector<KeyForm> with(KeyForm first, std::vector<KeyForm> others) {
  others.insert(others.begin(), std::move(first));
  return others;
}

FormPtr axis_form() {
  const KeyForm name =
      optional_key("name", name_form(), "in expressions and results; default that of what changes");
  std::vector<KeyForm> single = with(
      required_key("parameter", text(1).form,
                   "a parameter of the model: spacing, depth, ...; organ: a parameter of its "
                   "material by name, such as material.tau2, or a JSON pointer into the scene, "
                   "such as /protocol/depth"),
      with(name, value_keys(value_form())));
  const FormPtr one_of_many = object_form(
      "listed_values", "values of one parameter",
      {name, required_key("values", list_form(value_form(), 1), "one after the other")});
  const FormPtr two_ends = object_form(
      "two_ends", "the ends of one parameter",
      {name, required_key("from", value_form(), "one end"),
       required_key("to", value_form(), "the other"),
       optional_key("scale", scale_form(), "how points lie between the ends; default linear")});
  Form form{.type = Form::Type::kinds, .name = "axis", .sentence = "what changes, and how"};
  form.by = "";
  form.kinds = {
      {"parameter", "one parameter, by a list of values or a range", std::move(single)},
      {"together",
       "parameters with a list of values each, which go on together",
       {required_key("together", map_form(one_of_many, 1), "by the parameters' names"), name}},
      {"samples",
       "points between the ends of parameters",
       {required_key(
            "samples",
            one_of({"random", "latin_hypercube", "sobol", "plain_sobol", "sensitivity"}).form,
            "how they are spread; sobol is scrambled"),
        name, required_key("count", whole<std::uint64_t>(1, 1e12).form, "how many"),
        optional_key("seed", whole<std::uint64_t>(0, kLargestWhole).form, "default 0"),
        optional_key("replicates", whole<std::uint64_t>(2, 1e6).form,
                     "sensitivity: independent scramblings of 'count' points each"),
        required_key("parameters", map_form(two_ends, 1), "by the parameters' names")}}};
  return shared(std::move(form));
}

FormPtr output_form() {
  const FormPtr times = object_form("times", "rising times, as a list or a range",
                                    value_keys(quantity_form(Dimension::time, kZeroOrMore)));
  const KeyForm name = required_key("name", name_form(), "in results and formulas");
  Form named{
      .type = Form::Type::kinds, .name = "named_output", .sentence = "an output with a name"};
  named.by = "";
  std::vector<std::string> words;
  for (const OutputForm& output : output_forms()) {
    if (output.when == OutputForm::When::fixed) {
      words.emplace_back(output.text);
      continue;
    }
    const FormPtr when =
        output.when == OutputForm::When::at ? quantity_form(Dimension::time, kZeroOrMore) : times;
    const std::string word(output.text);
    named.kinds.push_back(
        {word, std::string(output.words), {required_key(word, when, "when"), name}});
  }
  named.kinds.push_back({"formula",
                         "of parameters and outputs before it, SI",
                         {required_key("formula", text(1).form, "an expression"), name}});
  return either_form({one_of(std::move(words)).form, shared(std::move(named))});
}

/// The keys of both models, and those of one.
std::vector<KeyForm> keys_with(std::vector<KeyForm> of_model) {
  const FormPtr skip = object_form(
      "skip", "cells that are not run",
      {required_key("when", text(1).form,
                    "an expression of the parameters in SI units, such as \"depth > spacing / 2\""),
       optional_key("reason", text().form, "in words; default the expression")});
  std::vector<KeyForm> keys{
      optional_key("title", text().form, "what the sweep is"),
      optional_key("description", text().form, "what else is to be said"),
      required_key("axes", list_form(axis_form(), 1, 24),
                   "every combination of their places is a cell; the last "
                   "axis changes fastest"),
      required_key("outputs", list_form(output_form(), 1), "what is found for each cell"),
      optional_key("skip", list_form(skip, 0), "cells that are not run"),
      optional_key("block", whole<std::uint64_t>(1, 65535).form,
                   "cells that are computed and stored together; default: "
                   "what fills about a megabyte")};
  keys[2].example = Json::array({Json{{"parameter", "E1"}, {"values", {"10 kPa", "12 kPa"}}}});
  keys[3].example = Json::array({"peak_force"});
  std::move(of_model.begin(), of_model.end(), std::back_inserter(keys));
  return keys;
}

FormPtr element_form() {
  const auto modulus = [](const char* name) {
    return optional_key(name, quantity_form(Dimension::stress),
                        "the paper's constant of this name");
  };
  return object_form("element", "the paper's element; defaults are its constants",
                     {modulus("E1"), modulus("E2"), modulus("Eprime"),
                      optional_key("eta1", quantity_form(Dimension::viscosity), "viscosity"),
                      optional_key("spacing", quantity_form(Dimension::length), "of the spheres"),
                      optional_key("A0", quantity_form(Dimension::area), "cross section"),
                      optional_key("l0", quantity_form(Dimension::length), "length at rest")});
}

/// A protocol whose missing numbers have to be swept.
FormPtr indentation_form() {
  Form form = with_open_keys(*protocol_kinds().form());
  form.name = "indentation";
  form.sentence = "of the single contact; what is not given has to be swept";
  std::erase_if(form.kinds, [](const KindForm& kind) {
    return kind.word != "ramp_hold" && kind.word != "step_hold";
  });
  return shared(std::move(form));
}

FormPtr creep_form() {
  return object_form(
      "constant_load", "of the single contact; what is not given has to be swept",
      {optional_key("load", quantity_form(Dimension::force, kZeroOrMore), "the load"),
       optional_key("duration", quantity_form(Dimension::time, kZeroOrMore),
                    "without it: for ever")});
}

FormPtr sweep_form() {
  const FormPtr scene = shared({.type = Form::Type::map, .item = any("").form});
  const FormPtr integrator = object_form(
      "integrator", "steps of one length",
      {required_key("step", quantity_form(Dimension::time, kAboveZero), "every step is that long"),
       optional_key("stages", whole<int>(2, 8).form,
                    "Radau nodes of a step: order 2 stages - 1; default 8")});
  Form form{.type = Form::Type::kinds, .name = "sweep"};
  form.by = "model";
  KeyForm indentation = optional_key("indentation", indentation_form(), "a protocol of the depth");
  indentation.example = Json{{"kind", "step_hold"}, {"depth", "4 mm"}};
  form.kinds = {
      {"single_contact", "the paper's star in closed form",
       keys_with({optional_key("material", element_form(), "of the contact"), indentation,
                  optional_key("creep", creep_form(), "a constant load")})},
      {"organ", "the quasi-static network of a scene",
       keys_with(
           {required_key("scene", either_form({text(1).form, scene}),
                         "a scene of tpm simulate, or its file, relative to this one"),
            optional_key("tolerance",
                         quantity_form(Dimension::dimensionless, {.least = 1e-6, .most = 0.5}),
                         "of the response, in parts of its peak, such as \"1 %\"; each cell then "
                         "runs on the cheapest model that claims to be within it. Default: the "
                         "network at the scene's own tolerance"),
            optional_key("integrator", integrator,
                         "instead of steps that follow the tolerance; its keys can be swept as "
                         "/integrator/step and /integrator/stages")})}};
  return shared(std::move(form));
}

}  // namespace

const FileKind& sweep_kind() {
  static const FileKind kind{
      "sweep", "A sweep of tpm sweep",
      "A model, the parameters that are changed, and what is found for each combination. "
      "Quantities are texts of a number and a unit, such as \"20 mm\"",
      sweep_form()};
  return kind;
}

}  // namespace tpm::sweep
