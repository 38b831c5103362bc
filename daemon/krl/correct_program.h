#pragma once
// A KRL program whose taught points are those that bring the real TCP where the program wants it.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/krl/krl_program.h"
#include "daemon/krl/tool_used.h"

namespace cellcal::daemon::krl {

struct CorrectionOptions {
  std::vector<std::string> leave = {};  ///< names of points that stay as they are
  bool anywhere = false;                ///< also where the calibration claims nothing
  std::vector<std::string> still = {};  ///< routines that neither move nor set frames
  /// The arm that the points were taught on: where its TCP was is what is wanted. Null: where the nominal
  /// arm's is. Of the same nominal geometry; outlives the call.
  const calib::Calibration* from = nullptr;
};

struct CorrectedPoint {
  std::string name, file;
  int line = 0;
  bool axes = false;
  int tool = 0, base = 0;  ///< numbers; -1: as it stands in the text
  /// How far the written point moved: in its own base; of axis angles the nominal TCP, robot's base.
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();
  double turn_deg = 0.0;        ///< and by how much it was turned
  double u95_mm = 0.0;          ///< of the real TCP there, as predict gives it
  double left_mm = 0.0;         ///< how far the calibrated TCP is off with the numbers as written
  bool status_changed = false;  ///< S or T
};

struct LeftPoint {
  std::string name, why;  ///< "--leave", a file that has it, "no motion goes to it"
};

struct CorrectedProgram {
  std::vector<KrlFile> files;  ///< .src and .dat; empty where anything was refused
  std::vector<CorrectedPoint> points;
  std::vector<LeftPoint> left;
  std::vector<ToolUsed> tools;
  bool robroot_stated = false;  ///< by a file; else the arm stands in the world's origin
  std::vector<Refusal> refusals;
  int motions = 0;  ///< lines of the program that move the arm

  const CorrectedPoint* largest() const;  ///< shift; null without points
};

/// The arm as it is drawn: a calibration of no corrections. With it, and `from` the arm's own, points that were
/// touched up become those that the nominal arm needs.
calib::Calibration as_drawn(calib::Calibration calibration);

/// What became of one module of a backup.
struct CorrectedModule {
  std::string src;
  int motions = 0;  ///< lines that move the arm
  int points = 0;   ///< that were corrected
  /// Any: none of its points is changed.
  std::vector<Refusal> refusals;
};

/// No module has corrected and uncorrected points, those aside that stay in all of them.
struct CorrectedBackup {
  std::vector<KrlFile> files;  ///< that changed
  std::vector<CorrectedModule> modules;
  std::vector<CorrectedPoint> points;
  std::vector<LeftPoint> left;
  std::vector<ToolUsed> tools;
  bool robroot_stated = false;
};

/// Throws FileError for what is no KRL text.
CorrectedBackup correct_backup(const calib::Calibration& calibration, const BackupFiles& files,
                               const CorrectionOptions& options = {});

/// Throws FileError for what is no KRL text.
CorrectedProgram correct_program(const calib::Calibration& calibration, const ProgramFiles& files,
                                 const CorrectionOptions& options = {});

}  // namespace cellcal::daemon::krl
