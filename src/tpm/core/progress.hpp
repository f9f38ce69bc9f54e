#pragma once
#include <cstddef>
#include <string>

namespace tpm {

/// One line of progress on standard error, rewritten in place; silent unless standard error is a
/// terminal, so that pipes and logs stay clean.
class Progress {
 public:
  /// @param what a short phrase ("profiling", "coverage")
  /// @param total number of steps; 0 if not known
  Progress(std::string what, std::size_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::size_t steps = 1);

 private:
  void draw() const;
  std::string what_;
  std::size_t total_;
  std::size_t done_ = 0;
  bool on_terminal_;
};

}  // namespace tpm
