#pragma once
// How a test tells a stand-in library, which runs behind dlopen, what its operator does.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tpm/haptics/device/operator_script.hpp"

namespace tpm::haptics {

/// One line a piece: "place|force END FROM TO X Y Z X Y Z", the last six from where to where
/// across; numbers that read back as they are.
[[nodiscard]] inline std::string to_lines(const OperatorScript& script) {
  std::string text;
  for (const OperatorPiece& piece : script.pieces()) {
    char line[320];
    const Eigen::Vector3d& from = piece.across_from_m;
    const Eigen::Vector3d& to = piece.across_to_m;
    (void)std::snprintf(line, sizeof line,
                        "%s %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n",
                        piece.aim == OperatorPiece::Aim::place ? "place" : "force", piece.end_s,
                        piece.from, piece.to, from.x(), from.y(), from.z(), to.x(), to.y(), to.z());
    text += line;
  }
  return text;
}

/// Throws std::runtime_error for a file that is not such lines.
[[nodiscard]] inline OperatorScript read_operator_script(const std::filesystem::path& file) {
  std::ifstream lines(file);
  std::vector<OperatorPiece> pieces;
  std::string line;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string aim;
    OperatorPiece piece;
    words >> aim >> piece.end_s >> piece.from >> piece.to;
    for (double& x_m : piece.across_from_m) words >> x_m;
    for (double& x_m : piece.across_to_m) words >> x_m;
    if (!words || (aim != "place" && aim != "force")) {
      throw std::runtime_error(file.string() + ": '" + line + "' is no piece of a script");
    }
    piece.aim = aim == "place" ? OperatorPiece::Aim::place : OperatorPiece::Aim::force;
    pieces.push_back(piece);
  }
  if (pieces.empty()) throw std::runtime_error(file.string() + ": no operator script");
  return OperatorScript(std::move(pieces));
}

}  // namespace tpm::haptics
