#pragma once
// Effects of a program's calls on the arm and its frames: KUKA's routines without effect, routines
// with a given body, and all others, which may have both effects.

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "calib/export/krl_text.h"
#include "daemon/krl/krl_changes.h"

namespace cellcal::daemon::krl {

struct Data;

using namespace calib::krl;

/// Possible effects of a statement by its calls.
struct Effects {
  bool moves = false, frames = false;
  std::string call;  ///< name of the responsible call
};

enum class MotionKind { kNone, kPoint, kRelative, kExternal };
/// By the statement's first word.
MotionKind motion_kind(const Line& line);
/// C_SPL and the like, also after WITH.
bool approximates(const Token& token);

/// DEF, DEFFCT, DECL, EXT, INTERRUPT, SIGNAL: not executed here.
bool declares(const Line& line);
/// After GLOBAL, if present.
const Token& first_word(const Line& line);
bool begins_routine(const Line& line);
/// Throws FileError for a file without a routine.
void require_routine(const KrlFile& src);
/// Name of the routine that starts in this line, after a function's return type.
std::string routine_name(const Line& line);
/// $TOOL, $BASE, $LOAD, $IPO_MODE, FDAT_ACT, or a BAS command that may set them.
bool sets_frames(const Line& line);
/// NAME( of a routine, without BAS, at tokens[at].
bool calls_at(const std::vector<Token>& tokens, std::size_t at);
bool calls_a_routine(const Line& line);
/// BAS with a command that may set frames, at tokens[at].
bool frames_by_bas(const std::vector<Token>& tokens, std::size_t at);

/// All given routines, with their effects including callees.
class Routines {
 public:
  /// `modules`: .src files whose routines call each other. `still`: names, in upper case, of
  /// routines that neither move nor set frames. `stated`: by the controller's files; must outlive this. A module that is
  /// not KRL text has no routines.
  Routines(const std::vector<const KrlFile*>& modules, const std::set<std::string>& still,
           const ControllerFrames& stated);

  /// Effects of a statement of that module, counted from 0.
  Effects of(std::size_t module, const Line& line) const;
  /// Name of the given routine that this INTERRUPT or TRIGGER of that module runs, if it sets frames; otherwise empty.
  std::string frames_aside(std::size_t module, const Line& line) const;
  /// True if a given routine leaves those that it interrupted.
  bool resumes() const { return resumes_; }
  /// Name and module of the routine that the statement calls and does nothing else; empty: another
  /// statement, no body or several.
  std::optional<std::pair<std::size_t, std::string>> called(std::size_t module,
                                                            const Line& line) const;
  /// The module, and the statements of the routine that `called` finds with the call's arguments (krl_inline.h).
  std::optional<std::pair<std::size_t, std::vector<Line>>> body_of(std::size_t module,
                                                                   const Line& line) const;
  /// Routines of which every given body has its parameters by value (:IN).
  const Readers& readers() const { return readers_; }
  /// Changes by that module's routines and all their callees.
  FrameChanges changes(std::size_t module) const;
  /// Module and name of the routines elsewhere that its routines call, directly or not, and that move to points other than
  /// the homes of `known`, the data that all modules see.
  std::vector<std::pair<std::size_t, std::string>> moving_callees(std::size_t module,
                                                                  const Data& known) const;
  /// Routines without a given body that its routines call, directly or not, and that may move.
  std::set<std::string> ungiven_callees(std::size_t module) const;

 private:
  struct Body {
    std::string name;
    std::size_t module = 0;
    std::set<std::string>
        targets;  ///< first words of its own motions' targets, other than where the arm is
    bool moves = false, frames = false;      ///< by its own statements
    bool may_move = false, may_set = false;  ///< including callees
    std::set<std::string> calls;
    FrameChanges changes;
    std::vector<std::string> parameters;
    std::vector<Line> lines;  ///< of those that set frames, if they are few
  };
  void find_readers(const std::vector<const KrlFile*>& modules);
  void read(const KrlFile& file, std::size_t module);
  void keep(const std::string& name, Body body, bool global);
  void settle();
  bool update_effects(Body& body) const;
  /// Visible from this module: its own routines hide others.
  const std::vector<std::size_t>* bodies_of(std::size_t module, const std::string& name) const;
  Effects of_name(std::size_t module, const std::string& name) const;
  /// True if a given body of it, or one that it calls, sets frames.
  bool sets_by_given(std::size_t module, const std::string& name,
                     std::set<std::string>& seen) const;
  /// The module's own and all their callees, as indices.
  std::vector<std::size_t> reached(std::size_t module) const;

  std::vector<Body> bodies_;
  std::map<std::pair<std::size_t, std::string>, std::vector<std::size_t>> places_;
  std::set<std::string> still_;
  const ControllerFrames& stated_;
  Readers readers_;
  bool resumes_ = false;
};

/// Calls of one module.
struct Calls {
  const Routines& routines;
  std::size_t module = 0;
  Effects of(const Line& line) const { return routines.of(module, line); }
};

}  // namespace cellcal::daemon::krl
