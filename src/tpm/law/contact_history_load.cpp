// Declared in tpm/law/contact_history.hpp.
// A contact history under an imposed load; contact_history.cpp has the imposed depth.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tpm/law/contact_history.hpp"

namespace tpm::law {

void ContactHistory::rest_at_load(double load) {
  Balance b{law_.relaxation.constant, 0.0, zero_slopes(), zero_slopes()};
  if (want_slopes_) {
    for (std::size_t q = 0; q < law_.relaxation.by.size(); ++q) {
      b.a_by[law_.relaxation.by[q]] += law_.relaxation.d_constant[static_cast<Eigen::Index>(q)];
    }
  }
  carry_all_slopes();
  now_ = surface_under(load - law_.offset, b, true);
  relax_fully();
}

void ContactHistory::jump_to_load(double load) {
  carry_all_slopes();
  // A dashpot does not move instantaneously.
  if (law_.relaxation.dashpot > 0.0) return;
  now_ = surface_under(load - law_.offset, instantaneous_balance(), true);
  v_rate_ = 0.0;
  v_rate_by_.setZero();
}

void ContactHistory::load_step(double load, double h, double time_scale) {
  update_weights(h, time_scale, false);
  move_to_surface(surface_under(load - law_.offset, balance_over_step(h), true), h);
}

void ContactHistory::move_load(double from, double to, double h, double time_scale) {
  if (std::isinf(h)) {
    rest_at_load(to);
    return;
  }
  move_load_adaptive(from, to, h, time_scale, 0);
}

/// Weights of one move made in 1, 2, ..., n steps that extrapolate it to ever smaller ones
/// (Richardson): the polynomial through the answers, at no step. A step of branches alone is
/// symmetric: made back with -h it ends where it began, because V runs straight between the depths
/// that both states balance. So its error has even powers of h only (Hairer, Norsett & Wanner,
/// Solving Ordinary Differential Equations I, II.8), and n answers reach order 2 n. A dashpot,
/// whose speed is the mean over the step, has all powers from the first on.
std::array<double, ContactHistory::kMostSteps> ContactHistory::extrapolation(int n) const {
  const bool symmetric = law_.relaxation.dashpot == 0.0;
  std::array<double, kMostSteps> weight{};
  for (int j = 1; j <= n; ++j) {
    double product = 1.0;
    for (int i = 1; i <= n; ++i) {
      if (i == j) continue;
      product *= symmetric ? static_cast<double>(j * j) / (j * j - i * i)
                           : static_cast<double>(j) / (j - i);
    }
    weight[static_cast<std::size_t>(j - 1)] = product;
  }
  return weight;
}

ContactHistory::Loaded ContactHistory::extrapolated(const std::vector<Loaded>& ends) const {
  const auto weight = extrapolation(static_cast<int>(ends.size()));
  Loaded limit = ends.front();
  limit.w *= weight[0];
  limit.w_by *= weight[0];
  limit.now.v *= weight[0];
  limit.now.u_by *= weight[0];
  limit.now.v_by *= weight[0];
  for (std::size_t j = 1; j < ends.size(); ++j) {
    const Loaded& end = ends[j];
    limit.w += weight[j] * end.w;
    limit.w_by += weight[j] * end.w_by;
    limit.now.v += weight[j] * end.now.v;
    limit.now.u_by += weight[j] * end.now.u_by;
    limit.now.v_by += weight[j] * end.now.v_by;
  }
  limit.now.u = law_.kernel.inverse(std::max(limit.now.v, 0.0));
  return limit;
}

/// The largest difference of V and of the states of the branches.
double ContactHistory::distance(const Loaded& a, const Loaded& b) const {
  const double off = std::abs(a.now.v - b.now.v);
  return a.w.size() > 0 ? std::max(off, (a.w - b.w).abs().maxCoeff()) : off;
}

void ContactHistory::move_load_adaptive(double from, double to, double h, double time_scale,
                                        int level) {
  constexpr double kRounding = 1e-13;  // of V: no step is so short that it falls below
  double allowed = 30.0 * v_tolerance_;
  const Loaded begin{w_, w_by_, now_};
  const auto stand_at = [&](const Loaded& place) {
    w_ = place.w;
    w_by_ = place.w_by;
    now_ = place.now;
  };
  std::vector<Loaded> ends;
  Loaded best;
  double off = std::numeric_limits<double>::infinity();
  for (int steps = 1; steps <= kMostSteps; ++steps) {
    stand_at(begin);
    for (int i = 1; i <= steps; ++i) {
      load_step(from + (to - from) * i / steps, h / steps, time_scale);
    }
    ends.push_back({w_, w_by_, now_});
    Loaded better = extrapolated(ends);
    const double change = steps > 1 ? distance(better, best) : off;
    best = std::move(better);
    allowed = std::max(allowed, kRounding * std::abs(best.now.v));
    const bool slow = steps > 2 && change > 0.5 * off;  // shorter steps gain more
    off = change;
    if (off <= allowed || slow) break;
  }
  if (off <= allowed || level >= kMostHalvings) {
    stand_at(best);
    return;
  }
  stand_at(begin);
  const double middle = 0.5 * (from + to);
  move_load_adaptive(from, middle, 0.5 * h, time_scale, level + 1);
  move_load_adaptive(middle, to, 0.5 * h, time_scale, level + 1);
}

}  // namespace tpm::law
