#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "tpm/fit/groups/group_difference.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/groups/young_moduli.hpp"

namespace tpm::fit {

/// Recordings of one group of specimens, healthy ones say.
struct RecordingGroup {
  std::string name;
  std::vector<PreparedRecording> recordings;
};

/// One parameter, or one Young's modulus, in two groups.
struct ComparedQuantity {
  std::string si_unit;     ///< "N/m", "Pa s^alpha"
  FitParameter parameter;  ///< theta, unit and scale; of a modulus its name and "Pa"
  std::array<std::optional<RandomEffects>, 2> typical;  ///< none: no recording determines it
  std::array<int, 2> left_out{};                        ///< recordings that do not determine it
  std::optional<GroupDifference> difference;
  double p_holm = 1.0;  ///< p_value, adjusted by Holm for all quantities that are compared
  std::string reason;   ///< why there is no difference
  /// A group's recordings do not tell it from this ("drift or a slow branch"): the difference holds
  /// only without it. None: they do.
  std::optional<Remark> only_without;
  /// Recordings among those compared that the law does not describe: the difference holds only if
  /// it did.
  std::array<int, 2> not_described{};
};

/// Why a compared quantity is not identified, in words; empty if it is.
[[nodiscard]] std::string doubt_of(const ComparedQuantity& quantity);

struct GroupComparison {
  std::array<std::string, 2> names;
  std::size_t first =
      0;  ///< rows of the study that are of the first group; the others are of the second
  SpecimenStudy study;  ///< one law and one reference for both; `pooled` is empty
  std::vector<ComparedQuantity> parameters;
  std::vector<ComparedQuantity> moduli;  ///< empty without a probe; not counted by p_holm
};

/// Fits one law to each recording of both groups, with one reference depth, and asks of each
/// material parameter how far the groups lie apart (group_difference()), and of Young's moduli
/// where a probe is given. Repeats of a specimen (PreparedRecording::specimen) become its mean
/// first. Error(bad_input): two files with the same bytes; groups that were indented to different
/// depths, so that depth and group are confounded (see require_comparable_depths); as
/// study_specimens().
[[nodiscard]] GroupComparison compare_groups(const RecordingGroup& first,
                                             const RecordingGroup& second,
                                             const std::optional<LawSpec>& law,
                                             const SelectionOptions& options,
                                             const std::optional<ContactGeometry>& probe = {});

/// A law whose kernel is not the tissue's has a stiffness that depends on depth, which then looks
/// like a difference of groups. Refused is a group whose typical (geometric mean) depth of contact
/// is more than 10 % beyond the other's while group explains more than three quarters of the
/// variance of the logarithm of depth; Error(bad_input) says both depths.
void require_comparable_depths(const RecordingGroup& first, const RecordingGroup& second);

/// Parameters that differ, in one sentence.
[[nodiscard]] std::string conclusion(const GroupComparison& comparison);
[[nodiscard]] Json to_json(const GroupComparison& comparison);
[[nodiscard]] std::string to_terminal_text(const GroupComparison& comparison);
/// Each quantity: typical values, ratio (or difference), interval, tests.
[[nodiscard]] std::string comparison_csv(const GroupComparison& comparison);

}  // namespace tpm::fit
