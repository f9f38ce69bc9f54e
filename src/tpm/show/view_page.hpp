#pragma once
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

 private:
  std::string put_bytes(std::string_view type, std::string_view bytes);
  std::string arrays_;
  std::size_t count_ = 0;
};

}  // namespace tpm::show
