#include "tpm/plan/show/view_simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

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

/// A contact of the scene in the file.
struct ShownContact {
  std::string name;  ///< "contact 2: punch"
  bool is_tool = false;
  bool is_still = false;  ///< a tool that nothing moves
  std::string curves;     ///< group of its own curves; empty for the scene's protocol

  /// Its protocol is that of the scene.
  [[nodiscard]] bool is_driven() const { return curves.empty() && !is_still; }
};

/// The contacts in the order of the scene; none if the scene names none.
std::vector<ShownContact> contacts_in(const Hdf5Reader& file) {
  std::vector<ShownContact> contacts;
  if (!file.has_attribute("/", "scene")) return contacts;
  const Json scene = Json::parse(file.attribute("/", "scene"), nullptr, false);
  if (!scene.is_object() || !scene.contains("contacts")) return contacts;
  std::vector<double> shares;  // of the tools
  if (file.has("/tools/share")) shares = file.numbers("/tools/share");
  std::size_t tools = 0;
  for (const Json& contact : scene.at("contacts")) {
    const Json stated = contact.is_object() ? contact.value("kind", Json()) : Json();
    const std::string kind = stated.is_string() ? stated.get<std::string>() : "sphere";
    const std::size_t number = contacts.size() + 1;
    const std::string group = fmt::format("/contacts/{}", number);
    const bool is_tool = kind == "ball" || kind == "punch";
    const bool is_still = is_tool && tools < shares.size() && shares[tools] == 0.0;
    tools += is_tool ? 1U : 0U;
    contacts.push_back({fmt::format("contact {}: {}", number, kind), is_tool, is_still,
                        file.has(group) ? group : ""});
  }
  return contacts;
}

/// Name of the curves of the scene's protocol, which may drive several contacts.
std::string name_of_driven(const std::vector<ShownContact>& contacts, const char* alone) {
  if (contacts.size() < 2) return alone;
  std::vector<std::string> names;
  for (const ShownContact& contact : contacts) {
    if (contact.is_driven()) names.push_back(contact.name);
  }
  return fmt::format("{}", fmt::join(names, " + "));
}

/// Forces of tools that have no curve of their own, each along its direction, at the shown states.
Json forces_of_tools(const Hdf5Reader& file, const std::filesystem::path& path,
                     const std::vector<std::size_t>& shown,
                     const std::vector<ShownContact>& contacts, ViewPage& page) {
  Json series = Json::array();
  const Json& organ = page.description.at("organ");
  if (!organ.contains("tools") || contacts.size() < 2) return series;
  // The force of a contact that is driven alone is the curve.
  const bool together = std::ranges::count_if(contacts, &ShownContact::is_driven) > 1;
  const Json& tools = organ.at("tools");
  const std::size_t count = tools.at("radius_m").size();
  std::size_t tool = 0;
  for (const ShownContact& contact : contacts) {
    if (!contact.is_tool) continue;
    const std::size_t t = tool++;
    if (!contact.curves.empty() || !(together || contact.is_still)) continue;
    std::vector<double> force_N;
    for (const std::size_t step : shown) {
      const std::vector<double> on_tissue =
          table_of(file, path, step_name(step, "tools/force_on_tissue_N"), 3 * count);
      double along = 0.0;
      for (std::size_t c = 0; c < 3; ++c) {
        along += on_tissue[3 * t + c] * tools.at("direction").at(3 * t + c).get<double>();
      }
      force_N.push_back(along);
    }
    series.push_back({{"kind", "trail"},
                      {"label", contact.name},
                      {"x", organ.at("time_s")},
                      {"y", page.put(force_N)}});
  }
  return series;
}

/// The tools in the shown states: a ball is placed by its centre, a punch by its face.
void add_tools(const Hdf5Reader& file, const std::filesystem::path& path,
               const std::vector<std::size_t>& shown, const std::vector<ShownContact>& contacts,
               ViewPage& page, Json& organ) {
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
  const auto is_tool = [](const ShownContact& contact) { return contact.is_tool; };
  if (std::ranges::count_if(contacts, is_tool) != std::ssize(kind)) {
    throw bad_input(path.string() + ": /tools/kind",
                    "has another length than the tools of its scene", kExpectedResult);
  }
  if (contacts.size() < 2) return;
  organ["tools"]["names"] = Json::array();
  for (const ShownContact& contact : contacts) {
    if (contact.is_tool) organ["tools"]["names"].push_back(contact.name);
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

/// Answers the states that the page holds.
std::vector<std::size_t> add_organ(const Hdf5Reader& file, const std::filesystem::path& path,
                                   std::size_t most, const std::vector<ShownContact>& contacts,
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
  add_tools(file, path, shown, contacts, page, organ);
  page.description["organ"] = std::move(organ);
  return shown;
}

/// Curves over time, of each contact that has them, in the unit that people read.
class ContactCurves {
 public:
  ContactCurves(const Hdf5Reader& file, const std::filesystem::path& path,
                const std::vector<ShownContact>& contacts, ViewPage& page)
      : file_(file), path_(path), contacts_(contacts), page_(page) {
    const std::vector<double> times = file.numbers("/curve/time_s");
    samples_ = times.size();
    time_ = page.put(times);
  }

  /// @param quantity the end of its name, "force_N"
  /// @param others of the same quantity and unit
  void add(const char* quantity, const char* title, const char* unit, double scale,
           const Json& others = Json::array()) {
    Json series = Json::array();
    put(series, "/curve/", quantity, name_of_driven(contacts_, title), scale);
    for (const ShownContact& contact : contacts_) {
      if (!contact.curves.empty()) {
        put(series, contact.curves + "/", quantity, contact.name, scale);
      }
    }
    for (const Json& other : others) series.push_back(other);
    if (!series.empty()) page_.plot_over_time(title, unit, std::move(series));
  }

  /// Of the organ, not of one contact.
  void add_of_whole(const char* quantity, const char* title, const char* unit, double scale) {
    Json series = Json::array();
    put(series, "/curve/", quantity, title, scale);
    if (!series.empty()) page_.plot_over_time(title, unit, std::move(series));
  }

 private:
  void put(Json& series, const std::string& group, const char* quantity, const std::string& label,
           double scale) {
    if (!file_.has(group + quantity)) return;
    std::vector<double> values = file_.numbers(group + quantity);
    if (values.size() != samples_) {
      throw bad_input(path_.string() + ": " + group + quantity,
                      fmt::format("has {} numbers", values.size()), fmt::format("{}", samples_));
    }
    for (double& v : values) v *= scale;
    series.push_back({{"kind", "line"}, {"label", label}, {"x", time_}, {"y", page_.put(values)}});
  }

  const Hdf5Reader& file_;
  const std::filesystem::path& path_;
  const std::vector<ShownContact>& contacts_;
  ViewPage& page_;
  std::size_t samples_ = 0;
  std::string time_;
};

/// @param forces of tools that have no curve of their own
void add_curves(const Hdf5Reader& file, const std::filesystem::path& path,
                const std::vector<ShownContact>& contacts, const Json& forces, ViewPage& page) {
  constexpr double kMilli = 1e3;
  ContactCurves curves(file, path, contacts, page);
  curves.add("depth_m", "depth", "mm", kMilli);
  curves.add("force_N", "contact force", "N", 1.0, forces);
  curves.add("load_N", "load", "N", 1.0);
  curves.add_of_whole("dissipated_J", "dissipated energy", "mJ", kMilli);
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
  const std::vector<ShownContact> contacts = contacts_in(file);
  Json forces = Json::array();
  if (file.has("/spheres/position_m")) {
    const std::vector<std::size_t> shown =
        add_organ(file, path, options.most_numbers, contacts, page);
    forces = forces_of_tools(file, path, shown, contacts, page);
  } else {
    page.fact("organ", "this formulation does not show whole states: there is no organ to turn");
  }
  if (const auto peak = time_of_peak(file, path)) page.description["start_s"] = *peak;
  add_curves(file, path, contacts, forces, page);
  return page;
}

}  // namespace tpm::plan
