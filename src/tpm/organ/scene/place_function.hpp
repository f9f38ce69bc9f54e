#pragma once
#include <Eigen/Core>
#include <memory>
#include <string>
#include <string_view>

namespace tpm::organ {

/// A formula of place, such as "1 + 4*exp(-(x^2 + y^2)/0.01^2)": x, y and z are metres, the
/// arithmetic is muParser's (+ - * / ^, ?:, sqrt, exp, ln, abs, min, max, ...), pi is a constant.
class PlaceFunction {
 public:
  /// Throws Error(bad_input), starting with `where`, if the text is no formula or names something
  /// else.
  PlaceFunction(const std::string& text, std::string_view where);
  ~PlaceFunction();
  PlaceFunction(const PlaceFunction&) = delete;
  PlaceFunction& operator=(const PlaceFunction&) = delete;

  /// Throws Error(bad_input) where muParser refuses the values.
  [[nodiscard]] double at(const Eigen::Vector3d& place_m);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tpm::organ
