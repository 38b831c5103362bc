#include "calib/identify/drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>

#include "calib/identify/dimensions.h"

namespace cellcal::calib {

namespace {

constexpr double kMmPerM = 1000.0;
constexpr double kTurnRad = 2.0 * std::numbers::pi, kDegPerRad = 360.0 / kTurnRad;
/// All sets of axes are tried of arms with no more.
constexpr std::size_t kMostJoints = 8;

using Change = std::function<void(Robot&)>;

std::vector<Change> zeros(const Robot& robot) {
  std::vector<Change> changes;
  for (std::size_t i = 0; i < robot.joints.size(); ++i)
    for (const int quarters : {-1, 1, 2})
      changes.push_back([i, quarters](Robot& r) {
        r.joints[i].offset_rad += quarters * kTurnRad / 4.0;
      });
  return changes;
}

std::vector<Change> twists(const Robot& robot) {
  std::vector<Change> changes;
  for (std::size_t i = 0; i < robot.joints.size(); ++i)
    if (robot.joints[i].alpha_rad != 0.0)
      changes.push_back([i](Robot& r) { r.joints[i].alpha_rad = -r.joints[i].alpha_rad; });
  return changes;
}

}  // namespace

std::vector<std::string> differences(const Robot& stated, const Robot& other) {
  constexpr double kSameM = 5e-5, kSameRad = 2e-4;
  std::vector<std::string> words;
  for (std::size_t i = 0; i < stated.joints.size(); ++i) {
    const Joint &is = stated.joints[i], &should = other.joints[i];
    const auto say = [&](const char* key, double is_in_file, double should_be) {
      words.push_back(
          fmt::format("{} of {} {:.6g} instead of {:.6g}", key, is.name, should_be, is_in_file));
    };
    const auto length = [&](const char* key, double is_m, double should_m) {
      if (std::abs(is_m - should_m) > kSameM) say(key, is_m * kMmPerM, should_m * kMmPerM);
    };
    const auto angle = [&](const char* key, double is_rad, double should_rad) {
      if (std::abs(std::remainder(should_rad - is_rad, kTurnRad)) > kSameRad)
        say(key, is_rad * kDegPerRad, std::remainder(should_rad, kTurnRad) * kDegPerRad);
    };
    if (is.sign != should.sign) say("sign", is.sign, should.sign);
    angle("offset_deg", is.offset_rad, should.offset_rad);
    length("d_mm", is.d_m, should.d_m);
    length("a_mm", is.a_m, should.a_m);
    angle("alpha_deg", is.alpha_rad, should.alpha_rad);
    angle("beta_deg", is.beta_rad, should.beta_rad);
  }
  return words;
}

std::vector<OtherDrawing> other_drawings(const Cell& cell, const std::vector<Touch>& touches) {
  std::vector<OtherDrawing> drawings;
  const auto look_at = [&](const Robot& robot) {
    Cell changed = cell;
    changed.robot = robot;
    drawings.push_back({robot, nominal_off_m(changed, touches)});
  };
  const std::size_t joints = cell.robot.joints.size();
  if (joints <= kMostJoints)
    for (unsigned set = 1; set < 1u << joints; ++set) {
      if (std::popcount(set) < 2) continue;
      Robot robot = cell.robot;
      for (std::size_t i = 0; i < joints; ++i)
        if ((set >> i & 1u) != 0) robot.joints[i].sign = -robot.joints[i].sign;
      look_at(robot);
    }
  for (const auto& changes : {zeros(cell.robot), twists(cell.robot)})
    for (std::size_t a = 0; a < changes.size(); ++a) {
      Robot one = cell.robot;
      changes[a](one);
      look_at(one);
      for (std::size_t b = a + 1; b < changes.size(); ++b) {
        Robot two = one;
        changes[b](two);
        look_at(two);
      }
    }
  std::stable_sort(drawings.begin(), drawings.end(),
                   [](const OtherDrawing& a, const OtherDrawing& b) { return a.off_m < b.off_m; });
  return drawings;
}

}  // namespace cellcal::calib
