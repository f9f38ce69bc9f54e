#include "tpm/law/depth_pieces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tpm::law {
namespace {

/// Steps that differ by less have weights of first order in the difference: off by its square.
/// Their derivatives by the times are those of the step they differ from.
constexpr double kNearlyEqual = 3e-6;

bool is_curved(const DepthPiece& piece) {
  return piece.course != PieceCourse::straight;
}

/// `same`: lengths that differ by less are equal.
bool fits(const DepthPiece& piece, const PieceClass& of, double same) {
  return is_curved(piece) == of.curved &&
         std::abs(piece.h - of.h) <= std::max(same, kNearlyEqual * std::min(of.h, piece.h));
}

}  // namespace

DepthPieces::DepthPieces(const KernelShape& kernel, double contact, const DrivePath& path)
    : kernel_(kernel) {
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
void DepthPieces::add_step(double from, double to, double h) {
  if (from * to < 0.0) {
    const double share = from / (from - to);
    add_stretch(from, 0.0, h * share, 0);
    add_stretch(0.0, to, h * (1.0 - share), 0);
  } else {
    add_stretch(from, to, h, 0);
  }
}

void DepthPieces::add_stretch(double from, double to, double h, int level) {
  if (!(h > 0.0)) return;
  if (kernel_.is_linear()) {
    pieces_.push_back({from, to, h, PieceCourse::straight});
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
  if (part > kQuartic && level < kMostHalvings && kernel_.quartic_error(a, b) > v_tolerance_) {
    const double middle = 0.5 * (from + to);
    add_stretch(from, middle, 0.5 * h, level + 1);
    add_stretch(middle, to, 0.5 * h, level + 1);
    return;
  }
  const PieceCourse course = part > kCubicPart  ? PieceCourse::quartic
                             : part > kStraight ? PieceCourse::cubic
                                                : PieceCourse::straight;
  pieces_.push_back({from, to, h, course});
}

std::size_t DepthPieces::class_of(const DepthPiece& piece, double same) {
  constexpr std::size_t kHistorySteps = 8;
  for (std::size_t i = classes_.size(); i > 0 && i + kHistorySteps > classes_.size(); --i) {
    if (fits(piece, classes_[i - 1], same)) return i - 1;
  }
  classes_.push_back({piece.h, is_curved(piece)});
  return classes_.size() - 1;
}

void DepthPieces::sort_into_runs(double same) {
  off_length_.setZero(count());
  std::size_t current = 0;
  for (Eigen::Index k = 0; k < count(); ++k) {
    const DepthPiece& piece = (*this)[k];
    if (k == 0 || !fits(piece, classes_[current], same)) {
      current = class_of(piece, same);
      if (runs_.empty() || runs_.back().step_class != current) {
        runs_.push_back({k, k, current, false});
      }
    }
    const double h = classes_[current].h;
    if (std::abs(piece.h - h) > same) {
      off_length_[k] = piece.h / h - 1.0;
      runs_.back().uneven = true;
    }
    runs_.back().last = k + 1;
  }
}

}  // namespace tpm::law
