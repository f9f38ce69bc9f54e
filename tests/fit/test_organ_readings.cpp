// Bonds fitted to recordings, each with a contact and an offset of its own, and the short profile
// against the walk that tpm fit takes.
#include <catch2/catch.hpp>
#include <cmath>

#include "liver_of_60.hpp"
#include "refusal.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/predict/organ_profile.hpp"
#include "tpm/fit/predict/organ_readings.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;

FitParameter searched(const char* name, double start, Scale scale, double lower, double upper) {
  FitParameter p;
  p.name = name;
  p.scale = scale;
  p.start = start;
  p.lower = lower;
  p.upper = upper;
  return p;
}

/// y = a exp(-k t) + c with noise: a and k trade off, k and c even more.
class Decay final : public ResidualFunction {
 public:
  Decay() {
    Random random(11);
    for (int i = 0; i < 40; ++i) {
      t_.push_back(0.1 * i);
      y_.push_back(2.0 * std::exp(-0.4 * t_.back()) + 0.5 + 0.05 * random.normal());
    }
  }
  [[nodiscard]] Eigen::Index residual_count() const override { return std::ssize(t_); }
  [[nodiscard]] bool evaluate(std::span<const double> p, Eigen::VectorXd& residual,
                              RowMatrix* jacobian) const override {
    residual.resize(residual_count());
    if (jacobian != nullptr) jacobian->resize(residual_count(), 3);
    for (std::size_t i = 0; i < t_.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const double e = std::exp(-p[1] * t_[i]);
      residual[k] = p[0] * e + p[2] - y_[i];
      if (jacobian == nullptr) continue;
      (*jacobian)(k, 0) = e;
      (*jacobian)(k, 1) = -p[0] * t_[i] * e;
      (*jacobian)(k, 2) = 1.0;
    }
    return true;
  }

 private:
  std::vector<double> t_, y_;
};

/// A star whose bonds have one branch.
Json star_with_branch() {
  return Json::parse(R"({"organ": {"kind": "star"}, "bonds": {"lateral": "relaxing"},
    "material": {"Einf": "8 kPa", "Eprime": "14 kPa", "branches": [{"g": "6 kPa", "tau": "1.5 s"}]},
    "contacts": [{"kind": "sphere"}]})");
}

/// What a recording of that star is made of.
struct MadeReadings {
  double contact_m, offset_N, rate_m_per_s;
  std::uint64_t seed;
};

OrganReadings recorded(const OrganModel& model, const FittedBonds& bonds,
                       std::span<const double> true_values, const MadeReadings& made) {
  constexpr double kDeepest = 3e-3, kStep_s = 0.05, kEnd_s = 6.0, kNoise = 5e-3;
  const double ramp_s = kDeepest / made.rate_m_per_s;
  const Protocol drive(Drive::displacement, {{0.0, 0.0}, {ramp_s, kDeepest}, {kEnd_s, kDeepest}});
  OrganReadings r{drive, {}, {}, made.contact_m + 0.2e-3, 0.0};  // begins beside the true value
  for (int i = 0; i * kStep_s < kEnd_s; ++i) r.time_s.push_back(i * kStep_s);
  const Response response =
      model.respond(beyond_contact(drive, made.contact_m), r.time_s,
                    FittedBonds::values(model, bonds.material(true_values)), Want::values);
  Random random(made.seed);
  const double sd = kNoise * response.value.maxCoeff();
  for (const double f : response.value) {
    r.force_N.push_back(f + made.offset_N + sd * random.normal());
  }
  return r;
}

}  // namespace

TEST_CASE("a short profile ends where the full walk does") {
  const Decay function;
  const std::vector<FitParameter> parameters{searched("a", 1.0, Scale::log, 1e-2, 1e2),
                                             searched("k", 1.0, Scale::log, 1e-3, 1e2),
                                             searched("c", 0.0, Scale::linear, -5.0, 5.0)};
  Threshold threshold;
  threshold.scale_known = false;
  threshold.data_count = 40;
  const FitResult full = fit_residuals(function, parameters, {{1.0, 1.0, 0.0}}, threshold, true);
  threshold.parameter_count = 3;
  const double rise = threshold.rise(full.best.deviance);
  for (std::size_t i = 0; i < 3; ++i) {
    CAPTURE(parameters[i].name);
    const ParameterResult& expected = full.parameters[i];
    REQUIRE(expected.lower);
    REQUIRE(expected.upper);
    const Profile found = short_profile(function, parameters, full.best, i, 0.1, rise);
    REQUIRE(found.lower);
    REQUIRE(found.upper);
    const FitParameter& p = parameters[i];
    const double best = p.theta(full.best.natural[i]);
    for (const auto& [mine, other] :
         {std::pair{*found.lower, *expected.lower}, std::pair{*found.upper, *expected.upper}}) {
      const double half = std::abs(p.theta(other) - best);
      CHECK(p.theta(mine) == Approx(p.theta(other)).margin(0.01 * half));
    }
    CHECK(found.below == ProfileEnd::limit);
    CHECK(std::is_sorted(found.points.begin(), found.points.end(),
                         [](const auto& a, const auto& b) { return a.natural < b.natural; }));
  }
}

TEST_CASE("a short profile is open where a bound comes first, and reports a deeper minimum") {
  const Decay function;
  std::vector<FitParameter> parameters{searched("a", 1.0, Scale::log, 1e-2, 1e2),
                                       searched("k", 0.4, Scale::log, 0.39, 1e2),
                                       searched("c", 0.0, Scale::linear, -5.0, 5.0)};
  const std::vector<double> start{2.0, 0.4, 0.5};
  const Minimum best = minimise(function, parameters, start);
  const Profile open = short_profile(function, parameters, best, 1, 0.1, 1e3);
  CHECK_FALSE(open.lower);
  CHECK(open.below == ProfileEnd::bound);
  Minimum shallow = best;
  shallow.natural = {3.0, 1.0, 0.2};
  shallow.deviance = deviance_at(function, shallow.natural);
  const Profile deeper = short_profile(function, parameters, shallow, 1, 0.1, 0.01);
  REQUIRE(deeper.better);
  CHECK(deeper.better->deviance < shallow.deviance);
}

TEST_CASE("bonds, contacts and offsets of two recordings are found from their readings") {
  const SceneOrgan organ = organ_of_scene(star_with_branch(), "test", {});
  const FittedBonds bonds(organ.tissue->materials.materials.front(), false);
  REQUIRE(bonds.names() == std::vector<std::string>{"Einf", "g1"});
  const std::vector<double> true_values{8e3, 6e3};
  const std::vector<MadeReadings> made{{0.5e-3, 0.02, 3e-3, 3}, {0.2e-3, -0.01, 1e-3, 4}};
  std::vector<OrganReadings> recordings;
  for (const MadeReadings& each : made) {
    recordings.push_back(recorded(*organ.model, bonds, true_values, each));
  }
  const std::vector<FitParameter> parameters{searched("Einf", 1e4, Scale::log, 80.0, 8e5),
                                             searched("g1", 5e3, Scale::log, 60.0, 6e5)};
  const ReadingsFit r = fit_to_readings(*organ.model, bonds, parameters, recordings, true);
  REQUIRE(r.fit.parameters.size() == 6);
  CHECK(r.readings == 2 * 120);
  CHECK(r.independent > 150.0);  // white noise
  // Twice as far as the limits: four standard errors.
  const auto holds = [&](std::size_t i, double value) {
    const ParameterResult& p = r.fit.parameters[i];
    CAPTURE(p.parameter.name, p.estimate);
    REQUIRE(p.lower);
    REQUIRE(p.upper);
    CHECK(*p.lower < p.estimate);
    CHECK(*p.upper > p.estimate);
    CHECK(value > p.estimate - 2.0 * (p.estimate - *p.lower));
    CHECK(value < p.estimate + 2.0 * (*p.upper - p.estimate));
  };
  holds(0, true_values[0]);
  holds(1, true_values[1]);
  for (std::size_t i = 0; i < 2; ++i) {
    holds(2 + 2 * i, made[i].contact_m);
    holds(3 + 2 * i, made[i].offset_N);
    CHECK(r.fit.parameters[2 + 2 * i].estimate == Approx(made[i].contact_m).margin(5e-5));
  }
  // The interval is about as wide as a 0.5 % noise over 242 readings allows.
  CHECK(*r.fit.parameters[0].upper / *r.fit.parameters[0].lower < 1.1);
  CHECK(r.fit.parameters[0].profile.points.size() > 4);
}

TEST_CASE("after a descent from a deeper minimum nothing is left of the first one") {
  const SceneOrgan organ = organ_of_scene(star_with_branch(), "test", {});
  const FittedBonds bonds(organ.tissue->materials.materials.front(), false);
  const std::vector<double> true_values{8e3, 6e3};
  std::vector<OrganReadings> readings{
      recorded(*organ.model, bonds, true_values, {0.5e-3, 0.02, 3e-3, 3})};
  const auto fit_from = [&](double einf, double contact_m, bool profiles) {
    const std::vector<FitParameter> parameters{searched("Einf", einf, Scale::log, 80.0, 8e5),
                                               searched("g1", 5e3, Scale::log, 60.0, 6e5)};
    readings.front().contact_m = contact_m;
    return fit_to_readings(*organ.model, bonds, parameters, readings, profiles);
  };
  const ReadingsFit expected = fit_from(1e4, 0.7e-3, true);
  // Too stiff and too late a contact: the search ends with the contact on its bound.
  const ReadingsFit wrong = fit_from(1e5, 1.5e-3, false);
  REQUIRE(wrong.fit.best.deviance > 10.0 * expected.fit.best.deviance);
  REQUIRE(wrong.fit.parameters[2].at_lower_bound);
  REQUIRE(wrong.independent < 0.5 * expected.independent);
  const ReadingsFit found = fit_from(1e5, 1.5e-3, true);
  constexpr double kSame = 1e-3;
  CHECK(found.fit.best.deviance == Approx(expected.fit.best.deviance).epsilon(kSame));
  CHECK(found.independent == Approx(expected.independent).epsilon(kSame));
  CHECK(found.rise == Approx(expected.rise).epsilon(kSame));
  CHECK(found.fit.variance_factor == Approx(expected.fit.variance_factor).epsilon(kSame));
  REQUIRE(found.fit.parameters.size() == expected.fit.parameters.size());
  for (std::size_t i = 0; i < found.fit.parameters.size(); ++i) {
    const ParameterResult& mine = found.fit.parameters[i];
    const ParameterResult& other = expected.fit.parameters[i];
    CAPTURE(other.parameter.name);
    REQUIRE((other.lower && other.upper));
    REQUIRE((mine.lower && mine.upper));
    constexpr double kNear = 0.02;
    const double within = kNear * (*other.upper - *other.lower);
    CHECK(mine.estimate == Approx(other.estimate).margin(within));
    CHECK(*mine.lower == Approx(*other.lower).margin(within));
    CHECK(*mine.upper == Approx(*other.upper).margin(within));
    CHECK_FALSE(mine.at_lower_bound);
    REQUIRE(mine.standard_error);
    CHECK(*mine.standard_error == Approx(*other.standard_error).epsilon(0.01));
  }
}

TEST_CASE("intervals of readings need a recording") {
  LawFile law;
  law.spec = parse_law_name("linear-1", "test");
  law.spec.reference = 2e-3;
  law.values = {100.0, 50.0, 0.5, 0.0, 0.0};
  OrganMaterialOptions options;
  options.intervals = MaterialIntervals::readings;
  CHECK_THAT(test::refusal_of([&] {
               (void)put_on_organ(law, {testing::ramp_to_2_mm()}, testing::liver_of_60(), "test",
                                  {}, options);
             }),
             Contains("intervals of readings along a protocol"));
}

}  // namespace tpm::fit
