#include "calib/diagnose/causes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "calib/consistency/lengths.h"
#include "calib/consistency/session_order.h"
#include "calib/diagnose/axis_convention.h"
#include "calib/diagnose/data_association.h"
#include "calib/diagnose/dimensions.h"
#include "calib/diagnose/trial.h"
#include "calib/estimate/target_place.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {
/// What a cause takes away at least, squared sigmas; chance and a few more unknowns take less.
constexpr double kWorthNaming = 25.0;
/// A cause has to explain all but this part of the misfit.
constexpr double kExplained = 0.5;
constexpr std::size_t kNamed = 3;
constexpr double kSameMisfit = 0.02;
constexpr std::size_t kMostPairs = 28, kMostTargets = 12;
/// A mistake of set-up shows in so many touches; more would only take longer.
constexpr std::size_t kMostTouches = 1000;
/// So much nearer to the touches than stated another drawing or tool has to bring the nominal arm.
constexpr double kNearer = 1.0 / 3.0;
/// So many fields of a robot file are named one by one.
constexpr std::size_t kFewDifferences = 6;
constexpr double kAnyToolM = 0.3, kAnyRadiusM = 0.01;

/// What was touched is elsewhere on a plane or before a tracker each time; how they stand is not.
double moved_by_m(const TargetResult& before, const TargetResult& after) {
  if (before.kind == TargetKind::kPlane)
    return std::abs(after.normal.dot(before.centre_m) - after.distance_m);
  if (before.kind == TargetKind::kTracker)
    return (after.frame * (before.frame.inverse() * before.centre_m) - before.centre_m).norm();
  return (after.centre_m - before.centre_m).norm();
}

class Search {
 public:
  Search(const Cell& cell, const std::vector<Touch>& touches, const OtherRobots& other_robots)
      : cell_(cell), other_robots_(other_robots), share_(share_of(touches, kMostTouches)) {
    for (const std::size_t i : share_) touches_.push_back(touches[i]);
    stated_ = attempt(cell, touches_);
    least_scatter_ = stated_.scatter;
    nominal_off_m_ = nominal_off_m(cell, touches_);
  }

  bool needed() const { return !stated_.makes_sense(); }

  /// What the best explanation leaves, in what was stated as the noise of a touch: an arm that does
  /// what its model lacks scatters by more. None where all as it is stated scatters hardly more.
  std::optional<double> beyond_stated() const {
    constexpr double kAsStated = 1.3, kNoBetter = 1.5;
    if (least_scatter_ < kAsStated || stated_.scatter < kNoBetter * least_scatter_) return {};
    return least_scatter_;
  }

  void radians() {
    constexpr double kTurnDeg = 360.0 * std::numbers::pi / 180.0;  // read as degrees: below 6.3
    double largest = 0.0;
    for (const Touch& touch : touches_)
      for (const double q : touch.joint_rad) largest = std::max(largest, std::abs(q) * kDegPerRad);
    if (largest > kTurnDeg) return;
    std::vector<Touch> changed = touches_;
    for (Touch& touch : changed)
      for (double& q : touch.joint_rad) q *= kDegPerRad;
    weigh(cell_, changed, [&](const Calibration&) {
      return fmt::format(
          "no joint angle is above {:.1f} deg, and read as radians the touches make sense; give them "
          "in degrees",
          largest);
    });
  }

  void signs() {
    for (std::size_t i = 0; i < cell_.robot.joints.size(); ++i) {
      std::vector<Touch> changed = touches_;
      for (Touch& touch : changed) touch.joint_rad[i] = -touch.joint_rad[i];
      if (farther(cell_, changed)) continue;
      weigh(cell_, changed, [&](const Calibration&) {
        return fmt::format(
            "with {} turning the other way the touches make sense; check its sign in the robot "
            "file",
            cell_.robot.joints[i].name);
      });
    }
  }

  /// An axis that lost its mastering.
  void zeros() {
    constexpr double kAnyZeroRad = 0.1;
    for (std::size_t i = 0; i < cell_.robot.joints.size(); ++i) {
      const Joint& joint = cell_.robot.joints[i];
      const auto off_rad = [&](const Calibration& c) {
        const double off = correction_of(c, joint_parameter(ParameterKind::kTheta, i));
        return std::remainder(joint.sign * off, 2.0 * std::numbers::pi);
      };
      Cell loose = cell_;
      loose.robot.joints[i].errors = {JointError::kTheta};  // or another angle takes its share
      loose.robot.joints[i].tolerance_angle_rad = kAnyZeroRad;
      const Trial trial = attempt(loose, touches_);
      if (!trial.found) continue;
      const double about_rad = off_rad(*trial.found);
      if (!(std::abs(about_rad) > 2.0 * joint.tolerance_angle_rad)) continue;
      std::vector<Touch> changed = touches_;
      for (Touch& touch : changed) touch.joint_rad[i] += about_rad;
      weigh(cell_, changed, [&](const Calibration& c) {
        return fmt::format(
            "with {:+.2f} deg added to all angles of {} the touches make sense; has it lost its "
            "mastering?",
            (about_rad + off_rad(c)) * 180.0 / std::numbers::pi, joint.name);
      });
    }
  }

  void exchanged() {
    std::size_t tried = 0;
    for (std::size_t a = 0; a < cell_.robot.joints.size(); ++a)
      for (std::size_t b = a + 1; b < cell_.robot.joints.size() && tried < kMostPairs;
           ++b, ++tried) {
        std::vector<Touch> changed = touches_;
        for (Touch& touch : changed) std::swap(touch.joint_rad[a], touch.joint_rad[b]);
        if (farther(cell_, changed)) continue;
        weigh(cell_, changed, [&](const Calibration&) {
          return fmt::format(
              "with the angles of {} and {} exchanged the touches make sense; check the columns",
              cell_.robot.joints[a].name, cell_.robot.joints[b].name);
        });
      }
  }

  void swapped() {
    std::size_t tried = 0;
    for (std::size_t a = 0; a < cell_.targets.size(); ++a)
      for (std::size_t b = a + 1; b < cell_.targets.size() && tried < kMostPairs; ++b, ++tried) {
        const std::string &one = cell_.targets[a].id, &other = cell_.targets[b].id;
        std::vector<Touch> changed = touches_;
        for (Touch& touch : changed)
          touch.target = touch.target == one ? other : touch.target == other ? one : touch.target;
        weigh(cell_, changed, [&](const Calibration&) {
          return fmt::format("with {} and {} swapped the touches make sense; check which is which",
                             one, other);
        });
      }
  }

  /// Names that went round among three targets or more.
  void mixed_up() {
    const auto names = better_names(cell_, touches_);
    if (!names || names->changed() < 3) return;  // two are swapped()
    weigh(cell_, names->given_to(cell_, touches_), [&](const Calibration&) {
      return names->words(cell_) + " all makes sense; check which is which";
    });
  }

  void tool() {
    constexpr double kTinyM = 5e-3;
    if (const double reach_m = cell_.tool.tcp.translation().norm();
        reach_m > 0.0 && reach_m < kTinyM) {
      Cell larger = cell_;
      larger.tool.tcp.translation() *= kMmPerM;
      if (larger.tool.length_m < kTinyM) larger.tool.length_m *= kMmPerM;
      if (larger.tool.com_m.norm() < kTinyM) larger.tool.com_m *= kMmPerM;
      weigh(larger, touches_, [&](const Calibration&) {
        return fmt::format(
            "the tool is {:.3f} mm long, and read as metres the touches make sense; give it in "
            "millimetres",
            reach_m * kMmPerM);
      });
    }
    Cell nearest = cell_;
    if (!(bring_tool_nearest(nearest, touches_) < kNearer * nominal_off_m_)) {
      weigh_tool(Eigen::Vector3d::Zero());
      return;
    }
    const Eigen::Vector3d brought = nearest.tool.tcp.translation() - cell_.tool.tcp.translation();
    weigh_tool(brought);
    // A tip beyond the spheres' middles fits their far sides nearly as well.
    for (const Target& target : cell_.targets) {
      if (target.kind != TargetKind::kSphere) continue;
      for (const double side : {-1.0, 1.0})
        weigh_tool(brought + side * target.diameter_m * Eigen::Vector3d::UnitZ());
      break;
    }
  }

  /// A length that is not what the robot file says, by centimetres.
  void dimensions() {
    constexpr double kAnyLengthM = 0.05;
    constexpr std::size_t kMost = 4;
    struct Found {
      Dimension dimension;
      Nearest nearest;
    };
    std::vector<Found> found;
    for (const Dimension& dimension : dimensions_of(cell_.robot))
      found.push_back({dimension, nearest(cell_, touches_, dimension)});
    std::stable_sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
      return a.nearest.off_m < b.nearest.off_m;
    });
    for (std::size_t k = 0; k < std::min(kMost, found.size()); ++k) {
      const auto& [dimension, nearest] = found[k];
      if (!(nearest.off_m < kNearer * nominal_off_m_)) return;
      const Joint& joint = cell_.robot.joints[dimension.joint];
      const bool is_d = dimension.of == Dimension::Of::kD;
      const auto off_m = [&](const Calibration& c) {
        return correction_of(
            c, joint_parameter(is_d ? ParameterKind::kD : ParameterKind::kA, dimension.joint));
      };
      Cell changed = cell_;
      double& value = dimension.in(changed);
      value += nearest.add_m;
      Cell loose = changed;
      loose.robot.joints[dimension.joint].tolerance_length_m = kAnyLengthM;
      const Trial trial = attempt(loose, touches_);
      if (!trial.found) continue;
      value += off_m(*trial.found);
      const double about_m = value;
      Cell stated = cell_;
      weigh(changed, touches_, [&](const Calibration& c) {
        return fmt::format(
            "with {}_mm of {} {:.1f} instead of {:.1f} the touches make sense; check it in the "
            "robot file{}",
            is_d ? 'd' : 'a', joint.name, (about_m + off_m(c)) * kMmPerM,
            dimension.in(stated)*kMmPerM,
            dimension.joint + 1 == cell_.robot.joints.size() ? ", and the tool's length" : "");
      });
    }
  }

  void other_robot() {
    constexpr std::size_t kMost = 3;
    const std::vector<OtherArm> arms = other_arms(cell_, touches_, other_robots_);
    for (std::size_t k = 0; k < std::min(kMost, arms.size()); ++k) {
      if (!(arms[k].off_m < kNearer * nominal_off_m_)) return;
      weigh(arms[k].cell, touches_, [&](const Calibration&) {
        const std::vector<std::string> differ = differences(cell_.robot, arms[k].cell.robot);
        return fmt::format(
            "with the robot file {} ({}) the touches make sense, and not with {}; {}", arms[k].file,
            arms[k].cell.robot.name,
            arms[k].cell.robot.name == cell_.robot.name ? "the cell's own of that name"
                                                        : "that of " + cell_.robot.name,
            differ.size() > kFewDifferences
                ? "which arm is it?"
                : fmt::format("it has {}; check these", fmt::join(differ, ", ")));
      });
    }
  }

  void drawing() {
    constexpr std::size_t kMost = 3;
    const std::vector<OtherDrawing> drawings = other_drawings(cell_, touches_);
    for (std::size_t k = 0; k < std::min(kMost, drawings.size()); ++k) {
      if (!(drawings[k].off_m < kNearer * nominal_off_m_)) return;
      Cell changed = cell_;
      changed.robot = drawings[k].robot;
      weigh(
          changed, touches_,
          [&](const Calibration&) {
            return fmt::format("with {} the touches make sense; check the robot file",
                               fmt::join(differences(cell_.robot, drawings[k].robot), ", "));
          },
          {}, static_cast<std::size_t>(drawings[k].changes));
    }
  }

  void radius() {
    Cell changed = cell_;
    changed.radius_offset_sigma_m = kAnyRadiusM;
    weigh(changed, touches_, [&](const Calibration& c) {
      const double rho =
          correction_of(c, tool_parameter(ParameterKind::kEffectiveRadius, 0)) * kMmPerM;
      return fmt::format(
          "with diameters {:+.2f} mm off what the cell file states the touches make sense; check "
          "diameter_mm and tip_radius_mm",
          2.0 * rho);
    });
    for (std::size_t t = 0; t < cell_.targets.size(); ++t) {
      if (cell_.targets[t].kind != TargetKind::kSphere) continue;
      changed = cell_;
      changed.targets[t].diameter_sigma_m = 2.0 * kAnyRadiusM;
      weigh(changed, touches_, [&](const Calibration& c) {
        const double radius =
            correction_of(c, target_parameter(ParameterKind::kRadius, t)) * kMmPerM;
        return fmt::format(
            "with the diameter of {} {:+.2f} mm off what the cell file states the touches make "
            "sense; check its diameter_mm",
            cell_.targets[t].id, 2.0 * radius);
      });
    }
  }

  void lengths() {
    for (std::size_t k = 0; k < std::min(kMostPairs, cell_.lengths.size()); ++k) {
      const CertifiedLength& wrong = cell_.lengths[k];
      const auto here = cell_.lengths.begin() + static_cast<std::ptrdiff_t>(k);
      if (std::any_of(cell_.lengths.begin(), here,
                      [&](const CertifiedLength& l) { return same_ends(l, wrong); }))
        continue;
      const Cell changed =
          silenced(cell_, [&](const CertifiedLength& l) { return same_ends(l, wrong); });
      weigh(changed, touches_, [&](const Calibration& c) { return without_length(wrong, c); });
    }
    std::size_t tried = 0;
    for (std::size_t a = 0; a < cell_.lengths.size(); ++a)
      for (std::size_t b = a + 1; b < cell_.lengths.size() && tried < kMostPairs; ++b, ++tried) {
        Cell changed = cell_;
        std::swap(changed.lengths[a].length_m, changed.lengths[b].length_m);
        const CertifiedLength &one = cell_.lengths[a], &other = cell_.lengths[b];
        weigh(changed, touches_, [&](const Calibration&) {
          return fmt::format(
              "with the certified lengths of {}-{} and {}-{} exchanged the touches make sense; "
              "check which is which",
              one.from, one.to, other.from, other.to);
        });
      }
  }

  /// Readings of trackers and wires in other units, or of a left-handed tracker.
  void readings() {
    constexpr double kMmPerInch = 25.4;
    std::vector<std::string> trackers, wires;
    for (const Target& target : cell_.targets) {
      if (target.kind == TargetKind::kTracker) trackers.push_back(target.id);
      if (target.kind == TargetKind::kWire) wires.push_back(target.id);
    }
    std::vector<std::vector<std::string>> sets;
    for (const auto& all : {trackers, wires}) {
      if (!all.empty()) sets.push_back(all);
      if (all.size() > 1 && all.size() <= kMostTargets)
        for (const std::string& id : all) sets.push_back({id});
    }
    if (!trackers.empty() && !wires.empty()) {
      sets.push_back(trackers);
      sets.back().insert(sets.back().end(), wires.begin(), wires.end());
    }
    const auto changed = [&](const std::vector<std::string>& ids, double factor, double x_factor) {
      std::vector<Touch> touches = touches_;
      for (Touch& touch : touches) {
        if (std::find(ids.begin(), ids.end(), touch.target) == ids.end()) continue;
        touch.radius_m *= factor;
        for (double& m : touch.tracker_m) m *= factor;
        touch.tracker_m[0] *= x_factor;
      }
      return touches;
    };
    struct Unit {
      double factor;
      const char* name;
    };
    for (const auto& ids : sets)
      for (const Unit& unit : {Unit{kMmPerM, "metres"}, Unit{1.0 / kMmPerM, "micrometres"},
                               Unit{kMmPerInch, "inches"}}) {
        const std::vector<Touch> touches = changed(ids, unit.factor, 1.0);
        if (farther(cell_, touches)) continue;
        weigh(cell_, touches, [&](const Calibration&) {
          return fmt::format(
              "with the readings of {} taken as {} the touches make sense; give them in "
              "millimetres",
              fmt::join(ids, ", "), unit.name);
        });
      }
    for (const auto& ids : sets) {
      if (cell_.targets[cell_.target_index(ids.front())].kind != TargetKind::kTracker) continue;
      weigh(cell_, changed(ids, 1.0, -1.0), [&](const Calibration&) {
        return fmt::format(
            "with one axis of the readings of {} turned about the touches make sense; has one of "
            "the columns the wrong sign, or are two of them exchanged?",
            fmt::join(ids, ", "));
      });
    }
  }

  /// An arm that hangs or stands otherwise than its file says.
  void gravity() {
    constexpr double kEarth = 9.81;
    const double stated = cell_.robot.gravity_m_s2.norm(), g = stated > 0.0 ? stated : kEarth;
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {-1.0, 1.0}) {
        Cell changed = cell_;
        changed.robot.gravity_m_s2 = sign * g * Eigen::Vector3d::Unit(axis);
        if ((changed.robot.gravity_m_s2 - cell_.robot.gravity_m_s2).norm() < 0.1 * g) continue;
        weigh(changed, touches_, [&](const Calibration& c) -> std::string {
          // The other way round joints and tool would give against their load.
          if (has(c.verdict.findings, FindingKind::kNegativeCompliance)) return {};
          return fmt::format(
              "with gravity along {}{} of the base the touches make sense; check how the arm is "
              "mounted, and gravity in the robot file",
              sign < 0.0 ? '-' : '+', "xyz"[axis]);
        });
      }
  }

  void centres() {
    const auto centre_of = [](const Calibration& c, const std::string& id) {
      for (const TargetResult& t : c.targets)
        if (t.id == id) return t.centre_m;
      return Eigen::Vector3d(Eigen::Vector3d::Zero());
    };
    Cell all = cell_;
    std::size_t held = 0;
    for (std::size_t t = 0; t < cell_.targets.size(); ++t) {
      const Target& target = cell_.targets[t];
      if (!centre_is_held(target)) continue;
      all.targets[t].centre_sigma_m = 0.0;
      if (++held > kMostTargets) continue;
      Cell changed = cell_;
      changed.targets[t].centre_sigma_m = 0.0;  // where to begin, no more
      weigh(changed, touches_, [&](const Calibration& c) {
        return fmt::format(
            "with {} {:.1f} mm from where the cell file states it the touches make sense; check its "
            "centre_mm, or state a larger centre_sigma_mm",
            target.id, (centre_of(c, target.id) - target.centre_m).norm() * kMmPerM);
      });
    }
    if (held < 2) return;
    weigh(
        all, touches_,
        [&](const Calibration&) {
          return "with no centre held where the cell file states it the touches make sense; check "
                 "centre_mm (of the arm's base frame?), or state a larger centre_sigma_mm";
        },
        {}, held);
  }

  /// From one of its touches on, a target stands elsewhere.
  void moved() {
    constexpr int kLeastEachSide = 4;
    for (const Target& target : cell_.targets) {
      std::vector<std::size_t> own;
      for (const std::size_t i : in_order(touches_))
        if (touches_[i].target == target.id && touches_[i].set == TouchSet::kFit) own.push_back(i);
      for (const int quarter : {1, 2, 3}) {
        const std::size_t split = own.size() * static_cast<std::size_t>(quarter) / 4;
        if (split < kLeastEachSide || own.size() - split < kLeastEachSide) continue;
        Cell changed = cell_;
        Target later = target;
        later.id = id_after_move(cell_, target.id);
        later.centre_sigma_m = 0.0;  // the touches say where
        changed.targets.push_back(later);
        std::vector<Touch> renamed = touches_;
        bool passed = false;
        for (const std::size_t i : in_order(touches_)) {
          passed = passed || i == own[split];
          if (passed && renamed[i].target == target.id) renamed[i].target = later.id;
        }
        MovedTarget suspect;
        suspect.target = target.id;
        suspect.after_touch = share_[own[split - 1]];
        suspect.many_left_out = true;  // or the touches would make sense as they are
        weigh(
            changed, renamed,
            [&](const Calibration& c) {
              TargetResult before, after;
              for (const TargetResult& t : c.targets) {
                if (t.id == target.id) before = t;
                if (t.id == later.id) after = t;
              }
              return fmt::format(
                  "{} seems to have moved by {:.2f} mm at about touch {}; fix it, and touch again",
                  target.id, moved_by_m(before, after) * kMmPerM, share_[own[split]] + 1);
            },
            suspect);
      }
    }
  }

  std::vector<Cause> best() {
    std::stable_sort(causes_.begin(), causes_.end(),
                     [](const Cause& a, const Cause& b) { return a.misfit < b.misfit; });
    std::vector<Cause> named;
    for (const Cause& cause : causes_) {
      // Another one is worth naming where it explains the touches about as well,
      if (named.size() == kNamed || cause.misfit > 1.2 * causes_.front().misfit) break;
      // and is not the same in other words: joints' conventions can be had in several ways.
      const auto same = [&](const Cause& other) {
        return std::abs(other.misfit - cause.misfit) < kSameMisfit;
      };
      if (std::none_of(causes_.begin(), causes_.end(), [&](const Cause& other) {
            return same(other) && other.changes < cause.changes;
          }))
        named.push_back(cause);
    }
    return named;
  }

 private:
  /// Whether turning the tool about the last axis, the flange's z, moves its tip so.
  bool is_turn(const Eigen::Vector3d& off_m) const {
    constexpr double kLike = 0.2;
    const Eigen::Vector2d tip = cell_.tool.tcp.translation().head<2>();
    const Eigen::Vector2d turned = tip + off_m.head<2>();
    return std::abs(turned.norm() - tip.norm()) < kLike * off_m.norm() &&
           std::abs(off_m.z()) < kLike * off_m.norm();
  }

  /// Whether the nominal arm is farther from the touches so, beyond doubt: quickly asked, before an
  /// estimate.
  bool farther(const Cell& cell, const std::vector<Touch>& touches) const {
    constexpr double kDoubt = 1.5;
    return nominal_off_m(cell, touches) > kDoubt * nominal_off_m_;
  }

  /// With the tool's tip about there, from where it is stated.
  void weigh_tool(const Eigen::Vector3d& brought) {
    Cell changed = cell_;
    changed.tool.tcp.translation() += brought;
    if (cell_.tool.length_m == cell_.tool.tcp.translation().norm())  // as long as it reaches
      changed.tool.length_m = changed.tool.tcp.translation().norm();
    changed.tool.tcp_sigma_m.setConstant(kAnyToolM);
    weigh(changed, touches_, [&](const Calibration& c) {
      Eigen::Vector3d off = brought * kMmPerM;
      for (int axis = 0; axis < 3; ++axis)
        off[axis] += correction_of(c, tool_parameter(ParameterKind::kTcp, 0, axis)) * kMmPerM;
      return fmt::format(
          "with the tool's tip moved by about ({:.1f}, {:.1f}, {:.1f}) mm on the flange the "
          "touches make sense; is it the tool of the cell file{}?",
          off.x(), off.y(), off.z(),
          is_turn(off / kMmPerM) ? ", and has the last axis its mastering" : "");
    });
  }

  /// `words`: empty where it is no cause after all.
  void weigh(const Cell& cell, const std::vector<Touch>& touches,
             const std::function<std::string(const Calibration&)>& words,
             const std::optional<MovedTarget>& moved = {}, std::size_t changes = 1) {
    const Trial trial = attempt(cell, touches);
    least_scatter_ = std::min(least_scatter_, trial.scatter);
    if (!trial.makes_sense() || !(trial.excess() < kExplained * stated_.excess()) ||
        !(trial.sum < stated_.sum - kWorthNaming))
      return;
    Cause cause{trial.misfit(), words(*trial.found), moved, changes};
    if (!cause.words.empty() &&
        std::none_of(causes_.begin(), causes_.end(),
                     [&](const Cause& other) { return other.words == cause.words; }))
      causes_.push_back(std::move(cause));
  }

  const Cell& cell_;
  const OtherRobots& other_robots_;
  std::vector<std::size_t> share_;  ///< of the touches, those that are asked
  std::vector<Touch> touches_;      ///< these
  Trial stated_;
  double least_scatter_ = 0.0;
  double nominal_off_m_ = 0.0;
  std::vector<Cause> causes_;
};

}  // namespace

namespace {

/// As the noise is stated. `beyond`: what the best explanation leaves, where that is more.
std::vector<Cause> causes_at(const Cell& cell, const std::vector<Touch>& touches,
                             const OtherRobots& other_robots, std::optional<double>& beyond) {
  Search search(cell, touches, other_robots);
  if (!search.needed()) return {};
  search.radians();
  search.signs();
  search.zeros();
  search.exchanged();
  search.swapped();
  search.mixed_up();
  search.tool();
  search.dimensions();
  search.other_robot();
  search.drawing();
  search.radius();
  search.lengths();
  search.readings();
  search.gravity();
  search.centres();
  search.moved();
  beyond = search.beyond_stated();
  return search.best();
}

}  // namespace

std::vector<Cause> causes_of(const Cell& cell, const std::vector<Touch>& touches,
                             const OtherRobots& other_robots) {
  /// Of more, no arm would be left to speak of.
  constexpr double kMostScatterM = 1e-3;
  // Twice: a fit that is weighed by too small a noise leaves less than there is.
  constexpr int kMostRepeats = 2;
  std::optional<double> beyond;
  std::vector<Cause> causes = causes_at(cell, touches, other_robots, beyond);
  Cell noisier = cell;
  std::vector<Touch> same = touches;
  for (int k = 0; k < kMostRepeats && causes.empty() && beyond; ++k) {
    // With a noise as large as what the best explanation leaves.
    noisier.touch_sigma_m *= *beyond;
    if (noisier.touch_sigma_m > kMostScatterM) break;
    noisier.turn_sigma_rad *= *beyond;
    for (Touch& touch : same) {
      touch.sigma_m *= *beyond;
      touch.turn_sigma_rad *= *beyond;
    }
    beyond.reset();
    causes = causes_at(noisier, same, other_robots, beyond);
  }
  return causes;
}

}  // namespace cellcal::calib
