#include "calib/diagnose/axis_convention.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "calib/diagnose/dimensions.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {
constexpr double kHalfTurnRad = std::numbers::pi, kTurnRad = 2.0 * kHalfTurnRad;
/// All sets of axes are tried of arms with no more.
constexpr std::size_t kMostJoints = 8;

struct Change {
  std::size_t joint;
  std::function<void(Joint&)> make;
};

std::vector<Change> signs(const Robot& robot) {
  std::vector<Change> changes;
  for (std::size_t i = 0; i < robot.joints.size(); ++i)
    changes.push_back({i, [](Joint& joint) { joint.sign = -joint.sign; }});
  return changes;
}

std::vector<Change> zeros(const Robot& robot) {
  std::vector<Change> changes;
  for (std::size_t i = 0; i < robot.joints.size(); ++i)
    for (const int quarters : {-1, 1, 2})
      changes.push_back(
          {i, [quarters](Joint& joint) { joint.offset_rad += quarters * kTurnRad / 4.0; }});
  return changes;
}

std::vector<Change> twists(const Robot& robot) {
  std::vector<Change> changes;
  for (std::size_t i = 0; i < robot.joints.size(); ++i)
    if (robot.joints[i].alpha_rad != 0.0)
      changes.push_back({i, [](Joint& joint) { joint.alpha_rad = -joint.alpha_rad; }});
  return changes;
}

/// Up to `most` changes at once, of different joints each.
class Combinations {
 public:
  Combinations(const Cell& cell, const std::vector<Touch>& touches)
      : cell_(cell), touches_(touches) {}

  std::vector<OtherDrawing> of(const std::vector<Change>& changes, std::size_t most) {
    drawings_.clear();
    add(cell_.robot, changes, 0, 0, most);
    return std::move(drawings_);
  }

 private:
  void add(const Robot& robot, const std::vector<Change>& changes, std::size_t first, int made,
           std::size_t most) {
    for (std::size_t k = first; k < changes.size(); ++k) {
      Cell changed = cell_;
      changed.robot = robot;
      changes[k].make(changed.robot.joints[changes[k].joint]);
      const double off_m = nominal_off_m(changed, touches_);
      drawings_.push_back({changed.robot, made + 1, off_m});
      std::size_t next = k + 1;
      while (next < changes.size() && changes[next].joint == changes[k].joint) ++next;
      if (static_cast<std::size_t>(made) + 1 < most)
        add(changed.robot, changes, next, made + 1, most);
    }
  }

  const Cell& cell_;
  const std::vector<Touch>& touches_;
  std::vector<OtherDrawing> drawings_;
};

}  // namespace

std::vector<FindingPart> differences(const Robot& stated, const Robot& other) {
  constexpr double kSameM = 5e-5, kSameRad = 2e-4;
  std::vector<FindingPart> parts;
  for (std::size_t i = 0; i < stated.joints.size(); ++i) {
    const Joint &is = stated.joints[i], &should = other.joints[i];
    const auto add = [&](const char* key, const char* unit, double is_in_file, double should_be) {
      parts.push_back(
          {about_joint(is.name), {{key, should_be, unit}, {"stated", is_in_file, unit}}});
    };
    const auto length = [&](const char* key, double is_m, double should_m) {
      if (std::abs(is_m - should_m) > kSameM) add(key, "mm", is_m * kMmPerM, should_m * kMmPerM);
    };
    const auto angle = [&](const char* key, double is_rad, double should_rad) {
      if (!(std::abs(std::remainder(should_rad - is_rad, kTurnRad)) > kSameRad)) return;
      const double turn = std::remainder(should_rad, kTurnRad);
      add(key, "deg", is_rad * kDegPerRad,
          (turn < kSameRad - kHalfTurnRad ? kHalfTurnRad : turn) * kDegPerRad);
    };
    if (is.sign != should.sign) add("sign", "", is.sign, should.sign);
    angle("offset_deg", is.offset_rad, should.offset_rad);
    length("d_mm", is.d_m, should.d_m);
    length("a_mm", is.a_m, should.a_m);
    angle("alpha_deg", is.alpha_rad, should.alpha_rad);
    angle("beta_deg", is.beta_rad, should.beta_rad);
  }
  return parts;
}

std::vector<OtherDrawing> other_drawings(const Cell& cell, const std::vector<Touch>& touches) {
  // What turns all targets with it, or none, changes nothing, and comes no nearer.
  constexpr double kNoNearer = 0.9;
  const std::size_t joints = cell.robot.joints.size();
  Combinations combinations(cell, touches);
  std::vector<OtherDrawing> drawings;
  const auto take = [&](const std::vector<Change>& changes, std::size_t most, int least) {
    const std::vector<OtherDrawing> all = combinations.of(changes, most);
    for (const OtherDrawing& drawing : all) {
      if (drawing.changes < least) continue;
      if (std::none_of(all.begin(), all.end(), [&](const OtherDrawing& other) {
            return other.changes < drawing.changes && drawing.off_m > kNoNearer * other.off_m;
          }))
        drawings.push_back(drawing);
    }
  };
  take(signs(cell.robot), joints <= kMostJoints ? joints : 2, 2);
  take(zeros(cell.robot), 2, 1);
  take(twists(cell.robot), 2, 1);
  std::stable_sort(drawings.begin(), drawings.end(),
                   [](const OtherDrawing& a, const OtherDrawing& b) { return a.off_m < b.off_m; });
  return drawings;
}

}  // namespace cellcal::calib
