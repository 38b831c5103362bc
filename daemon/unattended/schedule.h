#pragma once
// Decides which unattended session begins, and records its decisions. Evaluated in passes by
// daemon/main/unattended_services.h; clocks and cell are injected.
//
// A session begins in a pass where all conditions hold: its window lasts, it is undecided, the
// configuration names a responsible person, nothing is held, no session is under way, and its expected end
// lies within the window. The decision is on disk before the session begins.
//
// Where the journal is new or was opened without its head, aborts and begun windows may be missing: nothing begins until
// an operator releases it or has run a session to its end.
//
// The wall clock determines the window. After a step (a minute or more relative to the clock since boot), and
// after a boot without synchronisation, it is not used until an operator releases it or it has been
// synchronised for ten minutes without another step.

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/config/unattended_config.h"
#include "daemon/journal/journal.h"
#include "daemon/service/status.h"
#include "daemon/session/failure.h"
#include "daemon/unattended/decision.h"

namespace cellcal::daemon {

// Interface of the schedule to the sessions; implemented for the daemon by service_session_gateway.cc.

/// Situation after the newest session recorded by this installation.
struct Standing {
  enum class State { kNone, kDone, kFailed, kAborted, kInterrupted };
  bool busy = false;           ///< a session is under way, or releasing its devices
  std::int64_t session = 0;    ///< the newest; 0: none
  State state = State::kNone;  ///< of its newest end; undefined while busy
  std::string end;             ///< distinguishes this end from others of the same session
  Failure failure;             ///< kFailed; kAborted by the daemon itself
  double left_share = 1.0;     ///< share of its touches still to be made
  std::uint64_t aborts = 0;    ///< requested by a person since the daemon started
};

/// Temporarily impossible.
struct NotNow : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class SessionGateway {
 public:
  virtual ~SessionGateway() = default;
  virtual Standing standing() = 0;
  /// Begins a session, unless an abort was requested since `aborts` was read; returns its number. `by`:
  /// responsible person, recorded in its events. Throws NotNow, std::exception.
  virtual std::int64_t begin(const ScheduledSession& session, const std::string& by,
                             std::uint64_t aborts) = 0;
  /// Resumes the newest session, as an operator would. Likewise.
  virtual std::int64_t resume(const std::string& by, std::uint64_t aborts) = 0;
  /// Stops the arm and ends the session, since its window is over.
  virtual void stop() = 0;
  /// For the daemon's status.
  virtual void show(const ScheduleSeen& schedule) = 0;
  /// Expected duration, from earlier sessions or a default.
  virtual double foreseen_s(const ScheduledSession& session) = 0;
};

// Persistent state of the schedule: written to the journal before a session begins, so that a restart neither
// repeats a session nor releases a hold. Format "cellcal.schedule/1", in which "night" is a
// window's day, "looked" the time evaluated so far and "aborted" the session of a hold.

/// A window decided finally: begun, refused or missed.
struct ClosedWindow {
  std::string entry, day;
  bool missed = false;  ///< nothing was begun: a clock set back may repeat it
};

/// Simultaneous values of the wall clock and the clock since boot.
struct ClockMark {
  std::string boot;  ///< id of this boot; empty: none
  UtcSeconds utc = 0;
  double since_boot_s = 0.0;
};

/// The wall clock is not used.
struct ClockDoubt {
  Why why = Why::kClockStepped;
  double set_by_s = 0.0;
};

/// Nothing begins until released, or until a later session is done.
struct Hold {
  std::int64_t session = 0;  ///< the newest at that time
  Why why = Why::kAbortedBefore;
};

struct ScheduleState {
  UtcSeconds evaluated_until = 0;           ///< evaluated up to this time
  std::map<std::string, UtcSeconds> known;  ///< time at which an entry was added
  std::deque<ClosedWindow> closed;          ///< newest last
  std::optional<Hold> hold;
  ClockMark clock;
  std::optional<ClockDoubt> clock_doubt;
  std::string released;            ///< inspected end (Standing::end)
  std::string left;                ///< interruption that was reported
  std::string harmless;            ///< end after which another may begin
  std::deque<Decision> decisions;  ///< newest last

  /// Also after an end that was released.
  void hold_from(const Hold& since);
  /// `lasts`: now lies within the window, in which a missed session may still begin.
  bool is_closed(const std::string& entry, const std::string& day, bool lasts = false) const;
  void close(const std::string& entry, const std::string& day, bool missed);
  void reopen_missed(const std::string& entry, const std::string& day);
  void add(Decision decision);
};

std::string to_text(const ScheduleState& state);
/// Inverse of to_text(); an initial state for an empty text. Throws std::runtime_error where it is damaged.
ScheduleState schedule_state_from(const std::string& text);

/// Public state of the schedule.
struct SchedulePicture {
  struct Entry {
    ScheduledSession session;
    Window now;  ///< in which a session may begin now, or be resumed; empty: none
    Window next;
    double foreseen_s = 0.0;
    std::optional<Decision> last;
  };
  bool unattended = false;
  std::string responsible;
  int resumes = 0;
  Why held = Why::kNothing;  ///< why no session begins automatically
  calib::Phrase held_words;  ///< empty: not held
  std::vector<Entry> entries;
  std::vector<Decision> decisions;  ///< newest first
};

class Schedule {
 public:
  using Steady = std::chrono::steady_clock::time_point;
  struct Clocks {
    std::function<UtcSeconds()> utc;
    std::function<Steady()> steady;      ///< since boot
    std::string boot;                    ///< id; empty: each start counts as one
    std::function<bool()> synchronised;  ///< the wall clock, with its time source
  };
  /// Storage of the state. Both throw std::exception.
  struct Store {
    std::function<StoredSchedule()> load;
    std::function<void(const std::string&)> save;  ///< on disk on return
  };
  struct Parts {
    SessionGateway& cell;
    Store store;
    std::function<ScheduleConfig()> config;  ///< current configuration
    Clocks clocks;
    /// Called with each decision, from the evaluating thread. May be null.
    std::function<void(const Decision&)> on_decision;
  };
  explicit Schedule(Parts parts);

  void update();
  /// Begins a session on request, if permitted; returns the decision.
  Decision begin(const std::string& entry);
  /// Confirms that cell and arm were inspected: releases a hold.
  Decision release(const std::string& by);
  SchedulePicture picture() const;
  /// False while the wall clock is not used.
  bool trusts_clock();

 private:
  struct Own {  ///< the session begun by the schedule
    std::int64_t session = 0;
    ScheduledSession entry;
    Window window;
    int resumes = 0;
    Steady ends{};  ///< end of the window, independent of wall clock steps
    bool stopped = false;
    std::optional<Steady> resume_at;
  };
  struct Inputs {  ///< inputs of one pass
    ScheduleConfig config;
    UtcSeconds now = 0;
    Steady steady{};
    Standing cell;
  };

  Inputs read_inputs();
  void notice_clock(const Inputs& inputs);
  void doubt_clock(const Inputs& inputs, Why why, double set_by_s);
  void report_left(const Inputs& inputs);
  void report_held(const Inputs& inputs, Why why, double figure_s);
  void restore_clock_trust(const Inputs& inputs);
  void notice_ends(const Inputs& inputs);
  void follow(const Inputs& inputs);
  void follow_end(const Inputs& inputs);
  void resume(const Inputs& inputs);
  void decide(const Inputs& inputs, const ScheduledSession& entry, const Window& window);
  void close(const ScheduledSession& entry, const Window& window, Decision decision);
  Why obstacle(const Inputs& inputs, const ScheduledSession& entry, const Window& window,
               Decision& why);
  Why held(const Inputs& inputs, Decision& why) const;
  Decision begin(const Inputs& inputs, const ScheduledSession& entry, const Window& window);
  Why over(const ScheduledSession& entry, const Window& window) const;
  Decision of(const Inputs& inputs, const ScheduledSession& entry, const Window& window) const;
  const Decision* newest(const std::string& entry, const std::string& day) const;
  bool may_begin_in(const ScheduledSession& entry, const Window& window) const;
  void report(Decision decision);
  bool keep();
  void show(const Inputs& inputs);
  ScheduleSeen seen(const SchedulePicture& picture) const;
  std::string by(const ScheduleConfig& config, const ScheduledSession& entry) const;

  Parts parts_;
  std::mutex deciding_;  ///< serialises passes and requests
  ScheduleState state_;
  std::string damaged_;  ///< fault of the stored state: nothing begins
  std::string disk_;     ///< error of the last write
  bool dirty_ = false;
  UtcSeconds kept_ = 0, started_ = 0;
  bool clock_set_ = false;              ///< forward, in this pass
  std::optional<Steady> agrees_since_;  ///< begin of synchronisation without a step
  std::uint64_t aborts_seen_ = 0;
  std::optional<Own> own_;

  mutable std::mutex showing_;
  SchedulePicture picture_;
};

}  // namespace cellcal::daemon
