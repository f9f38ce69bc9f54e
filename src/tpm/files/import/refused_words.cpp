#include "tpm/files/import/refused_words.hpp"

#include <algorithm>
#include <array>

namespace tpm::files {
namespace {

constexpr std::string_view kAsked = "is what was asked for, not what was measured";
constexpr std::string_view kLimit = "is a limit or a summary, not a reading of each sample";
constexpr std::string_view kError = "is a deviation, not what was measured";
constexpr std::string_view kIsRate = "is a rate, not the quantity itself";
constexpr std::string_view kOther = "is another quantity";

struct RefusingWord {
  std::string_view word;
  std::string_view why;
};

constexpr auto kRefusing = std::to_array<RefusingWord>({
    // Commanded values.
    {"command", kAsked},
    {"commanded", kAsked},
    {"cmd", kAsked},
    {"target", kAsked},
    {"setpoint", kAsked},
    {"setvalue", kAsked},
    {"setting", kAsked},
    {"demand", kAsked},
    {"demanded", kAsked},
    {"desired", kAsked},
    {"requested", kAsked},
    {"reference", kAsked},
    {"ref", kAsked},
    {"nominal", kAsked},
    {"nominale", kAsked},
    {"programmed", kAsked},
    {"preset", kAsked},
    {"planned", kAsked},
    {"soll", kAsked},
    {"sollwert", kAsked},
    {"vorgabe", kAsked},
    {"vorgabewert", kAsked},
    {"fuhrungsgrosse", kAsked},
    {"zielwert", kAsked},
    {"ziel", kAsked},
    {"nennwert", kAsked},
    {"referenz", kAsked},
    {"consigne", kAsked},
    {"commande", kAsked},
    {"cible", kAsked},
    {"souhaite", kAsked},
    {"souhaitee", kAsked},
    {"consigna", kAsked},
    {"comando", kAsked},
    {"objetivo", kAsked},
    {"referencia", kAsked},
    {"deseado", kAsked},
    {"deseada", kAsked},
    {"obiettivo", kAsked},
    {"riferimento", kAsked},
    {"impostato", kAsked},
    {"impostata", kAsked},
    {"bersaglio", kAsked},
    {"desiderato", kAsked},
    {"desiderata", kAsked},
    // Limits and summaries.
    {"max", kLimit},
    {"maximum", kLimit},
    {"maximal", kLimit},
    {"maximale", kLimit},
    {"maximo", kLimit},
    {"maxima", kLimit},
    {"massimo", kLimit},
    {"massima", kLimit},
    {"min", kLimit},
    {"minimum", kLimit},
    {"minimal", kLimit},
    {"minimale", kLimit},
    {"minimo", kLimit},
    {"minima", kLimit},
    {"peak", kLimit},
    {"spitze", kLimit},
    {"pic", kLimit},
    {"pico", kLimit},
    {"picco", kLimit},
    {"fmax", kLimit},
    {"fmin", kLimit},
    {"limit", kLimit},
    {"limits", kLimit},
    {"threshold", kLimit},
    {"grenze", kLimit},
    {"grenzwert", kLimit},
    {"schwelle", kLimit},
    {"limite", kLimit},
    {"seuil", kLimit},
    {"umbral", kLimit},
    {"soglia", kLimit},
    {"break", kLimit},
    {"yield", kLimit},
    {"rupture", kLimit},
    {"bruch", kLimit},
    // Deviations.
    {"error", kError},
    {"err", kError},
    {"fehler", kError},
    {"regelabweichung", kError},
    {"abweichung", kError},
    {"erreur", kError},
    {"ecart", kError},
    {"errore", kError},
    // Rates.
    {"rate", kIsRate},
    {"speed", kIsRate},
    {"velocity", kIsRate},
    {"geschwindigkeit", kIsRate},
    {"vitesse", kIsRate},
    {"velocidad", kIsRate},
    {"velocita", kIsRate},
    {"acceleration", kIsRate},
    {"beschleunigung", kIsRate},
    // Other quantities.
    {"viscosity", kOther},
    {"viskositat", kOther},
    {"viscosite", kOther},
    {"viscosidad", kOther},
    {"viscosita", kOther},
    {"temperature", kOther},
    {"temperatur", kOther},
    {"temperatura", kOther},
    {"temp", kOther},
    {"humidity", kOther},
    {"energy", kOther},
    {"energie", kOther},
    {"energia", kOther},
    {"work", kOther},
    {"arbeit", kOther},
    {"voltage", kOther},
    {"spannungssignal", kOther},
    {"torque", kOther},
    {"drehmoment", kOther},
    {"couple", kOther},
    {"aspirated", kOther},
});

/// German joins its words: Sollkraft, Kraftsollwert, Maximalkraft.
constexpr auto kJoinedStarts = std::to_array<RefusingWord>({
    {"soll", kAsked},
    {"vorgabe", kAsked},
    {"ziel", kAsked},
    {"nenn", kAsked},
    {"maximal", kLimit},
    {"hochst", kLimit},
    {"grenz", kLimit},
    {"bruch", kLimit},
});
constexpr auto kJoinedEnds = std::to_array<RefusingWord>({
    {"sollwert", kAsked},
    {"vorgabe", kAsked},
    {"geschwindigkeit", kIsRate},
    {"temperatur", kOther},
    {"grenze", kLimit},
    {"fehler", kError},
    {"abweichung", kError},
});

/// A nominal stress or strain is measured: the force over the area, or the displacement over the
/// length, before the test.
bool is_engineering(std::string_view word, const std::vector<std::string>& words) {
  constexpr auto kNominal = std::to_array<std::string_view>({"nominal", "nominale"});
  constexpr auto kJoined = std::to_array<std::string_view>({"nennspannung", "nenndehnung"});
  constexpr auto kReferred = std::to_array<std::string_view>(
      {"stress", "strain", "spannung", "dehnung", "stauchung", "contrainte", "deformation",
       "esfuerzo", "deformacion", "sforzo", "deformazione"});
  if (std::ranges::find(kJoined, word) != kJoined.end()) return true;
  const bool referred = std::ranges::find_first_of(words, kReferred) != words.end();
  return referred && std::ranges::find(kNominal, word) != kNominal.end();
}

}  // namespace

std::optional<RefusedWord> find_refused_word(const std::vector<std::string>& words) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (is_engineering(word, words)) continue;
    const auto found = [&word](std::string_view why) {
      return RefusedWord{word, why, why == kAsked};
    };
    for (const RefusingWord& refusing : kRefusing) {
      if (word == refusing.word) return found(refusing.why);
    }
    for (const RefusingWord& start : kJoinedStarts) {
      if (word.size() > start.word.size() && word.starts_with(start.word)) return found(start.why);
    }
    for (const RefusingWord& end : kJoinedEnds) {
      if (word.size() > end.word.size() && word.ends_with(end.word)) return found(end.why);
    }
    const bool set = word == "set" && i + 1 < words.size() &&
                     (words[i + 1] == "point" || words[i + 1] == "value" || words.size() == 2);
    if (set || (word == "set" && i > 0)) return found(kAsked);
  }
  return std::nullopt;
}

bool names_another_quantity(const std::vector<std::string>& words) {
  constexpr auto kNever = std::to_array<std::string_view>(
      {"pressure",   "pression", "presion", "pressione", "pressao",    "vacuum",  "angle", "winkel",
       "drehwinkel", "angulo",   "angolo",  "rotation",  "volume",     "volumen", "volum", "flow",
       "strom",      "current",  "power",   "aspirated", "aspiration", "moment"});
  const auto refused = find_refused_word(words);
  return (refused && refused->why == kOther) ||
         std::ranges::find_first_of(words, kNever) != words.end();
}

std::vector<std::string> with_parts_of_joined(std::vector<std::string> words) {
  const std::size_t whole = words.size();
  for (std::size_t i = 0; i < whole; ++i) {
    for (const RefusingWord& start : kJoinedStarts) {
      if (words[i].starts_with(start.word)) words.push_back(words[i].substr(start.word.size()));
    }
    for (const RefusingWord& end : kJoinedEnds) {
      if (!words[i].ends_with(end.word)) continue;
      words.push_back(words[i].substr(0, words[i].size() - end.word.size()));
    }
  }
  return words;
}

}  // namespace tpm::files
