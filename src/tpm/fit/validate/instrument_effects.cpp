#include "tpm/fit/validate/instrument_effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"

namespace tpm::fit {
namespace {

std::string millimetres(double length_m) {
  return significant(1e3 * length_m, 4) + " mm";
}

}  // namespace

std::vector<InstrumentEffect> instrument_effects(const ChannelSlopes& by,
                                                 const std::optional<Instrument>& validation,
                                                 const std::optional<Instrument>& calibration,
                                                 bool creep) {
  std::vector<InstrumentEffect> effects;
  const auto add = [&](const char* name, double by_s, double by_d, auto uncertainty) {
    const double ours = validation ? uncertainty(*validation) : 0.0;
    const double theirs = calibration ? uncertainty(*calibration) : 0.0;
    if (ours > 0.0 || theirs > 0.0) effects.push_back({name, by_d, by_s, ours, theirs});
  };
  const auto relative = [](const std::optional<ChannelUncertainty>& c) {
    return c ? c->relative : 0.0;
  };
  const auto absolute = [](const std::optional<ChannelUncertainty>& c) {
    return c ? c->absolute : 0.0;
  };
  // A scale error of the force is in the law as it is in the readings; one of the depth is in the
  // law with the other sign than where the law is asked.
  // Of creep the force is what is imposed, and the depth what is read.
  const auto& read = [creep](const Instrument& i) -> const std::optional<ChannelUncertainty>& {
    return creep ? i.depth : i.force;
  };
  const auto& imposed = [creep](const Instrument& i) -> const std::optional<ChannelUncertainty>& {
    return creep ? i.force : i.depth;
  };
  add(creep ? "scale of the depth" : "scale of the force", by.simulated, -by.measured,
      [&](const Instrument& i) { return relative(read(i)); });
  add(creep ? "depth channel" : "force channel", by.by_simulated, -by.by_measured,
      [&](const Instrument& i) { return absolute(read(i)); });
  add(creep ? "scale of the force" : "scale of the depth", -by.depth_scale, by.depth_scale,
      [&](const Instrument& i) { return relative(imposed(i)); });
  add(creep ? "force channel" : "depth channel", -by.travel, by.travel,
      [&](const Instrument& i) { return absolute(imposed(i)); });
  add("scale of the time", -by.time_scale, by.time_scale,
      [&](const Instrument& i) { return relative(i.time); });
  add("time between channels", -by.time_shift, by.time_shift,
      [&](const Instrument& i) { return absolute(i.time); });
  return effects;
}

double slope_by_radius(double simulated, double imposed_scale, bool creep) {
  return creep ? simulated - 2.0 * imposed_scale : 2.0 * simulated - imposed_scale;
}

ProbeEffect probe_effect(const std::optional<Instrument>& validation,
                         const std::optional<Instrument>& calibration) {
  const auto u_of = [](const std::optional<Instrument>& i) {
    return i ? i->radius.value_or(0.0) : 0.0;
  };
  ProbeEffect effect;
  effect.stated = u_of(validation) > 0.0 || u_of(calibration) > 0.0;
  effect.same = validation && calibration && validation->probe_id() == calibration->probe_id();
  if (effect.same) return effect;
  effect.u_validation = u_of(validation);
  effect.u_calibration = u_of(calibration);
  return effect;
}

std::string probe_words(const std::optional<Instrument>& validation,
                        const std::optional<Instrument>& calibration) {
  const ProbeEffect effect = probe_effect(validation, calibration);
  if (!effect.stated) return {};
  if (effect.same) {
    return "one probe in calibration and validation: an error of its radius is in both alike and "
           "adds nothing to u_input";
  }
  if (effect.u_validation > 0.0 && effect.u_calibration > 0.0) {
    return "the radii of two probes, of a half space, are in u_input";
  }
  return fmt::format("the radius of the {} probe alone is in u_input: the other is not stated",
                     effect.u_validation > 0.0 ? "validation's" : "calibration's");
}

std::string probe_difference_words(const std::optional<Instrument>& validation,
                                   const std::optional<Instrument>& calibration) {
  const auto radius_of = [](const std::optional<Instrument>& i) {
    return i ? i->probe_radius : std::nullopt;
  };
  const auto ours = radius_of(validation), theirs = radius_of(calibration);
  constexpr double kEqual = 1e-6;
  if (!ours || !theirs || std::abs(*ours - *theirs) <= kEqual * std::max(*ours, *theirs)) return {};
  return fmt::format(
      "the probe has a radius of {}, that of the calibration {}: S is of the latter, the "
      "difference is in E",
      millimetres(*ours), millimetres(*theirs));
}

}  // namespace tpm::fit
