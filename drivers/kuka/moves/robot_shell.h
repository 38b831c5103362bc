#pragma once
// Infrastructure of a Robot on an I/O thread, independent of the protocol: moves, stops and results
// across threads, a snapshot of the state, the tick, and a shutdown that waits for the I/O thread.
//
// Threads: functions marked 'caller' are called by the session's thread, the others on the I/O
// thread. The I/O thread neither locks nor allocates.

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <deque>
#include <future>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "drivers/kuka/moves/cause.h"
#include "drivers/latest_value.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// Short enough to detect silence within a cycle of 4 ms, to process commands without packets, and
/// to poll the contact sensor.
inline constexpr std::chrono::milliseconds kShellTick{2};

/// `Core`: RsiCore or EkiCore.
template <typename Core>
class RobotShell {
 public:
  using State = std::remove_cvref_t<decltype(std::declval<const Core&>().core_state())>;

  bool is_open() const { return open_.load(); }

  /// Caller. Opens the link with this state. Returns the number of this opening, so that commands
  /// of an earlier one are discarded.
  std::uint32_t open(const State& state) {
    snapshot_.store({state});
    open_ = true;
    return ++asked_;
  }
  /// Caller. Not referenced from rereference() on, until the core has obeyed.
  State state() const {
    Snapshot newest = snapshot_.load();
    if (newest.rereferences < rereferences_asked_ && newest.state.link == RobotLink::kReady)
      newest.state.link = RobotLink::kNotReferenced;
    return newest.state;
  }
  /// Caller.
  void begin(const Move& move) {
    if (!is_open()) {
      refuse(move, "the link to the controller is closed");
    } else if (!commands_.push({Command::Kind::kBegin, asked_, move})) {
      refuse(move, "too many moves at once: begin one at a time");
    }
  }
  /// Caller.
  void stop() { send(Command::Kind::kStop); }
  /// Caller.
  void rereference() {
    if (send(Command::Kind::kRereference)) ++rereferences_asked_;
  }
  /// Caller.
  std::optional<MoveResult> poll() {
    if (!refusals_.empty()) {
      MoveResult oldest = std::move(refusals_.front());
      refusals_.pop_front();
      return oldest;
    }
    CoreResult result;
    if (!results_.pop(result)) return std::nullopt;
    return to_move_result(result);
  }

  void start(std::uint32_t opening) { opening_ = opening; }
  bool is_current(std::uint32_t opening) const { return opening == opening_ && is_open(); }
  std::uint32_t opening() const { return opening_; }
  void closed() { open_ = false; }

  /// Passes pending commands to the core.
  void obey(Core& core) {
    commands_.consume_all([&](const Command& command) {
      if (command.kind == Command::Kind::kRereference) ++rereferences_;
      if (command.opening != opening_) return;
      switch (command.kind) {
        case Command::Kind::kBegin: core.begin(command.move); break;
        case Command::Kind::kStop: core.stop(); break;
        case Command::Kind::kRereference: core.rereference(); break;
      }
    });
    if (stop_anyway_.exchange(false)) core.stop();
  }
  void publish(Core& core) {
    while (results_.write_available() > 0) {
      const auto result = core.next_result();
      if (!result) break;
      results_.push(*result);
    }
    snapshot_.store({core.core_state(), rereferences_});
  }

 private:
  static constexpr std::size_t kDepth = 64;

  struct Command {
    enum class Kind { kBegin, kStop, kRereference } kind = Kind::kStop;
    std::uint32_t opening = 0;
    Move move;
  };

  struct Snapshot {
    State state;
    std::uint64_t rereferences = 0;  ///< obeyed, or discarded with their opening
  };

  /// False if the link is closed or, instead, the arm is stopped: a stop is never lost.
  bool send(typename Command::Kind kind) {
    if (!is_open()) return false;
    const bool queued = commands_.push({kind, asked_, {}});
    if (!queued) stop_anyway_ = true;
    return queued;
  }
  void refuse(const Move& move, const char* why) {
    MoveResult result;
    result.id = move.id;
    result.detail = why;
    refusals_.push_back(std::move(result));
  }

  boost::lockfree::spsc_queue<Command, boost::lockfree::capacity<kDepth>> commands_;
  boost::lockfree::spsc_queue<CoreResult, boost::lockfree::capacity<kDepth>> results_;
  std::atomic<bool> stop_anyway_{false}, open_{false};
  Seqlock<Snapshot> snapshot_;
  std::atomic<std::uint64_t> rereferences_asked_{0};
  std::uint64_t rereferences_ = 0;  // I/O thread only
  std::uint32_t opening_ = 0;       // I/O thread only
  std::uint32_t asked_ = 0;         // caller only
  std::deque<MoveResult> refusals_;
};

/// Runs `tick` now and then every `kShellTick` until it returns false or the timer is cancelled.
/// Missed ticks are not made up for.
template <typename Tick>
void keep_ticking(boost::asio::steady_timer& timer, Tick tick) {
  timer.async_wait(
      [&timer, tick = std::move(tick)](const boost::system::error_code& error) mutable {
        if (error || !tick()) return;
        timer.expires_after(kShellTick);
        keep_ticking(timer, std::move(tick));
      });
}

/// Shuts `impl` down on the context's thread and waits for completion.
template <typename Impl>
void shut_and_wait(boost::asio::io_context& context, const std::shared_ptr<Impl>& impl) {
  const auto done = std::make_shared<std::promise<void>>();
  const auto shut = done->get_future();
  boost::asio::post(context, [impl, done] {
    impl->shut();
    done->set_value();
  });
  // A stopped context runs no more handlers: then nothing else uses the robot either.
  constexpr std::chrono::milliseconds kPollInterval{5};
  while (shut.wait_for(kPollInterval) != std::future_status::ready) {
    if (!context.stopped()) continue;
    impl->shut();
    break;
  }
}

}  // namespace cellcal::drivers
