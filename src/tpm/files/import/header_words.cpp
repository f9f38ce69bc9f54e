#include "tpm/files/import/header_words.hpp"

#include <fmt/format.h>
#include <utf8.h>

#include <algorithm>
#include <array>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/import/refused_words.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

struct Letter {
  char32_t accented;
  char plain;
};

constexpr auto kLetters = std::to_array<Letter>({
    {U'\u00E0', 'a'}, {U'\u00E1', 'a'}, {U'\u00E2', 'a'}, {U'\u00E4', 'a'}, {U'\u00E7', 'c'},
    {U'\u00E8', 'e'}, {U'\u00E9', 'e'}, {U'\u00EA', 'e'}, {U'\u00EB', 'e'}, {U'\u00EC', 'i'},
    {U'\u00ED', 'i'}, {U'\u00EE', 'i'}, {U'\u00EF', 'i'}, {U'\u00F1', 'n'}, {U'\u00F2', 'o'},
    {U'\u00F3', 'o'}, {U'\u00F4', 'o'}, {U'\u00F6', 'o'}, {U'\u00F9', 'u'}, {U'\u00FA', 'u'},
    {U'\u00FB', 'u'}, {U'\u00FC', 'u'},
});

/// A lower-case letter or digit without accents; a space for everything else.
char folded(char32_t c) {
  // Latin-1 capitals lie 0x20 below their small letters, as in ASCII.
  const bool capital = (c >= U'A' && c <= U'Z') || (c >= U'\u00C0' && c <= U'\u00DE');
  if (capital) c += 0x20;
  if ((c >= U'a' && c <= U'z') || (c >= U'0' && c <= U'9')) return static_cast<char>(c);
  const auto letter = std::find_if(kLetters.begin(), kLetters.end(),
                                   [c](const Letter& l) { return l.accented == c; });
  return letter == kLetters.end() ? ' ' : letter->plain;
}

/// "BaseDisp" and "XForce" as "Base Disp" and "X Force".
std::string parted_at_capitals(std::string_view name) {
  const auto is_small = [](char c) { return c >= 'a' && c <= 'z'; };
  const auto is_capital = [](char c) { return c >= 'A' && c <= 'Z'; };
  std::string text;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool begins = i > 0 && is_capital(name[i]) &&
                        (is_small(name[i - 1]) ||
                         (is_capital(name[i - 1]) && i + 1 < name.size() && is_small(name[i + 1])));
    if (begins) text += ' ';
    text += name[i];
  }
  return text;
}

std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words(1);
  for (const char32_t c : utf8::utf8to32(std::string(name))) {
    const char plain = folded(c);
    if (plain != ' ') {
      words.back() += plain;
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

struct TitleWord {
  std::string_view word;
  Recognized meaning;
};

// The time of a step goes before that of the whole test.
constexpr Recognized kStepTime{ColumnRole::time, Quantity::time, -1};
constexpr Recognized kTime{ColumnRole::time, Quantity::time, 0};
constexpr Recognized kForce{ColumnRole::response, Quantity::contact_force, 0};
constexpr Recognized kStress{ColumnRole::response, Quantity::stress, 1};
constexpr Recognized kDepth{ColumnRole::drive, Quantity::indentation_depth, 0};
constexpr Recognized kDisplacement{ColumnRole::drive, Quantity::indentation_depth, 1};
constexpr Recognized kTravel{ColumnRole::drive, Quantity::indentation_depth, 2};
constexpr Recognized kCrosshead{ColumnRole::drive, Quantity::indentation_depth, 3};
constexpr Recognized kStretch{ColumnRole::drive, Quantity::relative_length, 4};
constexpr Recognized kStrain{ColumnRole::drive, Quantity::strain, 5};
constexpr Recognized kRelaxation{ColumnRole::response, Quantity::relaxation_modulus, 2};
constexpr Recognized kCompliance{ColumnRole::response, Quantity::creep_compliance, 2};
constexpr Recognized kHeight{ColumnRole::height, Quantity::indentation_depth, 0};
constexpr Recognized kDeflection{ColumnRole::deflection, Quantity::indentation_depth, 0};
constexpr Recognized kSd{ColumnRole::sd, Quantity::contact_force, 0};

constexpr Recognized kFrequency{ColumnRole::frequency, Quantity::frequency, 0};
constexpr Recognized kStorage{ColumnRole::storage, Quantity::storage_modulus, 0};
constexpr Recognized kLoss{ColumnRole::loss, Quantity::loss_modulus, 0};
constexpr Recognized kMagnitude{ColumnRole::magnitude, Quantity::storage_modulus, 0};
constexpr Recognized kPhase{ColumnRole::phase, Quantity::abscissa, 0};
constexpr Recognized kLossTangent{ColumnRole::loss_tangent, Quantity::abscissa, 1};

constexpr auto kWords = std::to_array<TitleWord>({
    {"time", kTime},
    {"t", kTime},
    {"timestamp", kTime},
    {"temps", kTime},
    {"zeit", kTime},
    {"prufzeit", kTime},
    {"testzeit", kTime},
    {"tiempo", kTime},
    {"tempo", kTime},
    {"tijd", kTime},
    {"schrittzeit", kStepTime},
    {"intervallzeit", kStepTime},
    {"segmentzeit", kStepTime},
    {"abschnittszeit", kStepTime},
    {"force", kForce},
    {"load", kForce},
    {"kraft", kForce},
    {"standardkraft", kForce},
    {"prufkraft", kForce},
    {"fuerza", kForce},
    {"forza", kForce},
    {"f", kForce},
    {"normalkraft", kForce},
    {"fz", kForce},
    {"fn", kForce},
    {"forca", kForce},
    {"kracht", kForce},
    {"effort", kForce},
    {"carga", kForce},
    {"carico", kForce},
    {"charge", kForce},
    {"stress", kStress},
    {"spannung", kStress},
    {"contrainte", kStress},
    {"sigma", kStress},
    {"tau", kStress},
    {"tension", kStress},
    {"esfuerzo", kStress},
    {"sforzo", kStress},
    {"tensione", kStress},
    {"schubspannung", kStress},
    {"druckspannung", kStress},
    {"nennspannung", kStress},
    {"depth", kDepth},
    {"indentation", kDepth},
    {"penetration", kDepth},
    {"eindringtiefe", kDepth},
    {"pd", kDepth},
    {"profondeur", kDepth},
    {"enfoncement", kDepth},
    {"indentacion", kDepth},
    {"profundidad", kDepth},
    {"profondita", kDepth},
    {"tiefe", kDepth},
    {"penetracion", kDepth},
    {"penetrazione", kDepth},
    {"displacement", kDisplacement},
    {"disp", kDisplacement},
    {"displ", kDisplacement},
    {"lvdt", kDisplacement},
    {"extension", kDisplacement},
    {"elongation", kDisplacement},
    {"allongement", kDisplacement},
    {"deplacement", kDisplacement},
    {"dehnung", kDisplacement},
    {"verlangerung", kDisplacement},
    {"verformung", kDisplacement},
    {"verschiebung", kDisplacement},
    {"desplazamiento", kDisplacement},
    {"spostamento", kDisplacement},
    {"deslocamento", kDisplacement},
    {"verplaatsing", kDisplacement},
    {"standardweg", kTravel},
    {"weg", kTravel},
    {"course", kTravel},
    {"stroke", kTravel},
    {"travel", kTravel},
    {"carrera", kTravel},
    {"corsa", kTravel},
    {"recorrido", kTravel},
    {"traverse", kCrosshead},
    {"crosshead", kCrosshead},
    {"distance", kCrosshead},
    {"traversenweg", kCrosshead},
    {"position", kCrosshead},
    {"posicion", kCrosshead},
    {"posizione", kCrosshead},
    {"stretch", kStretch},
    {"lambda", kStretch},
    {"length", kStretch},
    {"lange", kStretch},
    {"longueur", kStretch},
    {"strain", kStrain},
    {"nenndehnung", kStrain},
    {"height", kHeight},
    {"hohe", kHeight},
    {"hauteur", kHeight},
    {"altura", kHeight},
    {"altezza", kHeight},
    {"piezo", kHeight},
    {"zsensor", kHeight},
    {"zsnsr", kHeight},
    {"zpiezo", kHeight},
    {"zheight", kHeight},
    {"deflection", kDeflection},
    {"defl", kDeflection},
    {"auslenkung", kDeflection},
    {"deflexion", kDeflection},
    {"deflessione", kDeflection},
    {"vdeflection", kDeflection},
    {"gamma", kStrain},
    {"epsilon", kStrain},
    {"scherung", kStrain},
    {"stauchung", kStrain},
    {"deformation", kStrain},
    {"deformacion", kStrain},
    {"deformazione", kStrain},
    {"frequency", kFrequency},
    {"freq", kFrequency},
    {"frequenz", kFrequency},
    {"kreisfrequenz", kFrequency},
    {"frequence", kFrequency},
    {"frecuencia", kFrequency},
    {"frequenza", kFrequency},
    {"omega", kFrequency},
    {"complex", kMagnitude},
    {"magnitude", kMagnitude},
    {"delta", kPhase},
    {"phase", kPhase},
    {"phasenwinkel", kPhase},
    {"tandelta", kLossTangent},
    {"storage", kStorage},
    {"speichermodul", kStorage},
    {"conservation", kStorage},
    {"almacenamiento", kStorage},
    {"conservativo", kStorage},
    {"loss", kLoss},
    {"verlustmodul", kLoss},
    {"perte", kLoss},
    {"perdida", kLoss},
    {"dissipativo", kLoss},
    {"sd", kSd},
    {"stdev", kSd},
    {"stddev", kSd},
    {"x", {ColumnRole::drive, Quantity::abscissa, 9}},
    {"y", {ColumnRole::response, Quantity::ordinate, 9}},
});

/// G', G'', E', E", J' and the like, with straight or typographic primes: a letter and one or two
/// of them. G* and |G*| are the magnitude.
std::optional<Recognized> recognize_primes(std::string_view name) {
  std::u32string text = utf8::utf8to32(std::string(trimmed(name)));
  if (text.size() > 3 && text.front() == U'|' && text.back() == U'|') {
    text = text.substr(1, text.size() - 2);
  }
  if (text.size() < 2 || std::u32string_view(U"GEKgekJ").find(text[0]) == std::u32string::npos) {
    return std::nullopt;
  }
  if (text.substr(1) == U"*") return text[0] == U'J' ? std::nullopt : std::optional(kMagnitude);
  int primes = 0;
  for (const char32_t c : std::u32string_view(text).substr(1)) {
    if (c == U'\'' || c == U'\u2032' || c == U'\u2019') {
      primes += 1;
    } else if (c == U'"' || c == U'\u2033' || c == U'\u201D') {
      primes += 2;
    } else {
      return std::nullopt;
    }
  }
  if (primes == 1) return kStorage;
  return primes == 2 ? std::optional(kLoss) : std::nullopt;
}

/// G(t) and E(t) are relaxation moduli, J(t) and D(t) creep compliances.
std::optional<Recognized> recognize_step_response(std::string_view name) {
  std::string text;
  for (const char c : name) {
    if (c != ' ') text += c;
  }
  if (text == "G(t)" || text == "E(t)") return kRelaxation;
  if (text == "J(t)" || text == "D(t)") return kCompliance;
  return std::nullopt;
}

bool has_word(const std::vector<std::string>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

bool has_word_of(const std::vector<std::string>& words,
                 std::initializer_list<std::string_view> known) {
  return std::ranges::any_of(known, [&words](auto word) { return has_word(words, word); });
}

/// The function that is the first or last word of a title: "Mean G(t)", "G(t) specimen 2".
std::optional<Recognized> function_beside_words(std::string_view name) {
  const std::string_view title = trimmed(name);
  const auto first = title.find(' '), last = title.rfind(' ');
  if (first == std::string_view::npos) return std::nullopt;
  const auto function = recognize_step_response(title.substr(last + 1));
  return function ? function : recognize_step_response(title.substr(0, first));
}

/// None if the words say that the numbers are others: logarithms, limits, a fitted curve.
std::optional<Recognized> unless_other(Recognized function, const std::vector<std::string>& words) {
  if (has_word_of(words, {"sd", "stdev", "stddev"})) return kSd;
  const bool other = has_word_of(
      words,
      {"log",      "log10",       "lg",         "ln",       "norm",   "normalized", "normalised",
       "normiert", "relative",    "ratio",      "lower",    "upper",  "ci",         "low",
       "high",     "se",          "sem",        "std",      "cv",     "fit",        "fitted",
       "model",    "predicted",   "prediction", "residual", "calc",   "calculated", "smoothed",
       "sigma",    "uncertainty", "deviation",  "variance", "theory", "simulated"});
  if (other || find_refused_word(words)) return std::nullopt;
  function.rank += 1;  // a title of nothing else says more
  return function;
}

/// L/L0: a length over the unloaded one, the zero as a letter, a digit or an index.
bool is_ratio_of_lengths(std::string_view name) {
  std::string text(name);
  std::erase_if(text, [](char c) { return c == ' ' || c == '_'; });
  constexpr auto kRatios = std::to_array<std::string_view>(
      {"L/L0", "l/l0", "L/Lo", "l/lo", "L/L\xE2\x82\x80", "l/l\xE2\x82\x80"});
  return std::ranges::find(kRatios, text) != kRatios.end();
}

/// Greek letters by their names, as words of their own.
std::string spelled_out(std::string_view name) {
  std::string text;
  for (const char32_t c : utf8::utf8to32(std::string(name))) {
    if (c == U'\u03C9') {
      text += " omega ";
    } else if (c == U'\u03B4') {
      text += " delta ";
    } else if (c == U'\u03B3') {
      text += " gamma ";
    } else if (c == U'\u03B5') {
      text += " epsilon ";
    } else if (c == U'\u03BB') {
      text += " lambda ";
    } else if (c == U'\u03C3') {
      text += " sigma ";
    } else if (c == U'\u03C4') {
      text += " tau ";
    } else {
      utf8::append(c, text);
    }
  }
  return text;
}

/// The word without the number behind it: "force2" is the second force.
std::string_view without_number(std::string_view word) {
  const auto last = word.find_last_not_of("0123456789");
  return last == std::string_view::npos ? word : word.substr(0, last + 1);
}

/// "Step time", "temps de l'intervalle".
bool is_of_a_step(const std::vector<std::string>& words) {
  constexpr auto kSteps = std::to_array<std::string_view>(
      {"step", "interval", "segment", "schritt", "intervall", "abschnitt", "etape", "intervalle",
       "paso", "intervalo", "segmento", "passo", "intervallo"});
  return std::any_of(kSteps.begin(), kSteps.end(),
                     [&words](std::string_view step) { return has_word(words, step); });
}

/// Quantity that the words of a title name, whatever else stands among them.
std::optional<Recognized> recognize_words(const std::vector<std::string>& words) {
  // "tan delta", "loss tangent", "loss factor".
  const bool tangent = has_word(words, "tan") || has_word(words, "tangent") ||
                       (has_word(words, "loss") && has_word(words, "factor"));
  if (tangent) return kLossTangent;
  if (has_word_of(words, {"compliance", "complaisance", "cedevolezza", "nachgiebigkeit",
                          "kriechnachgiebigkeit"})) {
    // "Storage compliance" and "loss compliance" are those of an oscillation.
    if (has_word(words, "storage")) return kStorage;
    return has_word(words, "loss") ? kLoss : kCompliance;
  }
  const bool relaxation = has_word_of(words, {"relaxation", "relajacion", "rilassamento"}) &&
                          has_word_of(words, {"modulus", "module", "modulo"});
  if (relaxation || has_word(words, "relaxationsmodul")) return kRelaxation;
  const auto meaning_of = [](std::string_view word) {
    const auto known = std::find_if(kWords.begin(), kWords.end(),
                                    [word](const TitleWord& w) { return w.word == word; });
    return known == kWords.end() ? nullptr : &known->meaning;
  };
  std::optional<Recognized> found;
  for (const std::string& word : words) {
    const Recognized* known = meaning_of(word);
    if (known == nullptr) known = meaning_of(without_number(word));
    if (known == nullptr) continue;
    // "Piezo deflection" is a deflection, and the height of a cantilever's base is no depth.
    const bool deflection =
        found && (found->role == ColumnRole::deflection || known->role == ColumnRole::deflection);
    if (deflection) {
      found = kDeflection;
      continue;
    }
    // "Piezo position" is the height of the cantilever's base.
    const bool travel = known->role == ColumnRole::drive && known->rank >= kTravel.rank;
    if (found && found->role == ColumnRole::height && travel) continue;
    // "Course traverse absolue" is crosshead travel: the word that says more counts.
    if (!found || known->rank > found->rank) found = *known;
  }
  if (found && found->role == ColumnRole::time && is_of_a_step(words)) return kStepTime;
  return found;
}

}  // namespace

std::vector<std::string> title_words(std::string_view name) {
  std::vector<std::string> words = words_of(spelled_out(name));
  if (recognize_words(words)) return words;
  std::vector<std::string> parts = words_of(spelled_out(parted_at_capitals(name)));
  return recognize_words(parts) ? parts : words;
}

bool is_dimension_of(const Recognized& meaning, Dimension dimension) {
  const auto is_one_of = [dimension](std::initializer_list<Dimension> known) {
    return std::find(known.begin(), known.end(), dimension) != known.end();
  };
  switch (meaning.role) {
    case ColumnRole::time:
      return dimension == Dimension::time;
    case ColumnRole::response:
      if (meaning.quantity == Quantity::contact_force || meaning.quantity == Quantity::stress) {
        return is_one_of({Dimension::force, Dimension::stress, Dimension::compliance});
      }
      return meaning.quantity == Quantity::ordinate ||
             dimension == quantity_dimension(meaning.quantity);
    case ColumnRole::drive:
      return meaning.quantity == Quantity::abscissa ||
             is_one_of({Dimension::length, Dimension::dimensionless});
    case ColumnRole::height:
      return dimension == Dimension::length;
    case ColumnRole::frequency:
      return dimension == Dimension::frequency;
    case ColumnRole::storage:
    case ColumnRole::loss:
      return is_one_of({Dimension::stress, Dimension::stiffness, Dimension::compliance});
    case ColumnRole::magnitude:
      return is_one_of({Dimension::stress, Dimension::stiffness});
    case ColumnRole::phase:
      return is_one_of({Dimension::angle, Dimension::dimensionless});
    case ColumnRole::loss_tangent:
      return dimension == Dimension::dimensionless;
    case ColumnRole::sd:
    case ColumnRole::deflection:
      return true;
  }
  return true;
}

std::optional<Recognized> recognize_title(std::string_view name) {
  if (const auto primes = recognize_primes(name)) return primes;
  if (const auto function = recognize_step_response(name)) return function;
  if (const auto function = function_beside_words(name)) {
    return unless_other(*function, words_of(name));
  }
  if (is_normalised(name)) return std::nullopt;
  if (is_ratio_of_lengths(name)) return kStretch;
  const std::vector<std::string> words = title_words(name);
  const auto known = recognize_words(words);
  // The standard deviation of a force is no deviation from what was asked for.
  const bool sd = known && known->role == ColumnRole::sd;
  return known && (sd || !find_refused_word(words)) ? known : std::nullopt;
}

std::optional<RefusedTitle> refused_title(std::string_view name) {
  if (recognize_primes(name) || recognize_step_response(name)) return std::nullopt;
  const std::vector<std::string> words = title_words(name);
  const auto refused = find_refused_word(words);
  const auto known = recognize_words(with_parts_of_joined(words));
  if (!known || known->role == ColumnRole::sd) return std::nullopt;
  if (!refused) return std::nullopt;
  return RefusedTitle{*known, fmt::format("'{}' {}", refused->word, refused->why), refused->asked};
}

bool is_normalised(std::string_view name) {
  std::string text(name);
  std::erase_if(text, [](char c) { return c == ' ' || c == '_'; });
  return std::ranges::any_of(
      std::to_array<std::string_view>({"/G0", "/E0", "/J0", "/G(0)", "/E(0)", "/J(0)"}),
      [&text](std::string_view end) { return text.ends_with(end); });
}

bool is_logarithm(std::string_view name) {
  constexpr auto kLogarithms = std::to_array<std::string_view>({"log", "log10", "lg", "ln"});
  const std::vector<std::string> words = words_of(spelled_out(name));
  return words.size() > 1 && std::ranges::find(kLogarithms, words.front()) != kLogarithms.end();
}

bool is_angular(std::string_view name) {
  const std::vector<std::string> words = words_of(spelled_out(name));
  return has_word(words, "omega") || has_word(words, "angular") || has_word(words, "kreisfrequenz");
}

}  // namespace tpm::files
