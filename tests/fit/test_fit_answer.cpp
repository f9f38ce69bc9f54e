// The short answer of a fit: at most 25 lines, no warning and no verdict left out, units of its
// size.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <string>
#include <utility>

#include "one_law.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/show/fit_answer.hpp"
#include "tpm/fit/show/recording_report.hpp"
#include "tpm/fit/waterfall.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::Contains;

namespace {

/// A ramp and a hold of linear-1, depths and forces times `scale`; noise of 0.5 % of the peak.
Recording scaled_press(double scale) {
  Recording r;
  for (int i = 0; i < 160; ++i) {
    const double t = 0.1 * i;
    r.time_s.push_back(t);
    r.drive.push_back(scale * std::min(5e-3, std::max(0.0, 2e-3 * (t - 2.0))));
  }
  const LawModel model(parse_law_name("linear-1", "test"));
  const Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  const std::vector<double> values{60.0, 45.0, 2.0, 0.0, 0.0};
  const Eigen::VectorXd f = model.respond(history, r.time_s, values, Want::values).value;
  for (Eigen::Index i = 0; i < f.size(); ++i) {
    const double sign = (i * i + i / 2) % 2 == 0 ? 1.0 : -1.0;
    r.response.push_back(f[i] + sign * 0.005 * f.maxCoeff());
  }
  return r;
}

Selection selected_at_scale(double scale) {
  const std::vector<PreparedRecording> one{prepare_recording("pressed.csv", scaled_press(scale))};
  return select_law(one, test::only({"linear", "linear-1", "power-1"}));
}

auto lines_of(const std::string& text) {
  return std::ranges::count(text, '\n');
}

/// The short answer with its end, as tpm fit prints it.
std::string printed_answer(const Selection& s) {
  ShortAnswer answer = short_answer(s);
  end_answer(answer, "pressed_fit", {"law.json"}, "tpm view pressed_fit/law.json");
  return to_text(answer);
}

}  // namespace

TEST_CASE("the short answer says the verdicts, adequacy and remarks of the JSON in 25 lines",
          "[fit][answer]") {
  const Selection s = selected_at_scale(1.0);
  const std::string text = printed_answer(s);
  const Json json = to_json(s);
  INFO(text);
  CHECK(lines_of(text) <= 25);
  CHECK(text.find('{') == std::string::npos);
  CHECK_THAT(text, Contains(json.at("adequacy").at("summary").get<std::string>()));
  for (const Json& part : {json, json.at("fit")}) {
    for (const Json& remark : part.at("remarks")) {
      CHECK_THAT(text, Contains(remark.at("text").get<std::string>()));
    }
  }
  for (const Json& p : json.at("fit").at("parameters")) {
    const auto at = text.find("\n" + p.at("name").get<std::string>() + " ");
    REQUIRE(at != std::string::npos);
    const std::string row = text.substr(at + 1, text.find('\n', at + 1) - at - 1);
    CHECK_THAT(row, Catch::Matchers::EndsWith(p.at("verdict").get<std::string>()));
  }
  CHECK(json.at("fit").at("starts").at("looked_at") ==
        config_json(s.candidates[s.recommended].fit.config).at("starts").at("count"));
  CHECK_THAT(text, Contains("next: tpm view pressed_fit/law.json"));
}

TEST_CASE("the short answer of a law with many parameters names the verdict of each",
          "[fit][answer]") {
  Selection s = selected_at_scale(1.0);
  FitResult& fit = s.candidates[s.recommended].fit;
  const ParameterResult one = fit.parameters.front();
  for (int i = 0; i < 30; ++i) {
    ParameterResult more = one;
    more.parameter.name = fmt::format("more{}", i);
    more.not_separable.reset();
    more.verdict = i == 29 ? Verdict::flat : Verdict::identified;
    fit.parameters.push_back(more);
  }
  const std::string text = printed_answer(s);
  INFO(text);
  CHECK(lines_of(text) <= 25);
  for (int i = 0; i < 30; ++i) CHECK_THAT(text, Contains(fmt::format("more{}", i)));
  CHECK_THAT(text, Contains("more29: flat"));
}

TEST_CASE("an estimate near 0 is shown in the unit of its interval", "[fit][answer]") {
  Selection s = selected_at_scale(1.0);
  FitResult& fit = s.candidates[s.recommended].fit;
  for (ParameterResult& p : fit.parameters) {
    if (p.parameter.name != "contact") continue;
    p.verdict = Verdict::identified;
    p.estimate = 1.6e-16;
    p.lower = -2.871e-6;
    p.upper = 2.427e-6;
  }
  const std::string text = printed_answer(s);
  INFO(text);
  CHECK_THAT(text, Contains("-2.871 .. 2.427") && Contains("um"));
  CHECK_THAT(text, !Contains(" fm"));
}

TEST_CASE("the short answer of a folder names the recordings that are not fitted or described",
          "[fit][answer]") {
  SpecimenStudy study;
  study.law = parse_law_name("linear-1", "test");
  study.why = "because";
  for (int i = 0; i < 40; ++i) {
    SpecimenRow row;
    row.name = fmt::format("r{}.csv", i);
    row.reason = "too short";
    study.rows.push_back(std::move(row));
  }
  const Selection s = selected_at_scale(1.0);
  SpecimenRow fitted;
  fitted.name = "fitted.csv";
  fitted.fit = s.candidates[s.recommended].fit;
  fitted.fit->adequacy = LawAdequacy{"not_described", 9.0, "it does not"};
  study.rows.push_back(fitted);
  ShortAnswer answer = short_answer(study);
  end_answer(answer, "folder_fit", {"pooled.csv"}, "tpm view folder_fit/figures.json");
  const std::string text = to_text(answer);
  INFO(text);
  CHECK(lines_of(text) <= 25);
  for (int i = 0; i < 40; ++i) CHECK_THAT(text, Contains(fmt::format("r{}.csv is not fitted", i)));
  CHECK_THAT(text, Contains("1 of 1 recordings: the law does not describe them") &&
                       Contains("(fitted.csv)"));
}

TEST_CASE("the short answer of depths and forces times 1e-6 has units of their size",
          "[fit][answer]") {
  const Selection s = selected_at_scale(1e-6);
  const std::string text = printed_answer(s);
  INFO(text);
  CHECK(lines_of(text) <= 25);
  CHECK_THAT(text, Contains(" nN ") && Contains(" N/m "));
  const auto table = text.find("\nk_inf ");
  REQUIRE(table != std::string::npos);
  const std::string rows = text.substr(table, text.find("\n\n", table) - table);
  CHECK(rows.find("e-") == std::string::npos);  // no number of a row needs an exponent
  CHECK_THAT(rows, Contains("\noffset ") && Contains(" pN ") && Contains(" pm "));
}

TEST_CASE("the verbose text of a fit has the units of its short answer", "[fit][answer]") {
  const Selection s = selected_at_scale(1e-6);
  const std::string text = to_terminal_text(s.candidates[s.recommended].fit);
  INFO(text);
  CHECK_THAT(text, Contains(" pN ") && Contains(" pm "));
  const auto residual = text.find("rms residual ");
  REQUIRE(residual != std::string::npos);
  CHECK(text.substr(residual, text.find(" of the peak", residual) - residual).find("e-") ==
        std::string::npos);
}

TEST_CASE("words of a command to type stay one word each in a shell", "[fit][answer]") {
  CHECK(shell_quoted("--folder") == "--folder");
  CHECK(shell_quoted("4 mm") == "'4 mm'");
  CHECK(shell_quoted("") == "''");
  CHECK(shell_quoted("it's") == "'it'\\''s'");
  CHECK(shell_word("-a file") == "'./-a file'");
}

TEST_CASE("a unit fits the size of its value, and one that takes no prefix stays",
          "[fit][answer]") {
  const Unit newton = parse_unit("N", "test");
  CHECK(sized_text(newton, 1.7, 4) == "1.7 N");
  CHECK(sized_text(newton, 1.7e-9, 4) == "1.7 nN");
  CHECK(sized_text(newton, 1.7e6, 4) == "1.7 MN");
  CHECK(sized_text(newton, -3.2e-5, 4) == "-32 uN");
  CHECK(sized_text(newton, 0.0, 4) == "0 N");
  CHECK(sized_text(newton, 0.99999e-3, 3) == "1 mN");
  CHECK(sized_text(Dimension::length, 4e-6, 4) == "4 um");
  CHECK(sized_text(Dimension::stress, 12e9, 4) == "12 GPa");
  CHECK(sized_text(Dimension::time, 5e6, 4) == "5e+06 s");
  CHECK(sized_text({"Pa s^alpha", Dimension::viscosity, 1.0}, 1e7, 4) == "1e+07 Pa s^alpha");
  CHECK(sized_text({"mN/s", Dimension::force, 1e-3}, 1e-9, 4) == "1 nN/s");
}

TEST_CASE("screen, figure and JSON count the same starts at the best minimum", "[fit][answer]") {
  const Selection s = selected_at_scale(1.0);
  const FitResult& fit = s.candidates[s.recommended].fit;
  // Contact and offset are near zero: a share of them is no measure of agreement.
  REQUIRE(fit.waterfall.clusters.size() > 1);
  const auto at_best = std::ranges::count(fit.waterfall.clusters, 0);
  CHECK(fit.starts_agreeing == at_best);
  CHECK_THAT(printed_answer(s), Contains(fmt::format("{} of {} followed starts end at this minimum",
                                                     at_best, fit.starts_run)));
  CHECK_THAT(waterfall_figure(fit).caption,
             Contains(fmt::format("{} of {} starts end at the best minimum", at_best,
                                  fit.waterfall.starts)));
  CHECK(to_json(fit).at("starts").at("agreeing_to_5_digits") == at_best);
  // Rounds that go on from the minima count the starts that had led there.
  int listed = 0;
  for (const DistinctMinimum& m : fit.minima) listed += m.starts;
  CHECK(listed == fit.starts_run - fit.starts_failed);
  CHECK(to_json(fit).at("minima").at(0).at("starts") >= at_best);
}

TEST_CASE("ends of starts that agree are drawn on the axis on which they count as one") {
  FitResult fit;
  fit.waterfall = waterfall(std::vector<double>{3.0, 3.0 + 1e-12, 3.0 + 2e-12});
  const show::Axis agreeing = waterfall_figure(fit).panels.at(0).y;
  CHECK(agreeing.lower == 0.0);
  CHECK(agreeing.upper == fit.waterfall.margin);
  fit.waterfall = waterfall(std::vector<double>{3.0, 8.0});
  CHECK_FALSE(waterfall_figure(fit).panels.at(0).y.upper.has_value());
}

TEST_CASE("an answer that is too long sums up rows and lets warnings share a line",
          "[fit][answer]") {
  ShortAnswer answer;
  answer.conclusion = {"one", "two\nlines"};
  answer.head = {"head"};
  for (int i = 0; i < 40; ++i) answer.rows.push_back(fmt::format("row {}", i));
  for (int i = 0; i < 40; ++i) answer.warnings.push_back(fmt::format("warning {}.", i));
  answer.warnings.push_back("warning 3.");  // said once
  end_answer(answer, "it's", {"a"}, "tpm view " + shell_word("it's"));
  const std::string text = to_text(answer);
  INFO(text);
  CHECK(lines_of(text) == 25);
  for (int i = 0; i < 40; ++i) CHECK_THAT(text, Contains(fmt::format("warning {}.", i)));
  CHECK(text.find("warning 3.") == text.rfind("warning 3."));
  CHECK_THAT(text, Contains("row 0\n") && Contains("... and 35 more") && Contains("two lines\n"));
  CHECK_THAT(text, Contains("tpm view 'it'\\''s'"));
}
