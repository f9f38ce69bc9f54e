// Results of benchmarks: their schema says what their reader says.
#include <catch2/catch.hpp>

#include "odd_documents.hpp"
#include "tpm/accuracy/show/benchmark_report.hpp"

using namespace tpm;
using namespace tpm::accuracy;

TEST_CASE("schema and reader of a benchmark's results agree on odd ones", "[keys]") {
  Json whole = example_of(benchmark_kind());
  whole["repeats"] = 3;
  whole["problems"] =
      parse_json(R"([{"name": "bond", "title": "t", "text": "x", "response": "force",
    "simulated_s": 1, "relaxation_time_s": 0.1,
    "targets": [{"curve": "c", "error": 0.1, "step_median_s": 1e-6}],
    "reference": {"first": "a", "first_method": "b", "second": "c", "second_method": "d",
      "exact": true, "peak": 1, "peak_unit": "N", "agreement": 1e-9, "floor": 1e-8},
    "points": [{"method": "rk4", "step_s": 0.001, "end": "completed", "error": 0.01,
      "below_floor": false, "end_time_s": 1, "steps": 1000, "rates": 4000, "factorisations": 0,
      "solves": 0, "claims": {"largest_error": 0.1, "median_over_true": 2, "share_covered": 1},
      "repeats": 3, "runs_per_repeat": 10,
      "wall_s": {"median": 1, "lower_quartile": 1, "upper_quartile": 1, "least": 1}}],
    "run": {"version": "0"}}])",
                 "whole");
  test::compare_schema_and_form(benchmark_kind(), {whole, example_of(benchmark_kind())}, 200);
}
