// Declared in tpm/fit/validate/validation.hpp.
#include <fmt/format.h>

#include "tpm/files/file.hpp"
#include "tpm/fit/sample_digest.hpp"
#include "tpm/fit/validate/validation.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

namespace fs = std::filesystem;

std::optional<fs::path> found_file(const std::string& name, const std::string& sha256,
                                   const fs::path& law_file) {
  const fs::path folder = law_file.parent_path();
  for (const fs::path& place :
       {fs::path(name), folder / name, folder / ".." / name, folder / fs::path(name).filename(),
        folder / ".." / fs::path(name).filename()}) {
    for (fs::path file : {place, fs::path(place).replace_extension(".csv")}) {
      std::error_code none;
      if (!fs::is_regular_file(file, none)) continue;
      if (sha256_hex(read_file(file)) == sha256) return file.lexically_normal();
    }
  }
  return std::nullopt;
}

using WayToRead = std::function<PreparedRecording(const std::string&)>;

/// @param numbers samples_sha256 of the fitted recording; empty: not stated, and any will do
/// @param trouble why there is none
std::optional<PreparedRecording> as_it_was_fitted(const std::string& file,
                                                  const std::string& numbers,
                                                  const std::vector<WayToRead>& ways,
                                                  Remark& trouble) {
  for (const WayToRead& read : ways) {
    try {
      PreparedRecording recording = read(file);
      if (numbers.empty() || samples_sha256(recording.recording) == numbers) {
        trouble = {};
        return recording;
      }
      trouble = {
          "calibration_read_differently",
          fmt::format("the calibration's {} was fitted with other options of reading", file)};
    } catch (const Error& error) {
      if (error.code() != ExitCode::bad_input && error.code() != ExitCode::usage) throw;
      if (trouble.text.empty()) {
        trouble = {"calibration_unreadable",
                   fmt::format("the calibration's file was not read: {}", error.what())};
      }
    }
  }
  return std::nullopt;
}

}  // namespace

CalibrationData find_calibration(const LawFile& law, const fs::path& law_file,
                                 const std::vector<std::string>& digests,
                                 const std::vector<WayToRead>& ways) {
  CalibrationData data;
  if (!law.uncertainty) return data;
  bool one = true;
  for (const FittedFile& fitted : law.uncertainty->data) {
    CalibrationData::File file{fitted.name, fitted.sha256, std::nullopt};
    if (data.files.size() < digests.size()) file.samples_sha256 = digests[data.files.size()];
    const auto path =
        fitted.sha256.empty() ? std::nullopt : found_file(fitted.name, fitted.sha256, law_file);
    if (!path) {
      data.remarks.push_back(
          {"calibration_not_found",
           fmt::format("the calibration's {} was not found with its SHA-256", fitted.name)});
      one = false;
    } else {
      Remark trouble;
      file.recording = as_it_was_fitted(path->string(), file.samples_sha256, ways, trouble);
      if (!trouble.text.empty()) data.remarks.push_back(trouble);
      const auto block = instrument_beside(*path);
      std::optional<Instrument> instrument;
      if (block) {
        instrument = read_instrument(*block, quantity_dimension(law.spec.response),
                                     quantity_dimension(law.spec.drive),
                                     fmt::format("{}: instrument", path->string()));
      }
      if (!instrument || (data.instrument && data.instrument->id != instrument->id)) one = false;
      if (instrument && !data.instrument) data.instrument = instrument;
    }
    data.files.push_back(std::move(file));
  }
  if (!one) data.instrument.reset();
  return data;
}

}  // namespace tpm::fit
