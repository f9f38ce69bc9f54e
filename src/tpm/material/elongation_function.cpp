#include "tpmkit/elongation_function.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/core/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm {

ElongationFunction::ElongationFunction(const ElongationShape& shape,
                                       std::initializer_list<double> values)
    : shape_(shape.is_linear() ? nullptr : &shape) {
  std::copy_n(values.begin(), std::min(values.size(), shape.parameters().size()), values_.begin());
}

std::string_view ElongationFunction::shape_name() const {
  if (shape_ != nullptr) return shape_->name();
  const ElongationShapes all = elongation_shapes();
  const auto linear =
      std::find_if(all.begin(), all.end(), [](const ElongationShape* s) { return s->is_linear(); });
  return linear == all.end() ? "linear" : (*linear)->name();
}

double ElongationFunction::change(double l, const ShapeValues& of_values) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < parameters().size(); ++k) {
    if (of_values[k] != 0.0) sum += of_values[k] * shape_->derivative(l, values_, k);
  }
  return sum;
}

double ElongationFunction::gap(double l, double w) const {
  if (shape_ == nullptr) return 0.5 * (l - w) * (l - w);
  const double u = inverse(w);
  return integral(l) - integral(u) - (l - u) * w;
}

ElongationFunction elongation_function(std::string_view name,
                                       std::initializer_list<double> values) {
  const ElongationShape& shape = elongation_shape(name, "material");
  const std::vector<MaterialParameter>& parameters = shape.parameters();
  if (values.size() != parameters.size()) {
    throw bad_input("material",
                    fmt::format("{} values for the shape '{}'", values.size(), shape.name()),
                    std::to_string(parameters.size()));
  }
  for (std::size_t k = 0; k < values.size(); ++k) {
    const double value = values.begin()[k];
    if (std::isfinite(value) && parameters[k].allows(value)) continue;
    throw bad_input("material", fmt::format("{} = {}", parameters[k].name, shortest(value)),
                    range_of(parameters[k]));
  }
  return {shape, values};
}

}  // namespace tpm
