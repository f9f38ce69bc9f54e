#include "tpm/organ/linear/elimination_order.hpp"

#include <fmt/format.h>
#include <metis.h>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <csignal>
#include <mutex>
#include <new>

#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

using GraphEdge = std::array<std::uint32_t, 2>;

constexpr std::size_t kFewNodes = 500;
constexpr idx_t kSeed = 1;

std::vector<std::uint32_t> minimum_degree(std::size_t nodes, std::span<const GraphEdge> edges) {
  using Graph = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;
  std::vector<Eigen::Triplet<double, int>> entries;
  entries.reserve(2 * edges.size() + nodes);
  for (std::size_t i = 0; i < nodes; ++i) {
    entries.emplace_back(static_cast<int>(i), static_cast<int>(i), 1.0);
  }
  for (const auto& [a, b] : edges) {
    entries.emplace_back(static_cast<int>(a), static_cast<int>(b), 1.0);
    entries.emplace_back(static_cast<int>(b), static_cast<int>(a), 1.0);
  }
  const auto n = static_cast<Eigen::Index>(nodes);
  Graph graph(n, n);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(graph, permutation);
  std::vector<std::uint32_t> order(nodes);
  for (std::size_t place = 0; place < nodes; ++place) {
    const int node = permutation.indices()[static_cast<Eigen::Index>(place)];
    order[static_cast<std::size_t>(node)] = static_cast<std::uint32_t>(place);
  }
  return order;
}

/// The neighbours of each node, rising, without repetitions, as METIS takes them.
struct Adjacency {
  std::vector<idx_t> begin, node;
};

Adjacency adjacency(std::size_t nodes, std::span<const GraphEdge> edges) {
  std::vector<std::vector<std::uint32_t>> neighbours(nodes);
  for (const auto& [a, b] : edges) {
    neighbours[a].push_back(b);
    neighbours[b].push_back(a);
  }
  Adjacency result;
  result.begin.reserve(nodes + 1);
  result.node.reserve(2 * edges.size());
  result.begin.push_back(0);
  for (auto& near : neighbours) {
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    for (const std::uint32_t n : near) result.node.push_back(static_cast<idx_t>(n));
    result.begin.push_back(static_cast<idx_t>(result.node.size()));
  }
  return result;
}

/// Holds SIGTERM back in this thread while it lives.
class TerminationHeldBack {
 public:
  TerminationHeldBack() {
    sigset_t termination;
    sigemptyset(&termination);
    sigaddset(&termination, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &termination, &before_);
  }
  ~TerminationHeldBack() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  TerminationHeldBack(const TerminationHeldBack&) = delete;
  TerminationHeldBack& operator=(const TerminationHeldBack&) = delete;

 private:
  sigset_t before_{};
};

std::vector<std::uint32_t> nested_dissection(std::size_t nodes, std::span<const GraphEdge> edges) {
  Adjacency graph = adjacency(nodes, edges);
  auto n = static_cast<idx_t>(nodes);
  std::vector<idx_t> node_at(nodes);
  std::vector<idx_t> place_of(nodes);
  std::array<idx_t, METIS_NOPTIONS> options{};
  METIS_SetDefaultOptions(options.data());
  options[METIS_OPTION_SEED] = kSeed;
  static std::mutex one_at_a_time;
  int status = METIS_OK;
  {
    const std::scoped_lock lock(one_at_a_time);
    const TerminationHeldBack held_back;
    status = METIS_NodeND(&n, graph.begin.data(), graph.node.data(), nullptr, options.data(),
                          node_at.data(), place_of.data());
  }
  if (status == METIS_ERROR_MEMORY) throw std::bad_alloc();
  if (status != METIS_OK) {
    throw Error(ExitCode::numerical, "elimination order", fmt::format("METIS failed ({})", status));
  }
  return {place_of.begin(), place_of.end()};
}

}  // namespace

std::vector<std::uint32_t> elimination_order(std::size_t nodes, std::span<const GraphEdge> edges) {
  return nodes <= kFewNodes ? minimum_degree(nodes, edges) : nested_dissection(nodes, edges);
}

}  // namespace tpm::organ
