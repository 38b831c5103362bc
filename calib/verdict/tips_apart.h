#pragma once
// How far two descriptions of one arm put its tip apart, over the poses that a verdict speaks of.

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// The same nominal geometry: dimensions, senses and the first tool, to a nanometre.
bool same_nominal(const Cell& a, const Cell& b);

/// `count` poses, the same each time: of the workspace, or else within 150 mm of where `touches` were made and
/// in like postures.
std::vector<JointVector> poses_in_scope(const Cell& cell, std::span<const Touch> touches,
                                        bool workspace, int count);

/// Tip in the base frame [m].
using TipOf = std::function<Eigen::Vector3d(const JointVector&)>;
/// Distances of the tips at each pose [m], a motion of the base taken out.
Eigen::VectorXd tips_apart_m(const TipOf& one, const TipOf& other,
                             const std::vector<JointVector>& poses);

/// Over the scope of a calibration: how far an earlier description of the arm was from it, and its own bound.
struct InScope {
  bool workspace = false;
  int poses = 0;
  double mean_apart_m = 0.0, max_apart_m = 0.0;
  double mean_u95_m = 0.0, max_u95_m = 0.0;  ///< of `now`
};

inline constexpr int kScopePoses = 1000;
/// `earlier` null: the nominal arm with a stiff tool. `workspace`: else near the touches, which `now` is of.
/// Empty where their nominal geometry or tool is another, or no poses can be found.
std::optional<InScope> apart_in_scope(const Calibration* earlier, const Calibration& now,
                                      std::span<const Touch> touches, bool workspace);

}  // namespace cellcal::calib
