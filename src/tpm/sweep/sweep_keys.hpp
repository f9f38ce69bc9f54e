#pragma once
// A sweep as its file says it: the declaration of all its keys.
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/blocks/protocol_block.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/sweep/sweep.hpp"
#include "tpm/sweep/sweep_outputs.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::sweep {

enum class AxisKind { single, together, samples };
enum class PointKind { random, latin_hypercube, sobol, plain_sobol, sensitivity };

struct AxisKeys {
  AxisKind kind = AxisKind::single;
  std::string name;  ///< empty: as usual
  // of one parameter
  std::string parameter;
  ValueKeys values;
  // of several, by their names: lists that go on together, or ends of samples
  std::vector<std::pair<std::string, ValueKeys>> parameters;
  // of samples
  PointKind points = PointKind::random;
  std::uint64_t count = 0, seed = 0;
  std::optional<std::uint64_t> replicates;
};
[[nodiscard]] const Kinds<AxisKeys, AxisKind>& axis_kinds();

/// Steps of one length.
[[nodiscard]] const Block<QuasiStaticOptions>& integrator_block();

enum class SweepSubject { single_contact, organ };

struct SweepKeys {
  SweepSubject subject = SweepSubject::single_contact;
  std::string title, description;
  std::vector<AxisKeys> axes;
  std::vector<SweepOutputKeys> outputs;
  std::vector<SkipCondition> skip;
  std::optional<std::uint64_t> block;
  // of a single contact
  TpmParameters material;
  std::optional<ProtocolBlock> indentation, creep;
  // of an organ
  Json scene;  ///< or the name of its file
  std::optional<double> tolerance;
  Json integrator;  ///< null: none. As it stands in the file: pointers find its numbers
};
[[nodiscard]] const Kinds<SweepKeys, SweepSubject>& sweep_kinds();
[[nodiscard]] const FileKind& sweep_kind();

}  // namespace tpm::sweep
