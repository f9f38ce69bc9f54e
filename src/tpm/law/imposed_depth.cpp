#include "tpm/law/imposed_depth.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "tpm/law/depth_pieces.hpp"
#include "tpm/law/kernel_tables.hpp"
#include "tpm/law/relaxation/exponential_quadrature.hpp"

namespace tpm::law {
namespace {

/// The states of one branch after each piece: w follows V (column 0) or a derivative of V.
class BranchStates {
 public:
  BranchStates(const DepthPieces& pieces, const KernelTables& tables)
      : pieces_(pieces), tables_(tables), decay_(pieces.count()), input_(pieces.count()) {}

  void set_rate(double rate_per_s);
  /// @param start the state before the first piece
  void follow(Eigen::Index column, double start, Eigen::ArrayXd& w);
  /// The derivative of w by ln(tau).
  void follow_by_log_time(const Eigen::ArrayXd& w, Eigen::ArrayXd& w_by);

 private:
  void set_input(Eigen::Index column, std::array<double, 5> QuadratureWeights::*b);

  const DepthPieces& pieces_;
  const KernelTables& tables_;
  std::vector<QuadratureWeights> weights_;  ///< of each class of steps
  Eigen::ArrayXd decay_, input_;
};

void BranchStates::set_rate(double rate_per_s) {
  weights_.clear();
  for (const PieceClass& c : pieces_.classes()) {
    const double z = c.h * rate_per_s;
    weights_.push_back(c.curved ? quartic_weights(z) : line_weights(z));
  }
  for (const PieceRun& run : pieces_.runs()) {
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
  for (const PieceRun& run : pieces_.runs()) {
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
  for (const PieceRun& run : pieces_.runs()) {
    const Eigen::Index n = run.last - run.first;
    input_.segment(run.first, n) += weights_[run.step_class].d_r * w.segment(run.first, n);
  }
  w_by[0] = 0.0;
  for (Eigen::Index k = 0; k < pieces_.count(); ++k) w_by[k + 1] = decay_[k] * w_by[k] + input_[k];
}

/// Contact force (offset left out) after each piece, and its derivatives, one column each.
class ForceHistory {
 public:
  ForceHistory(const LawAtParameters& law, const DepthPieces& pieces, const DrivePath& path,
               Want want);

  Eigen::ArrayXd force;
  Eigen::ArrayXXd by;

 private:
  void add_elastic();
  void add_branches(const DepthPieces& pieces, bool relaxed);
  void add_branch_slopes(Eigen::Index branch, BranchStates& states, bool relaxed);
  void add_tension(const DepthPieces& pieces, double start);

  const LawAtParameters& law_;
  bool want_slopes_;
  KernelTables tables_;
  Eigen::ArrayXd w_, other_;
};

ForceHistory::ForceHistory(const LawAtParameters& law, const DepthPieces& pieces,
                           const DrivePath& path, Want want)
    : law_(law),
      want_slopes_(want == Want::values_and_sensitivity),
      tables_(law, pieces, path.start - law.contact, want),
      w_(pieces.count() + 1),
      other_(pieces.count() + 1) {
  force = law.relaxation.constant * tables_.end.col(0);
  if (want_slopes_) {
    by.setZero(force.size(), law.parameter_count);
    add_elastic();
  }
  add_branches(pieces, path.relaxed);
  if (law.place.k_tension >= 0) add_tension(pieces, path.start - law.contact);
}

void ForceHistory::add_elastic() {
  const RelaxationSum& m = law_.relaxation;
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

void ForceHistory::add_branches(const DepthPieces& pieces, bool relaxed) {
  const RelaxationSum& m = law_.relaxation;
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
  const RelaxationSum& m = law_.relaxation;
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

void ForceHistory::add_tension(const DepthPieces& pieces, double start) {
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

std::optional<Response> respond_in_contact(const LawAtParameters& law, const DrivePath& path,
                                           Want want) {
  const DepthPieces pieces(law.kernel, law.contact, path);
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

}  // namespace tpm::law
