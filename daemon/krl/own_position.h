#pragma once
// The arm's own position in KRL ($POS_ACT, $AXIS_ACT, ...) and the variables that it reaches. With CELLCAL_FIX the arm
// is where a correction has brought it: a point of that place would be corrected twice.

#include <map>
#include <set>
#include <string>
#include <vector>

#include "daemon/krl/krl_program.h"
#include "daemon/krl/krl_types.h"

namespace cellcal::daemon::krl {

/// True for a variable that states the arm's present or past position: $POS_ACT, $AXIS_BACK.
bool states_own_position(const std::string& word);

class OwnPosition {
 public:
  /// Keeps a reference to `types`, which are those of `files`. Throws FileError for a text that is not KRL.
  OwnPosition(const BackupFiles& files, const Types& types);

  /// Source of it in tokens [begin, end): "$POS_ACT", or a variable or function that it reaches through assignments,
  /// parameters and results of the given files, in any order. Empty: nothing, or E1 to E6, S and T alone.
  std::string source(std::size_t module, const Line& line, std::size_t begin,
                     std::size_t end) const;
  /// True for a variable that states it or that it reaches.
  bool reaches(std::size_t module, int line, const std::string& name) const;
  /// A variable that is only ever given the whole of it: the controller's place, to which it returns uncorrected.
  bool whole(std::size_t module, int line, const std::string& name) const;

 private:
  /// A value is assigned, given as an argument, or returned.
  struct Flow {
    std::string to;
    std::vector<std::string> from;
    bool whole = false;  ///< nothing but the one in `from`
  };
  struct Parameter {
    std::string key;
    bool in = false;
  };
  struct Value {
    std::string key;  ///< of a variable (Types::key) or function; empty: the own position itself
    std::string word;
  };
  void keep_taught(const KrlFile& dat, std::size_t module);
  void keep_parameters(const Line& line, std::size_t module);
  void read(const Line& line, std::size_t module, const std::string& routine);
  void give_arguments(const Line& line, std::size_t module);
  void flow(const std::string& to, const std::vector<Value>& from, bool whole);
  std::vector<Value> values(std::size_t module, const Line& line, std::size_t begin,
                            std::size_t end) const;
  void settle();
  bool reached(const std::string& key) const { return reached_.count(key) > 0; }

  const Types& types_;
  std::multimap<std::string, std::vector<Parameter>> parameters_;  ///< by routine
  std::vector<Flow> flows_;
  std::set<std::string> reached_, mixed_;  ///< mixed: has other values, too
};

}  // namespace cellcal::daemon::krl
