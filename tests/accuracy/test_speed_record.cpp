// The speed record: what is measured, the file that is kept, and what is refused.
#include <catch2/catch.hpp>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/accuracy/show/speed_record.hpp"
#include "tpm/files/file.hpp"

using namespace tpm;
using namespace tpm::accuracy;
using Catch::Matchers::Contains;
using test::refusal_of;
using test::TempFolder;

namespace {

/// Work of a length that is known in parts of other such work.
std::function<void()> rounds(long count) {
  return [count] {
    volatile double x = 1.0;
    for (long i = 0; i < count; ++i) x = 0.5 * (x + 1.0 / x);
  };
}

SpeedWork spinning(std::string_view name, long count) {
  return {name, "a loop", [count] { return rounds(count); }};
}

std::size_t lines_of(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

TEST_CASE("twice the work takes about twice the processor time, and stands so to the loop") {
  SpeedOptions options;
  options.repeats = 5;
  std::size_t done = 0;
  const auto rows = measure_speed({spinning("once", 1'000'000), spinning("four times", 4'000'000)},
                                  options, [&] { ++done; });
  REQUIRE(rows.size() == 2);
  CHECK(done == 10);
  for (const SpeedRow& row : rows) {
    CHECK(row.repeats == 5);
    CHECK(row.times_per_repeat >= 1);
    CHECK(row.least_s <= row.lower_quartile_s);
    CHECK(row.lower_quartile_s <= row.median_s);
    CHECK(row.median_s <= row.upper_quartile_s);
    CHECK(row.calibration_s > 0.0);
    CHECK(row.ratio > 0.0);
  }
  // Bounds that only a wrong measure leaves: it is processor time on a machine with other work.
  CHECK(rows[1].least_s > 2.0 * rows[0].least_s);
  CHECK(rows[1].least_s < 8.0 * rows[0].least_s);
  CHECK(rows[1].ratio > rows[0].ratio);
}

TEST_CASE("a speed record is appended to, and keeps what it had") {
  const TempFolder folder;
  const auto file = folder / "speed.csv";
  SpeedRow row;
  row.work = "factorise_424";
  row.repeats = 3;
  row.times_per_repeat = 20;
  row.median_s = 1.25e-3;
  row.calibration_s = 5e-3;
  row.ratio = 0.25;
  append_speed_record(file, {row, row}, {"abc1234"});
  const std::string first = read_file(file);
  CHECK(lines_of(first) == 3);
  CHECK_THAT(first, Contains("factorise_424,abc1234,"));
  append_speed_record(file, {row}, {"a, \"b\""});
  const std::string second = read_file(file);
  CHECK(lines_of(second) == 4);
  CHECK(second.starts_with(first));
  CHECK_THAT(second, Contains("\"a, \"\"b\"\"\""));
  CHECK(speed_json({row}, {"abc1234"}).at("works").at(0).at("ratio") == 0.25);
}

TEST_CASE("a file that is no speed record is left alone") {
  const TempFolder folder;
  const auto file = folder / "speed.csv";
  write_file(file, "time_s,force_N\n0,1\n");
  CHECK_THAT(refusal_of([&] { append_speed_record(file, {}, {"x"}); }),
             Contains("no speed record of this version"));
  CHECK(read_file(file) == "time_s,force_N\n0,1\n");
}

TEST_CASE("works have names of their own, and an unknown one is refused with those that are") {
  const auto& works = speed_works();
  CHECK(works.size() >= 10);
  for (const SpeedWork& work : works) {
    CHECK(std::count_if(works.begin(), works.end(),
                        [&](const SpeedWork& other) { return other.name == work.name; }) == 1);
    CHECK_FALSE(work.summary.empty());
  }
  CHECK(chosen_speed_works({}).size() == works.size());
  CHECK(chosen_speed_works({"solve_424"}).front().name == "solve_424");
  CHECK_THAT(refusal_of([] { (void)chosen_speed_works({"solve_425"}); }),
             Contains("no work 'solve_425'") && Contains("solve_424"));
}

TEST_CASE("a small work of the record runs") {
  SpeedOptions options;
  options.repeats = 1;
  options.least_s = 0.0;
  const auto rows =
      measure_speed(chosen_speed_works({"factorise_424", "lanes_424"}), options, [] {});
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].median_s > 0.0);
}
