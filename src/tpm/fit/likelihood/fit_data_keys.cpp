// Declared in tpm/fit/likelihood/fit_keys.hpp.
#include <fmt/format.h>

#include <cmath>

#include "tpm/data/curve_words.hpp"
#include "tpm/files/import/reading_options.hpp"
#include "tpm/fit/likelihood/fit_keys.hpp"
#include "tpm/fit/likelihood/fit_words.hpp"

namespace tpm::fit {
namespace {

const Kinds<StatedProtocol, FitProtocol>& protocol_kinds_of_fit() {
  using P = StatedProtocol;
  const auto kind = [](FitProtocol meaning, std::string sentence, std::vector<Key<P>> keys = {}) {
    return files::Kind<P, FitProtocol>{meaning, std::string(protocol_kind_name(meaning)),
                                       std::move(sentence), std::move(keys)};
  };
  const auto of_choice = [](const Key<ProtocolChoice>& one) { return within(&P::choice, one); };
  static const Kinds<P, FitProtocol> kinds(
      {"fit_protocol", "what was imposed; depth, load and hold are the data's"}, &P::kind,
      {kind(FitProtocol::ramp_hold, "a ramp that is held",
            {required(of_choice(key("rate", &ProtocolChoice::rate_m_per_s,
                                    files::quantity(Dimension::speed, kAboveZero),
                                    "speed of the ramp"))),
             of_choice(key("rate_provenance", &ProtocolChoice::rate_provenance, word(kProvenances),
                           "where the rate comes from"))}),
       kind(FitProtocol::step_hold, "a step that is held"),
       kind(FitProtocol::static_, "long after each step"),
       kind(FitProtocol::creep, "a load as a step"),
       kind(FitProtocol::measured, "the drive of a recording"),
       kind(FitProtocol::oscillation, "small oscillations",
            {key("operating_depth", &P::operating_depth, stated_quantity(),
                 "depth of the tissue (or relative length) that they are about; default the law's "
                 "reference")})});
  return kinds;
}

constexpr std::string_view kEstimated = "estimated";

/// Of "estimated" an empty name, of "estimated NAME" the name.
std::optional<std::string> estimated_name(const std::string& text) {
  if (text == kEstimated) return std::string{};
  const std::string before = std::string(kEstimated) + " ";
  if (!text.starts_with(before) || text == before) return std::nullopt;
  return text.substr(before.size());
}

std::string estimated_text(const std::string& name) {
  return name.empty() ? std::string(kEstimated) : fmt::format("{} {}", kEstimated, name);
}

/// b: a number, or "estimated".
ValueType<StatedSigma> relative_sigma() {
  const FormPtr words = text_like(fmt::format("^{}( .+)?$", kEstimated),
                                  "\"estimated\" or \"estimated NAME\", or a number without "
                                  "quotation marks",
                                  std::string(kEstimated))
                            .form;
  return {either_form({number(kAboveZero).form, words}),
          [](const Json& value, const DocumentPlace&) {
            StatedSigma sigma;
            if (value.is_number()) {
              sigma.number = value.get<double>();
            } else {
              sigma.estimated = estimated_name(value.get<std::string>());
            }
            return sigma;
          },
          [](const StatedSigma& from) {
            return from.estimated ? Json(estimated_text(*from.estimated)) : Json(from.number);
          }};
}

/// a: a quantity of the readings, or "estimated".
ValueType<StatedSigma> absolute_sigma() {
  return converted<StatedSigma>(
      text(1),
      [](const std::string& value, const DocumentPlace& place) {
        return StatedSigma{estimated_name(value), 0.0, {value, place}};
      },
      [](const StatedSigma& from) {
        return from.estimated ? estimated_text(*from.estimated) : from.quantity.text;
      });
}

/// Fault if a kind of noise states the wrong one of both keys.
std::optional<Fault> sigma_fault(const StatedNoise& noise) {
  const NoiseKind kind = noise.kind();
  const auto fault = [&](const char* name, bool stands, bool needed) -> std::optional<Fault> {
    if (stands == needed) return std::nullopt;
    return Fault{"", fmt::format("noise '{}' {} '{}'", noise_kind_name(kind),
                                 needed ? "needs" : "does not use", name)};
  };
  const auto relative = fault("relative", noise.relative.has_value(), uses_relative(kind));
  return relative ? relative : fault("absolute", noise.absolute.has_value(), uses_absolute(kind));
}

std::vector<Rule<StatedNoise>> noise_rules() {
  using N = StatedNoise;
  const auto rule = [](std::string expected, std::string key, std::string what,
                       bool (*broken)(const N&)) {
    return Rule<N>{std::move(expected),
                   [fault = Fault{std::move(key), std::move(what)}, broken](const N& noise) {
                     return broken(noise) ? std::optional(fault) : std::nullopt;
                   }};
  };
  return {
      rule("a noise kind, or the distribution 'log_normal'", "kind", "is missing",
           [](const N& n) { return !n.kind_alone && !(n.distribution && n.distribution->log); }),
      rule("no kind, or the kind 'log', with 'log_normal'", "distribution",
           "'log_normal' beside another kind",
           [](const N& n) {
             return n.kind() == NoiseKind::log && n.kind_alone.value_or(NoiseKind::log) != n.kind();
           }),
      rule("'log_normal', not 'normal', with the kind 'log'", "distribution",
           "'normal' beside the kind 'log'",
           [](const N& n) {
             return n.kind_alone == NoiseKind::log && n.distribution == NoiseDistribution{};
           }),
      rule("degrees of freedom only with the distribution 'student_t'", "degrees_of_freedom",
           "without Student's t",
           [](const N& n) { return n.degrees_of_freedom && n.shape() != ErrorShape::student_t; }),
      {"the sizes that the kind uses, and no other", sigma_fault},
      rule("an angle only with normal noise of the kind 'relative_to_datum'", "angle",
           "beside another kind or distribution",
           [](const N& n) {
             const bool shares = n.kind() == NoiseKind::relative_to_datum;
             return n.angle_rad && !(shares && n.shape() == ErrorShape::normal);
           }),
      {"an estimated scale of normal noise only; of another, \"absolute\": \"estimated\"",
       [](const N& n) -> std::optional<Fault> {
         if (n.scale_known || n.shape() == ErrorShape::normal) return std::nullopt;
         return Fault{"scale", fmt::format("estimated under distribution '{}'",
                                           error_shape_name(n.shape()))};
       }},
      rule("an estimated b of the kind 'relative_to_model' (sigma = b |model|) or 'combined'",
           "relative", "estimated under 'relative_to_datum'",
           [](const N& n) {
             return n.kind() == NoiseKind::relative_to_datum && n.estimates_sigma();
           }),
      rule("an estimated scale or an estimated sigma, not both", "scale",
           "a common factor and sigma, both estimated",
           [](const N& n) { return !n.scale_known && n.estimates_sigma(); })};
}

const Block<StatedNoise>& noise_block_of_fit() {
  using N = StatedNoise;
  const auto distribution = [](ErrorShape shape) {
    return Word<NoiseDistribution>{{shape}, error_shape_name(shape)};
  };
  static const std::vector<Word<NoiseDistribution>> distributions{
      distribution(ErrorShape::normal),
      {{ErrorShape::normal, true}, "log_normal"},
      distribution(ErrorShape::laplace),
      distribution(ErrorShape::student_t)};
  static const Block<N> block(
      "fit_noise", "scatter of a reading y about the model",
      {key("kind", &N::kind_alone, word(kNoiseKindWords),
           "needed unless the distribution is log_normal"),
       key("distribution", &N::distribution, word(distributions),
           "shape of the noise, sigma being its scale; default normal; log_normal is the kind log"),
       key("degrees_of_freedom", &N::degrees_of_freedom, number({.least = 2.0, .above = true}),
           fmt::format("of student_t; default {}", Noise{}.degrees_of_freedom)),
       key("relative", &N::relative, relative_sigma(),
           "b of sigma = b |y| (relative_to_datum), a + b |y| (combined), b |model|, or of the "
           "logarithm (log); or \"estimated\" or \"estimated NAME\": sigma = a + b |model| with b "
           "among the parameters"),
       key("absolute", &N::absolute, absolute_sigma(),
           "a, such as \"5 mN\"; or \"estimated\" or \"estimated NAME\""),
       key("angle", &N::angle_rad, files::quantity(Dimension::angle, kAboveZero),
           "of a spectrum whose magnitude and phase were measured: standard deviation of the "
           "phase, such as \"0.3 deg\"; \"relative\" is then that of the magnitude, and the noise "
           "of storage and loss is correlated"),
       key("scale", &N::scale_known, word(kNoiseScaleWords),
           "estimated: right up to one common factor; thresholds come from F")},
      noise_rules());
  return block;
}

const Block<Selector>& selector_block() {
  using S = Selector;
  static const Block<S> block(
      "selector",
      "picks readings by their imposed depth or load and by their label; a missing key matches all",
      {key("depth", &S::depth_m, files::quantity(Dimension::length), "imposed depth"),
       key("load", &S::load_N, files::quantity(Dimension::force), "imposed load"),
       key("label", &S::label, text(), "of the row")});
  return block;
}

constexpr auto kImposedWords = std::to_array<Word<bool>>({{false, "drive"}, {true, "response"}});

std::vector<Rule<StatedData>> data_rules() {
  using D = StatedData;
  const auto without_recording = [](const D& data, const char* key, bool stands) {
    return stands && data.protocol.kind != FitProtocol::measured
               ? std::optional(Fault{key, "without a recording"})
               : std::nullopt;
  };
  return {
      {"an angle of the noise only with the protocol 'oscillation'",
       [](const D& d) {
         const bool spectrum = d.protocol.kind == FitProtocol::oscillation;
         return d.noise.angle_rad && !spectrum ? std::optional(Fault{"noise", "an angle"})
                                               : std::nullopt;
       }},
      {"'import' only with the protocol 'measured' or 'oscillation'",
       [](const D& d) {
         const bool importable = d.protocol.kind == FitProtocol::measured ||
                                 d.protocol.kind == FitProtocol::oscillation;
         return !importable && d.import ? std::optional(Fault{"import", "for separate readings"})
                                        : std::nullopt;
       }},
      {"'from' only with the protocol 'measured'",
       [=](const D& d) { return without_recording(d, "from", std::isfinite(d.choice.from_s)); }},
      {"'to' only with the protocol 'measured'",
       [=](const D& d) { return without_recording(d, "to", std::isfinite(d.choice.to_s)); }},
      {"'from' before 'to'",
       [](const D& d) {
         return d.choice.from_s < d.choice.to_s ? std::nullopt
                                                : std::optional(Fault{"to", "not after 'from'"});
       }},
      {"'clipped_above' only with the protocol 'measured'",
       [=](const D& d) {
         return without_recording(d, "clipped_above", d.clipped_above.has_value());
       }},
      {"'contact_force' only with the protocol 'measured'",
       [=](const D& d) {
         return without_recording(d, "contact_force", d.contact_response.has_value());
       }},
      {"'clipped_below' only with the protocol 'measured'", [=](const D& d) {
         return without_recording(d, "clipped_below", d.clipped_below.has_value());
       }}};
}

}  // namespace

const Block<StatedData>& data_block() {
  using D = StatedData;
  const auto of_choice = [](const Key<DataChoice>& one) { return within(&D::choice, one); };
  const auto time = [&](const char* name, double DataChoice::*member, const char* sentence) {
    return with_default(of_choice(key(name, member, files::quantity(Dimension::time), sentence)),
                        nullptr);
  };
  static const Block<D> block(
      "fit_data", "a data set with its protocol and noise",
      {required(of_choice(key("dataset", &DataChoice::dataset, text(1),
                              "id of a shipped curve (tpm data list) or a path ending in .csv or "
                              ".json, relative to this file"))),
       required(key("protocol", &D::protocol,
                    placed(protocol_kinds_of_fit().type(), &StatedProtocol::place),
                    "what was imposed")),
       required(key("noise", &D::noise, placed(noise_block_of_fit().type(), &StatedNoise::place),
                    "scatter of a reading")),
       key("stiffness_per_modulus", &D::stiffness_per_modulus_m,
           placed(files::quantity(Dimension::length, kAboveZero)),
           "oscillation, moduli under a law of contact force over depth: A0/l0, the contact's "
           "stiffness over the modulus, such as \"12.56 mm\""),
       key("import", &D::import,
           reading_type().named("fit_import",
                                "what the file does not say, as the options of tpm data import"),
           "recordings and spectra without a description: what the file does not say"),
       time("from", &DataChoice::from_s, "recordings: earlier samples are not fitted"),
       time("to", &DataChoice::to_s, "recordings: later samples are predicted, not fitted"),
       key("imposed", &D::load_imposed, placed(word(kImposedWords)),
           "recordings of stress over strain or force over depth: response where the load was "
           "imposed and the strain or depth answers (creep); its noise is then one of what "
           "answers"),
       key("contact_force", &D::contact_response, stated_quantity(),
           "recordings: force at which contact begins, as --contact-force; it tells the rest "
           "before "
           "and the length of the ramp, and 'from' what is fitted"),
       key("clipped_above", &D::clipped_above, stated_quantity(),
           "recordings: limit of the force cell; readings from here on are censored: of each it "
           "counts only that it lay at the limit or beyond"),
       key("clipped_below", &D::clipped_below, stated_quantity(),
           "the same of the smallest reading"),
       of_choice(key("exclude", &DataChoice::exclude, list(selector_block().type()),
                     "readings that are not used")),
       of_choice(key("hold_out", &DataChoice::hold_out, list(selector_block().type()),
                     "readings that are not fitted but predicted"))},
      data_rules());
  return block;
}

}  // namespace tpm::fit
