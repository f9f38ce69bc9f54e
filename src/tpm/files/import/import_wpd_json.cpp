// Declared in tpm/files/import/import_digitizer.hpp.
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "tpm/files/import/import_digitizer.hpp"
#include "tpm/files/json.hpp"
#include "tpm/files/other_kind.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

/// A key of a JSON document written by another program: errors name the path.
const Json& member(const Json& object, const std::string& key, const std::string& where) {
  if (!object.is_object() || !object.contains(key)) {
    throw bad_input(where, fmt::format("no key '{}'", key), "a WebPlotDigitizer project");
  }
  return object.at(key);
}

const Json& list(const Json& object, const std::string& key, const std::string& where) {
  const Json& found = member(object, key, where);
  if (!found.is_array()) {
    throw bad_input(where, fmt::format("key '{}' is no list", key), "a WebPlotDigitizer project");
  }
  return found;
}

/// Calibration values are stored as text, pixels as numbers.
double number(const Json& value, const std::string& where) {
  if (value.is_number()) return value.get<double>();
  if (value.is_string()) return parse_number(value.get<std::string>(), where);
  throw bad_input(where, "is not a number", "a number");
}

std::string text(const Json& object, const char* key) {
  const bool found = object.is_object() && object.contains(key) && object.at(key).is_string();
  return found ? object.at(key).get<std::string>() : std::string();
}

bool flag(const Json& object, const char* key) {
  return object.contains(key) && object.at(key).is_boolean() && object.at(key).get<bool>();
}

struct Pixel {
  double x;
  double y;
};

/// Turns pixels into plot coordinates. Points 1 and 2 lie on the x axis and points 3 and 4 on the y
/// axis, with known values. With the axis directions u = p2 - p1 and v = p4 - p3 a pixel p is
/// p1 + a u + b v = p3 + c u + d v, and x = x1 + a (x2 - x1), y = y3 + d (y4 - y3); logarithmic
/// axes interpolate the logarithm.
class Calibration {
 public:
  Calibration(const Json& axes, const std::string& where)
      : log_x_(flag(axes, "isLogX")), log_y_(flag(axes, "isLogY")) {
    const std::string type = text(axes, "type");
    if (type != "XYAxes") {
      throw bad_input(where, fmt::format("axes of type '{}'", printable(type)), "XYAxes");
    }
    const Json& points = list(axes, "calibrationPoints", where);
    if (points.size() < pixels_.size()) {
      throw bad_input(where, fmt::format("{} calibration points", points.size()), "four");
    }
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      const std::string place = fmt::format("{}: calibration point {}", where, i + 1);
      pixels_[i] = {number(member(points[i], "px", place), place),
                    number(member(points[i], "py", place), place)};
      const bool on_x = i < 2;
      const double value = number(member(points[i], on_x ? "dx" : "dy", place), place);
      values_[i] = on_x ? scaled(value, log_x_, place) : scaled(value, log_y_, place);
    }
    if (flag(axes, "noRotation")) {
      pixels_[1].y = pixels_[0].y;
      pixels_[3].x = pixels_[2].x;
    }
    u_ = {pixels_[1].x - pixels_[0].x, pixels_[1].y - pixels_[0].y};
    v_ = {pixels_[3].x - pixels_[2].x, pixels_[3].y - pixels_[2].y};
    determinant_ = u_.x * v_.y - u_.y * v_.x;
    if (determinant_ == 0.0) throw bad_input(where, "the axes are parallel", "two axes that cross");
  }

  [[nodiscard]] double x(const Pixel& p) const {
    const Pixel d{p.x - pixels_[0].x, p.y - pixels_[0].y};
    const double along = (d.x * v_.y - d.y * v_.x) / determinant_;
    const double value = values_[0] + along * (values_[1] - values_[0]);
    return log_x_ ? std::pow(10.0, value) : value;
  }

  [[nodiscard]] double y(const Pixel& p) const {
    const Pixel d{p.x - pixels_[2].x, p.y - pixels_[2].y};
    const double along = (u_.x * d.y - u_.y * d.x) / determinant_;
    const double value = values_[2] + along * (values_[3] - values_[2]);
    return log_y_ ? std::pow(10.0, value) : value;
  }

 private:
  static double scaled(double value, bool logarithmic, const std::string& where) {
    if (!logarithmic) return value;
    if (value <= 0.0) throw bad_input(where, "not positive on a logarithmic axis", "above 0");
    return std::log10(value);
  }

  bool log_x_;
  bool log_y_;
  std::array<Pixel, 4> pixels_{};
  std::array<double, 4> values_{};
  Pixel u_{};
  Pixel v_{};
  double determinant_ = 0.0;
};

/// Adds the coordinates of a point. False if the file states none.
bool add_value(const Json& point, const std::string& where, DigitizedDataset& dataset) {
  if (!point.is_object()) return false;
  const auto value = point.find("value");
  if (value == point.end() || !value->is_array() || value->size() < 2) return false;
  dataset.x.push_back(number(value->at(0), where));
  dataset.y.push_back(number(value->at(1), where));
  return true;
}

const Json& axes_of(const Json& project, const Json& dataset, const std::string& where) {
  const std::string name = text(dataset, "axesName");
  for (const Json& axes : list(project, "axesColl", where)) {
    if (text(axes, "name") == name) return axes;
  }
  throw bad_input(where, fmt::format("no axes named '{}'", printable(name)),
                  "the axes that 'axesName' names, under axesColl");
}

/// Points with values need no axes; those without are computed from their pixels.
DigitizedDataset read_dataset(const Json& project, const Json& json, const std::string& file) {
  DigitizedDataset dataset;
  dataset.name = text(json, "name");
  const std::string where = fmt::format("{}: dataset '{}'", file, printable(dataset.name));
  const Json& points = list(json, "data", where);
  std::optional<Calibration> calibration;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::string place = fmt::format("{}, point {}", where, i + 1);
    if (add_value(points[i], place, dataset)) continue;
    const Pixel pixel{number(member(points[i], "x", place), place),
                      number(member(points[i], "y", place), place)};
    if (!calibration) calibration.emplace(axes_of(project, json, where), where);
    dataset.x.push_back(calibration->x(pixel));
    dataset.y.push_back(calibration->y(pixel));
  }
  return dataset;
}

DigitizedDataset read_old_dataset(const Json& json, const std::string& file) {
  DigitizedDataset dataset;
  dataset.name = text(json, "name");
  const std::string where = fmt::format("{}: dataset '{}'", file, printable(dataset.name));
  const Json& points = list(json, "data", where);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::string place = fmt::format("{}, point {}", where, i + 1);
    if (add_value(points[i], place, dataset)) continue;
    throw bad_input(place, "has no value", "a list of x and y");
  }
  return dataset;
}

}  // namespace

std::vector<DigitizedDataset> read_wpd_json(std::string_view text, const std::string& file) {
  const Json project = parse_json(text, file);
  require_not_other_kind(project, "wpd", file);
  std::vector<DigitizedDataset> datasets;
  if (project.is_object() && project.contains("wpd")) {
    for (const Json& json : list(project.at("wpd"), "dataSeries", file + ": wpd")) {
      datasets.push_back(read_old_dataset(json, file));
    }
  } else {
    for (const Json& json : list(project, "datasetColl", file)) {
      datasets.push_back(read_dataset(project, json, file));
    }
  }
  return datasets;
}

}  // namespace tpm::files
