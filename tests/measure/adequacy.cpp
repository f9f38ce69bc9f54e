// measure_adequacy healthy|defects|drift|clipping RECORDINGS SEED, or curves RECORDINGS SEED
// FOLDER: how often a law that is right is called wrong, how often a defect is found and a clipped
// force cell is named, and the rate against the size of each defect as FOLDER/figures.json
// (reports/adequacy).
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <map>

#include "adequacy_studies.hpp"
#include "program.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/figure.hpp"

namespace {

using namespace tpm;
using namespace tpm::show;
using test::AdequacyOutcome;
using test::AdequacyTrial;
using test::Defect;

constexpr int kRests[] = {10, 14, 20, 30, 50, 80, 120, 200};
constexpr Defect kScaled[] = {Defect::slow_branch, Defect::slip, Defect::ringing,
                              Defect::transient};

/// Counts of one row of a table.
struct Row {
  int recordings = 0, not_judged = 0, not_described = 0, named = 0, intervals = 0, missing = 0;

  void count(const AdequacyOutcome& o) {
    ++recordings;
    not_judged += o.adequacy.verdict == "not_judged";
    not_described += o.adequacy.is_rejected();
    named += !o.adequacy.causes.empty();
    intervals += o.intervals;
    missing += o.missing;
  }
};

void print_rows(const std::map<std::string, Row>& rows) {
  fmt::print(
      "| recordings | number | cannot be judged | not described | with a likely cause | intervals "
      "without condition | of these without the true value |\n"
      "| --- | --- | --- | --- | --- | --- | --- |\n");
  Row all;
  const auto print = [](const std::string& name, const Row& r) {
    fmt::print("| {} | {} | {} | {} | {} | {} | {} ({:.1f} %) |\n", name, r.recordings,
               r.not_judged, r.not_described, r.named, r.intervals, r.missing,
               r.intervals > 0 ? 100.0 * r.missing / r.intervals : 0.0);
  };
  for (const auto& [name, row] : rows) {
    print(name, row);
    all.recordings += row.recordings;
    all.not_judged += row.not_judged;
    all.not_described += row.not_described;
    all.named += row.named;
    all.intervals += row.intervals;
    all.missing += row.missing;
  }
  print("all", all);
}

void healthy(int count, std::uint64_t seed) {
  std::map<std::string, Row> rows;
  Random pick(seed);
  for (int i = 0; i < count; ++i) {
    AdequacyTrial trial;
    trial.seed = seed + 1000 + static_cast<std::uint64_t>(i);
    trial.at_rest = kRests[i % 8];
    const int kind = i % 3;
    if (kind == 1) trial.rho = 0.9;
    if (kind == 2) trial.quantum = 0.3 * std::exp(pick.uniform() * std::log(20.0));
    rows[kind == 0   ? "white noise"
         : kind == 1 ? "AR(1) noise, 0.9"
                     : "white noise, rounded to 0.3 to 6 of it"]
        .count(test::fitted(trial));
  }
  print_rows(rows);
}

void defects(int count, std::uint64_t seed) {
  std::map<std::string, Row> rows;
  std::map<Defect, double> unit;
  Random pick(seed);
  for (int i = 0; i < count; ++i) {
    AdequacyTrial trial;
    trial.seed = seed + 5000 + static_cast<std::uint64_t>(i);
    trial.defect = kScaled[i % 4];
    trial.rho = i / 4 % 2 == 0 ? 0.0 : 0.6;
    const double effective = 20.0 + 30.0 * pick.uniform();
    trial.at_rest = static_cast<int>(std::ceil(effective * (1.0 + trial.rho) / (1.0 - trial.rho)));
    const double noises = 3.0 * std::exp(pick.uniform() * std::log(10.0));
    trial.defect_N = test::amplitude_for(trial, noises);
    rows[test::defect_name(trial.defect)].count(test::fitted(trial));
  }
  print_rows(rows);
}

/// A drift that the rest tells is a term of the fit: the recording is then described.
void drift(int count, std::uint64_t seed) {
  std::map<std::string, Row> rows;
  Random pick(seed);
  for (int i = 0; i < count; ++i) {
    AdequacyTrial trial;
    trial.seed = seed + 7000 + static_cast<std::uint64_t>(i);
    trial.defect = Defect::drift;
    trial.rho = i % 2 == 0 ? 0.0 : 0.6;
    trial.at_rest = kRests[i % 8];
    // Over the recording, in noises.
    trial.defect_N = test::kNoise_N * 3.0 * std::exp(pick.uniform() * std::log(100.0));
    const AdequacyOutcome o = test::fitted(trial, true);
    rows[o.drift_fitted ? "drift in the fit" : "not separable from a slow branch"].count(o);
  }
  print_rows(rows);
}

void clipping(int count, std::uint64_t seed) {
  struct Part {
    int recordings = 0, named = 0, adequate = 0, intervals = 0, missing = 0, false_alarms = 0;
  };
  std::map<std::string, Part> parts;
  Random pick(seed);
  for (int i = 0; i < count; ++i) {
    AdequacyTrial trial;
    trial.seed = seed + 9000 + static_cast<std::uint64_t>(i);
    trial.quantum = i % 2 == 0 ? 0.0 : 0.3 * std::exp(pick.uniform() * std::log(20.0));
    const double clip = 0.6 + 0.35 * pick.uniform();
    Part& part = parts[clip < 0.7 ? "60 to 70 %" : "70 to 95 %"];
    part.false_alarms += test::fitted(trial).clipped;
    trial.clip = clip;
    const AdequacyOutcome o = test::fitted(trial, true);  // intervals as tpm fit states them
    ++part.recordings;
    part.named += o.clipped;
    part.adequate += o.adequacy.is_adequate();
    part.intervals += o.intervals;
    part.missing += o.missing;
  }
  fmt::print(
      "| limit, of the peak | recordings | named | the rest is described | intervals | without the "
      "true value | the same recordings not clipped, named |\n"
      "| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const auto& [limit, p] : parts) {
    fmt::print("| {} | {} | {} | {} | {} | {} ({:.1f} %) | {} |\n", limit, p.recordings, p.named,
               p.adequate, p.intervals, p.missing, 100.0 * p.missing / std::max(p.intervals, 1),
               p.false_alarms);
  }
}

void curves(int count, std::uint64_t seed, const std::filesystem::path& folder) {
  Panel panel{"Found",
              {"residual of the best fit without noise, in noises", "", true, {}, {}},
              {"recordings called not described", "%", false, 0.0, 100.0},
              {}};
  fmt::print("| defect | noises | not described of {} |\n| --- | --- | --- |\n", count);
  for (const Defect defect : kScaled) {
    Series found = line(test::defect_name(defect), {}, {});
    for (const double noises : {0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0}) {
      AdequacyTrial trial;
      trial.defect = defect;
      trial.at_rest = 30;
      trial.defect_N = test::amplitude_for(trial, noises);
      int rejected = 0;
      for (int i = 0; i < count; ++i) {
        trial.seed = seed + static_cast<std::uint64_t>(i);
        rejected += test::fitted(trial).adequacy.is_rejected();
      }
      found.add(noises, 100.0 * rejected / count);
      fmt::print("| {} | {} | {} |\n", test::defect_name(defect), noises, rejected);
    }
    panel.series.push_back(std::move(found));
  }
  const Figure figure{
      "adequacy", "How often a misfit is found, with 30 samples at rest", "", {std::move(panel)}};
  write_file(folder / "figures.json", to_text(to_json(std::vector<Figure>{figure})));
}

void run(const std::vector<std::string>& words) {
  const int count = std::atoi(words[1].c_str());
  const auto seed = std::strtoull(words[2].c_str(), nullptr, 10);
  if (words[0] == "healthy") {
    healthy(count, seed);
  } else if (words[0] == "defects") {
    defects(count, seed);
  } else if (words[0] == "drift") {
    drift(count, seed);
  } else if (words[0] == "clipping") {
    clipping(count, seed);
  } else if (words[0] == "curves" && words.size() == 4) {
    curves(count, seed, words[3]);
  } else {
    throw Error(ExitCode::usage, words[0], "no such study",
                "healthy, defects, drift, clipping, or curves with a folder");
  }
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(
      argc, argv, 3, 4,
      "usage: measure_adequacy healthy|defects|drift|clipping|curves RECORDINGS SEED "
      "[FOLDER]",
      run);
}
