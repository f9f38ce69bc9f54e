#include "tpm/show/view_parts.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/files/file.hpp"
#include "tpmkit/version.hpp"

namespace tpm::show {

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

}  // namespace tpm::show
