#include "tpm/fit/likelihood/fit_keys.hpp"

#include <algorithm>
#include <iterator>

#include "tpm/data/curve_words.hpp"
#include "tpm/files/keys/more_types.hpp"

namespace tpm::fit {
namespace {

constexpr double kLargestSeed = 9007199254740991.0;  // 2^53 - 1

/// Of a dimension that the model knows.
FormPtr some_quantity() {
  static const FormPtr form =
      text(1).named("some_quantity", "a number and a unit, such as \"12 kPa\"").form;
  return form;
}

FormPtr of_dimension(Dimension dimension, Range range = {}) {
  return files::quantity(dimension, range).form;
}

FormPtr number_or_text() {
  return either_form({number().form, text(1).form});
}

FormPtr distinct_texts() {
  return list(text(1), {.fewest = 1, .distinct = true}).form;
}

FormPtr words(std::vector<std::string> all) {
  return one_of(std::move(all)).form;
}

FormPtr fit_parameter_form() {
  const FormPtr prior = object_form(
      "prior", "a normal distribution, whose residual (value - mean) / sd is added to the fit",
      {required_key("mean", some_quantity(), "its mean"),
       required_key("sd", some_quantity(), "its standard deviation"),
       optional_key("from", text().form, "what measured it")});
  const FormPtr drift = object_form(
      "drift", "a slope of the zero of a recording: slope (t - origin) is added to the answer",
      {required_key("of", text(1).form, "the recording"),
       required_key("origin", of_dimension(Dimension::time), "when the slope adds nothing")});
  const FormPtr rise = object_form(
      "rise",
      "two samples of a recording between which the drive rises: the parameter is the delay of "
      "the rise's centre against that of a straight line",
      {required_key("of", text(1).form, "the recording"),
       required_key("begin", of_dimension(Dimension::time), "the sample before"),
       required_key("end", of_dimension(Dimension::time), "the sample behind")});
  return object_form(
      "fit_parameter", "a parameter that is estimated",
      {required_key("start", some_quantity(), "where the search begins"),
       required_key("lower", some_quantity(), "least value"),
       required_key("upper", some_quantity(), "largest value"),
       optional_key("scale", words({"log", "linear", "inverse_square"}),
                    "coordinate of the search; default log"),
       optional_key("sets", distinct_texts(),
                    "model parameters that take this value; default: the one of the same name"),
       optional_key("for", distinct_texts(),
                    "data sets that this parameter belongs to (an offset of one recording); "
                    "default: all"),
       optional_key("prior", prior, "what a measurement of its own tells"),
       optional_key("drift", drift,
                    "the parameter is a slope of the zero of this recording, in its response per "
                    "second such as \"1 mN/s\""),
       optional_key("rise", rise,
                    "the parameter is the delay of a rise of the drive between two samples, such "
                    "as \"10 ms\""),
       optional_key("not_separable", text(1).form,
                    "what the data cannot tell the parameter from; it is then not called "
                    "identified")});
}

FormPtr fit_law_form() {
  return object_form(
      "fit_law", "a law of the family instead of the paper's element",
      {required_key("name", text(1).form,
                    "kernel, branches, tension: linear-1-elastic, power-2, hertz-fzener"),
       optional_key("drive", words({"indentation_depth", "strain", "relative_length"}),
                    "answered by a contact force or a stress; default indentation_depth"),
       required_key("reference", some_quantity(),
                    "reference depth of the kernel, such as \"5 mm\" (\"0.2\" for a relative "
                    "length)")});
}

FormPtr fit_protocol_form() {
  std::vector<std::string> provenances;
  for (const auto& entry : kProvenances) provenances.emplace_back(entry.text);
  Form form{.type = Form::Type::kinds,
            .name = "fit_protocol",
            .sentence = "what was imposed; depth, load and hold are the data's"};
  form.kinds = {
      {"ramp_hold",
       "a ramp that is held",
       {required_key("rate", of_dimension(Dimension::speed, kAboveZero), "speed of the ramp"),
        optional_key("rate_provenance", words(std::move(provenances)),
                     "where the rate comes from")}},
      {"step_hold", "a step that is held", {}},
      {"static", "long after each step", {}},
      {"creep", "a load as a step", {}},
      {"measured", "the drive of a recording", {}},
      {"oscillation",
       "small oscillations",
       {optional_key("operating_depth", some_quantity(),
                     "depth of the tissue (or relative length) that they are about; default the "
                     "law's reference")}}};
  return shared(std::move(form));
}

FormPtr fit_noise_form() {
  return object_form(
      "fit_noise", "scatter of a reading y about the model",
      {optional_key("kind",
                    words({"relative_to_datum", "absolute", "combined", "per_row", "log",
                           "relative_to_model"}),
                    "needed unless the distribution is log_normal"),
       optional_key("distribution", words({"normal", "log_normal", "laplace", "student_t"}),
                    "shape of the noise, sigma being its scale; default normal; log_normal is the "
                    "kind log"),
       optional_key("degrees_of_freedom", number().form, "of student_t, above 2; default 4"),
       optional_key("relative", number_or_text(),
                    "b of sigma = b |y| (relative_to_datum), a + b |y| (combined), b |model|, or "
                    "of the logarithm (log); or \"estimated\" or \"estimated NAME\": sigma = a + b "
                    "|model| with b among the parameters"),
       optional_key("absolute", text(1).form,
                    "a, such as \"5 mN\"; or \"estimated\" or \"estimated NAME\""),
       optional_key("scale", words({"known", "estimated"}),
                    "estimated: right up to one common factor; thresholds come from F. Default "
                    "known")});
}

FormPtr fit_import_form() {
  const FormPtr plain = text(1).form;
  const FormPtr whole_or_text = either_form({whole<int>(0, 1e9).form, plain});
  return object_form(
      "fit_import", "what the file does not say, as the options of tpm data import",
      {optional_key("encoding", words({"auto", "utf-8", "latin-1"}), "of the text"),
       optional_key("separator", words({"auto", "comma", "semicolon", "tab", "blank"}),
                    "between columns"),
       optional_key("decimal", words({"auto", "point", "comma"}), "decimal sign"),
       optional_key("thousands", words({"auto", "none", "comma", "point", "apostrophe", "space"}),
                    "mark between groups of three digits"),
       optional_key("header_rows", whole_or_text, "rows above the samples, if not found"),
       optional_key("block", whole_or_text, "which of several blocks of samples, from 1"),
       optional_key("time", plain, "column"),
       optional_key("drive", plain, "column"),
       optional_key("response", plain, "column"),
       optional_key("sd", plain, "column of standard deviations"),
       optional_key("frequency", plain, "column"),
       optional_key("storage", plain, "column"),
       optional_key("loss", plain, "column"),
       optional_key("drive_quantity", plain, "what the column of the drive holds"),
       optional_key("response_quantity", plain, "what the column of the response holds"),
       optional_key("negate_drive", flag().form, "the drive has the other sign"),
       optional_key("negate_response", flag().form, "the response has the other sign"),
       optional_key("step_time", plain,
                    "time of the step on the file's clock, for G(t), J(t) and what is kept after a "
                    "step: \"185 s\" or 11:09:16; earlier samples are left out and times count "
                    "from it"),
       optional_key("from", plain, "samples before this time of the file are not read"),
       optional_key("until", plain, "samples after this time of the file are not read"),
       optional_key("rest_length", of_dimension(Dimension::length),
                    "unloaded length of the specimen, by which a length or an elongation is "
                    "divided"),
       optional_key("area", of_dimension(Dimension::area),
                    "cross section of the specimen, by which a force is divided"),
       optional_key("spring_constant", of_dimension(Dimension::stiffness),
                    "of a cantilever, such as \"0.05 N/m\": JPK force files, instead of that of "
                    "the file; tables with the height of a piezo"),
       optional_key("deflection_sensitivity", plain,
                    "tables with a deflection in V or mV, such as \"50 nm/V\""),
       optional_key("segments", list_form(plain, 0),
                    "JPK force files: kinds of segments to read, such as extend and pause; all if "
                    "left out"),
       optional_key("units", map_form(plain), "of columns, by their names")});
}

FormPtr fit_data_form() {
  const FormPtr selector = object_form(
      "selector",
      "picks readings by their imposed depth or load and by their label; a missing key matches all",
      {optional_key("depth", of_dimension(Dimension::length), "imposed depth"),
       optional_key("load", of_dimension(Dimension::force), "imposed load"),
       optional_key("label", text().form, "of the row")});
  const FormPtr selectors = list_form(selector, 0);
  return object_form(
      "fit_data", "a data set with its protocol and noise",
      {required_key("dataset", text(1).form,
                    "id of a shipped curve (tpm data list) or a path ending in .csv or .json, "
                    "relative to this file"),
       required_key("protocol", fit_protocol_form(), "what was imposed"),
       required_key("noise", fit_noise_form(), "scatter of a reading"),
       optional_key("stiffness_per_modulus", of_dimension(Dimension::length, kAboveZero),
                    "oscillation, moduli under a law of contact force over depth: A0/l0, the "
                    "contact's stiffness over the modulus, such as \"12.56 mm\""),
       optional_key("import", fit_import_form(),
                    "recordings and spectra without a description: what the file does not say"),
       optional_key("from", of_dimension(Dimension::time),
                    "recordings: earlier samples are not fitted"),
       optional_key("to", of_dimension(Dimension::time),
                    "recordings: later samples are predicted, not fitted"),
       optional_key("imposed", one_of({"drive", "response"}).form,
                    "recordings of stress over strain or force over depth: response where the load "
                    "was imposed and the strain or depth answers (creep); its noise is then one of "
                    "what answers"),
       optional_key("clipped_above", some_quantity(),
                    "recordings: limit of the force cell; readings from here on are censored: of "
                    "each it counts only that it lay at the limit or beyond"),
       optional_key("clipped_below", some_quantity(), "the same of the smallest reading"),
       optional_key("exclude", selectors, "readings that are not used"),
       optional_key("hold_out", selectors, "readings that are not fitted but predicted")});
}

/// The keys of both kinds that stand before the data, and behind them.
std::vector<KeyForm> keys_of_model() {
  KeyForm title = required_key("title", text().form, "what the fit is");
  return {std::move(title),
          optional_key("description", text().form, "what else is to be said"),
          optional_key("model", text(1).form,
                       "a formulation for fits (tpm simulate --list-formulations) or organ: the "
                       "paper's element by its closed form (default) or by CVODES, or the network "
                       "of a scene"),
          optional_key("scene", text(1).form,
                       "with the model organ: the file that holds the organ, its bonds and "
                       "anchors, relative to this file; its material is not used"),
          optional_key("law", fit_law_form(),
                       "a law of the family instead of the paper's element; its parameters are "
                       "listed by tpm laws NAME"),
          optional_key("tension", words({"exact", "frozen_at_peak"}),
                       "exact: lambda1(e); frozen_at_peak: as the paper; default exact")};
}

std::vector<KeyForm> keys_of_statistics() {
  const FormPtr seed = whole<std::uint64_t>(0, kLargestSeed).form;
  const FormPtr loss =
      object_form("loss", "a robust loss",
                  {required_key("kind", words({"none", "huber", "cauchy"}), "its shape"),
                   optional_key("width", number({.least = 1e-6}).form,
                                "in standard deviations; default 1.345")});
  const FormPtr starts = object_form(
      "starts", "where searches begin",
      {optional_key("count", whole<int>(1, 100000).form,
                    "the first is the given start, the others a Latin hypercube; default 50"),
       optional_key("seed", seed, "default 0")});
  const FormPtr profile = object_form(
      "profile", "intervals from the profile of the likelihood",
      {optional_key("level", number({.least = 0.01, .most = 0.9999}).form, "default 0.95"),
       optional_key("enabled", flag().form, "default true")});
  const FormPtr bootstrap = object_form(
      "bootstrap", "refits to resampled data, beside the profiles",
      {optional_key("replicates", whole<int>(20, 1e6).form, "default 1000"),
       optional_key("resample", words({"residuals", "blocks", "recordings"}),
                    "single residuals (default), runs of neighbours, or whole data sets"),
       optional_key("block_length", whole<int>(1, 1e6).form,
                    "of blocks, in readings; default from the residuals' correlation"),
       optional_key("seed", seed, "default: the seed of the starts")});
  const FormPtr hypothesis =
      object_form("hypothesis", "values of parameters that are tested",
                  {required_key("name", text().form, "what it is called"),
                   required_key("values", map_form(some_quantity(), 1), "of parameters")});
  return {optional_key("loss", loss, "a robust loss"),
          optional_key("correlation", words({"adjust", "ignore"}),
                       "whether intervals count correlated neighbours of a recording as fewer "
                       "readings; default adjust"),
          optional_key("starts", starts, "where searches begin"),
          optional_key("profile", profile, "intervals from the profile of the likelihood"),
          optional_key("bootstrap", bootstrap, "refits to resampled data, beside the profiles"),
          optional_key("hypotheses", list_form(hypothesis, 0), "what is tested")};
}

FormPtr fit_form(std::string name, std::vector<KeyForm> of_data) {
  std::vector<KeyForm> keys = keys_of_model();
  std::move(of_data.begin(), of_data.end(), std::back_inserter(keys));
  std::vector<KeyForm> statistics = keys_of_statistics();
  std::move(statistics.begin(), statistics.end(), std::back_inserter(keys));
  return object_form(std::move(name), "", std::move(keys));
}

}  // namespace

const FileKind& fit_kind() {
  const auto made = [] {
    KeyForm parameters =
        required_key("parameters", map_form(fit_parameter_form(), 1), "that are estimated");
    parameters.example = {{"E",
                           {{"start", "12 kPa"},
                            {"lower", "1 kPa"},
                            {"upper", "200 kPa"},
                            {"sets", {"E1", "E2", "Eprime"}}}}};
    KeyForm data = required_key("data", list_form(fit_data_form(), 1), "what is fitted");
    data.example =
        Json::array({Json{{"dataset", "evren_static"},
                          {"protocol", {{"kind", "static"}}},
                          {"noise", {{"kind", "relative_to_datum"}, {"relative", 0.1}}}}});
    return FileKind{
        "fit", "Configuration of tpm fit",
        "What is fitted to which data. Quantities are texts of a number and a unit, such as \"12 "
        "kPa\"",
        fit_form("fit",
                 {parameters,
                  optional_key("fixed", map_form(some_quantity()),
                               "model parameters fixed at a value; what is neither estimated nor "
                               "fixed has the paper's value (with a law: contact and offset 0, "
                               "spacing infinite)"),
                  data})};
  };
  static const FileKind kind = made();
  return kind;
}

const FileKind& fit_tables_kind() {
  const auto file = [](const char* key, const char* sentence) {
    return required_key(key, text(1).form, sentence);
  };
  static const FileKind kind{
      "fit_tables",
      "A fit whose parameters, observables, conditions and measurements stand in tables after "
      "PEtab",
      "The other keys are those of the configuration of tpm fit, without parameters, fixed and "
      "data",
      fit_form("fit_tables", {file("parameter_file", "parameters.csv, relative to this file"),
                              file("observable_file", "observables.csv"),
                              file("condition_file", "conditions.csv"),
                              file("measurement_file", "measurements.csv")})};
  return kind;
}

}  // namespace tpm::fit
