// The quick way through a recording, and what it is built from, against the general one.
#include <catch2/catch.hpp>
#include <optional>
#include <vector>

#include "random_laws.hpp"
#include "tpm/base/random.hpp"
#include "tpm/law/kernel.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::law;
using Catch::Matchers::WithinRel;

namespace {

/// A ramp from below the surface to a hold with a trembling drive, as machines record it.
/// @param jitter of the sampling times, relative to the step
Protocol trembling_hold(double jitter, std::vector<double>& times) {
  Random random(7);
  std::vector<Knot> knots;
  for (int i = 0; i <= 400; ++i) {
    const double time = 0.05 * (i + (i > 0 ? jitter * (random.uniform() - 0.5) : 0.0));
    const double depth = std::min(-1e-4 + 1.5e-3 * time, 4e-3);
    const double tremble = depth < 4e-3 ? 0.0 : 1e-6 * (random.uniform() - 0.5);
    knots.push_back({time, depth + tremble});
    times.push_back(time);
  }
  Protocol protocol(Drive::displacement, std::move(knots));
  protocol.set_equilibrium_at_start(true);
  return protocol;
}

}  // namespace

TEST_CASE("the quick way through a recording answers what the general one does", "[law]") {
  Random random(19);
  for (const double jitter : {0.0, 2e-6, 1e-3}) {
    std::vector<double> times;
    const Protocol protocol = trembling_hold(jitter, times);
    const std::vector<double> reversed(times.rbegin(), times.rend());  // is answered step by step
    for (const std::string& name : test::kLaws) {
      const LawModel law(parse_law_name(name, "test"));
      const auto values = test::random_parameters(law, random);
      const Response quick = law.respond(protocol, times, values, Want::values_and_sensitivity);
      const Response general =
          law.respond(protocol, reversed, values, Want::values_and_sensitivity);
      const double peak = general.value.cwiseAbs().maxCoeff();
      INFO(name << ", jitter " << jitter);
      CHECK(test::largest_difference(quick.value, general.value.reverse()) < 1e-9 * peak);
      for (Eigen::Index j = 0; j < quick.sensitivity.cols(); ++j) {
        const Eigen::VectorXd slopes = general.sensitivity.col(j).reverse();
        CHECK(test::largest_difference(quick.sensitivity.col(j), slopes) <
              (jitter > 0.0 ? 1e-5 : 1e-7) * slopes.cwiseAbs().maxCoeff());
      }
      if (jitter > 0.0) continue;
      CHECK(test::largest_difference(law.respond(protocol, times, values, Want::values).value,
                                     quick.value) == 0.0);
    }
  }
}

TEST_CASE("between near depths a kernel follows from its values and slopes at both", "[law]") {
  for (const KernelShape& kernel : {KernelShape(Kernel::hertz, 1e-3, 1.5, std::nullopt, 1.0),
                                    KernelShape(Kernel::power, 1e-3, 6.0, std::nullopt, 1.0),
                                    KernelShape(Kernel::linear, 1e-3, 1.0, 0.8, 2e-3)}) {
    for (const double u : {1e-5, 1e-3, 7e-3}) {
      const double change = kCubicPart * u;
      const KernelShape::Jet a = kernel.jet(u);
      const KernelShape::Jet b = kernel.jet(u + change);
      const KernelBetween between =
          kernel_between(change, a.values.value, a.tangent.slope, b.values.value, b.tangent.slope);
      for (std::size_t i = 0; i < 3; ++i) {
        const auto exact = kernel.at(u + 0.25 * static_cast<double>(i + 1) * change);
        CHECK_THAT(between.value[i], WithinRel(exact.value, 1e-10));
        CHECK_THAT(between.slope[i], WithinRel(exact.slope, 3e-8));
      }
    }
  }
}
