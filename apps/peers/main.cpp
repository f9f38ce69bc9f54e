// tpm_peers: MuJoCo and Bullet beside tpm's own methods on one problem that all of them can state.
//
//     tpm_peers [FOLDER] [REPEATS]
//
// Writes the report that `tpm accuracy benchmark` writes. Engines are set up within a run, as a new
// scene would; their models are compiled before.
#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cstring>

#include "peers.hpp"
#include "tpm/accuracy/organ_problems.hpp"
#include "tpm/accuracy/show/benchmark_report.hpp"
#include "tpm/show/draw.hpp"
#include "tpm/show/run_record.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::accuracy;

namespace {

const char* const kText =
    "The liver of 424 spheres with masses and a drag of a tenth of the lowest mode, its bonds "
    "elastic "
    "(E2 = E' = 12 kPa, nothing relaxes): 8 mm in at 100 mm/s along the normal alone, held to 0.2 "
    "s. "
    "MuJoCo 2.2.2: spheres on three slides, bonds as spatial tendons with stiffness and spring "
    "length: "
    "the same force law. Bullet 3.24 (double precision): a soft body of links; a link is a share "
    "of "
    "correction per iteration and has no stiffness in N/m. The share is chosen such that the "
    "iterations of one step add up to the spring's impulse to first order, and is 1 where that "
    "would "
    "be more. The contact force is what the springs' law gives at the positions of each engine, "
    "with "
    "the drag of the driven sphere. Setting up an engine's state is part of a run, compiling its "
    "model is not.";

BenchmarkProblem peer_problem() {
  const auto benchmark = elastic_poke_case();
  BenchmarkProblem problem = poke_with_mass_problem(benchmark);
  problem.name = "organ_peers";
  problem.title = "Organ with elastic bonds and masses, poked: tpm, MuJoCo and Bullet";
  problem.text = kText;
  const auto network = std::make_shared<peers::SpringNetwork>(*benchmark);
  const std::vector<double> steps_s{1e-2, 2.5e-3, 1e-3, 5e-4, 2.5e-4, 1e-4};
  add(problem.settings, peers::mujoco_settings(network, steps_s));
  add(problem.settings, peers::bullet_settings(network, steps_s));
  return problem;
}

int run(const std::string& folder, const char* repeats) {
  BenchmarkRecord record;
  const char* end = repeats + std::strlen(repeats);
  const auto read = std::from_chars(repeats, end, record.options.repeats);
  if (read.ec != std::errc{} || read.ptr != end || record.options.repeats < 1) {
    throw Error(ExitCode::usage, "REPEATS", fmt::format("'{}'", printable(repeats)),
                "a whole number above 0");
  }
  const std::string python = find_drawing_python();
  const auto start = std::chrono::steady_clock::now();
  BenchmarkResult result = run_benchmark(peer_problem(), record.options);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  const std::string name = result.name;
  put_result(record, std::move(result), run_record({{name, took.count()}}));
  write_benchmark(record, folder, python);
  fmt::print("written to {}: report.html, report.md, benchmark.json, organ_peers.csv, figures\n",
             folder);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc > 1 ? argv[1] : "out/peers", argc > 2 ? argv[2] : "20");
  } catch (const Error& error) {
    fmt::print(stderr, "tpm_peers: {}\n", error.what());
    return static_cast<int>(error.code());
  }
}
