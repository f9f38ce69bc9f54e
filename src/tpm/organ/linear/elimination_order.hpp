#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace tpm::organ {

/// An order of elimination with little fill for a symmetric matrix on a graph: approximate minimum
/// degree (Amestoy, Davis & Duff 1996, by Eigen) up to 500 nodes, where it is as good and faster,
/// nested dissection (Karypis & Kumar 1998, by METIS) above. The order depends on nothing but the
/// graph.
///
/// METIS keeps the state of its random numbers in the C library's rand(): calls wait for each
/// other, and reset it to one seed. SIGTERM is held back until METIS has returned, which would
/// otherwise take it for its own.
/// @param nodes number of nodes
/// @param edges pairs of different nodes, each in any order; repetitions do no harm
/// @return the place of each node in the order
/// Throws std::bad_alloc, and Error(numerical) if METIS fails.
[[nodiscard]] std::vector<std::uint32_t> elimination_order(
    std::size_t nodes, std::span<const std::array<std::uint32_t, 2>> edges);

}  // namespace tpm::organ
