#include "tpm/haptics/device/operator_script.hpp"

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

}  // namespace tpm::haptics
