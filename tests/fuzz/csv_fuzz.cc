// Any text as a table of touches: refused with FileError, or read such that its written form reads
// the same again. Also replayed over csv_corpus as an ordinary test.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "calib/files/files.h"

namespace {

using namespace cellcal::calib;  // NOLINT: a fuzz target's own file

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

Cell make_cell(bool with_positioner) {
  Cell cell;
  for (const char* name : {"A1", "A2"}) {
    Joint joint;
    joint.name = name;
    joint.min_rad = -3.0;
    joint.max_rad = 3.0;
    cell.robot.joints.push_back(joint);
  }
  for (const char* name : {"E1", "E2"}) {
    PositionerAxis axis;
    axis.name = name;
    axis.min_rad = -3.0;
    axis.max_rad = 3.0;
    if (with_positioner) cell.robot.positioner.push_back(axis);
  }
  cell.targets.resize(3);
  cell.targets[0].id = "S1";
  cell.targets[1].id = "W";
  cell.targets[1].kind = TargetKind::kWire;
  cell.targets[2].id = "L";
  cell.targets[2].kind = TargetKind::kTracker;
  cell.tool.id = "T1";
  cell.other_tools.resize(1);
  cell.other_tools[0].id = "T2";
  return cell;
}

void as_touches_of(const Cell& cell, std::string_view text) {
  std::vector<Touch> touches;
  try {
    touches = parse_touches(text, "fuzz.csv", cell);
  } catch (const FileError&) {
    return;
  }
  for (const Touch& touch : touches) {
    require(touch.joint_rad.size() == 2, "a touch has an angle per joint");
    for (const double angle : touch.joint_rad)
      require(std::isfinite(angle) && std::abs(angle) < 3.2, "angles are within the limits");
    require(touch.positioner_rad.size() == cell.robot.positioner.size(), "and one per axis");
    for (const double angle : touch.positioner_rad)
      require(std::isfinite(angle) && std::abs(angle) < 3.2, "the positioner's, too");
    require(std::isfinite(touch.sigma_m) && touch.sigma_m >= 0.0, "sigma");
    require(std::isfinite(touch.radius_m) && touch.radius_m >= 0.0, "radius");
    require(touch.tool.empty() || touch.tool == "T2", "a tool of the cell");
    require(!touch.temperature_c || std::abs(*touch.temperature_c) <= 200.0, "temperature");
    require(std::isfinite(touch.turn_sigma_rad) && touch.turn_sigma_rad >= 0.0, "sigma of turns");
    if (touch.tracker_abc_rad) {
      require(touch.target == "L" && touch.turn_sigma_rad > 0.0, "turns are a tracker's");
      for (const double angle : *touch.tracker_abc_rad) require(std::abs(angle) < 63.0, "turns");
    }
    for (const double m : touch.tracker_m) require(std::abs(m) <= 1e3, "readings");
  }
  const auto again = parse_touches(format_touches(touches, cell.robot), "again.csv", cell);
  // Rounded angles may be those of one stand.
  require(again.size() <= touches.size(), "what was read can be written and read");
  if (again.size() < touches.size()) return;
  for (std::size_t i = 0; i < again.size(); ++i) {
    require(again[i].target == touches[i].target && again[i].set == touches[i].set &&
                again[i].time == touches[i].time && again[i].tool == touches[i].tool &&
                again[i].temperature_c.has_value() == touches[i].temperature_c.has_value() &&
                again[i].tracker_abc_rad.has_value() == touches[i].tracker_abc_rad.has_value(),
            "words survive");
    for (std::size_t j = 0; j < 2; ++j)
      require(std::abs(again[i].joint_rad[j] - touches[i].joint_rad[j]) < 1e-10,
              "angles survive to a billionth of a degree");
    for (std::size_t j = 0; j < touches[i].positioner_rad.size(); ++j)
      require(std::abs(again[i].positioner_rad[j] - touches[i].positioner_rad[j]) < 1e-10,
              "the positioner's survive, too");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Cell kArmAlone = make_cell(false), kWithPositioner = make_cell(true);
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  as_touches_of(kArmAlone, text);
  as_touches_of(kWithPositioner, text);
  return 0;
}
