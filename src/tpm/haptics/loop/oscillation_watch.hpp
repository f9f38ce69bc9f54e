#pragma once
#include <array>
#include <cstdint>

namespace tpm::haptics {

/// When a force that goes up and down is taken for an oscillation of the loop.
struct OscillationWatchSettings {
  double period_s = 1e-3;
  double swing_N = 0.3;        ///< smaller ones are not seen
  double least_Hz = 4.0;       ///< slower ones are the operator's
  double fast_Hz = 25.0;       ///< faster ones no hand makes: they need not be regular
  double spread_time = 0.15;   ///< of the times between peaks, in parts of their mean
  double spread_force = 0.25;  ///< of the peaks, in parts of their mean swing
};

/// Finds a limit cycle in the force sent: eight peaks in a row that are equally high and equally
/// far apart, which a hand that moves on purpose does not produce at this rate, or twenty-four
/// faster than a hand can move. A motion that dies out is none. Neither allocates nor throws.
class OscillationWatch {
 public:
  static constexpr std::size_t kRegular = 8, kFast = 24;

  explicit OscillationWatch(const OscillationWatchSettings& settings) noexcept
      : settings_(settings) {}

  /// @param force_N sent, against the push
  /// @param periods since the call before, >= 1
  void observe(double force_N, int periods) noexcept;
  [[nodiscard]] bool found() const noexcept { return found_; }

 private:
  struct Peak {
    std::uint64_t time = 0;  ///< periods
    double force_N = 0.0, swing_N = 0.0;
  };
  void add(const Peak& peak) noexcept;
  [[nodiscard]] const Peak& back(std::size_t i) const noexcept {
    return peaks_[(count_ - 1 - i) % kFast];
  }
  [[nodiscard]] bool regular() const noexcept;
  [[nodiscard]] bool fast() const noexcept;

  OscillationWatchSettings settings_;
  std::array<Peak, kFast> peaks_{};  ///< the last ones, a ring
  std::size_t count_ = 0;
  std::uint64_t now_ = 0, extreme_at_ = 0;
  double extreme_N_ = 0.0, valley_N_ = 0.0;
  bool rising_ = true, found_ = false;
};

}  // namespace tpm::haptics
