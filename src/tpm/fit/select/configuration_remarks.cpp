#include "tpm/fit/select/configuration_remarks.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/select/file_remarks.hpp"
#include "tpm/fit/select/imposed_channel.hpp"
#include "tpm/fit/select/material_function.hpp"
#include "tpm/fit/select/selection.hpp"

namespace tpm::fit {
namespace {

/// The recording of a motion with the window that the configuration states.
PreparedRecording windowed(const DataChoice& choice, const Recording& recording) {
  PhaseOptions options;
  options.contact_response = choice.contact_response;
  PreparedRecording r{choice.dataset, recording, find_phases(recording, options), 0.0, 0.0,
                      choice.import};
  r.from_s = std::max(choice.from_s, recording.time_s.front());
  r.to_s = std::min(choice.to_s, recording.time_s.back());
  r.load_imposed = choice.load_imposed;
  return r;
}

/// Adds what the file says beyond its readings.
void warn_of_file(PreparedRecording& r, const std::string& path) {
  const RecordingFile file = read_recording_file(path, r.import);
  if (auto channels = imposed_channel_remark(r.name, file.recording, r.load_imposed)) {
    r.remarks.push_back(*std::move(channels));
  }
  warn_of_rows_left_out(r, file.findings);
  take_instrument(r, path);
}

}  // namespace

std::vector<Remark> configuration_remarks(const FitResult& fit, const std::vector<DataSet>& data,
                                          bool from_files) {
  std::vector<PreparedRecording> recordings;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const auto* recording = std::get_if<Recording>(&data[i]);
    if (recording == nullptr || is_step_response(recording->response_quantity)) continue;
    const DataChoice& choice = fit.config.data[i];
    recordings.push_back(windowed(choice, *recording));
    if (from_files) warn_of_file(recordings.back(), data_path(fit.config, choice.dataset));
  }
  std::vector<Remark> remarks = recording_remarks(recordings);
  const auto warn = [&remarks](std::vector<Remark> more) {
    std::ranges::move(more, std::back_inserter(remarks));
  };
  if (!recordings.empty() && recordings.size() == data.size()) {
    warn(protocol_remarks(fit, recordings));
  }
  if (data.size() == 1) warn(function_remarks(fit, data.front()));
  warn(outside_remarks(fit));
  return remarks;
}

}  // namespace tpm::fit
