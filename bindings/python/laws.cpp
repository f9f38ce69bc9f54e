// Protocols, laws, and the paper's element.
#include <algorithm>
#include <cmath>

#include "binding.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/warning.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/frequency_response.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/law_model.hpp"
#include "tpmkit/model.hpp"

namespace tpm::python {
namespace {

Protocol history(const Numbers& times_s, const Numbers& values, const std::string& drive,
                 bool equilibrium_at_start) {
  Drive kind = Drive::displacement;
  if (drive == "force") {
    kind = Drive::force;
  } else if (drive != "displacement") {
    throw bad_input("drive", "'" + printable(drive) + "'", "displacement or force");
  }
  Protocol protocol = measured_history(kind, span_of(times_s), span_of(values));
  protocol.set_equilibrium_at_start(equilibrium_at_start);
  return protocol;
}

py::array_t<double> knots_of(const Protocol& protocol) {
  const auto knots = protocol.knots();
  py::array_t<double> table({static_cast<py::ssize_t>(knots.size()), py::ssize_t{2}});
  auto at = table.mutable_unchecked<2>();
  for (std::size_t i = 0; i < knots.size(); ++i) {
    at(static_cast<py::ssize_t>(i), 0) = knots[i].time_s;
    at(static_cast<py::ssize_t>(i), 1) = knots[i].value;
  }
  return table;
}

/// The answer of a model; with sensitivity a tuple.
py::object answer_of(const Model& model, const Protocol& protocol, const Numbers& times_s,
                     const std::vector<double>& parameters, bool sensitivity) {
  const Want want = sensitivity ? Want::values_and_sensitivity : Want::values;
  Response response;
  {
    const std::span<const double> times = span_of(times_s);
    const py::gil_scoped_release released;
    response = model.respond(protocol, times, parameters, want);
  }
  py::object value = py::cast(std::move(response.value));
  if (!sensitivity) return value;
  return py::make_tuple(std::move(value), py::cast(std::move(response.sensitivity)));
}

/// A law with its parameters, and the model that answers for it.
class Law {
 public:
  explicit Law(LawFile file) : file_(std::move(file)), model_(file_.spec) {}

  [[nodiscard]] const LawFile& file() const { return file_; }
  [[nodiscard]] const LawModel& model() const { return model_; }
  [[nodiscard]] py::dict parameters() const {
    py::dict named;
    for (std::size_t i = 0; i < file_.values.size(); ++i) {
      named[py::str(law_key(model_.law_parameters()[i]))] = file_.values[i];
    }
    return named;
  }

 private:
  LawFile file_;
  LawModel model_;
};

void bind_protocols(py::module_& module) {
  py::class_<Protocol>(
      module, "Protocol",
      "What an experiment imposes: a history of depth (m) or load (N), linear between "
      "its knots, at rest before the first.")
      .def_static("step_and_hold", &step_and_hold, py::arg("depth_m"), py::arg("hold_s"),
                  "A jump to a depth at time 0, kept for hold_s (may be inf).")
      .def_static("ramp_and_hold", &ramp_and_hold, py::arg("depth_m"), py::arg("rate_m_per_s"),
                  py::arg("hold_s"),
                  "From rest to a depth (> 0) at constant speed (> 0), then kept for hold_s.")
      .def_static("creep", &creep, py::arg("load_N"), py::arg("duration_s"),
                  "A constant load from time 0 on.")
      .def_static(
          "history", &history, py::arg("times_s"), py::arg("values"),
          py::arg("drive") = "displacement", py::arg("equilibrium_at_start") = false,
          "A measured history of depths (drive \"displacement\") or loads (\"force\"); times "
          "increase. equilibrium_at_start: the first value had been kept for ever before.")
      .def_property_readonly("name", &Protocol::name, "What kind of history it is.")
      .def_property_readonly(
          "drive",
          [](const Protocol& p) { return p.drive() == Drive::force ? "force" : "displacement"; },
          "displacement or force.")
      .def_property_readonly("start_s", &Protocol::start_s, "Time of the first knot.")
      .def_property_readonly("end_s", &Protocol::end_s,
                             "Time of the last knot; inf if the last value is kept for ever.")
      .def_property_readonly("peak", &Protocol::peak, "Largest absolute imposed value, m or N.")
      .def_property_readonly("knots", &knots_of, "Times and values, shape (n, 2).")
      .def(
          "value_at", [](const Protocol& p, double time_s) { return value_at(p, time_s); },
          py::arg("time_s"), "The imposed value at a time; at a jump the one after it.")
      .def("scaled", &Protocol::scaled, py::arg("factor"),
           "The same history with every value times a factor.")
      .def(py::pickle(
          [](const Protocol& p) {
            return py::make_tuple(p.drive() == Drive::force, knots_of(p), p.name(),
                                  std::isinf(p.end_s()) && std::isfinite(p.knots().back().time_s),
                                  p.equilibrium_at_start());
          },
          [](const py::tuple& state) {
            const auto table = state[1].cast<Numbers>();
            const auto at = table.unchecked<2>();
            std::vector<Knot> knots;
            for (py::ssize_t i = 0; i < at.shape(0); ++i) knots.push_back({at(i, 0), at(i, 1)});
            Protocol p(state[0].cast<bool>() ? Drive::force : Drive::displacement, std::move(knots),
                       state[2].cast<std::string>(), state[3].cast<bool>());
            p.set_equilibrium_at_start(state[4].cast<bool>());
            return p;
          }))
      .def(
          "__eq__",
          [](const Protocol& a, const Protocol& b) {
            const auto same = [](const Knot& x, const Knot& y) {
              return x.time_s == y.time_s && x.value == y.value;
            };
            return a.drive() == b.drive() && a.name() == b.name() && a.end_s() == b.end_s() &&
                   a.equilibrium_at_start() == b.equilibrium_at_start() &&
                   std::ranges::equal(a.knots(), b.knots(), same);
          },
          py::is_operator())
      .def("__repr__", [](const Protocol& p) {
        return "<tpmkit.Protocol " + p.name() + ", " + std::to_string(p.knots().size()) + " knots>";
      });
}

}  // namespace

void bind_laws(py::module_& module) {
  bind_protocols(module);

  py::class_<Law>(module, "Law")
      .def_static(
          "from_json",
          [](const std::string& text) {
            return std::make_unique<Law>(law_from_json(parse_json(text, "law"), "law"));
          },
          py::arg("text"))
      .def_static(
          "read",
          [](const std::filesystem::path& path) { return std::make_unique<Law>(read_law(path)); },
          py::arg("path"))
      .def(
          "write",
          [](const Law& law, const std::filesystem::path& path) { write_law(path, law.file()); },
          py::arg("path"))
      .def("to_json", [](const Law& law) { return to_text(to_json(law.file())); })
      .def_property_readonly("name", [](const Law& law) { return law_name(law.file().spec); })
      .def_property_readonly("summary", [](const Law& law) { return law_words(law.file().spec); })
      .def_property_readonly("parameters", &Law::parameters)
      .def_property_readonly(
          "provenance",
          [](const Law& law) { return std::string(provenance_name(law.file().provenance)); })
      .def_property_readonly("reference", [](const Law& law) { return law.file().spec.reference; })
      .def_property_readonly("fitted_to", [](const Law& law) { return law.file().fitted_to; })
      .def(
          "respond",
          [](const Law& law, const Protocol& protocol, const Numbers& times_s, bool sensitivity) {
            return answer_of(law.model(), protocol, times_s, law.file().values, sensitivity);
          },
          py::arg("protocol"), py::arg("times_s"), py::arg("sensitivity") = false)
      .def(
          "respond_spectrum",
          [](const Law& law, const Numbers& frequency_Hz) {
            SpectrumResponse response;
            {
              const std::span<const double> frequencies = span_of(frequency_Hz);
              const py::gil_scoped_release released;
              response = respond_spectrum(law.file().spec, law.file().values, frequencies,
                                          std::nullopt, Want::values);
            }
            return py::make_tuple(py::cast(std::move(response.storage)),
                                  py::cast(std::move(response.loss)));
          },
          py::arg("frequency_Hz"))
      .def("__repr__", [](const Law& law) {
        return "<tpmkit.Law " + law_name(law.file().spec) + ": " + law_words(law.file().spec) + ">";
      });

  module.def(
      "respond_element", [](const std::vector<double>& parameters, const std::string& formulation,
                            const Protocol& protocol, const Numbers& times_s, bool sensitivity) {
        return answer_of(*make_model(formulation), protocol, times_s, parameters, sensitivity);
      });
  module.def("element_parameters", [] {
    std::vector<std::tuple<std::string, std::string, std::string>> rows;
    for (const ParameterDescription& p : kTpmParameterTable) {
      rows.emplace_back(p.name, si_symbol(p.dimension), p.meaning);
    }
    return rows;
  });
  module.def("law_parameters", [](const std::string& name) {
    std::vector<std::tuple<std::string, std::string, std::string>> rows;
    for (const LawParameter& p : law_parameters(parse_law_name(name, "law"))) {
      rows.emplace_back(law_key(p), si_symbol(p.dimension), p.meaning);
    }
    return rows;
  });
}

}  // namespace tpm::python
