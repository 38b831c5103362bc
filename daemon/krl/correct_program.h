#pragma once
// Corrects the taught points of a KRL program so that the real TCP reaches the programmed places.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/krl/krl_program.h"

namespace cellcal::daemon::krl {

struct CorrectionOptions {
  std::vector<std::string> leave = {};  ///< names of points that stay unchanged
  bool anywhere = false;                ///< also outside the calibration's scope
  std::vector<std::string> still = {};  ///< routines that neither move nor set frames
  /// The arm that the points were taught on: its TCP is the wanted one. Null: the nominal arm's
  /// TCP. Same nominal geometry; must outlive the call.
  const calib::Calibration* from = nullptr;
};

struct CorrectedPoint {
  std::string name, file;
  int line = 0;
  bool axes = false;
  int tool = 0, base = 0;  ///< numbers; -1: written out in the text
  /// Shift of the written point in its own base; for axis angles that of the nominal TCP, robot's
  /// base.
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();
  double turn_deg = 0.0;           ///< its rotation
  double u95_mm = 0.0;             ///< of the real TCP there, as from predict
  double left_mm = 0.0;            ///< deviation of the calibrated TCP with the written numbers
  bool status_changed = false;     ///< S or T changed
  bool taught_accurately = false;  ///< by the absolutely accurate model of the controller (S)
};

struct LeftPoint {
  std::string name, why;  ///< "--leave", its file, "no motion goes to it"
};

struct Corrected {
  std::vector<KrlFile> files;  ///< those that may be changed
  std::vector<CorrectedPoint> points;
  std::vector<LeftPoint> left;
  std::vector<ToolUsed> tools;
  std::vector<calib::Phrase> warnings;
  bool robroot_stated = false;  ///< by a file; otherwise the arm is at the world's origin
};

struct CorrectedProgram : Corrected {  // .src and .dat; no files after a refusal
  std::vector<Refusal> refusals;
  int motions = 0;  ///< lines of the program with a motion

  const CorrectedPoint* largest() const;  ///< by shift; null without points
};

/// Calibration without corrections. With it, and `from` the arm's own, touched-up points become
/// those of the nominal arm.
calib::Calibration as_drawn(calib::Calibration calibration);

/// Result for one module of a backup.
struct CorrectedModule {
  std::string src;
  int motions = 0;  ///< lines with a motion
  int points = 0;   ///< corrected points
  /// If any: none of its points is changed.
  std::vector<Refusal> refusals;
  bool kukas = false;           ///< the controller's own program, left as it is
  std::vector<ToolUsed> tools;  ///< tools and loads of its corrected points
};

/// No module has corrected and uncorrected points, except points that stay unchanged in all of
/// them.
struct CorrectedBackup : Corrected {  // changed files
  std::vector<CorrectedModule> modules;
};

/// Joint angles of the nominal arm at the points of a program, and the reasons for the others.
struct ProgramPostures {
  std::vector<calib::JointVector> postures;
  std::vector<Refusal> refusals;
  std::map<std::string, calib::FileError> no_points;  ///< names of `leave` without a point
};
/// `leave`, `still`: as in CorrectionOptions. Throws FileError if a text is not KRL.
ProgramPostures program_postures(const calib::Cell& cell, const ProgramFiles& files,
                                 const std::vector<std::string>& leave = {},
                                 const std::vector<std::string>& still = {});

/// Throws FileError if a text is not KRL.
CorrectedBackup correct_backup(const calib::Calibration& calibration, const BackupFiles& files,
                               const CorrectionOptions& options = {});

/// Throws FileError if a text is not KRL, and for a name of `leave` without a point.
CorrectedProgram correct_program(const calib::Calibration& calibration, const ProgramFiles& files,
                                 const CorrectionOptions& options = {});

}  // namespace cellcal::daemon::krl
