// tpm laws: the family of laws, and the parameters of one.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::app {
namespace {

/// One of each kind; the rest are their combinations.
constexpr std::array<const char*, 16> kExamples{"linear",
                                                "linear-1",
                                                "linear-2",
                                                "linear-2-fluid",
                                                "linear-2-series",
                                                "hertz-1",
                                                "power-1",
                                                "linear-1-elastic",
                                                "linear-1-relaxing",
                                                "linear-fspringpot",
                                                "linear-fmaxwell",
                                                "linear-fkelvin_voigt",
                                                "linear-fzener",
                                                "linear-fmaxwell2",
                                                "linear-fkelvin_voigt2",
                                                "linear-fzener2"};

constexpr const char* kNextOfFamily = "tpm laws linear-1";  // the parameters of one

std::string grammar() {
  return fmt::format(
      "KERNEL[-BRANCHES][-TENSION][-fluid][-series]: kernel linear, hertz or power; branches 1 to "
      "{} or fspringpot, fmaxwell, fkelvin_voigt, fzener, with two spring-pots fmaxwell2, "
      "fkelvin_voigt2, fzener2; tension elastic or relaxing",
      kMostBranches);
}

Json limit(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json parameter_json(const LawParameter& p) {
  Json json{{"name", p.name},       {"key", law_key(p)},       {"unit", si_symbol(p.dimension)},
            {"meaning", p.meaning}, {"lower", limit(p.lower)}, {"upper", limit(p.upper)},
            {"linear", p.linear},   {"nuisance", p.nuisance}};
  if (p.preset) json["preset"] = std::isfinite(*p.preset) ? Json(*p.preset) : Json("infinite");
  return json;
}

Json law_json(const LawSpec& spec, bool with_parameters) {
  Json json{{"law", law_name(spec)}, {"summary", law_words(spec)}};
  if (!with_parameters) return json;
  json["parameters"] = array_json(law_parameters(spec), parameter_json);
  return json;
}

std::string range_words(const LawParameter& p) {
  if (std::isfinite(p.upper)) return fmt::format("{} to {}", shortest(p.lower), shortest(p.upper));
  return std::isfinite(p.lower) ? fmt::format("from {}", shortest(p.lower)) : "any";
}

std::string one_law_text(const LawSpec& spec) {
  std::string text = fmt::format("{}: {}\n\n{:<15} {:<5} {:<11} {}\n", law_name(spec),
                                 law_words(spec), "parameter", "unit", "range", "meaning");
  for (const LawParameter& p : law_parameters(spec)) {
    std::string meaning = p.meaning;
    if (p.preset) meaning += fmt::format(" ({} unless set)", shortest(*p.preset));
    text += fmt::format("{:<15} {:<5} {:<11} {}\n", p.name, si_symbol(p.dimension), range_words(p),
                        meaning);
  }
  return text;
}

std::string family_text() {
  std::string text = grammar() + "\n\n";
  for (const char* name : kExamples) {
    text += fmt::format("{:<22} {}\n", name, law_words(parse_law_name(name, "laws")));
  }
  return text + "\n" + next_line(kNextOfFamily);
}

std::string answer(const std::string& name, const Session& session) {
  if (!name.empty()) {
    const LawSpec spec = of_option([&] { return parse_law_name(name, "laws"); });
    return session.json() ? answer_text(session, law_json(spec, true)) : one_law_text(spec);
  }
  if (!session.json()) return family_text();
  const auto law = [](const char* text) { return law_json(parse_law_name(text, "laws"), false); };
  Json json{{"names", grammar()}, {"laws", array_json(kExamples, law)}};
  add_end(json, {}, {}, kNextOfFamily);
  return answer_text(session, std::move(json));
}

}  // namespace

void add_laws_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("laws", "The family of laws, and the parameters of one");
  const auto name = std::make_shared<std::string>();
  command->add_option("name", *name, "A law, e.g. linear-2-elastic");
  add_format_option(*command, session);
  command->footer("Example:\n  tpm laws hertz-fzener");
  set_run(*command, session, [name, &session] {
    deliver(answer(*name, session), "");
    return 0;
  });
}

}  // namespace tpm::app
