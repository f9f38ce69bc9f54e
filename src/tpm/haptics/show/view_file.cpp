#include "tpm/haptics/show/view_file.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/files/file.hpp"
#include "tpm/show/view_parts.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/version.hpp"

namespace tpm::report {

ViewPage begun_page(std::string_view kind, const std::filesystem::path& file,
                    std::string_view bytes) {
  ViewPage page;
  page.description = {{"kind", kind},
                      {"title", file.filename().string()},
                      {"facts", Json::array()},
                      {"plots", Json::array()}};
  page.fact("file", file.filename().string());
  page.fact("SHA-256", sha256_hex(bytes));
  page.fact("page made by", fmt::format("tpm {} view", version()));
  return page;
}

std::size_t shown_stride(std::size_t states, std::size_t numbers_of_one, std::size_t most) {
  const std::size_t fitting =
      std::max<std::size_t>(2, most / std::max<std::size_t>(1, numbers_of_one));
  return states <= fitting ? 1 : (states - 1) / (fitting - 1) + 1;
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

}  // namespace tpm::report
