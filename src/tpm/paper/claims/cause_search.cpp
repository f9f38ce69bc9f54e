#include "tpm/paper/claims/cause_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <cstdint>
#include <optional>
#include <tuple>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::paper {
namespace {

Scope with_value(const Scope& scope, const std::string& name, double si) {
  Scope changed = scope;
  changed.formulas.erase(name);
  changed.values[name] = si;
  return changed;
}

/// One search: the formula, the target and where the answers go.
class CauseSearch {
 public:
  CauseSearch(const ClaimReader& reader, const ClaimValue& value, const Scope& scope,
              const PrintedNumber& printed, const Unit& unit)
      : reader_(reader), value_(value), scope_(scope), printed_(printed), unit_(unit) {}

  void try_printed_values(const AuditInput& input);
  void try_any_value(const AuditInput& input);
  [[nodiscard]] std::vector<AuditCause> take() { return std::move(causes_); }

 private:
  /// In the printed unit. Trial values can leave a formula's domain; such a value explains nothing.
  [[nodiscard]] std::optional<double> at(const std::string& name, double si) const {
    try {
      return value_.total(with_value(scope_, name, si)) / unit_.to_si;
    } catch (const Error&) {
      return std::nullopt;
    }
  }
  [[nodiscard]] std::optional<double> root_near(const std::string& name, double si) const;
  [[nodiscard]] std::optional<double> root_between(const std::string& name, double low,
                                                   double high) const;
  void add_choice(const AuditInput& input, const PrintedSymbol& symbol,
                  const std::vector<std::size_t>& choice);

  const ClaimReader& reader_;
  const ClaimValue& value_;
  const Scope& scope_;
  const PrintedNumber& printed_;
  const Unit& unit_;
  std::vector<AuditCause> causes_;
};

/// The printed values of a symbol: choice 0 is its own, the others stand in `also`.
double chosen_si(const PrintedSymbol& symbol, std::size_t choice) {
  return choice == 0 ? symbol.si : symbol.also[choice - 1].si;
}

std::string chosen_text(const PrintedSymbol& symbol, std::size_t choice) {
  const std::string& value = choice == 0 ? symbol.value : symbol.also[choice - 1].value;
  const std::string& where = choice == 0 ? symbol.where : symbol.also[choice - 1].where;
  return fmt::format("{} ({})", with_unit(value, symbol.unit), where);
}

/// An input in words for people.
std::string called(const ClaimReader& reader, const std::string& name) {
  const PrintedSymbol* symbol = reader.set().symbol(name);
  return symbol == nullptr ? name : symbol->summary;
}

void CauseSearch::add_choice(const AuditInput& input, const PrintedSymbol& symbol,
                             const std::vector<std::size_t>& choice) {
  double sum = 0.0;
  for (std::size_t t = 0; t < choice.size(); ++t) {
    sum += value_.term(t, with_value(scope_, input.name, chosen_si(symbol, choice[t])));
  }
  sum /= unit_.to_si;
  if (!compare_digits(printed_, sum).explained()) return;
  AuditCause cause;
  cause.only_printed = true;
  cause.recomputed = sum;
  const bool mixed =
      std::adjacent_find(choice.begin(), choice.end(), std::not_equal_to<>()) != choice.end();
  cause.text = symbol.summary + " = ";
  for (std::size_t t = 0; t < (mixed ? choice.size() : 1); ++t) {
    if (t > 0) cause.text += ", ";
    cause.text += chosen_text(symbol, choice[t]);
    if (mixed) cause.text += fmt::format(" in term {}", t + 1);
  }
  causes_.push_back(std::move(cause));
}

void CauseSearch::try_printed_values(const AuditInput& input) {
  constexpr std::size_t kMostCombinations = 4096;
  const PrintedSymbol* symbol = reader_.set().symbol(input.name);
  if (symbol == nullptr || symbol->also.empty()) return;
  const std::size_t values = symbol->also.size() + 1;
  const std::size_t terms = value_.terms();
  std::size_t combinations = 1;
  for (std::size_t t = 0; t < terms && combinations <= kMostCombinations; ++t)
    combinations *= values;
  if (combinations > kMostCombinations) {
    throw bad_input(reader_.at(), "too many combinations of terms and printed values",
                    fmt::format("at most {}", kMostCombinations));
  }
  // Combination 0 is the formula as it stands, which does not give the printed number.
  for (std::size_t c = 1; c < combinations; ++c) {
    std::vector<std::size_t> choice(terms);
    std::size_t rest = c;
    for (std::size_t t = 0; t < terms; ++t, rest /= values) choice[t] = rest % values;
    add_choice(input, *symbol, choice);
  }
}

std::optional<double> CauseSearch::root_between(const std::string& name, double low,
                                                double high) const {
  const auto residual = [&](double v) {
    // toms748 wants a number everywhere; the ends of the interval have one, so between them a hole
    // counts as a residual of the target itself and the root found is checked by the caller.
    return at(name, v).value_or(0.0) - printed_.value;
  };
  std::uintmax_t iterations = 100;
  const double a = std::fmin(low, high);
  const double b = std::fmax(low, high);
  const auto bracket = boost::math::tools::toms748_solve(
      residual, a, b, boost::math::tools::eps_tolerance<double>(48), iterations);
  return 0.5 * (bracket.first + bracket.second);
}

std::optional<double> CauseSearch::root_near(const std::string& name, double si) const {
  constexpr int kSteps = 60;
  constexpr double kLargestFactor = 10.0;
  const auto start = at(name, si);
  if (!start || si == 0.0) return std::nullopt;
  double previous[2] = {si, si};
  double residual[2] = {*start - printed_.value, *start - printed_.value};
  // Outwards in both directions at once, so that the nearest root is found first.
  for (int step = 1; step <= kSteps; ++step) {
    const double factor = std::pow(kLargestFactor, static_cast<double>(step) / kSteps);
    for (const int side : {0, 1}) {
      const double trial = side == 0 ? si * factor : si / factor;
      const auto there = at(name, trial);
      if (!there) continue;
      const double r = *there - printed_.value;
      if (r == 0.0) return trial;
      if (r * residual[side] < 0.0) return root_between(name, previous[side], trial);
      previous[side] = trial;
      residual[side] = r;
    }
  }
  return std::nullopt;
}

void CauseSearch::try_any_value(const AuditInput& input) {
  constexpr int kMostDigits = 6;
  const Unit& unit = input.value.unit;
  const double original = input.value.value * unit.to_si;
  const auto root = root_near(input.name, original);
  if (!root) return;
  for (int digits = 1; digits <= kMostDigits; ++digits) {
    const std::string text = significant(*root / unit.to_si, digits);
    const double si = parse_number(text, reader_.at()) * unit.to_si;
    const auto there = at(input.name, si);
    if (!there || !compare_digits(printed_, *there).explained()) continue;
    AuditCause cause;
    const std::string was =
        input.printed.empty() ? with_unit(significant(input.value.value, 4), unit) : input.printed;
    cause.text = fmt::format("{} = {} instead of {}", called(reader_, input.name),
                             with_unit(text, unit), was);
    cause.recomputed = *there;
    cause.digits = digits;
    cause.relative_change = std::abs(*root / original - 1.0);
    causes_.push_back(std::move(cause));
    return;
  }
}

}  // namespace

std::vector<AuditCause> search_causes(const ClaimReader& reader, const ClaimValue& value,
                                      const Scope& scope, const PrintedNumber& printed,
                                      const Unit& unit, const std::vector<AuditInput>& inputs,
                                      std::size_t limit) {
  CauseSearch search(reader, value, scope, printed, unit);
  for (const AuditInput& input : inputs) {
    search.try_printed_values(input);
    search.try_any_value(input);
  }
  std::vector<AuditCause> causes = search.take();
  std::ranges::stable_sort(causes, {}, [](const AuditCause& a) {
    return std::tuple(!a.only_printed, a.digits, a.relative_change);
  });
  if (causes.size() > limit) causes.resize(limit);
  return causes;
}

}  // namespace tpm::paper
