// A result that is declared once, in its forms.
#include <catch2/catch.hpp>
#include <limits>
#include <optional>

#include "tpm/show/result_table.hpp"

using namespace tpm;
using namespace tpm::show;

namespace {

struct Reading {
  std::string name;
  double depth_m = 0.0;
  std::optional<double> force_N{};
  int samples = 0;
  std::string reason{};

  [[nodiscard]] bool holds() const { return reason.empty(); }
};

const ResultTable<Reading>& reading_table() {
  using Column = ResultColumn<Reading>;
  static const ResultTable<Reading> table(
      {Column("name", &Reading::name).shown("reading", -8),
       Column("depth_m", &Reading::depth_m, 4).shown("depth, mm", 10, 1e-3, 2),
       Column("force_N", &Reading::force_N).shown("force, N", 9),
       Column("samples", &Reading::samples),
       Column("holds", &Reading::holds).shown("verdict").in_words([](const Reading& r) {
         return Cell{r.holds() ? "holds" : "FAILS", r.holds() ? Tone::good : Tone::bad};
       }),
       Column("reason", &Reading::reason).or_left_out()});
  return table;
}

const std::vector<Reading> kReadings{{"a, b", 0.00123456, 0.3266, 12},
                                     {"η", 0.01, std::nullopt, 0, "no contact"}};

}  // namespace

TEST_CASE("A table that is declared once is the same in JSON, CSV, text and on pages", "[table]") {
  const ResultTable<Reading>& table = reading_table();
  CHECK(table.list(kReadings).dump() ==
        R"([{"name":"a, b","depth_m":0.001235,"force_N":0.3266,"samples":12,"holds":true},)"
        R"({"name":"η","depth_m":0.01,"force_N":null,"samples":0,"holds":false,)"
        R"("reason":"no contact"}])");
  CHECK(table.csv(kReadings) ==
        "name,depth_m,force_N,samples,holds,reason\n"
        "\"a, b\",0.001235,0.3266,12,yes,\n"
        "η,0.01,,0,no,no contact\n");
  CHECK(table.text(kReadings) ==
        "reading   depth, mm  force, N  verdict\n"
        "a, b            1.2    0.3266  holds\n"
        "η                10         -  FAILS\n");
  CHECK(table.lists(kReadings).dump() ==
        R"({"name":["a, b","η"],"depth_m":[0.001235,0.01],"force_N":[0.3266,null],)"
        R"("samples":[12,0],"holds":[true,false],"reason":["","no contact"]})");
  Document document;
  document.table(table.page("Readings", kReadings));
  CHECK(to_markdown(document) ==
        "# \n\n\n\nReadings\n\n"
        "| reading | depth, mm | force, N | verdict |\n"
        "| --- | ---: | ---: | --- |\n"
        "| a, b | 1.2 | 0.3266 | holds |\n"
        "| η | 10 | - | FAILS |\n");
  CHECK(std::get<Table>(document.blocks.front()).rows.back().back().tone == Tone::bad);
}

TEST_CASE("Numbers of a result that are not finite are null, and all digits are kept on demand",
          "[table]") {
  const auto itself = [](double x) { return x; };
  const auto list = [](double) { return Json::array({1.5, nullptr}); };
  const ResultTable<double> table({{"six", itself}, {"all", itself, 0}, {"list", list}});
  const std::vector<double> rows{1.0 / 3.0, std::numeric_limits<double>::infinity()};
  CHECK(table.csv(rows) == "six,all,list\n0.333333,0.3333333333333333,1.5 \n,,1.5 \n");
  CHECK(table.list(rows).at(1) ==
        Json{{"six", nullptr}, {"all", nullptr}, {"list", {1.5, nullptr}}});
}

TEST_CASE("Items of rows are lines of CSV behind the columns of their row", "[table]") {
  struct Group {
    std::string group;
    std::vector<Reading> readings;
  };
  const ResultTable<Group> groups({{"group", &Group::group}});
  const ResultTable<Reading> names({{"name", &Reading::name}});
  const std::vector<Group> rows{{"first", kReadings}, {"empty", {}}};
  CHECK(nested_csv(groups, rows, &Group::readings, names) ==
        "group,name\nfirst,\"a, b\"\nfirst,η\n");
}

TEST_CASE("Columns of texts are lined up, each as wide as its widest cell", "[table]") {
  CHECK(aligned({{"name", "x"}, {"η", "10"}, {"long one", ""}}, {false, true}) ==
        "name       x\nη         10\nlong one\n");
  CHECK(aligned({{"a", "b"}, {"cc", "d"}}) == "a   b\ncc  d\n");
}
