#include "option_kinds.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "command.hpp"
#include "tpm/base/nearest_word.hpp"

namespace tpm::app {
namespace {

/// Names of options whose values are of one kind.
struct OptionKind {
  std::string_view kind;
  std::string_view names;                   ///< between blanks
  std::optional<Dimension> dimension = {};  ///< of the whole value
};

/// Without a dimension are lists, places on the clock of a file, and quantities whose dimension
/// depends on the file.
constexpr OptionKind kKinds[] = {
    {"LENGTH",
     " --depth --radius --punch-radius --length --l0 --spacing --motion-tolerance "
     "--probe-diameter --encoder --hold-out ",
     Dimension::length},
    {"LENGTHS", " --depths --spacings "},
    {"TIME",
     " --hold --earliest --latest --duration --window --compare-every --checkpoint-every "
     "--page-keep --page-wait ",
     Dimension::time},
    {"TIME", " --from-time --until --step-time "},
    {"TIMES", " --times "},
    {"SPEED", " --rate ", Dimension::speed},
    {"FREQUENCY", " --loop-rate ", Dimension::frequency},
    {"FREQUENCIES", " --frequencies "},
    {"FORCE", " --contact-force --load ", Dimension::force},
    {"AREA", " --area --A0 ", Dimension::area},
    {"MODULUS", " --E --E1 --E2 --Eprime ", Dimension::stress},
    {"VISCOSITY", " --eta ", Dimension::viscosity},
    {"ANGLE", " --cone-angle ", Dimension::angle},
    {"STIFFNESS", " --spring-constant ", Dimension::stiffness},
    {"QUANTITY", " --contact --zero --reference --rest-length --deflection-sensitivity --wall "},
    {"NUMBER",
     " --poisson --density --order --patience --margin --noise --delay --inverse-gravity "},
    {"NUMBERS", " --margins "},
    {"COUNT",
     " --bootstrap --starts --repetitions --draws --spheres --most-spheres --layers --top --points "
     "--workers --block --header-rows --contact-samples --terms --index "},
    {"SEED", " --seed "},
    {"SHARE", " --level --target --sphere-tolerance --flaw "},
    {"TOLERANCE", " --tolerance --require "},
    {"PORT",
     " --port --events-port --page --inverse-port --inverse-events-port --inverse-http-port "},
    {"FILE",
     " --output --budget-file --costs --device-file --device-recording --replay-motion --law "
     "--scene --finer --session --instrument --calibration-instrument --recheck --credibility "
     "--write-scene --configuration --write-configuration --append-to --plugin --dhd-library "},
    {"FOLDER", " --folder "},
    {"LAWS", " --laws "},
    {"DEVICE", " --device "},
    {"RECORDING", " --at-recording "},
    {"COLUMN", " --time --drive --response --sd --frequency --storage --loss "},
    {"COLUMN=UNIT", " --unit "},
    {"QUANTITY:UNIT", " --x-quantity --y-quantity "},
    {"NAME",
     " --drive-quantity --response-quantity --quantity --dataset --inverse-id --serial --only "},
    {"AXIS", " --axis --over --x --y "},
    {"AXIS=VALUE", " --at "},
    {"VARIABLE", " --variable --objective "},
    {"MISFIT,COST", " --pareto "},
    {"FORMULA", " --size "},
    {"I/N", " --shard "},
    {"PATTERN", " --group-by "},
    {"CATEGORY=FILE", " --evidence "},
    {"DATE", " --date "},
    {"CODE", " --operator --subject --commit --doi "},
    {"TEXT", " --title --citation --specimen --probe-shape --note --context --question --risk "},
    {"WORD",
     " --format --family --resample --placement --filling --outputs --intervals --stiffening "
     "--clock --real-time --input-format --time-origin --provenance --to --segments --encoding "
     "--separator --decimal --thousands "}};

const OptionKind* find_kind(std::string_view name) {
  const std::string word = " " + std::string(name) + " ";
  for (const OptionKind& kind : kKinds) {
    if (kind.names.find(word) != std::string_view::npos) return &kind;
  }
  return nullptr;
}

}  // namespace

std::string_view kind_of_option(std::string_view name) {
  const OptionKind* kind = find_kind(name);
  return kind != nullptr ? kind->kind : std::string_view{};
}

void set_option_kinds(CLI::App& app) {
  for (CLI::App* command : app.get_subcommands({})) set_option_kinds(*command);
  for (CLI::Option* option : app.get_options()) {
    if (option->get_positional() || option->get_items_expected_max() == 0) continue;
    const std::string name = option->get_name();
    const OptionKind* kind = find_kind(name);
    if (kind == nullptr) continue;
    option->type_name(std::string(kind->kind));
    if (!kind->dimension) continue;
    // check() would append its own words to the kind in the help.
    option->each([name, dimension = *kind->dimension](const std::string& value) {
      // Some commands take a plain number in a unit of their own.
      if (value.find_first_not_of("0123456789.+-eE") == std::string::npos) return;
      static_cast<void>(option_quantity(value, dimension, name));
    });
  }
}

CLI::Validator one_of_words(std::vector<std::string> words) {
  const std::string known = fmt::format("{{{}}}", fmt::join(words, ","));
  return {[words = std::move(words)](const std::string& word) {
            if (std::ranges::find(words, word) != words.end()) return std::string();
            return fmt::format("unknown word '{}'{}; expected one of {}", printable(word),
                               did_you_mean(word, words), fmt::join(words, ", "));
          },
          known};
}

}  // namespace tpm::app
