#pragma once
// Active tool and base while a .src file is read from top to bottom.

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "daemon/krl/krl_calls.h"
#include "daemon/krl/krl_program.h"

namespace cellcal::daemon::krl {

/// Names that these lines read or change, except values of $TOOL, $BASE and $LOAD, indices, and arguments of BAS.
std::set<std::string> touched_names(const std::vector<Line>& lines);

/// Parameters of routines and variables declared without a value: they hide those of the .dat.
std::set<std::string> hidden_names(const std::vector<Line>& lines);

/// True if one of these lines sets $LOAD otherwise than inline forms do.
bool sets_load(const std::vector<Line>& lines);

/// True: the line only sets frames and contains no motion.
bool only_sets_frames(const Line& line);

/// Frames at each line of a .src file: known where all paths to it agree. A routine that statements of its own file alone
/// call begins with the frames of its calls; all others begin with none.
class FrameState {
 public:
  /// `own`: name of the routine that other modules see. `shared`: data that all modules see, those of routines of other
  /// modules.
  FrameState(const std::vector<Line>& lines, const std::string& own, const Data& data,
             const Data& shared, Calls calls);

  /// Before the line; null: no path leads there.
  const Frames* before(const Line& line) const;
  /// For a motion that a path leads to, including its own WITH.
  Frames at_motion(const Line& line, std::optional<Refusal>& wrong) const;
  /// FDATs used by motions.
  const std::map<std::string, int>& frame_data_used() const { return used_; }
  /// Number of blocks that a line begins; negative: ends.
  static int blocks(const Line& line);

 private:
  struct State {
    Frames now, pending, outside_spline;  ///< `pending`: of FDAT_ACT
    std::optional<Refusal> wrong, pending_wrong;
  };
  FrameState(const std::vector<Line>& lines, const Data& data, const Data& shared, Calls calls)
      : data_(data),
        shared_(shared),
        calls_(calls),
        touched_(touched_names(lines)),
        hidden_(hidden_names(lines)),
        sets_load_(sets_load(lines)) {
    touched_.insert(hidden_.begin(), hidden_.end());
  }
  /// Finds the state at each line; that after the last one. `entry`: before the first one.
  const std::optional<State>& run(const std::vector<Line>& lines, const std::string& own,
                                  const State* entry);
  /// Runs one that sets frames, or after which they are unknown.
  void step(const Line& line, State& state) const;
  /// With the values of INTs by name, and of [F.TOOL_NO] and [F.BASE_NO].
  Line with_numbers(Line line) const;
  bool steps(const Line& line) const;
  static bool meet(State& into, const State& other);
  const std::optional<State>& state(const Line& line) const {
    return states_[static_cast<std::size_t>(before_.at(line.number))];
  }

  void read_frame_data(const Line& line, State& state) const;
  void read_bas(const Line& line, State& state) const;
  /// Frames after a call whose body is given; false: not known.
  bool follow(const Line& call, State& state) const;
  /// Nothing is known until it is set again; `why`: the responsible statement.
  State unknown(const Lost& why) const;
  /// Likewise, but an external tool remains one.
  void lose(const Lost& why, State& state) const;
  /// The statement, or the call that it is inside.
  Lost at(const std::string& what, int line) const { return call_.value_or(Lost{what, line}); }
  Frames with_own(const Line& line, const State& state, std::optional<Refusal>& wrong) const;
  bool apply(const std::vector<Token>& tokens, std::size_t at, Frames& frames,
             std::optional<Refusal>& wrong, int line) const;
  /// An assignment of $LOAD that begins at tokens[at].
  void apply_load(const std::vector<Token>& tokens, std::size_t at, Frames& frames, int line) const;
  std::optional<LoadRef> load_at(const std::vector<Token>& tokens, std::size_t at,
                                 Aggregate& parts) const;
  void take(const std::string& name, int line, Frames& frames, std::optional<Refusal>& wrong) const;
  std::optional<FrameRef> assigned(const std::vector<Token>& tokens, std::size_t at,
                                   const char* data) const;
  std::optional<FrameRef> on_kinematic(const std::vector<Token>& tokens, std::size_t at) const;
  std::size_t read_frame(const std::vector<Token>& tokens, std::size_t at, const char* data,
                         FrameRef& frame) const;

  const Data& data_;
  const Data& shared_;
  Calls calls_;
  int depth_ = 0;                                            ///< of followed calls
  std::shared_ptr<int> followed_ = std::make_shared<int>();  ///< so far
  bool foreign_ = false;      ///< a routine of another module, whose .dat is not seen
  std::optional<Lost> call_;  ///< that is followed
  std::set<std::string> touched_, hidden_;
  bool sets_load_ = false;
  mutable std::map<std::string, int> used_;
  std::map<int, int> before_;                 ///< place before each line, by its number
  std::map<int, Line> statements_;            ///< that lead to a place
  std::vector<std::optional<State>> states_;  ///< of each place; none: never reached
};

}  // namespace cellcal::daemon::krl
