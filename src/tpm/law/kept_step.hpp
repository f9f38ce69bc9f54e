#pragma once
#include <optional>
#include <span>
#include <vector>

#include "tpm/law/contact_history.hpp"

namespace tpm::law {

/// The kernel of a law at given parameters, what acts beside it, and where these stand.
struct KernelAtParameters {
  KernelPlaces place;
  double k_tension, spacing, contact, offset;
  KernelShape kernel;
};
[[nodiscard]] KernelAtParameters kernel_at(const LawSpec& spec,
                                           const std::vector<LawParameter>& table,
                                           std::span<const double> values);

/// A load imposed suddenly and then constant that elastic tension helps to carry.
[[nodiscard]] std::optional<Response> respond_to_kept_load(const LawAtParameters& law,
                                                           const Protocol& protocol,
                                                           std::span<const double> times_s,
                                                           Want want);

/// A step of the depth or of the load on a law with spring-pots: G(t) V(u) and V(u) = J(t) F,
/// exact at any time after the step, and under a load at the step itself. Nothing for other laws
/// and histories, for elastic tension, for a depth on a curved kernel (its slope by the contact
/// depth has no closed form there), for a depth at the step itself, or where the step leaves the
/// probe out of contact.
[[nodiscard]] std::optional<Response> respond_to_step(const LawSpec& spec,
                                                      const std::vector<LawParameter>& table,
                                                      std::span<const double> parameters,
                                                      const Protocol& protocol,
                                                      std::span<const double> times_s, Want want);

}  // namespace tpm::law
