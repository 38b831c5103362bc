#pragma once
// Decides which session begins when nobody is there, and keeps what it has decided. One look after the other, by
// whoever has a thread for it (schedule_thread.h); clocks and cell are given to it.
//
// A session begins in a look where all of this holds: its window lasts, nothing was decided for this night yet,
// the configuration says that somebody answers for the cell, nothing is held, no session is under way, and its
// foreseen time ends before the window. That it begins is on disk before it does.
//
// The wall clock says which window lasts. Where it was set (by a minute or more against the clock since the computer's
// start), and behind a start without synchronisation, it decides nothing until somebody releases it or it has been
// synchronised, without another step, for ten minutes.

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "daemon/unattended/cell_door.h"
#include "daemon/unattended/schedule_state.h"

namespace cellcal::daemon {

/// What others see of the schedule.
struct SchedulePicture {
  struct Entry {
    ScheduledSession session;
    Night now;  ///< empty: not within its window
    Night next;
    double foreseen_s = 0.0;
    std::optional<Decision> last;
  };
  bool unattended = false;
  std::string responsible;
  int resumes = 0;
  Why held = Why::kNothing;  ///< why nothing begins by itself
  std::string held_words;    ///< empty: it is not
  std::vector<Entry> entries;
  std::vector<Decision> decisions;  ///< newest first
};

class Schedule {
 public:
  using Steady = std::chrono::steady_clock::time_point;
  struct Clocks {
    std::function<UtcSeconds()> utc;
    std::function<Steady()> steady;      ///< since the computer's start
    std::string boot;                    ///< tells this start from others; empty: not known
    std::function<bool()> synchronised;  ///< the wall clock, with its time source
  };
  /// Where the state is kept. Both throw std::exception.
  struct Store {
    std::function<std::string()> load;             ///< as it was stored last; empty: never
    std::function<void(const std::string&)> save;  ///< on disk when it returns
  };
  struct Parts {
    CellDoor& cell;
    Store store;
    std::function<ScheduleConfig()> config;  ///< the newest
    Clocks clocks;
    /// Each decision as it is made; from the thread that looks. May be null.
    std::function<void(const Decision&)> on_decision;
  };
  explicit Schedule(Parts parts);

  void look();
  /// A session that begins on request, if it may; what was decided.
  Decision begin(const std::string& entry);
  /// Somebody has looked at the cell and the arm: what is held is not any more.
  Decision release(const std::string& by);
  SchedulePicture picture() const;

 private:
  struct Own {  ///< the session that the schedule has begun
    std::int64_t session = 0;
    ScheduledSession entry;
    Night night;
    int resumes = 0;
    Steady ends{};  ///< the night, whatever the wall clock is set to
    bool stopped = false;
    std::optional<Steady> resume_at;
  };
  struct Look {  ///< what one look sees
    ScheduleConfig config;
    UtcSeconds now = 0;
    Steady steady{};
    Standing cell;
  };

  Look see();
  void notice_clock(const Look& look);
  void doubt_clock(const Look& look, Why why, double set_by_s);
  void trust_clock_again(const Look& look);
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
  std::mutex deciding_;  ///< one look or request at a time
  ScheduleState state_;
  std::string damaged_;  ///< what was stored is: nothing begins
  std::string disk_;     ///< why it could not be written the last time
  bool dirty_ = false;
  UtcSeconds kept_ = 0, started_ = 0;
  bool clock_set_ = false;              ///< forward, in this look
  std::optional<Steady> agrees_since_;  ///< wall clock and time source, without a step
  std::uint64_t aborts_seen_ = 0;
  std::optional<Own> own_;

  mutable std::mutex showing_;
  SchedulePicture picture_;
};

}  // namespace cellcal::daemon
