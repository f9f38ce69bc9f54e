// Ten recordings of one material to unequal depths, from unequal preloads, with unequal zeros: a
// part of measure_specimens (reports/fits), with the spread that the whole is held to.
#include <catch2/catch.hpp>

#include "placed_specimens.hpp"

using namespace tpm;
using test::PlacedSpecimens;

TEST_CASE("identified coefficients of ten recordings of one material spread by less than 1.3",
          "[placement][specimens]") {
  constexpr std::uint64_t kSeed = 7;
  struct Row {
    const char* law;
    double noise;
    int without_rest;
  };
  for (const Row& row :
       {Row{"hertz-1", 2e-3, 3}, Row{"hertz-1", 1e-2, 6}, Row{"linear-1", 2e-3, 3}}) {
    PlacedSpecimens study;
    study.law = row.law;
    study.noise = row.noise;
    study.without_rest = row.without_rest;
    base::Random random(kSeed);
    for (const test::CoefficientSpread& spread : test::coefficient_spreads(study, random)) {
      CAPTURE(row.law, row.noise, row.without_rest, spread.name, spread.identified.count,
              spread.identified.least, spread.identified.most, spread.truth);
      CHECK(spread.fitted.count == study.recordings);
      REQUIRE(spread.identified.ratio());
      CHECK(*spread.identified.ratio() < 1.3);
      // Without a rest no drift of the zero is told from a slow relaxation.
      const int most = study.recordings - (spread.name == "k_inf" ? row.without_rest : 0);
      CHECK(spread.identified.count <= most);
      CHECK(spread.pooled_identified);
      REQUIRE(spread.distance);
      CHECK(std::abs(*spread.distance) < 4.0);
    }
  }
}

TEST_CASE("at depths of their own the coefficients of one material spread by more than 1.3",
          "[placement][specimens]") {
  base::Random random(7);
  const PlacedSpecimens study;
  test::EstimateRange k_inf;
  for (const fit::PreparedRecording& r : test::placed_specimens(study, random)) {
    const std::span<const fit::PreparedRecording> one(&r, 1);
    fit::SetupOptions setup;
    setup.profiles = false;
    const fit::FitResult fit =
        run_fit(recording_config(parse_law_name(study.law, "law"), one, setup), data_sets(one));
    k_inf.add(fit.parameters.front().estimate);
  }
  CHECK(k_inf.ratio().value() > 1.3);
}
