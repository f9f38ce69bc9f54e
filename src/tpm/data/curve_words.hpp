#pragma once
// The words of files for what curve.hpp enumerates.
#include <array>
#include <string_view>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpmkit/curve.hpp"

namespace tpm::data {

inline constexpr auto kProvenances = std::to_array<Word<Provenance>>({
    {Provenance::table, "table"},
    {Provenance::text, "text"},
    {Provenance::abstract, "abstract"},
    {Provenance::derived, "derived"},
    {Provenance::assumed, "assumed"},
    {Provenance::digitized, "digitized"},
    {Provenance::measured, "measured"},
});

inline constexpr auto kTimeOrigins = std::to_array<Word<TimeOrigin>>({
    {TimeOrigin::none, "none"},
    {TimeOrigin::end_of_ramp, "end_of_ramp"},
    {TimeOrigin::load_applied, "load_applied"},
});

struct QuantityWords {
  Quantity meaning;
  std::string_view text;
  std::string_view short_name;
  Dimension dimension;
};

inline constexpr auto kQuantities = std::to_array<QuantityWords>({
    {Quantity::time, "time", "time", Dimension::time},
    {Quantity::indentation_depth, "indentation_depth", "depth", Dimension::length},
    {Quantity::contact_force, "contact_force", "force", Dimension::force},
    {Quantity::load, "load", "load", Dimension::force},
    {Quantity::relative_length, "relative_length", "relative_length", Dimension::dimensionless},
    {Quantity::strain, "strain", "strain", Dimension::dimensionless},
    {Quantity::stress, "stress", "stress", Dimension::stress},
    {Quantity::frequency, "frequency", "frequency", Dimension::frequency},
    {Quantity::storage_modulus, "storage_modulus", "storage", Dimension::stress},
    {Quantity::loss_modulus, "loss_modulus", "loss", Dimension::stress},
    {Quantity::storage_stiffness, "storage_stiffness", "storage", Dimension::stiffness},
    {Quantity::loss_stiffness, "loss_stiffness", "loss", Dimension::stiffness},
    {Quantity::relaxation_modulus, "relaxation_modulus", "relaxation_modulus", Dimension::stress},
    {Quantity::creep_compliance, "creep_compliance", "creep_compliance", Dimension::compliance},
    {Quantity::abscissa, "abscissa", "x", Dimension::dimensionless},
    {Quantity::ordinate, "ordinate", "y", Dimension::dimensionless},
});

}  // namespace tpm::data
