#include "tpm/fit/recording/motion_before_load.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/data/drive_pieces.hpp"
#include "tpm/fit/adequacy.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kFewestStill = 10;

}  // namespace

std::size_t still_samples(const Recording& r, std::size_t at_rest) {
  constexpr double kCreeps = 0.01;  // part of the range that a still drive may creep
  const double jitter = data::noise_sd(r.time_s, r.drive, 0, r.drive.size() - 1);
  const auto pieces = data::drive_pieces(r.time_s, r.drive, jitter, kCreeps);
  const data::DrivePiece& first = pieces.front();
  if (first.motion != data::Motion::still) return at_rest;
  const std::size_t still = std::min(first.last + 1, at_rest);
  return still >= kFewestStill ? still : at_rest;
}

std::string load_in_air(const Recording& r, std::size_t at_rest) {
  constexpr double kSure = 4.0;
  const std::size_t end = std::min(at_rest, r.time_s.size());
  const std::size_t still = still_samples(r, end);
  if (still >= end) return {};
  const auto all = rest_trend(std::span(r.time_s).first(end), std::span(r.response).first(end));
  const auto of_still =
      rest_trend(std::span(r.time_s).first(still), std::span(r.response).first(still));
  if (!all || !of_still) return {};
  const bool told = std::abs(all->per_s) > kSure * of_still->standard_error;
  const bool differs = std::abs(all->per_s - of_still->per_s) >
                       kSure * std::hypot(all->standard_error, of_still->standard_error);
  if (!told || !differs) return {};
  return fmt::format(
      "a load that changes as the probe moves before contact (buoyancy, drag, a guide), from {} s "
      "on, and does not where it rests: no drift",
      significant(r.time_s[still - 1], 4));
}

}  // namespace tpm::fit
