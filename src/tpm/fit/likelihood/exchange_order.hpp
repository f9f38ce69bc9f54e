#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "tpm/fit/likelihood/parameter.hpp"

namespace tpm::fit {

struct FitConfig;

/// The order of parts of a law that can change places without changing its response: relaxing
/// branches (by their times) and two spring-pots (by their orders). A fit and its profiles name
/// them in this order, so that an interval of `tau1` never holds values of `tau2`.
class ExchangeOrder {
 public:
  /// No order: nothing can change places.
  ExchangeOrder() = default;
  /// The order of a configuration. Nothing is ordered where a part is fixed, belongs to some data
  /// sets only, or has bounds that name the parts in another order already.
  explicit ExchangeOrder(const FitConfig& config);

  /// Gives the parts their names in rising order of their keys.
  /// @param natural all estimated parameters, SI
  void sort(std::vector<double>& natural) const;

  /// True if the keys rise, equal ones included.
  [[nodiscard]] bool is_sorted(std::span<const double> natural) const;

  /// Bounds with which a parameter that is fixed at a value keeps its place: keys before it stay
  /// below, keys behind it above. Other parameters than keys change nothing.
  [[nodiscard]] std::vector<FitParameter> bounds_around(std::span<const FitParameter> parameters,
                                                        std::size_t held, double value) const;

 private:
  /// A part that can change its place: the parameter that orders it, and those that go along.
  struct Part {
    std::size_t key;
    std::vector<std::size_t> companions;
  };
  std::vector<Part> parts_;
};

}  // namespace tpm::fit
