// The audit: what it finds in the paper, and that findings follow from the printed strings.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "expected_values.hpp"
#include "refusal.hpp"
#include "tpm/fit/expression/expression.hpp"
#include "tpm/paper/claims/audit.hpp"
#include "tpm/paper/show/study_report.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::paper;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

Json paper_document() {
  return read_json(paper_claims_path());
}

const AuditReport& printed_paper() {
  static const AuditReport report = run_audit(paper_document(), "paper_claims.json");
  return report;
}

const Finding& finding(const AuditReport& report, std::string_view id) {
  for (const Finding& f : report.findings) {
    if (f.id == id) return f;
  }
  FAIL("no finding " << id);
  return report.findings.front();
}

/// A file with one symbol `a` = 2 mm, one definition and one claim.
Json small_file(Json claim) {
  Json file = Json::parse(R"({"title": "t", "citation": "c",
    "symbols": [{"name": "a", "value": "2", "unit": "mm", "where": "p. 1"},
                {"name": "b", "value": "3", "unit": "mm", "where": "p. 1",
                 "also": [{"value": "4", "where": "p. 2"}]}],
    "definitions": [{"name": "twice", "expression": "2 * a", "where": "p. 1"},
                    {"name": "circle", "expression": "circle + 1", "where": "p. 1"}],
    "tables": [{"id": "T", "kind": "other", "where": "Table 1",
                "columns": [{"name": "n"}, {"name": "d", "unit": "mm"}],
                "rows": [["1", "2"], ["2", "4"], ["3", "7"]]}],
    "claims": []})");
  claim["id"] = "c1";
  claim["where"] = "p. 1";
  claim["quote"] = "so it says";
  file["claims"].push_back(std::move(claim));
  for (int i = 0; i < 60; ++i) {
    const std::string below = i == 0 ? "1" : fmt::format("a{}", i - 1);
    file["definitions"].push_back({{"name", fmt::format("a{}", i)},
                                   {"expression", fmt::format("{0} + {0}", below)},
                                   {"where", "p. 1"}});
  }
  return file;
}

Finding one(Json claim) {
  return run_audit(small_file(std::move(claim)), "f.json").findings.front();
}

std::string refusal(Json claim) {
  return test::refusal_of([&] { static_cast<void>(one(std::move(claim))); });
}

/// The paper's file with the printed value of one claim replaced.
Finding with_printed(std::string_view id, const char* printed) {
  Json document = paper_document();
  for (Json& claim : document["claims"]) {
    if (claim["id"] == id) claim["printed"] = printed;
  }
  return finding(run_audit(document, "changed.json"), id);
}

/// The paper's file with the printed value of one symbol replaced.
Finding with_symbol(std::string_view id, std::string_view symbol, const char* value) {
  Json document = paper_document();
  for (Json& item : document["symbols"]) {
    if (item["name"] == symbol) item["value"] = value;
  }
  return finding(run_audit(document, "changed.json"), id);
}

}  // namespace

TEST_CASE("formulas: names, definitions, the dynamic scope and the model library") {
  Evaluator e;
  e.define_symbol("k", 3.0, "here");
  e.define_expression("line", "k * u + 1", "here");
  Scope scope;
  scope.values["u"] = 2.0;
  CHECK(e.evaluate("line", scope, "here") == 7.0);
  scope.values["k"] = 10.0;
  CHECK(e.evaluate("line + 0 * pi", scope, "here") == 21.0);
  scope.formulas["u"] = "k / 5";
  scope.values.erase("u");
  CHECK(e.evaluate("line", scope, "here") == 21.0);
  CHECK(e.inputs("line", scope, "here") == std::vector<std::string>{"k"});
  CHECK_THAT(e.evaluate("tension_modulus(12000, 0.004, 0.03)", {}, "here"),
             test::expected("paper.tension_modulus_at_4_mm"));
  CHECK_THROWS_WITH(e.define_symbol("k", 1.0, "here"), Contains("'k' is taken"));
  CHECK_THROWS_WITH(e.define_symbol("pi", 1.0, "here"), Contains("'pi' is taken"));
  CHECK_THROWS_WITH(e.define_symbol("exp", 1.0, "here"), Contains("'exp' is taken"));
  CHECK_THROWS_WITH(e.evaluate("k = 4", {}, "here"), Contains("'=' assigns"));
  CHECK_THROWS_WITH(e.evaluate("1, 2", {}, "here"), Contains("more than one value"));
}

TEST_CASE(
    "formulas: a chain of definitions that name two earlier ones each is computed link by link") {
  constexpr int kLinks = 40;  // one by one; without the values of earlier ones 2^40
  Evaluator e;
  e.define_expression("a0", "1", "here");
  e.define_expression("b0", "1", "here");
  for (int i = 1; i <= kLinks; ++i) {
    e.define_expression(fmt::format("a{}", i), fmt::format("(a{0} + b{0}) / 2", i - 1), "here");
    e.define_expression(fmt::format("b{}", i), fmt::format("(b{0} + 3 * a{0}) / 4", i - 1), "here");
  }
  const std::string last = "a" + std::to_string(kLinks);
  CHECK(e.evaluate(last, {}, "here") == 1.0);
  CHECK(e.inputs(last, {}, "here").empty());
}

TEST_CASE("item 1: the stated viscosity relaxes in 0.2 ms") {
  CHECK(finding(printed_paper(), "relaxation-after-1s").verdict == AuditVerdict::contradicted);
  CHECK_THAT(finding(printed_paper(), "relaxation-after-1s").consequence, Contains("0.2083 ms"));
  CHECK(finding(printed_paper(), "relaxed-at-30s").verdict == AuditVerdict::holds);
  CHECK(finding(printed_paper(), "rate-dependence").verdict == AuditVerdict::contradicted);
  CHECK_THAT(finding(printed_paper(), "peak-with-ramp").recomputed->value,
             test::expected("paper_audit.peak_with_ramp"));
}

TEST_CASE("item 2: Eq. 18 is not the limit of Eq. 14") {
  CHECK(finding(printed_paper(), "eq18-limit").verdict == AuditVerdict::contradicted);
  CHECK_THAT(finding(printed_paper(), "creep-small-end").recomputed->value,
             test::expected("paper_audit.creep_small_end"));
  CHECK_THAT(finding(printed_paper(), "creep-large-end").recomputed->value,
             test::expected("paper_audit.creep_large_end"));
  CHECK(finding(printed_paper(), "creep-small-end-eq18").verdict == AuditVerdict::holds);
}

TEST_CASE("items 3 and 4: the search finds the two loads, 0.20 N and 3.68 mm by itself") {
  const Finding& mixed = finding(printed_paper(), "creep-large-end-eq18");
  REQUIRE_FALSE(mixed.causes.empty());
  CHECK(mixed.causes.front().only_printed);
  CHECK_THAT(mixed.causes.front().text, Contains("0.98 N (Fig. 9) in term 1, 0.96 N"));
  CHECK_THAT(mixed.causes.front().recomputed,
             test::expected("paper_audit.creep_large_end_of_two_loads"));
  const Finding& start = finding(printed_paper(), "creep-small-start");
  CHECK(start.verdict == AuditVerdict::differs);
  CHECK_THAT(start.recomputed->value, test::expected("paper_audit.creep_small_start"));
  CHECK_THAT(start.causes.at(0).text, Contains("load = 0.2 N instead of 0.196 N"));
  CHECK_THAT(finding(printed_paper(), "creep-small-lambda1").causes.at(0).text,
             Contains("3.68 mm"));
  CHECK_THAT(finding(printed_paper(), "creep-large-start").causes.at(0).text,
             Contains("0.98 N (Fig. 9)"));
}

TEST_CASE("item 5: with lambda1(e) one creep claim survives, the other does not") {
  CHECK_THAT(finding(printed_paper(), "creep-large-angle").consequence,
             Contains("40.68 degrees") && Contains("25.79 mm"));
  const Finding& large = finding(printed_paper(), "creep-large-self-consistent");
  CHECK(large.verdict == AuditVerdict::holds);
  CHECK_THAT(1e-3 * large.recomputed->value, test::expected("paper.creep_end_at_0.98_N"));
  const Finding& small = finding(printed_paper(), "creep-small-self-consistent");
  CHECK(small.verdict == AuditVerdict::contradicted);
  CHECK_THAT(1e-3 * small.recomputed->value, test::expected("paper.creep_end_at_0.196_N"));
}

TEST_CASE("items 6 to 13") {
  CHECK_THAT(finding(printed_paper(), "lambda1-range-pi6").details.at(1).recomputed.value,
             test::expected("paper_audit.lambda1_at_pi_6"));
  CHECK_THAT(finding(printed_paper(), "lambda1-range-pi4").details.at(1).recomputed.value,
             test::expected("paper_audit.lambda1_at_pi_4"));
  CHECK(finding(printed_paper(), "angle-ranges").verdict == AuditVerdict::contradicted);
  CHECK(finding(printed_paper(), "eq10-as-converted").verdict == AuditVerdict::contradicted);
  CHECK(finding(printed_paper(), "eq10-without-s").verdict == AuditVerdict::holds);
  CHECK_THAT(finding(printed_paper(), "static-modulus").recomputed->value, WithinAbs(6.0, 1e-9));
  CHECK(finding(printed_paper(), "tables-forces").cells->by_rounding == 16);
  CHECK(finding(printed_paper(), "tables-forces").cells->by_truncation == 14);
  CHECK(finding(printed_paper(), "tables-forces-area").recomputed_words() == "28 of 32");
  CHECK(finding(printed_paper(), "peak-to-end-ratio").verdict == AuditVerdict::contradicted);
  CHECK_THAT(finding(printed_paper(), "angle-guards-damage").recomputed->value,
             test::expected("paper_audit.depth_of_angle_30"));
  CHECK(finding(printed_paper(), "creep-validity").verdict == AuditVerdict::contradicted);
  CHECK(finding(printed_paper(), "table1-lambda1-range").verdict == AuditVerdict::contradicted);
  CHECK(finding(printed_paper(), "strain-rate-unit").verdict == AuditVerdict::contradicted);
  CHECK(finding(printed_paper(), "fit-with-ramp").recomputed->value > 100.0);
  CHECK(finding(printed_paper(), "gap").verdict == AuditVerdict::holds);
  CHECK(finding(printed_paper(), "distance-as-x").verdict == AuditVerdict::contradicted);
  CHECK(finding(printed_paper(), "close-to-experiment").verdict == AuditVerdict::undetermined);
  CHECK_THAT(finding(printed_paper(), "creep-probe").recomputed->value,
             test::expected("paper_audit.creep_probe"));
}

TEST_CASE("changing a printed number changes the verdict") {
  CHECK(with_printed("creep-small-start", "1.28").verdict == AuditVerdict::holds);
  CHECK(with_printed("creep-small-end", "2.52").verdict == AuditVerdict::holds_by_truncation);
  CHECK(with_printed("gap", "12").verdict == AuditVerdict::differs);
  CHECK(with_symbol("creep-load", "load_large", "0.98").verdict == AuditVerdict::holds);
  CHECK(with_symbol("creep-validity", "depth_large_end", "9.9").verdict == AuditVerdict::holds);
  CHECK(with_symbol("angle-ranges", "theta_limit", "pi/4").verdict == AuditVerdict::holds);
  CHECK(with_symbol("relaxation-after-1s", "eta1", "200000").verdict == AuditVerdict::holds);
  CHECK(with_symbol("creep-large-self-consistent", "x", "60").verdict ==
        AuditVerdict::contradicted);
  Json document = paper_document();
  for (Json& table : document["tables"]) {
    if (table["id"] == "table-3") table["rows"][3][2] = "0.930";
  }
  const AuditReport report = run_audit(document, "changed.json");
  CHECK(finding(report, "tables-forces").recomputed_words() == "31 of 32");
}

TEST_CASE("a file about anything else works the same way") {
  CHECK(
      one({{"kind", "value"}, {"printed", "4"}, {"unit", "mm"}, {"expression", "twice"}}).verdict ==
      AuditVerdict::holds);
  const Finding off = one(
      {{"kind", "value"}, {"printed", "9.0"}, {"unit", "mm"}, {"terms", {"a + b", "b - 0 * a"}}});
  CHECK(off.verdict == AuditVerdict::differs);
  CHECK_THAT(off.causes.at(0).text, Contains("4 mm (p. 2) in term 1, 3 mm (p. 1) in term 2"));
  const Finding root =
      one({{"kind", "value"},
           {"printed", "1.41"},
           {"solve",
            {{"unknown", "y"}, {"left", "y * y"}, {"right", "2"}, {"from", "0"}, {"to", "9"}}}});
  CHECK(root.verdict == AuditVerdict::holds);
  const Finding table = one({{"kind", "table"},
                             {"tables", {"T"}},
                             {"series", {{{"column", "d"}, {"expression", "n * a"}}}}});
  CHECK(table.verdict == AuditVerdict::last_digit_off);
  CHECK(table.cells->by_rounding == 2);
  const Finding inverse = one({{"kind", "agree"},
                               {"left", "1 / (s + 1)"},
                               {"right", "exp(-t)"},
                               {"tolerance", "1e-3"},
                               {"transform", {{"variable", "s"}, {"time", "t"}}},
                               {"vary", {{"symbol", "t"}, {"values", {"0.1", "1", "3"}}}}});
  CHECK(inverse.verdict == AuditVerdict::holds);
}

TEST_CASE("bad claims give one line that names file and claim") {
  CHECK(refusal({{"kind", "vibe"}}) ==
        "f.json: claim 'c1': unknown kind 'vibe'; expected one of value, range, band, agree, "
        "inequality, dimension, table, misfit");
  const auto value = [](const char* expression) {
    return refusal(
        {{"kind", "value"}, {"printed", "4"}, {"unit", "mm"}, {"expression", expression}});
  };
  CHECK_THAT(value("q + 1"), Contains("f.json: claim 'c1': unknown symbol 'q'"));
  CHECK_THAT(value("a +"), Contains("f.json: claim 'c1': expression 'a +': Unexpected end"));
  CHECK_THAT(value("nosuch(a)"), Contains("claim 'c1'"));
  CHECK_THAT(value("0 / 0"), Contains("claim 'c1': expression '0 / 0' is not a finite number"));
  CHECK_THAT(value("a59"), Contains("'a9' stands below 50 definitions that name each other"));
  CHECK_THAT(value("circle"), Contains("claim 'c1'") && Contains("refers to itself"));
  CHECK_THAT(value("step_force(a, 1, 1, -1, 1, 1, 1, 1)"),
             Contains("claim 'c1': expression 'step_force") && Contains("E1 = -1 Pa"));
  CHECK_THAT(refusal({{"kind", "value"}, {"printed", "4"}}),
             Contains("key 'expression' is missing; expected it, because the kind is 'value'"));
  CHECK_THAT(refusal({{"kind", "value"}, {"printed", {"4", "5"}}, {"expression", "a"}}),
             Contains("claim 'c1': a range is printed; expected one number"));
  CHECK_THAT(refusal({{"kind", "band"}, {"printed", "4"}, {"expression", "a"}}),
             Contains("claim 'c1': one number is printed; expected two"));
  // The name of a key follows from its declaration.
  CHECK_THAT(refusal({{"kind", "agree"}, {"left", "a"}}), Contains("key 'right' is missing"));
  CHECK_THAT(refusal({{"kind", "inequality"}, {"left", "a"}, {"right", "b"}}),
             Contains("key 'relation' is missing"));
  CHECK_THAT(refusal({{"kind", "range"}, {"printed", {"4", "5"}}, {"expression", "a"}}),
             Contains("key 'over' is missing"));
  CHECK_THAT(refusal({{"kind", "table"}, {"tables", {"T"}}}), Contains("key 'series' is missing"));
  CHECK_THAT(refusal({{"kind", "dimension"}, {"expression", "a"}}),
             Contains("key 'claimed_dimension' is missing"));
  CHECK_THAT(
      refusal({{"kind", "value"}, {"printed", "4"}, {"unit", "furlong"}, {"expression", "a"}}),
      Contains("claim 'c1': unknown unit 'furlong'"));
  CHECK_THAT(
      refusal({{"kind", "value"}, {"printed", "4"}, {"expression", "a"}, {"with", {{"a", "3 s"}}}}),
      Contains("'s' is a unit of time; expected a unit of length"));
  CHECK_THAT(refusal({{"kind", "value"},
                      {"printed", "4"},
                      {"unit", "mm"},
                      {"expression", "twice"},
                      {"if_holds", "well, {nothing}"}}),
             Contains("unknown placeholder 'nothing'"));
  CHECK_THAT(refusal({{"kind", "band"}, {"printed", {"5", "4"}}, {"expression", "a"}}),
             Contains("low before high"));
  CHECK_THAT(refusal({{"kind", "table"},
                      {"tables", {"U"}},
                      {"series", {{{"column", "d"}, {"expression", "n"}}}}}),
             Contains("unknown table 'U'"));
  CHECK_THAT(refusal({{"kind", "table"},
                      {"tables", {"T"}},
                      {"series", {{{"column", "e"}, {"expression", "n"}}}}}),
             Contains("table 'T' has no column 'e'"));
}

TEST_CASE("bad files are refused") {
  const Json good =
      small_file({{"kind", "value"}, {"printed", "2"}, {"unit", "mm"}, {"expression", "a"}});
  CHECK_NOTHROW(run_audit(good, "f.json"));
  CHECK_THROWS_WITH(read_json("no/such/claims.json"), Contains("no such file"));
  Json file = good;
  file["claims"][0]["surprise"] = 1;
  CHECK_THROWS_WITH(run_audit(file, "f.json"), Contains("f.json") && Contains("surprise"));
  file = good;
  file["claims"].push_back(file["claims"][0]);
  CHECK_THROWS_WITH(run_audit(file, "f.json"), Contains("'c1' stands twice"));
  file = good;
  file["claims"][0]["printed"] = "nan";
  CHECK_THROWS_WITH(run_audit(file, "f.json"),
                    "f.json: claim 'c1': 'nan' is not a finite number; expected a number such as "
                    "12.5 or 1.2e-3");
  file = good;
  file["tables"][0]["rows"][1][1] = "about 4";
  CHECK_THROWS_WITH(run_audit(file, "f.json"), Contains("table 'T': 'about 4'"));
  file = good;
  file["symbols"][0]["value"] = "1e400";
  CHECK_THROWS_WITH(run_audit(file, "f.json"), Contains("symbol 'a'"));
  file = good;
  file["symbols"][1]["name"] = "a";
  CHECK_THROWS_WITH(run_audit(file, "f.json"), Contains("'a' is taken"));
  file = good;
  file["tables"][0]["rows"][1] = Json::array({"1"});
  CHECK_THROWS_WITH(run_audit(file, "f.json"),
                    Contains("key /tables/0/rows: row 2 of table 'T' has 1 cells"));
  file = good;
  file.erase("symbols");
  CHECK_THROWS_AS(run_audit(file, "f.json"), Error);
}

TEST_CASE("JSON of the audit is complete and the same each time") {
  const Json json = to_json(printed_paper());
  CHECK(json.at("findings").size() == printed_paper().findings.size());
  CHECK(to_text(json) == to_text(to_json(run_audit(paper_document(), "paper_claims.json"))));
  for (const Finding& f : printed_paper().findings) {
    CAPTURE(f.id);
    CHECK_FALSE(f.consequence.empty());
    CHECK_FALSE(f.expression.empty());
  }
  CHECK_THAT(audit_text(printed_paper()),
             Contains("creep-small-start") && Contains("eq1-geometry"));
}

TEST_CASE("The short answer of the audit counts every verdict and names what does not stand") {
  const AuditReport& report = printed_paper();
  const ShortAnswer answer = short_answer(report);
  const std::string text = to_text(answer);
  CHECK(std::ranges::count(text, '\n') <= static_cast<std::ptrdiff_t>(kAnswerLines));
  CHECK_THAT(text, !Contains("more lines of claims"));
  for (const Finding& f : report.findings) {
    CAPTURE(f.id);
    CHECK((text.find(f.id) != std::string::npos) != f.stands());
  }
  for (const auto& verdict : kAuditVerdicts) {
    const std::string count =
        fmt::format("{:<21}{:>4}", verdict.text, report.count(verdict.meaning));
    CHECK_THAT(text, Contains(count));
  }
  // The diameter of a flat punch, sqrt(4 F / (pi p)) of 0.196 N at 6.9 kPa.
  const double diameter_mm = 1e3 * std::sqrt(4.0 / std::numbers::pi * 0.196 / 6.9e3);
  CHECK_THAT(text,
             Contains(fmt::format("creep-probe: printed 4 mm, recomputed {:.3f} mm", diameter_mm)));
}
