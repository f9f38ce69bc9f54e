// Declared in tpmkit/servo_loop.hpp.
#include <algorithm>
#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <chrono>
#include <cmath>
#include <exception>
#include <thread>

#include "tpm/haptics/device/forces_off_guard.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpm/haptics/loop/servo_step.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kRingRows = 1U << 16U;  // 16 s at 4 kHz

/// In place of the time since which a cycle lasts: the watch has given it up.
constexpr std::int64_t kLeftBehind = -1;

/// State that the threads of a session share. The stuck thread of a cycle that does not end keeps
/// it alive.
struct Shared {
  Shared(std::shared_ptr<HapticDevice> d, std::shared_ptr<ContactModel> m, const ServoSettings& s)
      : device(std::move(d)), model(std::move(m)), settings(s), step(*device, *model, s) {
    touch_ring();
  }

  std::shared_ptr<HapticDevice> device;
  std::shared_ptr<ContactModel> model;
  ServoSettings settings;
  ServoStep step;
  boost::lockfree::spsc_queue<ServoRecord> ring{kRingRows};
  std::atomic<std::uint64_t> dropped{0};
  std::atomic<std::int64_t> busy_since_ns{0};  ///< 0: sleeping, or over
  std::atomic<StopCause> wanted{StopCause::none};
  std::atomic<bool> scheduled{false}, begin{false}, over{false};
  // Written by the loop before `over`, read after it.
  std::string scheduling;
  std::exception_ptr refused;  ///< by the system, or forces that could not be switched on
  std::int64_t stop_took_ns = 0;
  // Of completed cycles. Written by the loop between two cycles; whoever sets busy_since_ns to
  // kLeftBehind reads them from then on.
  TimeHistogram woke_late, busy;
  ServoCounts counts;
  std::uint64_t cycles = 0;
  std::int64_t first_cycle_ns = 0;

 private:
  /// Every page of the ring is there before the loop begins, also where memory cannot be locked.
  void touch_ring() {
    ServoRecord row;
    while (ring.push(row)) {
    }
    while (ring.pop(row)) {
    }
  }
};

/// The loop proper: nothing in here allocates, locks or throws.
void serve(Shared& s) noexcept {
  const auto period_ns = static_cast<std::int64_t>(std::llround(s.settings.period_s * 1e9));
  const double period_s = s.settings.period_s;
  std::int64_t deadline = now_ns() + period_ns;
  ServoRecord row;
  StopCause cause = StopCause::none;
  while (cause == StopCause::none) {
    sleep_until_ns(deadline);
    const std::int64_t woke = now_ns();
    s.busy_since_ns.store(woke, std::memory_order_release);
    const std::int64_t late_ns = woke - deadline;  // of the first period that went by
    const std::int64_t missed = std::max<std::int64_t>(late_ns / period_ns, 0);
    deadline += missed * period_ns;
    const StopCause wanted = s.wanted.load(std::memory_order_acquire);
    if (wanted != StopCause::none) {
      s.step.stop(wanted);
      cause = wanted;
    } else {
      s.device->advance(static_cast<double>(missed) * period_s);
      cause = s.step.cycle(static_cast<int>(std::min<std::int64_t>(missed, 1'000'000)), row);
      s.device->advance(period_s);
      const std::int64_t done = now_ns();
      std::int64_t since = woke;
      if (!s.busy_since_ns.compare_exchange_strong(since, 0, std::memory_order_acq_rel)) {
        s.step.stop(StopCause::cycle_timeout);
        return;
      }
      row.woke_late_s = static_cast<float>(static_cast<double>(late_ns) * 1e-9);
      row.busy_s = static_cast<float>(static_cast<double>(done - woke) * 1e-9);
      s.woke_late.note(late_ns);
      s.busy.note(done - woke);
      s.counts = s.step.counts();
      s.cycles = s.step.cycles();
      if (s.first_cycle_ns == 0 && row.phase >= 0) {
        s.first_cycle_ns = deadline - static_cast<std::int64_t>(row.cycle) * period_ns;
      }
      if (!s.ring.push(row)) s.dropped.fetch_add(1, std::memory_order_relaxed);
    }
    if (cause != StopCause::none) s.stop_took_ns = now_ns() - woke;
    s.busy_since_ns.store(0, std::memory_order_release);
    deadline += period_ns;
  }
}

/// Forces on and the loop, with nothing in between.
void forces_on_and_serve(Shared& s) noexcept {
  try {
    s.device->enable_forces();
  } catch (...) {
    s.device->stop();
    s.refused = std::current_exception();
    return;
  }
  serve(s);
}

/// Takes what the loop has written; ends when told so and the ring is empty.
class RecordThread {
 public:
  RecordThread(std::shared_ptr<Shared> shared, const RecordSink& sink,
               const std::function<void()>& idle)
      : shared_(std::move(shared)), thread_([this, sink, idle] { drain(sink, idle); }) {}
  ~RecordThread() {
    ending_ = true;
    if (thread_.joinable()) thread_.join();
  }
  RecordThread(const RecordThread&) = delete;
  RecordThread& operator=(const RecordThread&) = delete;

  /// The last rows are written when this returns.
  void finish() {
    ending_ = true;
    thread_.join();
    if (fault_) std::rethrow_exception(fault_);
  }

 private:
  void drain(const RecordSink& sink, const std::function<void()>& idle) noexcept {
    try {
      for (;;) {
        const bool last = ending_;
        ServoRecord row;
        while (shared_->ring.pop(row)) sink(row);
        if (idle) idle();
        if (last) return;
        std::this_thread::sleep_for(10ms);
      }
    } catch (...) {
      fault_ = std::current_exception();
      shared_->wanted.store(StopCause::exception, std::memory_order_release);
    }
  }

  std::shared_ptr<Shared> shared_;
  std::atomic<bool> ending_{false};
  std::exception_ptr fault_;
  std::thread thread_;
};

/// Cuts the forces from a thread that may itself get stuck, and waits for it a little.
void cut_forces_from_outside(const std::shared_ptr<Shared>& shared) {
  auto cut = std::make_shared<std::atomic<bool>>(false);
  std::thread([shared, cut] {
    shared->device->cut_forces();
    *cut = true;
  }).detach();
  for (int i = 0; i < 20 && !*cut; ++i) std::this_thread::sleep_for(100us);
}

/// The loop in its thread. However this ends, the forces are off then and no thread is left to
/// end the program; one that is stuck stays behind.
class LoopThread {
 public:
  LoopThread(std::shared_ptr<Shared> shared, RealTimeWish wish)
      : shared_(std::move(shared)), thread_([s = shared_, wish] {
          const SignalStack signal_stack;
          try {
            s->scheduling = become_real_time(wish);
          } catch (...) {
            s->refused = std::current_exception();
          }
          s->scheduled.store(true, std::memory_order_release);
          while (!s->begin.load(std::memory_order_acquire)) std::this_thread::sleep_for(100us);
          const StopCause wanted = s->wanted.load(std::memory_order_acquire);
          if (wanted != StopCause::none) {
            s->step.stop(wanted);
          } else if (!s->refused) {
            forces_on_and_serve(*s);
          }
          s->over.store(true, std::memory_order_release);
        }) {}
  ~LoopThread() {
    if (!thread_.joinable()) return;
    shared_->wanted.store(StopCause::exception, std::memory_order_release);
    shared_->begin.store(true, std::memory_order_release);
    constexpr int kPatience = 1000;  // ms
    for (int i = 0; i < kPatience && !over(); ++i) std::this_thread::sleep_for(1ms);
    if (over()) {
      thread_.join();
    } else {
      cut_forces_from_outside(shared_);
      thread_.detach();
    }
  }
  LoopThread(const LoopThread&) = delete;
  LoopThread& operator=(const LoopThread&) = delete;

  void join() { thread_.join(); }
  void leave_behind() { thread_.detach(); }

 private:
  [[nodiscard]] bool over() const { return shared_->over.load(std::memory_order_acquire); }

  std::shared_ptr<Shared> shared_;
  std::thread thread_;
};

/// Waits for the loop; true if a cycle did not end in time.
bool watch(const std::shared_ptr<Shared>& s, const RealTimeOptions& options,
           std::int64_t& stop_took_ns) {
  const auto limit_ns = static_cast<std::int64_t>(options.cycle_timeout_s * 1e9);
  while (!s->over.load(std::memory_order_acquire)) {
    std::this_thread::sleep_for(500us);
    if (ForcesOffGuard::ended_by_signal() || (options.interrupted && options.interrupted())) {
      s->wanted.store(StopCause::signal, std::memory_order_release);
    }
    std::int64_t since = s->busy_since_ns.load(std::memory_order_acquire);
    if (since != 0 && now_ns() - since > limit_ns &&
        s->busy_since_ns.compare_exchange_strong(since, kLeftBehind, std::memory_order_acq_rel)) {
      // Should the stuck call come back, its thread ends there.
      s->wanted.store(StopCause::cycle_timeout, std::memory_order_release);
      cut_forces_from_outside(s);
      stop_took_ns = now_ns() - since;
      s->busy.note(stop_took_ns);  // so far
      return true;
    }
  }
  return false;
}

/// Counts of the completed cycles, also if the last one hangs.
void fill_counts(ServoOutcome& outcome, const Shared& s) {
  outcome.cycles = s.cycles;
  outcome.counts = s.counts;
  outcome.woke_late = s.woke_late;
  outcome.busy = s.busy;
  outcome.first_cycle_monotonic_ns = s.first_cycle_ns;
}

void fill(ServoOutcome& outcome, Shared& s) {
  s.step.complete_cause();
  if (outcome.detail.empty()) outcome.detail = s.step.detail();
  outcome.cause = s.step.cause();
  outcome.device = s.step.device_status();
  outcome.stop_took_s = static_cast<double>(s.stop_took_ns) * 1e-9;
}

}  // namespace

ServoOutcome run_in_real_time(const std::shared_ptr<HapticDevice>& device,
                              const std::shared_ptr<ContactModel>& model,
                              const ServoSettings& settings, const RecordSink& sink,
                              const RealTimeOptions& options) {
  const ForcesOffGuard guard(*device);
  auto shared = std::make_shared<Shared>(device, model, settings);
  RecordThread records(shared, sink, options.idle);
  LoopThread loop(shared, options.wish);
  while (!shared->scheduled.load(std::memory_order_acquire)) std::this_thread::sleep_for(100us);

  ServoOutcome outcome;
  outcome.real_time = true;
  outcome.scheduling = shared->scheduling;
  std::int64_t stop_took_ns = 0;
  if (!shared->refused && options.prepare) options.prepare();
  const bool timed_out = [&] {
    const AboveRealTime watching;
    shared->begin.store(true, std::memory_order_release);
    return watch(shared, options, stop_took_ns);
  }();
  if (timed_out) {
    loop.leave_behind();
    outcome.cause = StopCause::cycle_timeout;
    outcome.stop_took_s = static_cast<double>(stop_took_ns) * 1e-9;
    outcome.detail = "a cycle did not end within the limit; its thread was left behind";
  } else {
    loop.join();
  }
  try {
    records.finish();
  } catch (const std::exception& error) {
    outcome.detail = error.what();
  } catch (...) {
    outcome.detail = "something that is no error was thrown by whoever records";
  }
  outcome.dropped_records = shared->dropped;
  fill_counts(outcome, *shared);
  if (timed_out) return outcome;
  if (shared->refused) {
    device->stop();
    std::rethrow_exception(shared->refused);
  }
  fill(outcome, *shared);
  return outcome;
}

}  // namespace tpm::haptics
