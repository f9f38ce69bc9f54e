// Shared by the files of the Python module.
#pragma once
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "tpm/base/namespaces.hpp"
#include "tpm/work/interrupted.hpp"

namespace tpm::python {

namespace py = pybind11;

/// A list of numbers from Python; an array of doubles is taken as it stands, without a copy.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

[[nodiscard]] inline std::span<const double> span_of(const Numbers& numbers) {
  return {numbers.data(), static_cast<std::size_t>(numbers.size())};
}

/// Hands a vector over to numpy, without a copy.
[[nodiscard]] inline py::array_t<double> handed_over(std::vector<double> values) {
  auto owned = std::make_unique<std::vector<double>>(std::move(values));
  std::vector<double>* const data = owned.get();
  const py::capsule owner(owned.release(),
                          [](void* p) { delete static_cast<std::vector<double>*>(p); });  // NOLINT
  return py::array_t<double>(static_cast<py::ssize_t>(data->size()), data->data(), owner);
}

/// Long calls of the library, without the interpreter's lock. Ctrl-C and what `progress` raises end
/// them with Interrupted; run() then raises what Python had to say.
class LongCall {
 public:
  /// @param progress None, or called with (done, total)
  explicit LongCall(py::object progress = py::none())
      : state_(std::make_shared<State>(std::move(progress))) {}

  /// For the library's `interrupted`; may be called from any thread, also after run().
  [[nodiscard]] std::function<bool()> interrupted() const {
    return [state = state_] { return state->asked_to_stop(); };
  }
  [[nodiscard]] bool has_progress() const { return state_->has_progress; }
  void tell(std::uint64_t done, std::uint64_t total) const { state_->tell(done, total); }

  /// @returns what `work` returns
  template <class Work>
  auto run(Work&& work) const {
    try {
      const py::gil_scoped_release released;
      return work();
    } catch (const Interrupted&) {
      state_->raise();
      throw;
    }
  }
  /// Raises what Python had to say, if the call came back without throwing.
  void raise() const { state_->raise(); }

 private:
  struct State {
    explicit State(py::object told)
        : progress(std::move(told)), has_progress(!progress.is_none()) {}
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    ~State() {
      const py::gil_scoped_acquire held;
      progress = py::object();
      error.reset();
    }

    bool asked_to_stop() {
      using Clock = std::chrono::steady_clock;
      constexpr std::chrono::milliseconds kEvery{50};
      if (stop) return true;
      // Python handles signals in its main thread only, which is the one that called.
      if (std::this_thread::get_id() != caller) return false;
      const Clock::time_point now = Clock::now();
      if (now - asked < kEvery) return false;
      asked = now;
      const py::gil_scoped_acquire held;
      if (PyErr_CheckSignals() != 0) keep(py::error_already_set());
      return stop;
    }
    void tell(std::uint64_t done, std::uint64_t total) {
      if (!has_progress || stop) return;
      const py::gil_scoped_acquire held;
      try {
        progress(done, total);
      } catch (py::error_already_set& raised) {
        keep(std::move(raised));
      }
    }
    void raise() {
      const std::lock_guard<std::mutex> lock(mutex);
      if (error) throw py::error_already_set(std::move(*error));
    }
    void keep(py::error_already_set raised) {
      const std::lock_guard<std::mutex> lock(mutex);
      if (!error) error.emplace(std::move(raised));
      stop = true;
    }

    py::object progress;
    const bool has_progress;
    const std::thread::id caller = std::this_thread::get_id();
    std::chrono::steady_clock::time_point asked = std::chrono::steady_clock::now();
    std::atomic<bool> stop{false};
    std::mutex mutex;
    std::optional<py::error_already_set> error;
  };
  std::shared_ptr<State> state_;
};

void bind_laws(py::module_& module);
void bind_fits(py::module_& module);
void bind_contacts(py::module_& module);
void bind_runs(py::module_& module);

}  // namespace tpm::python
