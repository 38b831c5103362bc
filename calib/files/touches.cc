#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "calib/files/csv.h"
#include "calib/files/files.h"
#include "calib/files/shown.h"
#include "calib/files/touch_columns.h"
#include "calib/files/units.h"

namespace cellcal::calib {

namespace {

/// The robot file's limits are the catalogue's; a controller's own may be set wider. Beyond this it
/// is another joint, another unit or another robot.
constexpr double kLimitSlackRad = 10.0 * kRadPerDeg;
/// To be predicted any angle will do; this only catches nonsense.
constexpr double kAnyAngleRad = 3600.0 * kRadPerDeg;

std::vector<int> joint_columns(const CsvTable& table, const Robot& robot, const std::string& name) {
  std::vector<int> columns;
  for (const Joint& joint : robot.joints) {
    columns.push_back(table.find(joint.name));
    if (columns.back() < 0)
      throw FileError(name + ":" + std::to_string(table.header_line()) + ": no column \"" +
                      joint.name +
                      "\"; one column per joint is needed, named as in the robot file");
  }
  return columns;
}

std::vector<double> read_joints(const CsvTable& table, const std::vector<int>& columns) {
  std::vector<double> angles(columns.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    angles[i] = table.number(columns[i]) * kRadPerDeg;
    if (std::abs(angles[i]) > kAnyAngleRad)
      table.fail(columns[i], fmt::format("{} deg is out of range; angles are in degrees",
                                         shown(table.text(columns[i]))));
  }
  return angles;
}

/// The first angle that is outside its joint's limits, put into words as an error of its column.
std::optional<FileError> beyond_limits(const CsvTable& table, const Robot& robot,
                                       const std::vector<int>& columns,
                                       const std::vector<double>& angles) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const Joint& joint = robot.joints[i];
    if (angles[i] < joint.min_rad - kLimitSlackRad || angles[i] > joint.max_rad + kLimitSlackRad)
      return table.error(
          columns[i],
          fmt::format("{} deg is outside the joint's limits {:.6g} to {:.6g} deg in the "
                      "robot file; is it this arm's file, and are the columns the right joints'?",
                      shown(table.text(columns[i])), joint.min_rad * kDegPerRad,
                      joint.max_rad * kDegPerRad));
  }
  return std::nullopt;
}

std::vector<std::string> joint_names(const Robot& robot) {
  std::vector<std::string> names;
  for (const Joint& joint : robot.joints) names.push_back(joint.name);
  return names;
}

/// A tracker looks across a hall, not farther.
constexpr double kFarthestReadingM = 1e3;
constexpr double kLeastSigmaM = 1e-12, kMostSigmaM = 1.0;  // as in the cell file
constexpr const char* kReading[] = {"x_mm", "y_mm", "z_mm"};

bool has_reading(const Touch& touch) {
  return touch.tracker_m[0] != 0.0 || touch.tracker_m[1] != 0.0 || touch.tracker_m[2] != 0.0;
}

constexpr std::size_t kMaxRows = 2'000'000;

}  // namespace

std::vector<Touch> parse_touches(std::string_view text, const std::string& name, const Cell& cell) {
  CsvTable table(text, name);
  auto known = joint_names(cell.robot);
  for (const std::string_view column : kTouchColumns) known.emplace_back(column);
  table.refuse_unknown(known);
  const auto joints = joint_columns(table, cell.robot, name);
  const int target = table.find("target");
  if (target < 0)
    throw FileError(name + ":" + std::to_string(table.header_line()) +
                    ": no column \"target\"; it says which target each row touched");
  const int sigma = table.find("sigma_mm"), radius = table.find("radius_mm");
  const int set = table.find("set"), time = table.find("time");
  const int xyz[3] = {table.find("x_mm"), table.find("y_mm"), table.find("z_mm")};

  std::vector<Touch> touches;
  while (table.next()) {
    if (touches.size() == kMaxRows) throw FileError(name + ": more than 2000000 touches");
    Touch touch;
    touch.line = table.line();
    touch.joint_rad = read_joints(table, joints);
    if (const auto error = beyond_limits(table, cell.robot, joints, touch.joint_rad)) throw *error;
    touch.target = table.text(target);
    TargetKind kind;
    try {
      kind = cell.targets[cell.target_index(touch.target)].kind;
    } catch (const std::out_of_range&) {
      table.fail(target, "there is no target \"" + shown(touch.target) + "\" in the cell file");
    }
    if (sigma >= 0 && !table.text(sigma).empty()) {
      touch.sigma_m = table.number(sigma) / kMmPerM;
      if (touch.sigma_m < kLeastSigmaM || touch.sigma_m > kMostSigmaM)
        table.fail(sigma, "must be between 1e-9 and 1000 mm");
    }
    if (radius >= 0 && !table.text(radius).empty()) {
      touch.radius_m = table.number(radius) / kMmPerM;
      if (touch.radius_m <= 0.0 || touch.radius_m > kFarthestReadingM)
        table.fail(radius, fmt::format("must be above 0 and at most {:.0f} mm",
                                       kFarthestReadingM * kMmPerM));
    }
    if (kind == TargetKind::kWire && touch.radius_m <= 0.0)
      throw FileError(name + ":" + std::to_string(table.line()) +
                      ": radius_mm: missing; a touch of kind wire needs its length");
    for (int k = 0; k < 3; ++k) {
      if (xyz[k] >= 0 && !table.text(xyz[k]).empty()) {
        touch.tracker_m[k] = table.number(xyz[k]) / kMmPerM;
        if (std::abs(touch.tracker_m[k]) > kFarthestReadingM)
          table.fail(xyz[k], "is out of range, -1e6 to 1e6");
      } else if (kind == TargetKind::kTracker) {
        throw FileError(name + ":" + std::to_string(table.line()) + ": " + kReading[k] +
                        ": missing; a touch of kind tracker needs its reading x_mm, y_mm, z_mm");
      }
    }
    if (set >= 0) {
      const std::string_view word = table.text(set);
      if (word == "check")
        touch.set = TouchSet::kCheck;
      else if (word != "fit" && !word.empty())
        table.fail(set, "must be fit or check");
    }
    if (time >= 0) touch.time = table.text(time);
    touches.push_back(std::move(touch));
  }
  return touches;
}

std::vector<Touch> load_touches(const std::filesystem::path& path, const Cell& cell) {
  return parse_touches(read_file(path), path.string(), cell);
}

std::string touch_words(std::size_t index, const Touch& touch) {
  return fmt::format("touch {}{}", index + 1,
                     touch.line > 0 ? fmt::format(" (line {})", touch.line) : "");
}

std::string format_touches(const std::vector<Touch>& touches, const Robot& robot) {
  bool sigmas = false, radii = false, readings = false, times = false;
  for (const Touch& touch : touches) {
    sigmas = sigmas || touch.sigma_m > 0.0;
    radii = radii || touch.radius_m > 0.0;
    readings = readings || has_reading(touch);
    times = times || !touch.time.empty();
  }
  std::string out;
  for (const Joint& joint : robot.joints) out += joint.name + ",";
  out += "target,set";
  if (sigmas) out += ",sigma_mm";
  if (radii) out += ",radius_mm";
  if (readings) out += ",x_mm,y_mm,z_mm";
  if (times) out += ",time";
  out += "\n";
  for (const Touch& touch : touches) {
    // Nine decimals of a degree are 2e-8 mm at 1.4 m: nothing is lost.
    for (const double angle : touch.joint_rad) out += fmt::format("{:.9f},", angle * kDegPerRad);
    out += touch.target + (touch.set == TouchSet::kCheck ? ",check" : ",fit");
    if (sigmas) out += touch.sigma_m > 0.0 ? fmt::format(",{:.6g}", touch.sigma_m * kMmPerM) : ",";
    if (radii) out += touch.radius_m > 0.0 ? fmt::format(",{:.9g}", touch.radius_m * kMmPerM) : ",";
    // Zeros, too: a tracker's own origin is a reading.
    if (readings)
      for (const double m : touch.tracker_m) out += fmt::format(",{:.9g}", m * kMmPerM);
    if (times) out += "," + touch.time;
    out += "\n";
  }
  return out;
}

JointRows load_joints(const std::filesystem::path& path, const Robot& robot) {
  const std::string text = read_file(path);
  CsvTable table(text, path.string());
  table.refuse_unknown(joint_names(robot));
  const auto columns = joint_columns(table, robot, path.string());
  JointRows rows;
  while (table.next()) {
    if (rows.joint_rad.size() == kMaxRows)
      throw FileError(path.string() + ": more than 2000000 rows");
    rows.joint_rad.push_back(read_joints(table, columns));
    const auto error = beyond_limits(table, robot, columns, rows.joint_rad.back());
    if (!error) continue;
    constexpr std::size_t kInWords = 5;
    if (++rows.beyond_limits <= kInWords) rows.beyond_limits_words.emplace_back(error->what());
  }
  return rows;
}

}  // namespace cellcal::calib
