// Every file of tests/fuzz/corpus, and every shipped file of a kind that is fuzzed, is taken or
// refused in one sentence; so are its halves.
#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <string>
#include <vector>

#include "fuzz/inputs.hpp"
#include "fuzz/json_mutator.hpp"
#include "temp_folder.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/files/file.hpp"

namespace tpm::files {
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

/// Files that their readers take.
constexpr std::pair<const char*, const char*> kTaken[] = {
    {"scene", "tests/fuzz/corpus/scene/block.json"},
    {"scene", "configs/liver_poke.json"},
    {"session", "tests/fuzz/corpus/session/star.json"},
    {"sweep", "configs/sweep_x_depth.json"},
    {"claims", "tests/fuzz/corpus/claims/one_of_each_kind.json"},
    {"design", "configs/design_meat.json"},
    {"costs", "tests/fuzz/corpus/costs/equal.json"},
    {"delimited_text", "tests/fuzz/corpus/delimited_text/ramp.csv"},
    {"jpk", "tests/fuzz/corpus/jpk/shared.jpk-force"},
    {"recording", "tests/fuzz/corpus/recording/cut.tpmrec"},
    {"stl", "tests/fuzz/corpus/stl/tetrahedron.stl"},
    {"obj", "tests/fuzz/corpus/obj/tetrahedron.obj"},
    {"law", "tests/fuzz/corpus/law/linear_1.json"},
    {"sweep_log", "tests/fuzz/corpus/sweep_log/begun.blocks"},
    {"checkpoint", "tests/fuzz/corpus/checkpoint/interrupted.h5"},
    {"hdf5", "tests/fuzz/corpus/hdf5/packed.h5"},
    {"web_socket", "tests/fuzz/corpus/web_socket/fragments.bytes"},
    {"web_socket", "tests/fuzz/corpus/web_socket/handshake.bytes"},
    {"inverse", "tests/fuzz/corpus/inverse/inventory.json"},
    {"inverse", "tests/fuzz/corpus/inverse/force.json"}};

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

/// The file with some bytes changed, cut off or doubled; JSON is changed as JSON half the time.
std::string mutated(const fuzz::Input& input, const std::string& bytes, std::mt19937& random) {
  if (input.ending == ".json" && random() % 2 == 0) {
    std::string json = fuzz::mutated_json(bytes, static_cast<std::uint32_t>(random()));
    if (!json.empty()) return json;
  }
  std::string changed = bytes;
  for (auto left = 1 + random() % 4; left > 0 && !changed.empty(); --left) {
    const std::size_t at = random() % changed.size();
    switch (random() % 4) {
      case 0:
        changed[at] = static_cast<char>(random());
        break;
      case 1:
        changed.erase(at, random() % 16);
        break;
      case 2:
        changed.insert(at, changed.substr(at, random() % 16));
        break;
      default:
        changed[at] = static_cast<char>(changed[at] ^ (1 << (random() % 8)));
    }
  }
  return changed;
}

TEST_CASE("files that are changed at random are taken or refused") {
  constexpr int kMutants = 60;
  std::mt19937 random(0);
  for (const auto& [name, file] : kTaken) {
    const test::TempFolder folder;  // of one kind: a description beside a table would count
    const fuzz::Input& input = fuzz::input_named(name);
    const std::string bytes = read_file(std::filesystem::path(TPM_TEST_SOURCE_DIR) / file);
    if (bytes.find("\"liver\"") != std::string::npos) continue;  // it takes long to be filled
    for (int i = 0; i < kMutants; ++i) {
      INFO(file << ", mutant " << i);
      CHECK_NOTHROW(fuzz::reads(input, folder.path(), mutated(input, bytes, random)));
    }
  }
}

TEST_CASE("what is shipped is taken by the reader that the fuzzer tries it with") {
  const std::filesystem::path source = TPM_TEST_SOURCE_DIR;
  for (const auto& [name, file] : kTaken) {
    const test::TempFolder folder;
    INFO(file);
    CHECK(fuzz::reads(fuzz::input_named(name), folder.path(), read_file(source / file)));
  }
}

}  // namespace
}  // namespace tpm::files
