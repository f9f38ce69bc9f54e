// A part of measure_adequacy (reports/adequacy), with the rates that the whole is held to.
#include <catch2/catch.hpp>

#include "adequacy_studies.hpp"

using namespace tpm;
using test::AdequacyOutcome;
using test::AdequacyTrial;
using test::Defect;

TEST_CASE("fits of healthy recordings are seldom called wrong", "[adequacy][slow]") {
  int wrong = 0, intervals = 0, missing = 0;
  for (int i = 0; i < 120; ++i) {
    AdequacyTrial trial;
    trial.seed = 1 + static_cast<std::uint64_t>(i);
    trial.at_rest = 10 + 40 * (i % 5);
    if (i % 3 == 1) trial.rho = 0.9;
    if (i % 3 == 2) trial.quantum = 0.5 * (1 + i % 10);
    const AdequacyOutcome o = test::fitted(trial);
    wrong += o.adequacy.is_rejected();
    intervals += o.intervals;
    missing += o.missing;
  }
  CHECK(wrong <= 5);  // 1.2 expected of a test at 1 %
  CHECK(missing <= intervals / 7);
}

namespace {

/// How many of 30 recordings with a defect that leaves three noises are refused.
int refused_of_thirty(Defect defect) {
  AdequacyTrial trial;
  trial.defect = defect;
  // A slow branch passes for a drift unless the rest is long enough to tell one.
  trial.at_rest = defect == Defect::slow_branch ? 100 : 25;
  trial.defect_N = test::amplitude_for(trial, 3.0);
  int found = 0;
  for (int i = 0; i < 30; ++i) {
    trial.seed = 100 + static_cast<std::uint64_t>(i);
    trial.defect_N =
        test::amplitude_for(trial, 3.0);  // with the placement that its own noise tells
    found += test::fitted(trial).adequacy.is_rejected();
  }
  return found;
}

}  // namespace

TEST_CASE("misfits of three noises are found", "[adequacy][slow]") {
  // A drift is no misfit: the rests tell it, and it is part of the fit.
  CHECK(refused_of_thirty(Defect::slow_branch) >= 27);
  CHECK(refused_of_thirty(Defect::ringing) >= 27);
  CHECK(refused_of_thirty(Defect::transient) >= 27);
}

TEST_CASE("a clipped force cell is named and its samples censored", "[adequacy][slow]") {
  int named = 0, adequate = 0, intervals = 0, missing = 0;
  for (int i = 0; i < 60; ++i) {
    AdequacyTrial trial;
    trial.seed = 300 + static_cast<std::uint64_t>(i);
    trial.clip = 0.6 + 0.35 * i / 59.0;
    const AdequacyOutcome o = test::fitted(trial, true);
    named += o.clipped;
    intervals += o.intervals;
    missing += o.missing;
    adequate += o.adequacy.is_adequate();
  }
  CHECK(named >= 59);
  CHECK(adequate >= 55);
  CHECK(intervals >= 150);
  CHECK(missing <= intervals / 14);
}
