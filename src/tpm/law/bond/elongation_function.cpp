#include "tpmkit/elongation_function.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
using namespace base;

std::string range_of(const MaterialParameter& parameter) {
  const std::string least = shortest(parameter.least);
  return parameter.least_excluded ? "above " + least : least + " or above";
}

ElongationShape::ElongationShape(Entry entry) : entry_(std::move(entry)) {
  if (entry_.parameters.size() <= kMostShapeParameters) return;
  throw std::logic_error(fmt::format("the shape '{}' has {} parameters, more than {}", entry_.name,
                                     entry_.parameters.size(), kMostShapeParameters));
}

double ElongationShape::inverse(double w, const ShapeValues& p) const {
  const double aim = std::abs(w);
  if (aim == 0.0) return 0.0;
  double low = 0.0;
  double high = aim;
  while (value(high, p) < aim) {
    low = high;
    high *= 2.0;
  }
  double l = 0.5 * (low + high);
  constexpr int kMostSteps = 200;  // bisection alone would be done after 60
  for (int i = 0; i < kMostSteps; ++i) {
    const double excess = value(l, p) - aim;
    (excess > 0.0 ? high : low) = l;
    double next = l - excess / slope(l, p);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (excess == 0.0 || next == l || std::abs(next - l) <= 1e-16 * high) break;
    l = next;
  }
  return std::copysign(l, w);
}

std::vector<const ElongationShape*> joined(std::initializer_list<ElongationShapes> lists) {
  std::vector<const ElongationShape*> all;
  for (const ElongationShapes& list : lists) all.insert(all.end(), list.begin(), list.end());
  std::sort(all.begin(), all.end(), [](const ElongationShape* a, const ElongationShape* b) {
    return a->rank() != b->rank() ? a->rank() < b->rank() : a->name() < b->name();
  });
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (all[i]->name() != all[k]->name()) continue;
      throw std::logic_error(fmt::format("two shapes are called '{}'", all[i]->name()));
    }
  }
  return all;
}

const ElongationShape& elongation_shape(std::string_view name, std::string_view where) {
  std::vector<std::string> names;
  for (const ElongationShape* shape : elongation_shapes()) {
    if (shape->name() == name) return *shape;
    names.emplace_back(shape->name());
  }
  throw unknown_word(where, "unknown shape", name, names);
}

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
