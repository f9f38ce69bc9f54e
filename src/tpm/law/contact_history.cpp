#include "tpm/law/contact_history.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "tpmkit/error.hpp"

namespace tpm::law {
namespace {

constexpr double kRelativeTolerance = 1e-10;

}  // namespace

ContactHistory::ContactHistory(const LawAtParameters& law, double peak_depth, Want want)
    : law_(law),
      want_slopes_(want == Want::values_and_sensitivity),
      v_tolerance_(kRelativeTolerance * std::max(law.kernel.value(std::max(peak_depth, 0.0)),
                                                 std::numeric_limits<double>::min())) {
  const Eigen::Index branches = law.relaxation.stiffness.size();
  w_.setZero(branches);
  w_next_ = w_;
  now_.u_by = zero_slopes();
  now_.v_by = zero_slopes();
  v_rate_by_ = zero_slopes();
  weights_.each.resize(static_cast<std::size_t>(branches));
  for (auto* weight : {&weights_.r, &weights_.b[0], &weights_.b[1], &weights_.b[2], &weights_.b[3],
                       &weights_.b[4]}) {
    weight->setZero(branches);
  }
  if (!want_slopes_) return;
  const KernelPlaces& p = law.place;
  for (int i = 0; i < law.parameter_count; ++i) {
    const auto& rates = law.relaxation.rate_parameter;
    const bool of_kernel =
        i == p.exponent || i == p.tension_share || i == p.spacing || i == p.contact;
    if (of_kernel || std::find(rates.begin(), rates.end(), i) != rates.end()) carried_.push_back(i);
  }
  w_by_.setZero(branches, std::ssize(carried_));
  w_by_next_ = w_by_;
}

/// From here on the depth of the surface, and so the states, depend on every parameter.
void ContactHistory::carry_all_slopes() {
  if (!want_slopes_ || std::ssize(carried_) == law_.parameter_count) return;
  Eigen::ArrayXXd all = Eigen::ArrayXXd::Zero(w_.size(), law_.parameter_count);
  for (std::size_t c = 0; c < carried_.size(); ++c) {
    all.col(carried_[c]) = w_by_.col(static_cast<Eigen::Index>(c));
  }
  w_by_ = std::move(all);
  w_by_next_ = w_by_;
  carried_.resize(static_cast<std::size_t>(law_.parameter_count));
  std::iota(carried_.begin(), carried_.end(), 0);
}

/// All branches have relaxed under the depth of now.
void ContactHistory::relax_fully() {
  w_.setConstant(now_.v);
  for (Eigen::Index c = 0; c < w_by_.cols(); ++c) {
    w_by_.col(c).setConstant(now_.v_by[carried_[static_cast<std::size_t>(c)]]);
  }
  v_rate_ = 0.0;
  v_rate_by_.setZero();
}

/// The sum of weight_j times the derivatives of the state of branch j.
Slopes ContactHistory::weighted_slopes(const Eigen::ArrayXd& weight) const {
  Slopes slopes = zero_slopes();
  for (Eigen::Index c = 0; c < w_by_.cols(); ++c) {
    slopes[carried_[static_cast<std::size_t>(c)]] = (weight * w_by_.col(c)).sum();
  }
  return slopes;
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
  double force = law_.relaxation.constant * v + law_.relaxation.dashpot * v_rate;
  force += (law_.relaxation.stiffness.array() * (v - w)).sum();
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
  const RelaxationSum& m = law_.relaxation;
  slopes += m.instant() * now_.v_by + m.dashpot * v_rate_by_ - weighted_slopes(m.stiffness.array());
  for (std::size_t q = 0; q < m.by.size(); ++q) {
    const auto column = static_cast<Eigen::Index>(q);
    slopes[m.by[q]] += m.d_constant[column] * now_.v + m.d_dashpot[column] * v_rate_ +
                       (m.d_stiffness.col(column).array() * (now_.v - w_)).sum();
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
  StepWeights& k = weights_;
  if (k.curved == curved && std::abs(h - k.h) <= same) return;
  k.h = h;
  k.curved = curved;
  const bool fixed_rates = !weights_.each.empty() && law_.relaxation.rate_parameter.front() < 0;
  if (fixed_rates && !curved && std::isfinite(h)) {
    set_line_weights(h);
    return;
  }
  for (Eigen::Index j = 0; j < w_.size(); ++j) {
    const double z = h * law_.relaxation.rate_per_s[j];
    const QuadratureWeights one = curved ? quartic_weights(z) : line_weights(z);
    k.r[j] = one.r;
    for (std::size_t i = 0; i < one.b.size(); ++i) k.b[i][j] = one.b[i];
    k.each[static_cast<std::size_t>(j)] = one;
  }
}

/// line_weights of all branches at once, without derivatives: the many rates of a fractional law.
void ContactHistory::set_line_weights(double h) {
  StepWeights& k = weights_;
  const Eigen::ArrayXd z = h * law_.relaxation.rate_per_s.array();
  // Values below rounding become 0: products with denormal numbers are slow.
  k.r = (z < 60.0).select((-z).exp(), 0.0);
  // 1 - (1 - r)/z, below 0.1 as z/2! - z^2/3! + ..., where it would cancel
  Eigen::ArrayXd series = Eigen::ArrayXd::Zero(z.size());
  for (int n = 11; n >= 1; --n) series = (1.0 - series) * z / (n + 1);
  k.b[4] = (z < 0.1).select(series, 1.0 - (1.0 - k.r) / z);
  k.b[0] = (z < 0.1).select(z * (1.0 - k.b[4]), 1.0 - k.r) - k.b[4];
  for (const std::size_t i : {1U, 2U, 3U}) k.b[i].setZero();
}

void ContactHistory::step_branches(const Point& begin, std::span<const Point> middle,
                                   const Point& end) {
  const StepWeights& k = weights_;
  w_next_ = k.r * w_ + k.b.front() * begin.v + k.b.back() * end.v;
  for (std::size_t i = 0; i < middle.size(); ++i) w_next_ += k.b[i + 1] * middle[i].v;
  const std::vector<int>& rates = law_.relaxation.rate_parameter;
  for (Eigen::Index c = 0; c < w_by_.cols(); ++c) {
    const int p = carried_[static_cast<std::size_t>(c)];
    auto next = w_by_next_.col(c);
    next = k.r * w_by_.col(c) + k.b.front() * begin.v_by[p] + k.b.back() * end.v_by[p];
    for (std::size_t i = 0; i < middle.size(); ++i) next += k.b[i + 1] * middle[i].v_by[p];
    for (std::size_t j = 0; j < rates.size(); ++j) {
      if (rates[j] != p) continue;
      const auto row = static_cast<Eigen::Index>(j);
      const QuadratureWeights& d = k.each[j];
      double slope = d.d_r * w_[row] + d.d_b.front() * begin.v + d.d_b.back() * end.v;
      for (std::size_t i = 0; i < middle.size(); ++i) slope += d.d_b[i + 1] * middle[i].v;
      next[row] += law_.relaxation.rate_per_s[row] * slope;
    }
  }
}

void ContactHistory::accept(const Point& end, double v_rate, const Slopes& v_rate_by) {
  v_rate_ = v_rate;
  v_rate_by_ = v_rate_by;
  w_.swap(w_next_);
  w_by_.swap(w_by_next_);
  now_ = end;
}

ContactHistory::Balance ContactHistory::instantaneous_balance() const {
  const RelaxationSum& m = law_.relaxation;
  Balance b{m.instant(), (m.stiffness.array() * w_).sum(), zero_slopes(), zero_slopes()};
  if (!want_slopes_) return b;
  b.r_by = weighted_slopes(m.stiffness.array());
  for (std::size_t q = 0; q < m.by.size(); ++q) {
    const auto d = m.d_stiffness.col(static_cast<Eigen::Index>(q)).array();
    b.a_by[m.by[q]] += m.d_constant[static_cast<Eigen::Index>(q)] + d.sum();
    b.r_by[m.by[q]] += (d * w_).sum();
  }
  return b;
}

ContactHistory::Balance ContactHistory::balance_over_step(double h) const {
  const RelaxationSum& m = law_.relaxation;
  const StepWeights& k = weights_;
  const Point& begin = now_;
  const Eigen::ArrayXd kept = k.r * w_ + k.b.front() * begin.v;
  const auto stiffness = m.stiffness.array();
  Balance b{m.constant + m.dashpot / h + (stiffness * (1.0 - k.b.back())).sum(),
            m.dashpot / h * begin.v + (stiffness * kept).sum(), zero_slopes(), zero_slopes()};
  if (!want_slopes_) return b;
  b.r_by = weighted_slopes(stiffness * k.r) +
           ((stiffness * k.b.front()).sum() + m.dashpot / h) * begin.v_by;
  for (std::size_t j = 0; j < m.rate_parameter.size(); ++j) {
    const int tau = m.rate_parameter[j];
    if (tau < 0) continue;
    const auto row = static_cast<Eigen::Index>(j);
    const double scale = m.stiffness[row] * m.rate_per_s[row];
    b.a_by[tau] -= scale * k.each[j].d_b.back();
    b.r_by[tau] += scale * (k.each[j].d_r * w_[row] + k.each[j].d_b.front() * begin.v);
  }
  for (std::size_t q = 0; q < m.by.size(); ++q) {
    const auto column = static_cast<Eigen::Index>(q);
    const auto d = m.d_stiffness.col(column).array();
    b.a_by[m.by[q]] +=
        m.d_constant[column] + m.d_dashpot[column] / h + (d * (1.0 - k.b.back())).sum();
    b.r_by[m.by[q]] += m.d_dashpot[column] / h * begin.v + (d * kept).sum();
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
  KernelShape::Values k{};
  TensionShape::Values t{};
  const auto newton_from = [&](double depth) {
    k = law_.kernel.at(depth);
    t = tension(depth);
    const double excess = balance.a * k.value + law_.k_tension * t.value - right;
    return depth - excess / (balance.a * k.slope + law_.k_tension * t.slope);
  };
  // So is one step from anywhere, and the depth of before is near.
  if (law_.k_tension > 0.0 && now_.u > 0.0) {
    const double nearer = newton_from(now_.u);
    if (nearer > 0.0 && nearer < u) u = nearer;
  }
  constexpr int kMostNewtonSteps = 200;
  double next = newton_from(u);
  for (int i = 0; law_.k_tension > 0.0 && next < u && i < kMostNewtonSteps; ++i) {
    u = next;
    next = newton_from(u);
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
  relax_fully();
  free_ = false;
}

void ContactHistory::jump_to_drive(double drive) {
  now_ = imposed(drive, false);
  v_rate_ = 0.0;
  v_rate_by_.setZero();
  free_ = elastic_force(now_.v, now_.u, w_, 0.0) < 0.0;
  if (!free_) return;
  carry_all_slopes();
  now_ = surface_under(0.0, instantaneous_balance(), false);
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
  if (part > kQuartic && level < kMostHalvings && law_.kernel.quartic_error(a, b) > v_tolerance_) {
    const double middle = 0.5 * (from + to);
    move_smooth(from, middle, 0.5 * h, time_scale, level + 1);
    move_smooth(middle, to, 0.5 * h, time_scale, level + 1);
    return;
  }
  move_piece(from, to, h, time_scale, !free_ && part > kStraight);
}

void ContactHistory::move_piece(double from, double to, double h, double time_scale, bool curved) {
  const bool touching = std::max(from, to) > law_.contact;
  const Point end = imposed(to, touching);
  update_weights(h, time_scale, curved);
  // dV/dt at the end of the step, for a dashpot.
  double v_rate = (end.v - now_.v) / h;
  Slopes v_rate_by = (end.v_by - now_.v_by) / h;
  if (curved) {
    const std::array<Point, 3> middle{imposed(0.75 * from + 0.25 * to, touching),
                                      imposed(0.5 * (from + to), touching),
                                      imposed(0.25 * from + 0.75 * to, touching)};
    step_branches(now_, middle, end);
    // Five-point backward difference.
    v_rate = (3.0 * now_.v - 16.0 * middle[0].v + 36.0 * middle[1].v - 48.0 * middle[2].v +
              25.0 * end.v) /
             (3.0 * h);
    v_rate_by = (3.0 * now_.v_by - 16.0 * middle[0].v_by + 36.0 * middle[1].v_by -
                 48.0 * middle[2].v_by + 25.0 * end.v_by) /
                (3.0 * h);
  } else {
    step_branches(now_, {}, end);
  }
  if (elastic_force(end.v, end.u, w_next_, v_rate) >= 0.0) {
    free_ = false;
    accept(end, v_rate, v_rate_by);
    return;
  }
  free_ = true;
  carry_all_slopes();
  update_weights(h, time_scale, false);
  move_to_surface(surface_under(0.0, balance_over_step(h), false), h);
}

/// The surface moved within h to where its balance puts it.
void ContactHistory::move_to_surface(const Point& surface, double h) {
  step_branches(now_, {}, surface);
  accept(surface, (surface.v - now_.v) / h, (surface.v_by - now_.v_by) / h);
}

}  // namespace tpm::law
