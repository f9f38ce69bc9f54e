// The element's closed forms: against the formulas of the paper, against high-precision
// arithmetic, against themselves on refined steps, and against CVODES.
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <catch2/catch.hpp>
#include <cmath>

#include "expected_values.hpp"
#include "tpm/base/random.hpp"
#include "tpm/law/relaxation/creep_exact.hpp"
#include "tpm/law/relaxation/relaxation_filter.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/model.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::law;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using Quad = boost::multiprecision::cpp_bin_float_100;

namespace {

TpmParameters distinct() {
  TpmParameters p;
  p.E1_Pa = 9e3;
  p.E2_Pa = 14e3;
  p.Eprime_Pa = 11e3;
  p.eta1_Pa_s = 6e4;
  p.spacing_m = 0.021;
  return p;
}

Response ask(const Model& model, const Protocol& protocol, const std::vector<double>& times,
             const TpmParameters& p, Want want = Want::values) {
  const TpmVector v = to_vector(p);
  return model.respond(protocol, times, v, want);
}

}  // namespace

TEST_CASE("update weights are correct to rounding from h/tau = 1e-12 to 1e12") {
  for (int step = 0; step <= 64; ++step) {
    const double z = std::pow(10.0, -12.0 + 0.375 * step);
    const Quad zq = z;
    const Quad r = exp(-zq);
    const Quad w1 = 1 - (1 - r) / zq;
    const Quad w0 = (1 - r) / zq - r;
    const RelaxationWeights k = relaxation_weights(z);
    CAPTURE(z);
    CHECK_THAT(k.w1, WithinRel(static_cast<double>(w1), 4e-16));
    CHECK_THAT(k.w0, WithinRel(static_cast<double>(w0), 8e-16));
    // derivatives with respect to ln tau, from d/dz of the formulas
    const Quad d_w1 = -zq * ((1 - r) / (zq * zq) - r / zq);
    const Quad d_w0 = -zq * (r / zq - (1 - r) / (zq * zq) + r);
    CHECK_THAT(k.d_w1, WithinRel(static_cast<double>(d_w1), 1e-15));
    CHECK_THAT(k.d_w0, WithinAbs(static_cast<double>(d_w0), 4e-16 * std::abs(k.w0) + 1e-300) ||
                           WithinRel(static_cast<double>(d_w0), 1e-13));
  }
  CHECK(relaxation_weights(0.0).r == 1.0);
  CHECK(relaxation_weights(0.0).w1 == 0.0);
  CHECK(relaxation_weights(INFINITY).w1 == 1.0);
  CHECK(relaxation_weights(INFINITY).d_r == 0.0);
}

TEST_CASE("step relaxation is Eq. 11 with its limits") {
  const TpmParameters p = distinct();
  const auto model = make_model("closed_form");
  const double d = 0.004;
  const double lambda1 = lambda1_Pa(p.Eprime_Pa, d, p.spacing_m);
  const std::vector<double> times{0.0, 0.01, 0.3, 2.0, 30.0, 3000.0};
  const Response r = ask(*model, step_and_hold(d, 3000.0), times, p);
  for (std::size_t i = 0; i < times.size(); ++i) {
    CHECK_THAT(r.value[static_cast<Eigen::Index>(i)],
               WithinRel(step_relaxation_force_N(p, lambda1, d, times[i]), 1e-14));
  }
  const double kappa = p.modulus_to_stiffness_m();
  CHECK_THAT(r.value[0], WithinRel((p.E2_Pa + lambda1) * d * kappa, 1e-15));
  CHECK_THAT(r.value[5], WithinRel((p.equilibrium_modulus_Pa() + lambda1) * d * kappa, 1e-14));
}

TEST_CASE("the paper's worked example: 0.613 N at 4 mm and x = 30 mm") {
  const TpmParameters paper;
  CHECK_THAT(lambda1_Pa(12e3, 0.004, 0.030), test::expected("paper.printed_lambda1_at_4_mm"));
  CHECK_THAT(step_relaxation_force_N(paper, 211.0, 0.004, 0.0),
             test::expected("paper.peak_force_at_4_mm"));
}

TEST_CASE("ramp and hold follows its closed form") {
  const auto model = make_model("closed_form");
  for (const double eta1 : {1.0, 5.0, 1e3, 6e4, 1e7}) {
    TpmParameters p = distinct();
    p.eta1_Pa_s = eta1;
    const double v = 0.002;
    const double d = 0.006;
    const double tr = d / v;
    const double tau = p.relaxation_time_s();
    const double a = p.E2_Pa / (p.E1_Pa + p.E2_Pa);
    const std::vector<double> times{0.5, 1.7, tr, tr + 0.1, tr + 30.0};
    const Response r = ask(*model, ramp_and_hold(d, v, 30.0), times, p);
    const double at_ramp_end = a * v * (tr + tau * std::expm1(-tr / tau));
    for (std::size_t i = 0; i < times.size(); ++i) {
      const double t = times[i];
      const double e = std::min(v * t, d);
      const double e1 = t <= tr ? a * v * (t + tau * std::expm1(-t / tau))
                                : a * d + (at_ramp_end - a * d) * std::exp(-(t - tr) / tau);
      const double force = (p.E2_Pa * (e - e1) + lambda1_Pa(p.Eprime_Pa, e, p.spacing_m) * e) *
                           p.modulus_to_stiffness_m();
      CAPTURE(eta1, t);
      CHECK_THAT(r.value[static_cast<Eigen::Index>(i)], WithinRel(force, 2e-11));
    }
  }
}

TEST_CASE("a measured history does not depend on how finely its straight pieces are sampled") {
  const TpmParameters p = distinct();
  const auto model = make_model("closed_form");
  const std::vector<double> coarse_t{0.0, 1.0, 1.5, 4.0, 9.0};
  const std::vector<double> coarse_e{0.0, 0.003, 0.002, 0.007, 0.001};
  std::vector<double> fine_t;
  std::vector<double> fine_e;
  const int parts = 1000;
  for (std::size_t i = 0; i + 1 < coarse_t.size(); ++i) {
    for (int j = 0; j < parts; ++j) {
      const double s = j / static_cast<double>(parts);
      fine_t.push_back(coarse_t[i] + s * (coarse_t[i + 1] - coarse_t[i]));
      fine_e.push_back(coarse_e[i] + s * (coarse_e[i + 1] - coarse_e[i]));
    }
  }
  fine_t.push_back(9.0);
  fine_e.push_back(0.001);
  const std::vector<double> times{0.4, 1.0, 1.2, 3.3, 6.0, 9.0};
  const Response a =
      ask(*model, measured_history(Drive::displacement, coarse_t, coarse_e), times, p);
  const Response b = ask(*model, measured_history(Drive::displacement, fine_t, fine_e), times, p);
  for (Eigen::Index i = 0; i < a.value.size(); ++i) {
    CHECK_THAT(b.value[i], WithinAbs(a.value[i], 1e-13 * a.value.cwiseAbs().maxCoeff()));
  }
}

TEST_CASE("creep with frozen lambda1 is Eq. 14 with its limits") {
  const TpmParameters p = distinct();
  const double lambda1 = 179.0;
  ModelOptions options;
  options.tension = TensionRule::frozen(lambda1);
  const auto model = make_model("closed_form", options);
  const std::vector<double> times{0.0, 0.7, 5.0, 300.0};
  const double load = 0.196;
  const Response r = ask(*model, creep(load, 300.0), times, p);
  // Eq. 14 as printed, in its own symbols
  const double P1 = p.eta1_Pa_s / (p.E1_Pa + p.E2_Pa);
  const double P2 = p.E1_Pa * p.E2_Pa / (p.E1_Pa + p.E2_Pa);
  const double P3 = P1 * p.E2_Pa;
  const double T = (P3 + lambda1 * P1) / (P2 + lambda1);
  const double s0 = load / p.modulus_to_stiffness_m();
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double e = s0 / (P3 + lambda1 * P1) *
                     (T * (1.0 - std::exp(-times[i] / T)) + P1 * std::exp(-times[i] / T));
    CHECK_THAT(r.value[static_cast<Eigen::Index>(i)], WithinRel(e, 1e-13));
    CHECK_THAT(creep_depth_m(p, lambda1, load, times[i]), WithinRel(e, 1e-13));
  }
  CHECK_THAT(creep_depth_m(p, lambda1, load, INFINITY), WithinRel(s0 / (P2 + lambda1), 1e-15));
  CHECK_THAT(creep_depth_m(p, lambda1, load, 0.0), WithinRel(s0 / (p.E2_Pa + lambda1), 1e-15));
}

TEST_CASE("creep with the true lambda1 ends where the springs balance the load") {
  TpmParameters paper;
  // Ends of creep (docs/theory.md): 10.59 mm at 0.98 N, 2.56 mm at 0.196 N
  CHECK_THAT(CreepUnderConstantLoad(paper, 0.98).depth_m(INFINITY),
             test::expected("paper.creep_end_at_0.98_N"));
  CHECK_THAT(CreepUnderConstantLoad(paper, 0.196).depth_m(INFINITY),
             test::expected("paper.creep_end_at_0.196_N"));
  const CreepUnderConstantLoad creep_(paper, 0.98);
  CHECK_THAT(creep_.depth_m(0.0), WithinRel(creep_.instantaneous_depth_m(), 1e-15));
  CHECK_THAT(creep_.depth_m(1e9), WithinRel(creep_.depth_m(INFINITY), 1e-15));
  CHECK_THAT(CreepUnderConstantLoad(paper, -0.98).depth_m(1e-4),
             WithinRel(-creep_.depth_m(1e-4), 1e-15));
}

TEST_CASE("closed form and CVODES agree to 1e-9 relative from 1 Pa s to 1e7 Pa s") {
  const auto exact = make_model("closed_form");
  ModelOptions tight;
  tight.relative_tolerance = 1e-12;
  const auto cvodes = make_model("cvodes", tight);
  std::vector<Protocol> protocols;
  protocols.push_back(ramp_and_hold(0.004, 0.004, 30.0));
  protocols.push_back(step_and_hold(0.008, 30.0));
  protocols.push_back(creep(0.98, 31.0));
  for (const double eta1 : {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7}) {
    TpmParameters p = distinct();
    p.eta1_Pa_s = eta1;
    const double tau = p.relaxation_time_s();
    for (const Protocol& protocol : protocols) {
      std::vector<double> times{0.3, 1.0, 2.5, 10.0, 30.0};
      if (tau < 1.0) times.insert(times.end(), {tau, 5.0 * tau});
      const Response a = ask(*exact, protocol, times, p, Want::values_and_sensitivity);
      const Response b = ask(*cvodes, protocol, times, p, Want::values_and_sensitivity);
      CAPTURE(eta1, protocol.name());
      for (Eigen::Index i = 0; i < a.value.size(); ++i) {
        CAPTURE(times[static_cast<std::size_t>(i)]);
        CHECK_THAT(b.value[i], WithinRel(a.value[i], 1e-9));
        for (int j = 0; j < kTpmParameterCount; ++j) {
          // in logarithmic parameters, relative to the response
          const double scale = to_vector(p)[static_cast<std::size_t>(j)] / a.value[i];
          CAPTURE(j);
          CHECK_THAT(b.sensitivity(i, j) * scale, WithinAbs(a.sensitivity(i, j) * scale, 1e-8));
        }
      }
    }
  }
}

TEST_CASE("closed form and CVODES agree on every tension rule and on jumps in the history") {
  ModelOptions options;
  options.relative_tolerance = 1e-12;
  const TpmParameters p = distinct();
  const Protocol jumps(Drive::displacement,
                       {{0.0, 0.001}, {1.0, 0.003}, {1.0, 0.006}, {4.0, 0.006}, {6.0, 0.0}});
  const Protocol loads(Drive::force, {{0.0, 0.1}, {1.0, 0.3}, {1.0, 0.6}, {4.0, 0.6}, {6.0, 0.0}});
  const std::vector<double> times{0.0, 0.5, 1.0, 2.0, 5.0, 6.0};
  for (const TensionRule rule : {TensionRule::exact(), TensionRule::frozen_at_peak(),
                                 TensionRule::frozen(300.0), TensionRule::frozen(0.0)}) {
    options.tension = rule;
    const auto exact = make_model("closed_form", options);
    const auto cvodes = make_model("cvodes", options);
    for (const Protocol* protocol : {&jumps, &loads}) {
      const bool force = protocol->drive() == Drive::force;
      if (force && rule.kind == TensionRule::Kind::frozen_at_peak) {
        CHECK_THROWS_AS(ask(*exact, *protocol, times, p), Error);
        CHECK_THROWS_AS(ask(*cvodes, *protocol, times, p), Error);
        continue;
      }
      if (force && rule.kind == TensionRule::Kind::exact) {
        CHECK_THROWS_WITH(ask(*exact, *protocol, times, p), Catch::Contains("no closed form"));
        continue;
      }
      const Response a = ask(*exact, *protocol, times, p, Want::values_and_sensitivity);
      const Response b = ask(*cvodes, *protocol, times, p, Want::values_and_sensitivity);
      for (Eigen::Index i = 0; i < a.value.size(); ++i) {
        const double peak = a.value.cwiseAbs().maxCoeff();
        CHECK_THAT(b.value[i], WithinAbs(a.value[i], 1e-9 * peak));
        for (int j = 0; j < kTpmParameterCount; ++j) {
          const double scale = to_vector(p)[static_cast<std::size_t>(j)] / peak;
          CAPTURE(j, i);
          CHECK_THAT(b.sensitivity(i, j) * scale, WithinAbs(a.sensitivity(i, j) * scale, 1e-8));
        }
      }
    }
  }
}

TEST_CASE("sensitivities equal central differences of the closed form") {
  const auto model = make_model("closed_form");
  const TpmParameters p = distinct();
  const std::vector<double> times{0.5, 2.0, 7.0, 32.0};
  std::vector<Protocol> protocols;
  protocols.push_back(ramp_and_hold(0.006, 0.003, 30.0));
  protocols.push_back(creep(0.5, 32.0));
  for (const Protocol& protocol : protocols) {
    const Response r = ask(*model, protocol, times, p, Want::values_and_sensitivity);
    for (std::size_t j = 0; j < kTpmParameterCount; ++j) {
      const double h = 1e-5;
      TpmVector up = to_vector(p);
      TpmVector down = up;
      up[j] *= 1.0 + h;
      down[j] *= 1.0 - h;
      const Response a = model->respond(protocol, times, up, Want::values);
      const Response b = model->respond(protocol, times, down, Want::values);
      for (Eigen::Index i = 0; i < r.value.size(); ++i) {
        const double difference = (a.value[i] - b.value[i]) / (2.0 * h * to_vector(p)[j]);
        const double scale = to_vector(p)[j] / r.value[i];
        CHECK_THAT(r.sensitivity(i, static_cast<Eigen::Index>(j)) * scale,
                   WithinAbs(difference * scale, 2e-9));
      }
    }
  }
}

TEST_CASE(
    "random elements: closed form and CVODES agree on ramps and on creep with the true lambda1") {
  // Moduli, dashpots, spacings, depths and loads over several decades, also E1 = 0.
  const auto exact = make_model("closed_form");
  ModelOptions tight;
  tight.relative_tolerance = 1e-11;
  const auto cvodes = make_model("cvodes", tight);
  Random random(2013);
  const auto decades = [&](double low, double high) {
    return low * std::pow(high / low, random.uniform());
  };
  for (int trial = 0; trial < 60; ++trial) {
    TpmParameters p;
    p.E1_Pa = trial % 10 == 0 ? 0.0 : decades(1e2, 1e6);
    p.E2_Pa = decades(1e2, 1e6);
    p.Eprime_Pa = decades(1e2, 1e6);
    p.eta1_Pa_s = decades(1e1, 1e7);
    p.spacing_m = decades(1e-3, 1.0);
    const Protocol ramp = ramp_and_hold(decades(1e-4, 1e-2), decades(1e-4, 1e-1), 30.0);
    const Protocol load = creep(decades(1e-3, 1.0), 30.0);
    CAPTURE(trial, p.E1_Pa, p.E2_Pa, p.Eprime_Pa, p.eta1_Pa_s, p.spacing_m);
    for (const Protocol* protocol : {&ramp, &load}) {
      const std::vector<double> times{0.01, 0.1, 1.0, 10.0, 30.0};
      const Response a = ask(*exact, *protocol, times, p);
      const Response b = ask(*cvodes, *protocol, times, p);
      for (Eigen::Index i = 0; i < a.value.size(); ++i) {
        CHECK_THAT(b.value[i], WithinAbs(a.value[i], 1e-8 * a.value.cwiseAbs().maxCoeff()));
      }
    }
  }
}

TEST_CASE("bad parameters and times are named") {
  const auto model = make_model("closed_form");
  TpmParameters p;
  p.E1_Pa = -1.0;
  CHECK_THROWS_WITH(ask(*model, creep(0.1, 1.0), {0.5}, p),
                    "model: E1 = -1 Pa; expected a finite value of at least 0");
  p = {};
  p.eta1_Pa_s = NAN;
  CHECK_THROWS_WITH(ask(*model, creep(0.1, 1.0), {0.5}, p), Catch::Contains("eta1 = nan Pa s"));
  CHECK_THROWS_WITH(ask(*model, creep(0.1, 1.0), {1.5}, TpmParameters{}),
                    "creep: asked for t = 1.5 s; expected a time from 0 to 1 s");
  CHECK_THROWS_WITH(make_model("magic"), Catch::Contains("closed_form, cvodes"));
}
