// Printed digits and Tables 1-5: the windows at their edges, and the counts of explained cells.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "expected_values.hpp"
#include "tpm/paper/show/study_report.hpp"
#include "tpm/paper/tables.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::paper;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

DigitVerdict verdict(const char* printed, double computed) {
  return compare_digits(parse_printed(printed, "here"), computed).verdict;
}

const std::vector<PrintedTable>& paper_tables() {
  static const auto tables = read_printed_tables(read_json(paper_claims_path()), "paper");
  return tables;
}

TablesResult printed_tables(const TableRequest& request = {}) {
  return make_tables(request, paper_tables());
}

const TableRow& row_at(const TablesResult& result, double depth_m, double spacing_m) {
  for (const TableRow& row : result.rows) {
    if (row.depth_m == depth_m && row.spacing_m == spacing_m) return row;
  }
  FAIL("no such row");
  return result.rows.front();
}

}  // namespace

TEST_CASE("a printed number knows the worth of its last digit") {
  CHECK_THAT(parse_printed("0.61", "here").last_digit, WithinRel(0.01, 1e-15));
  CHECK_THAT(parse_printed("0.3", "here").last_digit, WithinRel(0.1, 1e-15));
  CHECK_THAT(parse_printed("-12.50", "here").last_digit, WithinRel(0.01, 1e-15));
  CHECK(parse_printed("490", "here").last_digit == 1.0);
  CHECK(parse_printed("7.", "here").last_digit == 1.0);
  CHECK_THAT(parse_printed("1.2e-3", "here").last_digit, WithinRel(1e-4, 1e-15));
  CHECK_THAT(parse_printed("1E+3", "here").last_digit, WithinRel(1e3, 1e-15));
  for (const char* wrong : {"", "nan", "inf", "1e400", "0x1", "1,5", "1.2.3", "1e", "5 mm", " 5"}) {
    CAPTURE(wrong);
    CHECK_THROWS_AS(parse_printed(wrong, "here"), Error);
  }
}

TEST_CASE("windows: rounding both ways, truncation towards zero, neighbours, and beyond") {
  CHECK(verdict("0.61", 0.605) == DigitVerdict::by_rounding);
  CHECK(verdict("0.61", 0.615) == DigitVerdict::by_rounding);
  CHECK(verdict("0.61", 0.6151) == DigitVerdict::by_truncation);
  CHECK(verdict("0.61", 0.6199) == DigitVerdict::by_truncation);
  CHECK(verdict("0.61", 0.62) == DigitVerdict::last_digit_off);
  CHECK(verdict("0.61", 0.6049) == DigitVerdict::last_digit_off);
  CHECK(verdict("0.61", 0.595) == DigitVerdict::last_digit_off);
  CHECK(verdict("0.61", 0.5949) == DigitVerdict::differs);
  CHECK(verdict("0.61", 0.6299) == DigitVerdict::last_digit_off);
  CHECK(verdict("0.61", 0.63) == DigitVerdict::differs);
  CHECK(verdict("0.61", -0.61) == DigitVerdict::differs);
}

TEST_CASE("negative, zero and scientific printed numbers use the same windows") {
  CHECK(verdict("-0.61", -0.615) == DigitVerdict::by_rounding);
  CHECK(verdict("-0.61", -0.619) == DigitVerdict::by_truncation);
  CHECK(verdict("-0.61", -0.604) == DigitVerdict::last_digit_off);
  CHECK(verdict("0.0", -0.04) == DigitVerdict::by_rounding);
  CHECK(verdict("0.0", 0.09) == DigitVerdict::by_truncation);
  CHECK_FALSE(compare_digits(parse_printed("0", "here"), 3.0).difference_percent);
  CHECK(verdict("1.2e-3", 0.00124) == DigitVerdict::by_rounding);
  CHECK(verdict("1.2e-3", 0.00129) == DigitVerdict::by_truncation);
  const DigitCheck check = compare_digits(parse_printed("-0.61", "here"), -0.5);
  CHECK_THAT(check.window_low, WithinAbs(-0.62, 1e-15));
  CHECK_THAT(check.window_high, WithinAbs(-0.605, 1e-15));
  CHECK_THAT(*check.difference_percent, WithinRel(100.0 * 0.11 / 0.61, 1e-12));
  CHECK(check.words() == "differs by +18 %");
}

TEST_CASE("the window of a cell with few digits is wide, and says so") {
  const TablesResult result = printed_tables();
  const TableRow& row = row_at(result, 0.004, 0.035);  // printed 0.61 -> 0.3
  CHECK_THAT(row.end_force.printed->from_computed_lambda1.window_width(), WithinRel(0.15, 1e-12));
  CHECK_THAT(*row.end_force.printed->from_computed_lambda1.window_percent(),
             WithinRel(50.0, 1e-12));
}

TEST_CASE("Tables 1-4: 16 of 16 lambda1 and 30 of 32 forces follow") {
  const TableSummary s = printed_tables().summary;
  CHECK(s.lambda1.cells == 16);
  CHECK(s.lambda1.explained() == 16);
  CHECK(s.lambda1.by_rounding == 14);
  CHECK(s.force_from_printed_lambda1.cells == 32);
  CHECK(s.force_from_printed_lambda1.explained() == 30);
  CHECK(s.force_from_printed_lambda1.by_rounding == 16);
  CHECK(s.force_from_printed_lambda1.last_digit_off == 1);
  CHECK(s.force_from_printed_lambda1.differ == 1);
  CHECK(s.force_from_computed_lambda1.explained() == 29);
}

TEST_CASE("with the true circle area 28 of 32 forces follow") {
  TableRequest request;
  request.parameters.A0_m2 = std::numbers::pi * 4e-6;
  CHECK(printed_tables(request).summary.force_from_printed_lambda1.explained() == 28);
}

TEST_CASE("the cells are Eqs. 2, 15 and 16 computed by hand") {
  const TablesResult result = printed_tables();
  const TableRow& row = row_at(result, 0.004, 0.030);
  const double lambda1 = 24e3 * (1.0 - std::cos(std::atan(4.0 / 30.0)));
  CHECK_THAT(row.lambda1.value, WithinRel(lambda1, 1e-12));
  CHECK_THAT(row.peak_force.value, WithinRel((12e3 + lambda1) * 4.0 * 12.56e-6, 1e-12));
  CHECK_THAT(row.end_force.value, WithinRel((6e3 + lambda1) * 4.0 * 12.56e-6, 1e-12));
  CHECK_THAT(row_at(result, 0.008, 0.030).peak_force.measured->misfit_percent,
             test::expected("paper_tables.peak_misfit_at_8_mm"));
  CHECK_THAT(row_at(result, 0.002, 0.030).end_force.measured->misfit_percent,
             test::expected("paper_tables.end_misfit_at_2_mm"));
}

TEST_CASE("Table 5 is the relaxed force at 30 mm and lies in its bands") {
  const TablesResult result = printed_tables();
  REQUIRE(result.bands.size() == 4);
  for (const BandRow& band : result.bands) {
    CHECK(band.inside);
    CHECK(band.force.printed->from_printed_lambda1->explained());
    CHECK(band.force.value == row_at(result, band.depth_m, 0.030).end_force.value);
  }
}

TEST_CASE("consistent mode with the stated eta1 has no peak, with a large one it has") {
  TableRequest request;
  request.mode = TableMode::consistent;
  const TableRow fast = row_at(printed_tables(request), 0.004, 0.030);
  CHECK_THAT(fast.peak_force.value, WithinRel(fast.end_force.value, 1e-3));
  CHECK_THAT(*fast.peak_force.printed->from_computed_lambda1.difference_percent,
             test::expected("paper_tables.peak_misfit_with_stated_viscosity"));
  request.parameters.eta1_Pa_s = 2.4e9;  // so slow that nothing relaxes
  const TableRow slow = row_at(printed_tables(request), 0.004, 0.030);
  const TableRow step = row_at(printed_tables(), 0.004, 0.030);
  CHECK_THAT(slow.end_force.value, WithinRel(step.peak_force.value, 1e-3));
}

TEST_CASE("rows the paper does not print have no verdict") {
  TableRequest request;
  request.depths_m = {0.003};
  const TablesResult result = printed_tables(request);
  CHECK(result.summary.lambda1.cells == 0);
  CHECK(result.bands.empty());
  CHECK_FALSE(result.rows.front().lambda1.printed);
  CHECK(render(tables_document(result), TableStyle::text).find("verdict") == std::string::npos);
}

TEST_CASE("bad requests give one clear line") {
  TableRequest request;
  request.depths_m = {0.002, 0.002};
  CHECK_THROWS_WITH(printed_tables(request),
                    "depths: 2 mm stands twice; expected each length once");
  request.depths_m = {-0.002};
  CHECK_THROWS_WITH(printed_tables(request), "depths: -2 mm; expected a length above 0");
  request.depths_m = {};
  CHECK_THROWS_AS(printed_tables(request), Error);
  request.depths_m = {0.002};
  request.rate_m_per_s = 0.0;
  CHECK_THROWS_AS(printed_tables(request), Error);
  request.rate_m_per_s = 1.0;
  request.parameters.E1_Pa = std::nan("");
  CHECK_THROWS_AS(printed_tables(request), Error);
}

TEST_CASE("JSON has all 48 cells, and every format is the same each time") {
  const TablesResult result = printed_tables();
  const Json json = to_json(result);
  int cells = 0;
  for (const Json& row : json.at("rows")) {
    for (const char* key : {"lambda1", "peak_force", "end_force"}) {
      cells += row.at(key).contains("printed") ? 1 : 0;
      CHECK(row.at(key).at("window_percent").get<double>() > 0.0);
    }
  }
  CHECK(cells == 48);
  CHECK(json.at("summary").at("force_from_printed_lambda1").at("explained") == 30);
  CHECK(to_text(json) == to_text(to_json(printed_tables())));
  for (const TableStyle style : {TableStyle::text, TableStyle::markdown, TableStyle::latex}) {
    const std::string text = render(tables_document(result), style);
    CHECK(text.find("0.613") != std::string::npos);
    CHECK(text.back() == '\n');
  }
  CHECK(render(tables_document(result), TableStyle::latex).find("\\%") != std::string::npos);
  const std::string csv = tables_csv(result);
  CHECK(std::count(csv.begin(), csv.end(), '\n') == 1 + 48 + 4);
}

TEST_CASE("CSV cells with commas and quotes are quoted") {
  CHECK(csv_line({"a", "b,c", "d\"e"}) == "a,\"b,c\",\"d\"\"e\"\n");
}

TEST_CASE(
    "The short answer of the tables has a row per depth and spacing, and marks what does not "
    "follow") {
  const TablesResult result = printed_tables();
  const ShortAnswer answer = short_answer(result);
  REQUIRE(answer.rows.size() == result.rows.size());
  const std::string text = to_text(answer);
  CHECK(std::ranges::count(text, '\n') <= static_cast<std::ptrdiff_t>(kAnswerLines));
  for (const std::string& row : answer.rows) CHECK(text.find(row) != std::string::npos);
  const auto marked = [](const std::string& words) {
    std::ptrdiff_t count = 0;
    for (std::size_t at = words.find(", not "); at != std::string::npos;
         at = words.find(", not ", at + 1)) {
      ++count;
    }
    return count;
  };
  const CellCounts& forces = result.summary.force_from_printed_lambda1;
  const CellCounts& lambda1 = result.summary.lambda1;
  CHECK(marked(text) == forces.cells - forces.explained() + lambda1.cells - lambda1.explained());
  CHECK_THAT(text, Catch::Contains("0.3024 N, not 0.301"));
}

TEST_CASE("A short answer of many rows says how many are left out, and keeps the counts") {
  TableRequest request;
  request.spacings_m.clear();
  for (int i = 0; i < 30; ++i) request.spacings_m.push_back(0.020 + 0.0005 * i);
  const ShortAnswer answer = short_answer(printed_tables(request));
  const std::string text = to_text(answer);
  CHECK(std::ranges::count(text, '\n') <= static_cast<std::ptrdiff_t>(kAnswerLines));
  CHECK_THAT(text, Catch::Contains("more rows") && Catch::Contains("lambda1: "));
}
