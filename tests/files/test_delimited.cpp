#include <algorithm>
#include <catch2/catch.hpp>

#include "tpm/base/random.hpp"
#include "tpm/files/delimited.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::files;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinRel;

namespace {

using Fields = std::vector<std::string>;

/// The fields of a row as texts of their own.
Fields fields(const DelimitedRow& row) {
  return {row.fields.begin(), row.fields.end()};
}

std::string utf16(const std::string& ascii, bool big_endian) {
  std::string bytes = big_endian ? "\xFE\xFF" : "\xFF\xFE";
  for (const char c : ascii) {
    if (big_endian) bytes += '\0';
    bytes += c;
    if (!big_endian) bytes += '\0';
  }
  return bytes;
}

}  // namespace

TEST_CASE("the same table is read from every encoding, separator and line end") {
  struct Case {
    const char* name;
    std::string bytes;
    Encoding encoding;
    char separator;
  };
  const std::vector<Case> cases = {
      {"plain", "a,b\n1,2\n", Encoding::utf8, ','},
      {"byte order mark",
       "\xEF\xBB\xBF"
       "a,b\n1,2\n",
       Encoding::utf8_with_mark, ','},
      {"CRLF", "a;b\r\n1;2\r\n", Encoding::utf8, ';'},
      {"CR", "a\tb\r1\t2", Encoding::utf8, '\t'},
      {"UTF-16 LE", utf16("a\tb\r\n1\t2\r\n", false), Encoding::utf16_little_endian, '\t'},
      {"UTF-16 BE", utf16("a;b\n1;2", true), Encoding::utf16_big_endian, ';'},
  };
  for (const Case& c : cases) {
    INFO(c.name);
    const DelimitedTable table = parse_delimited(c.bytes, "f");
    CHECK(table.encoding == c.encoding);
    CHECK(table.separator == c.separator);
    REQUIRE(table.rows.size() == 2);
    CHECK(fields(table.rows[0]) == Fields{"a", "b"});
    CHECK(fields(table.rows[1]) == Fields{"1", "2"});
    CHECK(table.rows[1].line == 2);
  }
}

TEST_CASE("quoted fields keep separators, quotes and line ends, and lines stay counted") {
  const auto table = parse_delimited(
      "# first\n\na,b\n\"x, y\",\"say \"\"no\"\"\"\n\"two\nlines\",2\n#last\n3,4\n", "f");
  REQUIRE(table.rows.size() == 4);
  CHECK(fields(table.rows[1]) == Fields{"x, y", "say \"no\""});
  CHECK(fields(table.rows[2]) == Fields{"two\nlines", "2"});
  CHECK(table.rows[2].line == 5);
  CHECK(table.rows[3].line == 8);
  REQUIRE(table.comments.size() == 2);
  CHECK(table.comments[0].text == " first");
  CHECK(table.comments[1].text == "last");
  CHECK(table.comments[1].line == 7);
}

TEST_CASE("decimal commas are found, and never mixed up with separators or points") {
  const auto table = parse_delimited("t;f\n0,5;1e3\n1;-2,5E-3\n", "f");
  CHECK(table.decimal_comma);
  CHECK_THAT(parse_field(table.rows[2].fields[1], true, "f"), WithinRel(-2.5e-3, 1e-15));
  CHECK_FALSE(parse_delimited("a,b\n0,5\n", "f").decimal_comma);
  CHECK_FALSE(parse_delimited("a;b\n0.5;1,5\n", "f").decimal_comma);
  CHECK_THROWS_WITH(parse_field("1.234,5", true, "f:2"), Catch::StartsWith("f:2: '1.234,5' has"));
  DelimitedOptions both;
  both.separator = ',';
  both.decimal_comma = true;
  CHECK_THROWS_AS(parse_delimited("a,b\n", "f", both), Error);
}

TEST_CASE("latin-1 is read when it is asked for and named when it is met") {
  const std::string bytes =
      "Pr\xFC"
      "fzeit;Kraft\n1;2\n";
  CHECK_THROWS_WITH(parse_delimited(bytes, "f"), Catch::StartsWith("f:1: byte 0xFC is not UTF-8"));
  DelimitedOptions options;
  options.latin1 = true;
  CHECK(parse_delimited(bytes, "f", options).rows[0].fields[0] ==
        "Pr\xC3\xBC"
        "fzeit");
}

TEST_CASE("what is no delimited text is refused with its line and without repeating it") {
  CHECK_THROWS_WITH(parse_delimited("a,b\n1,2,3\n", "f"),
                    "f:2: 3 fields in this row; expected 2 fields as in line 1");
  CHECK_THROWS_WITH(parse_delimited(std::string("a,b\n1,\0\n", 8), "f"),
                    Catch::StartsWith("f:2: byte 0x00 is not text"));
  CHECK_THROWS_WITH(parse_delimited("a,b\n\"1,2\n3,4\n", "f"),
                    Catch::StartsWith("f:2: a quoted field is never closed"));
  CHECK_THROWS_WITH(parse_delimited("a,b\n\"1\"2,3\n", "f"),
                    Catch::StartsWith("f:2: a quote stands where none belongs"));
  CHECK_THROWS_WITH(parse_delimited("# only a comment\n", "f"), Catch::StartsWith("f: no rows"));
  CHECK_THROWS_AS(parse_delimited("\xFF\xFE"
                                  "a",
                                  "f"),
                  Error);
  CHECK_THROWS_AS(parse_delimited(std::string("\xFF\xFE\x00\xD8", 4) + std::string("a\0", 2), "f"),
                  Error);
  DelimitedOptions narrow;
  narrow.longest_line = 10;
  CHECK_THROWS_WITH(parse_delimited("a,b\n" + std::string(11, 'x'), "f", narrow),
                    "f:2: the line is 11 bytes long; expected at most 10 bytes a line");
}

TEST_CASE("a quote inside a field is a letter, and a quote alone an inch") {
  const auto table = parse_delimited("Frequency\tG'\tG\"\nHz\tPa\t\"\n1\t2\t3\n", "f");
  CHECK(fields(table.rows[0]) == Fields{"Frequency", "G'", "G\""});
  CHECK(fields(table.rows[1]) == Fields{"Hz", "Pa", "\""});
}

TEST_CASE("blanks separate where they make the most rows of numbers") {
  const auto table = parse_delimited("time  force\n 0.0   1.5e+00\n0.5\t2\n", "f");
  CHECK(table.separator == ' ');
  CHECK(fields(table.rows[1]) == Fields{"0.0", "1.5e+00"});
  CHECK(fields(table.rows[2]) == Fields{"0.5", "2"});
  std::string preamble;
  for (int i = 0; i < 300; ++i) preamble += "a setting, with a comma\n";
  DelimitedOptions ragged;
  ragged.ragged = true;
  CHECK(parse_delimited(preamble + "0;1\n1;2\n2;3\n", "f", ragged).separator == ';');
}

TEST_CASE("a field quoted by quoted_field is read back") {
  for (const std::string text : {"plain", "a,b", "say \"no\"", "# no comment", "two\nlines", ""}) {
    INFO(text);
    const auto table = parse_delimited(quoted_field(text) + ",end\n", "f");
    CHECK(table.rows[0].fields[0] == text);
  }
}

TEST_CASE("fields that are only cut up are those that the rules of quoting give") {
  // A doubled quote in the last field sends the whole line through libcsv.
  const std::string parts[] = {"a",       " a b ", "\"\"",    "\"x\"", " \"x, y\"\t",
                               "\" x \"", "",      "\"0,5\"", "\"#\""};
  Random random(11);
  DelimitedOptions options;
  options.separator = ',';
  options.ragged = true;
  for (int i = 0; i < 500; ++i) {
    std::string line;
    const auto count = 1 + static_cast<int>(5.0 * random.uniform());
    for (int field = 0; field < count; ++field) {
      line += (field > 0 ? "," : "") + parts[static_cast<std::size_t>(9.0 * random.uniform())];
    }
    INFO(line);
    const DelimitedTable plain = parse_delimited("t,u\n" + line + ",z\n", "t", options);
    const DelimitedTable doubled = parse_delimited("t,u\n" + line + ",\"z\"\"\"\n", "t", options);
    REQUIRE(plain.rows.size() == 2);
    const auto& cut = plain.rows[1].fields;
    const auto& expected = doubled.rows.at(1).fields;
    REQUIRE(cut.size() == expected.size());
    CHECK(std::equal(cut.begin(), cut.end() - 1, expected.begin()));
  }
  for (const char* line : {"\"a\"b,c", "\"a,c", "\"a\" \"b\",c"}) {
    CHECK_THROWS_WITH(parse_delimited(std::string("t,u\n") + line + "\n", "t", {}),
                      Contains("quote"));
  }
}

TEST_CASE("every mixture of line ends is cut and counted alike") {
  const auto table = parse_delimited("a,b\r1,2\n3,4\r\n\r5,6\r\r\n7,8\r", "f");
  REQUIRE(table.rows.size() == 5);
  CHECK(fields(table.rows[1]) == Fields{"1", "2"});
  CHECK(fields(table.rows[4]) == Fields{"7", "8"});
  const std::vector<int> lines = {1, 2, 3, 5, 7};
  for (std::size_t i = 0; i < lines.size(); ++i) CHECK(table.rows[i].line == lines[i]);
}

TEST_CASE("a copied table keeps its fields when the first one is gone") {
  DelimitedTable copy;
  {
    const auto table = parse_delimited("a,\"b\"\n1,2\n", "f");
    copy = table;
  }
  CHECK(fields(copy.rows[0]) == Fields{"a", "b"});
}
