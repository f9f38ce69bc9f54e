// The report on the paper, made as a user makes it, against the one in reports/paper.
#include <catch2/catch.hpp>

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/files/file.hpp"
#include "tpm/paper/show/paper_report.hpp"
#include "tpm/show/draw.hpp"

using namespace tpm;
using namespace tpm::paper;
namespace fs = std::filesystem;

namespace {

const std::vector<std::string> kResults{
    "report.md",        "validation.json",     "tables.md",
    "tables.csv",       "tables.tex",          "tables.json",
    "audit.json",       "fit_relaxation.json", "fit_sensitivity.json",
    "fit_held_out.json"};

fs::path fresh_report(const char* name) {
  fs::path folder = fs::temp_directory_path() / ("tpm_report_" + std::string(name));
  fs::remove_all(folder);
  write_paper_report(make_paper_report(), folder, find_drawing_python());
  return folder;
}

/// One word or one number of a text.
struct Token {
  std::string text;
  bool number = false;
};

std::vector<Token> tokens(const std::string& text) {
  std::vector<Token> list;
  const char* at = text.c_str();
  const char* const end = at + text.size();
  while (at < end) {
    char* after = nullptr;
    const bool digit = std::isdigit(static_cast<unsigned char>(*at)) != 0;
    if (digit) std::strtod(at, &after);
    const char* next = digit ? after : at + 1;
    list.push_back({std::string(at, next), digit});
    at = next;
  }
  return list;
}

/// The same but for a last printed digit: another processor's exp and pow differ in the last bit,
/// and a number on the edge of rounding then falls to the other side.
std::string first_difference(const std::string& expected, const std::string& fresh) {
  const auto a = tokens(expected);
  const auto b = tokens(fresh);
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (a[i].text == b[i].text) continue;
    const double x = std::strtod(a[i].text.c_str(), nullptr);
    const double y = std::strtod(b[i].text.c_str(), nullptr);
    const bool close =
        a[i].number && b[i].number &&
        std::abs(x - y) <= 1.001 * std::pow(10.0, std::floor(std::log10(std::abs(x))) - 4.0);
    if (!close) return a[i].text + " became " + b[i].text;
  }
  return a.size() == b.size() ? "" : "the texts differ in length";
}

}  // namespace

TEST_CASE("the report is reproduced, and twice byte for byte") {
  const fs::path reference = fs::path(TPM_TEST_SOURCE_DIR) / "reports" / "paper";
  const fs::path first = fresh_report("first");
  const fs::path second = fresh_report("second");
  for (const std::string& name : kResults) {
    INFO(name);
    const std::string text = read_file(first / name);
    CHECK(text == read_file(second / name));
    const std::string difference = first_difference(read_file(reference / name), text);
    INFO(difference);
    CHECK(difference.empty());
  }
  SECTION("the drawings are the same bytes too, and so is the page made of them") {
    CHECK(read_file(first / "report.html") == read_file(second / "report.html"));
    CHECK(read_file(first / "figures.json") == read_file(second / "figures.json"));
  }
  fs::remove_all(first);
  fs::remove_all(second);
}
