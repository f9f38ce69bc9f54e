// The organ as a model of experiments: against the closed form of the star, and against an organ
// built at another spacing.
#include <catch2/catch.hpp>
#include <cmath>

#include "expected_values.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/likelihood/config.hpp"
#include "tpm/organ/scene/organ_model.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::WithinRel;

namespace {

std::shared_ptr<const Tissue> tissue_of(const char* scene) {
  return std::make_shared<Tissue>(parse_tissue(parse_json(scene, "scene"), "scene", {}));
}

TpmVector some_parameters(double spacing_m) {
  TpmParameters p;
  p.E1_Pa = 9e3;
  p.E2_Pa = 14e3;
  p.Eprime_Pa = 11e3;
  p.eta1_Pa_s = 2e4;
  p.spacing_m = spacing_m;
  p.A0_m2 = 11e-6;
  p.l0_m = 1.3e-3;
  return to_vector(p);
}

/// Values to the accuracy of the runs, and derivatives by relative changes of the parameters, in
/// parts of the largest response.
void check_equal(const Response& a, const Response& b, const TpmVector& parameters,
                 double accuracy) {
  const double scale = a.value.cwiseAbs().maxCoeff();
  CHECK((a.value - b.value).cwiseAbs().maxCoeff() < accuracy * scale);
  for (int i = 0; i < kTpmParameterCount; ++i) {
    CAPTURE(i);
    const double size = parameters[static_cast<std::size_t>(i)];
    const double off = (a.sensitivity.col(i) - b.sensitivity.col(i)).cwiseAbs().maxCoeff();
    CHECK(size * off < 2e-5 * scale);
  }
}

Protocol load_history(double peak_N) {
  return {Drive::force, {{0.0, 0.1 * peak_N}, {3.0, peak_N}, {10.0, peak_N}}, "load"};
}

}  // namespace

TEST_CASE("the star of a scene answers as the closed form, derivatives included") {
  const OrganModel organ(tissue_of(R"({"organ": {"kind": "star", "spacing": "30 mm"}})"));
  const auto closed = make_model("closed_form");
  const auto cvodes = make_model("cvodes");
  const std::vector<double> times{0.5, 2.0, 4.0, 9.5};
  for (const double spacing : {0.020, 0.030, 0.070}) {
    const TpmVector p = some_parameters(spacing);
    const auto check = [&](const Model& exact, const Protocol& protocol) {
      CAPTURE(spacing, protocol.name());
      check_equal(exact.respond(protocol, times, p, Want::values_and_sensitivity),
                  organ.respond(protocol, times, p, Want::values_and_sensitivity), p, 2e-6);
    };
    check(*closed, ramp_and_hold(8e-3, 4e-3, 8.0));
    check(*closed, creep(0.5, 10.0));
    check(*cvodes, load_history(0.6));
  }
}

TEST_CASE("an organ scaled by its spacing answers as one built at that spacing", "[heavy]") {
  const auto scene = [](const char* spacing, const char* law) {
    return tissue_of((std::string(R"({"organ": {"kind": "liver", "count": 60, "spacing": ")") +
                      spacing + R"("}, "bonds": {"spacing_law": ")" + law + R"("}})")
                         .c_str());
  };
  const TpmVector p = some_parameters(0.031);
  const std::vector<double> times{1.0, 2.0, 3.0, 9.0};
  for (const char* law : {"paper", "continuum"}) {
    const OrganModel scaled(scene("20 mm", law));
    const OrganModel built(scene("31 mm", law));
    for (const Protocol& protocol : {ramp_and_hold(6e-3, 3e-3, 8.0), load_history(0.2)}) {
      CAPTURE(law, protocol.name());
      const Response a = scaled.respond(protocol, times, p, Want::values_and_sensitivity);
      const Response b = built.respond(protocol, times, p, Want::values_and_sensitivity);
      // The spheres of the two organs lie alike to a few parts in a million.
      check_equal(a, b, p, 1e-5);
    }
  }
}

TEST_CASE("derivatives along tied changes are those of each, added") {
  const OrganModel organ(
      tissue_of(R"({"organ": {"kind": "liver", "count": 60, "spacing": "20 mm"}})"));
  TpmVector p = some_parameters(0.025);
  p[kE1] = p[kE2] = p[kEprime];
  Eigen::MatrixXd along = Eigen::MatrixXd::Zero(kTpmParameterCount, 2);
  along.col(0).head(3).setOnes();
  along(kEta1, 1) = 1.0;
  const std::vector<double> times{1.0, 2.0, 9.0};
  const Protocol protocol = ramp_and_hold(6e-3, 3e-3, 8.0);
  const RowMatrix each =
      organ.respond(protocol, times, p, Want::values_and_sensitivity).sensitivity;
  const RowMatrix tied = organ.respond_along(protocol, times, p, along).sensitivity;
  for (int c = 0; c < 2; ++c) {
    const Eigen::VectorXd expected = each * along.col(c);
    CHECK((tied.col(c) - expected).norm() < 1e-5 * expected.norm());
  }
}

namespace {

/// A few observations of a decay with a bend, and what a surrogate takes them for.
class BentDecay final : public ResidualFunction {
 public:
  BentDecay(double bend, const ResidualFunction* surrogate) : bend_(bend), surrogate_(surrogate) {}
  [[nodiscard]] Eigen::Index residual_count() const override { return 12; }
  [[nodiscard]] bool evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                              RowMatrix* jacobian) const override {
    ++asked;
    residual.resize(12);
    if (jacobian != nullptr) jacobian->resize(12, 2);
    for (Eigen::Index i = 0; i < 12; ++i) {
      const double t = 0.3 * static_cast<double>(i);
      const double decay = std::exp(-t / natural[1]);
      const double seen = 2.0 * std::exp(-t / 0.8) + 0.4 * std::sin(5.0 * t);
      residual[i] = 3.0 * (natural[0] * decay * (1.0 + bend_ * decay) - seen);
      if (jacobian == nullptr) continue;
      (*jacobian)(i, 0) = 3.0 * decay * (1.0 + bend_ * decay);
      (*jacobian)(i, 1) =
          3.0 * natural[0] * (1.0 + 2.0 * bend_ * decay) * decay * t / (natural[1] * natural[1]);
    }
    return true;
  }
  [[nodiscard]] const ResidualFunction* surrogate() const override { return surrogate_; }

  mutable int asked = 0;

 private:
  double bend_;
  const ResidualFunction* surrogate_;
};

}  // namespace

TEST_CASE("a search with a surrogate ends where one without does, and asks less") {
  const std::vector<FitParameter> parameters{{"a", {}, Scale::log, 1.0, 1e-3, 1e3},
                                             {"tau", {}, Scale::log, 1.0, 1e-3, 1e3}};
  const BentDecay plain(0.5, nullptr);
  const BentDecay cheap(0.0, nullptr);
  const BentDecay costly(0.5, &cheap);
  for (const std::vector<double>& start :
       {std::vector<double>{1.0, 1.0}, std::vector<double>{20.0, 0.05}}) {
    const Minimum reference = minimise(plain, parameters, start);
    costly.asked = 0;
    const Minimum found = minimise(costly, parameters, start);
    REQUIRE(found.converged);
    CHECK_THAT(found.deviance, WithinRel(reference.deviance, 1e-6));
    CHECK_THAT(found.natural[0], WithinRel(reference.natural[0], 1e-3));
    CHECK_THAT(found.natural[1], WithinRel(reference.natural[1], 1e-3));
    CHECK(costly.asked < test::allowed_cost("fit.search_with_surrogate"));
  }
  const Minimum held = minimise(costly, parameters, std::vector<double>{1.0, 3.0}, {false, true});
  CHECK(held.natural[1] == 3.0);
  CHECK_THAT(
      held.natural[0],
      WithinRel(
          minimise(plain, parameters, std::vector<double>{1.0, 3.0}, {false, true}).natural[0],
          1e-3));
}

TEST_CASE("a fit with an organ needs its scene, and one that stands", "[heavy]") {
  const auto config = [](const std::string& extra) {
    return parse_json(R"({"title": "t", )" + extra + R"(,
      "parameters": {"E": {"start": "12 kPa", "lower": "1 kPa", "upper": "90 kPa", "sets": ["E1", "E2", "Eprime"]}},
      "data": [{"dataset": "evren_relaxation", "protocol": {"kind": "step_hold"},
                "noise": {"kind": "relative_to_datum", "relative": 0.1}}]})",
                      "f.json");
  };
  const auto parse = [&](const std::string& extra) {
    return parse_fit_config(config(extra), "f.json",
                            std::filesystem::path(TPM_TEST_SOURCE_DIR) / "configs");
  };
  CHECK_THROWS_WITH(parse(R"("model": "organ")"), Catch::Contains("f.json: key /scene: missing"));
  CHECK_THROWS_WITH(parse(R"("scene": "liver_scene.json")"), Catch::Contains("without the model"));
  CHECK_THROWS_WITH(
      parse(R"("model": "organ", "scene": "liver_scene.json", "tension": "frozen_at_peak")"),
      Catch::Contains("tension"));
  CHECK_THROWS_WITH(parse(R"("model": "organ", "scene": "nowhere.json")"),
                    Catch::Contains("nowhere.json: no such file"));
  CHECK_THROWS_WITH(make_model(parse(R"("model": "organ", "scene": "liver_poke.json")")),
                    Catch::Contains("contacts"));
  const FitConfig good = parse(R"("model": "organ", "scene": "liver_scene.json")");
  CHECK(make_model(good)->name() == "organ");
}

TEST_CASE("equilibria are found where the potential falls by less than its rounding") {
  TpmParameters p;
  p.E1_Pa = p.E2_Pa = p.Eprime_Pa = 12621.3;
  p.eta1_Pa_s = 301690.0;
  p.spacing_m = 0.0747083;
  const OrganModel model(
      std::make_shared<Tissue>(read_tissue(share_dir() / "configs" / "liver_scene.json")));
  const TpmVector values = to_vector(p);
  const std::array<double, 1> end{std::numeric_limits<double>::infinity()};
  for (int i = 0; i < 80; ++i) {
    const double depth_m = 0.1e-3 + 3e-6 * i;
    CAPTURE(depth_m);
    CHECK_NOTHROW(model.respond(step_and_hold(depth_m, end[0]), end, values, Want::values));
  }
}
