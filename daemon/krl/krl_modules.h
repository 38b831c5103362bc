#pragma once
// Data that KRL modules see of each other: GLOBAL names, imports, named frames and loads that another module touches,
// and points that are copied.

#include <map>
#include <set>
#include <string>
#include <vector>

#include "daemon/krl/krl_program.h"

namespace cellcal::daemon::krl {

/// Adds data missing in the program's own files.
void add_missing(const Data& controller, Data& own);

/// Adds the parts of a .dat file that other modules see: all of $config.dat.
void add_globals(const Data& from, Data& into);

/// Removes frames, loads and numbers by name that modules touch: all, or the GLOBAL ones.
void forget(const std::set<std::string>& touched, bool all, Data& data);

/// Applies the effect of another module on a program's data: points that it imports may be its own, too, and named
/// frames and loads that it touches are unknown. A module that is no text has none.
void apply_beside(const KrlFile& module, const std::string& program, Data& known, Data& own);

/// Frames that nothing but one assignment changes: in its module this is their value. Other modules may run before it.
void take_assigned(const std::vector<const KrlFile*>& files, const Readers& readers,
                   Program& program);

/// Motions to copied points (XP2=XP1), which may go to all values of their group, and points whose value is unknown
/// since statements read or change them.
void settle(Program& program);

/// Lists the points without a motion among those that stay. `where`: end of the keys of points that no other module sees;
/// `file`: precedes the file's name in the reason; empty: it is not named.
void leave_unmoved(const Data& own, bool kukas, const std::string& where, const std::string& file,
                   Program& program);

/// Imports of modules from each other.
class Imports {
 public:
  explicit Imports(const BackupFiles& files);
  /// Points of a .dat that others import become visible to all.
  void share(const KrlFile& dat, Data& data) const;
  /// Names that a module imports and that are not followed, with the reason.
  const std::map<std::string, Why>& not_followed(const std::string& file) const;
  /// By the key of the point that has another name elsewhere.
  const std::map<std::string, Refusal>& renamed() const { return renamed_; }

 private:
  void read(const KrlFile& file, const std::set<std::string>& modules);

  std::map<std::string, std::set<std::string>> shared_;
  std::map<std::string, std::map<std::string, Why>> not_followed_;
  std::map<std::string, Refusal> renamed_;
};

}  // namespace cellcal::daemon::krl
