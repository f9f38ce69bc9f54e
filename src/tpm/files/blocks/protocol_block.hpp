#pragma once
// Protocols in files: one declaration of kinds and keys, one place where they are made.
#include <array>
#include <initializer_list>
#include <optional>
#include <string_view>
#include <vector>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/files/document_place.hpp"
#include "tpm/files/keys/block.hpp"
#include "tpmkit/protocol.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {

/// The protocols that files name.
enum class ProtocolKind {
  ramp_hold,  ///< from rest to `depth` at `rate`, then held for `hold`
  step_hold,  ///< instantaneously to `depth`, then held for `hold`
  creep,      ///< `load` applied instantaneously, kept for `duration`
  knots,      ///< linear between corners
};

inline constexpr auto kProtocolKindWords =
    std::to_array<Word<ProtocolKind>>({{ProtocolKind::ramp_hold, "ramp_hold"},
                                       {ProtocolKind::step_hold, "step_hold"},
                                       {ProtocolKind::creep, "creep"},
                                       {ProtocolKind::knots, "knots"}});

/// The protocol as a block states it. Numbers may be open as long as something else will set them:
/// an axis of a sweep, the data of a fit.
struct ProtocolBlock {
  ProtocolKind kind = ProtocolKind::ramp_hold;
  std::optional<double> depth_m, rate_m_per_s, hold_s, load_N, duration_s;
  Drive drive = Drive::displacement;  ///< of knots
  std::vector<Knot> knots;

  /// The number under a key of the block's kind, such as "depth"; null for another key.
  [[nodiscard]] std::optional<double>* find(std::string_view key);
  /// The number under a key of the block's kind. Throws Error(bad_input) at the key if it is open
  /// or out of range, std::logic_error for another key.
  [[nodiscard]] double number(std::string_view key, const DocumentPlace& place) const;
  /// Throws Error(bad_input) for a number that is open or out of range, at its key.
  [[nodiscard]] Protocol protocol(const DocumentPlace& place) const;
};

/// Their declaration.
[[nodiscard]] const Kinds<ProtocolBlock, ProtocolKind>& protocol_kinds();

enum class Openness {
  complete,  ///< every key has to be there
  open,      ///< missing values stay open
};

/// A block with the key `kind`, or of a kind that its place in the file says.
/// Throws Error(bad_input) for unknown kinds, keys of others, and what is not a number of its unit.
[[nodiscard]] ProtocolBlock parse_protocol_block(const Json& block, const DocumentPlace& place,
                                                 Openness openness,
                                                 std::optional<ProtocolKind> kind = std::nullopt);

/// The name that a file uses for a key, such as "rates" for a list of the key "rate".
struct ProtocolKeyName {
  std::string_view key, in_file;
};

/// Numbers of several protocols of one kind, SI; an empty list leaves the number open.
struct ProtocolLists {
  std::vector<double> depths_m, rates_m_per_s, holds_s, loads_N, durations_s;
};

/// The keys of a kind with one quantity or a list of them each, all required.
/// @param renamed the keys that have another name in this block
[[nodiscard]] std::vector<Key<ProtocolLists>> protocol_list_keys(
    ProtocolKind kind, std::initializer_list<ProtocolKeyName> renamed = {});

/// All combinations: the first key of the kind varies most slowly. Throws Error(bad_input) for more
/// than 100,000.
[[nodiscard]] std::vector<ProtocolBlock> combinations(ProtocolKind kind, const ProtocolLists& lists,
                                                      const DocumentPlace& place);

}  // namespace tpm::files
