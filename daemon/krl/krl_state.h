#pragma once
// Active tool and base while a .src file is read from top to bottom.

#include <map>
#include <set>
#include <string>
#include <vector>

#include "daemon/krl/krl_calls.h"
#include "daemon/krl/krl_program.h"

namespace cellcal::daemon::krl {

/// Names that these lines read or change, except values of $TOOL, $BASE and $LOAD.
std::set<std::string> touched_names(const std::vector<Line>& lines);

/// Parameters of routines and variables declared without a value: they hide those of the .dat.
std::set<std::string> hidden_names(const std::vector<Line>& lines);

/// True if one of these lines sets $LOAD otherwise than inline forms do.
bool sets_load(const std::vector<Line>& lines);

/// Statements that set frames, or after which they are unknown. Fed with each line in turn.
class FrameState {
 public:
  /// `shared`: data that all modules see, those of routines of other modules.
  FrameState(const std::vector<Line>& lines, const Data& data, const Data& shared, Calls calls)
      : data_(data), shared_(shared), calls_(calls), touched_(touched_names(lines)), sets_load_(sets_load(lines)) {
    touched_.merge(hidden_names(lines));
    find_strict(lines);
  }

  /// True: the line only sets frames and contains no motion.
  bool read(const Line& line);
  /// For a motion of this line, including its own WITH.
  Frames at_motion(const Line& line, std::optional<Refusal>& wrong) const;
  const Frames& now() const { return now_; }
  /// FDATs used by motions.
  const std::map<std::string, int>& frame_data_used() const { return used_; }
  /// Number of blocks that a line begins; negative: ends.
  static int blocks(const Line& line);

 private:
  bool read_frames(const Line& line);
  bool read_frame_data(const Line& line);
  bool read_bas(const Line& line);
  /// Frames after a call whose body is given; false: not known.
  bool follow(const Line& call);
  /// Unknown until they are set again; `why`: the responsible statement.
  void forget(const std::string& why = {}, int line = 0);
  void find_strict(const std::vector<Line>& lines);
  bool apply(const std::vector<Token>& tokens, std::size_t at, Frames& frames,
             std::optional<Refusal>& wrong, int line) const;
  /// An assignment of $LOAD that begins at tokens[at].
  void apply_load(const std::vector<Token>& tokens, std::size_t at, Frames& frames, int line) const;
  std::optional<LoadRef> load_at(const std::vector<Token>& tokens, std::size_t at,
                                 Aggregate& parts) const;
  void take(const std::string& name, int line, Frames& frames, std::optional<Refusal>& wrong) const;

  const Data& data_;
  const Data& shared_;
  Calls calls_;
  int depth_ = 0;         ///< of followed calls
  bool foreign_ = false;  ///< a routine of another module, whose .dat is not seen
  Frames now_, pending_, outside_spline_;
  std::optional<Refusal> wrong_, pending_wrong_;
  mutable std::map<std::string, int> used_;
  std::optional<FrameRef> assigned(const std::vector<Token>& tokens, std::size_t at,
                                   const char* data) const;
  std::optional<FrameRef> on_kinematic(const std::vector<Token>& tokens, std::size_t at) const;
  std::size_t read_frame(const std::vector<Token>& tokens, std::size_t at, const char* data,
                         FrameRef& frame) const;

  std::set<std::string> touched_;
  bool sets_load_ = false;
  std::map<int, bool> strict_;  ///< first line of each sub-program
  bool strict_now_ = false;
};

/// True for a branch, a loop, a label or GOTO.
bool is_control(const Line& line);

}  // namespace cellcal::daemon::krl
