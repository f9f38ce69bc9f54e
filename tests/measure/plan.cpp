// Claimed against true errors of plans on random scenes, in parts that can be put together:
//   measure_plan FIRST COUNT SEED FILE   plans scenes FIRST to FIRST + COUNT - 1 of SEED and adds
//                                        their lines to FILE; those that FILE has are passed over
//   measure_plan FILE...                 counts what the files say
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <sstream>

#include "random_plan_scene.hpp"
#include "tpm/plan/plan.hpp"
#include "tpmkit/error.hpp"

namespace {

using Fields = std::vector<std::string>;

// A line's fields. A scene's last line is its "scene" line: a file that was cut off within a scene
// has its claims without it, and they are neither counted nor passed over.
//   claim SEED NUMBER NAME FORMULATION CLAIMED TRUE REFERENCE_DIFFERENCE PICK REJECTED
//   scene SEED NUMBER OUTCOME TOLERANCE CPU_S WORDS
constexpr char kBetween = ';';
constexpr double kNothing = 1e-12;  // an error of rounding alone, for ratios

std::vector<Fields> read_lines(const std::string& file) {
  std::vector<Fields> lines;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    Fields fields;
    std::istringstream words(line);
    for (std::string field; std::getline(words, field, kBetween);) fields.push_back(field);
    lines.push_back(std::move(fields));
  }
  return lines;
}

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

std::string lines_of_plan(const tpm::test::RandomPlan& random, const std::string& scene) {
  std::string lines, outcome, phases;
  tpm::plan::PlanRequest request = random.request();
  double phase_begin = cpu_s();
  std::string phase;
  const auto end_phase = [&](const std::string& next) {
    const double now = cpu_s();
    if (!phase.empty()) phases += fmt::format(", {} {:.1f}", phase, now - phase_begin);
    phase = next;
    phase_begin = now;
  };
  request.progress = end_phase;
  const double begin = cpu_s();
  try {
    const tpm::plan::Plan plan = tpm::plan::make_plan(random.scene(), request);
    outcome = plan.choice ? "pick" : plan.without_budget ? "budget" : "none";
    for (std::size_t i = 0; i < plan.candidates.size(); ++i) {
      const tpm::plan::PlannedCandidate& c = plan.candidates[i];
      if (!c.claimed_error || !c.verified_error) continue;
      lines += fmt::format("claim;{};{};{};{:.4g};{:.4g};{:.2g};{:d};{:d}\n", scene, c.name,
                           c.formulation, *c.claimed_error,
                           *c.verified_error - plan.reference.difference, plan.reference.difference,
                           plan.choice == i, c.reason.starts_with("verified:"));
    }
  } catch (const tpm::Error& error) {
    outcome = fmt::format("error: {}", error.what());
  }
  end_phase("");
  return lines + fmt::format("scene;{};{};{:.3g};{:.2f};{}{}\n", scene, outcome, request.tolerance,
                             cpu_s() - begin, random.words(), phases);
}

int run(int first, int count, std::uint64_t seed, const std::string& file) {
  std::set<std::string> done;
  for (const Fields& line : read_lines(file)) {
    if (line.front() == "scene") done.insert(line.at(1) + kBetween + line.at(2));
  }
  std::ofstream out(file, std::ios::app);
  for (int i = first; i < first + count; ++i) {
    const std::string scene = fmt::format("{};{}", seed, i);
    if (done.contains(scene)) continue;
    out << lines_of_plan(tpm::test::RandomPlan(seed, i), scene) << std::flush;
  }
  return out ? 0 : 1;
}

double share_of(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

struct Tally {
  int count = 0, violated = 0;
  int undecided = 0;  ///< the true error is above the claim by less than the reference's own error
  std::vector<double> ratio;
};

int count(const std::vector<std::string>& files) {
  std::map<std::string, Tally> by_formulation;
  std::map<std::string, int> outcomes;
  std::map<std::string, std::vector<Fields>> open;
  Tally picks, all;
  std::vector<double> cpu;
  int rejected = 0;
  const auto add = [](Tally& tally, double claimed, double reference, double uncertain) {
    ++tally.count;
    if (reference > claimed) ++(reference - uncertain > claimed ? tally.violated : tally.undecided);
    tally.ratio.push_back(claimed / std::max(reference, kNothing));
  };
  for (const std::string& file : files) {
    open.clear();
    for (const Fields& line : read_lines(file)) {
      const std::string scene = line.at(1) + kBetween + line.at(2);
      if (line.front() == "claim") {
        open[scene].push_back(line);
        continue;
      }
      const std::string& outcome = line.at(3);
      ++outcomes[outcome.starts_with("error") ? "error" : outcome];
      cpu.push_back(std::stod(line.at(5)));
      if (outcome.starts_with("error")) fmt::print("{} of {}: {}\n", line[2], line[1], outcome);
      std::set<std::string> counted;
      for (const Fields& claim : open[scene]) {
        if (!counted.insert(claim.at(3)).second) continue;
        const double claimed = std::stod(claim.at(5));
        const double reference = std::stod(claim.at(6));
        const double uncertain = std::stod(claim.at(7));
        add(by_formulation[claim.at(4)], claimed, reference, uncertain);
        add(all, claimed, reference, uncertain);
        if (claim.at(8) == "1") add(picks, claimed, reference, uncertain);
        if (claim.at(9) == "1") ++rejected;
        if (reference > claimed) {
          fmt::print("{} of {}: {}{} claims {:.3g}, true {:.3g}, reference uncertain by {:.2g}\n",
                     line[2], line[1], claim[3], claim[8] == "1" ? ", picked," : "", claimed,
                     reference, uncertain);
        }
      }
    }
  }
  fmt::print("\n{:<14} {:>6} {:>9} {:>9}   {:<20}\n", "", "count", "violated", "undecided",
             "claimed/true");
  fmt::print("{:<14} {:>6} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "", "", "", "", "least", "median",
             "9 in 10");
  const auto row = [](const std::string& name, const Tally& t) {
    fmt::print("{:<14} {:>6} {:>9} {:>9} {:>9.2f} {:>9.2f} {:>9.3g}\n", name, t.count, t.violated,
               t.undecided, share_of(t.ratio, 0.0), share_of(t.ratio, 0.5), share_of(t.ratio, 0.9));
  };
  for (const auto& [name, tally] : by_formulation) row(name, tally);
  row("all", all);
  row("picks", picks);
  double sum = 0.0;
  for (const double s : cpu) sum += s;
  fmt::print(
      "scenes {}: picks {}, beyond the budget {}, no accurate model {}, errors {}; "
      "rejected by verification {}\n",
      cpu.size(), outcomes["pick"], outcomes["budget"], outcomes["none"], outcomes["error"],
      rejected);
  fmt::print("CPU time {:.0f} s, of a scene: median {:.1f} s, most {:.1f} s\n", sum,
             share_of(cpu, 0.5), share_of(cpu, 1.0));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  const bool numbers =
      words.size() == 4 && std::all_of(words.begin(), words.end() - 1, [](auto& w) {
        return !w.empty() && w.find_first_not_of("0123456789") == w.npos;
      });
  if (numbers) {
    return run(std::atoi(words[0].c_str()), std::atoi(words[1].c_str()),
               static_cast<std::uint64_t>(std::atoll(words[2].c_str())), words[3]);
  }
  if (!words.empty()) return count(words);
  std::cerr << "measure_plan FIRST COUNT SEED FILE, or measure_plan FILE...\n";
  return 2;
}
