#pragma once
// Decides which unattended session begins, and records its decisions. Evaluated in passes by
// service_session_gateway.h; clocks and cell are injected.
//
// A session begins in a pass where all conditions hold: its window lasts, this night is undecided, the
// configuration names a responsible person, nothing is held, no session is under way, and its expected end
// lies within the window. The decision is on disk before the session begins.
//
// The wall clock determines the window. After a step (a minute or more relative to the clock since boot), and
// after a boot without synchronisation, it is not used until an operator releases it or it has been
// synchronised for ten minutes without another step.

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "daemon/unattended/schedule_state.h"
#include "daemon/unattended/session_gateway.h"

namespace cellcal::daemon {

/// Public state of the schedule.
struct SchedulePicture {
  struct Entry {
    ScheduledSession session;
    Night now;  ///< empty: outside its window
    Night next;
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
    std::function<std::string()> load;             ///< newest stored text; empty: none
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

  void look();
  /// Begins a session on request, if permitted; returns the decision.
  Decision begin(const std::string& entry);
  /// Confirms that cell and arm were inspected: releases a hold.
  Decision release(const std::string& by);
  SchedulePicture picture() const;

 private:
  struct Own {  ///< the session begun by the schedule
    std::int64_t session = 0;
    ScheduledSession entry;
    Night night;
    int resumes = 0;
    Steady ends{};  ///< end of the window, independent of wall clock steps
    bool stopped = false;
    std::optional<Steady> resume_at;
  };
  struct Look {  ///< inputs of one pass
    ScheduleConfig config;
    UtcSeconds now = 0;
    Steady steady{};
    Standing cell;
  };

  Look see();
  void notice_clock(const Look& look);
  void doubt_clock(const Look& look, Why why, double set_by_s);
  void restore_clock_trust(const Look& look);
  void notice_ends(const Look& look);
  void follow(const Look& look);
  void follow_end(const Look& look);
  void resume(const Look& look);
  void decide(const Look& look, const ScheduledSession& entry, const Night& night);
  void close(const ScheduledSession& entry, const Night& night, Decision decision);
  Why obstacle(const Look& look, const ScheduledSession& entry, const Night& night, Decision& why);
  Why held(const Look& look, Decision& why) const;
  Decision begin(const Look& look, const ScheduledSession& entry, const Night& night);
  Why over(const ScheduledSession& entry, const Night& night) const;
  Decision of(const Look& look, const ScheduledSession& entry, const Night& night) const;
  const Decision* newest(const std::string& entry, const std::string& night) const;
  void tell(Decision decision);
  bool keep();
  void show(const Look& look);
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
