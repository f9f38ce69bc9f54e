#include "tpmkit/model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/element/validity_limits.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
using namespace law;

Response Model::respond_along(const Protocol& protocol, std::span<const double> times_s,
                              std::span<const double> parameters,
                              const Eigen::MatrixXd& along) const {
  Response response = respond(protocol, times_s, parameters, Want::values_and_sensitivity);
  response.sensitivity = response.sensitivity * along;
  return response;
}

std::vector<Remark> validity_remarks(double spacing_m, double peak_depth_m) {
  std::vector<Remark> remarks;
  if (peak_depth_m > kDamageIndentation_m) {
    remarks.push_back({"indentation_over_12_mm",
                       fmt::format("indentation of {:.4g} mm is over 12 mm, where liver is damaged",
                                   peak_depth_m * 1e3)});
  } else if (peak_depth_m > kValidIndentation_m) {
    remarks.push_back({"indentation_over_10_mm",
                       fmt::format("indentation of {:.4g} mm is over the paper's validity of 10 mm",
                                   peak_depth_m * 1e3)});
  }
  const double angle = std::atan(peak_depth_m / spacing_m);
  if (angle > kValidTurning_rad) {
    remarks.push_back({"lateral_bond_turned_over_30_degrees",
                       fmt::format("bonds turn by {:.4g} degrees, over the paper's 30",
                                   angle * 180.0 / std::numbers::pi)});
  }
  return remarks;
}

void require_times_within(const Protocol& protocol, std::span<const double> times_s) {
  for (const double t : times_s) {
    if (t >= protocol.start_s() && t <= protocol.end_s()) continue;
    throw bad_input(protocol.name(), fmt::format("asked for t = {} s", shortest(t)),
                    fmt::format("a time from {} to {} s", shortest(protocol.start_s()),
                                shortest(protocol.end_s())));
  }
}

std::vector<std::size_t> rising_order(std::span<const double> times_s) {
  std::vector<std::size_t> order(times_s.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (std::is_sorted(times_s.begin(), times_s.end())) return order;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return times_s[a] < times_s[b]; });
  return order;
}

}  // namespace tpm
