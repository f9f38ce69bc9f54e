#include "tpm/solve/sampled_function.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace tpm {
namespace {

constexpr std::size_t kNodes = 16;
constexpr std::size_t kWorth = 2;  // times the nodes: fewer places are not worth a polynomial

/// Chebyshev nodes of a stretch, rising.
std::array<double, kNodes> nodes_between(double from, double to) {
  std::array<double, kNodes> nodes{};
  for (std::size_t i = 0; i < kNodes; ++i) {
    const double angle = std::numbers::pi * (static_cast<double>(i) + 0.5) / kNodes;
    nodes[i] = 0.5 * (from + to) - 0.5 * (to - from) * std::cos(angle);
  }
  return nodes;
}

/// A polynomial through values at nodes, in barycentric form.
class Interpolant {
 public:
  /// @param nodes, values must live as long as this
  Interpolant(std::span<const double> nodes, const Eigen::MatrixXd& values)
      : nodes_(nodes), values_(values), weight_(nodes.size()) {
    const double reach = nodes.back() - nodes.front();
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      double product = 1.0;
      for (std::size_t j = 0; j < nodes.size(); ++j) {
        if (j != i) product *= 4.0 * (nodes[i] - nodes[j]) / reach;
      }
      weight_[i] = 1.0 / product;
    }
  }

  [[nodiscard]] Eigen::RowVectorXd operator()(double place) const {
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(values_.cols());
    double total = 0.0;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const auto row = values_.row(static_cast<Eigen::Index>(i));
      const double apart = place - nodes_[i];
      if (apart == 0.0) return row;
      sum += weight_[i] / apart * row;
      total += weight_[i] / apart;
    }
    return sum / total;
  }

 private:
  std::span<const double> nodes_;
  const Eigen::MatrixXd& values_;
  std::vector<double> weight_;
};

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
    const std::size_t worth = kWorth * std::max(kNodes, together_);
    if (here.size() < worth || !(here.front() < here.back())) {
      rows(first, last) = values_at(here);
      return;
    }
    if (interpolate(first, last)) return;
    const double middle = 0.5 * (here.front() + here.back());
    const auto cut = std::lower_bound(here.begin(), here.end(), middle);
    const std::size_t half = first + static_cast<std::size_t>(cut - here.begin());
    fill(first, half);
    fill(half, last);
  }

  [[nodiscard]] bool interpolate(std::size_t first, std::size_t last) {
    const std::array<double, kNodes> nodes = nodes_between(places_[first], places_[last - 1]);
    const Eigen::MatrixXd values = values_at(nodes);
    std::array<double, kNodes / 2> others{};
    Eigen::MatrixXd other_values(kNodes / 2, values.cols());
    for (std::size_t i = 0; i < others.size(); ++i) {
      others[i] = nodes[2 * i];
      other_values.row(static_cast<Eigen::Index>(i)) = values.row(static_cast<Eigen::Index>(2 * i));
    }
    const Interpolant coarse(others, other_values);
    for (std::size_t i = 1; i < kNodes; i += 2) {
      const Eigen::RowVectorXd apart = coarse(nodes[i]) - values.row(static_cast<Eigen::Index>(i));
      if (!(apart.array().abs() <= allowed_.array()).all()) return false;
    }
    const Interpolant fine(nodes, values);
    for (std::size_t i = first; i < last; ++i) {
      answer_.row(static_cast<Eigen::Index>(i)) = fine(places_[i]);
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

}  // namespace tpm
