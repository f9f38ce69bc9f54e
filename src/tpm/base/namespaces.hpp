#pragma once
// The namespaces of the library and what each sees without qualification, besides tpm, in which
// they all are: those of the rooms that CMakeLists.txt says it needs.

/// Errors, units, text, random numbers.
namespace tpm::base {}

/// Work on several processors, its progress and its interruption.
namespace tpm::work {
using namespace base;
}

/// Curves and protocols as values.
namespace tpm::data {
using namespace base;
}

/// The response of an element.
namespace tpm::law {
using namespace base;
using namespace data;
}  // namespace tpm::law

/// Files that are read and written.
namespace tpm::files {
using namespace base;
using namespace work;
using namespace data;
using namespace law;
}  // namespace tpm::files

/// Documents, tables, figures, pages.
namespace tpm::show {
using namespace base;
using namespace files;
}  // namespace tpm::show

/// Spheres, bonds, their balance and motion.
namespace tpm::organ {
using namespace base;
using namespace work;
using namespace data;
using namespace law;
using namespace files;
}  // namespace tpm::organ

/// Contacts at servo rate.
namespace tpm::contact {
using namespace base;
using namespace law;
using namespace files;
using namespace organ;
}  // namespace tpm::contact

/// The choice of a model that is accurate enough.
namespace tpm::plan {
using namespace base;
using namespace data;
using namespace law;
using namespace files;
using namespace show;
using namespace organ;
using namespace contact;
}  // namespace tpm::plan

/// Parameters from measurements.
namespace tpm::fit {
using namespace base;
using namespace work;
using namespace data;
using namespace law;
using namespace files;
using namespace show;
using namespace organ;
using namespace contact;
using namespace plan;
}  // namespace tpm::fit

/// Devices, servo loop, sessions.
namespace tpm::haptics {
using namespace base;
using namespace work;
using namespace data;
using namespace law;
using namespace files;
using namespace show;
using namespace organ;
using namespace contact;
using namespace plan;
using namespace fit;
}  // namespace tpm::haptics

/// Many cells.
namespace tpm::sweep {
using namespace base;
using namespace work;
using namespace law;
using namespace files;
using namespace show;
using namespace organ;
using namespace plan;
using namespace fit;
}  // namespace tpm::sweep

/// Error against cost, stability, verification.
namespace tpm::accuracy {
using namespace base;
using namespace work;
using namespace data;
using namespace law;
using namespace files;
using namespace show;
using namespace organ;
using namespace contact;
using namespace fit;
using namespace haptics;
}  // namespace tpm::accuracy

/// The paper, recomputed.
namespace tpm::paper {
using namespace base;
using namespace work;
using namespace data;
using namespace law;
using namespace files;
using namespace show;
using namespace fit;
}  // namespace tpm::paper

/// The program tpm: by these three rooms it sees all.
namespace tpm::app {
using namespace sweep;
using namespace accuracy;
using namespace paper;
}  // namespace tpm::app

/// The Python module, likewise.
namespace tpm::python {
using namespace sweep;
using namespace accuracy;
using namespace paper;
}  // namespace tpm::python
