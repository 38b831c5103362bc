#pragma once
// Order of a program's motions: which of them may have been the last before a place, through branches, loops, GOTO
// and calls of routines with a given body.

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "calib/export/krl_text.h"
#include "daemon/krl/krl_refusal.h"

namespace cellcal::daemon::krl {

using namespace calib::krl;

/// A routine: its module, from 0, and its name.
using RoutineKey = std::pair<std::size_t, std::string>;

/// Possible last motions before a place.
struct Before {
  std::set<std::size_t> motions;
  std::optional<Lost> lost;  ///< on one of the ways the arm's place is unknown: the reason
};

/// Places of a program, by number.
class Flow {
 public:
  int lost(Lost why) { return put({Kind::kLost, {}, 0, std::move(why), {}}); }
  int motion(std::size_t index, int from) { return put({Kind::kMotion, {from}, index, {}, {}}); }
  /// State at a junction; without ways: never reached.
  int join(std::vector<int> from = {}) { return put({Kind::kJoin, std::move(from), 0, {}, {}}); }
  void lead(int from, int to) { places_[static_cast<std::size_t>(to)].from.push_back(from); }
  /// After a call at `from`; `why`: the reason where the routine's end is unknown.
  int call(int from, RoutineKey routine, Lost why) {
    calls_[routine].push_back(from);
    return put({Kind::kCall, {from}, 0, std::move(why), std::move(routine)});
  }
  void keep(RoutineKey routine, int entry, int exit) {
    routines_[std::move(routine)] = {entry, exit};
  }
  /// Entry of a routine that nothing but this number of statements leads to: it begins where its calls are, if all are known.
  void only_called(const RoutineKey& routine, std::size_t statements);
  /// A motion that may take the place of another: to a point that is copied to the other's.
  void instead(std::size_t motion, std::size_t other) { others_.emplace(motion, other); }

  Before before(int place) const;

  // Forwards, where a call ends in the state that its statement gives.

  /// Places that follow each.
  std::vector<std::vector<int>> next() const;
  /// Places that begin with nothing known, and why.
  std::vector<std::pair<int, Lost>> beginnings() const;

 private:
  enum class Kind { kLost, kMotion, kJoin, kCall };
  struct Place {
    Kind kind = Kind::kLost;
    std::vector<int> from;
    std::size_t motion = 0;
    Lost why;
    RoutineKey routine;
  };
  /// A place within calls, the outermost first.
  using Way = std::pair<int, std::vector<int>>;

  int put(Place place) {
    places_.push_back(std::move(place));
    return static_cast<int>(places_.size()) - 1;
  }
  void follow(const Way& way, Before& before, std::vector<Way>& open) const;

  std::vector<Place> places_;
  std::map<RoutineKey, std::pair<int, int>> routines_;  ///< entry and exit
  std::map<RoutineKey, std::vector<int>> calls_;        ///< the places before them
  std::map<int, std::vector<int>> callers_;             ///< by entry, where they are all
  std::multimap<std::size_t, std::size_t> others_;
};

/// Follows the control statements of one module.
class FlowReader {
 public:
  /// `own`: name of the routine that other modules see; lines without DEF are its own.
  FlowReader(Flow& flow, std::size_t module, std::string own);
  /// IF, LOOP, GOTO, a label, RETURN, DEF, END and the like; others change nothing.
  void control(const Line& line);
  int now() const { return now_; }
  void moved(std::size_t motion) { now_ = flow_.motion(motion, now_); }
  void lose(Lost why) { now_ = flow_.lost(std::move(why)); }
  void call(const RoutineKey& routine, Lost why) {
    now_ = flow_.call(now_, routine, std::move(why));
  }
  /// No way leads here.
  void never() { stop(); }
  /// After the last line.
  void finish();
  /// End of the last routine, or of text without one.
  int exit() const { return exit_; }

 private:
  struct Block {
    bool loop = false, all_cases = false;
    int entry = 0, exit = 0;
  };
  void open(const std::string& word);
  bool close(const std::string& word);
  void next_case(bool last);
  void leave_loop();
  int label(const std::string& name);
  void begin(const Line& line);
  void end();
  /// Sets `now` and returns what it was.
  int stop() { return std::exchange(now_, flow_.join()); }

  Flow& flow_;
  std::size_t module_;
  std::string own_, routine_;
  std::map<std::string, std::size_t> words_;  ///< how often each is in the module
  std::vector<std::string> locals_;           ///< routines that no other module sees
  bool begun_ = false;
  int now_ = 0, entry_ = 0, exit_ = 0;
  std::vector<Block> blocks_;
  std::map<std::string, int> labels_;
};

}  // namespace cellcal::daemon::krl
