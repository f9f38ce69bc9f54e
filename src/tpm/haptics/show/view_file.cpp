#include "tpm/haptics/show/view_file.hpp"

#include <fmt/format.h>

#include "tpm/files/file.hpp"
#include "tpm/fit/show/view_fit.hpp"
#include "tpm/haptics/show/view_recording.hpp"
#include "tpm/plan/show/view_simulation.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {

std::filesystem::path shown_file(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path)) return path;
  constexpr const char* kShown[] = {"selection.json", "answer.json", "law.json", "figures.json",
                                    "simulation.h5"};
  for (const char* name : kShown) {
    if (std::filesystem::exists(path / name)) return path / name;
  }
  throw bad_input(path.string(), "is a folder without a result that tpm view shows",
                  fmt::format("a folder with one of {}", fmt::join(kShown, ", ")));
}

ViewPage view_file(const std::filesystem::path& file, const ViewOptions& options) {
  constexpr std::string_view kHdf5 = "\x89HDF\r\n\x1a\n", kRows = "TPMROWS1";
  const std::string bytes = read_file(file);
  if (bytes.starts_with(kHdf5)) return view_simulation(file, bytes, options);
  if (bytes.starts_with(kRows)) return view_recording(file, bytes, options);
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && bytes[first] == '{') return view_fit(file, bytes);
  throw bad_input(file.string(), "is nothing that tpm view shows",
                  "a result of tpm simulate (HDF5), a recording of tpm hil run, or law.json, "
                  "figures.json or the JSON answer of tpm fit");
}

}  // namespace tpm::haptics
