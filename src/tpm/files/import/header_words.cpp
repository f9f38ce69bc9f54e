#include "tpm/files/import/header_words.hpp"

#include <utf8.h>

#include <algorithm>
#include <array>
#include <vector>

#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

std::string_view trimmed(std::string_view text) noexcept {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

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
    {"temps", kTime},
    {"zeit", kTime},
    {"prufzeit", kTime},
    {"testzeit", kTime},
    {"tiempo", kTime},
    {"tempo", kTime},
    {"force", kForce},
    {"load", kForce},
    {"kraft", kForce},
    {"standardkraft", kForce},
    {"prufkraft", kForce},
    {"fuerza", kForce},
    {"forza", kForce},
    {"f", kForce},
    {"stress", kStress},
    {"spannung", kStress},
    {"contrainte", kStress},
    {"sigma", kStress},
    {"tau", kStress},
    {"depth", kDepth},
    {"indentation", kDepth},
    {"penetration", kDepth},
    {"eindringtiefe", kDepth},
    {"profondeur", kDepth},
    {"enfoncement", kDepth},
    {"displacement", kDisplacement},
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
    {"standardweg", kTravel},
    {"weg", kTravel},
    {"course", kTravel},
    {"stroke", kTravel},
    {"traverse", kCrosshead},
    {"crosshead", kCrosshead},
    {"traversenweg", kCrosshead},
    {"position", kCrosshead},
    {"stretch", kStretch},
    {"length", kStretch},
    {"lange", kStretch},
    {"longueur", kStretch},
    {"strain", kStrain},
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

/// G', G'', E', E" and the like, with straight or typographic primes: a letter and one or two of
/// them. G* and |G*| are the magnitude.
std::optional<Recognized> recognize_primes(std::string_view name) {
  std::u32string text = utf8::utf8to32(std::string(trimmed(name)));
  if (text.size() > 3 && text.front() == U'|' && text.back() == U'|') {
    text = text.substr(1, text.size() - 2);
  }
  if (text.size() < 2 || std::u32string_view(U"GEKgek").find(text[0]) == std::u32string::npos) {
    return std::nullopt;
  }
  if (text.substr(1) == U"*") return kMagnitude;
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

bool has_word(const std::vector<std::string>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// The text before and after the last separator, if a unit stands after it.
std::optional<ColumnTitle> split_at(std::string_view title, std::string_view separator) {
  const auto cut = title.rfind(separator);
  if (cut == std::string_view::npos) return std::nullopt;
  const auto unit = trimmed(title.substr(cut + separator.size()));
  if (!is_unit(unit)) return std::nullopt;
  return ColumnTitle{std::string(trimmed(title.substr(0, cut))), std::string(unit)};
}

}  // namespace

std::string_view without_brackets(std::string_view cell) noexcept {
  const std::string_view text = trimmed(cell);
  const bool bracketed = text.size() > 1 && ((text.front() == '(' && text.back() == ')') ||
                                             (text.front() == '[' && text.back() == ']'));
  return bracketed ? trimmed(text.substr(1, text.size() - 2)) : text;
}

ColumnTitle split_title(std::string_view title) {
  const std::string_view text = trimmed(title);
  const auto open = text.find_last_of("([");
  if (open != std::string_view::npos && open > 0) {
    const auto unit = without_brackets(text.substr(open));
    const bool square = text[open] == '[' && text.back() == ']' && !unit.empty();
    if (square || is_unit(unit)) {
      return {std::string(trimmed(text.substr(0, open))), std::string(unit)};
    }
  }
  for (const std::string_view separator : {" / ", ", ", " in ", "_"}) {
    if (auto split = split_at(text, separator)) return *split;
  }
  return {std::string(text), {}};
}

std::optional<Recognized> recognize_title(std::string_view name) {
  if (const auto primes = recognize_primes(name)) return primes;
  if (const auto function = recognize_step_response(name)) return function;
  const std::vector<std::string> words = words_of(spelled_out(name));
  // "tan delta", "loss tangent", "loss factor".
  const bool tangent = has_word(words, "tan") || has_word(words, "tangent") ||
                       (has_word(words, "loss") && has_word(words, "factor"));
  if (tangent) return kLossTangent;
  // "complex viscosity" is no modulus, "strain rate" no strain.
  for (const std::string_view other : {"viscosity", "rate", "geschwindigkeit", "vitesse"}) {
    if (has_word(words, other)) return std::nullopt;
  }
  if (has_word(words, "compliance")) return kCompliance;
  if (has_word(words, "modulus") && has_word(words, "relaxation")) return kRelaxation;
  std::optional<Recognized> found;
  for (const std::string& word : words) {
    const auto known = std::find_if(kWords.begin(), kWords.end(),
                                    [&word](const TitleWord& w) { return w.word == word; });
    if (known == kWords.end()) continue;
    // "Course traverse absolue" is crosshead travel: the word that says more counts.
    if (!found || known->meaning.rank > found->rank) found = known->meaning;
  }
  return found;
}

bool is_angular(std::string_view name) {
  const std::vector<std::string> words = words_of(spelled_out(name));
  return has_word(words, "omega") || has_word(words, "angular") || has_word(words, "kreisfrequenz");
}

}  // namespace tpm::files
