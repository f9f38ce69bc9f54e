// The paper's model against printed numbers and ranges: verdicts by hand.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <regex>
#include <sstream>
#include <string>

#include "tpm/files/file.hpp"
#include "tpm/paper/claims/audit.hpp"
#include "tpm/paper/printed_comparison.hpp"

using namespace tpm;
using namespace tpm::paper;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;

namespace {

std::string report_in_repository() {
  return read_file(std::filesystem::path(TPM_TEST_SOURCE_DIR) / "reports" / "paper" / "report.md");
}

/// How often each sentence of paragraphs, lists and captions stands in a Markdown page.
std::map<std::string, int> sentences_of(const std::string& page) {
  std::map<std::string, int> counts;
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("|") || line.starts_with("#") || line.starts_with("![")) continue;
    line = std::regex_replace(line, std::regex(R"(^- (Fit: )?|\*\*)"), "");
    line = std::regex_replace(line, std::regex(R"(\. )"), "\n");
    std::istringstream parts(line);
    for (std::string sentence; std::getline(parts, sentence);) {
      if (sentence.ends_with('.')) sentence.pop_back();
      if (std::ranges::count(sentence, ' ') >= 3) ++counts[sentence];
    }
  }
  return counts;
}

/// S against [low, high] with u_D alone, R = 10 %.
PrintedComparison judged(double simulated, double low, double high, double u_D,
                         double share = 0.1) {
  PrintedComparison c;
  c.unit = parse_unit("N", "test");
  c.simulated = simulated;
  c.low = low;
  c.high = high;
  c.u_D = u_D;
  c.e.degrees = std::numeric_limits<double>::infinity();
  judge_printed(c, share);
  return c;
}

}  // namespace

TEST_CASE("a printed number is judged by |E| + U and |E| - U against R") {
  const double u = 0.01 / 1.9599639845400545;  // U = 0.01
  CHECK(judged(1.05, 1.0, 1.0, u).verdict == ModelVerdict::adequate);
  CHECK(judged(0.95, 1.0, 1.0, u).verdict == ModelVerdict::adequate);
  CHECK(judged(1.095, 1.0, 1.0, u).verdict == ModelVerdict::undetermined);
  CHECK(judged(1.12, 1.0, 1.0, u).verdict == ModelVerdict::not_adequate);
  const PrintedComparison c = judged(1.12, 1.0, 1.0, u);
  CHECK_THAT(c.e.expanded(), WithinAbs(0.01, 1e-12));
  CHECK_THAT(c.not_adequate_below, WithinAbs(0.11, 1e-12));
  CHECK_THAT(c.adequate_from, WithinAbs(0.13, 1e-12));
  CHECK_THAT(c.remark, Contains("unless the unstated part of u_D exceeds"));
}

TEST_CASE("a range refutes a number well outside and confirms nothing inside") {
  CHECK(judged(0.5, 0.4, 0.6, 1e-6).verdict == ModelVerdict::undetermined);
  CHECK_THAT(judged(0.5, 0.4, 0.6, 1e-6).remark, Contains("range of 0.2 N"));
  CHECK(judged(0.2, 0.4, 0.6, 1e-6).verdict == ModelVerdict::not_adequate);
  CHECK(judged(0.38, 0.4, 0.6, 1e-6).verdict == ModelVerdict::undetermined);
  CHECK(judged(0.9, 0.4, 0.6, 1e-6).verdict == ModelVerdict::not_adequate);
  CHECK(judged(1.0, 0.98, 1.02, 1e-6).verdict == ModelVerdict::adequate);
}

TEST_CASE("a verdict is the same for every number that the range allows") {
  const double u = 0.002;
  for (const double simulated : {0.2, 0.35, 0.4, 0.45, 0.5, 0.6, 0.66, 0.8}) {
    for (const double share : {0.05, 0.2, 0.6}) {
      const PrintedComparison c = judged(simulated, 0.4, 0.6, u, share);
      bool all_adequate = true, all_not = true;
      for (int i = 0; i <= 200; ++i) {
        const double measured = 0.4 + 0.001 * i;
        const double error = std::abs(simulated - measured), U = c.e.expanded();
        all_adequate = all_adequate && error + U <= share * measured;
        all_not = all_not && error - U > share * measured;
      }
      CAPTURE(simulated, share);
      CHECK((c.verdict == ModelVerdict::adequate) == all_adequate);
      CHECK((c.verdict == ModelVerdict::not_adequate) == all_not);
    }
  }
}

TEST_CASE("what the paper never printed is not called printed") {
  const std::filesystem::path path = paper_claims_path();
  const AuditReport audit = run_audit(read_json(path), path.filename().string());
  const auto finding = [&](std::string_view id) -> const Finding& {
    for (const Finding& f : audit.findings) {
      if (f.id == id) return f;
    }
    throw std::out_of_range(std::string(id));
  };
  for (const char* id : {"eq10-as-converted", "eq1-geometry", "relaxation-after-1s",
                         "rate-dependence", "peak-to-end-ratio"}) {
    INFO(id);
    CHECK(finding(id).printed.empty());
    CHECK_FALSE(finding(id).derived.empty());
  }
  CHECK(finding("relaxation-after-1s").derived == ">= 1 % (assumed)");
  CHECK(finding("creep-load").printed == "0.96 N");
  CHECK(finding("creep-validity").printed == "<= 10 mm");
  for (const Finding& f : audit.findings) {
    INFO(f.id);
    CHECK(f.printed.empty() != f.derived.empty());
    for (const AuditCause& cause : f.causes) {
      CHECK_THAT(cause.text, !Contains("_"));
      CHECK_THAT(f.consequence, !Contains(cause.text));
    }
    CHECK_THAT(f.consequence, !Contains("_"));
  }
}

TEST_CASE("the report says no sentence twice") {
  CHECK(sentences_of("- a b c d. A b c d.\n\n**a b c d.**\n").at("a b c d") == 2);
  const std::map<std::string, int> sentences = sentences_of(report_in_repository());
  CHECK(sentences.size() > 50);
  for (const auto& [sentence, count] : sentences) {
    INFO(sentence);
    CHECK(count == 1);
  }
}

TEST_CASE("the report's summary accounts for all claims, and the page names no variables") {
  const std::string page = report_in_repository();
  std::smatch counts;
  REQUIRE(std::regex_search(
      page, counts,
      std::regex(
          "of (\\d+) claims (\\d+) stand, (\\d+) differ from their recomputation, (\\d+) are "
          "contradicted by [^;]*; off in the last digit: (\\d+); undetermined: (\\d+)")));
  int sum = 0;
  for (std::size_t i = 2; i < counts.size(); ++i) sum += std::stoi(counts[i]);
  CHECK(sum == std::stoi(counts[1]));
  // Identifiers of data sets, quantities of uncertainty and files may stand.
  const std::regex name(R"([A-Za-z0-9]*[a-z][a-z0-9]*_[a-z0-9_]+(\.[a-z]+)?)");
  const std::regex allowed(
      R"(evren_(relaxation|static)|amy_creep|u_(val|num|input)|[a-z_0-9]+\.(svg|json))");
  for (std::sregex_iterator i(page.begin(), page.end(), name), end; i != end; ++i) {
    INFO(i->str());
    CHECK(std::regex_match(i->str(), allowed));
  }
}
