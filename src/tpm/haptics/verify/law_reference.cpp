#include "tpm/haptics/verify/law_reference.hpp"

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <cstdint>

#include "tpm/base/namespaces.hpp"
#include "tpm/law/contact_history.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::haptics {
namespace {

/// A depth from low to high where a force that grows with it changes its sign; an end where none
/// does.
template <class Force>
double where_no_force_is(const Force& force_at, double low, double high) {
  if (!(high > low)) return low;
  const double at_low = force_at(low), at_high = force_at(high);
  if (!(at_high > 0.0)) return high;
  if (at_low > 0.0) return low;
  std::uintmax_t most = 100;
  const auto [before, after] = boost::math::tools::toms748_solve(
      force_at, low, high, at_low, at_high, boost::math::tools::eps_tolerance<double>(), most);
  return 0.5 * (before + after);
}

}  // namespace

std::vector<double> law_forces_by_gauss(const LawFile& file, std::span<const double> time_s,
                                        std::span<const double> depth_m) {
  if (file.spec.fractional != Fractional::none) {
    throw bad_input("law " + law_name(file.spec), "is fractional", "a law with branches");
  }
  const LawAtParameters law = LawModel(file.spec).at(file.values, nullptr);
  const Eigen::VectorXd& rate = law.relaxation.rate_per_s;
  Eigen::VectorXd y = Eigen::VectorXd::Zero(rate.size());
  const auto elastic = [&](double u) {
    const double tension = law.k_tension == 0.0 ? 0.0 : law.k_tension * law.tension.at(u).value;
    return law.relaxation.constant * law.kernel.value(u) + tension;
  };
  // Within [0, h] the depth goes from a to b; returns the branches at its end.
  const auto moved = [&](double a, double b, double h) {
    Eigen::VectorXd end = (-rate * h).array().exp().matrix().cwiseProduct(y);
    const double from = std::max(a, 0.0), to = std::max(b, 0.0);
    if (from == to) return end;
    // Depths below 0 are no contact: only the part inside moves the kernel.
    const double start = a < 0.0 ? h * (0.0 - a) / (b - a) : 0.0;
    const double stop = b < 0.0 ? h * (a - 0.0) / (a - b) : h;
    const double speed = (b - a) / h;
    for (Eigen::Index j = 0; j < rate.size(); ++j) {
      end[j] += boost::math::quadrature::gauss<double, 8>::integrate(
          [&](double s) {
            return std::exp(-rate[j] * (h - s)) * law.kernel.slope(a + speed * s) * speed;
          },
          start, stop);
    }
    return end;
  };
  std::vector<double> forces;
  forces.reserve(time_s.size());
  double surface = 0.0;
  bool touching = false;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    const double h = i == 0 ? 0.0 : time_s[i] - time_s[i - 1];
    const double tool = depth_m[i];
    if (h == 0.0) {  // the first instant: from rest, instantaneously
      surface = std::max(tool, 0.0);
      y.setConstant(law.kernel.value(surface));
      touching = tool >= 0.0;
      forces.push_back(touching ? elastic(surface) + law.relaxation.stiffness.dot(y) : 0.0);
      continue;
    }
    const auto force_at = [&](double u) {
      return elastic(std::max(u, 0.0)) + law.relaxation.stiffness.dot(moved(surface, u, h));
    };
    double force = force_at(tool);
    touching = force > 0.0;
    double end = tool;
    if (!touching) {
      end =
          std::max(tool, where_no_force_is(force_at, std::min(tool, 0.0), std::max(surface, tool)));
      force = 0.0;
    }
    y = moved(surface, end, h);
    surface = end;
    forces.push_back(force);
  }
  return forces;
}

}  // namespace tpm::haptics
