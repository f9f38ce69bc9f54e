#include "tpm/law/relaxation/sampled_function.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tpm/law/relaxation/lagrange_basis.hpp"

namespace tpm::law {
namespace {

constexpr std::size_t kSampleNodes = 16;
constexpr std::size_t kWorth = 2;  // times the nodes: fewer places are not worth a polynomial

/// Chebyshev nodes of the unit stretch, rising, each `stride`-th of them.
std::vector<double> unit_nodes(std::size_t stride) {
  std::vector<double> nodes;
  nodes.reserve(kSampleNodes / stride);
  for (std::size_t i = 0; i < kSampleNodes; i += stride) {
    nodes.push_back(
        0.5 - 0.5 * std::cos(std::numbers::pi * (static_cast<double>(i) + 0.5) / kSampleNodes));
  }
  return nodes;
}

class Sampling {
 public:
  Sampling(const RowsAt& function, std::span<const double> places, std::size_t together,
           const Eigen::RowVectorXd& allowed)
      : function_(function),
        places_(places),
        together_(together),
        allowed_(allowed),
        answer_(static_cast<Eigen::Index>(places.size()), allowed.size()) {}

  Eigen::MatrixXd all() && {
    fill(0, places_.size());
    return std::move(answer_);
  }

 private:
  [[nodiscard]] Eigen::MatrixXd values_at(std::span<const double> places) const {
    Eigen::MatrixXd values(static_cast<Eigen::Index>(places.size()), allowed_.size());
    for (std::size_t first = 0; first < places.size(); first += together_) {
      const std::size_t count = std::min(together_, places.size() - first);
      values.middleRows(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(count)) =
          function_(places.subspan(first, count));
    }
    return values;
  }

  [[nodiscard]] auto rows(std::size_t first, std::size_t last) {
    return answer_.middleRows(static_cast<Eigen::Index>(first),
                              static_cast<Eigen::Index>(last - first));
  }

  /// Answers the places from `first` to before `last`.
  void fill(std::size_t first, std::size_t last) {
    const std::span<const double> here = places_.subspan(first, last - first);
    const std::size_t worth = kWorth * std::max(kSampleNodes, together_);
    const double middle = here.empty() ? 0.0 : 0.5 * (here.front() + here.back());
    if (here.size() < worth || !(here.front() < middle && middle < here.back())) {
      rows(first, last) = values_at(here);
      return;
    }
    if (interpolate(first, last)) return;
    const auto cut = std::lower_bound(here.begin(), here.end(), middle);
    const std::size_t half = first + static_cast<std::size_t>(cut - here.begin());
    fill(first, half);
    fill(half, last);
  }

  [[nodiscard]] bool interpolate(std::size_t first, std::size_t last) {
    static const LagrangeBasis fine(unit_nodes(1)), coarse(unit_nodes(2));
    const double from = places_[first], length = places_[last - 1] - from;
    std::vector<double> nodes = fine.nodes();
    for (double& node : nodes) node = from + length * node;
    const Eigen::MatrixXd values = values_at(nodes);
    const Eigen::MatrixXd other_values = values(Eigen::seqN(0, kSampleNodes / 2, 2), Eigen::all);
    for (std::size_t i = 1; i < kSampleNodes; i += 2) {
      const Eigen::RowVectorXd apart = coarse.at(fine.nodes()[i]).transpose() * other_values -
                                       values.row(static_cast<Eigen::Index>(i));
      if (!(apart.array().abs() <= allowed_.array()).all()) return false;
    }
    for (std::size_t i = first; i < last; ++i) {
      answer_.row(static_cast<Eigen::Index>(i)) =
          fine.at((places_[i] - from) / length).transpose() * values;
    }
    return true;
  }

  const RowsAt& function_;
  std::span<const double> places_;
  std::size_t together_;
  const Eigen::RowVectorXd& allowed_;
  Eigen::MatrixXd answer_;
};

}  // namespace

Eigen::MatrixXd sampled(const RowsAt& function, std::span<const double> places,
                        std::size_t together, const Eigen::RowVectorXd& allowed) {
  return Sampling(function, places, together, allowed).all();
}

}  // namespace tpm::law
