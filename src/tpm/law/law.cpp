#include "tpmkit/law.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
using namespace base;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr auto kKernelWords = std::to_array<Word<Kernel>>(
    {{Kernel::linear, "linear"}, {Kernel::hertz, "hertz"}, {Kernel::power, "power"}});

constexpr auto kFractionalWords =
    std::to_array<Word<Fractional>>({{Fractional::springpot, "fspringpot"},
                                     {Fractional::maxwell, "fmaxwell"},
                                     {Fractional::kelvin_voigt, "fkelvin_voigt"},
                                     {Fractional::zener, "fzener"},
                                     {Fractional::maxwell_pair, "fmaxwell2"},
                                     {Fractional::kelvin_voigt_pair, "fkelvin_voigt2"},
                                     {Fractional::zener_pair, "fzener2"}});

/// Numbers up to twelve are written as words.
constexpr auto kNumbers =
    std::to_array<std::string_view>({"no", "one", "two", "three", "four", "five", "six", "seven",
                                     "eight", "nine", "ten", "eleven", "twelve"});

template <typename Words>
std::vector<std::string> texts_of(const Words& words) {
  return mapped<std::string>(words, [](const auto& word) { return word.text; });
}

/// A law's name with each part replaced by the nearest word; empty where a part has none.
std::string nearest_law(std::string_view text);

Error unknown_law(std::string_view text, std::string_view where) {
  const std::string nearest = nearest_law(text);
  return bad_input(
      where,
      fmt::format("unknown law '{}'{}", printable(text),
                  nearest.empty() ? "" : fmt::format(" (did you mean '{}'?)", nearest)),
      "KERNEL[-BRANCHES or -FRACTIONAL][-elastic or -relaxing][-fluid][-series], such as "
      "linear-1-elastic, power-2 or hertz-fzener");
}

/// Imposed is a plain number, answered is a stress.
bool is_strain(const LawSpec& spec) {
  return is_answered_by_stress(spec.drive);
}

std::string nearest_law(std::string_view text) {
  static const std::vector<std::string> kernels = texts_of(kKernelWords);
  static const std::vector<std::string> others = [] {
    std::vector<std::string> all = texts_of(kFractionalWords);
    all.insert(all.end(), {"elastic", "relaxing", "fluid", "series"});
    return all;
  }();
  constexpr std::size_t kLongest = 100;
  if (text.size() > kLongest) return {};
  std::string name;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('-', begin), text.size());
    const std::string_view part = text.substr(begin, end - begin);
    const bool number = part.find_first_not_of("0123456789") == std::string_view::npos;
    const std::string nearest = begin == 0 ? nearest_word(part, kernels)
                                : number   ? std::string(part)
                                           : nearest_word(part, others);
    if (nearest.empty()) return {};
    const bool none = number && nearest.find_first_not_of('0') == std::string::npos;  // linear-0
    if (!none) name.append(begin == 0 ? "" : "-").append(nearest);
    begin = end + 1;
  }
  return name == text ? std::string() : name;
}

}  // namespace

std::string law_name(const LawSpec& spec) {
  std::string name(entry_of(kKernelWords, spec.kernel).text);
  if (spec.fractional != Fractional::none) {
    name += '-';
    name += entry_of(kFractionalWords, spec.fractional).text;
  } else if (spec.branches > 0) {
    name += fmt::format("-{}", spec.branches);
  }
  if (spec.tension == Tension::elastic) name += "-elastic";
  if (spec.tension == Tension::relaxing) name += "-relaxing";
  if (!spec.solid) name += "-fluid";
  if (spec.form == BranchForm::series) name += "-series";
  return name;
}

LawSpec parse_law_name(std::string_view text, std::string_view where) {
  LawSpec spec;
  spec.branches = 0;
  std::size_t begin = 0;
  for (int part = 0; begin <= text.size(); ++part) {
    const std::size_t end = std::min(text.find('-', begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    begin = end + 1;
    if (part == 0) {
      const auto* kernel = find_entry(kKernelWords, word);
      if (kernel == nullptr) throw unknown_law(text, where);
      spec.kernel = kernel->meaning;
    } else if (const auto* fractional = find_entry(kFractionalWords, word)) {
      spec.fractional = fractional->meaning;
    } else if (word == "elastic") {
      spec.tension = Tension::elastic;
    } else if (word == "relaxing") {
      spec.tension = Tension::relaxing;
    } else if (word == "fluid") {
      spec.solid = false;
    } else if (word == "series") {
      spec.form = BranchForm::series;
    } else {
      const auto [stop, status] =
          std::from_chars(word.data(), word.data() + word.size(), spec.branches);
      if (status != std::errc{} || stop != word.data() + word.size()) {
        throw unknown_law(text, where);
      }
    }
  }
  require_valid(spec, where);
  if (law_name(spec) != text) throw unknown_law(text, where);  // parts twice or out of order
  return spec;
}

std::string law_words(const LawSpec& spec) {
  const auto count = static_cast<std::size_t>(spec.branches);
  std::string words = spec.kernel == Kernel::linear  ? "linear kernel"
                      : spec.kernel == Kernel::hertz ? "Hertz kernel"
                                                     : "power-law kernel";
  static constexpr auto kFractionalWords = std::to_array<Word<Fractional>>({
      {Fractional::springpot, ", spring-pot"},
      {Fractional::maxwell, ", fractional Maxwell"},
      {Fractional::kelvin_voigt, ", fractional Kelvin-Voigt"},
      {Fractional::zener, ", fractional Zener"},
      {Fractional::maxwell_pair, ", fractional Maxwell of two spring-pots"},
      {Fractional::kelvin_voigt_pair, ", fractional Kelvin-Voigt of two spring-pots"},
      {Fractional::zener_pair, ", fractional Zener of two spring-pots"},
  });
  words += word_for(kFractionalWords, spec.fractional);
  if (spec.fractional == Fractional::none) {
    words += fmt::format(
        ", {} relaxing branch{}",
        count < kNumbers.size() ? std::string(kNumbers[count]) : std::to_string(spec.branches),
        spec.branches == 1 ? "" : "es");
  }
  if (spec.form == BranchForm::series) words += " as a Kelvin chain";
  if (!spec.solid) words += ", no lasting stiffness";
  words += spec.tension == Tension::none      ? ", no tension"
           : spec.tension == Tension::elastic ? ", elastic tension"
                                              : ", relaxing tension";
  return words;
}

bool depends_on_reference(const LawSpec& spec) noexcept {
  return spec.kernel != Kernel::linear || spec.tension != Tension::none;
}

std::string reference_words(const LawSpec& spec) {
  if (!depends_on_reference(spec)) return {};
  if (spec.drive == Quantity::strain) {
    return fmt::format("coefficients are secants at a strain of {}",
                       significant(spec.reference, 4));
  }
  if (is_strain(spec)) {
    return fmt::format("coefficients are secants at a stretch of {} above the slack length",
                       significant(spec.reference, 4));
  }
  return fmt::format("coefficients are secants at a depth of {} mm",
                     significant(1e3 * spec.reference, 4));
}

void require_valid(const LawSpec& spec, std::string_view where) {
  if (spec.branches < 0 || spec.branches > kMostBranches) {
    throw bad_input(where, fmt::format("{} branches", spec.branches),
                    fmt::format("0 to {} branches", kMostBranches));
  }
  if (spec.fractional != Fractional::none &&
      (spec.branches > 0 || spec.form == BranchForm::series || !spec.solid)) {
    throw bad_input(where, "a fractional law with branches, 'fluid' or 'series'",
                    "a fractional element instead of branches");
  }
  if (!spec.solid && (spec.branches == 0 || spec.form == BranchForm::series)) {
    throw bad_input(where, "a fluid without parallel branches",
                    "at least one branch, not 'series'");
  }
  if (spec.form == BranchForm::series && spec.branches == 0) {
    throw bad_input(where, "a Kelvin chain without units", "at least one branch");
  }
  if (spec.tension == Tension::relaxing && spec.branches == 0 &&
      spec.fractional == Fractional::none) {
    throw bad_input(where, "nothing relaxes, so tension cannot relax with it", "elastic tension");
  }
  if (!(spec.reference > 0.0) || !std::isfinite(spec.reference)) {
    throw bad_input(where, fmt::format("reference {}", shortest(spec.reference)),
                    "a reference depth above 0");
  }
  const bool indentation =
      spec.drive == Quantity::indentation_depth && spec.response == Quantity::contact_force;
  const bool stretch = is_strain(spec) && spec.response == Quantity::stress;
  if (!indentation && !stretch) {
    throw bad_input(
        where,
        fmt::format("{} answered by {}", quantity_name(spec.drive), quantity_name(spec.response)),
        "indentation_depth with contact_force, or strain or relative_length with stress");
  }
  if (spec.kernel == Kernel::hertz && stretch) {
    throw bad_input(where,
                    fmt::format("a Hertz kernel over a {}",
                                spec.drive == Quantity::strain ? "strain" : "relative length"),
                    "a linear or power kernel: Hertz is the contact of a ball over its depth");
  }
}

std::vector<LawParameter> law_parameters(const LawSpec& spec) {
  require_valid(spec, "law");
  const bool stretch = is_strain(spec);
  const Dimension stiffness = stretch ? Dimension::stress : Dimension::stiffness;
  const Dimension drive = stretch ? Dimension::dimensionless : Dimension::length;
  std::vector<LawParameter> p;
  const auto add_stiffness = [&](std::string name, std::string meaning, bool linear) {
    p.push_back({std::move(name), stiffness, std::move(meaning), linear, false, std::nullopt, 0.0,
                 kInfinity});
  };
  const auto add_time = [&](std::string name, std::string meaning) {
    p.push_back({std::move(name), Dimension::time, std::move(meaning), false, false, std::nullopt,
                 0.0, kInfinity});
  };
  const auto add_order = [&](std::string name, std::string meaning, double lower) {
    p.push_back({std::move(name), Dimension::dimensionless, std::move(meaning), false, false,
                 std::nullopt, lower, 1.0});
  };
  const auto add_fractional = [&](Fractional law) {
    const bool has_tau = has_relaxation_time(law);
    const bool pair = has_two_springpots(law);
    if (has_lasting_spring(law)) add_stiffness("k_inf", "stiffness in the end", true);
    add_stiffness("k1",
                  !has_tau ? "spring-pot: stiffness at 1 s, times Gamma(1-alpha)"
                  : pair   ? "stiffness of each spring-pot at the rate 1/tau1"
                           : "stiffness that relaxes",
                  true);
    if (law == Fractional::kelvin_voigt_pair) {
      add_stiffness("k2", "second spring-pot: stiffness at 1 s, times Gamma(1-beta)", true);
    }
    if (has_tau) add_time("tau1", "relaxation time");
    add_order("alpha", "order of the spring-pot", 0.01);
    if (pair) add_order("beta", "order of the second spring-pot, the smaller one", 0.0);
  };
  if (spec.form == BranchForm::series) {
    add_stiffness("k0", "instantaneous stiffness", false);
    for (int i = 1; i <= spec.branches; ++i) {
      add_stiffness(fmt::format("kc{}", i), "spring of a unit of the Kelvin chain", false);
    }
    for (int i = 1; i <= spec.branches; ++i) {
      add_time(fmt::format("T{}", i), "retardation time of that unit");
    }
  } else if (spec.fractional != Fractional::none) {
    add_fractional(spec.fractional);
  } else {
    if (spec.solid) add_stiffness("k_inf", "stiffness in the end", true);
    for (int i = 1; i <= spec.branches; ++i) {
      add_stiffness(fmt::format("k{}", i), "stiffness of a branch", true);
    }
    for (int i = 1; i <= spec.branches; ++i) {
      add_time(fmt::format("tau{}", i), "relaxation time of that branch");
    }
  }
  if (spec.kernel == Kernel::power) {
    p.push_back({"exponent", Dimension::dimensionless, "exponent m of the kernel", false, false,
                 std::nullopt, 1.0, 20.0});
  }
  if (spec.tension == Tension::elastic) {
    add_stiffness("k_tension", "secant stiffness of the tension at the reference depth", true);
  }
  if (spec.tension == Tension::relaxing) {
    p.push_back({"tension_share", Dimension::dimensionless,
                 "part of the kernel at the reference depth that is tension", false, false,
                 std::nullopt, 0.0, 1.0});
  }
  if (spec.tension != Tension::none) {
    p.push_back({"spacing", drive, "distance x of lateral neighbours", false, false, kInfinity, 0.0,
                 kInfinity});
  }
  const char* contact = spec.drive == Quantity::strain ? "strain at which the stress begins"
                        : stretch                      ? "slack length"
                                                       : "depth at which contact begins";
  p.push_back({"contact", drive, contact, false, true, 0.0, -kInfinity, kInfinity});
  p.push_back({"offset", stretch ? Dimension::stress : Dimension::force,
               "zero error of the response", true, true, 0.0, -kInfinity, kInfinity});
  return p;
}

}  // namespace tpm
