#pragma once
// Decides which unattended session begins, and records its decisions. Evaluated in passes by
// service_session_gateway.h; clocks and cell are injected.
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
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "daemon/journal/journal.h"
#include "daemon/unattended/schedule_state.h"
#include "daemon/unattended/session_gateway.h"

namespace cellcal::daemon {

/// Public state of the schedule.
struct SchedulePicture {
  struct Entry {
    ScheduledSession session;
    Window now;  ///< empty: outside its window
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
    std::string boot;                    ///< id of this boot; empty: unknown
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
  void report(Decision decision);
  bool keep();
  void show(const Inputs& inputs);
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
