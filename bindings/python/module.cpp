// tpmkit._core: the library for Python. The package around it (tpmkit/*.py) makes DataFrames,
// Datasets and figures of what it answers.
#include "binding.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/base/warning.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"
#include "tpmkit/version.hpp"

namespace tpm::python {
namespace {

/// tpmkit.Error: str() is the one line, `code` the exit code that the program would end with. Of an
/// argument it is tpmkit.ArgumentError, which is a ValueError too.
void bind_errors(py::module_& module) {
  static PyObject* const kind = PyErr_NewExceptionWithDoc(
      "tpmkit.Error",
      "What tpmkit cannot do, in one line: \"WHERE: WHAT; expected ...\".\n\n"
      "`code` is the exit code of the program `tpm`: 1 the answer is no, "
      "2 usage, 3 bad input,\n4 numerical, 5 environment.",
      PyExc_RuntimeError, py::dict(py::arg("code") = static_cast<int>(ExitCode::bad_input)).ptr());
  module.add_object("Error", py::reinterpret_borrow<py::object>(kind));
  static PyObject* const of_argument = PyErr_NewExceptionWithDoc(
      "tpmkit.ArgumentError", "An argument that a call does not take. It is a ValueError too.",
      py::make_tuple(py::handle(kind), py::handle(PyExc_ValueError)).ptr(),
      py::dict(py::arg("code") = static_cast<int>(ExitCode::usage)).ptr());
  module.add_object("ArgumentError", py::reinterpret_borrow<py::object>(of_argument));
  py::register_exception_translator([](std::exception_ptr thrown) {
    const auto raise = [](const std::string& words, ExitCode code) {
      const py::handle raised = code == ExitCode::usage ? of_argument : kind;
      const py::object error = raised(words);
      error.attr("code") = static_cast<int>(code);
      PyErr_SetObject(raised.ptr(), error.ptr());
    };
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& error) {
      raise(with_arguments_for_options(error.what()), error.code());
    } catch (const Interrupted& stop) {
      PyErr_SetString(PyExc_KeyboardInterrupt, stop.what());
    }
  });
}

/// Warnings of the library are FutureWarnings, which Python shows by default.
void bind_warnings() {
  set_warning_sink([](const std::string& text) {
    const std::string safe = for_terminal(text, LineEnds::escaped);
    const py::gil_scoped_acquire lock;
    if (PyErr_WarnEx(PyExc_FutureWarning, safe.c_str(), 1) != 0) throw py::error_already_set();
  });
}

}  // namespace
}  // namespace tpm::python

PYBIND11_MODULE(_core, module) {
  using namespace tpm::python;
  module.doc() = "The compiled part of tpmkit; use the package tpmkit.";
  module.attr("__version__") = std::string(tpm::version());
  bind_errors(module);
  bind_warnings();
  // Files that were read once are not overwritten, as in the program (docs/python.md).
  static const tpm::files::FileRoles roles("another name for the result");
  module.def(
      "parse_quantity",
      [](const std::string& text, const std::string& dimension) {
        for (const auto& [name, known] :
             {std::pair<const char*, tpm::Dimension>{"length", tpm::Dimension::length},
              {"time", tpm::Dimension::time},
              {"speed", tpm::Dimension::speed},
              {"force", tpm::Dimension::force},
              {"stress", tpm::Dimension::stress},
              {"viscosity", tpm::Dimension::viscosity},
              {"area", tpm::Dimension::area},
              {"stiffness", tpm::Dimension::stiffness},
              {"frequency", tpm::Dimension::frequency}}) {
          if (dimension == name) return tpm::parse_quantity(text, known, "quantity");
        }
        throw tpm::bad_input("dimension", "'" + tpm::printable(dimension) + "'",
                             "length, time, speed, force, stress, viscosity, area, stiffness or "
                             "frequency");
      },
      py::arg("text"), py::arg("dimension"));
  module.def("with_arguments_for_options", &tpm::base::with_arguments_for_options,
             py::arg("message"));
  module.def("share_dir", [] { return tpm::files::share_dir(); });
  bind_laws(module);
  bind_fits(module);
  bind_contacts(module);
  bind_runs(module);
}
