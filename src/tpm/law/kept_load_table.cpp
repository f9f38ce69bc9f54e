#include "tpm/law/kept_load_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace tpm::law {
namespace {

constexpr std::size_t kNodes = 16;        // of a piece
constexpr double kPiecesPerDecade = 2.0;  // at least
constexpr std::size_t kWorthwhile = 2;    // times for each node
constexpr double kLongestDecades = 60.0;  // of a table

struct ChebyshevPoints {
  std::array<double, kNodes> x;       ///< in -1 .. 1, falling
  std::array<double, kNodes> weight;  ///< of the barycentric formula
};

const ChebyshevPoints& chebyshev_points() {
  static const ChebyshevPoints points = [] {
    ChebyshevPoints p{};
    for (std::size_t i = 0; i < kNodes; ++i) {
      const double angle = (static_cast<double>(i) + 0.5) * std::numbers::pi / kNodes;
      p.x[i] = std::cos(angle);
      p.weight[i] = (i % 2 == 0 ? 1.0 : -1.0) * std::sin(angle);
    }
    return p;
  }();
  return points;
}

/// Weights of the values at the nodes at x; they sum to 1.
std::array<double, kNodes> shares_at(double x) {
  const ChebyshevPoints& points = chebyshev_points();
  std::array<double, kNodes> share{};
  double sum = 0.0;
  for (std::size_t i = 0; i < kNodes; ++i) {
    const double distance = x - points.x[i];
    if (distance == 0.0) {
      share.fill(0.0);
      share[i] = 1.0;
      return share;
    }
    share[i] = points.weight[i] / distance;
    sum += share[i];
  }
  for (double& s : share) s /= sum;
  return share;
}

bool is_kept_load(const Protocol& protocol) {
  const auto knots = protocol.knots();
  return protocol.drive() == Drive::force && !protocol.equilibrium_at_start() &&
         std::all_of(knots.begin(), knots.end(),
                     [&](const Knot& k) { return k.value == knots.front().value; });
}

}  // namespace

std::optional<KeptLoadTable> KeptLoadTable::covering(const Protocol& protocol,
                                                     std::span<const double> times_s) {
  if (times_s.size() < kWorthwhile * kNodes || !is_kept_load(protocol)) return std::nullopt;
  double first = std::numeric_limits<double>::infinity();
  double last = 0.0;
  for (const double t : times_s) {
    const double since = t - protocol.start_s();
    if (!(since >= 0.0) || !std::isfinite(since)) return std::nullopt;
    last = std::max(last, since);
    if (since > 0.0) first = std::min(first, since);
  }
  if (!(last > first) || std::log10(last / first) > kLongestDecades) return std::nullopt;
  KeptLoadTable table(protocol.start_s(), first, last, times_s);
  if (times_s.size() < kWorthwhile * table.node_times_s_.size()) return std::nullopt;
  return table;
}

KeptLoadTable::KeptLoadTable(double start_s, double first_s, double last_s,
                             std::span<const double> times_s)
    : start_s_(start_s), log_first_(std::log(first_s)), asked_s_(times_s) {
  const double span = std::log(last_s) - log_first_;
  pieces_ =
      static_cast<Eigen::Index>(std::ceil(kPiecesPerDecade * span / std::numbers::ln10_v<double>));
  pieces_ = std::max<Eigen::Index>(pieces_, 1);
  pieces_per_log_ = static_cast<double>(pieces_) / span;
  node_times_s_.reserve(static_cast<std::size_t>(pieces_) * kNodes + 1);
  for (Eigen::Index piece = 0; piece < pieces_; ++piece) {
    for (const double x : chebyshev_points().x) {
      const double place = static_cast<double>(piece) + 0.5 * (1.0 + x);
      node_times_s_.push_back(start_s_ + std::exp(log_first_ + place / pieces_per_log_));
    }
  }
  if (std::find(times_s.begin(), times_s.end(), start_s) != times_s.end()) {
    node_times_s_.push_back(start_s);
  }
}

Response KeptLoadTable::at_asked(const Response& at_nodes) const {
  Response response;
  response.value.resize(std::ssize(asked_s_));
  const Eigen::Index columns = at_nodes.sensitivity.cols();
  if (columns > 0) response.sensitivity.resize(std::ssize(asked_s_), columns);
  for (Eigen::Index row = 0; row < response.value.size(); ++row) {
    const double since = asked_s_[static_cast<std::size_t>(row)] - start_s_;
    if (since == 0.0) {
      const Eigen::Index start = at_nodes.value.size() - 1;
      response.value[row] = at_nodes.value[start];
      if (columns > 0) response.sensitivity.row(row) = at_nodes.sensitivity.row(start);
      continue;
    }
    const double place = (std::log(since) - log_first_) * pieces_per_log_;
    const Eigen::Index piece =
        std::clamp<Eigen::Index>(static_cast<Eigen::Index>(place), 0, pieces_ - 1);
    const auto share = shares_at(2.0 * (place - static_cast<double>(piece)) - 1.0);
    const Eigen::Map<const Eigen::RowVectorXd> shares(share.data(), kNodes);
    const Eigen::Index first = piece * static_cast<Eigen::Index>(kNodes);
    response.value[row] = shares.dot(at_nodes.value.segment(first, kNodes));
    if (columns > 0) {
      response.sensitivity.row(row).noalias() =
          shares.lazyProduct(at_nodes.sensitivity.middleRows(first, kNodes));
    }
  }
  return response;
}

}  // namespace tpm::law
