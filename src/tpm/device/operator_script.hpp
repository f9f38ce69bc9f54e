#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace tpm {

/// A stretch of what an operator means to do, along one direction.
struct OperatorPiece {
  enum class Aim {
    place,  ///< a position, m, reached through the stiffness of the arm
    force,  ///< a push, N
  };
  Aim aim = Aim::place;
  double end_s = 0.0;  ///< begins where the one before ends
  double from = 0.0, to = 0.0;
};

/// What an operator means to do, for a simulated arm.
class OperatorScript {
 public:
  OperatorScript() = default;
  explicit OperatorScript(std::vector<OperatorPiece> pieces) : pieces_(std::move(pieces)) {}

  /// The piece at a time; calls with rising times are cheap. There is at least one.
  [[nodiscard]] const OperatorPiece& at(double time_s, double& value, double& rate) noexcept;
  [[nodiscard]] const std::vector<OperatorPiece>& pieces() const { return pieces_; }

 private:
  std::vector<OperatorPiece> pieces_;
  std::size_t now_ = 0;
  double start_s_ = 0.0;
};

/// One line a piece: "place|force END FROM TO", numbers that read back as they are.
[[nodiscard]] std::string to_lines(const OperatorScript& script);
/// Throws std::runtime_error for a file that is not such lines.
[[nodiscard]] OperatorScript read_operator_script(const std::filesystem::path& file);

}  // namespace tpm
