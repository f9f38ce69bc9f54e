#include "tpm/law/contact_history.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tpm/core/error.hpp"

namespace tpm {
namespace {

constexpr double kRelativeTolerance = 1e-10;
constexpr int kMostHalvings = 60;

}  // namespace

ContactHistory::ContactHistory(const LawAtParameters& law, double peak_depth, Want want)
    : law_(law),
      want_slopes_(want == Want::values_and_sensitivity),
      v_tolerance_(kRelativeTolerance * std::max(law.kernel.value(std::max(peak_depth, 0.0)),
                                                 std::numeric_limits<double>::min())) {
  const Eigen::Index branches = law.memory.stiffness.size();
  w_.setZero(branches);
  w_next_ = w_;
  if (want_slopes_) {
    w_by_.setZero(law.parameter_count, branches);
    w_by_next_ = w_by_;
  }
  now_.u_by = zero_slopes();
  now_.v_by = zero_slopes();
  v_rate_by_ = zero_slopes();
  weights_.resize(static_cast<std::size_t>(branches));
}

Slopes ContactHistory::zero_slopes() const {
  return Slopes::Zero(want_slopes_ ? law_.parameter_count : 0);
}

ContactHistory::Point ContactHistory::imposed(double drive, bool touching) const {
  Point point{std::max(drive - law_.contact, 0.0), 0.0, zero_slopes(), zero_slopes()};
  if (!want_slopes_) {
    point.v = law_.kernel.value(point.u);
    return point;
  }
  const KernelShape::Values k = law_.kernel.at(point.u);
  point.v = k.value;
  const KernelPlaces& p = law_.place;
  if (p.exponent >= 0) point.v_by[p.exponent] = k.d_exponent;
  if (p.tension_share >= 0) {
    point.v_by[p.tension_share] = k.d_share;
    point.v_by[p.spacing] = k.d_spacing;
  }
  if (point.u > 0.0 || touching) {
    point.u_by[p.contact] = -1.0;
    point.v_by[p.contact] = -k.slope;
  }
  return point;
}

double ContactHistory::elastic_force(double v, double u, const Eigen::ArrayXd& w,
                                     double v_rate) const {
  double force = law_.memory.constant * v + law_.memory.dashpot * v_rate;
  for (Eigen::Index j = 0; j < w.size(); ++j) force += law_.memory.stiffness[j] * (v - w[j]);
  if (law_.k_tension != 0.0) force += law_.k_tension * law_.tension.at(u).value;
  return force;
}

double ContactHistory::force() const {
  if (free_) return law_.offset;
  return law_.offset + elastic_force(now_.v, now_.u, w_, v_rate_);
}

Slopes ContactHistory::force_slopes() const {
  Slopes slopes = zero_slopes();
  slopes[law_.place.offset] = 1.0;
  if (free_) return slopes;
  const Memory& m = law_.memory;
  double instant = m.constant;
  for (Eigen::Index j = 0; j < w_.size(); ++j) {
    instant += m.stiffness[j];
    slopes -= m.stiffness[j] * w_by_.col(j);
  }
  slopes += instant * now_.v_by + m.dashpot * v_rate_by_;
  for (std::size_t q = 0; q < m.by.size(); ++q) {
    const auto column = static_cast<Eigen::Index>(q);
    double direct = m.d_constant[column] * now_.v + m.d_dashpot[column] * v_rate_;
    for (Eigen::Index j = 0; j < w_.size(); ++j) {
      direct += m.d_stiffness(j, column) * (now_.v - w_[j]);
    }
    slopes[m.by[q]] += direct;
  }
  if (law_.place.k_tension >= 0) {
    const TensionShape::Values t = law_.tension.at(now_.u);
    slopes[law_.place.k_tension] += t.value;
    slopes[law_.place.spacing] += law_.k_tension * t.d_spacing;
    slopes += law_.k_tension * t.slope * now_.u_by;
  }
  return slopes;
}

Slopes ContactHistory::drive_slopes() const {
  Slopes slopes = now_.u_by;
  slopes[law_.place.contact] += 1.0;
  return slopes;
}

void ContactHistory::update_weights(double h, double time_scale, bool curved) {
  // Evenly sampled times differ by their rounding; the weights of one step length serve them all.
  const double same = 4.0 * std::numeric_limits<double>::epsilon() * time_scale;
  if (weights_curved_ == curved && std::abs(h - weights_h_) <= same) return;
  for (std::size_t j = 0; j < weights_.size(); ++j) {
    const double z = h * law_.memory.rate_per_s[static_cast<Eigen::Index>(j)];
    weights_[j] = curved ? quartic_weights(z) : line_weights(z);
  }
  weights_h_ = h;
  weights_curved_ = curved;
}

void ContactHistory::step_branches(const Point& begin, std::span<const Point> middle,
                                   const Point& end) {
  const Memory& m = law_.memory;
  for (Eigen::Index j = 0; j < w_.size(); ++j) {
    const QuadratureWeights& k = weights_[static_cast<std::size_t>(j)];
    double next = k.r * w_[j] + k.b.front() * begin.v + k.b.back() * end.v;
    for (std::size_t i = 0; i < middle.size(); ++i) next += k.b[i + 1] * middle[i].v;
    w_next_[j] = next;
    if (!want_slopes_) continue;
    auto by = w_by_next_.col(j);
    by = k.r * w_by_.col(j) + k.b.front() * begin.v_by + k.b.back() * end.v_by;
    for (std::size_t i = 0; i < middle.size(); ++i) by += k.b[i + 1] * middle[i].v_by;
    const int tau = m.rate_parameter[static_cast<std::size_t>(j)];
    if (tau < 0) continue;
    double d = k.d_r * w_[j] + k.d_b.front() * begin.v + k.d_b.back() * end.v;
    for (std::size_t i = 0; i < middle.size(); ++i) d += k.d_b[i + 1] * middle[i].v;
    by[tau] += m.rate_per_s[j] * d;
  }
}

void ContactHistory::accept(const Point& begin, const Point& end, double h) {
  v_rate_ = (end.v - begin.v) / h;
  if (want_slopes_) v_rate_by_ = (end.v_by - begin.v_by) / h;
  w_.swap(w_next_);
  w_by_.swap(w_by_next_);
  now_ = end;
}

ContactHistory::Balance ContactHistory::balance_at_once() const {
  const Memory& m = law_.memory;
  Balance b{m.constant, 0.0, zero_slopes(), zero_slopes()};
  for (Eigen::Index j = 0; j < w_.size(); ++j) {
    b.a += m.stiffness[j];
    b.r += m.stiffness[j] * w_[j];
    if (want_slopes_) b.r_by += m.stiffness[j] * w_by_.col(j);
  }
  if (!want_slopes_) return b;
  for (std::size_t q = 0; q < m.by.size(); ++q) {
    const auto column = static_cast<Eigen::Index>(q);
    b.a_by[m.by[q]] += m.d_constant[column];
    for (Eigen::Index j = 0; j < w_.size(); ++j) {
      b.a_by[m.by[q]] += m.d_stiffness(j, column);
      b.r_by[m.by[q]] += m.d_stiffness(j, column) * w_[j];
    }
  }
  return b;
}

ContactHistory::Balance ContactHistory::balance_over_step(double h) const {
  const Memory& m = law_.memory;
  const Point& begin = now_;
  Balance b{m.constant + m.dashpot / h, m.dashpot / h * begin.v, zero_slopes(), zero_slopes()};
  if (want_slopes_) b.r_by += m.dashpot / h * begin.v_by;
  for (Eigen::Index j = 0; j < w_.size(); ++j) {
    const QuadratureWeights& k = weights_[static_cast<std::size_t>(j)];
    const double kept = k.r * w_[j] + k.b.front() * begin.v;
    b.a += m.stiffness[j] * (1.0 - k.b.back());
    b.r += m.stiffness[j] * kept;
    if (!want_slopes_) continue;
    b.r_by += m.stiffness[j] * (k.r * w_by_.col(j) + k.b.front() * begin.v_by);
    const int tau = m.rate_parameter[static_cast<std::size_t>(j)];
    if (tau >= 0) {
      const double scale = m.stiffness[j] * m.rate_per_s[j];
      b.a_by[tau] -= scale * k.d_b.back();
      b.r_by[tau] += scale * (k.d_r * w_[j] + k.d_b.front() * begin.v);
    }
    for (std::size_t q = 0; q < m.by.size(); ++q) {
      const double d = m.d_stiffness(j, static_cast<Eigen::Index>(q));
      b.a_by[m.by[q]] += d * (1.0 - k.b.back());
      b.r_by[m.by[q]] += d * kept;
    }
  }
  if (!want_slopes_) return b;
  for (std::size_t q = 0; q < m.by.size(); ++q) {
    const auto column = static_cast<Eigen::Index>(q);
    b.a_by[m.by[q]] += m.d_constant[column] + m.d_dashpot[column] / h;
    b.r_by[m.by[q]] += m.d_dashpot[column] / h * begin.v;
  }
  return b;
}

ContactHistory::Point ContactHistory::surface_under(double load, const Balance& balance,
                                                    bool loaded) const {
  Point point{0.0, 0.0, zero_slopes(), zero_slopes()};
  const double right = load + balance.r;
  if (!(right > 0.0)) return point;
  if (!(balance.a > 0.0) && !(law_.k_tension > 0.0)) {
    throw Error(ExitCode::numerical, "law", "nothing carries the load");
  }
  const auto tension = [&](double u) {
    return law_.k_tension > 0.0 ? law_.tension.at(u) : TensionShape::Values{0.0, 0.0, 0.0};
  };
  // A start at least as deep as the root, from which Newton falls monotonically because the left
  // side is convex: where the surface would lie without tension, or if only tension carries the
  // load, the first doubled depth where it does.
  double u = law_.tension.reference;
  if (balance.a > 0.0) {
    u = law_.kernel.inverse(right / balance.a);
  } else {
    while (law_.k_tension * tension(u).value < right) u *= 2.0;
  }
  KernelShape::Values k = law_.kernel.at(u);
  TensionShape::Values t = tension(u);
  for (int i = 0; i < 200 && law_.k_tension > 0.0; ++i) {
    const double excess = balance.a * k.value + law_.k_tension * t.value - right;
    const double next = u - excess / (balance.a * k.slope + law_.k_tension * t.slope);
    if (!(next < u)) break;
    u = next;
    k = law_.kernel.at(u);
    t = tension(u);
  }
  point.u = u;
  point.v = k.value;
  if (!want_slopes_) return point;
  const KernelPlaces& p = law_.place;
  if (p.exponent >= 0) point.v_by[p.exponent] = k.d_exponent;
  if (p.tension_share >= 0) {
    point.v_by[p.tension_share] = k.d_share;
    point.v_by[p.spacing] = k.d_spacing;
  }
  Slopes excess_by = balance.a_by * k.value + balance.a * point.v_by - balance.r_by;
  if (loaded) excess_by[p.offset] += 1.0;  // the tissue carries the load less the zero error
  if (p.k_tension >= 0) {
    const TensionShape::Values shape = law_.tension.at(u);
    excess_by[p.k_tension] += shape.value;
    excess_by[p.spacing] += law_.k_tension * shape.d_spacing;
  }
  point.u_by = -excess_by / (balance.a * k.slope + law_.k_tension * t.slope);
  point.v_by += k.slope * point.u_by;
  return point;
}

void ContactHistory::rest_at_drive(double drive) {
  now_ = imposed(drive, false);
  w_.setConstant(now_.v);
  for (Eigen::Index j = 0; j < w_by_.cols(); ++j) w_by_.col(j) = now_.v_by;
  v_rate_ = 0.0;
  v_rate_by_.setZero();
  free_ = false;
}

void ContactHistory::jump_to_drive(double drive) {
  now_ = imposed(drive, false);
  v_rate_ = 0.0;
  v_rate_by_.setZero();
  free_ = elastic_force(now_.v, now_.u, w_, 0.0) < 0.0;
  if (free_) now_ = surface_under(0.0, balance_at_once(), false);
}

void ContactHistory::move_drive(double from, double to, double h, double time_scale) {
  // The probe meets (or leaves) the undeformed surface within the step: V has a kink there.
  const double before = from - law_.contact;
  const double after = to - law_.contact;
  if (before * after < 0.0) {
    const double share = before / (before - after);
    move_one(from, law_.contact, h * share, time_scale);
    move_one(law_.contact, to, h * (1.0 - share), time_scale);
  } else {
    move_one(from, to, h, time_scale);
  }
}

void ContactHistory::move_one(double from, double to, double h, double time_scale) {
  if (!(h > 0.0)) return;
  const bool touching = std::max(from, to) > law_.contact;
  if (touching && !free_ && now_.u == 0.0) now_ = imposed(from, true);
  if (law_.kernel.is_linear() || free_) {
    move_piece(from, to, h, time_scale, false);
  } else {
    move_smooth(from, to, h, time_scale, 0);
  }
}

void ContactHistory::move_smooth(double from, double to, double h, double time_scale, int level) {
  const double a = std::max(from - law_.contact, 0.0);
  const double b = std::max(to - law_.contact, 0.0);
  // Kernels are powers of the depth: over a small part of it a straight line, or a polynomial of
  // fourth degree, holds to 1e-10.
  constexpr double kStraight = 3e-6;
  constexpr double kQuartic = 0.05;
  const double part = std::abs(b - a) / std::min(a, b);
  if (part > kQuartic && level < kMostHalvings) {
    const KernelShape& v = law_.kernel;
    const double v0 = v.value(a);
    const double v1 = v.value(0.75 * a + 0.25 * b);
    const double v2 = v.value(0.5 * (a + b));
    const double v3 = v.value(0.25 * a + 0.75 * b);
    const double v4 = v.value(b);
    // The polynomial at 1/8 and 7/8, where its error is largest.
    const double early = (35.0 * v0 + 140.0 * v1 - 70.0 * v2 + 28.0 * v3 - 5.0 * v4) / 128.0;
    const double late = (-5.0 * v0 + 28.0 * v1 - 70.0 * v2 + 140.0 * v3 + 35.0 * v4) / 128.0;
    const double off = std::max(std::abs(early - v.value(0.875 * a + 0.125 * b)),
                                std::abs(late - v.value(0.125 * a + 0.875 * b)));
    if (off > v_tolerance_) {
      const double middle = 0.5 * (from + to);
      move_smooth(from, middle, 0.5 * h, time_scale, level + 1);
      move_smooth(middle, to, 0.5 * h, time_scale, level + 1);
      return;
    }
  }
  move_piece(from, to, h, time_scale, !free_ && part > kStraight);
}

void ContactHistory::move_piece(double from, double to, double h, double time_scale, bool curved) {
  const bool touching = std::max(from, to) > law_.contact;
  const Point end = imposed(to, touching);
  update_weights(h, time_scale, curved);
  if (curved) {
    const std::array<Point, 3> middle{imposed(0.75 * from + 0.25 * to, touching),
                                      imposed(0.5 * (from + to), touching),
                                      imposed(0.25 * from + 0.75 * to, touching)};
    step_branches(now_, middle, end);
  } else {
    step_branches(now_, {}, end);
  }
  if (elastic_force(end.v, end.u, w_next_, (end.v - now_.v) / h) >= 0.0) {
    free_ = false;
    accept(now_, end, h);
    return;
  }
  free_ = true;
  update_weights(h, time_scale, false);
  const Point surface = surface_under(0.0, balance_over_step(h), false);
  step_branches(now_, {}, surface);
  accept(now_, surface, h);
}

void ContactHistory::rest_at_load(double load) {
  Balance b{law_.memory.constant, 0.0, zero_slopes(), zero_slopes()};
  if (want_slopes_) {
    for (std::size_t q = 0; q < law_.memory.by.size(); ++q) {
      b.a_by[law_.memory.by[q]] += law_.memory.d_constant[static_cast<Eigen::Index>(q)];
    }
  }
  now_ = surface_under(load - law_.offset, b, true);
  w_.setConstant(now_.v);
  for (Eigen::Index j = 0; j < w_by_.cols(); ++j) w_by_.col(j) = now_.v_by;
}

void ContactHistory::jump_to_load(double load) {
  now_ = surface_under(load - law_.offset, balance_at_once(), true);
  v_rate_ = 0.0;
  v_rate_by_.setZero();
}

void ContactHistory::load_step(double load, double h, double time_scale) {
  update_weights(h, time_scale, false);
  const Point end = surface_under(load - law_.offset, balance_over_step(h), true);
  step_branches(now_, {}, end);
  accept(now_, end, h);
}

void ContactHistory::move_load(double from, double to, double h, double time_scale) {
  if (std::isinf(h)) {
    rest_at_load(to);
    return;
  }
  move_load_adaptive(from, to, h, time_scale, 0);
}

void ContactHistory::move_load_adaptive(double from, double to, double h, double time_scale,
                                        int level) {
  const Eigen::ArrayXd w = w_;
  const Eigen::ArrayXXd w_by = w_by_;
  const Point begin = now_;
  const double middle = 0.5 * (from + to);
  load_step(to, h, time_scale);
  const Eigen::ArrayXd w_whole = w_;
  const Eigen::ArrayXXd w_by_whole = w_by_;
  const Point whole = now_;
  w_ = w;
  w_by_ = w_by;
  now_ = begin;
  load_step(middle, 0.5 * h, time_scale);
  load_step(to, 0.5 * h, time_scale);
  const double off =
      std::max(std::abs(now_.v - whole.v), w_.size() > 0 ? (w_ - w_whole).abs().maxCoeff() : 0.0);
  if (off > 30.0 * v_tolerance_ && level < kMostHalvings) {
    w_ = w;
    w_by_ = w_by;
    now_ = begin;
    move_load_adaptive(from, middle, 0.5 * h, time_scale, level + 1);
    move_load_adaptive(middle, to, 0.5 * h, time_scale, level + 1);
    return;
  }
  // The step is of second order: one extrapolation takes the leading error away.
  const auto better = [](const auto& fine, const auto& coarse) {
    return ((4.0 * fine - coarse) / 3.0).eval();
  };
  w_ = better(w_, w_whole);
  w_by_ = better(w_by_, w_by_whole);
  now_.v = (4.0 * now_.v - whole.v) / 3.0;
  now_.u = law_.kernel.inverse(now_.v);
  now_.u_by = better(now_.u_by, whole.u_by);
  now_.v_by = better(now_.v_by, whole.v_by);
}

}  // namespace tpm
