// Spectra, relaxation moduli and creep compliances, fitted without a configuration.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "fitted_parameter.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/likelihood/config.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/select/material_function.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinRel;

// Two Maxwell branches beside a spring, Pa and s.
constexpr double kLasting = 1000.0, kFirst = 2000.0, kSecond = 500.0, kTau1 = 0.1, kTau2 = 5.0;

double modulus(double t) {
  return kLasting + kFirst * std::exp(-t / kTau1) + kSecond * std::exp(-t / kTau2);
}

std::vector<double> decades_of(double from, double to, int points) {
  std::vector<double> values;
  values.reserve(static_cast<std::size_t>(points));
  for (int i = 0; i < points; ++i) {
    values.push_back(from * std::pow(to / from, static_cast<double>(i) / (points - 1)));
  }
  return values;
}

MaterialFunction read_function(const std::string& path) {
  auto function = find_material_function(path, {});
  REQUIRE(function);
  return *std::move(function);
}

SelectionOptions quick() {
  SelectionOptions options;
  options.setup.starts = 6;
  return options;
}

const FitResult& chosen(const Selection& s) {
  return s.candidates[s.recommended].fit;
}

/// The two branches come in any order.
void check_two_branches(const FitResult& fit) {
  CHECK_THAT(estimate_of(fit, "k_inf"), WithinRel(kLasting, 1e-5));
  const bool in_order = estimate_of(fit, "tau1") < estimate_of(fit, "tau2");
  CHECK_THAT(estimate_of(fit, in_order ? "k1" : "k2"), WithinRel(kFirst, 1e-5));
  CHECK_THAT(estimate_of(fit, in_order ? "k2" : "k1"), WithinRel(kSecond, 1e-5));
  CHECK_THAT(estimate_of(fit, in_order ? "tau1" : "tau2"), WithinRel(kTau1, 1e-5));
  CHECK_THAT(estimate_of(fit, in_order ? "tau2" : "tau1"), WithinRel(kTau2, 1e-5));
}

TEST_CASE("A relaxation modulus is fitted from its file alone") {
  const test::TempFolder folder;
  std::string text = "time [s],G(t) [kPa]\n";
  for (const double t : decades_of(0.01, 100.0, 41)) {
    text += fmt::format("{:.17g},{:.17g}\n", t, 1e-3 * modulus(t));
  }
  write_file(folder / "g.csv", text);
  const MaterialFunction function = read_function(folder / "g.csv");
  CHECK(function.kind() == "relaxation modulus");
  const Selection s = select_law(function, quick());
  CHECK(law_name(chosen(s).config.law.value()) == "linear-2");
  check_two_branches(chosen(s));
  // The written configuration says the same.
  const FitConfig again = parse_fit_config(config_json(chosen(s).config), "config.json");
  const FitResult rerun = run_fit(again);
  CHECK_THAT(estimate_of(rerun, "k_inf"), WithinRel(kLasting, 1e-5));
}

TEST_CASE("A creep compliance is fitted from its file alone") {
  // J(t) of a spring k0 in series with a Kelvin unit k, T; the same solid has k_inf = k0 k/(k0 +
  // k).
  constexpr double k0 = 3000.0, k = 1500.0, T = 2.0;
  const test::TempFolder folder;
  std::string text = "time [s],compliance [1/Pa]\n";
  for (const double t : decades_of(0.01, 100.0, 31)) {
    text += fmt::format("{:.17g},{:.17g}\n", t, 1.0 / k0 + (1.0 - std::exp(-t / T)) / k);
  }
  write_file(folder / "j.csv", text);
  const MaterialFunction function = read_function(folder / "j.csv");
  CHECK(function.kind() == "creep compliance");
  SelectionOptions options = quick();
  options.laws = {parse_law_name("linear-1", "test")};
  options.only_listed = true;
  const FitResult fit = chosen(select_law(function, options));
  const double lasting = k0 * k / (k0 + k);
  CHECK_THAT(estimate_of(fit, "k_inf"), WithinRel(lasting, 1e-5));
  CHECK_THAT(estimate_of(fit, "k1"), WithinRel(k0 - lasting, 1e-5));
  CHECK_THAT(estimate_of(fit, "tau1"), WithinRel(T * k / (k0 + k), 1e-5));
}

TEST_CASE("All laws are fitted to a creep compliance that begins at 0 s") {
  // Times are equidistant and begin with the step itself, as exported by rheometers.
  constexpr double k0 = 3000.0, ka = 1500.0, Ta = 0.5, kb = 2500.0, Tb = 20.0;
  const test::TempFolder folder;
  std::string text = "time [s],compliance [1/Pa]\n";
  for (int i = 0; i < 600; ++i) {
    const double t = 0.1 * i;
    text += fmt::format("{:.17g},{:.17g}\n", t,
                        1.0 / k0 + (1.0 - std::exp(-t / Ta)) / ka + (1.0 - std::exp(-t / Tb)) / kb);
  }
  write_file(folder / "j.csv", text);
  const Selection s = select_law(read_function(folder / "j.csv"), quick());
  const FitResult& fit = chosen(s);
  CHECK(law_name(fit.config.law.value()) == "linear-2");
  const KelvinChain chain = to_series({estimate_of(fit, "k_inf"),
                                       {estimate_of(fit, "k1"), estimate_of(fit, "k2")},
                                       {estimate_of(fit, "tau1"), estimate_of(fit, "tau2")}});
  CHECK_THAT(chain.k0, WithinRel(k0, 1e-6));
  CHECK_THAT(chain.k.front(), WithinRel(ka, 1e-6));
  CHECK_THAT(chain.T_s.front(), WithinRel(Ta, 1e-6));
  CHECK_THAT(chain.k.back(), WithinRel(kb, 1e-6));
  CHECK_THAT(chain.T_s.back(), WithinRel(Tb, 1e-6));
}

TEST_CASE("A relaxation modulus that falls by more decades than an instrument reads is fitted") {
  const test::TempFolder folder;
  std::string text = "time [s],G(t) [Pa]\n";
  for (const double t : decades_of(1e-4, 100.0, 121)) {
    text += fmt::format("{:.9g},{:.9g}\n", t, std::exp(-t));
  }
  write_file(folder / "g.csv", text);
  const Selection s = select_law(read_function(folder / "g.csv"), quick());
  CHECK(law_name(chosen(s).config.law.value()) == "linear-1-fluid");
  CHECK_THAT(estimate_of(chosen(s), "k1"), WithinRel(1.0, 1e-6));
  CHECK_THAT(estimate_of(chosen(s), "tau1"), WithinRel(1.0, 1e-6));
  REQUIRE_FALSE(s.remarks.empty());
  CHECK(s.remarks.front().code == "scatter_of_small_readings_assumed");
  CHECK(s.remarks.front().text.find("43 decades") != std::string::npos);
  // The written configuration says the same.
  const FitResult again =
      fit_and_judge({parse_fit_config(config_json(chosen(s).config), "config.json"), {}});
  CHECK_THAT(estimate_of(again, "tau1"), WithinRel(1.0, 1e-6));
  REQUIRE_FALSE(again.remarks.empty());
  CHECK(again.remarks.front() == s.remarks.front());
}

TEST_CASE("A master curve that no law of the family describes names the Prony series that may") {
  const test::TempFolder folder;
  std::string text = "time [s],E(t) [MPa]\n";
  for (const double t : decades_of(1e-6, 1e3, 73)) {
    double e = 5.0, tau = 1e-5;
    for (const double k : {300.0, 250.0, 200.0, 120.0, 60.0, 30.0, 12.0, 6.0, 2.0}) {
      e += k * std::exp(-t / tau);
      tau *= 10.0;
    }
    text += fmt::format("{:.17g},{:.17g}\n", t, e);
  }
  write_file(folder / "e.csv", text);
  const MaterialFunction function = read_function(folder / "e.csv");
  SelectionOptions options = quick();
  options.setup.profiles = false;
  const auto named = [&] {
    const Selection s = select_law(function, options);
    const auto remark = std::ranges::find(s.remarks, "prony_series", &Remark::code);
    return remark == s.remarks.end() ? std::string() : remark->text;
  };
  CHECK_THAT(named(), Contains("--times \"1e-06 s : 1e+03 s : 19\""));
  // A law that was asked for is not argued with.
  options.laws = {parse_law_name("linear-1", "test")};
  options.only_listed = true;
  CHECK(named().empty());
}

TEST_CASE("A fluid in a solvent is not told to be a Prony series") {
  // A branch beside a dashpot: the law of two branches is named, whose times are no series.
  const test::TempFolder folder;
  std::string text = "omega [rad/s],G' [Pa],G'' [Pa]\n";
  for (const double omega : decades_of(0.1, 300.0, 22)) {
    const double x = 0.5 * omega, g = 300.0 * x / (1.0 + x * x);
    text += fmt::format("{:.17g},{:.17g},{:.17g}\n", omega, g * x, g + 0.4 * omega);
  }
  write_file(folder / "g.csv", text);
  SelectionOptions options = quick();
  options.setup.profiles = false;
  const Selection s = select_law(read_function(folder / "g.csv"), options);
  REQUIRE(s.preferred);
  CHECK(law_name(s.candidates[*s.preferred].law) == "linear-2-fluid");
  CHECK(std::ranges::find(s.remarks, "prony_series", &Remark::code) == s.remarks.end());
}

TEST_CASE("A relaxation modulus that falls by a power of time is fitted by a spring-pot") {
  constexpr double kSize = 500.0, kOrder = 0.3;
  const test::TempFolder folder;
  std::string text = "time [s],G(t) [Pa]\n";
  for (const double t : decades_of(0.01, 100.0, 41)) {
    text += fmt::format("{:.17g},{:.17g}\n", t,
                        kSize * std::pow(t, -kOrder) / std::tgamma(1.0 - kOrder));
  }
  write_file(folder / "g.csv", text);
  const Selection s = select_law(read_function(folder / "g.csv"), quick());
  CHECK(law_name(chosen(s).config.law.value()) == "linear-fspringpot");
  CHECK_THAT(estimate_of(chosen(s), "k1"), WithinRel(kSize, 1e-6));
  CHECK_THAT(estimate_of(chosen(s), "alpha"), WithinRel(kOrder, 1e-6));
  for (const Candidate& c : s.candidates) {
    INFO(law_name(c.law) << ": " << c.reason);
    CHECK_FALSE(c.failed);
  }
}

TEST_CASE("A spectrum of a few readings does not get as many parameters") {
  const test::TempFolder folder;
  // Near a spring-pot beside a spring, written to two or three digits.
  write_file(folder / "s.txt",
             "Frequency\tG'\tG\"\nHz\tPa\tPa\n0.1\t120\t15\n0.3\t130\t17\n1\t145\t22\n3\t160\t31\n"
             "10\t190\t45\n30\t220\t60\n");
  const Selection s = select_law(read_function(folder / "s.txt"), quick());
  CHECK(s.samples == 12);
  CHECK(chosen(s).parameters.size() <= 5);
  CHECK(s.candidates[s.recommended].rms_over_peak < 0.01);
  // Exact readings of a branch are no fewer than it takes.
  write_file(folder / "J.csv",
             "time [s],J [1/Pa]\n0.1,0.000506600\n1,0.000560423\n5,0.000710707\n20,0.000827228\n"
             "50,0.000833318\n");
  CHECK(law_name(chosen(select_law(read_function(folder / "J.csv"), quick())).config.law.value()) ==
        "linear-1");
}

TEST_CASE("A spectrum is fitted from magnitude and phase over an angular frequency") {
  const test::TempFolder folder;
  std::string text = "omega [1/s],|G*| [Pa],delta [deg]\n";
  for (const double f : decades_of(0.01, 100.0, 31)) {
    const double w = 2.0 * std::numbers::pi * f;
    double storage = kLasting, loss = 0.0;
    for (const auto& [stiffness, tau] : {std::pair{kFirst, kTau1}, {kSecond, kTau2}}) {
      const double x = w * tau;
      storage += stiffness * x * x / (1.0 + x * x);
      loss += stiffness * x / (1.0 + x * x);
    }
    text += fmt::format("{:.17g},{:.17g},{:.17g}\n", w, std::hypot(storage, loss),
                        std::atan2(loss, storage) * 180.0 / std::numbers::pi);
  }
  write_file(folder / "s.csv", text);
  const MaterialFunction function = read_function(folder / "s.csv");
  CHECK(function.kind() == "spectrum");
  const Selection s = select_law(function, quick());
  CHECK(law_name(chosen(s).config.law.value()) == "linear-2");
  check_two_branches(chosen(s));
  const FitResult rerun = run_fit(parse_fit_config(config_json(chosen(s).config), "config.json"));
  check_two_branches(rerun);
}

TEST_CASE("Small readings that scatter by more than their share do not rule a fit") {
  const test::TempFolder folder;
  std::string text = "time [s],G(t) [Pa]\n";
  base::Random random(7);
  for (const double t : decades_of(0.01, 25.0, 90)) {
    const double g = 3200.0 * std::exp(-t / 1.5) + 700.0 * std::exp(-t / 9.0);
    const double read = g * (1.0 + 0.01 * random.normal()) + 4.0 * random.normal();
    text += fmt::format("{:.6g},{:.6g}\n", t, read);
  }
  write_file(folder / "g.csv", text);
  const Selection s = select_law(read_function(folder / "g.csv"), quick());
  CHECK(chosen(s).config.data.front().noise.kind == NoiseKind::combined);
  CHECK(law_name(chosen(s).config.law.value()) == "linear-2-fluid");
  CHECK_FALSE((chosen(s).adequacy && chosen(s).adequacy->is_rejected()));
  const bool in_order = estimate_of(chosen(s), "tau1") < estimate_of(chosen(s), "tau2");
  CHECK_THAT(estimate_of(chosen(s), in_order ? "tau2" : "tau1"), WithinRel(9.0, 0.06));
}

namespace {

/// A relaxation modulus read with 1 % noise and 2 Pa of the instrument's.
/// @param seen what the instrument makes of it
template <typename Modulus, typename Seen>
Selection read_with_floor(const Modulus& modulus_at, const Seen& seen, double until_s = 200.0) {
  const test::TempFolder folder;
  std::string text = "t [s],G(t) [Pa]\n";
  base::Random random(5);
  for (const double t : decades_of(0.01, until_s, 90)) {
    const double g = modulus_at(t) * (1.0 + 0.01 * random.normal()) + 2.0 * random.normal();
    text += fmt::format("{:.6g},{:.6g}\n", t, seen(g));
  }
  write_file(folder / "g.csv", text);
  return select_law(read_function(folder / "g.csv"), quick());
}

double fluid_modulus(double t) {
  return 3200.0 * std::exp(-t / 1.5) + 700.0 * std::exp(-t / 9.0);
}

double solid_modulus(double t) {
  return 300.0 + 1500.0 * std::exp(-t / 2.0);
}

/// True if a lasting stiffness is claimed.
bool claims_plateau(const Selection& s) {
  return std::ranges::any_of(chosen(s).parameters, [](const ParameterResult& p) {
    return p.parameter.name == "k_inf" && p.verdict == Verdict::identified && !p.not_separable;
  });
}

}  // namespace

TEST_CASE("An instrument that reads no negative values makes no lasting stiffness") {
  // The readings of a fluid end at the size of the noise, never below 0.
  const Selection fluid = read_with_floor(fluid_modulus, [](double g) { return std::abs(g); });
  CHECK_FALSE(claims_plateau(fluid));
  // Nor does a curve that ends before a plateau is seen.
  const auto early = [](double t) { return fluid_modulus(t) + 3.0; };
  CHECK_FALSE(claims_plateau(read_with_floor(
      early, [](double g) { return g; }, 36.0)));
  // What stands high above the noise is a plateau.
  const Selection solid = read_with_floor(solid_modulus, [](double g) { return std::abs(g); });
  CHECK(claims_plateau(solid));
  CHECK_THAT(estimate_of(chosen(solid), "k_inf"), WithinRel(300.0, 0.02));
}

TEST_CASE("Readings that stand at the least value of an instrument are left out") {
  const Selection s = read_with_floor(fluid_modulus, [](double g) { return std::max(g, 4.0); });
  CHECK(std::ranges::any_of(s.remarks,
                            [](const Remark& r) { return r.code == "floor_of_instrument"; }));
  CHECK(std::isfinite(chosen(s).config.data.front().to_s));
  CHECK_FALSE(claims_plateau(s));
  const bool in_order = estimate_of(chosen(s), "tau1") < estimate_of(chosen(s), "tau2");
  CHECK_THAT(estimate_of(chosen(s), in_order ? "tau2" : "tau1"), WithinRel(9.0, 0.06));
  // A plateau of rounded readings is no floor.
  const Selection rounded = read_with_floor([](double t) { return solid_modulus(t); },
                                            [](double g) { return std::round(g / 10.0) * 10.0; });
  CHECK(std::ranges::none_of(rounded.remarks,
                             [](const Remark& r) { return r.code == "floor_of_instrument"; }));
}

TEST_CASE("A few readings little above a floor do not set the relaxation time") {
  constexpr int kRecordings = 12;
  int told = 0, missing = 0;
  for (std::uint64_t seed = 1; seed <= kRecordings; ++seed) {
    const test::TempFolder folder;
    std::string text = "t [s],G(t) [Pa]\n";
    base::Random random(seed);
    for (const double t : decades_of(0.01, 200.0, 40)) {
      const double g = 5000.0 * std::exp(-t / 3.0) * (1.0 + 0.01 * random.normal());
      text += fmt::format("{:.6g},{:.6g}\n", t, std::max(g + random.normal(), 2.0));
    }
    write_file(folder / "g.csv", text);
    SelectionOptions options = quick();
    options.setup.profiles = true;
    const Selection s = select_law(read_function(folder / "g.csv"), options);
    if (std::ranges::none_of(s.remarks,
                             [](const Remark& r) { return r.code == "floor_of_instrument"; }))
      continue;
    for (const ParameterResult& p : chosen(s).parameters) {
      const double truth = p.parameter.name == "k1" ? 5000.0 : p.parameter.name == "tau1" ? 3.0 : 0;
      if (truth == 0.0 || p.verdict != Verdict::identified || p.only_if_described) continue;
      ++told;
      missing += truth < *p.lower || truth > *p.upper;
    }
  }
  CHECK(told >= 16);
  CHECK(missing <= 3);
}

TEST_CASE("A sweep with the inertia of the instrument is not described by a law of tissue") {
  const test::TempFolder folder;
  const auto sweep = [&](double inertia) {
    std::string text = "Frequency [Hz],G' [Pa],G\" [Pa]\n";
    base::Random random(3);
    for (const double f : decades_of(0.01, 60.0, 39)) {
      const double w = 2.0 * std::numbers::pi * f;
      double storage = 500.0 - inertia * w * w, loss = 0.0;
      for (const auto& [stiffness, tau] : {std::pair{300.0, 1.0}, {200.0, 0.05}}) {
        const double x = w * tau;
        storage += stiffness * x * x / (1.0 + x * x);
        loss += stiffness * x / (1.0 + x * x);
      }
      text += fmt::format("{:.6g},{:.6g},{:.6g}\n", f, storage * (1.0 + 0.005 * random.normal()),
                          loss * (1.0 + 0.005 * random.normal()));
    }
    const std::string name = inertia > 0.0 ? "inert.csv" : "healthy.csv";
    write_file(folder / name, text);
    return select_law(read_function(folder / name), quick());
  };
  const Selection healthy = sweep(0.0);
  CHECK_FALSE((chosen(healthy).adequacy && chosen(healthy).adequacy->is_rejected()));
  const Selection inert = sweep(2e-3);
  REQUIRE(chosen(inert).adequacy);
  CHECK(chosen(inert).adequacy->is_rejected());
  CHECK_THAT(chosen(inert).adequacy->summary, Contains("the residuals follow each other"));
  for (const ParameterResult& p : chosen(inert).parameters) CHECK(p.only_if_described);
}

TEST_CASE(
    "A recording with a drive is no material function, and curved kernels are refused for one") {
  const test::TempFolder folder;
  write_file(folder / "r.csv", "time [s],depth [mm],force [N]\n0,0,0\n1,1,1\n2,1,0.5\n");
  CHECK_FALSE(find_material_function(folder / "r.csv", {}));
  write_file(folder / "g.csv", "time [s],G(t) [Pa]\n1,3\n2,2\n3,1\n");
  const MaterialFunction function = read_function(folder / "g.csv");
  CHECK_THAT(test::refusal_of([&] {
               static_cast<void>(function_config(parse_law_name("hertz-1", "test"), function, {}));
             }),
             Contains("a law with a linear kernel"));
  write_file(folder / "before.csv", "time [s],G(t) [Pa]\n-1,3\n2,2\n3,1\n");
  CHECK_THAT(test::refusal_of([&] {
               static_cast<void>(select_law(read_function(folder / "before.csv"), quick()));
             }),
             Contains("times before the step"));
}

}  // namespace
}  // namespace tpm::fit
