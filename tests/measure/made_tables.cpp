// Reads tables of every style and counts how many are read right, refused, or read wrong:
//   measure_made_tables [COUNT] [FIRST_SEED] [--refused]
// With --refused it prints each refusal with how the table was written.
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <string_view>

#include "made_tables.hpp"

namespace {

/// A message without its file, its numbers and its quotes: what kind of refusal it is.
std::string kind_of(const std::string& said) {
  std::string text = said.substr(0, said.find("; expected"));
  const auto file = text.find("table.txt");
  if (file != std::string::npos) text = text.substr(file + 9);
  std::string kind;
  bool quoted = false;
  for (const char c : text) {
    if (c == '\'') quoted = !quoted;
    const bool digit = (c >= '0' && c <= '9') || c == '.';
    if (!quoted && !digit && c != '\'') kind += c;
  }
  return kind;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace tpm::test;
  const auto argument = [&](int i, std::uint32_t otherwise) {
    return argc > i ? static_cast<std::uint32_t>(std::strtoul(argv[i], nullptr, 10)) : otherwise;
  };
  const std::uint32_t count = argument(1, 5000), first = argument(2, 1);
  const bool show = argc > 3 && std::string_view(argv[3]) == "--refused";
  const auto folder = std::filesystem::temp_directory_path() / "tpm_made_tables";
  std::filesystem::create_directories(folder);
  std::map<ReadingResult, std::uint32_t> counts;
  std::map<std::string, std::uint32_t> refusals;
  for (std::uint32_t seed = first; seed < first + count; ++seed) {
    const MadeTable table = made_table(seed);
    std::string said;
    const std::string path = (folder / "table.txt").string();
    const ReadingResult result = read_made_table(table, path, said);
    ++counts[result];
    if (result == ReadingResult::refused) ++refusals[kind_of(said)];
    const bool tell = result == ReadingResult::wrong || (show && result == ReadingResult::refused);
    if (tell) fmt::print("seed {}: {}\n  {}\n", seed, table.recipe, said);
  }
  fmt::print("{} tables from seed {}: {} right, {} refused, {} wrong\n", count, first,
             counts[ReadingResult::right], counts[ReadingResult::refused],
             counts[ReadingResult::wrong]);
  for (const auto& [kind, n] : refusals) {
    constexpr std::uint32_t kOften = 10;
    if (n >= kOften) fmt::print("  {:5} refused{}\n", n, kind);
  }
  std::filesystem::remove_all(folder);
  return counts[ReadingResult::wrong] == 0 ? 0 : 1;
}
