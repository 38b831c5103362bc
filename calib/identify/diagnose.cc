#include "calib/identify/diagnose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>

#include "calib/files/error.h"
#include "calib/identify/identify.h"
#include "calib/identify/level.h"
#include "calib/identify/moved.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

namespace {

constexpr double kMmPerM = 1000.0;
/// Squared sigmas per touch, of touches and tolerances together, below which all makes sense: 1 and
/// at most one more for each of the unknowns, some of which the touches do not reach.
constexpr double kSense = 2.5;
/// A touch is wrong by no more than this, however far it is off.
constexpr double kMostSigmas = 5.0;
/// A cause has to explain all but this part of the misfit.
constexpr double kExplained = 0.5;
constexpr std::size_t kNamed = 2;
constexpr std::size_t kMostPairs = 28;
/// A mistake of set-up shows in so many touches; more would only take longer.
constexpr std::size_t kMostTouches = 1000;
constexpr double kAnyToolM = 0.1, kAnyRadiusM = 0.01;

/// What the best arm leaves unexplained: squared sigmas per fit touch, of touches and of what the
/// files state; and that arm.
struct Trial {
  double misfit = std::numeric_limits<double>::infinity();
  std::optional<Calibration> found;
};

/// How far the files let a parameter be off, 1 sigma; 0 where they say nothing.
double stated_sigma(const ArmModel& arm, const Cell& cell, const std::string& name) {
  for (const ArmParameter& parameter : arm.parameters())
    if (parameter.name == name) return parameter.sigma;
  if (name == "touch.rho") return cell.radius_offset_sigma_m;
  for (const Target& target : cell.targets)
    if (name == target.id + ".radius") return target.diameter_sigma_m / 2.0;
  return 0.0;
}

/// Between the centres that were found; nothing where one was not touched.
std::optional<double> found_length_m(const Calibration& found, const CertifiedLength& length) {
  const TargetResult *from = nullptr, *to = nullptr;
  for (const TargetResult& target : found.targets) {
    if (target.id == length.from) from = &target;
    if (target.id == length.to) to = &target;
  }
  if (from == nullptr || to == nullptr) return std::nullopt;
  return (from->centre_m - to->centre_m).norm();
}

/// How well a calibration knows it, 1 sigma.
double length_sigma_m(const Calibration& found, const CertifiedLength& length) {
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  for (const TargetResult& target : found.targets) {
    if (target.id == length.to) along += target.centre_m;
    if (target.id == length.from) along -= target.centre_m;
  }
  along.normalize();
  Eigen::VectorXd by = Eigen::VectorXd::Zero(found.covariance.cols());
  for (std::size_t p = 0; p < found.parameters.size(); ++p)
    for (int axis = 0; axis < 3; ++axis) {
      const std::string place = std::string(".") + "xyz"[axis];
      const auto k = static_cast<Eigen::Index>(p);
      if (found.parameters[p].name == length.to + place) by[k] = along[axis];
      if (found.parameters[p].name == length.from + place) by[k] = -along[axis];
    }
  return std::sqrt(std::max(0.0, by.dot(found.covariance * by)));
}

Trial attempt(const Cell& cell, const std::vector<Touch>& touches) {
  Trial trial;
  const Cell levelled = at_level(cell, ModelLevel{});
  const ArmModel arm(levelled.robot, levelled.tool);
  try {
    IdentifyOptions options;
    options.level = ModelLevel{};  // the fullest; which one it is does not matter here
    trial.found = identify_as_stated(cell, touches, options);
  } catch (const IdentifyError&) {
    return trial;
  }
  int count = 0;
  double sum = 0.0;
  for (const TouchResidual& r : trial.found->residuals) {
    const Touch& touch = touches[r.touch];
    if (touch.set != TouchSet::kFit) continue;
    const double sigma = touch.sigma_m > 0.0 ? touch.sigma_m : cell.touch_sigma_m;
    sum += std::pow(std::min(std::abs(r.after_m) / sigma, kMostSigmas), 2);
    ++count;
  }
  for (const ParameterResult& p : trial.found->parameters)
    if (const double sigma = stated_sigma(arm, cell, p.name); sigma > 0.0)
      sum += std::pow(p.correction / sigma, 2);
  for (const CertifiedLength& length : cell.lengths)
    if (const auto found_m = found_length_m(*trial.found, length))
      sum += std::pow((*found_m - length.length_m) / length.sigma_m, 2);
  trial.misfit = sum / count;
  return trial;
}

struct Cause {
  double misfit;
  std::string words;
  std::optional<MovedTarget> moved;  ///< a target, and nothing else
};

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
  Search(const Cell& cell, const std::vector<Touch>& touches)
      : cell_(cell), stride_(touches.size() / kMostTouches + 1) {
    for (std::size_t i = 0; i < touches.size(); i += stride_) touches_.push_back(touches[i]);
    stated_ = attempt(cell, touches_);
  }

  bool needed() const { return stated_.misfit > kSense; }

  void radians() {
    constexpr double kTurnDeg = 360.0 * std::numbers::pi / 180.0;  // read as degrees: below 6.3
    constexpr double kDegPerRad = 180.0 / std::numbers::pi;
    double largest = 0.0;
    for (const Touch& touch : touches_)
      for (const double q : touch.joint_rad) largest = std::max(largest, std::abs(q) * kDegPerRad);
    if (largest > kTurnDeg) return;
    std::vector<Touch> changed = touches_;
    for (Touch& touch : changed)
      for (double& q : touch.joint_rad) q *= kDegPerRad;
    weigh(cell_, changed, [&](const Calibration&) {
      return fmt::format(
          "no joint angle is above {:.1f} deg, and read as radians the touches make sense; give "
          "them "
          "in degrees",
          largest);
    });
  }

  void signs() {
    for (std::size_t i = 0; i < cell_.robot.joints.size(); ++i) {
      std::vector<Touch> changed = touches_;
      for (Touch& touch : changed) touch.joint_rad[i] = -touch.joint_rad[i];
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
    for (std::size_t i = 1; i < cell_.robot.joints.size(); ++i) {  // the first one's is the frame's
      const Joint& joint = cell_.robot.joints[i];
      Cell loose = cell_;
      loose.robot.joints[i].tolerance_angle_rad = kAnyZeroRad;
      const Trial trial = attempt(loose, touches_);
      if (!trial.found) continue;
      double off_rad = 0.0;
      for (const ParameterResult& p : trial.found->parameters)
        if (p.name == joint.name + ".theta") off_rad = joint.sign * p.correction;
      if (!(std::abs(off_rad) > 2.0 * joint.tolerance_angle_rad)) continue;
      std::vector<Touch> changed = touches_;
      for (Touch& touch : changed) touch.joint_rad[i] += off_rad;
      weigh(cell_, changed, [&](const Calibration&) {
        return fmt::format(
            "with {:+.2f} deg added to all angles of {} the touches make sense; has it lost its "
            "mastering?",
            off_rad * 180.0 / std::numbers::pi, joint.name);
      });
    }
  }

  void exchanged() {
    for (std::size_t a = 0; a < cell_.robot.joints.size(); ++a)
      for (std::size_t b = a + 1; b < cell_.robot.joints.size(); ++b) {
        std::vector<Touch> changed = touches_;
        for (Touch& touch : changed) std::swap(touch.joint_rad[a], touch.joint_rad[b]);
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

  void tool() {
    constexpr double kTinyM = 5e-3;
    if (const double reach_m = cell_.tool.tcp.translation().norm();
        reach_m > 0.0 && reach_m < kTinyM) {
      Cell larger = cell_;
      larger.tool.tcp.translation() *= kMmPerM;
      if (larger.tool.length_m < kTinyM) larger.tool.length_m *= kMmPerM;
      weigh(larger, touches_, [&](const Calibration&) {
        return fmt::format(
            "the tool is {:.3f} mm long, and read as metres the touches make sense; give it in "
            "millimetres",
            reach_m * kMmPerM);
      });
    }
    Cell changed = cell_;
    changed.tool.tcp_sigma_m.setConstant(kAnyToolM);
    weigh(changed, touches_, [&](const Calibration& c) {
      Eigen::Vector3d off = Eigen::Vector3d::Zero();
      for (const ParameterResult& p : c.parameters)
        for (int axis = 0; axis < 3; ++axis)
          if (p.name == std::string("tool.") + "xyz"[axis]) off[axis] = p.correction * kMmPerM;
      return fmt::format(
          "with the tool's tip moved by about ({:.1f}, {:.1f}, {:.1f}) mm on the flange the "
          "touches "
          "make sense; is it the tool of the cell file?",
          off.x(), off.y(), off.z());
    });
  }

  void radius() {
    Cell changed = cell_;
    changed.radius_offset_sigma_m = kAnyRadiusM;
    weigh(changed, touches_, [&](const Calibration& c) {
      double rho = 0.0;
      for (const ParameterResult& p : c.parameters)
        if (p.name == "touch.rho") rho = p.correction * kMmPerM;
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
        double radius = 0.0;
        for (const ParameterResult& p : c.parameters)
          if (p.name == cell_.targets[t].id + ".radius") radius = p.correction * kMmPerM;
        return fmt::format(
            "with the diameter of {} {:+.2f} mm off what the cell file states the touches make "
            "sense; check its diameter_mm",
            cell_.targets[t].id, 2.0 * radius);
      });
    }
  }

  void lengths() {
    constexpr double kContradicts = 4.0;  // sigmas
    for (std::size_t k = 0; k < cell_.lengths.size(); ++k) {
      const CertifiedLength& length = cell_.lengths[k];
      Cell changed = cell_;
      changed.lengths.erase(changed.lengths.begin() + static_cast<std::ptrdiff_t>(k));
      const Trial trial = attempt(changed, touches_);
      if (!trial.found) continue;
      const auto found_m = found_length_m(*trial.found, length);
      if (!found_m) continue;
      const double sigma_m = std::hypot(length.sigma_m, length_sigma_m(*trial.found, length));
      if (!(std::abs(*found_m - length.length_m) > kContradicts * sigma_m)) continue;
      consider(trial, fmt::format("without the certified length of {} and {} the touches make "
                                  "sense, and they lie {:.2f} +- {:.2f} mm apart instead of the "
                                  "{:.3f} mm of the cell file; check it",
                                  length.from, length.to, *found_m * kMmPerM, sigma_m * kMmPerM,
                                  length.length_m * kMmPerM));
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

  /// From one of its touches on, a target stands elsewhere.
  void moved() {
    constexpr int kLeastEachSide = 4;
    for (const Target& target : cell_.targets) {
      std::vector<std::size_t> own;
      for (std::size_t i = 0; i < touches_.size(); ++i)
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
        for (std::size_t i = own[split]; i < renamed.size(); ++i)
          if (renamed[i].target == target.id) renamed[i].target = later.id;
        MovedTarget suspect;
        suspect.target = target.id;
        suspect.after_touch = own[split - 1] * stride_;
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
                  target.id, moved_by_m(before, after) * kMmPerM, own[split] * stride_ + 1);
            },
            suspect);
      }
    }
  }

  std::vector<Cause> best() {
    std::stable_sort(causes_.begin(), causes_.end(),
                     [](const Cause& a, const Cause& b) { return a.misfit < b.misfit; });
    std::vector<Cause> named;
    for (const Cause& cause : causes_)
      // A second one is worth naming where it explains the touches about as well.
      if (named.size() < kNamed && cause.misfit < 1.2 * causes_.front().misfit)
        named.push_back(cause);
    return named;
  }

 private:
  void weigh(const Cell& cell, const std::vector<Touch>& touches,
             const std::function<std::string(const Calibration&)>& words,
             const std::optional<MovedTarget>& moved = {}) {
    const Trial trial = attempt(cell, touches);
    if (trial.found) consider(trial, words(*trial.found), moved);
  }

  void consider(const Trial& trial, std::string words,
                const std::optional<MovedTarget>& moved = {}) {
    if (trial.misfit < kSense && trial.misfit < kExplained * stated_.misfit)
      causes_.push_back({trial.misfit, std::move(words), moved});
  }

  const Cell& cell_;
  std::size_t stride_;
  std::vector<Touch> touches_;  ///< every stride-th
  Trial stated_;
  std::vector<Cause> causes_;
};

std::vector<Cause> causes_of(const Cell& cell, const std::vector<Touch>& touches) {
  Search search(cell, touches);
  if (!search.needed()) return {};
  search.radians();
  search.signs();
  search.zeros();
  search.exchanged();
  search.swapped();
  search.tool();
  search.radius();
  search.lengths();
  search.moved();
  return search.best();
}

bool moved_alone(const std::vector<Cause>& causes) {
  return std::all_of(causes.begin(), causes.end(),
                     [](const Cause& c) { return c.moved.has_value(); });
}

}  // namespace

std::vector<std::string> likely_causes(const Cell& cell, const std::vector<Touch>& touches) {
  std::vector<std::string> words;
  for (Cause& cause : causes_of(cell, touches)) words.push_back(std::move(cause.words));
  return words;
}

Calibration identify(const Cell& cell, const std::vector<Touch>& touches,
                     const IdentifyOptions& options) {
  try {
    Calibration calibration = identify_as_stated(cell, touches, options);
    std::vector<Cause> causes;
    if (!calibration.verdict.publish) causes = causes_of(cell, touches);
    // Another mistake moves targets, too.
    const bool moved = moved_alone(causes);
    for (const Cause& cause : causes) {
      if (!moved || !has_a_centre(cell.targets[cell.target_index(cause.moved->target)].kind))
        continue;
      const bool suspected =
          std::any_of(calibration.moved.begin(), calibration.moved.end(),
                      [&](const MovedTarget& m) { return m.target == cause.moved->target; });
      if (!suspected) calibration.moved.push_back(*cause.moved);
    }
    if (moved)
      confirm_moves(cell, touches, options, calibration);
    else
      calibration.moved.clear();
    // What looks like a move, and would have been let through without it, may be another mistake.
    if (!calibration.moved.empty() && causes.empty()) {
      causes = causes_of(cell, touches);
      if (!causes.empty() && causes.front().moved) causes.clear();
    }
    if (calibration.moved.empty() || !moved_alone(causes))
      for (const Cause& cause : causes)
        calibration.verdict.reasons.push_back("likely cause: " + cause.words);
    return calibration;
  } catch (const IdentifyError& error) {
    const auto causes = likely_causes(cell, touches);
    if (causes.empty()) throw;
    throw IdentifyError(std::string(error.what()) + "; likely cause: " + causes.front());
  }
}

}  // namespace cellcal::calib
