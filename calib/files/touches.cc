#include "calib/files/touches.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <optional>
#include <ranges>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/model/iso_time.h"

namespace cellcal::calib {

namespace {

/// The robot file states catalogue limits; a controller's own may be wider. Angles beyond this
/// slack indicate another joint, unit or robot.
constexpr double kLimitSlackRad = 10.0 * kRadPerDeg;
constexpr double kLimitSlackM = 0.1;  ///< of a linear unit
/// Error for the first angle outside its joint's limits, at its column.
std::optional<FileError> beyond_limits(const CsvTable& table, const Robot& robot,
                                       const std::vector<int>& columns,
                                       const std::vector<double>& angles) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const Joint& joint = robot.joints[i];
    const double slack = joint.is_prismatic() ? kLimitSlackM : kLimitSlackRad;
    const JointUnit unit = unit_of(joint);
    if (angles[i] < joint.min_rad - slack || angles[i] > joint.max_rad + slack)
      return table.error(
          columns[i],
          fmt::format("{0} {1} is outside the joint's limits {2:.6g} to {3:.6g} {1} in the "
                      "robot file. Check that it is this arm's file, and the order of the columns",
                      shown(table.text(columns[i])), unit.name, joint.min_rad * unit.per_si,
                      joint.max_rad * unit.per_si));
  }
  return std::nullopt;
}

/// The positioner's axes as turning joints: their columns are read as those.
Robot axes_of_positioner(const Robot& robot) {
  Robot axes;
  for (const PositionerAxis& axis : robot.positioner) {
    Joint joint;
    joint.name = axis.name;
    joint.min_rad = axis.min_rad;
    joint.max_rad = axis.max_rad;
    axes.joints.push_back(std::move(joint));
  }
  return axes;
}

/// Maximum range of a tracker.
constexpr double kFarthestReadingM = 1e3;
constexpr const char* kReading[] = {"x_mm", "y_mm", "z_mm"};
constexpr const char* kTurns[] = {"a_deg", "b_deg", "c_deg"};
constexpr const char* kQuaternion[] = {"qw", "qx", "qy", "qz"};
constexpr const char* kApproach[] = {"approach_x", "approach_y", "approach_z"};

/// A unit vector of six decimals has this norm; coarser values are still directions.
constexpr double kUnitSlack = 0.01;

std::array<int, 4> quaternion_columns(const CsvTable& table) {
  std::array<int, 4> columns{};
  std::ranges::transform(kQuaternion, columns.begin(),
                         [&](const char* name) { return table.find(name); });
  return columns;
}

/// The row's rotation as A, B, C [deg].
std::array<double, 3> abc_of_quaternion(const CsvTable& table, const std::array<int, 4>& columns) {
  std::array<double, 4> q{};
  for (std::size_t k = 0; k < q.size(); ++k) {
    if (columns[k] < 0)
      table.fail_header(std::string(kQuaternion[k]) + ": missing; a quaternion is qw,qx,qy,qz");
    q[k] = table.number(columns[k]);
  }
  const Eigen::Quaterniond turn(q[0], q[1], q[2], q[3]);
  if (std::abs(turn.norm() - 1.0) > kUnitSlack)
    table.fail(columns[0], fmt::format("qw,qx,qy,qz have length {:.3g}, but a quaternion of a "
                                       "rotation has length 1",
                                       turn.norm()));
  return to_frame(Eigen::Isometry3d(turn.normalized())).abc_deg;
}

bool has_reading(const Touch& touch) {
  return touch.tracker_m[0] != 0.0 || touch.tracker_m[1] != 0.0 || touch.tracker_m[2] != 0.0;
}

constexpr std::size_t kMaxRows = 2'000'000;

/// Column of a linear unit whose header states the unit.
std::string with_unit(const Joint& joint) { return joint.name + "_mm"; }

/// Columns other than the joints', and how they are read.
class TouchColumns {
 public:
  TouchColumns(const CsvTable& table, const Cell& cell) : table_(table) {
    const bool one_tracker =
        cell.targets.size() == 1 && cell.targets[0].kind == TargetKind::kTracker;
    if (target_ < 0 && !one_tracker)
      table.fail_header("no column \"target\"; it names the target of each row");
  }

  void read(const Cell& cell, Touch& touch) const {
    touch.target = target_ < 0 ? cell.targets[0].id : table_.text(target_);
    TargetKind kind;
    try {
      kind = cell.targets[cell.target_index(touch.target)].kind;
    } catch (const std::out_of_range&) {
      table_.fail(target_, "there is no target \"" + shown(touch.target) + "\" in the cell file");
    }
    read_tool(cell, touch);
    read_load(cell, touch);
    if (stated(sigma_)) touch.sigma_m = within(sigma_, 1e-9, 1e3, "1e-9 and 1000 mm") / kMmPerM;
    if (stated(radius_)) {
      touch.radius_m = table_.number(radius_) / kMmPerM;
      if (touch.radius_m <= 0.0 || touch.radius_m > kFarthestReadingM)
        table_.fail(radius_, fmt::format("must be above 0 and at most {:.0f} mm",
                                         kFarthestReadingM * kMmPerM));
    }
    if (kind == TargetKind::kWire && touch.radius_m <= 0.0)
      missing("radius_mm", "a touch of kind wire needs its length");
    read_place(kind, touch);
    read_turns(cell, kind, touch);
    read_approach(touch);
    if (set_ >= 0) {
      const std::string_view word = table_.text(set_);
      if (word == "check")
        touch.set = TouchSet::kCheck;
      else if (word != "fit" && !word.empty())
        table_.fail(set_, "must be fit or check");
    }
    if (stated(time_)) {
      touch.time = table_.text(time_);
      if (!seconds_of(touch.time))
        table_.fail(time_,
                    "\"" + shown(touch.time) +
                        "\" is not an ISO 8601 time, such as 2024-09-24T10:00:00Z. Without the "
                        "column the rows' order counts");
      std::ranges::replace(touch.time, ',', '.');
    }
    if (stated(temperature_))
      touch.temperature_c = within(temperature_, -100.0, 200.0, "-100 and 200 degrees Celsius");
  }

 private:
  bool stated(int column) const { return column >= 0 && !table_.text(column).empty(); }

  double within(int column, double least, double most, const char* words) const {
    const double value = table_.number(column);
    if (value < least || value > most) table_.fail(column, std::string("must be between ") + words);
    return value;
  }

  [[noreturn]] void missing(const char* column, const char* why) const {
    table_.fail_row(std::string(column) + ": missing; " + why);
  }

  void read_tool(const Cell& cell, Touch& touch) const {
    if (!stated(tool_)) return;
    const std::string_view id = table_.text(tool_);
    if (id == cell.tool.name()) return;  // the first tool has no column
    for (const Tool& tool : cell.other_tools)
      if (tool.id == id) {
        touch.tool = id;
        return;
      }
    table_.fail(tool_, "there is no tool \"" + shown(id) + "\" in the cell file");
  }

  void read_load(const Cell& cell, Touch& touch) const {
    if (!stated(load_)) return;
    touch.load = table_.text(load_);
    if (std::ranges::find(cell.loads, touch.load, &Load::id) == cell.loads.end())
      table_.fail(load_, "there is no [[load]] \"" + shown(touch.load) +
                             "\" in the cell file. Without load leave it empty");
  }

  void read_place(TargetKind kind, Touch& touch) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (stated(xyz_[k])) {
        touch.tracker_m[k] = table_.number(xyz_[k]) / kMmPerM;
        if (std::abs(touch.tracker_m[k]) > kFarthestReadingM)
          table_.fail(xyz_[k], "is out of range, -1e6 to 1e6");
      } else if (kind == TargetKind::kTracker) {
        missing(kReading[k],
                "a touch of kind tracker needs its reading x_mm, y_mm, z_mm. Leave "
                "out rows in which nothing was measured");
      }
    }
  }

  /// All three or none.
  void read_turns(const Cell& cell, TargetKind kind, Touch& touch) const {
    if (stated(turn_sigma_))
      touch.turn_sigma_rad = within(turn_sigma_, 1e-6, 90.0, "1e-6 and 90 deg") * kRadPerDeg;
    const bool quaternion = std::ranges::any_of(q_, [&](int column) { return stated(column); });
    if (!stated(abc_[0]) && !stated(abc_[1]) && !stated(abc_[2]) && !quaternion) return;
    if (kind != TargetKind::kTracker)
      table_.fail_row(
          "a_deg, b_deg, c_deg, qw, qx, qy, qz: only a target of kind tracker has turns; "
          "leave them empty");
    std::array<double, 3> abc{};
    if (quaternion) {
      if (stated(abc_[0]) || stated(abc_[1]) || stated(abc_[2]))
        table_.fail_row("both a_deg,b_deg,c_deg and a quaternion; one of them is needed");
      abc = abc_of_quaternion(table_, q_);
      for (double& angle : abc) angle *= kRadPerDeg;
    }
    for (std::size_t k = 0; k < 3 && !quaternion; ++k) {
      if (!stated(abc_[k])) missing(kTurns[k], "a_deg, b_deg and c_deg are stated together");
      abc[k] = table_.number(abc_[k]) * kRadPerDeg;
      if (std::abs(abc[k]) > kAnyAngleRad) table_.fail(abc_[k], "is out of range, -3600 to 3600");
    }
    if (touch.turn_sigma_rad == 0.0 && cell.turn_sigma_rad == 0.0)
      missing(
          "turn_sigma_deg",
          "its rotations have no uncertainty. State it here, or for all in [touch] of the cell file");
    touch.tracker_abc_rad = abc;
  }

  /// All three or none.
  void read_approach(Touch& touch) const {
    if (stated(speed_))
      touch.speed_m_s = within(speed_, 1e-3, 1e3, "0.001 and 1000 mm/s") / kMmPerM;
    if (!stated(approach_[0]) && !stated(approach_[1]) && !stated(approach_[2])) return;
    std::array<double, 3> along{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (!stated(approach_[k]))
        missing(kApproach[k], "approach_x, approach_y and approach_z are stated together");
      along[k] = within(approach_[k], -1.0 - kUnitSlack, 1.0 + kUnitSlack, "-1 and 1");
    }
    const double length = std::hypot(along[0], along[1], along[2]);
    if (std::abs(length - 1.0) > kUnitSlack)
      table_.fail(approach_[0],
                  fmt::format("approach_x, approach_y, approach_z have length {:.3g}, but a "
                              "direction in the base frame has length 1",
                              length));
    for (double& component : along) component /= length;
    touch.approach = along;
  }

  std::array<int, 3> three(const char* const (&columns)[3]) const {
    return {table_.find(columns[0]), table_.find(columns[1]), table_.find(columns[2])};
  }

  const CsvTable& table_;
  const int target_ = table_.find("target"), tool_ = table_.find("tool"),
            load_ = table_.find("load"), sigma_ = table_.find("sigma_mm"),
            radius_ = table_.find("radius_mm"), set_ = table_.find("set"),
            time_ = table_.find("time"), turn_sigma_ = table_.find("turn_sigma_deg"),
            temperature_ = table_.find("temperature_c"), speed_ = table_.find("speed_mm_s");
  const std::array<int, 4> q_ = quaternion_columns(table_);
  const std::array<int, 3> xyz_ = three(kReading), abc_ = three(kTurns),
                           approach_ = three(kApproach);
};

std::string joints_row(const Robot& robot) {
  std::string row;
  for (const Joint& joint : robot.joints) row += (row.empty() ? "" : ",") + joint.name;
  return row;
}

constexpr std::array<const char*, 6> kPose = {"x_mm", "y_mm", "z_mm", "a_deg", "b_deg", "c_deg"};
constexpr std::size_t kMaxPoses = 2'000'000;
/// Scatter (1 sigma of a coordinate) below which no arm returns to a posture.
constexpr double kNoArmReturnsM = 5e-6;

bool of_one_stand(const Touch& a, const Touch& b) {
  return a.joint_rad == b.joint_rad && a.positioner_rad == b.positioner_rad &&
         a.target == b.target && a.tool == b.tool && a.load == b.load && a.set == b.set &&
         a.sigma_m == b.sigma_m;
}

/// Consecutive readings of a tracker at the same angles that scatter less than any arm returns are of an arm
/// at rest. They share its errors, ripple included, and count as one touch: their mean.
void average_stands(const Cell& cell, std::vector<Touch>& touches) {
  std::vector<Touch> stands;
  double sum_m2 = 0.0;
  std::size_t degrees_of_freedom = 0;
  for (auto first = touches.begin(), next = first; first != touches.end(); first = next) {
    const bool tracked =
        cell.targets[cell.target_index(first->target)].kind == TargetKind::kTracker;
    next = std::find_if(first + 1, touches.end(), [&](const Touch& other) {
      return !tracked || !of_one_stand(*first, other);
    });
    Touch& stand = stands.emplace_back(*first);
    const auto count = next - first;
    if (count == 1) continue;
    stand.readings = static_cast<int>(count);
    for (int k = 0; k < 3; ++k) {
      double sum = 0.0;
      for (auto one = first; one != next; ++one) sum += one->tracker_m[k];
      stand.tracker_m[k] = sum / static_cast<double>(count);
      for (auto one = first; one != next; ++one)
        sum_m2 += std::pow(one->tracker_m[k] - stand.tracker_m[k], 2);
      degrees_of_freedom += static_cast<std::size_t>(count - 1);
    }
  }
  if (sum_m2 < static_cast<double>(degrees_of_freedom) * std::pow(kNoArmReturnsM, 2))
    touches = std::move(stands);
}

/// Beyond the reach and the turns of any arm: detects other units.
constexpr double kFarthestMm = 1e5, kMostDeg = 3600.0;

/// `quaternion`: in place of the angles.
std::array<int, 6> pose_columns(const CsvTable& table, bool quaternion) {
  std::array<int, 6> columns{};
  for (std::size_t i = 0; i < kPose.size(); ++i) {
    columns[i] = table.find(kPose[i]);
    if (columns[i] < 0 && !(quaternion && i >= 3))
      table.fail_header(
          fmt::format("no column \"{}\"; x_mm,y_mm,z_mm,a_deg,b_deg,c_deg are needed (or "
                      "qw,qx,qy,qz), in the robot's base frame",
                      kPose[i]));
  }
  return columns;
}

double bounded(const CsvTable& table, int column, double most, const char* unit) {
  const double value = table.number(column);
  if (std::abs(value) > most)
    table.fail(column, fmt::format("{} {} is out of range", shown(table.text(column)), unit));
  return value;
}

/// A column written if any touch has a value for it.
struct Written {
  const char* head;
  std::function<bool(const Touch&)> has;
  std::function<std::string(const Touch&)> field;
};

const std::vector<Written>& written_columns() {
  static const std::vector<Written> kColumns = {
      {"tool", [](const Touch& t) { return !t.tool.empty(); },
       [](const Touch& t) { return t.tool; }},
      {"load", [](const Touch& t) { return !t.load.empty(); },
       [](const Touch& t) { return t.load; }},
      {"sigma_mm", [](const Touch& t) { return t.sigma_m > 0.0; },
       [](const Touch& t) { return fmt::format("{:.6g}", t.sigma_m * kMmPerM); }},
      {"radius_mm", [](const Touch& t) { return t.radius_m > 0.0; },
       [](const Touch& t) { return fmt::format("{:.9g}", t.radius_m * kMmPerM); }},
      {"x_mm,y_mm,z_mm", has_reading,
       [](const Touch& t) {
         return fmt::format("{:.9g},{:.9g},{:.9g}", t.tracker_m[0] * kMmPerM,
                            t.tracker_m[1] * kMmPerM, t.tracker_m[2] * kMmPerM);
       }},
      {"a_deg,b_deg,c_deg", [](const Touch& t) { return t.tracker_abc_rad.has_value(); },
       [](const Touch& t) {
         const auto& abc = *t.tracker_abc_rad;
         return fmt::format("{:.9f},{:.9f},{:.9f}", abc[0] * kDegPerRad, abc[1] * kDegPerRad,
                            abc[2] * kDegPerRad);
       }},
      {"turn_sigma_deg", [](const Touch& t) { return t.turn_sigma_rad > 0.0; },
       [](const Touch& t) { return fmt::format("{:.6g}", t.turn_sigma_rad * kDegPerRad); }},
      {"temperature_c", [](const Touch& t) { return t.temperature_c.has_value(); },
       [](const Touch& t) { return fmt::format("{:.6g}", *t.temperature_c); }},
      {"speed_mm_s", [](const Touch& t) { return t.speed_m_s > 0.0; },
       [](const Touch& t) { return fmt::format("{:.6g}", t.speed_m_s * kMmPerM); }},
      {"approach_x,approach_y,approach_z", [](const Touch& t) { return t.approach.has_value(); },
       [](const Touch& t) {
         const auto& along = *t.approach;
         return fmt::format("{:.9f},{:.9f},{:.9f}", along[0], along[1], along[2]);
       }},
      {"time", [](const Touch& t) { return !t.time.empty(); },
       [](const Touch& t) { return t.time; }}};
  return kColumns;
}

/// Empty fields for a touch without the value; zeros for a reading, since a tracker's own origin is
/// a valid one.
std::string empty_fields(const Written& column) {
  const std::string_view head(column.head);
  if (head.starts_with("x_mm")) return "0,0,0";
  return std::string(static_cast<std::size_t>(std::count(head.begin(), head.end(), ',')), ',');
}

/// Columns of joints that a table has all of, or none.
std::vector<int> columns_or_none(const CsvTable& table, const Robot& robot) {
  const bool any = std::ranges::any_of(
      joint_names(robot), [&](const std::string& joint) { return table.find(joint) >= 0; });
  return any ? joint_columns(table, robot) : std::vector<int>{};
}

}  // namespace

std::vector<Touch> parse_touches(std::string_view text, const std::string& name, const Cell& cell) {
  CsvTable table(text, name, joints_row(cell.robot) + ",target");
  table.take_hash_as_comment();
  table.take_no_rows();  // as a session without touches writes it
  auto known = joint_names(cell.robot);
  const Robot positioner = axes_of_positioner(cell.robot);
  std::ranges::move(joint_names(positioner), std::back_inserter(known));
  for (const std::string_view column : kTouchColumns) known.emplace_back(column);
  take_for_joints(table, cell.robot);
  table.refuse_unknown(known);
  const auto joints = joint_columns(table, cell.robot);
  const auto axes = joint_columns(table, positioner);
  const TouchColumns columns(table, cell);
  std::vector<Touch> touches;
  while (table.next()) {
    if (touches.size() == kMaxRows) throw FileError(name, ": more than 2000000 touches");
    Touch touch;
    touch.line = table.line();
    touch.joint_rad = read_joints(table, cell.robot, joints);
    if (const auto error = beyond_limits(table, cell.robot, joints, touch.joint_rad)) throw *error;
    touch.positioner_rad = read_joints(table, positioner, axes);
    if (const auto error = beyond_limits(table, positioner, axes, touch.positioner_rad))
      throw *error;
    columns.read(cell, touch);
    touches.push_back(std::move(touch));
  }
  average_stands(cell, touches);
  return touches;
}

std::vector<Touch> load_touches(const std::filesystem::path& path, const Cell& cell) {
  return parse_touches(read_file(path), path.string(), cell);
}

std::string format_touches(const std::vector<Touch>& touches, const Robot& robot) {
  std::vector<const Written*> columns;
  for (const Written& column : written_columns())
    if (std::any_of(touches.begin(), touches.end(), column.has)) columns.push_back(&column);
  std::string out;
  for (const Joint& joint : robot.joints) out += joint.name + ",";
  for (const PositionerAxis& axis : robot.positioner) out += axis.name + ",";
  out += "target,set";
  for (const Written* column : columns) out += std::string(",") + column->head;
  out += "\n";
  for (const Touch& touch : touches) {
    // Nine decimals of a degree are 2e-8 mm at 1.4 m: lossless.
    for (std::size_t i = 0; i < touch.joint_rad.size(); ++i)
      out += fmt::format("{:.9f},", touch.joint_rad[i] * unit_of(robot.joints[i]).per_si);
    for (const double angle : touch.positioner_rad)
      out += fmt::format("{:.9f},", angle * kDegPerRad);
    out += touch.target + "," + to_string(touch.set);
    for (const Written* column : columns)
      out += "," + (column->has(touch) ? column->field(touch) : empty_fields(*column));
    out += "\n";
  }
  return out;
}

JointRows load_joints(const std::filesystem::path& path, const Robot& robot) {
  return parse_joints(read_file(path), path.string(), robot);
}

JointRows parse_joints(std::string_view text, const std::string& name, const Robot& robot) {
  CsvTable table(text, name, joints_row(robot));
  auto known = joint_names(robot);
  const Robot positioner = axes_of_positioner(robot);
  std::ranges::move(joint_names(positioner), std::back_inserter(known));
  take_for_joints(table, robot);
  table.refuse_unknown(known);
  const auto columns = joint_columns(table, robot);
  const auto axes = columns_or_none(table, positioner);
  JointRows rows;
  while (table.next()) {
    if (rows.joint_rad.size() == kMaxRows) throw FileError(name, ": more than 2000000 rows");
    rows.joint_rad.push_back(read_joints(table, robot, columns));
    auto error = beyond_limits(table, robot, columns, rows.joint_rad.back());
    if (!axes.empty()) rows.positioner_rad.push_back(read_joints(table, positioner, axes));
    if (!axes.empty() && !error)
      error = beyond_limits(table, positioner, axes, rows.positioner_rad.back());
    if (!error) continue;
    constexpr std::size_t kInWords = 5;
    if (++rows.beyond_limits <= kInWords) rows.beyond_limits_words.emplace_back(error->what());
  }
  return rows;
}

void take_for_joints(CsvTable& table, const Robot& robot) {
  std::vector<std::string> turning;
  for (std::size_t i = robot.first_turning(); i < robot.joints.size(); ++i)
    turning.push_back(robot.joints[i].name);
  table.take_for_joints(turning);
}

std::vector<int> joint_columns(const CsvTable& table, const Robot& robot) {
  std::vector<int> columns;
  for (const Joint& joint : robot.joints) {
    columns.push_back(table.find(joint.name));
    if (const int other = joint.is_prismatic() ? table.find(with_unit(joint)) : -1; other >= 0) {
      if (columns.back() >= 0 && columns.back() != other)
        table.fail_header(
            fmt::format("columns \"{}\" and \"{}\" are the same", joint.name, with_unit(joint)));
      columns.back() = other;
    }
    if (columns.back() >= 0 && joint.is_prismatic() && table.unit(columns.back()) == "deg")
      table.fail_header(fmt::format(
          "column \"{0}\" is in degrees, but {0} is a linear unit; give its position in mm",
          joint.name));
    if (columns.back() < 0)
      table.fail_header("no column \"" + joint.name +
                        "\"; one column per joint is needed, named as in the robot file");
  }
  return columns;
}

double joint_si(const Joint& joint, double in_files) {
  return joint.is_prismatic() ? in_files / kMmPerM : in_files * kRadPerDeg;
}

std::vector<double> read_joints(const CsvTable& table, const Robot& robot,
                                const std::vector<int>& columns) {
  std::vector<double> angles(columns.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const Joint& joint = robot.joints[i];
    angles[i] = joint_si(joint, table.number(columns[i]));
    if (std::abs(angles[i]) > (joint.is_prismatic() ? kAnyPositionM : kAnyAngleRad))
      table.fail(columns[i], fmt::format("{} {} is out of range; {}", shown(table.text(columns[i])),
                                         unit_of(joint).name,
                                         joint.is_prismatic() ? "positions are in millimetres"
                                                              : "angles are in degrees"));
  }
  return angles;
}

std::vector<std::string> joint_names(const Robot& robot) {
  std::vector<std::string> names;
  for (const Joint& joint : robot.joints) {
    names.push_back(joint.name);
    if (joint.is_prismatic()) names.push_back(with_unit(joint));
  }
  return names;
}

std::vector<PoseRow> parse_poses(std::string_view text, const std::string& name,
                                 const Robot& robot) {
  CsvTable table(text, name, fmt::format("{}", fmt::join(kPose, ",")));
  const Robot positioner = axes_of_positioner(robot);
  std::vector<std::string> known(kPose.begin(), kPose.end());
  known.insert(known.end(), std::begin(kQuaternion), std::end(kQuaternion));
  std::ranges::move(joint_names(robot), std::back_inserter(known));
  std::ranges::move(joint_names(positioner), std::back_inserter(known));
  take_for_joints(table, robot);
  table.refuse_unknown(known);
  const auto q = quaternion_columns(table);
  const bool quaternion = *std::ranges::max_element(q) >= 0;
  const auto pose = pose_columns(table, quaternion);
  if (quaternion && *std::ranges::max_element(pose | std::views::drop(3)) >= 0)
    table.fail_header("both a_deg,b_deg,c_deg and a quaternion; one of them is needed");
  const auto seed = columns_or_none(table, robot);
  const auto axes = columns_or_none(table, positioner);
  std::vector<PoseRow> rows;
  while (table.next()) {
    if (rows.size() == kMaxPoses) throw FileError(name, ": more than 2000000 rows");
    FrameMmDeg frame;
    if (quaternion) frame.abc_deg = abc_of_quaternion(table, q);
    for (std::size_t i = 0; i < 3; ++i) {
      frame.xyz_mm[i] = bounded(table, pose[i], kFarthestMm, "mm");
      if (!quaternion) frame.abc_deg[i] = bounded(table, pose[i + 3], kMostDeg, "deg");
    }
    rows.push_back({to_isometry(frame), read_joints(table, robot, seed),
                    read_joints(table, positioner, axes), table.line()});
  }
  return rows;
}

std::vector<PoseRow> load_poses(const std::filesystem::path& path, const Robot& robot) {
  const std::string text = read_file(path);
  return parse_poses(text, path.string(), robot);
}

}  // namespace cellcal::calib
