// Declared in tpm/fit/validate/validation.hpp.
#include <fmt/format.h>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/validate/validation.hpp"

namespace tpm::fit {

std::string part_words(const RecordingComparison& r, const LawSpec& law) {
  const ComparedPart& part = r.part;
  const Unit unit = shown_unit(quantity_dimension(r.creep ? law.response : law.drive));
  const auto driven = [&](double si) { return significant(si / unit.to_si, 3); };
  const auto seconds = [](double s) { return significant(s, 4); };
  std::string text =
      fmt::format("ramp from {} s to {} s, {}, ", seconds(part.from_s), seconds(part.corner_s),
                  r.creep || unit.dimension != Dimension::length
                      ? "to " + with_unit(driven(part.depth), unit)
                      : with_unit(driven(part.depth), unit) + " deep");
  text += part.hold_s > 0.0 ? fmt::format("and hold to {} s", seconds(part.to_s)) : "no hold";
  if (part.whole()) return text + (part.hold_asked_s ? ": the whole press" : ": the whole loading");
  text += ": only a part";
  if (part.depth < part.depth_of_all) {
    text += fmt::format(", of {}", with_unit(driven(part.depth_of_all), unit));
  }
  if (part.left_out_s > 0.0) {
    text += fmt::format(", without {} s of the {} s {}", seconds(part.left_out_s),
                        seconds(part.loaded_s),
                        part.hold_asked_s ? "that the hold was asked for" : "under load");
  }
  return text;
}

}  // namespace tpm::fit
