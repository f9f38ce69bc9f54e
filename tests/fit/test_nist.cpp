// Exponential problems of the NIST Statistical Reference Datasets (StRD, nonlinear regression;
// https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml; US government, public domain): 7
// certified digits of estimates, standard deviations and residual sum of squares from both
// published starts, and from random starts where one start fails.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "tpm/fit/fit.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::organ;
using namespace tpm::fit;
using Catch::Matchers::WithinRel;

namespace {

/// f(x; b) with its gradient.
using Curve = std::function<double(double x, std::span<const double> b, std::span<double> d)>;

/// y = b1 (1 - exp(-b2 x))
double saturating(double x, std::span<const double> b, std::span<double> d) {
  const double e = std::exp(-b[1] * x);
  d[0] = 1.0 - e;
  d[1] = b[0] * x * e;
  return b[0] * (1.0 - e);
}

/// y = b1 + b2 exp(-b4 x) + b3 exp(-b5 x)
double two_decays(double x, std::span<const double> b, std::span<double> d) {
  const double e4 = std::exp(-b[3] * x);
  const double e5 = std::exp(-b[4] * x);
  d[0] = 1.0;
  d[1] = e4;
  d[2] = e5;
  d[3] = -b[1] * x * e4;
  d[4] = -b[2] * x * e5;
  return b[0] + b[1] * e4 + b[2] * e5;
}

/// y = b1 exp(-b2 x) + b3 exp(-b4 x) + b5 exp(-b6 x)
double three_decays(double x, std::span<const double> b, std::span<double> d) {
  double y = 0.0;
  for (std::size_t k = 0; k < 6; k += 2) {
    const double e = std::exp(-b[k + 1] * x);
    d[k] = e;
    d[k + 1] = -b[k] * x * e;
    y += b[k] * e;
  }
  return y;
}

struct Problem {
  std::string name;
  Curve curve;
  std::vector<double> x, y;
  std::vector<std::vector<double>> starts;
  std::vector<double> certified, certified_sd;
  double certified_rss;
};

class Residuals final : public ResidualFunction {
 public:
  explicit Residuals(const Problem& problem) : problem_(problem) {}
  [[nodiscard]] Eigen::Index residual_count() const override {
    return static_cast<Eigen::Index>(problem_.x.size());
  }
  [[nodiscard]] bool evaluate(std::span<const double> b, Eigen::VectorXd& r,
                              RowMatrix* jacobian) const override {
    std::vector<double> d(b.size());
    r.resize(residual_count());
    if (jacobian != nullptr) jacobian->resize(r.size(), static_cast<Eigen::Index>(b.size()));
    for (Eigen::Index i = 0; i < r.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      r[i] = problem_.curve(problem_.x[k], b, d) - problem_.y[k];
      if (jacobian == nullptr) continue;
      for (std::size_t j = 0; j < b.size(); ++j) {
        (*jacobian)(i, static_cast<Eigen::Index>(j)) = d[j];
      }
    }
    return r.allFinite();
  }

 private:
  const Problem& problem_;
};

std::vector<double> steps(double step, std::size_t count) {
  std::vector<double> x(count);
  for (std::size_t i = 0; i < count; ++i) x[i] = step * static_cast<double>(i);
  return x;
}

std::vector<Problem> problems() {
  return {
      {"Misra1a",
       saturating,
       {77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1,
        760.0},
       {10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.4, 75.47,
        81.78},
       {{500, 0.0001}, {250, 0.0005}},
       {2.3894212918E+02, 5.5015643181E-04},
       {2.7070075241E+00, 7.2668688436E-06},
       1.2455138894E-01},
      {"BoxBOD",
       saturating,
       {1, 2, 3, 5, 7, 10},
       {109, 149, 149, 191, 213, 224},
       {{1, 1}, {100, 0.75}},
       {2.1380940889E+02, 5.4723748542E-01},
       {1.2354515176E+01, 1.0455993237E-01},
       1.1680088766E+03},
      {"MGH17",
       two_decays,
       steps(10.0, 33),
       {0.844, 0.908, 0.932, 0.936, 0.925, 0.908, 0.881, 0.85,  0.818, 0.784, 0.751,
        0.718, 0.685, 0.658, 0.628, 0.603, 0.58,  0.558, 0.538, 0.522, 0.506, 0.49,
        0.478, 0.467, 0.457, 0.448, 0.438, 0.431, 0.424, 0.42,  0.414, 0.411, 0.406},
       {{50, 150, -100, 1, 2}, {0.5, 1.5, -1, 0.01, 0.02}},
       {3.7541005211E-01, 1.9358469127E+00, -1.4646871366E+00, 1.2867534640E-02, 2.2122699662E-02},
       {2.0723153551E-03, 2.2031669222E-01, 2.2175707739E-01, 4.4861358114E-04, 8.9471996575E-04},
       5.4648946975E-05},
      {"Lanczos3",
       three_decays,
       steps(0.05, 24),
       {2.5134, 2.0443, 1.6684, 1.3664, 1.1232, 0.9269, 0.7679, 0.6389,
        0.5338, 0.4479, 0.3776, 0.3197, 0.2720, 0.2325, 0.1997, 0.1723,
        0.1493, 0.1301, 0.1138, 0.1000, 0.0883, 0.0783, 0.0698, 0.0624},
       {{1.2, 0.3, 5.6, 5.5, 6.5, 7.6}, {0.5, 0.7, 3.6, 4.2, 4.0, 6.3}},
       {8.6816414977E-02, 9.5498101505E-01, 8.4400777463E-01, 2.9515951832E+00, 1.5825685901E+00,
        4.9863565084E+00},
       {1.7197908859E-02, 9.7041624475E-02, 4.1488663282E-02, 1.0766312506E-01, 5.8371576281E-02,
        3.4436403035E-02},
       1.6117193594E-08},
  };
}

std::vector<FitParameter> unbounded(const std::vector<double>& start) {
  std::vector<FitParameter> parameters;
  for (std::size_t i = 0; i < start.size(); ++i) {
    FitParameter p;
    p.name = "b" + std::to_string(i + 1);
    p.unit = parse_unit("", "test");
    p.scale = Scale::linear;
    p.start = start[i];
    p.lower = -INFINITY;
    p.upper = INFINITY;
    parameters.push_back(p);
  }
  return parameters;
}

Threshold estimated_scale(const Problem& problem) {
  Threshold threshold;
  threshold.scale_known = false;
  threshold.data_count = static_cast<int>(problem.x.size());
  threshold.parameter_count = static_cast<int>(problem.certified.size());
  return threshold;
}

/// MGH17 may name its two decays in either order.
void check_certified(const Problem& problem, const FitResult& fit) {
  CHECK_THAT(fit.best.deviance, WithinRel(problem.certified_rss, 1e-7));
  for (std::size_t i = 0; i < problem.certified.size(); ++i) {
    CAPTURE(problem.name, i);
    CHECK_THAT(fit.best.natural[i], WithinRel(problem.certified[i], 1e-7));
    REQUIRE(fit.parameters[i].standard_error.has_value());
    CHECK_THAT(*fit.parameters[i].standard_error, WithinRel(problem.certified_sd[i], 1e-7));
  }
}

}  // namespace

TEST_CASE("NIST: 7 certified digits from both published starts") {
  for (const Problem& problem : problems()) {
    const Residuals residuals(problem);
    for (const auto& start : problem.starts) {
      CAPTURE(problem.name, start.front());
      const FitResult fit =
          fit_residuals(residuals, unbounded(start), {start}, estimated_scale(problem), false);
      check_certified(problem, fit);
    }
  }
}

TEST_CASE("NIST: random starts find the certified answer where published starts are not given") {
  for (const Problem& problem : problems()) {
    if (problem.certified.size() > 2) continue;
    // A box that spans both published starts by a factor of 20 on each side.
    std::vector<FitParameter> parameters = unbounded(problem.starts[0]);
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      parameters[i].scale = Scale::log;
      parameters[i].lower = std::min(problem.starts[0][i], problem.starts[1][i]) / 20.0;
      parameters[i].upper = std::max(problem.starts[0][i], problem.starts[1][i]) * 20.0;
      parameters[i].start = parameters[i].lower;
    }
    const Residuals residuals(problem);
    for (const std::uint64_t seed : {0U, 1U, 2U}) {
      CAPTURE(problem.name, seed);
      check_certified(problem, fit_residuals(residuals, parameters,
                                             latin_hypercube_starts(parameters, 20, seed),
                                             estimated_scale(problem), false));
    }
  }
}

TEST_CASE("NIST: profile intervals of Misra1a agree with certified standard deviations") {
  // The problem is nearly linear, so the F interval is close to +- t(0.975, 12) sd = 2.1788 sd.
  const Problem problem = problems().front();
  const Residuals residuals(problem);
  const FitResult fit = fit_residuals(residuals, unbounded(problem.starts[1]), {problem.starts[1]},
                                      estimated_scale(problem), true);
  for (std::size_t i = 0; i < 2; ++i) {
    const ParameterResult& p = fit.parameters[i];
    REQUIRE(p.verdict == Verdict::identified);
    const double half = 2.1788128 * problem.certified_sd[i];
    CHECK_THAT(*p.upper - *p.lower, WithinRel(2.0 * half, 0.01));
  }
}
