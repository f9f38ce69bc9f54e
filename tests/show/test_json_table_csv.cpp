// Tables of JSON answers as CSV.
#include <catch2/catch.hpp>

#include "tpm/show/json_table_csv.hpp"

using namespace tpm;
using namespace tpm::show;

TEST_CASE("A table of JSON keeps its keys, and the units within, as CSV", "[csv]") {
  const Json rows = Json::parse(R"([
    {"name": "a, b", "experiment": {"depth_m": 0.005}, "force_N": 1.25, "safe": true,
     "times_s": [0.5, 2], "parameters": [{"name": "k1", "lower": 1e-20}, {"name": "k2"}]},
    {"name": "c", "force_N": null, "late": "x", "parameters": []}])");
  CHECK(json_table_csv(rows) ==
        "name,experiment_depth_m,force_N,safe,times_s,late\n"
        "\"a, b\",0.005,1.25,yes,0.5 2,\n"
        "c,,,,,x\n");
  CHECK(json_table_csv(rows, "/parameters") ==
        "name,experiment_depth_m,force_N,safe,times_s,parameters_name,parameters_lower,late\n"
        "\"a, b\",0.005,1.25,yes,0.5 2,k1,1e-20,\n"
        "\"a, b\",0.005,1.25,yes,0.5 2,k2,,\n"
        "c,,,,,,,x\n");
}

TEST_CASE("The limits of an interval are two columns, of which one may be empty", "[csv]") {
  const Json rows = Json::parse(R"([{"name": "k1", "interval_SI": [null, 2.5], "times_s": [1, 2]},
                                    {"name": "k2", "interval_SI": [1.5, null]}])");
  CHECK(json_table_csv(rows) ==
        "name,interval_SI_lower,interval_SI_upper,times_s\n"
        "k1,,2.5,1 2\n"
        "k2,1.5,,\n");
}

TEST_CASE("A table without rows has its header", "[csv]") {
  CHECK(json_table_csv(Json::array(), {}, {"fit", "name"}) == "fit,name\n");
  const Json rows = Json::parse(R"([{"value": 2, "name": "k1"}])");
  CHECK(json_table_csv(rows, {}, {"fit", "name"}) == "fit,name,value\n,k1,2\n");
}
