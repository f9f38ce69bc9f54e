#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "tpm/data/drive_pieces.hpp"

namespace tpm::data {

/// The first of `count` samples in a row, from `first` to `last` (inclusive), that are at least
/// `level`; none if there is no such run.
[[nodiscard]] std::optional<std::size_t> first_reaching(const std::vector<double>& values,
                                                        std::size_t first, std::size_t last,
                                                        double level, std::size_t count);

/// Where the probe begins to touch, as the response tells.
struct Touch {
  std::optional<std::size_t> index;  ///< none if the response never leaves its floor
  std::size_t motion_start = 0;      ///< first sample of the first rise of the drive
  double floor = 0.0;                ///< level of the response before contact
  bool instantaneous = false;        ///< the response rises with the first movement
};

/// Input of a search for contact or detachment. All SI.
struct TouchSearch {
  const std::vector<double>& drive;
  const std::vector<double>& response;
  const std::vector<DrivePiece>& pieces;  ///< of the drive
  double noise_sd = 0.0;                  ///< of the response
  std::size_t sustained = 3;              ///< samples in a row that make a crossing
};

/// Finds where the response leaves its floor for good: the corner of a line that is flat and then
/// rises with the drive, fitted where the response comes out of its noise.
/// @param level  if given, contact is where the response passes it instead
[[nodiscard]] Touch find_touch(const TouchSearch& search, std::optional<double> level);

/// Where a falling drive leaves the response behind at its floor.
struct Release {
  std::size_t index;  ///< first sample at the floor
  double floor;       ///< level there
};

/// Nothing if the response comes down only with the drive, or not to `contact_floor`.
[[nodiscard]] std::optional<Release> find_release(const TouchSearch& search,
                                                  const DrivePiece& falling, double contact_floor);

/// Least distance of the response from its floor that exceeds the noise, SI.
[[nodiscard]] double touch_margin(const TouchSearch& search);

}  // namespace tpm::data
