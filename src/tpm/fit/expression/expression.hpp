#pragma once
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace tpm::fit {

/// Names that one evaluation knows beside the evaluator's symbols and definitions; it comes before
/// them, values before formulas.
struct Scope {
  std::map<std::string, double, std::less<>> values;  ///< SI
  std::map<std::string, std::string, std::less<>> formulas;
};

/// Evaluates formulas such as "load / (lambda1 + E2) * l0 / A0" over named symbols and named
/// definitions. All values are SI. The arithmetic is muParser's (+ - * / ^, comparisons, ?:, sqrt,
/// sin, cos, tan, atan, acos, exp, ln, abs, min, max, ...), `pi` is a constant, and the functions
/// of the model library (model_functions.hpp) are known.
///
/// Names are looked up dynamically: a definition sees the scope of the evaluation that uses it, so
/// that one printed equation serves every set of inputs. One evaluator serves one thread.
class Evaluator {
 public:
  Evaluator();
  ~Evaluator();
  Evaluator(Evaluator&&) noexcept;
  Evaluator& operator=(Evaluator&&) noexcept;
  Evaluator(const Evaluator&) = delete;
  Evaluator& operator=(const Evaluator&) = delete;

  /// Both throw Error(bad_input) if the name is taken or is that of a function or constant.
  void define_symbol(const std::string& name, double value, std::string_view where);
  void define_expression(const std::string& name, std::string text, std::string_view where);

  /// Throws Error(bad_input), starting with `where`, if the text is no formula, names something
  /// unknown, or refers to itself; Error(numerical) if the result is not finite.
  [[nodiscard]] double evaluate(const std::string& text, const Scope& scope,
                                std::string_view where) const;

  /// Names of symbols and scope values the result depends on, through definitions, sorted.
  [[nodiscard]] std::vector<std::string> inputs(const std::string& text, const Scope& scope,
                                                std::string_view where) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tpm::fit
