// Arm and tool that differ from robot and cell file. With a dimension that is wrong by centimetres,
// an axis of the opposite direction or the drawing of another arm the nominal tips are so far from
// their targets that an estimate need not converge. The distance is known without an estimate, and
// fast: geometries are therefore tried in turn, and only those much nearer to the touches are
// tested.

#include <algorithm>
#include <cmath>
#include <string>

#include "calib/identify/causes.h"
#include "calib/identify/mistakes.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// Largest ratio of a geometry's distance from the touches to that of the stated one.
constexpr double kNearerByFile = 1.0 / 3.0;

bool is_nearer(const Asked& asked, double off_m) {
  return off_m < kNearerByFile * asked.nominal_off_m;
}

/// Calls `use` for the nearest geometries, nearest first, up to `most`, that are near enough.
template <class Geometry>
void for_nearest(const Asked& asked, std::vector<Geometry> geometries, std::size_t most,
                 const auto& use) {
  std::ranges::stable_sort(geometries, {}, &Geometry::off_m);
  for (std::size_t k = 0; k < std::min(most, geometries.size()); ++k) {
    if (!is_nearer(asked, geometries[k].off_m)) return;
    use(geometries[k]);
  }
}

/// Correction of a dimension that brings the nominal arm nearest to the touches, and the remaining
/// distance.
struct Nearest {
  double add_m = 0.0, off_m = 0.0;
};

/// Searches within 320 mm in coarse steps, refined to 5 mm. `dimension`: reference to it in a cell.
Nearest nearest(const Cell& cell, const std::vector<Touch>& touches,
                const std::function<double&(Cell&)>& dimension) {
  constexpr double kFarthestM = 0.32;
  constexpr double kCoarseM = 40e-3;  // about a sphere's radius: the next scale resolves it
  constexpr double kFineM = 5e-3;     // the nominal arm has errors of millimetres
  Cell changed = cell;
  double& value = dimension(changed);
  const double stated = value;
  Nearest best{0.0, nominal_off_m(cell, touches)};
  const auto evaluate = [&](double add_m) {
    value = stated + add_m;
    if (const double off_m = nominal_off_m(changed, touches); off_m < best.off_m)
      best = {add_m, off_m};
  };
  for (double add_m = -kFarthestM; add_m <= kFarthestM; add_m += kCoarseM) evaluate(add_m);
  for (double step_m = kCoarseM / 2.0; step_m >= kFineM; step_m /= 2.0) {
    const double middle_m = best.add_m;
    evaluate(middle_m - step_m);
    evaluate(middle_m + step_m);
  }
  return best;
}

/// Moves the tool's tip to where the nominal arm is nearest to the touches, by one coordinate after
/// the other. Returns the remaining distance [m].
double bring_tool_nearest(Cell& cell, const std::vector<Touch>& touches) {
  constexpr int kRounds = 4;
  double off_m = nominal_off_m(cell, touches);
  for (int round = 0; round < kRounds; ++round) {
    const double before_m = off_m;
    for (const int axis : {2, 0, 1}) {
      const auto coordinate = [axis](Cell& c) -> double& { return c.tool.tcp.matrix()(axis, 3); };
      const Nearest best = nearest(cell, touches, coordinate);
      coordinate(cell) += best.add_m;
      off_m = best.off_m;
    }
    if (!(off_m < before_m)) break;
  }
  return off_m;
}

/// True if a turn of the tool about the last axis, the flange's z, moves its tip by `off_m`.
bool is_turn(const Tool& tool, const Eigen::Vector3d& off_m) {
  constexpr double kLike = 0.2;
  const Eigen::Vector2d tip = tool.tcp.translation().head<2>();
  const Eigen::Vector2d turned = tip + off_m.head<2>();
  return std::abs(turned.norm() - tip.norm()) < kLike * off_m.norm() &&
         std::abs(off_m.z()) < kLike * off_m.norm();
}

/// Tests the tool's tip at the stated position plus `brought`.
void tool_at(const Asked& asked, const Eigen::Vector3d& brought) {
  constexpr double kAnyToolM = 0.3;
  const Tool& stated = asked.cell.tool;
  asked.with_cell(
      [&](Cell& cell) {
        cell.tool.tcp.translation() += brought;
        if (stated.length_m == stated.tcp.translation().norm())  // straight tool
          cell.tool.length_m = cell.tool.tcp.translation().norm();
        cell.tool.tcp_sigma_m.setConstant(kAnyToolM);
      },
      [&](const Calibration& c) {
        Eigen::Vector3d off = brought * kMmPerM;
        for (int axis = 0; axis < 3; ++axis)
          off[axis] += correction_of(c, tool_parameter(ParameterKind::kTcp, 0, axis)) * kMmPerM;
        Finding finding =
            likely(LikelyCause::kToolTip, {},
                   {{"x", off.x(), "mm"}, {"y", off.y(), "mm"}, {"z", off.z(), "mm"}});
        if (is_turn(stated, off / kMmPerM)) finding.evidence.push_back({"turn", 1.0, ""});
        return finding;
      });
}

/// d or a of a joint, as a candidate.
struct Dimension {
  std::size_t joint;
  double Joint::*length;
  double add_m, off_m;  ///< Nearest
};

/// Tests a length that differs from the robot file by about `add_m`.
void dimension_off(const Asked& asked, const Dimension& dimension) {
  constexpr double kAnyLengthM = 0.05;
  const auto& joints = asked.cell.robot.joints;
  const bool is_d = dimension.length == &Joint::d_m;
  const auto off_m = [&](const Calibration& c) {
    return correction_of(
        c, joint_parameter(is_d ? ParameterKind::kD : ParameterKind::kA, dimension.joint));
  };
  Cell changed = asked.cell;
  double& value = changed.robot.joints[dimension.joint].*dimension.length;
  const double stated_m = value;
  value += dimension.add_m;
  Cell loose = changed;
  loose.robot.joints[dimension.joint].tolerance_length_m = kAnyLengthM;
  const Trial trial = fit_hypothesis(loose, asked.touches);
  if (!trial.found) return;
  value += off_m(*trial.found);
  const double about_m = value;
  asked.ask({changed, asked.touches, [&](const Calibration& c) {
               Finding finding = likely(LikelyCause::kDimension);
               finding.parts = {{about_joint(joints[dimension.joint].name),
                                 {in_mm(is_d ? "d_mm" : "a_mm", about_m + off_m(c)),
                                  in_mm("stated", stated_m)}}};
               if (dimension.joint + 1 == joints.size()) finding.evidence = {{"last", 1.0, ""}};
               return finding;
             }});
}

/// Fields of robot files in which `other` differs: joints, each with the value in `other` and as
/// "stated". The arms have the same number of joints.
std::vector<FindingPart> differences(const Robot& stated, const Robot& other) {
  constexpr double kHalfTurnRad = kRadPerTurn / 2.0, kSameM = 5e-5, kSameRad = 2e-4;
  std::vector<FindingPart> parts;
  for (std::size_t i = 0; i < stated.joints.size(); ++i) {
    const Joint &is = stated.joints[i], &should = other.joints[i];
    const auto add = [&](const char* key, const char* unit, double is_in_file, double should_be) {
      parts.push_back(
          {about_joint(is.name), {{key, should_be, unit}, {"stated", is_in_file, unit}}});
    };
    const auto length = [&](const char* key, double Joint::*m) {
      if (std::abs(is.*m - should.*m) > kSameM)
        add(key, "mm", is.*m * kMmPerM, should.*m * kMmPerM);
    };
    const auto angle = [&](const char* key, double Joint::*rad) {
      if (!(std::abs(std::remainder(should.*rad - is.*rad, kRadPerTurn)) > kSameRad)) return;
      const double turn = std::remainder(should.*rad, kRadPerTurn);
      add(key, "deg", is.*rad * kDegPerRad,
          (turn < kSameRad - kHalfTurnRad ? kHalfTurnRad : turn) * kDegPerRad);
    };
    if (is.sign != should.sign) add("sign", "", is.sign, should.sign);
    angle("offset_deg", &Joint::offset_rad);
    length("d_mm", &Joint::d_m);
    length("a_mm", &Joint::a_m);
    angle("alpha_deg", &Joint::alpha_rad);
    angle("beta_deg", &Joint::beta_rad);
  }
  return parts;
}

/// Arm of another file, with gravity, base and flange of the stated one.
struct OtherArm {
  std::string file;  ///< as a cell file names it
  Cell cell;
  double off_m;
};

/// Change of one field of a robot file between joint conventions.
struct Change {
  std::size_t joint;
  std::function<void(Joint&)> make;
};

/// The arm with some fields changed.
struct Convention {
  Robot robot;
  std::size_t changes = 0;
  double off_m = 0.0;
};

/// Adds combinations of up to `most` of these changes to those of `made`, each of a different
/// joint.
void combine(const Asked& asked, const Convention& made, const std::vector<Change>& changes,
             std::size_t first, std::size_t most, std::vector<Convention>& all) {
  for (std::size_t k = first; k < changes.size(); ++k) {
    Cell changed = asked.cell;
    changed.robot = made.robot;
    changes[k].make(changed.robot.joints[changes[k].joint]);
    const Convention more{changed.robot, made.changes + 1, nominal_off_m(changed, asked.touches)};
    all.push_back(more);
    std::size_t next = k + 1;
    while (next < changes.size() && changes[next].joint == changes[k].joint) ++next;
    if (more.changes < most) combine(asked, more, changes, next, most, all);
  }
}

/// The arm with two or more axes of the opposite direction, with one or two zeros off by a quarter
/// or half a turn, or with one or two twists of the opposite sign. Without those that are no nearer
/// than one with fewer changes of the same kind: a change that turns all targets or none has no
/// effect.
std::vector<Convention> conventions(const Asked& asked) {
  constexpr double kNoNearer = 0.9;
  constexpr std::size_t kMostJoints = 8;  // maximum number of joints for all combinations of axes
  const auto& joints = asked.cell.robot.joints;
  std::vector<Change> signs, zeros, twists;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    signs.push_back({i, [](Joint& joint) { joint.sign = -joint.sign; }});
    for (const int quarters : {-1, 1, 2})
      zeros.push_back(
          {i, [quarters](Joint& joint) { joint.offset_rad += quarters * kRadPerTurn / 4.0; }});
    if (joints[i].alpha_rad != 0.0)
      twists.push_back({i, [](Joint& joint) { joint.alpha_rad = -joint.alpha_rad; }});
  }
  std::vector<Convention> nearer;
  const auto take = [&](const std::vector<Change>& changes, std::size_t most, std::size_t least) {
    std::vector<Convention> all;
    combine(asked, {asked.cell.robot}, changes, 0, most, all);
    for (const Convention& one : all)
      if (one.changes >= least && std::ranges::none_of(all, [&](const Convention& other) {
            return other.changes < one.changes && one.off_m > kNoNearer * other.off_m;
          }))
        nearer.push_back(one);
  };
  take(signs, joints.size() <= kMostJoints ? joints.size() : 2, 2);
  take(zeros, 2, 1);
  take(twists, 2, 1);
  return nearer;
}

}  // namespace

namespace mistakes {

/// Tool in metres, read as millimetres.
void tool_unit(const Asked& asked) {
  constexpr double kTinyM = 5e-3;
  const double reach_m = asked.cell.tool.tcp.translation().norm();
  if (!(reach_m > 0.0 && reach_m < kTinyM)) return;
  asked.with_cell(
      [](Cell& cell) {
        Tool& tool = cell.tool;
        tool.tcp.translation() *= kMmPerM;
        if (tool.length_m < kTinyM) tool.length_m *= kMmPerM;
        if (tool.com_m.norm() < kTinyM) tool.com_m *= kMmPerM;
      },
      always(likely(LikelyCause::kToolUnit, {}, {in_mm("reach", reach_m)})));
}

void tool_tip(const Asked& asked) {
  Cell nearest = asked.cell;
  if (!is_nearer(asked, bring_tool_nearest(nearest, asked.touches))) {
    tool_at(asked, Eigen::Vector3d::Zero());
    return;
  }
  const Eigen::Vector3d brought =
      nearest.tool.tcp.translation() - asked.cell.tool.tcp.translation();
  tool_at(asked, brought);
  // A tip beyond the spheres' centres fits their far sides nearly as well.
  const auto sphere = std::ranges::find(asked.cell.targets, TargetKind::kSphere, &Target::kind);
  if (sphere == asked.cell.targets.end()) return;
  for (const double side : {-1.0, 1.0})
    tool_at(asked, brought + side * sphere->diameter_m * Eigen::Vector3d::UnitZ());
}

void dimensions(const Asked& asked) {
  std::vector<Dimension> found;
  const auto evaluate = [&](std::size_t i, double Joint::*length) {
    const auto [add_m, off_m] = nearest(
        asked.cell, asked.touches, [&](Cell& c) -> double& { return c.robot.joints[i].*length; });
    found.push_back({i, length, add_m, off_m});
  };
  for (std::size_t i = 0; i < asked.cell.robot.joints.size(); ++i)
    for (const JointError error : asked.cell.robot.joints[i].errors) {
      if (error == JointError::kD) evaluate(i, &Joint::d_m);
      if (error == JointError::kA) evaluate(i, &Joint::a_m);
    }
  for_nearest(asked, found, 4, [&](const Dimension& one) { dimension_off(asked, one); });
}

void other_robot(const Asked& asked) {
  constexpr std::size_t kFewDifferences = 6;  // listed individually
  if (!asked.other_robots) return;
  const Robot& stated = asked.cell.robot;
  std::vector<OtherArm> arms;
  std::vector<NamedRobot> others = asked.other_robots();
  std::ranges::stable_sort(others, {}, &NamedRobot::file);  // independent of the order of reading
  for (NamedRobot& other : others) {
    if (other.robot.joints.size() != stated.joints.size()) continue;
    other.robot.gravity_m_s2 = stated.gravity_m_s2;
    other.robot.base_fixed = stated.base_fixed;
    other.robot.flange_fixed = stated.flange_fixed;
    Cell cell = asked.cell;
    cell.robot = std::move(other.robot);
    const double off_m = nominal_off_m(cell, asked.touches);
    arms.push_back({other.file, std::move(cell), off_m});
  }
  for_nearest(asked, arms, 3, [&](const OtherArm& arm) {
    const std::vector<FindingPart> differ = differences(stated, arm.cell.robot);
    Finding finding = likely(LikelyCause::kOtherRobot, about_robot(arm.file, arm.cell.robot.name),
                             {{"differences", static_cast<double>(differ.size()), ""}},
                             {{about_robot(stated.name, {}), {}}});
    if (differ.size() <= kFewDifferences)
      finding.parts.insert(finding.parts.end(), differ.begin(), differ.end());
    asked.ask({arm.cell, asked.touches, always(finding)});
  });
}

/// Robot file with correct lengths and wrong axes: joint conventions differ between textbooks.
void axis_convention(const Asked& asked) {
  for_nearest(asked, conventions(asked), 3, [&](const Convention& one) {
    Hypothesis other{asked.cell, asked.touches,
                     always(likely(LikelyCause::kAxisConvention, {}, {},
                                   differences(asked.cell.robot, one.robot)))};
    other.cell.robot = one.robot;
    other.changes = one.changes;
    asked.ask(other);
  });
}

/// An arm mounted in another orientation than its file states.
void gravity(const Asked& asked) {
  constexpr double kEarth = 9.81;
  const Eigen::Vector3d& stated = asked.cell.robot.gravity_m_s2;
  const double g = stated.norm() > 0.0 ? stated.norm() : kEarth;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      const Eigen::Vector3d along = sign * g * Eigen::Vector3d::Unit(axis);
      if ((along - stated).norm() < 0.1 * g) continue;
      asked.with_cell(
          [&](Cell& cell) { cell.robot.gravity_m_s2 = along; },
          [&](const Calibration& c) -> std::optional<Finding> {
            // With gravity reversed the compliance of joints and tool is negative.
            if (has(c.verdict.findings, FindingKind::kNegativeCompliance)) return {};
            return likely(
                LikelyCause::kGravity, {},
                {{"x", along.x(), "m/s^2"}, {"y", along.y(), "m/s^2"}, {"z", along.z(), "m/s^2"}});
          });
    }
}

}  // namespace mistakes

}  // namespace cellcal::calib
