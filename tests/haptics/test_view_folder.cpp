// tpm view of a folder: which results it finds, and what it says of the rest.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "page_arrays.hpp"
#include "simulated_scene.hpp"
#include "temp_folder.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/haptics/show/view_file.hpp"
#include "tpm/organ/run/simulation_file.hpp"

using namespace tpm;
using namespace tpm::haptics;
using Catch::Matchers::Contains;
using test::numbers;
using test::TempFolder;

namespace {

/// A file that the reader of sweeps takes for one of theirs.
void write_sweep_like(const std::string& file) {
  Hdf5Writer sweep(file);
  sweep.numbers("/peak_force", {1.0, 2.0});
  sweep.attribute("/", "sweep_fingerprint", "a");
  sweep.commit();
}

const std::string kLawAlone = R"({"law": "linear-1", "drive": "indentation_depth",
    "response": "contact_force", "reference_m": 0.004, "provenance": "derived",
    "parameters": {"k_inf_N_per_m": 60, "k1_N_per_m": 45, "tau1_s": 2, "contact_m": 0,
                   "offset_N": 0}})";

std::vector<std::string> names_of(const Viewed& viewed) {
  std::vector<std::string> names;
  for (const auto& file : viewed.files) names.push_back(file.filename().string());
  return names;
}

}  // namespace

TEST_CASE("a folder is viewed by what its files hold, whatever their names are") {
  const TempFolder folder;
  const ExperimentScene scene = test::small_scene(
      R"("protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s", "hold": "1 s"},
         "outputs": {"count": 2})");
  const RunNetwork network = network_to_run(scene);
  write_simulation(scene, network, simulate(scene, network), folder / "poke");
  // One result alone is its own page; its table is no recording.
  std::ofstream(folder / "notes.txt") << "depth [mm],force [N]\n";
  std::ofstream(folder / "poke.csv") << "depth [mm],force [N]\n";
  const Viewed alone = view_path(folder.path());
  CHECK(names_of(alone) == std::vector<std::string>{"poke"});
  CHECK(alone.html() == view_file(folder / "poke").html());

  std::ofstream(folder / "liver.json") << kLawAlone;
  write_sweep_like(folder / "mysweep.h5");
  std::ofstream(folder / "scene.json") << R"({"organ": {"kind": "star"}})";
  std::ofstream(folder / "cut.json") << R"({"figures": [)";
  std::ofstream(folder / "other.json") << R"({"figures": [{"panels": 1}]})";
  const Viewed several = view_path(folder.path());
  CHECK(names_of(several) == std::vector<std::string>{"liver.json", "poke"});
  REQUIRE(several.not_shown.size() == 3);
  CHECK_THAT(several.not_shown[2].reason.what(), Contains("other.json: is not as tpm writes it"));
  CHECK_THAT(several.not_shown[0].reason.what(), Contains("cut.json: parse error"));
  CHECK_THAT(several.not_shown[1].reason.what(),
             Contains("mysweep.h5: is the result of a sweep; expected tpm sweep plot " +
                      (folder / "mysweep.h5")));
  // Both stand on the page, each with its arrays under its own names.
  const std::string html = several.html();
  CHECK_THAT(html, Contains(R"("names":["liver.json","poke"])") && Contains("tpm sweep plot") &&
                       Contains("id=\"result-1-description\"") &&
                       Contains("id=\"result-2-description\""));
  const Json& organ = several.pages.at(1).description.at("organ");
  const std::string time = "result-2-" + organ.at("time_s").get<std::string>();
  CHECK(numbers<double>(html, time) ==
        numbers<double>(several.pages.at(1).html(), organ.at("time_s")));
}

TEST_CASE("a folder of folders is viewed by what they hold") {
  const TempFolder folder;
  const auto within = [&](const char* name) {
    std::filesystem::create_directories(std::filesystem::path(folder / name).parent_path());
    return std::ofstream(folder / name);
  };
  const char* const kFigures = R"({"figures": []})";
  const char* const kTable = "time [s],force [N]\n0,0\n";
  for (const char* fit : {"day 1/b_fit", "day 1/a_fit"}) {
    within((std::string(fit) + "/selection.json").c_str()) << R"({"fit": {"title": "t",
        "model": "m", "chi_square": 1, "confidence_level": 0.95, "parameters": []}})";
    within((std::string(fit) + "/law.json").c_str()) << kLawAlone;
    within((std::string(fit) + "/figures.json").c_str()) << kFigures;
    within((std::string(fit) + "/samples.csv").c_str()) << kTable;
  }
  within("checked/validation.json") << R"({"law_file": "law.json", "law": "linear-1",
      "law_sha256": "ab", "requirement": "5%", "verdict": "not_adequate",
      "summary": "not adequate for 5%", "pooled": [{"quantity": "peak time",
        "unit": "s", "recordings": 2, "S": 1, "D": 1, "E": 0, "U": 0.5, "R": 0.25,
        "verdict": "undetermined"}],
      "remarks": [{"code": "c", "text": "few readings"}],
      "recordings": [{"recording": "r.csv", "sha256": "cd", "quantities": [
        {"quantity": "peak force", "unit": "N", "S": 2e-4, "D": 1.25, "E": 0.5, "U": 0.25,
         "verdict": "not_adequate"}]}]})";
  within("checked/figures.json") << kFigures;
  within("checked/validation.csv") << kTable;
  within("one.csv") << kTable;
  within("recordings/1.csv") << kTable;
  within("recordings/2.csv") << kTable;
  within("page.html") << "<!DOCTYPE html>\n<html><head><title>Credibility of law.json</title>";
  within(".hidden/law.json") << kLawAlone;
  within("1/2/3/law.json") << kLawAlone;
  within("1/2/3/4/law.json") << kLawAlone;
  const Viewed viewed = view_path(folder.path());
  CHECK(viewed.names == std::vector<std::string>{"day 1/a_fit", "day 1/b_fit", "1/2/3", "checked"});
  REQUIRE(viewed.not_shown.size() == 3);
  CHECK_THAT(viewed.not_shown[0].reason.what(),
             Contains("page.html: is the credibility page of a validation; expected a browser"));
  const auto table = [](const NotShown& other) { return std::string(other.reason.what()); };
  CHECK_THAT(
      table(viewed.not_shown[1]),
      Contains("one.csv: is a table, no result of tpm; expected tpm fit " + (folder / "one.csv")));
  CHECK_THAT(table(viewed.not_shown[2]),
             Contains("recordings: holds 2 tables, no result of tpm; expected tpm fit " +
                      (folder / "recordings")));
  CHECK_THAT(viewed.html(),
             Contains(R"("kinds":["fit","fit","fit","validation"])") &&
                 Contains(R"("titles":["t","t","linear-1","Validation of law.json"])"));
  const Json& shown = viewed.pages.at(3).description;
  CHECK(shown.at("lead").at(0) == Json{{"text", "not adequate for 5%"}, {"doubt", true}});
  CHECK(shown.at("lead").at(1).at("text") == "warning: few readings");
  const Json& rows = shown.at("table").at("rows");
  REQUIRE(rows.size() == 2);
  CHECK(rows.at(0) == Json({"mean of 2 recordings", "peak time", "undetermined", "1 s", "1 s",
                            "0 s", "0.5 s", "0.25 s"}));
  CHECK(rows.at(1) ==
        Json({"r.csv", "peak force", "not adequate", "200 uN", "1.25 N", "0.5 N", "0.25 N", "-"}));
}

TEST_CASE("links to folders are told and not followed, notes that begin like JSON left out") {
  const TempFolder folder;
  std::filesystem::create_directory(folder / "fit");
  std::ofstream(folder / "fit/law.json") << kLawAlone;
  std::ofstream(folder / "other.json") << kLawAlone;
  std::ofstream(folder / "notes.txt") << "{ broken";
  std::filesystem::create_symlink("loop", folder / "loop");
  std::filesystem::create_directory_symlink(".", folder / "self");
  const Viewed viewed = view_path(folder.path());
  CHECK(viewed.files.size() == 2);
  REQUIRE(viewed.not_shown.size() == 1);
  CHECK_THAT(std::string(viewed.not_shown.front().reason.what()),
             Contains("self: is a link to a folder, which is not followed"));
}

TEST_CASE("a table is no result: tpm view names the command that fits it") {
  const TempFolder folder;
  std::ofstream(folder / "r.csv") << "time [s],force [N]\n0,0\n";
  const std::string words =
      "r.csv: is a table, no result of tpm; expected tpm fit " + (folder / "r.csv");
  CHECK_THROWS_WITH(view_file(folder / "r.csv"), Contains(words));
  CHECK_THROWS_WITH(view_path(folder.path()), Contains(words));
}

TEST_CASE("a folder whose results tpm view does not show is refused with what shows them") {
  const TempFolder folder;
  write_sweep_like(folder / "b.h5");
  const std::string words = "is the result of a sweep; expected tpm sweep plot ";
  CHECK_THROWS_WITH(view_file(folder / "b.h5"), Contains(words + (folder / "b.h5")));
  CHECK_THROWS_WITH(view_path(folder.path()), Contains(words + (folder / "b.h5")));
  write_sweep_like(folder / "a.h5");
  CHECK_THROWS_WITH(view_path(folder.path()),
                    Contains("2 files that tpm view does not show, the first: ") &&
                        Contains(words + (folder / "a.h5")));
}

TEST_CASE("a folder with more results than a page holds is refused") {
  const TempFolder folder;
  for (std::size_t i = 0; i <= kMostResultsOfPage; ++i) {
    std::ofstream(folder / ("law" + std::to_string(i) + ".json")) << kLawAlone;
  }
  CHECK_THROWS_WITH(view_path(folder.path()),
                    Contains("holds 51 results; expected 50 at most on one page"));
}
