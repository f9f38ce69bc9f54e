#include "tpm/sweep/sweep_keys.hpp"

#include <algorithm>
#include <array>

#include "tpm/base/enum_names.hpp"
#include "tpm/files/keys/more_types.hpp"

namespace tpm::sweep {
namespace {

constexpr double kLargestWhole = 9007199254740991.0;  // 2^53 - 1

constexpr auto kScaleWords = std::to_array<Word<AxisScale>>({
    {AxisScale::linear, "linear"},
    {AxisScale::logarithmic, "log"},
});

constexpr auto kPointWords = std::to_array<Word<PointKind>>({
    {PointKind::random, "random"},
    {PointKind::latin_hypercube, "latin_hypercube"},
    {PointKind::sobol, "sobol"},
    {PointKind::plain_sobol, "plain_sobol"},
    {PointKind::sensitivity, "sensitivity"},
});

ValueType<std::string> name_type() {
  return text_like("^[A-Za-z_][A-Za-z0-9_]*$", "letters, digits and _, no digit first", "E1")
      .named("sweep_name", "letters, digits and _, no digit first");
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

Key<ValueKeys> values_key(const FormPtr& value) {
  return key("values", &ValueKeys::values, list(as_json(value), {.fewest = 1}),
             "one after the other");
}

Key<ValueKeys> scale_key(const char* sentence) {
  return key("scale", &ValueKeys::scale, word(kScaleWords), sentence);
}

/// The keys of a list or of a range of values.
std::vector<Key<ValueKeys>> value_keys(const FormPtr& value) {
  return {
      values_key(value), key("from", &ValueKeys::from, as_json(value), "the first"),
      key("to", &ValueKeys::to, as_json(value), "the last"),
      key("count", &ValueKeys::count, whole<std::uint64_t>(1, 1e12), "how many from end to end"),
      scale_key("how they lie between the ends; default linear")};
}

Key<ValueKeys> parameter_name_key() {
  return key("name", &ValueKeys::name, name_type(),
             "in expressions and results; default that of what changes");
}

const Block<ValueKeys>& listed_values_block() {
  static const Block<ValueKeys> block("listed_values", "values of one parameter",
                                      {parameter_name_key(), required(values_key(value_form()))});
  return block;
}

const Block<ValueKeys>& two_ends_block() {
  static const Block<ValueKeys> block(
      "two_ends", "the ends of one parameter",
      {parameter_name_key(),
       required(key("from", &ValueKeys::from, as_json(value_form()), "one end")),
       required(key("to", &ValueKeys::to, as_json(value_form()), "the other")),
       scale_key("how points lie between the ends; default linear")});
  return block;
}

const Block<ValueKeys>& times_block() {
  static const Block<ValueKeys> block("times", "rising times, as a list or a range",
                                      value_keys(quantity(Dimension::time, kZeroOrMore).form));
  return block;
}

/// Those that stand in an object, with a name.
const Kinds<SweepOutputKeys, std::optional<SweepOutput::Kind>>& named_outputs() {
  using Named = files::Kind<SweepOutputKeys, std::optional<SweepOutput::Kind>>;
  const auto made = [] {
    const Key<SweepOutputKeys> name =
        required(key("name", &SweepOutputKeys::name, name_type(), "in results and formulas"));
    std::vector<Named> kinds;
    for (const OutputForm& output : output_forms()) {
      if (output.when == OutputForm::When::fixed) continue;
      const std::string word(output.text);
      Key<SweepOutputKeys> when =
          output.when == OutputForm::When::at
              ? key(word, &SweepOutputKeys::time_s, quantity(Dimension::time, kZeroOrMore), "when")
              : key(word, &SweepOutputKeys::times, times_block().type(), "when");
      kinds.push_back(
          {output.meaning, word, std::string(output.words), {required(std::move(when)), name}});
    }
    const Key<SweepOutputKeys> formula =
        key("formula", &SweepOutputKeys::formula, text(1), "an expression");
    kinds.push_back({std::nullopt,
                     "formula",
                     "of parameters and outputs before it, SI",
                     {required(formula), name}});
    return Kinds<SweepOutputKeys, std::optional<SweepOutput::Kind>>(
        {.name = "named_output", .sentence = "an output with a name", .by = ""},
        &SweepOutputKeys::kind, std::move(kinds));
  };
  static const auto kinds = made();
  return kinds;
}

/// A word, whose name is the word, or an object with a name.
ValueType<SweepOutputKeys> output_type() {
  std::vector<std::string> words;
  for (const OutputForm& output : output_forms()) {
    if (output.when == OutputForm::When::fixed) words.emplace_back(output.text);
  }
  return {either_form({one_of(std::move(words)).form, named_outputs().form()}),
          [](const Json& value, const DocumentPlace& place) {
            if (!value.is_string()) return named_outputs().made(value, place);
            SweepOutputKeys plain;
            plain.name = value.get<std::string>();
            plain.kind = find_entry(output_forms(), plain.name)->meaning;
            return plain;
          },
          [](const SweepOutputKeys& output) {
            const auto of_name = output_forms();
            const auto* plain = find_entry(of_name, output.name);
            return plain != nullptr && plain->meaning == output.kind
                       ? Json(output.name)
                       : named_outputs().write(output);
          }};
}

/// The keys of both subjects, and those of one.
std::vector<Key<SweepKeys>> keys_with(std::vector<Key<SweepKeys>> of_subject) {
  static const Block<SkipCondition> skip(
      "skip", "cells that are not run",
      {required(
           key("when", &SkipCondition::when, text(1),
               "an expression of the parameters in SI units, such as \"depth > spacing / 2\"")),
       key("reason", &SkipCondition::reason, text(), "in words; default the expression")});
  std::vector<Key<SweepKeys>> keys{
      key("title", &SweepKeys::title, text_if_any(), "what the sweep is"),
      key("description", &SweepKeys::description, text_if_any(), "what else is to be said"),
      required(with_example(
          key("axes", &SweepKeys::axes, list(axis_kinds().type(), {.fewest = 1, .most = 24}),
              "every combination of their places is a cell; the last axis changes fastest"),
          Json::array({Json{{"parameter", "E1"}, {"values", {"10 kPa", "12 kPa"}}}}))),
      required(with_example(key("outputs", &SweepKeys::outputs, list(output_type(), {.fewest = 1}),
                                "what is found for each cell"),
                            Json::array({"peak_force"}))),
      key("skip", &SweepKeys::skip, list(skip.type()), "cells that are not run"),
      key("block", &SweepKeys::block, whole<std::uint64_t>(1, 65535),
          "cells that are computed and stored together; default: what fills about a megabyte")};
  std::move(of_subject.begin(), of_subject.end(), std::back_inserter(keys));
  return keys;
}

const Block<TpmParameters>& element_block() {
  const auto modulus = [](const char* name, double TpmParameters::*member) {
    return key(name, member, quantity(Dimension::stress), "the paper's constant of this name");
  };
  static const Block<TpmParameters> block(
      "element", "the paper's element; defaults are its constants",
      {modulus("E1", &TpmParameters::E1_Pa), modulus("E2", &TpmParameters::E2_Pa),
       modulus("Eprime", &TpmParameters::Eprime_Pa),
       key("eta1", &TpmParameters::eta1_Pa_s, quantity(Dimension::viscosity), "viscosity"),
       key("spacing", &TpmParameters::spacing_m, quantity(Dimension::length), "of the spheres"),
       key("A0", &TpmParameters::A0_m2, quantity(Dimension::area), "cross section"),
       key("l0", &TpmParameters::l0_m, quantity(Dimension::length), "length at rest")});
  return block;
}

/// A protocol whose missing numbers have to be swept.
ValueType<ProtocolBlock> indentation_type() {
  Form form = with_open_keys(*protocol_kinds().form());
  form.name = "indentation";
  form.sentence = "of the single contact; what is not given has to be swept";
  std::erase_if(form.kinds, [](const KindForm& kind) {
    return kind.word != "ramp_hold" && kind.word != "step_hold";
  });
  ValueType<ProtocolBlock> type = protocol_kinds().type();
  type.form = shared(std::move(form));
  return type;
}

const Block<ProtocolBlock>& creep_block() {
  const auto made = [] {
    std::vector<Key<ProtocolBlock>> keys = protocol_kinds().keys(ProtocolKind::creep);
    for (Key<ProtocolBlock>& key : keys) key.form.required = false;
    return Block<ProtocolBlock>(
        "constant_load",
        "of the single contact; without a load it has to be swept, without a duration it is kept "
        "for ever",
        std::move(keys));
  };
  static const Block<ProtocolBlock> block = made();
  return block;
}

FormPtr scene_form() {
  return either_form({text(1).form, shared({.type = Form::Type::map, .item = any("").form})});
}

}  // namespace

const Kinds<AxisKeys, AxisKind>& axis_kinds() {
  const auto made = [] {
    using AxisOf = files::Kind<AxisKeys, AxisKind>;
    const Key<AxisKeys> name = key("name", &AxisKeys::name, name_type(),
                                   "in expressions and results; default that of what changes");
    std::vector<Key<AxisKeys>> single{
        required(key("parameter", &AxisKeys::parameter, text(1),
                     "a parameter of the model: spacing, depth, ...; organ: a parameter of its "
                     "material by name, such as material.tau2, or a JSON pointer into the scene, "
                     "such as /protocol/depth")),
        name};
    for (const Key<ValueKeys>& one : value_keys(value_form())) {
      single.push_back(within(&AxisKeys::values, one));
    }
    const auto by_name = [](const char* word, const Block<ValueKeys>& block) {
      return required(
          key(word, &AxisKeys::parameters, map_of(block.type(), 1), "by the parameters' names"));
    };
    std::vector<AxisOf> kinds{
        {AxisKind::single, "parameter", "one parameter, by a list of values or a range", single},
        {AxisKind::together,
         "together",
         "parameters with a list of values each, which go on together",
         {by_name("together", listed_values_block()), name}},
        {AxisKind::samples,
         "samples",
         "points between the ends of parameters",
         {required(key("samples", &AxisKeys::points, word(kPointWords),
                       "how they are spread; sobol is scrambled")),
          name, required(key("count", &AxisKeys::count, whole<std::uint64_t>(1, 1e12), "how many")),
          key("seed", &AxisKeys::seed, whole<std::uint64_t>(0, kLargestWhole),
              "of their random numbers"),
          key("replicates", &AxisKeys::replicates, whole<std::uint64_t>(2, 1e6),
              "sensitivity: independent scramblings of 'count' points each"),
          by_name("parameters", two_ends_block())}}};
    return Kinds<AxisKeys, AxisKind>(
        {.name = "axis", .sentence = "what changes, and how", .by = ""}, &AxisKeys::kind,
        std::move(kinds));
  };
  static const Kinds<AxisKeys, AxisKind> kinds = made();
  return kinds;
}

const Block<QuasiStaticOptions>& integrator_block() {
  static const Block<QuasiStaticOptions> block(
      "integrator", "steps of one length",
      {required(key("step", &QuasiStaticOptions::step_s, quantity(Dimension::time, kAboveZero),
                    "every step is that long")),
       key("stages", &QuasiStaticOptions::stages, whole<int>(2, 8),
           "Radau nodes of a step: order 2 stages - 1")});
  return block;
}

const Kinds<SweepKeys, SweepSubject>& sweep_kinds() {
  static const Kinds<SweepKeys, SweepSubject> kinds(
      {.name = "sweep", .sentence = "", .by = "model"}, &SweepKeys::subject,
      {{SweepSubject::single_contact, "single_contact", "the paper's star in closed form",
        keys_with({key("material", &SweepKeys::material, element_block().type(), "of the contact"),
                   with_example(key("indentation", &SweepKeys::indentation, indentation_type(),
                                    "a protocol of the depth"),
                                Json{{"kind", "step_hold"}, {"depth", "4 mm"}}),
                   key("creep", &SweepKeys::creep, creep_block().type(), "a constant load")})},
       {SweepSubject::organ, "organ", "the quasi-static network of a scene",
        keys_with(
            {required(key("scene", &SweepKeys::scene, as_json(scene_form()),
                          "a scene of tpm simulate, or its file, relative to this one")),
             key("tolerance", &SweepKeys::tolerance,
                 quantity(Dimension::dimensionless, {.least = 1e-6, .most = 0.5}),
                 "of the response, in parts of its peak, such as \"1 %\"; each cell then runs on "
                 "the cheapest model that claims to be within it. Default: the network at the "
                 "scene's own tolerance"),
             key("integrator", &SweepKeys::integrator, as_json(integrator_block().form()),
                 "instead of steps that follow the tolerance; its keys can be swept as "
                 "/integrator/step and /integrator/stages")})}});
  return kinds;
}

const FileKind& sweep_kind() {
  static const FileKind kind{
      "sweep", "A sweep of tpm sweep",
      "A model, the parameters that are changed, and what is found for each combination. "
      "Quantities are texts of a number and a unit, such as \"20 mm\"",
      sweep_kinds().form()};
  return kind;
}

}  // namespace tpm::sweep
