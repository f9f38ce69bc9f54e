#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"

namespace tpm::show {

/// One self-contained HTML page that shows a file: pages/view.html with a description (JSON) and
/// arrays of numbers in it. The page asks nothing of a network.
class ViewPage {
 public:
  /// Title, badge, facts, organ and plots; pages/view.html says what it draws of them.
  Json description;

  /// Puts numbers into the page, which finds them under the name that is answered.
  [[nodiscard]] std::string put(std::span<const float> numbers);
  [[nodiscard]] std::string put(std::span<const double> numbers);
  [[nodiscard]] std::string put(std::span<const std::uint32_t> numbers);
  template <class Number>
  [[nodiscard]] std::string put(const std::vector<Number>& numbers) {
    return put(std::span<const Number>(numbers));
  }

  /// Adds a plot of curves over time.
  void plot_over_time(std::string_view title, std::string_view unit, Json series);

  /// One row of the table "What this is": where the file came from and what it rests on.
  void fact(std::string_view name, std::string_view value);

  /// The whole page. Throws Error(environment) if pages/view.html is missing or damaged.
  [[nodiscard]] std::string html() const;

  /// Description and arrays as elements of a page, whose names begin with `prefix`.
  [[nodiscard]] std::string elements(std::string_view prefix) const;

 private:
  struct Array {
    std::string_view type;  ///< "float32", a literal
    std::string base64;
  };
  std::string put_bytes(std::string_view type, std::string_view bytes);
  std::vector<Array> arrays_;
};

/// Results as one page that shows one of them at a time and lists all by their kind at its top.
/// @param names of the results, as they are listed
/// @param not_shown what else was found, in words
[[nodiscard]] std::string html_of(const std::vector<ViewPage>& results,
                                  const std::vector<std::string>& names,
                                  const std::vector<std::string>& not_shown);

}  // namespace tpm::show
