#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"

namespace tpm::show {

/// One thing drawn in a panel. All numbers are in the units of the panel's axes.
struct Series {
  enum class Kind {
    line,     ///< x, y: a curve
    points,   ///< x, y, and `sd` if known: separate readings
    band,     ///< x, lower, upper: a range over a stretch of x
    bracket,  ///< x, lower, upper: a range known at single places only; nothing is drawn between
    mark,     ///< x, y: a single value, written out beside its place as `text`
    trail,    ///< x, y, and a range lower to upper of each x if known: points of one method, joined
    failed,   ///< x: settings that have no y; they stand above the panel, in a row named `text`
    upright,  ///< x: a limit, named `text`
    level,    ///< y: a limit, named `text`
    heat,     ///< x, y, and `z` at each place of them, row by row of x: colours
  };
  Kind kind = Kind::line;
  std::string label{};       ///< for the legend; same label, same colour in all panels of a figure
  std::string provenance{};  ///< "model", "simulated", or a word of provenance_name()
  std::string assumed{};     ///< assumed part of its place ("time"); empty if none
  std::vector<double> x{};
  std::vector<double> y{};
  std::vector<double> sd{};
  std::vector<double> lower{};
  std::vector<double> upper{};
  std::vector<double> z{};  ///< NaN: nothing there
  std::string text{};

  void add(double at, double value) {
    x.push_back(at);
    y.push_back(value);
  }
  void add_range(double at, double least, double most) {
    x.push_back(at);
    lower.push_back(least);
    upper.push_back(most);
  }
};

struct Axis {
  std::string quantity;  ///< "contact force"
  std::string unit;      ///< "N"; may be empty
  bool logarithmic = false;
  std::optional<double> lower{};  ///< limits; what is not given follows the data
  std::optional<double> upper{};
  std::vector<std::string> names{};  ///< labels at 1, 2, ...: for things that have no number
};

struct Panel {
  std::string title{};
  Axis x{};
  Axis y{};
  std::vector<Series> series{};
};

/// A figure as data: scripts/draw_figures.py draws it, and it can be redrawn without recomputing.
struct Figure {
  /// Name of the file it is drawn into, without ending; figure_id() where it holds a user's name.
  std::string id;
  std::string title;
  std::string caption;
  std::vector<Panel> panels{};
  std::string note{};  ///< one line drawn below the panels: what the numbers depend on
};

/// "BEGINNING_NAME" for Figure::id, of a name such as that of a data file: letters, digits, `-`,
/// `_` and `.` alone, at most 64 bytes, since it becomes a file name, an XML id and part of a
/// style. A name that is not so already ends in a check sum of it, so that two names give two ids.
[[nodiscard]] std::string figure_id(std::string_view beginning, std::string_view name);

/// The content of figures.json. Throws Error(numerical) if the arrays of a series differ in length
/// or hold a number that is not finite.
[[nodiscard]] Json to_json(const std::vector<Figure>& figures);

[[nodiscard]] Series line(std::string label, std::vector<double> x, std::vector<double> y,
                          std::string provenance = "model");

/// Adds a series to a panel, unless it is empty.
void add_if_any(Panel& panel, Series series);

/// A name as words: "contact force" of "contact_force".
[[nodiscard]] std::string spaced(std::string_view name);

}  // namespace tpm::show
