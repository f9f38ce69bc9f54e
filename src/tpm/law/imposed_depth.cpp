#include "tpm/law/imposed_depth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace tpm {
namespace {

enum class Course { straight, cubic, quartic };

/// A part of a step over which V(u(t)) is a straight line or a polynomial. Depths are those of the
/// drive below `contact`, negative above the surface.
struct Piece {
  double from, to, h;
  Course course;
};

/// Pieces of one length share the weights of their steps.
struct StepClass {
  double h;
  bool curved;
};

/// Neighbouring pieces of one class.
struct Run {
  Eigen::Index first, last;  ///< last is the first one of the next run
  std::size_t step_class;
  bool uneven;  ///< their lengths differ by more than rounding
};

/// Steps that differ by less have weights of first order in the difference: off by its square.
/// Their derivatives by the times are those of the step they differ from.
constexpr double kNearlyEqual = 3e-6;

/// All pieces of a path at one contact depth, sorted into runs.
class Pieces {
 public:
  Pieces(const KernelShape& kernel, double contact, const DrivePath& path);

  [[nodiscard]] Eigen::Index count() const { return std::ssize(pieces_); }
  [[nodiscard]] const Piece& operator[](Eigen::Index k) const {
    return pieces_[static_cast<std::size_t>(k)];
  }
  [[nodiscard]] const std::vector<Run>& runs() const { return runs_; }
  [[nodiscard]] const std::vector<StepClass>& classes() const { return classes_; }
  /// Lengths of the pieces over those of their class, less 1.
  [[nodiscard]] const Eigen::ArrayXd& off_length() const { return off_length_; }
  /// How many pieces the first `steps` steps have.
  [[nodiscard]] Eigen::Index after(std::size_t steps) const {
    return steps == 0 ? 0 : after_step_[steps - 1];
  }

 private:
  void add_step(double from, double to, double h);
  void add_stretch(double from, double to, double h, int level);
  [[nodiscard]] bool is_quartic(double from, double to) const;
  void sort_into_runs(double same);
  [[nodiscard]] std::size_t class_of(const Piece& piece, double same, std::size_t guess);

  const KernelShape& kernel_;
  double v_tolerance_ = 0.0;
  std::vector<Piece> pieces_;
  std::vector<Eigen::Index> after_step_;
  std::vector<Run> runs_;
  std::vector<StepClass> classes_;
  Eigen::ArrayXd off_length_;
};

Pieces::Pieces(const KernelShape& kernel, double contact, const DrivePath& path) : kernel_(kernel) {
  constexpr double kRelativeTolerance = 1e-10;
  double peak = path.start;
  for (const DriveStep& step : path.steps) peak = std::max(peak, step.to);
  v_tolerance_ = kRelativeTolerance * std::max(kernel.value(std::max(peak - contact, 0.0)),
                                               std::numeric_limits<double>::min());
  pieces_.reserve(path.steps.size() + 16);
  after_step_.reserve(path.steps.size());
  for (const DriveStep& step : path.steps) {
    add_step(step.from - contact, step.to - contact, step.h);
    after_step_.push_back(std::ssize(pieces_));
  }
  sort_into_runs(4.0 * std::numeric_limits<double>::epsilon() * path.time_scale);
}

/// V has a kink where the probe meets or leaves the undeformed surface.
void Pieces::add_step(double from, double to, double h) {
  if (from * to < 0.0) {
    const double share = from / (from - to);
    add_stretch(from, 0.0, h * share, 0);
    add_stretch(0.0, to, h * (1.0 - share), 0);
  } else {
    add_stretch(from, to, h, 0);
  }
}

void Pieces::add_stretch(double from, double to, double h, int level) {
  if (!(h > 0.0)) return;
  if (kernel_.is_linear()) {
    pieces_.push_back({from, to, h, Course::straight});
    return;
  }
  // Kernels are powers of the depth: over a small part of it a straight line, or a polynomial,
  // holds to 1e-10.
  constexpr double kStraight = 3e-6;
  constexpr double kQuartic = 0.05;
  constexpr int kMostHalvings = 60;
  const double a = std::max(from, 0.0);
  const double b = std::max(to, 0.0);
  const double part = std::abs(b - a) / std::min(a, b);
  if (part > kQuartic && level < kMostHalvings && !is_quartic(a, b)) {
    const double middle = 0.5 * (from + to);
    add_stretch(from, middle, 0.5 * h, level + 1);
    add_stretch(middle, to, 0.5 * h, level + 1);
    return;
  }
  const Course course = part > kCubicPart  ? Course::quartic
                        : part > kStraight ? Course::cubic
                                           : Course::straight;
  pieces_.push_back({from, to, h, course});
}

/// The polynomial through five values is compared at 1/8 and 7/8, where its error is largest.
bool Pieces::is_quartic(double a, double b) const {
  const double v0 = kernel_.value(a);
  const double v1 = kernel_.value(0.75 * a + 0.25 * b);
  const double v2 = kernel_.value(0.5 * (a + b));
  const double v3 = kernel_.value(0.25 * a + 0.75 * b);
  const double v4 = kernel_.value(b);
  const double early = (35.0 * v0 + 140.0 * v1 - 70.0 * v2 + 28.0 * v3 - 5.0 * v4) / 128.0;
  const double late = (-5.0 * v0 + 28.0 * v1 - 70.0 * v2 + 140.0 * v3 + 35.0 * v4) / 128.0;
  const double off = std::max(std::abs(early - kernel_.value(0.875 * a + 0.125 * b)),
                              std::abs(late - kernel_.value(0.125 * a + 0.875 * b)));
  return off <= v_tolerance_;
}

std::size_t Pieces::class_of(const Piece& piece, double same, std::size_t guess) {
  const bool curved = piece.course != Course::straight;
  const auto fits = [&](std::size_t i) {
    const StepClass& c = classes_[i];
    return c.curved == curved &&
           std::abs(piece.h - c.h) <= std::max(same, kNearlyEqual * std::min(c.h, piece.h));
  };
  if (guess < classes_.size() && fits(guess)) return guess;
  constexpr std::size_t kRemembered = 8;
  for (std::size_t i = classes_.size(); i > 0 && i + kRemembered > classes_.size(); --i) {
    if (fits(i - 1)) return i - 1;
  }
  classes_.push_back({piece.h, curved});
  return classes_.size() - 1;
}

void Pieces::sort_into_runs(double same) {
  off_length_.setZero(count());
  std::size_t current = 0;
  for (Eigen::Index k = 0; k < count(); ++k) {
    const Piece& piece = (*this)[k];
    current = class_of(piece, same, current);
    const double h = classes_[current].h;
    const bool uneven = std::abs(piece.h - h) > same;
    if (uneven) off_length_[k] = piece.h / h - 1.0;
    if (runs_.empty() || runs_.back().step_class != current) {
      runs_.push_back({k, k, current, false});
    }
    runs_.back().last = k + 1;
    runs_.back().uneven = runs_.back().uneven || uneven;
  }
}

/// V(u) along the pieces in the first column, its derivatives by the kernel's parameters in the
/// others.
class KernelTables {
 public:
  KernelTables(const LawAtParameters& law, const Pieces& pieces, double start, Want want);

  /// Parameter of each column after the first.
  [[nodiscard]] const std::vector<int>& parameters() const { return parameters_; }

  Eigen::ArrayXXd begin;                  ///< a row for each piece
  Eigen::ArrayXXd end;                    ///< row 0 is the start, row k + 1 the end of piece k
  std::array<Eigen::ArrayXXd, 3> middle;  ///< within curved pieces; other rows are 0

 private:
  using Row = Eigen::Array<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, 6>;

  [[nodiscard]] Row row_of(const KernelShape::Values& k, bool touching) const;
  [[nodiscard]] Row slopes_of(const KernelShape::Tangent& k) const;
  void fill(const Pieces& pieces, double start);
  void fill_straight_kernel(const Pieces& pieces, double start);
  void fill_middle(Eigen::Index k, const Piece& piece, const KernelShape::Jet& from,
                   const KernelShape::Jet& to);

  const LawAtParameters& law_;
  std::vector<int> parameters_;
};

KernelTables::KernelTables(const LawAtParameters& law, const Pieces& pieces, double start,
                           Want want)
    : law_(law) {
  const KernelPlaces& p = law.place;
  if (want == Want::values_and_sensitivity) {
    for (const int place : {p.exponent, p.tension_share}) {
      if (place >= 0) parameters_.push_back(place);
    }
    if (p.tension_share >= 0) parameters_.push_back(p.spacing);
    parameters_.push_back(p.contact);
  }
  const Eigen::Index columns = 1 + std::ssize(parameters_);
  begin.resize(pieces.count(), columns);
  end.resize(pieces.count() + 1, columns);
  if (law.kernel.is_linear() && columns <= 2) {
    fill_straight_kernel(pieces, start);
    return;
  }
  if (!law.kernel.is_linear()) {
    for (auto& table : middle) table.setZero(pieces.count(), columns);
  }
  fill(pieces, start);
}

/// @param touching at u = 0 the slope just inside the contact is meant, not just outside
KernelTables::Row KernelTables::row_of(const KernelShape::Values& k, bool touching) const {
  Row row(begin.cols());
  Eigen::Index c = 0;
  row[c++] = k.value;
  if (row.size() == 1) return row;
  if (law_.place.exponent >= 0) row[c++] = k.d_exponent;
  if (law_.place.tension_share >= 0) {
    row[c++] = k.d_share;
    row[c++] = k.d_spacing;
  }
  row[c] = touching ? -k.slope : 0.0;
  return row;
}

/// d/du of what row_of gives, the last column (contact) apart.
KernelTables::Row KernelTables::slopes_of(const KernelShape::Tangent& k) const {
  return row_of({k.slope, 0.0, k.d_exponent, k.d_share, k.d_spacing}, false);
}

void KernelTables::fill_straight_kernel(const Pieces& pieces, double start) {
  const bool slopes = begin.cols() > 1;
  end(0, 0) = std::max(start, 0.0);
  if (slopes) end(0, 1) = start > 0.0 ? -1.0 : 0.0;
  for (Eigen::Index k = 0; k < pieces.count(); ++k) {
    const Piece& piece = pieces[k];
    begin(k, 0) = std::max(piece.from, 0.0);
    end(k + 1, 0) = std::max(piece.to, 0.0);
    if (slopes) begin(k, 1) = end(k + 1, 1) = std::max(piece.from, piece.to) > 0.0 ? -1.0 : 0.0;
  }
}

void KernelTables::fill(const Pieces& pieces, double start) {
  KernelShape::Jet from = law_.kernel.jet(std::max(start, 0.0));
  end.row(0) = row_of(from.values, start > 0.0);
  for (Eigen::Index k = 0; k < pieces.count(); ++k) {
    const Piece& piece = pieces[k];
    const bool touching = std::max(piece.from, piece.to) > 0.0;
    const bool cubic = piece.course == Course::cubic ||
                       (k + 1 < pieces.count() && pieces[k + 1].course == Course::cubic);
    const double depth = std::max(piece.to, 0.0);
    const KernelShape::Jet to =
        cubic ? law_.kernel.jet(depth) : KernelShape::Jet{law_.kernel.at(depth), {}};
    begin.row(k) = row_of(from.values, touching);
    end.row(k + 1) = row_of(to.values, touching);
    if (piece.course != Course::straight) fill_middle(k, piece, from, to);
    from = to;
  }
}

void KernelTables::fill_middle(Eigen::Index k, const Piece& piece, const KernelShape::Jet& from,
                               const KernelShape::Jet& to) {
  const double a = std::max(piece.from, 0.0);
  const double b = std::max(piece.to, 0.0);
  if (piece.course == Course::quartic) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double share = 0.25 * static_cast<double>(i + 1);
      middle[i].row(k) = row_of(law_.kernel.at((1.0 - share) * a + share * b), true);
    }
    return;
  }
  const Row slope0 = slopes_of(from.tangent);
  const Row slope1 = slopes_of(to.tangent);
  const Eigen::Index contact = begin.cols() - 1;
  for (Eigen::Index c = 0; c < std::max<Eigen::Index>(contact, 1); ++c) {
    const KernelBetween v = kernel_between(b - a, begin(k, c), slope0[c], end(k + 1, c), slope1[c]);
    for (std::size_t i = 0; i < 3; ++i) {
      middle[i](k, c) = v.value[i];
      if (c == 0 && contact > 0) middle[i](k, contact) = -v.slope[i];
    }
  }
}

/// The states of one branch after each piece: w follows V (column 0) or a derivative of V.
class BranchStates {
 public:
  BranchStates(const Pieces& pieces, const KernelTables& tables)
      : pieces_(pieces), tables_(tables), decay_(pieces.count()), input_(pieces.count()) {}

  void set_rate(double rate_per_s);
  /// @param start the state before the first piece
  void follow(Eigen::Index column, double start, Eigen::ArrayXd& w);
  /// The derivative of w by ln(tau).
  void follow_by_log_time(const Eigen::ArrayXd& w, Eigen::ArrayXd& w_by);

 private:
  void set_input(Eigen::Index column, std::array<double, 5> QuadratureWeights::*b);

  const Pieces& pieces_;
  const KernelTables& tables_;
  std::vector<QuadratureWeights> weights_;  ///< of each class of steps
  Eigen::ArrayXd decay_, input_;
};

void BranchStates::set_rate(double rate_per_s) {
  weights_.clear();
  for (const StepClass& c : pieces_.classes()) {
    const double z = c.h * rate_per_s;
    weights_.push_back(c.curved ? quartic_weights(z) : line_weights(z));
  }
  for (const Run& run : pieces_.runs()) {
    const QuadratureWeights& k = weights_[run.step_class];
    const Eigen::Index n = run.last - run.first;
    decay_.segment(run.first, n).setConstant(k.r);
    if (run.uneven) {
      decay_.segment(run.first, n) -= k.d_r * pieces_.off_length().segment(run.first, n);
    }
  }
}

/// The weighted sum of the column's values in each piece. Weights of pieces that are a little
/// longer than their class follow from the derivatives by ln(tau), d_b = -z db/dz.
void BranchStates::set_input(Eigen::Index column, std::array<double, 5> QuadratureWeights::*b) {
  for (const Run& run : pieces_.runs()) {
    const Eigen::Index n = run.last - run.first;
    const auto begin = tables_.begin.col(column).segment(run.first, n);
    const auto end = tables_.end.col(column).segment(run.first + 1, n);
    const QuadratureWeights& k = weights_[run.step_class];
    const bool curved = pieces_.classes()[run.step_class].curved;
    const auto middle = [&](std::size_t i) {
      return tables_.middle[i].col(column).segment(run.first, n);
    };
    auto input = input_.segment(run.first, n);
    const std::array<double, 5>& w = k.*b;
    input = w[0] * begin + w[4] * end;
    if (curved) input += w[1] * middle(0) + w[2] * middle(1) + w[3] * middle(2);
    if (!run.uneven || b != &QuadratureWeights::b) continue;
    const auto off = pieces_.off_length().segment(run.first, n);
    const std::array<double, 5>& d = k.d_b;
    input -= off * (d[0] * begin + d[4] * end);
    if (curved) input -= off * (d[1] * middle(0) + d[2] * middle(1) + d[3] * middle(2));
  }
}

void BranchStates::follow(Eigen::Index column, double start, Eigen::ArrayXd& w) {
  set_input(column, &QuadratureWeights::b);
  w[0] = start;
  for (Eigen::Index k = 0; k < pieces_.count(); ++k) w[k + 1] = decay_[k] * w[k] + input_[k];
}

void BranchStates::follow_by_log_time(const Eigen::ArrayXd& w, Eigen::ArrayXd& w_by) {
  set_input(0, &QuadratureWeights::d_b);
  for (const Run& run : pieces_.runs()) {
    const Eigen::Index n = run.last - run.first;
    input_.segment(run.first, n) += weights_[run.step_class].d_r * w.segment(run.first, n);
  }
  w_by[0] = 0.0;
  for (Eigen::Index k = 0; k < pieces_.count(); ++k) w_by[k + 1] = decay_[k] * w_by[k] + input_[k];
}

/// Contact force (offset left out) after each piece, and its derivatives, one column each.
class ForceHistory {
 public:
  ForceHistory(const LawAtParameters& law, const Pieces& pieces, const DrivePath& path, Want want);

  Eigen::ArrayXd force;
  Eigen::ArrayXXd by;

 private:
  void add_elastic();
  void add_branches(const Pieces& pieces, bool relaxed);
  void add_branch_slopes(Eigen::Index branch, BranchStates& states, bool relaxed);
  void add_tension(const Pieces& pieces, double start);

  const LawAtParameters& law_;
  bool want_slopes_;
  KernelTables tables_;
  Eigen::ArrayXd w_, other_;
};

ForceHistory::ForceHistory(const LawAtParameters& law, const Pieces& pieces, const DrivePath& path,
                           Want want)
    : law_(law),
      want_slopes_(want == Want::values_and_sensitivity),
      tables_(law, pieces, path.start - law.contact, want),
      w_(pieces.count() + 1),
      other_(pieces.count() + 1) {
  force = law.memory.constant * tables_.end.col(0);
  if (want_slopes_) {
    by.setZero(force.size(), law.parameter_count);
    add_elastic();
  }
  add_branches(pieces, path.relaxed);
  if (law.place.k_tension >= 0) add_tension(pieces, path.start - law.contact);
}

void ForceHistory::add_elastic() {
  const Memory& m = law_.memory;
  by.col(law_.place.offset).setOnes();
  for (std::size_t c = 0; c < tables_.parameters().size(); ++c) {
    by.col(tables_.parameters()[c]) +=
        m.instant() * tables_.end.col(static_cast<Eigen::Index>(c) + 1);
  }
  for (std::size_t q = 0; q < m.by.size(); ++q) {
    const double d = m.d_constant[static_cast<Eigen::Index>(q)];
    if (d != 0.0) by.col(m.by[q]) += d * tables_.end.col(0);
  }
}

void ForceHistory::add_branches(const Pieces& pieces, bool relaxed) {
  const Memory& m = law_.memory;
  BranchStates states(pieces, tables_);
  for (Eigen::Index j = 0; j < m.stiffness.size(); ++j) {
    states.set_rate(m.rate_per_s[j]);
    states.follow(0, relaxed ? tables_.end(0, 0) : 0.0, w_);
    other_ = tables_.end.col(0) - w_;
    force += m.stiffness[j] * other_;
    if (want_slopes_) add_branch_slopes(j, states, relaxed);
  }
}

/// w_ holds the states of the branch, other_ V less these.
void ForceHistory::add_branch_slopes(Eigen::Index branch, BranchStates& states, bool relaxed) {
  const Memory& m = law_.memory;
  for (std::size_t q = 0; q < m.by.size(); ++q) {
    const double d = m.d_stiffness(branch, static_cast<Eigen::Index>(q));
    if (d != 0.0) by.col(m.by[q]) += d * other_;
  }
  const double stiffness = m.stiffness[branch];
  states.follow_by_log_time(w_, other_);
  by.col(m.rate_parameter[static_cast<std::size_t>(branch)]) -=
      stiffness * m.rate_per_s[branch] * other_;
  for (std::size_t c = 0; c < tables_.parameters().size(); ++c) {
    const auto column = static_cast<Eigen::Index>(c) + 1;
    states.follow(column, relaxed ? tables_.end(0, column) : 0.0, other_);
    by.col(tables_.parameters()[c]) -= stiffness * other_;
  }
}

void ForceHistory::add_tension(const Pieces& pieces, double start) {
  const KernelPlaces& p = law_.place;
  for (Eigen::Index k = 0; k < force.size(); ++k) {
    const TensionShape::Values t =
        law_.tension.at(std::max(k == 0 ? start : pieces[k - 1].to, 0.0));
    force[k] += law_.k_tension * t.value;
    if (!want_slopes_) continue;
    by(k, p.k_tension) += t.value;
    by(k, p.spacing) += law_.k_tension * t.d_spacing;
    by(k, p.contact) -= law_.k_tension * t.slope;
  }
}

}  // namespace

KernelBetween kernel_between(double depth_change, double v0, double slope0, double v1,
                             double slope1) {
  const double m0 = depth_change * slope0;
  const double m1 = depth_change * slope1;
  const double rise = v1 - v0;
  return {{v0 + 0.15625 * rise + 0.140625 * m0 - 0.046875 * m1, v0 + 0.5 * rise + 0.125 * (m0 - m1),
           v0 + 0.84375 * rise + 0.046875 * m0 - 0.140625 * m1},
          {(1.125 * rise + 0.1875 * m0 - 0.3125 * m1) / depth_change,
           (1.5 * rise - 0.25 * (m0 + m1)) / depth_change,
           (1.125 * rise - 0.3125 * m0 + 0.1875 * m1) / depth_change}};
}

std::optional<DrivePath> drive_path(const Protocol& protocol, std::span<const double> times_s) {
  const auto knots = protocol.knots();
  DrivePath path;
  path.start = knots.front().value;
  path.relaxed = protocol.relaxed_at_start();
  path.time_scale = std::max(std::abs(knots.front().time_s), std::abs(knots.back().time_s));
  path.steps.reserve(knots.size() + times_s.size());
  path.steps_before.reserve(times_s.size());
  if (!std::is_sorted(times_s.begin(), times_s.end())) return std::nullopt;
  if (times_s.empty() || std::isinf(times_s.back())) return std::nullopt;
  Knot at = knots.front();
  const auto go_to = [&](double time_s, double value) {
    if (time_s > at.time_s) path.steps.push_back({at.value, value, time_s - at.time_s});
    at = {time_s, value};
  };
  std::size_t next = 1;
  for (const double time : times_s) {
    for (; next < knots.size() && knots[next].time_s <= time; ++next) {
      if (knots[next].time_s == knots[next - 1].time_s) return std::nullopt;
      go_to(knots[next].time_s, knots[next].value);
    }
    if (next == knots.size()) {
      go_to(time, at.value);
    } else if (time > at.time_s) {
      const Knot& from = knots[next - 1];
      const double share = (time - from.time_s) / (knots[next].time_s - from.time_s);
      go_to(time, from.value + (knots[next].value - from.value) * share);
    }
    path.steps_before.push_back(path.steps.size());
  }
  return path;
}

std::optional<Response> respond_in_contact(const LawAtParameters& law, const DrivePath& path,
                                           Want want) {
  const Pieces pieces(law.kernel, law.contact, path);
  const ForceHistory history(law, pieces, path, want);
  if (!(history.force.tail(history.force.size() - 1) >= 0.0).all()) return std::nullopt;
  Response response;
  const auto n = std::ssize(path.steps_before);
  response.value.resize(n);
  if (want == Want::values_and_sensitivity) response.sensitivity.resize(n, law.parameter_count);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index k = pieces.after(path.steps_before[static_cast<std::size_t>(i)]);
    response.value[i] = law.offset + history.force[k];
    if (want == Want::values_and_sensitivity) {
      response.sensitivity.row(i) = history.by.row(k).matrix();
    }
  }
  return response;
}

}  // namespace tpm
