// Ting's solution for a Hertz contact that shrinks, against closed forms, quadrature and a
// foundation of one-sided viscoelastic springs.
#include <algorithm>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <catch2/catch.hpp>
#include <cmath>

#include "expected_values.hpp"
#include "law_answers.hpp"
#include "refusal.hpp"
#include "support/remarks.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/show/recording_report.hpp"
#include "tpm/law/contact_retreat.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::evenly;

namespace {

constexpr double kReference = 1e-3;

/// Two branches, with the kernel's reference at 1 mm.
struct TwoBranches {
  double k_inf = 20.0, k1 = 30.0, k2 = 12.0, tau1 = 0.08, tau2 = 4.0;

  [[nodiscard]] double relaxation(double t) const {
    return k_inf + k1 * std::exp(-t / tau1) + k2 * std::exp(-t / tau2);
  }
  [[nodiscard]] std::vector<double> values(double contact = 0.0, double offset = 0.0) const {
    return {k_inf, k1, k2, tau1, tau2, contact, offset};
  }
};

double kernel_slope(double u) {
  return 1.5 * std::sqrt(u / kReference);
}

/// Down, held, up again.
struct Trapezoid {
  double depth = 3e-3, down_s = 0.5, hold_s = 1.5, up_s = 0.8;

  [[nodiscard]] double turn_s() const { return down_s + hold_s; }
  [[nodiscard]] double end_s() const { return turn_s() + up_s; }
  [[nodiscard]] Protocol protocol() const {
    return {Drive::displacement, {{0.0, 0.0}, {down_s, depth}, {turn_s(), depth}, {end_s(), 0.0}}};
  }
  [[nodiscard]] double at(double t) const {
    if (t < down_s) return depth * t / down_s;
    return t < turn_s() ? depth : depth * std::max(end_s() - t, 0.0) / up_s;
  }
};

template <class F>
double integral(const F& f, double from, double to) {
  double sum = 0.0;
  for (int part = 0; part < 40; ++part) {
    sum += boost::math::quadrature::gauss_kronrod<double, 31>::integrate(
        f, from + (to - from) * part / 40.0, from + (to - from) * (part + 1) / 40.0, 0);
  }
  return sum;
}

/// Ting's two integrals by quadrature, t1 by bisection; t after the turn, t1 within the ramp.
double ting_by_quadrature(const TwoBranches& law, const Trapezoid& path, double t) {
  const auto g = [&](double s) { return law.relaxation(t - s); };
  const double pulled = integral(g, path.turn_s(), t) * path.depth / path.up_s;
  double low = 0.0;
  double high = path.down_s;
  if (integral(g, low, path.down_s) * path.depth / path.down_s < pulled) return 0.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    const double pushed = integral(g, middle, path.down_s) * path.depth / path.down_s;
    (pushed > pulled ? low : high) = middle;
  }
  const double rate = path.depth / path.down_s;
  // s = x^2: the slope of the kernel is a root at the beginning
  return integral([&](double x) { return 2.0 * x * g(x * x) * kernel_slope(rate * x * x) * rate; },
                  0.0, std::sqrt(low));
}

/// The force of n one-sided springs, each with the law's relaxation, that the rising profile of the
/// probe meets one after the other (method of dimensionality reduction, Popov and Hess 2015).
/// Springs that carry nothing recover freely and may be met again.
double foundation_force(const TwoBranches& law, const Trapezoid& path, double t, int springs) {
  const int steps = 8 * springs;
  double force = 0.0;
  for (int i = 0; i < springs; ++i) {
    const double gap = path.depth * (i + 0.5) / springs;
    const double width =
        std::sqrt((i + 1.0) / springs) - std::sqrt(static_cast<double>(i) / springs);
    double x = 0.0;  // depth of the end of the spring, and of its two branches' dashpots
    double w1 = 0.0;
    double w2 = 0.0;
    double load = 0.0;
    const double h = t / steps;
    for (int k = 1; k <= steps; ++k) {
      const double r1 = std::exp(-h / law.tau1);
      const double r2 = std::exp(-h / law.tau2);
      const double b1 = 1.0 - law.tau1 / h * (1.0 - r1);
      const double b2 = 1.0 - law.tau2 / h * (1.0 - r2);
      const double c1 = 1.0 - r1 - b1;
      const double c2 = 1.0 - r2 - b2;
      const double past = law.k1 * (r1 * w1 + c1 * x) + law.k2 * (r2 * w2 + c2 * x);
      const double stiff = law.k_inf + law.k1 * (1.0 - b1) + law.k2 * (1.0 - b2);
      const double free = past / stiff;  // depth without load
      const double next = std::max(path.at(k * h) - gap, free);
      load = stiff * next - past;
      w1 = r1 * w1 + c1 * x + b1 * next;
      w2 = r2 * w2 + c2 * x + b2 * next;
      x = next;
    }
    // F = integral of the loads over dV'(gap), V' = 1.5 sqrt(gap/reference)
    force += load * 1.5 * std::sqrt(path.depth / kReference) * width;
  }
  return force;
}

}  // namespace

TEST_CASE("a Hertz contact that shrinks follows Ting's integrals", "[retreat]") {
  const TwoBranches branches;
  const Trapezoid path;
  const LawModel law(parse_law_name("hertz-2", "test"));
  const std::vector<double> times{2.001, 2.02, 2.1, 2.2, 2.3, 2.5, 2.7, 2.8};
  const Response r = law.respond(path.protocol(), times, branches.values(), Want::values);
  const double peak = law.respond(path.protocol(), std::vector<double>{path.down_s},
                                  branches.values(), Want::values)
                          .value[0];
  for (std::size_t i = 0; i < times.size(); ++i) {
    INFO("at " << times[i] << " s");
    CHECK_THAT(r.value[static_cast<Eigen::Index>(i)],
               WithinAbs(ting_by_quadrature(branches, path, times[i]), 1e-9 * peak));
  }
  CHECK(r.value[4] > 0.0);
  CHECK(r.value[7] == 0.0);  // the probe has left the crater before it is back at its start
}

TEST_CASE("a foundation of one-sided springs converges to it", "[retreat]") {
  const TwoBranches branches;
  const Trapezoid path;
  const LawModel law(parse_law_name("hertz-2", "test"));
  for (const double t : {1.2, 2.1, 2.3}) {
    const double exact =
        law.respond(path.protocol(), std::vector<double>{t}, branches.values(), Want::values)
            .value[0];
    const double coarse = std::abs(foundation_force(branches, path, t, 50) - exact);
    const double fine = std::abs(foundation_force(branches, path, t, 400) - exact);
    INFO("at " << t << " s: " << coarse << ", " << fine << " of " << exact);
    CHECK(fine < test::allowed_error("retreat.foundation_of_400") * exact);
    CHECK(std::log2(coarse / fine) / 3.0 > 0.9);
  }
}

TEST_CASE("the edge of a Maxwell contact under a triangle is known in closed form", "[retreat]") {
  // exp(-(t - t1)/tau) = 2 exp(-(t - t_max)/tau) - 1
  const double k = 50.0;
  const double tau = 0.7;
  const double rate = 2e-3;
  const double turn = 1.0;
  const LawModel law(parse_law_name("hertz-1-fluid", "test"));
  const Protocol triangle(Drive::displacement, {{0.0, 0.0}, {turn, rate * turn}, {2.0, 0.0}});
  const std::vector<double> values{k, tau, 0.0, 0.0};
  const double lost = tau * std::log(2.0 * std::exp(turn / tau) - 1.0);
  const std::vector<double> times{1.0, 1.05, 1.2, 1.3, lost - 1e-6, lost + 1e-6, 2.0};
  const Response r = law.respond(triangle, times, values, Want::values);
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double t = times[i];
    const double inside = 2.0 * std::exp(-(t - turn) / tau) - 1.0;
    const double met = t < lost ? t + tau * std::log(inside) : 0.0;
    const double expected = integral(
        [&](double x) {
          return 2.0 * x * k * std::exp(-(t - x * x) / tau) * kernel_slope(rate * x * x) * rate;
        },
        0.0, std::sqrt(met));
    INFO("at " << t << " s");
    CHECK_THAT(r.value[static_cast<Eigen::Index>(i)], WithinAbs(expected, 1e-11));
  }
  CHECK(r.value[4] > 0.0);
  CHECK(r.value[5] == 0.0);
}

TEST_CASE("without relaxation unloading is loading backwards", "[retreat]") {
  const Trapezoid path;
  const std::vector<double> up = evenly(path.turn_s(), path.end_s(), 40);
  TwoBranches elastic;
  elastic.k1 = elastic.k2 = 0.0;
  for (const char* name : {"hertz", "hertz-2"}) {
    const LawModel law(parse_law_name(name, "test"));
    const std::vector<double> values =
        law.spec().branches > 0 ? elastic.values() : std::vector<double>{elastic.k_inf, 0.0, 0.0};
    const Response r = law.respond(path.protocol(), up, values, Want::values);
    for (std::size_t i = 0; i < up.size(); ++i) {
      const double u = path.at(up[i]);
      CHECK_THAT(r.value[static_cast<Eigen::Index>(i)],
                 WithinAbs(20.0 * u * std::sqrt(u / kReference), 1e-12));
    }
  }
}

TEST_CASE("the force is continuous where the contact turns, and the turn is second order",
          "[retreat]") {
  const TwoBranches branches;
  const Trapezoid path;
  const LawModel law(parse_law_name("hertz-2", "test"));
  // Lee and Radok's integral over the retreat, from which Ting's parts with the square of the time.
  const auto apart = [&](double later) {
    const double t = path.turn_s() + later;
    const auto g = [&](double s) { return branches.relaxation(t - s); };
    const double rate = path.depth / path.down_s;
    const double radok =
        integral([&](double x) { return 2.0 * x * g(x * x) * kernel_slope(rate * x * x) * rate; },
                 0.0, std::sqrt(path.down_s)) -
        integral([&](double s) { return g(s) * kernel_slope(path.at(s)) * path.depth / path.up_s; },
                 path.turn_s(), t);
    const double ting =
        law.respond(path.protocol(), std::vector<double>{t}, branches.values(), Want::values)
            .value[0];
    return std::abs(radok - ting);
  };
  CHECK(apart(1e-5) < 1e-8);
  CHECK(std::log2(apart(8e-4) / apart(4e-4)) == Approx(2.0).margin(0.1));
}

TEST_CASE("sensitivities of a shrinking contact agree with differences", "[retreat]") {
  const Trapezoid path;
  Random random(5);
  for (const char* name : {"hertz-2", "hertz-1-fluid", "hertz-2-series"}) {
    const LawModel law(parse_law_name(name, "test"));
    std::vector<double> values;
    for (const LawParameter& p : law.law_parameters()) {
      values.push_back(p.dimension == Dimension::stiffness ? 20.0 + 20.0 * random.uniform()
                       : p.dimension == Dimension::time    ? 0.2 + 2.0 * random.uniform()
                       : p.name == "contact"               ? 2e-4
                                                           : 0.004);
    }
    for (const bool preloaded : {false, true}) {
      if (preloaded) values[law.index("contact")] = -5e-4;
      Protocol protocol = path.protocol();
      protocol.set_equilibrium_at_start(preloaded);
      const std::vector<double> times{1.0, 2.05, 2.2, 2.4, 2.75};
      const Response r = law.respond(protocol, times, values, Want::values_and_sensitivity);
      REQUIRE(r.value.allFinite());
      CHECK((r.value - law.respond(protocol, times, values, Want::values).value).norm() == 0.0);
      for (std::size_t j = 0; j < values.size(); ++j) {
        const double width = law.law_parameters()[j].name == "offset" ? 0.01 : std::abs(values[j]);
        const auto at = [&](double factor) {
          auto moved = values;
          moved[j] += factor * 1e-4 * width;
          return law.respond(protocol, times, moved, Want::values).value;
        };
        const Eigen::VectorXd difference =
            (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * 1e-4 * width);
        INFO(name << (preloaded ? ", preloaded, " : ", ") << law.law_parameters()[j].name);
        CHECK((r.sensitivity.col(static_cast<Eigen::Index>(j)) - difference).cwiseAbs().maxCoeff() <
              1e-6 * r.value.maxCoeff() / width);
      }
    }
  }
}

TEST_CASE("a contact that grows again is not predicted", "[retreat]") {
  const TwoBranches branches;
  const LawModel law(parse_law_name("hertz-2", "test"));
  const Protocol again(Drive::displacement,
                       {{0.0, 0.0}, {0.5, 3e-3}, {0.9, 2e-3}, {1.5, 3e-3}, {1.9, 0.0}});
  const std::vector<double> times{1.8, 0.2, 0.7, 0.9, 1.4};
  const Response r = law.respond(again, times, branches.values(), Want::values_and_sensitivity);
  CHECK(std::isfinite(r.value[1]));
  CHECK(std::isfinite(r.value[2]));
  CHECK(std::isfinite(r.value[3]));
  CHECK(r.sensitivity.row(3).allFinite());
  for (const Eigen::Index i : {0, 4}) {
    CHECK(std::isnan(r.value[i]));
    CHECK(std::isnan(r.sensitivity(i, 0)));
  }
  // A surface that recovers meets a probe that waits.
  const Protocol waits(Drive::displacement,
                       {{0.0, 0.0}, {0.5, 3e-3}, {2.0, 3e-3}, {2.3, 1e-3}, {20.0, 1e-3}});
  const Response later =
      law.respond(waits, std::vector<double>{2.25, 19.0}, branches.values(), Want::values);
  CHECK(std::isfinite(later.value[0]));
  CHECK(std::isnan(later.value[1]));
}

TEST_CASE("what Ting's solution does not cover is not predicted once the contact shrinks",
          "[retreat]") {
  const Trapezoid path;
  for (const char* name : {"hertz-1-elastic", "hertz-fzener", "hertz-1-relaxing"}) {
    const LawModel law(parse_law_name(name, "test"));
    std::vector<double> values;
    for (const LawParameter& p : law.law_parameters()) {
      values.push_back(p.nuisance ? 0.0 : p.dimension == Dimension::stiffness ? 20.0 : 0.5);
    }
    const Response r =
        law.respond(path.protocol(), std::vector<double>{1.9, 2.3}, values, Want::values);
    INFO(name);
    CHECK(std::isfinite(r.value[0]));
    CHECK(std::isnan(r.value[1]));
  }
  const LawModel law(parse_law_name("hertz-2", "test"));
  const Protocol load(Drive::force, {{0.0, 0.0}, {1.0, 0.1}, {2.0, 0.1}, {3.0, 0.0}});
  const Response depth =
      law.respond(load, std::vector<double>{1.9, 2.9}, TwoBranches{}.values(), Want::values);
  CHECK(std::isfinite(depth.value[0]));
  CHECK(std::isnan(depth.value[1]));
}

TEST_CASE("the jitter of a measured depth does not end the prediction", "[retreat]") {
  const TwoBranches branches;
  const Trapezoid path;
  const LawModel law(parse_law_name("hertz-2", "test"));
  Random random(3);
  std::vector<Knot> knots;
  std::vector<double> times;
  for (int i = 0; i <= 560; ++i) {
    const double t = std::min(0.005 * i, path.end_s());
    times.push_back(t);
    knots.push_back({t, path.at(t) + 2e-3 * path.depth * (random.uniform() - 0.5)});
  }
  Protocol measured(Drive::displacement, knots);
  measured.set_equilibrium_at_start(true);
  const Eigen::VectorXd noisy = law.respond(measured, times, branches.values(), Want::values).value;
  const Eigen::VectorXd clean =
      law.respond(path.protocol(), times, branches.values(), Want::values).value;
  REQUIRE(noisy.allFinite());
  CHECK((noisy - clean).cwiseAbs().maxCoeff() <
        test::allowed_error("retreat.noisy_path") * clean.maxCoeff());
}

TEST_CASE("a fit predicts the unloading of a Hertz contact, and says where it predicts nothing",
          "[retreat]") {
  const TwoBranches branches;
  const LawModel law(parse_law_name("hertz-2", "test"));
  // Down, held, up and, beyond the law, down again.
  const std::vector<Knot> corners{{0.0, -2e-4}, {1.0, 3e-3},   {8.0, 3e-3},
                                  {9.5, -2e-4}, {10.0, -2e-4}, {11.0, 3e-3}};
  Recording recording;
  std::size_t corner = 0;
  for (int i = 0; i <= 550; ++i) {
    const double t = std::min(0.02 * i, corners.back().time_s);
    while (corner + 2 < corners.size() && t > corners[corner + 1].time_s) ++corner;
    const Knot& a = corners[corner];
    const Knot& b = corners[corner + 1];
    recording.time_s.push_back(t);
    recording.drive.push_back(a.value +
                              (b.value - a.value) * (t - a.time_s) / (b.time_s - a.time_s));
  }
  Protocol once = measured_history(Drive::displacement, recording.time_s, recording.drive);
  once.set_equilibrium_at_start(true);
  const Response r = law.respond(once, recording.time_s, branches.values(), Want::values);
  Random random(9);
  const double sigma = 0.005 * r.value[50];
  std::size_t unknown = 0;
  for (const double f : r.value) {
    unknown += std::isfinite(f) ? 0 : 1;
    recording.response.push_back((std::isfinite(f) ? f : 0.1) + sigma * random.normal());
  }
  REQUIRE(unknown > 30);
  REQUIRE(unknown < 60);
  const std::vector<PreparedRecording> one{prepare_recording("cycle", recording)};
  SetupOptions setup;
  setup.profiles = false;
  const FitResult fit =
      run_fit(recording_config(parse_law_name("hertz-2", "test"), one, setup), data_sets(one));
  const RecordingFit& fitted = fit.recordings.front();
  CHECK(fitted.not_predicted > 30);
  REQUIRE(fitted.rms_outside);
  // The unloading is predicted to the noise.
  CHECK(*fitted.rms_outside < test::allowed_error("retreat.predicted_unloading") * sigma);
  CHECK(to_json(fit)["recordings"][0]["samples_not_predicted"] == fitted.not_predicted);
  CHECK(test::has_remark(fit.remarks, "not_predicted"));
  const auto outside = outside_remarks(fit);
  REQUIRE(outside.size() == 3);
  CHECK_THAT(outside[0].text,
             Catch::Contains("the prediction is off") && !Catch::Contains("describe"));
  CHECK(outside[1].code == "fitted_part");
  CHECK_THAT(outside[1].text, Catch::Contains("the fit ends where the drive first falls back") &&
                                  Catch::Contains("--until"));
  CHECK(outside[2].code == "not_predicted_after_fit");
  const Figure figure = recording_figure(fit, 0);
  CHECK_NOTHROW(to_json(std::vector<Figure>{figure}));
  const std::vector<Series>& drawn = figure.panels.front().series;
  const auto outside_law =
      std::ranges::find(drawn, "fitted law, outside the fitted window", &Series::label);
  REQUIRE(outside_law != drawn.end());
  CHECK(outside_law->x.back() < 11.0);
}

TEST_CASE("a fitted window that a Hertz law does not predict is named with what to do",
          "[retreat]") {
  // Ramp to 5 mm, back to 3 mm at 6 s, and from 8 s down again.
  Recording recording;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.05 * i;
    const double u = t < 6.0   ? std::min(5e-3, 5e-3 * t)
                     : t < 8.0 ? std::max(3e-3, 5e-3 - 4e-3 * (t - 6.0))
                               : 3e-3 + 1e-3 * (t - 8.0);
    recording.time_s.push_back(t);
    recording.drive.push_back(u);
    recording.response.push_back(40.0 * u * (1.0 + std::exp(-t)));
  }
  PreparedRecording whole = prepare_recording("cycle.csv", recording);
  whole.to_s = recording.time_s.back();
  SetupOptions setup;
  setup.profiles = false;
  const auto message_of = [&](const char* law) {
    const std::vector<PreparedRecording> one{whole};
    return test::refusal_of([&] {
      static_cast<void>(
          run_fit(recording_config(parse_law_name(law, "test"), one, setup), data_sets(one)));
    });
  };
  const std::string message = message_of("hertz-1");
  CHECK_THAT(message, Catch::StartsWith("cycle.csv: ") && Catch::Contains("of the 200 samples") &&
                          Catch::Contains("to 9.95 s, are not predicted by hertz-1") &&
                          Catch::Contains("\"to\" of the data set"));
  // The window that the message proposes is predicted.
  const std::string_view before = "a window that ends by ";
  REQUIRE(message.find(before) != std::string::npos);
  whole.to_s = std::stod(message.substr(message.find(before) + before.size()));
  CHECK(whole.to_s > 6.4);
  CHECK(message_of("hertz-1").empty());
  whole.to_s = recording.time_s.back();
  CHECK(message_of("power-1").empty());
}
