#pragma once
// A KRL program as written by an offline programming system, and the controller's joint angles at
// its points: from the nominal arm only, and KUKA's definition of S and T. Shares nothing with
// daemon/krl.

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/kinematics.h"

namespace cellcal::daemon::testing {

struct Frames {
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();  ///< TOOL_DATA[1]
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity();  ///< BASE_DATA[3]
};

struct KrlProgram {
  std::string src, dat, config;
};

/// Inline forms with CRLF and Latin-1, PTP and LIN in turn, points P1, P2, ... at these joint angles
/// of the nominal arm.
KrlProgram taught(const calib::Robot& robot, const Frames& frames,
                  const std::vector<calib::JointVector>& points);

/// S and T of joint angles: wrist behind axis 1, A3 beyond the stretched arm, A5 below 0; signs.
struct StatusAndTurn {
  int status = 0, turn = 0;
};
StatusAndTurn status_and_turn(const calib::Robot& robot, const calib::JointVector& q);
/// Reuses the arm and its stretched_a3(), for many calls.
StatusAndTurn status_and_turn(const calib::ArmModel& arm, double stretched_rad,
                              const calib::JointVector& q);
/// A3 of the stretched arm [rad].
double stretched_a3(const calib::Robot& robot);

/// The controller's joint angles at XP1, XP2, ... of a .dat file; empty where there is no solution.
std::vector<calib::JointVector> run(const calib::Robot& robot, const Frames& frames,
                                    const std::string& dat);

}  // namespace cellcal::daemon::testing
