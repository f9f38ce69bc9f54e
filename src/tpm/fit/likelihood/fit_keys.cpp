#include "tpm/fit/likelihood/fit_keys.hpp"

#include <algorithm>
#include <iterator>

#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/keys/more_types.hpp"
#include "tpm/fit/likelihood/fit_words.hpp"

namespace tpm::fit {
namespace {

constexpr double kLargestSeed = 9007199254740991.0;  // 2^53 - 1

ValueType<std::uint64_t> seed_type() {
  return whole<std::uint64_t>(0, kLargestSeed);
}

ValueType<std::vector<Placed<std::string>>> distinct_texts() {
  return list(placed(text(1)), {.fewest = 1, .distinct = true});
}

const Block<StatedPrior>& prior_block() {
  using P = StatedPrior;
  static const Block<P> block(
      "prior", "a normal distribution, whose residual (value - mean) / sd is added to the fit",
      {required(key("mean", &P::mean, stated_quantity(), "its mean")),
       required(key("sd", &P::sd, stated_quantity(), "its standard deviation")),
       key("from", &P::from, text_if_any(), "what measured it"),
       with_default(key("measured", &P::measured, flag(),
                        "a measurement found it; false: a limit of what is known, and every fit "
                        "reports how far the estimate moved from it"),
                    true)});
  return block;
}

const Block<StatedDrift>& drift_block() {
  using D = StatedDrift;
  static const Block<D> block(
      "drift", "a slope of the zero of a recording: slope (t - origin) is added to the answer",
      {required(key("of", &D::of, placed(text(1)), "the recording")),
       required(key("origin", &D::origin_s, files::quantity(Dimension::time),
                    "when the slope adds nothing"))});
  return block;
}

const Block<StatedRise>& rise_block() {
  using R = StatedRise;
  static const Block<R> block(
      "rise",
      "two samples of a recording between which the drive rises: the parameter is the delay of "
      "the rise's centre against that of a straight line",
      {required(key("of", &R::of, placed(text(1)), "the recording")),
       required(key("begin", &R::begin_s, files::quantity(Dimension::time), "the sample before")),
       required(key("end", &R::end_s, files::quantity(Dimension::time), "the sample behind"))},
      {{"'begin' before 'end'", [](const R& rise) {
          return rise.begin_s < rise.end_s ? std::nullopt
                                           : std::optional(Fault{"end", "not behind 'begin'"});
        }}});
  return block;
}

const Block<StatedParameter>& parameter_block() {
  using P = StatedParameter;
  static const Block<P> block(
      "fit_parameter", "a parameter that is estimated",
      {required(key("start", &P::start, stated_quantity(), "where the search begins")),
       required(key("lower", &P::lower, stated_quantity(), "least value")),
       required(key("upper", &P::upper, stated_quantity(), "largest value")),
       key("scale", &P::scale, word(kScaleWords),
           "coordinate of the search; default log, of a drift linear"),
       key("sets", &P::sets, distinct_texts(),
           "model parameters that take this value; default: the one of the same name"),
       key("for", &P::data, distinct_texts(),
           "data sets that this parameter belongs to (an offset of one recording); default: all"),
       key("prior", &P::prior, prior_block().type(), "what a measurement of its own tells"),
       key("drift", &P::drift, drift_block().type(),
           "the parameter is a slope of the zero of this recording, in its response per second "
           "such as \"1 mN/s\""),
       key("rise", &P::rise, rise_block().type(),
           "the parameter is the delay of a rise of the drive between two samples, such as \"10 "
           "ms\""),
       key("not_separable", &P::not_separable, remark(),
           "what the data cannot tell the parameter from; it is then not called identified")},
      {{"a drift or a rise of one recording alone", [](const P& p) -> std::optional<Fault> {
          const bool alone = p.drift || p.rise;
          if (!alone || (p.sets.empty() && p.data.empty())) return std::nullopt;
          return Fault{p.drift ? "drift" : "rise", "beside 'sets' or 'for'"};
        }}});
  return block;
}

const Block<StatedLaw>& law_block_of_fit() {
  using L = StatedLaw;
  static const Block<L> block(
      "fit_law", "a law of the family instead of the paper's element",
      {required(key("name", &L::name, placed(text(1)),
                    "kernel, branches, tension: linear-1-elastic, power-2, hertz-fzener")),
       key("drive", &L::drive,
           quantity_among(
               {Quantity::indentation_depth, Quantity::strain, Quantity::relative_length}),
           "answered by a contact force or a stress"),
       required(key("reference", &L::reference, stated_quantity(),
                    "reference depth of the kernel, such as \"5 mm\" (\"0.2\" for a relative "
                    "length)"))});
  return block;
}

constexpr auto kTensionWords = std::to_array<Word<TensionRule::Kind>>(
    {{TensionRule::Kind::exact, "exact"}, {TensionRule::Kind::frozen_at_peak, "frozen_at_peak"}});
constexpr auto kCorrelationWords = std::to_array<Word<bool>>({{true, "adjust"}, {false, "ignore"}});

/// A key of what needs neither the model nor the data.
Key<StatedFit> of_config(const Key<FitConfig>& one) {
  return within(&StatedFit::config, one);
}

/// The keys that stand before the data.
std::vector<Key<StatedFit>> keys_of_model() {
  using F = StatedFit;
  return {required(of_config(key("title", &FitConfig::title, text(), "what the fit is"))),
          unread<F>("description", text().form, "what else is to be said"),
          key("model", &F::model, placed(text(1)),
              "a formulation for fits (tpm simulate --list-formulations) or organ: the paper's "
              "element by its closed form (default) or by CVODES, or the network of a scene"),
          of_config(key("scene", &FitConfig::scene, text(1),
                        "with the model organ: the file that holds the organ, its bonds and "
                        "anchors, relative to this file; its material is not used")),
          key("law", &F::law, placed(law_block_of_fit().type(), &StatedLaw::place),
              "a law of the family instead of the paper's element; its parameters are listed by "
              "tpm laws NAME"),
          key("tension", &F::tension, word(kTensionWords),
              "exact: lambda1(e); frozen_at_peak: as the paper; default exact")};
}

const Block<RobustLoss>& loss_block() {
  using L = RobustLoss;
  static const Block<L> block(
      "loss", "a robust loss",
      {required(key("kind", &L::kind, word(kLossWords), "its shape")),
       key("width", &L::width, number({.least = 1e-6}), "in standard deviations")});
  return block;
}

const Block<FitConfig>& starts_block() {
  using C = FitConfig;
  static const Block<C> block("starts", "where searches begin",
                              {key("count", &C::starts, whole<std::size_t>(1, 100000),
                                   "the first is the given start, the others a Latin hypercube"),
                               key("seed", &C::seed, seed_type(), "of random numbers")});
  return block;
}

const Block<FitConfig>& profile_block() {
  using C = FitConfig;
  static const Block<C> block("profile", "intervals from the profile of the likelihood",
                              {key("level", &C::level, number({.least = 0.01, .most = 0.9999}),
                                   "probability that they hold the value"),
                               key("enabled", &C::profiles, flag(), "whether they are found")});
  return block;
}

const Block<StatedBootstrap>& bootstrap_block() {
  using B = StatedBootstrap;
  const auto of_options = [](const Key<BootstrapOptions>& one) { return within(&B::options, one); };
  static const Block<B> block(
      "bootstrap", "refits to resampled data, beside the profiles",
      {of_options(key("replicates", &BootstrapOptions::replicates, whole<int>(20, 1e6),
                      "how many refits")),
       of_options(key("resample", &BootstrapOptions::resampling, word(kResamplingWords),
                      "single residuals, runs of neighbours, or whole data sets")),
       with_default(of_options(key("block_length", &BootstrapOptions::block_length,
                                   whole<std::size_t>(1, 1e6),
                                   "of blocks, in readings; default from the residuals' "
                                   "correlation")),
                    nullptr),
       key("seed", &B::seed, seed_type(), "default: the seed of the starts")});
  return block;
}

const Block<StatedHypothesis>& hypothesis_block() {
  using H = StatedHypothesis;
  static const Block<H> block(
      "hypothesis", "values of parameters that are tested",
      {required(key("name", &H::name, text(), "what it is called")),
       required(key("values", &H::values, map_of(stated_quantity(), 1), "of parameters"))});
  return block;
}

const Block<LawChoice>& choice_block() {
  using C = LawChoice;
  static const Block<C> block(
      "fit_choice",
      "conditions under which the law was chosen among others, which a fit of the same law to the "
      "same readings says again",
      {required(key("law", &C::law, text(1), "that was chosen")),
       required(key("samples", &C::samples, whole<int>(0, 1e9), "that were fitted")),
       key("samples_sha256", &C::samples_sha256, list(text_if_any()),
           "SHA-256 of the numbers of each data set; without it nothing is said again"),
       key("better", &C::better, text(1), "law that the data prefer decisively"),
       key("better_by", &C::better_by, number({.least = 0.0}), "in BIC"),
       key("not_described", &C::not_described, text(1),
           "what was said of the law where it does not describe the data"),
       key("conditions", &C::conditions, list(text(1)), "in sentences")});
  return block;
}

/// The keys that stand behind the data.
std::vector<Key<StatedFit>> keys_of_statistics() {
  using F = StatedFit;
  return {of_config(key("loss", &FitConfig::loss, loss_block().type(), "a robust loss")),
          of_config(key("correlation", &FitConfig::adjust_correlation, word(kCorrelationWords),
                        "whether intervals count correlated neighbours of a recording as fewer "
                        "readings")),
          of_config(members("starts", starts_block(), "where searches begin")),
          of_config(
              members("profile", profile_block(), "intervals from the profile of the likelihood")),
          key("bootstrap", &F::bootstrap, bootstrap_block().type(),
              "refits to resampled data, beside the profiles"),
          key("hypotheses", &F::hypotheses, list(hypothesis_block().type()), "what is tested"),
          of_config(key("choice", &FitConfig::choice, choice_block().type(),
                        "how the law was chosen, as tpm fit RECORDING writes it"))};
}

template <class T>
std::vector<Key<T>> joined(std::vector<Key<T>> keys, const std::vector<Key<T>>& middle,
                           const std::vector<Key<T>>& last) {
  keys.insert(keys.end(), middle.begin(), middle.end());
  keys.insert(keys.end(), last.begin(), last.end());
  return keys;
}

std::vector<Rule<StatedFit>> fit_rules() {
  using F = StatedFit;
  const auto is_organ = [](const F& fit) { return fit.model && fit.model->value == kOrganModel; };
  return {{"\"model\": \"organ\" and the scene that holds the organ, or neither",
           [=](const F& fit) -> std::optional<Fault> {
             if (is_organ(fit) != fit.config.scene.empty()) return std::nullopt;
             return Fault{"scene", is_organ(fit) ? "missing" : "without the model 'organ'"};
           }},
          {"no tension with the model organ: the bonds of a network pull along themselves",
           [=](const F& fit) -> std::optional<Fault> {
             const auto exact = TensionRule::Kind::exact;
             if (!is_organ(fit) || fit.tension.value_or(exact) == exact) return std::nullopt;
             return Fault{"tension", "a rule for lambda1 beside the model 'organ'"};
           }},
          {"either a law of the family or a formulation of the paper's element",
           [](const F& fit) -> std::optional<Fault> {
             if (!fit.law || (!fit.model && !fit.tension)) return std::nullopt;
             return Fault{"law", "beside 'model' or 'tension'"};
           }},
          // A robust loss stands for a likelihood that nobody wrote down: nothing that needs one
          // goes with it.
          {"either a loss, or a likelihood such as 'student_t'",
           [](const F& fit) -> std::optional<Fault> {
             const bool plain = std::ranges::all_of(fit.data, [](const StatedData& data) {
               return data.noise.shape() == ErrorShape::normal && !data.noise.estimates_sigma();
             });
             if (plain || fit.config.loss.kind == Loss::none) return std::nullopt;
             return Fault{"loss", "beside a noise distribution or an estimated standard deviation"};
           }},
          {"scales of the noise that are all known or all estimated",
           [](const F& fit) -> std::optional<Fault> {
             const auto known = std::ranges::count_if(
                 fit.data, [](const StatedData& data) { return data.noise.scale_known; });
             if (known == 0 || known == std::ssize(fit.data)) return std::nullopt;
             return Fault{"data", "some noise scales are known and others estimated"};
           }}};
}

const Block<StatedFit>& fit_block() {
  using F = StatedFit;
  static const Block<F> block(
      "fit", "",
      joined<F>(
          keys_of_model(),
          {required(with_example(
               key("parameters", &F::parameters,
                   map_of(placed(parameter_block().type(), &StatedParameter::place), 1),
                   "that are estimated"),
               {{"E",
                 {{"start", "12 kPa"},
                  {"lower", "1 kPa"},
                  {"upper", "200 kPa"},
                  {"sets", {"E1", "E2", "Eprime"}}}}})),
           key("fixed", &F::fixed, map_of(stated_quantity()),
               "model parameters fixed at a value; what is neither estimated nor fixed has the "
               "paper's value (with a law: contact and offset 0, spacing infinite)"),
           required(with_example(
               key("data", &F::data, list(data_block().type(), {.fewest = 1}), "what is fitted"),
               Json::array(
                   {Json{{"dataset", "evren_static"},
                         {"protocol", {{"kind", "static"}}},
                         {"noise", {{"kind", "relative_to_datum"}, {"relative", 0.1}}}}})))},
          keys_of_statistics()),
      fit_rules());
  return block;
}

const std::vector<Key<TableFiles>>& table_keys() {
  using T = TableFiles;
  const auto file = [](const char* name, std::string T::*member, const char* sentence) {
    return required(key(name, member, text(1), sentence));
  };
  static const std::vector<Key<T>> keys{
      file("parameter_file", &T::parameters, "parameters.csv, relative to this file"),
      file("observable_file", &T::observables, "observables.csv"),
      file("condition_file", &T::conditions, "conditions.csv"),
      file("measurement_file", &T::measurements, "measurements.csv")};
  return keys;
}

}  // namespace

const FileKind& fit_kind() {
  static const FileKind kind{
      "fit", "Configuration of tpm fit",
      "What is fitted to which data. Quantities are texts of a number and a unit, such as \"12 "
      "kPa\"",
      fit_block().form()};
  return kind;
}

const FileKind& fit_tables_kind() {
  const auto made = [] {
    std::vector<KeyForm> keys;
    const auto add = [&keys](const auto& some) {
      for (const auto& one : some) keys.push_back(one.form);
    };
    add(keys_of_model());
    add(table_keys());
    add(keys_of_statistics());
    return FileKind{
        "fit_tables",
        "A fit whose parameters, observables, conditions and measurements stand in tables after "
        "PEtab",
        "The other keys are those of the configuration of tpm fit, without parameters, fixed and "
        "data",
        object_form("fit_tables", "", std::move(keys))};
  };
  static const FileKind kind = made();
  return kind;
}

StatedFit stated_fit(const Json& document, std::string_view where) {
  return fit_block().made(checked(document, fit_kind(), where), DocumentPlace{std::string(where)});
}

bool has_table_files(const Json& document) {
  return std::ranges::any_of(
      table_keys(), [&](const Key<TableFiles>& one) { return document.contains(one.form.name); });
}

TableFiles take_table_files(Json& problem, std::string_view where) {
  problem = checked(std::move(problem), fit_tables_kind(), where);
  TableFiles files;
  read_keys(table_keys(), problem, DocumentPlace{std::string(where)}, files);
  for (const Key<TableFiles>& one : table_keys()) problem.erase(one.form.name);
  return files;
}

}  // namespace tpm::fit
