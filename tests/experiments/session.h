#pragma once
// One session of touches of spheres by a true arm: random cell, planned touches, noise,
// gross errors, thermal growth, and a sphere that moves where asked for.

#include <optional>
#include <vector>

#include "calib/files/touch.h"
#include "calib/model/random.h"
#include "calib/model/robot.h"
#include "calib/plan/plan.h"
#include "tests/experiments/true_arm.h"

namespace cellcal::experiments {

struct Move {
  std::size_t sphere = 0;
  double when = 0.5;  ///< share of that sphere's fit touches that are made by then
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();
};

struct SessionSettings {
  int spheres = 4, fit = 100, check = 30;
  double touch_sigma_m = 0.03e-3;
  bool lengths = true;          ///< certified, between all spheres
  bool mixed = false;           ///< spheres mixed; otherwise in the order of the plan's route
  double outlier_share = 0.02;  ///< of the fit touches, off by 0.2 to 3 mm
  TruthSettings truth;
  std::optional<Move> move;
};

/// A cell and its touches before anything is touched.
struct PlannedSession {
  calib::Cell cell;  ///< without lengths
  calib::Plan plan;
  calib::Random random;
};

struct Session {
  calib::Cell cell;
  TrueArm arm;
  std::vector<Eigen::Vector3d> centre_m;  ///< true, before a move
  double rho_m = 0.0;
  std::vector<calib::Touch> touches;
};

/// Empty where the cell that was drawn cannot be planned for.
std::optional<PlannedSession> plan_session(const calib::Robot& robot,
                                           const SessionSettings& settings, std::uint64_t seed);

/// Another arm for other settings, the same for the same.
Session carry_out(PlannedSession planned, const SessionSettings& settings);

}  // namespace cellcal::experiments
