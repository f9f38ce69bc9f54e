#include "tpm/haptics/device/operator_script.hpp"

#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace tpm::haptics {

OperatorAim OperatorScript::at(double time_s) noexcept {
  while (now_ + 1 < pieces_.size() && time_s >= pieces_[now_].end_s) {
    start_s_ = pieces_[now_].end_s;
    ++now_;
  }
  const OperatorPiece& piece = pieces_[now_];
  const double length = piece.end_s - start_s_;
  const bool over = time_s >= piece.end_s || !(length > 0.0);
  if (over) return {piece.aim, piece.to, 0.0, piece.across_to_m};
  OperatorAim aim{piece.aim, 0.0, (piece.to - piece.from) / length};
  aim.value = piece.from + aim.rate * (time_s - start_s_);
  aim.across_m_per_s = (piece.across_to_m - piece.across_from_m) / length;
  aim.across_m = piece.across_from_m + aim.across_m_per_s * (time_s - start_s_);
  return aim;
}

std::string to_lines(const OperatorScript& script) {
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

OperatorScript read_operator_script(const std::filesystem::path& file) {
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
