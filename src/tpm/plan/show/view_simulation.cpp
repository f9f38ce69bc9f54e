#include "tpm/plan/show/view_simulation.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "tpm/base/text.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/organ/run/simulation.hpp"
#include "tpm/show/view_parts.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

constexpr const char* kExpectedResult = "a result of tpm simulate";

std::string step_name(std::size_t step, const char* what) {
  return fmt::format("/steps/{:05}/{}", step, what);
}

/// Reads an array in which all points must agree on their size: nothing of the file is trusted.
std::vector<double> table_of(const Hdf5Reader& file, const std::filesystem::path& path,
                             const std::string& name, std::size_t numbers) {
  std::vector<double> values = file.table(name);
  if (values.size() == numbers) return values;
  throw bad_input(path.string() + ": " + name, fmt::format("has {} numbers", values.size()),
                  fmt::format("{}", numbers));
}

/// Displacements, or forces, of the shown states, one after the other.
std::vector<float> states_of(const Hdf5Reader& file, const std::filesystem::path& path,
                             const char* what, const std::vector<std::size_t>& shown,
                             std::size_t spheres) {
  std::vector<float> all;
  all.reserve(shown.size() * 3 * spheres);
  for (const std::size_t step : shown) {
    for (const double v : table_of(file, path, step_name(step, what), 3 * spheres)) {
      all.push_back(static_cast<float>(v));
    }
  }
  return all;
}

std::vector<std::uint32_t> whole_numbers(const Hdf5Reader& file, const std::filesystem::path& path,
                                         const std::string& name, std::uint64_t below) {
  const std::vector<std::uint64_t> extents = file.extents(name);
  std::vector<std::uint32_t> result;
  for (const double v : file.part(name, std::vector<std::uint64_t>(extents.size(), 0), extents)) {
    if (!(v >= 0.0) || v >= static_cast<double>(below)) {
      throw bad_input(path.string() + ": " + name, "has a number that counts nothing",
                      fmt::format("0 to {}", below - 1));
    }
    result.push_back(static_cast<std::uint32_t>(v));
  }
  return result;
}

/// The states that the page holds, and the sentence that says which.
std::vector<std::size_t> shown_states(std::size_t states, std::size_t spheres, std::size_t most,
                                      Json& organ) {
  const std::size_t stride = shown_stride(states, 3 * spheres, most);
  std::vector<std::size_t> shown;
  for (std::size_t k = 0; k < states; k += stride) shown.push_back(k);
  if (shown.back() + 1 != states) shown.push_back(states - 1);
  organ["shown"] =
      stride == 1 ? fmt::format("all {} states of the file", states)
                  : fmt::format("{} of the {} states of the file, so that the page stays small",
                                shown.size(), states);
  return shown;
}

/// The tools in the shown states: a ball is placed by its centre, a punch by its face.
void add_tools(const Hdf5Reader& file, const std::filesystem::path& path,
               const std::vector<std::size_t>& shown, ViewPage& page, Json& organ) {
  if (!file.has("/tools/kind")) return;
  constexpr std::uint64_t kKinds = 2;
  const std::vector<std::uint32_t> kind = whole_numbers(file, path, "/tools/kind", kKinds);
  std::vector<float> places;
  for (const std::size_t step : shown) {
    for (const double v :
         table_of(file, path, step_name(step, "tools/position_m"), 3 * kind.size())) {
      places.push_back(static_cast<float>(v));
    }
  }
  organ["tools"] = {{"punch", kind},
                    {"radius_m", file.numbers("/tools/radius_m")},
                    {"direction", table_of(file, path, "/tools/direction", 3 * kind.size())},
                    {"position_m", page.put(places)}};
  if (organ["tools"]["radius_m"].size() != kind.size()) {
    throw bad_input(path.string() + ": /tools/radius_m", "has another length than /tools/kind",
                    kExpectedResult);
  }
}

/// When the response is largest, as tpm simulate says it: the force, or the depth under a load.
std::optional<double> time_of_peak(const Hdf5Reader& file, const std::filesystem::path& path) {
  const char* const response = file.has("/curve/force_N") ? "/curve/force_N" : "/curve/depth_m";
  if (!file.has(response)) return std::nullopt;
  const std::vector<double> values = file.numbers(response);
  const std::vector<double> times = file.numbers("/curve/time_s");
  if (values.empty() || values.size() != times.size()) return std::nullopt;
  std::vector<std::uint32_t> settling(values.size(), 0);
  if (file.has("/curve/settling")) settling = whole_numbers(file, path, "/curve/settling", 2);
  if (settling.size() != values.size()) return std::nullopt;
  std::vector<CurvePoint> curve(values.size());
  for (std::size_t i = 0; i < curve.size(); ++i) {
    curve[i].time_s = times[i];
    curve[i].response = values[i];
    curve[i].settling = settling[i] != 0;
  }
  const bool known = file.has_attribute("/", "tolerance");
  const double tolerance = known ? file.number_attribute("/", "tolerance") : 0.0;
  return largest_point(curve, tolerance).time_s;
}

void add_organ(const Hdf5Reader& file, const std::filesystem::path& path, std::size_t most,
               ViewPage& page) {
  const std::vector<double> rest = file.table("/spheres/position_m");
  const std::size_t spheres = rest.size() / 3;
  const std::vector<double> times = file.numbers("/steps/time_s");
  if (spheres == 0 || rest.size() != 3 * spheres || times.empty()) {
    throw bad_input(path.string(), "holds no state of an organ", kExpectedResult);
  }
  Json organ{{"spheres", spheres}, {"radius_m", file.numbers("/radius_m").at(0)}};
  const std::vector<std::size_t> shown = shown_states(times.size(), spheres, most, organ);
  std::vector<double> shown_times;
  for (const std::size_t k : shown) shown_times.push_back(times[k]);
  constexpr std::uint64_t kAny = std::uint64_t{1} << 31U;
  organ["rest_m"] = page.put(std::vector<float>(rest.begin(), rest.end()));
  organ["layer"] = page.put(whole_numbers(file, path, "/spheres/layer", kAny));
  // Files of version 0.1 name it by another word.
  const char* const constraint =
      file.has("/spheres/constraint") ? "/spheres/constraint" : "/spheres/held";
  organ["constraint"] = page.put(whole_numbers(file, path, constraint, 4));
  organ["bonds"] = page.put(whole_numbers(file, path, "/bonds/ends", spheres));
  organ["time_s"] = page.put(shown_times);
  organ["displacement_m"] = page.put(states_of(file, path, "displacement_m", shown, spheres));
  if (file.has(step_name(0, "force_N"))) {
    organ["force_N"] = page.put(states_of(file, path, "force_N", shown, spheres));
    organ["force_words"] = "force of the bonds on the sphere";
  }
  if (file.has("/probe/sphere")) organ["contact"] = file.numbers("/probe/sphere").at(0) - 1.0;
  if (file.has("/probe/direction")) organ["push"] = file.numbers("/probe/direction");
  add_tools(file, path, shown, page, organ);
  page.description["organ"] = std::move(organ);
}

/// A curve over time in the unit that people read.
void add_plot(ViewPage& page, const std::string& time, const Hdf5Reader& file,
              const std::string& name, const char* title, const char* unit, double scale) {
  if (!file.has(name)) return;
  std::vector<double> values = file.numbers(name);
  for (double& v : values) v *= scale;
  page.plot_over_time(title, unit,
                      {{{"kind", "line"}, {"label", title}, {"x", time}, {"y", page.put(values)}}});
}

void add_curves(const Hdf5Reader& file, ViewPage& page) {
  constexpr double kMilli = 1e3;
  const std::string time = page.put(file.numbers("/curve/time_s"));
  add_plot(page, time, file, "/curve/depth_m", "depth", "mm", kMilli);
  add_plot(page, time, file, "/curve/force_N", "contact force", "N", 1.0);
  add_plot(page, time, file, "/curve/load_N", "load", "N", 1.0);
  add_plot(page, time, file, "/curve/dissipated_J", "dissipated energy", "mJ", kMilli);
}

/// Claimed accuracy of a planned model, and its limits.
void add_claim(const Hdf5Reader& file, ViewPage& page) {
  if (!file.has("/claim")) return;
  const auto share = [&](const char* name) {
    return significant(100.0 * file.number_attribute("/", name), 3);
  };
  page.fact(
      "model",
      fmt::format("{} ({}{}{})", file.attribute("/", "model"), file.attribute("/", "formulation"),
                  file.has_attribute("/", "settings") ? ", " : "",
                  file.has_attribute("/", "settings") ? file.attribute("/", "settings") : ""));
  page.fact("claim", fmt::format("{}: error at most {} %, verified {} % ({}); {} % allowed",
                                 file.attribute("/claim", "quantity"), share("claimed_error"),
                                 share("verified_error"), file.attribute("/claim", "norm"),
                                 share("tolerance")));
  if (!file.has("/remarks")) return;
  for (const std::string& text : file.texts("/remarks/text")) page.fact("warning", text);
}

void add_origin(const Hdf5Reader& file, ViewPage& page) {
  const auto attribute = [&file](const char* name) {
    return file.has_attribute("/", name) ? file.attribute("/", name) : std::string();
  };
  page.description["title"] = attribute("title");
  page.description["badge"] = "SIMULATED";
  page.description["simulated"] = true;
  page.fact("origin", "computed from a model; nothing on this page was measured");
  page.fact("network", attribute("network"));
  page.fact("formulation", attribute("formulation"));
  page.fact("written by", fmt::format("tpm {}", attribute("version")));
  page.fact("scene's SHA-256", attribute("scene_sha256"));
  if (file.has("/assumptions")) {
    page.fact("assumptions", fmt::format("{}", fmt::join(file.texts("/assumptions/text"), "; ")));
  }
  if (!file.has_checksum())
    page.fact("check sum", "none: the file was not written by tpm, or is older");
  page.description["scene"] = attribute("scene");
}

}  // namespace

std::optional<OtherKind> other_than_simulation(const Hdf5Reader& file,
                                               const std::filesystem::path& path) {
  if (file.has("/curve/time_s") && file.has_attribute("/", "formulation")) return std::nullopt;
  const std::string name = shell_word(path.string());
  if (file.has_attribute("/", "sweep_fingerprint")) {
    return OtherKind{"is the result of a sweep", "tpm sweep plot " + name};
  }
  if (file.has("/rows")) {
    return OtherKind{"is an exported session", "the recording that it was exported from"};
  }
  if (file.has_attribute("/", "command") && file.attribute("/", "command") == "data pack") {
    return OtherKind{"is a pack of curves", "tpm data show " + name};
  }
  return OtherKind{"is an HDF5 file of another kind", kExpectedResult};
}

ViewPage view_simulation(const std::filesystem::path& path, std::string_view bytes,
                         const ViewOptions& options) {
  const Hdf5Reader file(path);
  if (const auto other = other_than_simulation(file, path)) {
    throw bad_input(path.string(), other->what, other->expected);
  }
  ViewPage page = begun_page("simulation", path, bytes);
  add_origin(file, page);
  add_claim(file, page);
  if (file.has("/spheres/position_m")) {
    add_organ(file, path, options.most_numbers, page);
  } else {
    page.fact("organ", "this formulation does not show whole states: there is no organ to turn");
  }
  if (const auto peak = time_of_peak(file, path)) page.description["start_s"] = *peak;
  add_curves(file, page);
  return page;
}

}  // namespace tpm::plan
