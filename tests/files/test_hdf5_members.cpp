// JSON objects in HDF5 files: their keys are the names of attributes, groups and datasets.
#include <catch2/catch.hpp>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/hdf5/hdf5_members.hpp"

namespace tpm::files {
namespace {

TEST_CASE("the members of a JSON object are attributes and groups under their own names") {
  const test::TempFolder folder;
  {
    Hdf5Writer file(folder / "m.h5");
    write_members(file, "/",
                  {{"title", "a push"},
                   {"whole", true},
                   {"late", false},
                   {"damaged_rows", 3},
                   {"tolerance", 1e-6},
                   {"nothing", nullptr},
                   {"empty", ""},
                   {"none", Json::array()},
                   {"device", {{"kind", "virtual"}, {"limits", {{"force_N", 12.5}}}}},
                   {"remarks", {{{"code", "a"}, {"text", "b"}}, {{"code", "c"}, {"text", "d"}}}}});
    file.commit();
  }
  const Hdf5Reader file(folder / "m.h5");
  CHECK(file.attribute("/", "title") == "a push");
  CHECK(file.number_attribute("/", "whole") == 1.0);
  CHECK(file.number_attribute("/", "late") == 0.0);
  CHECK(file.number_attribute("/", "damaged_rows") == 3.0);
  CHECK(file.number_attribute("/", "tolerance") == 1e-6);
  for (const char* name : {"nothing", "empty", "none"}) CHECK_FALSE(file.has_attribute("/", name));
  CHECK_FALSE(file.has("/none"));
  CHECK(file.attribute("/device", "kind") == "virtual");
  CHECK(file.number_attribute("/device/limits", "force_N") == 12.5);
  CHECK(file.texts("/remarks/code") == std::vector<std::string>{"a", "c"});
  CHECK(file.texts("/remarks/text") == std::vector<std::string>{"b", "d"});
}

TEST_CASE("a text, a list and a missing attribute are no number, and a number is no text") {
  const test::TempFolder folder;
  {
    Hdf5Writer file(folder / "m.h5");
    write_members(file, "/", {{"text", "1"}, {"number", 1.5}});
    file.attribute("/", "list", std::vector<std::int64_t>{2, 0});
    file.commit();
  }
  const Hdf5Reader file(folder / "m.h5");
  for (const char* name : {"text", "list"}) {
    CHECK_THAT(test::refusal_of([&] { (void)file.number_attribute("/", name); }),
               Catch::Contains("is of another type; expected one number"));
  }
  CHECK_THAT(test::refusal_of([&] { (void)file.number_attribute("/", "more"); }),
             Catch::Contains("no attribute 'more'"));
  CHECK_THAT(test::refusal_of([&] { (void)file.attribute("/", "number"); }),
             Catch::Contains("is of another type; expected a text"));
}

}  // namespace
}  // namespace tpm::files
