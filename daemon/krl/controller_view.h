#pragma once
// One tool as the controller reckons with it, and as it really is: nominal arm and calibrated arm.

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
#include "daemon/krl/krl_program.h"
#include "daemon/krl/status_turn.h"
#include "daemon/krl/tool_used.h"

namespace cellcal::daemon::krl {

/// A TOOL_DATA nearer than this to the cell file's tool, as stated or as identified, is that tool.
inline constexpr double kSameToolMm = 0.05, kSameToolDeg = 0.02;

class ControllerView {
 public:
  /// `tool`: flange to TCP as the controller has it. `load`: of LOAD_DATA, where it is stated.
  ControllerView(const calib::Calibration& calibration, const Eigen::Isometry3d& tool,
                 const std::optional<LoadData>& load);

  /// The cell file's tool, with its bending and what was identified of its tip.
  bool is_the_cells() const { return cells_; }
  bool closed_form() const { return ways_->closed_form(); }
  const calib::Robot& robot() const { return arm_.robot(); }

  /// Where the controller believes the TCP to be.
  Eigen::Isometry3d nominal(const calib::JointVector& q) const { return arm_.nominal_tcp(q); }
  std::optional<calib::JointVector> joints(const Eigen::Isometry3d& tcp, StatusTurn wanted) const {
    return joints_of(*ways_, robot(), tcp, wanted);
  }
  /// In the posture of `near`, by the whole turns that are nearest to it.
  std::optional<calib::JointVector> joints(const Eigen::Isometry3d& tcp,
                                           const calib::JointVector& near) const;
  StatusTurn status_turn(const calib::JointVector& q) const { return status_turn_of(*ways_, q); }

  /// Joints that bring the real TCP there.
  calib::Reach correct(const Eigen::Isometry3d& tcp, const calib::JointVector& seed) const {
    return corrector_.joints(tcp, seed);
  }
  calib::Prediction real(const calib::JointVector& q) const { return predictor_.calibrated(q); }

 private:
  bool cells_ = false;
  calib::ArmModel arm_;
  std::unique_ptr<calib::Configurations> ways_;  // refers to arm_
  calib::Corrector corrector_;
  calib::Predictor predictor_;
};

/// Where a tool or base lies; empty: its number is stated nowhere.
std::optional<Eigen::Isometry3d> frame_of_ref(const FrameRef& ref,
                                              const std::map<int, calib::FrameMmDeg>& stated);

/// One view for each tool of a program, made when it is first asked for. Keeps references to both.
class ControllerViews {
 public:
  ControllerViews(const calib::Calibration& calibration, const Data& data)
      : calibration_(calibration), data_(data) {}
  /// Null: its number is stated nowhere.
  ControllerView* of(const FrameRef& tool);
  const std::vector<ToolUsed>& used() const { return used_; }

 private:
  const calib::Calibration& calibration_;
  const Data& data_;
  std::map<std::string, std::unique_ptr<ControllerView>> views_;
  std::vector<ToolUsed> used_;
};

}  // namespace cellcal::daemon::krl
