#pragma once
// Motions of KRL programs rewritten so that CELLCAL_FIX (fix_module.h) gives their targets while the program runs:
// LIN XP1 C_DIS becomes LIN CC_FIX(XP1) C_DIS. Nothing else of a file changes, and restored() takes it back.

#include <map>
#include <string>
#include <vector>

#include "daemon/krl/krl_program.h"

namespace cellcal::daemon::krl {

struct RewrittenModule {
  std::string src;
  int motions = 0;    ///< lines with a motion of the arm
  int corrected = 0;  ///< those whose points are corrected at run time; the others stay, as homes
  std::vector<Refusal> refusals;                 ///< if any: the module is unchanged
  std::map<std::string, std::string> left = {};  ///< points that stay as they are, with the reason
  bool kukas = false;                            ///< the controller's own program: stays as it is
  /// The first $LOAD that is not the tool's own, with its line: CELLCAL_FIX corrects with the tool's
  /// own. Empty: none.
  std::string other_load = {};
  int other_load_line = 0;
};

struct RewrittenPrograms {
  std::vector<KrlFile> files;  ///< changed ones
  std::vector<RewrittenModule> modules;
};

/// Modules below R1/System and R1/TP, the controller's own, are not among the result's. `leave`: names, in upper case, of
/// points that stay as they are. `external`: axes of the calibration's linear unit and positioner (external_names()).
/// Throws FileError for a text that is not KRL, a name of `leave` without a point, and a program that is corrected at
/// run time already.
RewrittenPrograms rewrite_motions(const BackupFiles& files, const std::vector<std::string>& leave,
                                  const std::vector<std::string>& external = {});

/// The program before rewrite_motions(), also where its other lines were edited since. Throws FileError for a text
/// that is not KRL, a program without such motions, and a call that rewrite_motions() does not write.
std::string restored(const KrlFile& src);

}  // namespace cellcal::daemon::krl
