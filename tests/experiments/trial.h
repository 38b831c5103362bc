#pragma once
// One random robot: cell, plan, truth, touches, identification, and the true error of the result.

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calib/estimate/predict.h"
#include "calib/model/robot.h"
#include "calib/plan/online.h"
#include "calib/plan/plan.h"
#include "tests/experiments/true_arm.h"
#include "tests/experiments/world.h"

namespace cellcal::experiments {

struct Trial {
  int spheres = 4, fit = 100, check = 30;
  double touch_sigma_m = 0.03e-3;
  bool lengths = true;     ///< certified distances between all spheres,
  double longest_m = 1e3;  ///< no farther apart than this
  bool ideal = false;      ///< no noise, no gears, no compliance
  Gears gears = Gears::kHarmonics;
  double gear_arcsec = 10.0;
  calib::Criterion criterion = calib::Criterion::kI;
  double outlier_share = 0.02;              ///< of the fit touches
  bool outliers_dropped = false;            ///< before the estimate: the best possible result
  bool masses_stated = true;                ///< in the robot file
  double noise_m = 0.0;                     ///< of a touch; 0: the stated one
  double play_arcsec = 0.0, field_m = 0.0;  ///< unmodelled errors (true_arm.h)
  double field_reach_rad = 0.6;
  bool functions = true;  ///< of the joints' angles, in the estimate
  /// The cell file states order and size of all waves above the smooth orders: the best possible.
  bool waves_known = false;
  bool size_known = false;  ///< the cell file states the size of the joints' functions
  double spring_nm = 0.0, soft_rad = 0.0;
  double size = 1.0;         ///< world.h
  bool heavy_stated = true;  ///< world.h
  double compliance_rad_per_nm = 1e-5;
  /// On the flange at the postures of M2 to M4; 0: the tool, as at the touches.
  double load_kg = 0.0;
  double touched_kg = 0.0;  ///< on the flange at every second touch; 0: the tool, as at the others
  /// Factors per joint on the spreads of true lengths and angles; empty: 1.
  std::vector<double> length_factor = {}, angle_factor = {};
  int repeated = 0;  ///< this many of the fit touches are made four times
};

/// This arm's error with its nominal model, as stated by its calibration and as it is; m.
struct NominalFigure {
  double stated = 0.0, u = 0.0, real = 0.0;
  bool held() const { return std::abs(stated - real) <= u; }
};

/// M1 to M4 of the method; m and shares.
struct Outcome {
  double m1 = 0, m1_max = 0, m2 = 0, m2_max = 0, m3 = 0, m3_max = 0, m4 = 1, m4_local = 1;
  double rms = 0, u95 = 0;  ///< over the postures of M3: of the error, and mean
  double rho_error = 0, predicted_m3 = 0;
  double planned_m3 = 0, minutes = 0;           ///< predicted by the plan
  double nominal_m3 = 0, field = 0, alike = 0;  ///< predicted and reported by the estimator
  NominalFigure nominal_workspace, nominal_near;
  bool published = false, estimated = false;
  bool unchecked = false;          ///< the verdict warns of a touch that the others do not check
  int waves = 0, false_waves = 0;  ///< found in the joints; matching no wave of the true gear
  std::string why_not;
};

/// The touches of one random robot, before evaluation.
struct Session {
  World world;
  std::vector<calib::Touch> touches;
  double planned_m3 = 0, minutes = 0;  ///< predicted by the plan
};
/// Empty if the cell is not feasible.
std::optional<Session> measured(const calib::Robot& robot, const Trial& trial, std::uint64_t seed);

/// Errors of the tip over postures, after alignment of the base; m and a share.
struct OverPostures {
  double mean = 0.0, max = 0.0, rms = 0.0;
  double covered = 0.0;  ///< share within their own u95
  double u95 = 0.0;      ///< mean
};
OverPostures judge(const TrueArm& arm, const calib::Predictor& predictor,
                   const std::vector<calib::JointVector>& poses);

/// Postures for the evaluation of the aims: in front of the arm, as in the cases for which the aims
/// were set. Narrower than the workspace of predictions and plans.
std::vector<calib::JointVector> postures(const calib::ArmModel& arm, int count, unsigned seed);

/// Results from these touches in this world.
Outcome judged(World world, const std::vector<calib::Touch>& touches, double load_kg = 0.0,
               bool functions = true);

/// Its outcome. If there is no estimate all errors are infinite, and `why_not` states the reason.
std::optional<Outcome> run(const calib::Robot& robot, const Trial& trial, std::uint64_t seed);

/// Touches chosen one by one until the goal is reached.
struct OnlineOutcome {
  Outcome outcome;
  int touches = 0, failed = 0;
  double u95_m = 0.0;
  /// After each touch made: predicted u95, and robot time so far.
  std::vector<double> u95_by_touch_m = {}, minutes_by_touch = {};
  std::string why;
};
/// `failing`: share of touches that fail.
std::optional<OnlineOutcome> run_online(const calib::Robot& robot, const Trial& trial,
                                        const calib::Goal& goal, double failing,
                                        std::uint64_t seed);

double median(std::vector<double> values);

}  // namespace cellcal::experiments
