#pragma once
// The namespaces of the library and what each sees without qualification, besides tpm, in which
// they all are. docs/architecture.md says which folders are in which.

/// Networks, scenes and their runs.
namespace tpm::organ {}

/// Parameters from measurements.
namespace tpm::fit {
using namespace organ;
}

/// Devices, servo loop, sessions.
namespace tpm::haptics {
using namespace organ;
}

/// Many fits or runs to one end.
namespace tpm::study {
using namespace organ;
using namespace fit;
using namespace haptics;
}  // namespace tpm::study

/// Documents, tables, figures.
namespace tpm::report {
using namespace organ;
using namespace fit;
using namespace haptics;
using namespace study;
}  // namespace tpm::report

/// The program tpm.
namespace tpm::app {
using namespace organ;
using namespace fit;
using namespace haptics;
using namespace study;
using namespace report;
}  // namespace tpm::app

/// The Python module.
namespace tpm::python {
using namespace organ;
using namespace fit;
using namespace haptics;
using namespace study;
using namespace report;
}  // namespace tpm::python
