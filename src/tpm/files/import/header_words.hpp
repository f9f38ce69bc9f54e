#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/curve.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {

/// Uses of a testing machine's column.
enum class ColumnRole {
  time,
  drive,
  response,
  sd,
  frequency,
  storage,
  loss,
  magnitude,     ///< of the complex modulus, |G*|
  phase,         ///< the angle delta by which the stress leads the strain
  loss_tangent,  ///< tan delta
  height,        ///< of an AFM: travel of the piezo, which its cantilever shortens
  deflection,    ///< of that cantilever, as a length or as the signal of its detector
};

/// The meaning of a title in English, French, German, Spanish or Italian, or as G', G", E', E", J'
/// and J".
struct Recognized {
  ColumnRole role;
  Quantity quantity;
  int rank;  ///< the smaller, the closer to the specimen: depth before crosshead travel
};

[[nodiscard]] std::optional<Recognized> recognize_title(std::string_view name);

/// A title that would have a meaning but for a word: "Displacement command", "Max. load".
struct RefusedTitle {
  Recognized meaning;  ///< without that word
  std::string why;     ///< "'command' is what was asked for, not what was measured"
  bool asked = false;  ///< the quantity as it was asked for, and not another one
};

/// The words of a title, in small letters. Where none is known, capitals inside them begin new
/// ones: "BaseDisp" but not "zSensor" or "vDeflection", which are known as they stand.
[[nodiscard]] std::vector<std::string> title_words(std::string_view name);

/// None for a title that recognize_title recognises, and for one without any known word.
[[nodiscard]] std::optional<RefusedTitle> refused_title(std::string_view name);

/// True if numbers in this dimension can be what a title says.
[[nodiscard]] bool is_dimension_of(const Recognized& meaning, Dimension dimension);

/// True for "G(t)/G0", "E/E(0)": a share of the first reading.
[[nodiscard]] bool is_normalised(std::string_view name);

/// True for "log w", "lg G'", "ln(G)", "log10(omega)".
[[nodiscard]] bool is_logarithm(std::string_view name);

/// True for an angular frequency ("omega", "angular frequency", "Kreisfrequenz"): there 1/s means
/// rad/s.
[[nodiscard]] bool is_angular(std::string_view name);

}  // namespace tpm::files
