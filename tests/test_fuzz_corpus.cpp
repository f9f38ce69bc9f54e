// Every file of tests/fuzz/corpus, and every shipped file of a kind that is fuzzed, is taken or
// refused in one sentence; so are its halves.
#include <algorithm>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "fuzz/inputs.hpp"
#include "temp_folder.hpp"
#include "tpm/store/file.hpp"

namespace tpm {
namespace {

std::vector<std::filesystem::path> corpus_of(std::string_view name) {
  std::vector<std::filesystem::path> files;
  const auto folder = std::filesystem::path(TPM_TEST_SOURCE_DIR) / "tests/fuzz/corpus" / name;
  if (!std::filesystem::exists(folder)) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST_CASE("what fuzzing has found is read or refused") {
  const test::TempFolder folder;
  for (const fuzz::Input& input : fuzz::inputs()) {
    for (const auto& file : corpus_of(input.name)) {
      INFO(file);
      const std::string bytes = read_file(file);
      CHECK_NOTHROW(fuzz::reads(input, folder.path(), bytes));
      CHECK_NOTHROW(fuzz::reads(input, folder.path(), bytes.substr(0, bytes.size() / 2)));
    }
  }
}

TEST_CASE("what is shipped is taken by the reader that the fuzzer tries it with") {
  const std::filesystem::path source = TPM_TEST_SOURCE_DIR;
  const test::TempFolder folder;
  for (const auto& [name, file] :
       {std::pair{"scene", "configs/liver_poke.json"},
        std::pair{"sweep", "configs/sweep_x_depth.json"},
        std::pair{"claims", "data/paper_claims.json"},
        std::pair{"design", "configs/design_meat.json"},
        std::pair{"recording", "tests/fuzz/corpus/recording/cut.tpmrec"},
        std::pair{"stl", "tests/fuzz/corpus/stl/tetrahedron.stl"},
        std::pair{"obj", "tests/fuzz/corpus/obj/tetrahedron.obj"},
        std::pair{"law", "tests/fuzz/corpus/law/linear_1.json"},
        std::pair{"sweep_log", "tests/fuzz/corpus/sweep_log/begun.blocks"}}) {
    INFO(file);
    CHECK(fuzz::reads(fuzz::input_named(name), folder.path(), read_file(source / file)));
  }
}

}  // namespace
}  // namespace tpm
