#pragma once
// One tool in the controller's (nominal) and in the calibrated arm.

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/estimate/predict.h"
#include "calib/export/corrector.h"
#include "calib/model/inverse.h"
#include "calib/model/kinematics.h"
#include "calib/result/calibration.h"
#include "calib/words/phrase.h"
#include "daemon/krl/krl_program.h"
#include "daemon/krl/point_value.h"

namespace cellcal::daemon::krl {

/// A TOOL_DATA nearer than this to the cell file's tool, stated or identified, is that tool.
inline constexpr double kSameToolMm = 0.05, kSameToolDeg = 0.02;
/// A LOAD_DATA by which the TCP of the cell file's tool is nearer than this to where it is with the cell file's mass is
/// that of the tool.
inline constexpr double kSameLoadMm = 0.1;

bool same_tool(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b);
/// TCP of the cell file's tool.
Eigen::Isometry3d identified_tcp(const calib::Calibration& calibration);
/// True for the cell file's tool, as stated or as identified.
bool is_the_cells_tool(const calib::Calibration& calibration, const Eigen::Isometry3d& tool);
/// The calibration with that tool: the cell's with its bending and identified tip, any other stiff and as stated with
/// its own load, if stated, else with that of the cell's tool.
/// `in_force`: the load is that of the program, and takes the place of the cell's tool's, too.
calib::Calibration real_arm(const calib::Calibration& calibration, const Eigen::Isometry3d& tool,
                            const std::optional<LoadData>& load, bool in_force = false);

class ControllerView {
 public:
  /// `tool`: flange to TCP in the controller's data. `load`: from LOAD_DATA, if stated.
  /// `in_force`: as in real_arm.
  ControllerView(const calib::Calibration& calibration, const Eigen::Isometry3d& tool,
                 const std::optional<LoadData>& load, bool in_force = false);

  /// The cell file's tool, with its bending and its identified tip.
  bool is_the_cells() const { return cells_; }
  bool closed_form() const { return ways_->closed_form(); }
  const calib::Robot& robot() const { return arm_.robot(); }

  /// TCP by the controller's nominal arm.
  Eigen::Isometry3d nominal(const calib::JointVector& q) const { return arm_.nominal_tcp(q); }
  std::optional<calib::JointVector> joints(const Eigen::Isometry3d& tcp, StatusTurn wanted,
                                           double unit_m) const {
    return joints_of(*ways_, robot(), tcp, wanted, unit_m);
  }
  /// In the posture of `near`, with the nearest whole turns; a linear unit stays where it is there.
  std::optional<calib::JointVector> joints(const Eigen::Isometry3d& tcp,
                                           const calib::JointVector& near) const;
  StatusTurn status_turn(const calib::JointVector& q) const { return status_turn_of(*ways_, q); }

  /// Joints that bring the real TCP there.
  calib::Reach correct(const Eigen::Isometry3d& tcp, const calib::JointVector& seed) const {
    return corrector_.joints(tcp, seed);
  }
  calib::Prediction real(const calib::JointVector& q) const { return predictor_.calibrated(q); }
  /// u95 [m] in the frame that the positioner's axes carry at these angles; without any, in the base frame.
  double u95_m(const calib::JointVector& q, const std::vector<double>& carrier_rad) const;

 private:
  bool cells_ = false;
  calib::ArmModel arm_;
  std::unique_ptr<calib::Configurations> ways_;  // refers to arm_
  calib::Corrector corrector_;
  calib::Predictor predictor_;
  std::optional<calib::Calibration> on_a_positioner_;  ///< of a robot with one
  mutable std::map<std::size_t, calib::Predictor> by_carriers_;
};

/// Frame of a tool or base; empty: its number is not stated.
std::optional<Eigen::Isometry3d> frame_of_ref(const FrameRef& ref,
                                              const std::map<int, calib::FrameMmDeg>& stated);

/// LOAD_DATA of that number with a mass.
std::optional<LoadData> load_of(const Data& data, int number);
std::optional<LoadData> load_of(const Data& data, const LoadRef& load);

/// Warning that a bound relies on compliances found with far less mass on the flange.
std::optional<calib::Phrase> heavier_than_touched(const calib::Calibration& c, double mass_kg);

/// One view per tool and load of a program, created on first use. Keeps references to both.
class ControllerViews {
 public:
  ControllerViews(const calib::Calibration& calibration, const Data& data)
      : calibration_(calibration), data_(data) {}
  /// Of known frames' tool and load. Null: the tool's number is not stated.
  ControllerView* of(const Frames& frames);
  const std::vector<ToolUsed>& used() const { return used_; }
  /// By number of those whose LOAD_DATA is not the load of the cell file's tool.
  const std::map<int, calib::Phrase>& warnings() const { return warnings_; }
  /// Mass of LOAD_DATA that the arm bears in place of the cell's tool; 0: that of the cell's tool.
  double borne_kg(const Frames& frames) const;
  const calib::Calibration& calibration() const { return calibration_; }

 private:
  bool counts_for_the_cells(int number, const Eigen::Isometry3d& tool, const LoadData& load);

  const calib::Calibration& calibration_;
  const Data& data_;
  std::map<std::string, std::unique_ptr<ControllerView>> views_;
  std::vector<ToolUsed> used_;
  std::map<int, calib::Phrase> warnings_;
  std::map<std::string, double> borne_kg_;
};

}  // namespace cellcal::daemon::krl
