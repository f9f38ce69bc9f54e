// The credibility page of tpm validate: what it shows, and what of it is found changed.
#include <catch2/catch.hpp>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/show/credibility_page.hpp"
#include "validation_studies.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;

Json record_of(double stiffer, const CredibilitySummary& summary = {}) {
  Random random(3);
  test::StudyNoise noise;
  noise.sigma_N = 2e-4;
  ValidationRequest request;
  request.law_file = "law.json";
  request.law_sha256 = std::string(64, 'a');
  request.law = test::study_calibration(1, noise, random);
  request.requirement = parse_requirement("5%", "test");
  request.recordings = {prepare_recording(
      "other.csv",
      test::study_recording(test::study_validation(200, 0.0), noise, random, stiffer))};
  return credibility_record(request, validate(request), summary, Json::object());
}

}  // namespace

TEST_CASE("a credibility page shows its record, and no longer once it was edited",
          "[validate][credibility]") {
  const test::TempFolder folder;
  const Json record = record_of(1.3, {"Is it </script> stiff?", "training", "low"});
  const std::string page = credibility_page(record);
  write_file(folder / "page.html", page);
  CHECK(read_credibility_record(folder / "page.html") == record);
  CHECK(shows_its_record(folder / "page.html", record));
  CHECK_THAT(
      page,
      Contains("not adequate") && !Contains(">not_adequate<") && Contains("peak force, N") &&
          Contains("empty: nothing was given") && Contains("tpm accuracy verify") &&
          Contains("data-title=\"u_input\"") && !Contains("<th scope=\"col\"></th>") &&
          Contains("<th scope=\"col\">in the words of the user</th>") &&
          Contains("compared: ramp from 19.9 s to 20.65 s, 3 mm deep, and hold to 40.7 s: the "
                   "whole loading"));
  // Someone makes the verdict that is shown a better one; the record stays.
  std::string edited = page;
  const auto at = edited.find(">not adequate<");
  REQUIRE(at != std::string::npos);
  edited.replace(at, 14, ">adequate<");
  write_file(folder / "page.html", edited);
  CHECK(read_credibility_record(folder / "page.html") == record);
  CHECK_FALSE(shows_its_record(folder / "page.html", record));
}

TEST_CASE("files of evidence are linked, whatever they are called", "[validate][credibility]") {
  Json record = record_of(1.0);
  const std::string file = "java: \"x\"/checks.json";
  record["evidence"].push_back({{"category", "code verification"}, {"file", file}});
  record["files"][file] = std::string(64, 'b');
  CHECK_THAT(credibility_page(record),
             Contains("<a href=\"java%3A%20%22x%22/checks.json\">java: &quot;x&quot;/checks.json "
                      "(SHA-256 bbbb"));
}

TEST_CASE("every value that differs between two records is named, and red on the page",
          "[validate][credibility]") {
  const Json before = record_of(1.0);
  CHECK(changes_of(before, before).empty());
  Json now = before;
  const Json::json_pointer place("/validation/recordings/0/quantities/0/D");
  now[place] = 0.123456;
  now["files"]["new.csv"] = "sha";
  now["law"].erase("adequacy");
  const std::vector<CredibilityChange> changes = changes_of(before, now);
  REQUIRE(changes.size() == 3);
  const auto named = [&](const std::string& where) {
    return std::ranges::find(changes, where, &CredibilityChange::place);
  };
  REQUIRE(named(place.to_string()) != changes.end());
  CHECK(named(place.to_string())->now == "0.123456");
  REQUIRE(named("/files/new.csv") != changes.end());
  CHECK(named("/files/new.csv")->before == "not there");
  REQUIRE(named("/law/adequacy") != changes.end());
  CHECK(named("/law/adequacy")->now == "gone");
  CHECK_THAT(credibility_page(before, changes),
             Contains("(now 0.123456)") && Contains("Changed since this page was written") &&
                 Contains("class=\"number bad\""));
}

TEST_CASE("a page that lacks a part of its record names it", "[validate][credibility]") {
  const test::TempFolder folder;
  write_file(folder / "older.html", credibility_page(record_of(1.0)));
  std::string text = read_file(folder / "older.html");
  const auto at = text.find("\"evidence\"");
  REQUIRE(at != std::string::npos);
  text.replace(at, 10, "\"evidenco\"");
  write_file(folder / "older.html", text);
  const auto read = [&] { (void)read_credibility_record(folder / "older.html"); };
  CHECK_THAT(test::refusal_of(read), Contains("older.html") && Contains("lacks 'evidence'"));
  CHECK_THAT(test::refusal_of([] { (void)parse_evidence("checks=a.json", "--evidence"); }),
             Contains("code verification, calculation verification"));
}

}  // namespace tpm::fit
