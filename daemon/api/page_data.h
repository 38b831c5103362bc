#pragma once
// Data of the page as JSON: touches and figures of a session, 3D view of the cell, plan, and drift of the arm.

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/plan/planned_touch.h"
#include "calib/result/calibration.h"
#include "calib/words/phrase.h"
#include "daemon/archive/drift_watch.h"
#include "daemon/controller/advice_publisher.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon::web {

/// Signed outward distance [m] of the calibrated tip from its sphere or plane; none where the calibration
/// does not contain the target. Corrected for the latch delay, if estimated.
std::optional<double> residual_m(const calib::Calibration& calibration, const calib::Touch& touch);

/// Values known when the touch was made, before identification [m].
struct FigureOfTouch {
  std::optional<double> residual_m, u95_m;
};

/// `calibration`: null without one; the residuals are then the unsigned ones of `made`, by touch number.
/// `language`: of the findings' words.
std::string figures_to_json(const SessionRecord& record, const calib::Cell& cell,
                            const std::vector<calib::Touch>& touches,
                            const calib::Calibration* calibration,
                            const std::map<std::size_t, FigureOfTouch>& made = {},
                            const calib::Language& language = {});

// Data of a 3D view of the cell, which lets the page move the arm by its joint angles.
//
//   base . T_1 ... T_n . flange . tool,   T_i = Rz(sign_i q_i + offset_i) . behind_i,
//                                         of a linear unit Trans(q_i along_i)
//
// Frames are 3x4, row-major: rotation, and origin in mm. Nominal model.

/// Meshes with more triangles are replaced by their bounding box.
inline constexpr std::size_t kMostTrianglesDrawn = 20'000;

/// `cell`: with the meshes that could be read.
std::string scene_to_json(std::int64_t session, const calib::Cell& cell);

// Planned touches.

/// `first`: number of the plan's first touch in its session. The tip is at the expected contact, the joints
/// are those of the stand-off.
std::string plan_to_json(std::int64_t session, std::size_t first, const calib::Plan& plan,
                         const calib::Cell& cell);

// Points, frames and angles for the page: millimetres and degrees, finite numbers only.

/// null for a non-finite value.
nlohmann::json number(double value, double factor = 1.0);
nlohmann::json mm(const Eigen::Vector3d& point_m);
/// 3x4, row-major: rotation, and origin [mm].
nlohmann::json frame(const Eigen::Isometry3d& frame);
/// One number per joint: degrees, of a linear unit millimetres.
nlohmann::json shown_joints(const calib::JointVector& joint_rad, const calib::Robot& robot);

// Results of the sessions of one cell file over time: stability of the arm.

/// Maximum number of sessions.
inline constexpr std::size_t kMostCompared = 30;

/// `calibration`: that of a session, none without a result. Only sessions of the cell file `cell` are
/// included, where it is empty those of the newest with a result. Oldest first. `checks`: control chart of
/// the newest published calibration; null: none. `controller`: advice acknowledged by the controller. `language`: of
/// the events' words.
std::string drift_to_json(
    const std::vector<SessionRecord>& newest_first, std::string cell,
    const std::function<std::optional<calib::Calibration>(std::int64_t)>& calibration,
    const Drift* checks = nullptr, const AdviceStatus& controller = {},
    const calib::Language& language = {});

}  // namespace cellcal::daemon::web
