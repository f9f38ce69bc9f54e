#pragma once
// Header and closing record of a recording as they are said: the declaration of their keys.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/files/keys/block.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpmkit/device.hpp"

namespace tpm::haptics {

/// Notes that a person adds to a recording. Codes, not names: the recording may be passed on.
/// Nothing is required.
struct SessionNotes {
  std::string date, operator_code, subject_code;
};

struct RecordedDevice {
  std::string kind, name, serial, firmware, library_version, communication_mode;
  std::vector<Remark> assumptions;
};

struct RecordedModel {
  std::string name, error_bound;
  std::optional<double> stiffness_N_per_m;  ///< the first recordings do not name it
  Json plan;                                ///< null: none
};

struct RecordedRendering {
  std::string verdict;
  bool passive = false, stable = false;
  std::vector<Remark> remarks;
  std::vector<std::string> warnings;  ///< of recordings whose remarks had no codes

  /// Texts of both.
  [[nodiscard]] std::vector<std::string> texts() const {
    std::vector<std::string> all = remark_texts(remarks);
    all.insert(all.end(), warnings.begin(), warnings.end());
    return all;
  }
};

/// Before the rows.
struct RecordingHeader {
  std::string version, time;
  bool simulated_device = true;
  RecordedDevice device;
  RecordedModel model;
  SessionNotes notes;
  std::optional<RecordedRendering> rendering;
  /// None before slides followed a curved surface.
  std::optional<std::vector<std::vector<double>>> surface_by_phase_m;
  Json session;
};
[[nodiscard]] const Block<RecordingHeader>& recording_header_block();
[[nodiscard]] const FileKind& recording_header_kind();

struct RecordedTimes {
  double p50_s = 0.0, p99_s = 0.0, p999_s = 0.0, max_s = 0.0;
};

/// Behind the rows.
struct RecordingClosing {
  std::string cause;  ///< as to_string(StopCause)
  std::string detail;
  std::uint64_t dropped_records = 0;
  int device_error = 0;  ///< 0: none
  std::string device_error_text;
  std::optional<std::string> host, scheduling;  ///< in real time
  std::optional<RecordedTimes> woke_late, busy;
  std::vector<DeviceFinding> device_findings;
};
[[nodiscard]] const Block<RecordingClosing>& recording_closing_block();
[[nodiscard]] const FileKind& recording_closing_kind();

}  // namespace tpm::haptics
