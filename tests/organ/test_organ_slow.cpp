// Large organs: 150,000 spheres, as a solid and as a shell.
#include <catch2/catch.hpp>

#include "solid_fillings.hpp"
#include "tpm/organ/body/liver.hpp"

using namespace tpm;
using namespace tpm::organ;
using test::least_distance;

TEST_CASE("a solid liver of 150,000 spheres") {
  const MeshSurface surface = liver_surface({});
  SolidRequest request;
  request.count = 150'000;
  const Organ organ = fill_solid(surface, request);
  CHECK(organ.size() == 150'000);
  CHECK(least_distance(organ) > 0.6);
}

TEST_CASE("a shell of 150,000 spheres in two layers") {
  LiverRequest request;
  request.count = 150'000;
  request.spacing.reset();
  const Organ organ = fill_liver(request);
  CHECK(organ.size() == 150'000);
  CHECK(least_distance(organ) > 0.6);
}
