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
  bool anywhere = false;           ///< also where the calibration claims nothing
  std::vector<std::string> still = {};  ///< routines that neither move nor set frames
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

/// Throws FileError for what is no KRL text.
CorrectedProgram correct_program(const calib::Calibration& calibration, const ProgramFiles& files,
                                 const CorrectionOptions& options = {});

}  // namespace cellcal::daemon::krl
