// The document model, its two renderings, and figures as data.
#include <catch2/catch.hpp>

#include "tpm/show/document.hpp"
#include "tpm/show/figure.hpp"
#include "tpm/show/run_record.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::show;
using Catch::Matchers::Contains;

namespace {

Document small_document() {
  Document document;
  document.title = "A & B";
  document.subtitle = "of 1 < 2";
  document.heading(2, "First part");
  document.paragraph("eta1 = 2.6e+05 Pa s in `eta1`");
  document.bullets({{"good", Tone::good}, {"a * b"}});
  document.table({"caption", {{"x"}, {"y", true}}, {{{"a|b"}, {"1.3e-16", Tone::bad}}}});
  document.picture({"fig", "Figure", "words"});
  return document;
}

}  // namespace

TEST_CASE("typesetting writes names and powers of ten as print does, but not in code") {
  Document document = small_document();
  typeset(document);
  const std::string text = to_markdown(document);
  CHECK_THAT(text, Contains("η₁ = 2.6·10⁵ Pa s in `eta1`"));
  CHECK_THAT(text, Contains("1.3·10⁻¹⁶"));
}

TEST_CASE("Markdown escapes what would be read as markup") {
  const std::string text = to_markdown(small_document());
  CHECK_THAT(text, Contains("# A & B\n\nof 1 \\< 2\n"));
  CHECK_THAT(text, Contains("- a \\* b\n"));
  CHECK_THAT(text, Contains("| a\\|b | 1.3e-16 |"));
  CHECK_THAT(text, Contains("| --- | ---: |"));
  CHECK_THAT(text, Contains("![Figure](figures/fig.svg)"));
  // Without a caption the drawing stands alone; the text above it says what it shows.
  Document pictures;
  pictures.picture({"fig", "Figure", ""});
  const std::string alone = to_markdown(pictures);
  CHECK_THAT(alone, Contains("![Figure](figures/fig.svg)"));
  CHECK_THAT(alone, !Contains("**"));
  CHECK(text.back() == '\n');
  CHECK(text[text.size() - 2] != '\n');
}

TEST_CASE("HTML is one page that needs nothing else") {
  const std::string svg = "<?xml version=\"1.0\"?>\n<svg width=\"1\"><path/></svg>\n";
  const std::string html = to_html(small_document(), {{"fig", svg}});
  CHECK_THAT(html, Contains("<h1>A &amp; B</h1>"));
  CHECK_THAT(html, Contains("<a href=\"#first-part\">First part</a>"));
  CHECK_THAT(html, Contains("<code>eta1</code>"));
  CHECK_THAT(html, Contains("<td class=\"number bad\">1.3e-16</td>"));
  CHECK_THAT(html, Contains("<svg role=\"img\" aria-label=\"Figure\" width=\"1\">"));
  CHECK_THAT(html, !Contains("<?xml"));
  CHECK_THAT(html, !Contains("src="));
  CHECK_THAT(html, !Contains("<link"));
}

TEST_CASE("a picture that was not drawn is an error, not a gap") {
  CHECK_THROWS_WITH(to_html(small_document(), {}), "fig.svg: was not drawn");
  CHECK_THROWS_WITH(to_html(small_document(), {{"fig", "nothing"}}), "fig.svg: is no SVG drawing");
}

TEST_CASE("figure data carry provenance and refuse what cannot be drawn") {
  Figure figure{"f",
                "F",
                "",
                {{"",
                  {"time", "s", false, {}, {}},
                  {"force", "N", false, {}, {}},
                  {line("model", {0, 1}, {2, 3})}}}};
  const Json series = to_json(std::vector{figure})["figures"][0]["panels"][0]["series"][0];
  CHECK(series["provenance"] == "model");
  CHECK(series["y"] == Json::array({2.0, 3.0}));
  figure.panels[0].series[0].y.pop_back();
  CHECK_THROWS_WITH(to_json(std::vector{figure}),
                    "figure f, 'model': the arrays of a series differ in length");
  figure.panels[0].series[0].y.push_back(std::nan(""));
  CHECK_THROWS_WITH(to_json(std::vector{figure}), "figure f, 'model': a value is not finite");
}

TEST_CASE("the run record names the version and the times, and nothing of a result") {
  const Json record = run_record({{"fits", 1.23456}});
  CHECK(record["seconds"]["fits"] == 1.23);
  CHECK(record.contains("tpm_version"));
  CHECK(record.contains("finished_at_UTC"));
}
