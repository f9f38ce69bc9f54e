// Tables in every style that people and machines write: right, or refused, and never read wrong.
// tests/measure/made_tables.cpp counts more of them.
#include <catch2/catch.hpp>

#include "made_tables.hpp"
#include "temp_folder.hpp"

using namespace tpm::test;

TEST_CASE("no table of any style is silently read wrong, and most are read", "[made-tables]") {
  constexpr std::uint32_t kTables = 600;
  const TempFolder folder;
  std::uint32_t right = 0;
  for (std::uint32_t seed = 1; seed <= kTables; ++seed) {
    const MadeTable table = made_table(seed);
    std::string said;
    const ReadingResult result = read_made_table(table, folder / "table.txt", said);
    INFO("seed " << seed << ": " << table.recipe << "\n" << said);
    CHECK(result != ReadingResult::wrong);
    if (result == ReadingResult::right) ++right;
  }
  CHECK(right > kTables / 2);
}
