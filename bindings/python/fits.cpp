// Fits: of recordings and material functions by the simplest law, of configurations.
#include <algorithm>
#include <filesystem>
#include <map>

#include "binding.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/import/reading_options.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/groups/young_moduli.hpp"
#include "tpm/fit/petab.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/fit/prediction.hpp"
#include "tpm/fit/select/file_remarks.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/select/material_function.hpp"
#include "tpm/fit/select/placement_parameters.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/show/fit_answer.hpp"
#include "tpm/fit/show/fit_report.hpp"
#include "tpm/fit/show/function_report.hpp"
#include "tpm/fit/show/recording_report.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/error.hpp"

namespace tpm::python {
namespace {

/// Empty where there is none.
std::string text_of(const std::optional<Remark>& remark) {
  return remark ? remark->text : std::string();
}

/// Arguments of fit(), as keywords of Python.
struct FitRequest {
  std::vector<std::string> files;
  std::optional<std::string> law;
  std::optional<std::size_t> starts;
  std::optional<std::uint64_t> seed;
  std::optional<double> reference, contact, contact_force_N, zero;

  [[nodiscard]] bool holds_placement() const {
    return contact.has_value() || contact_force_N.has_value() || zero.has_value();
  }
  ImportOptions import;
};

ImportOptions import_of(const py::dict& said) {
  ImportOptions import;
  for (const auto& [key, value] : said) {
    const auto name = py::cast<std::string>(key);
    const std::string where = "columns: " + name;
    if (name == "units") {
      for (const auto& [column, unit] : py::cast<std::map<std::string, std::string>>(value)) {
        set_reading_unit(import, column, unit, where + ": " + column);
      }
    } else if (name == "segments") {
      import.segments = py::cast<std::vector<std::string>>(value);
    } else if (name == "provenance") {
      import.provenance = parse_provenance(py::cast<std::string>(value), where);
    } else if (py::isinstance<py::bool_>(value)) {
      set_reading_option(import, name, py::cast<bool>(value) ? "true" : "false", where);
    } else {
      // Counts may be numbers: header_rows=3.
      set_reading_option(import, name, py::cast<std::string>(py::str(value)), where);
    }
  }
  return import;
}

/// Result of a fit. `selection` is empty for a configuration.
class Fit {
 public:
  Fit(FitResult fit, std::optional<Selection> selection,
      std::optional<MaterialFunction> function = std::nullopt)
      : fit_(std::move(fit)), selection_(std::move(selection)), function_(std::move(function)) {}

  [[nodiscard]] const FitResult& fit() const { return fit_; }
  [[nodiscard]] const std::optional<Selection>& selection() const { return selection_; }

  /// Those of the selection, then those of the fit.
  [[nodiscard]] py::list remarks() const {
    std::vector<Remark> all = selection_ ? selection_->remarks : std::vector<Remark>();
    all.insert(all.end(), fit_.remarks.begin(), fit_.remarks.end());
    py::list list;
    for (const Remark& one : all) {
      list.append(py::dict(py::arg("code") = one.code, py::arg("text") = one.text));
    }
    return list;
  }
  [[nodiscard]] py::list parameters() const {
    py::list rows;
    for (const ParameterResult& p : fit_.parameters) {
      const std::optional<WithDrift>& drift = p.with_drift;
      using Value = std::optional<double>;
      rows.append(py::dict(py::arg("name") = p.parameter.name, py::arg("estimate") = p.estimate,
                           py::arg("standard_error") = p.standard_error, py::arg("lower") = p.lower,
                           py::arg("upper") = p.upper, py::arg("unit") = si_unit(p.parameter),
                           py::arg("verdict") = verdict_text(p), py::arg("nuisance") = p.nuisance,
                           py::arg("only_if_described") = p.only_if_described,
                           py::arg("not_separable") = text_of(p.not_separable),
                           py::arg("unconfirmed") = text_of(p.unconfirmed),
                           py::arg("with_drift") = drift ? Value(drift->estimate) : Value(),
                           py::arg("with_drift_lower") = drift ? drift->lower : Value(),
                           py::arg("with_drift_upper") = drift ? drift->upper : Value(),
                           py::arg("summary") = p.summary));
    }
    return rows;
  }
  [[nodiscard]] py::list recordings() const {
    py::list list;
    for (const RecordingFit& r : fit_.recordings) {
      py::dict one(
          py::arg("dataset") = fit_.config.data[r.choice].dataset,
          py::arg("drive_key") = si_key(r.drive_quantity),
          py::arg("response_key") = si_key(r.response_quantity),
          py::arg("provenance") = std::string(provenance_name(r.provenance)),
          py::arg("rms_residual") = r.rms_residual, py::arg("peak") = r.peak,
          py::arg("time_s") = handed_over(r.time_s), py::arg("drive") = handed_over(r.drive),
          py::arg("observed") = handed_over(r.observed),
          py::arg("predicted") = handed_over(r.predicted), py::arg("lower") = handed_over(r.lower),
          py::arg("upper") = handed_over(r.upper));
      one["fitted"] = py::array(py::cast(std::vector<bool>(r.fitted)));
      list.append(std::move(one));
    }
    return list;
  }
  [[nodiscard]] LawFile law() const {
    if (!fit_.config.law) {
      throw bad_input("fit", "is not of a law",
                      "a fit of a recording, or a configuration with 'law'");
    }
    return fitted_law(fit_);
  }
  /// Limits of a prediction, in the words of tpm predict.
  [[nodiscard]] std::vector<std::string> flags_of(const Protocol& protocol,
                                                  std::span<const double> times_s,
                                                  const std::vector<double>& values,
                                                  const Eigen::VectorXd& response) const {
    LawPrediction p;
    if (times_s.empty() || no_law_because(fit_.config)) return remark_texts(p.remarks);
    const LawFile law = fitted_law(fit_);
    p.spec = law.spec;
    p.drive_kind = protocol.drive();
    // The law's last parameters are contact and offset.
    if (fit_.config.law) p.contact = values[values.size() - 2];
    p.time_s.assign(times_s.begin(), times_s.end());
    p.response.assign(response.begin(), response.end());
    const double last = *std::ranges::max_element(times_s);
    for (const double t : times_s) p.imposed.push_back(value_at(protocol, t));
    // The motion before the first of these times counts, too.
    for (const Knot& knot : protocol.knots()) {
      if (knot.time_s > last) break;
      p.time_s.push_back(knot.time_s);
      p.imposed.push_back(knot.value);
    }
    add_range_remarks(p, law);
    return remark_texts(p.remarks);
  }
  /// The response of the fitted model, its standard error by the parameters' covariance (NaN where
  /// that is not of full rank), and flags_of() it.
  /// @param at_surface depths count from the surface, and the sensor has no zero error; else the
  ///   contact and the offset are those of `dataset`
  [[nodiscard]] py::tuple predict(const Protocol& protocol, const Numbers& times_s,
                                  std::size_t dataset, bool at_surface) const {
    if (dataset >= fit_.config.data.size()) {
      throw bad_input("dataset", std::to_string(dataset),
                      "0 to " + std::to_string(fit_.config.data.size() - 1));
    }
    const std::unique_ptr<Model> model = make_model(fit_.config);
    std::vector<double> values = model_parameters(fit_.config, fit_.best.natural, dataset);
    std::vector<bool> left_out(values.size(), false);
    if (at_surface && fit_.config.law) {
      const std::vector<LawParameter> of_law = law_parameters(*fit_.config.law);
      for (std::size_t i = 0; i < of_law.size(); ++i) {
        if (!belongs_to_recording(*fit_.config.law, of_law[i])) continue;
        values.at(i) = 0.0;
        left_out.at(i) = true;
      }
    }
    std::vector<FitParameter> parameters;
    for (const EstimatedParameter& p : fit_.config.parameters) parameters.push_back(p.fit);
    Eigen::MatrixXd along = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(values.size()),
                                                  static_cast<Eigen::Index>(parameters.size()));
    for (std::size_t j = 0; j < parameters.size(); ++j) {
      for (const Target& target : fit_.config.parameters[j].sets) {
        if (!target.applies_to(dataset) || left_out.at(target.parameter)) continue;
        along(static_cast<Eigen::Index>(target.parameter), static_cast<Eigen::Index>(j)) = 1.0;
      }
    }
    Response response;
    Eigen::VectorXd error;
    {
      const std::span<const double> times = span_of(times_s);
      const py::gil_scoped_release released;
      response = model->respond_along(protocol, times, values, along);
      error = prediction_standard_errors(response.sensitivity, parameters, fit_.best.natural,
                                         fit_.covariance);
    }
    if (error.size() == 0) {
      error.setConstant(response.value.size(), std::numeric_limits<double>::quiet_NaN());
    }
    std::vector<std::string> flags = flags_of(protocol, span_of(times_s), values, response.value);
    return py::make_tuple(py::cast(std::move(response.value)), py::cast(std::move(error)),
                          std::move(flags));
  }
  [[nodiscard]] std::vector<std::string> write(const std::filesystem::path& folder) const {
    if (!selection_) return write_fit_report(folder, fit_);
    if (function_) return write_function_report(folder, *function_, *selection_);
    return write_recording_report(folder, *selection_);
  }

 private:
  FitResult fit_;
  std::optional<Selection> selection_;
  std::optional<MaterialFunction> function_;
};

SelectionOptions selection_of(const FitRequest& request, const LongCall& call) {
  SelectionOptions options;
  if (request.law) options.laws = {parse_law_name(*request.law, "law")};
  options.only_listed = request.law.has_value();
  if (request.starts) options.setup.starts = *request.starts;
  if (request.seed) options.setup.seed = *request.seed;
  options.setup.reference = request.reference;
  options.setup.contact = request.contact;
  options.setup.zero = request.zero;
  options.setup.interrupted = call.interrupted();
  return options;
}

Fit fit_configuration(const FitRequest& request, const LongCall& call) {
  if (request.law || request.reference || request.holds_placement()) {
    throw Error(ExitCode::usage, "law, reference, contact, contact_force, zero",
                "with a configuration", "them only with recordings; a configuration says its own");
  }
  FitProblem problem = read_fit_problem(request.files.front());
  if (request.starts) problem.config.starts = *request.starts;
  if (request.seed) problem.config.seed = *request.seed;
  problem.config.interrupted = call.interrupted();
  return {call.run([&] { return fit_and_judge(problem); }), std::nullopt};
}

Fit fit_selected(Selection selection, std::optional<MaterialFunction> function) {
  FitResult best = selection.candidates[selection.recommended].fit;
  return {std::move(best), std::move(selection), std::move(function)};
}

Fit fit_files(const FitRequest& request) {
  if (request.files.empty()) {
    throw Error(ExitCode::usage, "fit", "no file", "a recording, or several");
  }
  const LongCall call;
  const std::filesystem::path first = request.files.front();
  if (std::filesystem::is_directory(first)) {
    throw Error(ExitCode::usage, first.string(), "is a folder",
                "files; a folder of specimens is pooled by the program: tpm fit FOLDER");
  }
  const bool alone = request.files.size() == 1;
  if (alone && first.extension() == ".json" && !read_json(first).contains("kind")) {
    return fit_configuration(request, call);
  }
  const SelectionOptions options = selection_of(request, call);
  if (alone) {
    auto function = find_material_function(first.string(), request.import);
    if (function) {
      if (request.holds_placement()) {
        throw Error(ExitCode::usage, "contact, contact_force, zero", "with a material function",
                    "them only with recordings");
      }
      Selection selection = call.run([&] { return select_law(*function, options); });
      return fit_selected(std::move(selection), std::move(function));
    }
  }
  if (request.contact && request.contact_force_N) {
    throw Error(ExitCode::usage, "contact", "beside contact_force", "one of them");
  }
  PhaseOptions phases;
  phases.contact_response = request.contact_force_N;
  std::vector<PreparedRecording> recordings;
  for (const std::string& file : request.files) {
    for (const PreparedRecording& before : recordings) {
      if (before.name != file) continue;
      throw Error(ExitCode::usage, "fit", "'" + file + "' is given twice", "each recording once");
    }
    RecordingFile read = read_recording_file(file, request.import);
    require_time_and_drive(read, file);
    recordings.push_back(prepare_recording(file, std::move(read.recording), phases));
    recordings.back().import = request.import;
    warn_of_rows_left_out(recordings.back(), read.findings);
    take_instrument(recordings.back(), file);
  }
  require_distinct_readings(recordings);
  if (request.contact) require_contact_within(*request.contact, recordings, "contact");
  return fit_selected(call.run([&] { return select_law(recordings, options); }), std::nullopt);
}

py::dict recording_of(const std::filesystem::path& file, const py::dict& columns) {
  const RecordingFile read = read_recording_file(file, import_of(columns));
  const Recording& r = read.recording;
  py::list findings;
  for (const ImportFinding& f : read.findings) findings.append(py::make_tuple(f.what, f.value));
  return py::dict(py::arg("id") = r.header.id, py::arg("title") = r.header.title,
                  py::arg("citation") = r.header.citation, py::arg("sha256") = r.header.sha256,
                  py::arg("provenance") = std::string(provenance_name(r.provenance)),
                  py::arg("drive_key") = si_key(r.drive_quantity),
                  py::arg("response_key") = si_key(r.response_quantity),
                  py::arg("time_s") = handed_over(r.time_s),
                  py::arg("drive") = handed_over(r.drive),
                  py::arg("response") = handed_over(r.response), py::arg("findings") = findings);
}

}  // namespace

void bind_fits(py::module_& module) {
  py::class_<Fit>(module, "Fit")
      .def_property_readonly("parameters", &Fit::parameters)
      .def_property_readonly("recordings", &Fit::recordings)
      .def_property_readonly("law_json", [](const Fit& f) { return to_text(to_json(f.law())); })
      .def_property_readonly("has_law", [](const Fit& f) { return f.fit().config.law.has_value(); })
      .def_property_readonly("adequacy_json",
                             [](const Fit& f) {
                               return f.fit().adequacy ? to_text(files::to_json(*f.fit().adequacy))
                                                       : std::string("null");
                             })
      .def_property_readonly("remarks", &Fit::remarks)
      .def_property_readonly("summary",
                             [](const Fit& f) {
                               return f.selection() ? f.selection()->summary
                                                    : std::vector<std::string>();
                             })
      .def_property_readonly("correlation",
                             [](const Fit& f) { return f.fit().covariance.correlation; })
      .def("predict", &Fit::predict)
      .def("young_moduli",
           [](const Fit& f, std::optional<double> sphere_radius_m,
              std::optional<double> cone_half_angle_rad, std::optional<double> punch_radius_m,
              std::optional<double> poisson_ratio) {
             ContactGeometry probe;
             probe.sphere_radius_m = sphere_radius_m;
             probe.cone_half_angle_rad = cone_half_angle_rad;
             probe.punch_radius_m = punch_radius_m;
             if (poisson_ratio) probe.poisson_ratio = *poisson_ratio;
             if (!probe.is_given()) {
               throw Error(ExitCode::usage, "young_moduli", "no probe",
                           "sphere_radius_m, cone_half_angle_rad or punch_radius_m");
             }
             return to_text(to_json(fit::young_moduli(f.fit(), probe, !poisson_ratio)));
           })
      .def("answer",
           [](const Fit& f) {
             return show::to_text(f.selection() ? fit::short_answer(*f.selection())
                                                : fit::short_answer(f.fit()));
           })
      .def("text",
           [](const Fit& f) {
             const std::string best = to_terminal_text(f.fit());
             return f.selection() ? to_terminal_text(*f.selection()) + "\n" + best : best;
           })
      .def("to_json",
           [](const Fit& f) {
             return to_text(f.selection() ? to_json(*f.selection()) : to_json(f.fit()));
           })
      .def("write", [](const Fit& f, const std::filesystem::path& folder) {
        const LongCall call;
        return call.run([&] { return f.write(folder); });
      });
  module.def("fit", [](std::vector<std::string> files, std::optional<std::string> law,
                       std::optional<std::size_t> starts, std::optional<std::uint64_t> seed,
                       std::optional<double> reference, std::optional<double> contact,
                       std::optional<double> contact_force_N, std::optional<double> zero,
                       const py::dict& columns) {
    return fit_files({std::move(files), std::move(law), starts, seed, reference, contact,
                      contact_force_N, zero, import_of(columns)});
  });
  module.def("read_recording", &recording_of);
}

}  // namespace tpm::python
