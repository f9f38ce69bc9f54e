#pragma once
#include <array>
#include <cstdint>

namespace tpm::haptics {

/// When a force that goes up and down is taken for an oscillation of the loop.
struct OscillationWatchSettings {
  double period_s = 1e-3;
  double turn_N = 0.05;             ///< by which a force turns; smaller ripples are not seen
  double swing_N = 0.3;             ///< of the strokes of a steady oscillation
  double longest_stroke_s = 0.125;  ///< slower ones are the operator's: below 4 Hz
  double growth = 1.1;              ///< of a stroke beyond the one of the same direction before
  double decay = 0.8;               ///< of the later half beside the earlier one: it dies out
  double spread_time = 0.15;        ///< of the times of a steady one, in parts of their mean
  double spread_force = 0.25;       ///< of equal strokes, in parts of their mean
  double fast_Hz = 25.0;            ///< faster ones no hand makes: they need not be regular
};

/// Finds an oscillation in the force sent by its rate and growth. A stroke is the way from a peak
/// to the next valley or back. Found are
///
///   - growing: kGrowing strokes in a row, each faster than `longest_stroke_s` and larger than the
///     last one of its direction by `growth`, as of a loop that feeds itself;
///   - steady: kSteady such strokes that do not die out, at times as regular as a hand does not
///     make at this rate, however large each one is; kEqual where they are equally large, too;
///   - fast: kFast strokes faster than a hand can move that do not die out.
///
/// Neither allocates nor throws.
class OscillationWatch {
 public:
  static constexpr std::size_t kGrowing = 8, kEqual = 16, kSteady = 32, kFast = 48;

  explicit OscillationWatch(const OscillationWatchSettings& settings) noexcept
      : settings_(settings) {}

  /// @param force_N sent, against the push
  /// @param periods since the call before, >= 1
  void observe(double force_N, int periods) noexcept;
  [[nodiscard]] bool found() const noexcept { return found_; }

 private:
  struct Stroke {
    std::uint64_t periods = 0;
    double swing_N = 0.0;
  };
  void add(const Stroke& stroke) noexcept;
  [[nodiscard]] const Stroke& back(std::size_t i) const noexcept {
    return strokes_[(count_ - 1 - i) % kFast];
  }
  [[nodiscard]] bool grows(std::size_t strokes) const noexcept;
  [[nodiscard]] bool steady(std::size_t strokes) const noexcept;
  [[nodiscard]] bool equal(std::size_t strokes) const noexcept;
  [[nodiscard]] bool fast() const noexcept;
  [[nodiscard]] bool stays(std::size_t strokes) const noexcept;

  OscillationWatchSettings settings_;
  std::array<Stroke, kFast> strokes_{};  ///< the last ones, a ring
  std::size_t count_ = 0;
  std::uint64_t now_ = 0, extreme_at_ = 0, turned_at_ = 0;
  double extreme_N_ = 0.0, turned_N_ = 0.0;
  bool rising_ = true, found_ = false;
};

}  // namespace tpm::haptics
