#include "tpm/law/imposed_load.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tpm::law {
namespace {

/// Branches below this part of the instantaneous stiffness count with it: the derivative by the
/// root of a stiffness means nothing at 0.
constexpr double kLeastShare = 1e-12;

/// Eigenvalues this close, relative to the larger, count as one in a divided difference.
constexpr double kConfluent = 1e-5;

constexpr std::size_t kTerms = 20;

/// (-1)^j / (j! (a + 1 + j)): the coefficients of z^j in int_0^1 exp(-z x) x^a dx.
constexpr std::array<std::array<double, kTerms>, 3> moment_series() {
  std::array<std::array<double, kTerms>, 3> series{};
  double power = 1.0;  // (-1)^j / j!
  for (std::size_t j = 0; j < kTerms; ++j) {
    for (std::size_t a = 0; a < 3; ++a) series[a][j] = power / static_cast<double>(a + 1 + j);
    power /= -static_cast<double>(j + 1);
  }
  return series;
}

constexpr auto kMomentSeries = moment_series();

/// int_0^1 exp(-z x) x^a dx for a = 0, 1, 2.
std::array<double, 3> exponential_moments(double z, double decay) {
  std::array<double, 3> moments{};
  constexpr double kSeries = 1.0;
  if (z > kSeries) {
    moments[0] = -std::expm1(-z) / z;
    for (int a = 1; a < 3; ++a) {
      moments[static_cast<std::size_t>(a)] =
          (a * moments[static_cast<std::size_t>(a) - 1] - decay) / z;
    }
    return moments;
  }
  for (std::size_t a = 0; a < 3; ++a) {
    const std::array<double, kTerms>& c = kMomentSeries[a];
    double sum = c[kTerms - 1];
    for (std::size_t j = kTerms - 1; j-- > 0;) sum = sum * z + c[j];
    moments[a] = sum;
  }
  return moments;
}

/// Rotates columns until they are orthogonal (one-sided Jacobi), which finds small singular values
/// as exactly as large ones: relaxation times span many decades. Returns the rotation.
Eigen::MatrixXd orthogonal_columns(Eigen::MatrixXd& f) {
  constexpr int kMostSweeps = 60;
  const Eigen::Index n = f.cols();
  Eigen::MatrixXd rotation = Eigen::MatrixXd::Identity(n, n);
  bool rotated = true;
  for (int sweep = 0; rotated && sweep < kMostSweeps; ++sweep) {
    rotated = false;
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = i + 1; j < n; ++j) {
        const double a = f.col(i).squaredNorm();
        const double b = f.col(j).squaredNorm();
        const double g = f.col(i).dot(f.col(j));
        if (std::abs(g) <= std::numeric_limits<double>::epsilon() * std::sqrt(a * b)) continue;
        rotated = true;
        const double zeta = (b - a) / (2.0 * g);
        const double t = std::copysign(1.0, zeta) / (std::abs(zeta) + std::hypot(1.0, zeta));
        const double c = 1.0 / std::hypot(1.0, t);
        for (Eigen::MatrixXd* matrix : {&f, &rotation}) {
          const Eigen::VectorXd old = matrix->col(i);
          matrix->col(i) = c * old - c * t * matrix->col(j);
          matrix->col(j) = c * t * old + c * matrix->col(j);
        }
      }
    }
  }
  return rotation;
}

}  // namespace

bool LoadedSurface::answers(const LawAtParameters& law) {
  const auto& rates = law.relaxation.rate_parameter;
  const bool fixed_rates = std::find(rates.begin(), rates.end(), -1) != rates.end();
  return law.place.k_tension < 0 && !fixed_rates && law.relaxation.dashpot == 0.0 &&
         law.relaxation.instant() > 0.0;
}

LoadedSurface::LoadedSurface(const LawAtParameters& law, Want want)
    : law_(law),
      want_slopes_(want == Want::values_and_sensitivity),
      sum_(law.relaxation.instant()),
      stiffness_(law.relaxation.stiffness.cwiseMax(kLeastShare * sum_)),
      rate_(law.relaxation.rate_per_s),
      q_(stiffness_.cwiseProduct(rate_).cwiseSqrt()) {
  const Eigen::Index n = rate_.size();
  // -K = F'F with F = (1 - b p p') sqrt(rates), p = q/sqrt(A rates), b p'p = 1 - sqrt(1 - p'p).
  const Eigen::VectorXd p = stiffness_.cwiseSqrt() / std::sqrt(sum_);
  const double rest = std::sqrt(std::max(law.relaxation.constant, 0.0) / sum_);
  Eigen::MatrixXd f = Eigen::MatrixXd::Identity(n, n);
  if (n > 0) f -= p * p.transpose() * ((1.0 - rest) / p.squaredNorm());
  f = f * rate_.cwiseSqrt().asDiagonal();
  eigenvector_ = orthogonal_columns(f);
  eigenvalue_ = -f.colwise().squaredNorm().transpose();
  weight_ = eigenvector_.transpose() * q_;
  // A law without a plateau flows: rounding must not make it relax.
  if (n > 0 && law.relaxation.constant == 0.0) {
    Eigen::Index slowest = 0;
    eigenvalue_.maxCoeff(&slowest);
    eigenvalue_[slowest] = 0.0;
  }
  for (Integrals* integrals : {&under_load_, &under_offset_}) {
    integrals->value.setZero(n);
    integrals->by_rate.setZero(n);
  }
  moments_.resize(static_cast<std::size_t>(n));
  if (!want_slopes_) return;
  const RelaxationSum& m = law.relaxation;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(n);
  for (std::size_t i = 0; i < m.by.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const Eigen::VectorXd d_stiffness = m.d_stiffness.col(column);
    add_direction(m.by[i], m.d_constant[column] + d_stiffness.sum(), d_stiffness, none);
  }
  for (Eigen::Index j = 0; j < n; ++j) {
    Eigen::VectorXd d_rate = none;
    d_rate[j] = -rate_[j] * rate_[j];  // by the time
    add_direction(m.rate_parameter[static_cast<std::size_t>(j)], 0.0, none, d_rate);
  }
}

/// dK in the eigenvectors is (e c' + c e')/A - c c' dA/A^2 - U' d(rates) U with e = U' dq, c = U'
/// q.
void LoadedSurface::add_direction(int parameter, double d_sum, const Eigen::VectorXd& d_stiffness,
                                  const Eigen::VectorXd& d_rate) {
  const Eigen::VectorXd d_q =
      (d_stiffness.cwiseProduct(rate_) + stiffness_.cwiseProduct(d_rate)).cwiseQuotient(2.0 * q_);
  const Eigen::VectorXd& c = weight_;
  Direction d{parameter, d_sum, {}, {}};
  if (q_.size() > 0) {
    const Eigen::VectorXd e = eigenvector_.transpose() * d_q;
    const Eigen::MatrixXd d_k = (e * c.transpose() + c * e.transpose()) / sum_ -
                                c * c.transpose() * (d_sum / (sum_ * sum_)) -
                                eigenvector_.transpose() * d_rate.asDiagonal() * eigenvector_;
    d.first = 2.0 * (e.array() * c.array());
    d.both = c.asDiagonal() * d_k * c.asDiagonal();
  }
  directions_.push_back(std::move(d));
}

void LoadedSurface::set_moments(double h) {
  if (h == h_) return;
  h_ = h;
  for (std::size_t m = 0; m < moments_.size(); ++m) {
    const double z = -eigenvalue_[static_cast<Eigen::Index>(m)] * h;
    const double decay = std::exp(-z);
    moments_[m] = {decay, exponential_moments(z, decay)};
  }
}

/// The integral over the step of exp(lambda (h - s)) times the line from `from` to `to`.
void LoadedSurface::advance(Integrals& integrals, double from, double to, double h) const {
  for (std::size_t m = 0; m < moments_.size(); ++m) {
    const auto row = static_cast<Eigen::Index>(m);
    const auto& [decay, of] = moments_[m];
    double& value = integrals.value[row];
    double& by_rate = integrals.by_rate[row];
    by_rate = decay * (by_rate + h * value) + h * h * (from * of[2] + to * (of[1] - of[2]));
    value = decay * value + h * (from * of[1] + to * (of[0] - of[1]));
  }
}

void LoadedSurface::rest_at(double load) {
  const double carried = load - law_.offset;
  if (!(carried > 0.0)) {
    arrive(carried);
    return;
  }
  if (!(law_.relaxation.constant > 0.0)) {
    in_contact_ = false;  // it has sunk for ever
    return;
  }
  untouched_ = false;
  for (const auto& [integrals, value] :
       {std::pair(&under_load_, carried), {&under_offset_, -1.0}}) {
    integrals->value = -value / eigenvalue_.array();
    integrals->by_rate = value / eigenvalue_.array().square();
  }
  arrive(carried);
}

void LoadedSurface::jump_to(double load) {
  arrive(load - law_.offset);
}

void LoadedSurface::move(double from, double to, double h) {
  double begin = from - law_.offset;
  const double end = to - law_.offset;
  if (untouched_ && !(end > 0.0)) {
    arrive(end);
    return;
  }
  if (untouched_ && begin < 0.0) {
    h *= end / (end - begin);
    begin = 0.0;
  }
  untouched_ = false;
  set_moments(h);
  advance(under_load_, begin, end, h);
  if (want_slopes_) advance(under_offset_, -1.0, -1.0, h);
  arrive(end);
}

/// The depth under the load of now.
void LoadedSurface::arrive(double load) {
  load_ = load;
  if (untouched_ && !(load > 0.0)) {
    v_ = u_ = 0.0;
    return;
  }
  untouched_ = false;
  v_ = load / sum_;
  if (weight_.size() > 0) {
    v_ += (weight_.array().square() * under_load_.value).sum() / (sum_ * sum_);
  }
  in_contact_ = in_contact_ && v_ >= 0.0;
  u_ = in_contact_ ? law_.kernel.inverse(v_) : 0.0;
}

double LoadedSurface::divided_difference(Eigen::Index m, Eigen::Index l) const {
  const Eigen::ArrayXd& by_rate = under_load_.by_rate;
  const double gap = eigenvalue_[m] - eigenvalue_[l];
  const double size = std::max(std::abs(eigenvalue_[m]), std::abs(eigenvalue_[l]));
  if (std::abs(gap) <= kConfluent * size) return 0.5 * (by_rate[m] + by_rate[l]);
  return (under_load_.value[m] - under_load_.value[l]) / gap;
}

Slopes LoadedSurface::drive_slopes() const {
  Slopes slopes = Slopes::Zero(law_.parameter_count);
  slopes[law_.place.contact] = 1.0;
  if (!(v_ > 0.0)) return slopes;
  const KernelShape::Values k = law_.kernel.at(u_);
  const double square = sum_ * sum_;
  const Eigen::Index n = weight_.size();
  Eigen::MatrixXd differences(n, n);
  for (Eigen::Index m = 0; m < n; ++m) {
    for (Eigen::Index l = 0; l <= m; ++l) {
      differences(m, l) = differences(l, m) = divided_difference(m, l);
    }
  }
  const double integral = square * (v_ - load_ / sum_);  // sum of weight^2 times the integrals
  for (const Direction& d : directions_) {
    double dv = -d.d_sum / square * (load_ + 2.0 * integral / sum_);
    if (n > 0) {
      dv += ((d.first * under_load_.value).sum() + d.both.cwiseProduct(differences).sum()) / square;
    }
    slopes[d.parameter] += dv / k.slope;
  }
  double by_offset = -1.0 / sum_;
  if (n > 0) by_offset += (weight_.array().square() * under_offset_.value).sum() / square;
  slopes[law_.place.offset] += by_offset / k.slope;
  const KernelPlaces& p = law_.place;
  if (p.exponent >= 0) slopes[p.exponent] -= k.d_exponent / k.slope;
  if (p.tension_share >= 0) {
    slopes[p.tension_share] -= k.d_share / k.slope;
    slopes[p.spacing] -= k.d_spacing / k.slope;
  }
  return slopes;
}

}  // namespace tpm::law
