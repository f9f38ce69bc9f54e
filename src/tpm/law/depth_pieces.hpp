#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <iterator>
#include <vector>

#include "tpm/law/drive_path.hpp"
#include "tpm/law/kernel.hpp"

namespace tpm::law {

/// Course of V(u) over a piece: straight, the cubic through values and slopes at both ends
/// (kernel_between), or the quartic through five values.
enum class PieceCourse { straight, cubic, quartic };

/// A part of a step over which V(u(t)) is a straight line or a polynomial. Depths are those of the
/// drive below `contact`, negative above the surface.
struct DepthPiece {
  double from, to, h;
  PieceCourse course;
};

/// Pieces of one length share the weights of their steps.
struct PieceClass {
  double h;
  bool curved;
};

/// Neighbouring pieces of one class.
struct PieceRun {
  Eigen::Index first, last;  ///< last is the first one of the next run
  std::size_t step_class;
  bool uneven;  ///< their lengths differ by more than rounding
};

/// All pieces of a path at one contact depth, sorted into runs.
class DepthPieces {
 public:
  DepthPieces(const KernelShape& kernel, double contact, const DrivePath& path);

  [[nodiscard]] Eigen::Index count() const { return std::ssize(pieces_); }
  [[nodiscard]] const DepthPiece& operator[](Eigen::Index k) const {
    return pieces_[static_cast<std::size_t>(k)];
  }
  [[nodiscard]] const std::vector<PieceRun>& runs() const { return runs_; }
  [[nodiscard]] const std::vector<PieceClass>& classes() const { return classes_; }
  /// Lengths of the pieces over those of their class, less 1.
  [[nodiscard]] const Eigen::ArrayXd& off_length() const { return off_length_; }
  /// Number of pieces of the first `steps` steps.
  [[nodiscard]] Eigen::Index after(std::size_t steps) const {
    return steps == 0 ? 0 : after_step_[steps - 1];
  }

 private:
  void add_step(double from, double to, double h);
  void add_stretch(double from, double to, double h, int level);
  void sort_into_runs(double same);
  [[nodiscard]] std::size_t class_of(const DepthPiece& piece, double same);

  const KernelShape& kernel_;
  double v_tolerance_ = 0.0;
  std::vector<DepthPiece> pieces_;
  std::vector<Eigen::Index> after_step_;
  std::vector<PieceRun> runs_;
  std::vector<PieceClass> classes_;
  Eigen::ArrayXd off_length_;
};

}  // namespace tpm::law
