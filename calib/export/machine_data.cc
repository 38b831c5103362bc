#include "calib/export/machine_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/export/tables.h"
#include "calib/files/text.h"
#include "calib/model/error.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

constexpr std::size_t kMostBytes = 16u << 20;
constexpr double kSame = 1e-5;  // m

/// NAME[index]=value of one line; index -1 if absent.
struct Assignment {
  std::string name;  ///< upper case: KRL is case-insensitive
  int index = -1;
  std::string_view value;
};

bool is_word(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '$';
}

std::string_view bare(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const auto begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

/// Removes a trailing comment: a semicolon outside a string and what follows.
std::string_view uncommented(std::string_view line) {
  bool text = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') text = !text;
    if (line[i] == ';' && !text) return line.substr(0, i);
  }
  return line;
}

std::optional<Assignment> assignment(std::string_view line) {
  line = uncommented(line);
  const auto equals = line.find('=');
  if (equals == std::string_view::npos) return std::nullopt;
  Assignment found;
  found.value = bare(line.substr(equals + 1));
  std::string_view left = bare(line.substr(0, equals));
  const auto bracket = left.find('[');
  std::string_view index;
  if (bracket != std::string_view::npos) {
    const auto end = left.find(']', bracket);
    if (end == std::string_view::npos) return std::nullopt;
    index = bare(left.substr(bracket + 1, end - bracket - 1));
    left = bare(left.substr(0, bracket));
  }
  // DECL REAL NAME, FRAME NAME: the last word is the variable.
  auto begin = left.size();
  while (begin > 0 && is_word(left[begin - 1])) --begin;
  for (const char c : left.substr(begin))
    found.name += c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  if (const auto value = number(index); value && *value >= 0.0 && *value <= 1000.0)
    found.index = static_cast<int>(*value);
  return found;
}

/// Location in a file, for messages.
struct Place {
  const std::string& file;
  std::size_t line;
  [[noreturn]] void fail(const Assignment& a, const char* what) const {
    throw FileError(
        file, fmt::format(", line {}: {}{} = \"{}\" is not {}", line, a.name,
                          a.index < 0 ? "" : fmt::format("[{}]", a.index), shown(a.value), what));
  }
};

double real(const Assignment& a, const Place& place, double largest) {
  const auto value = number(a.value);
  if (!value || std::abs(*value) > largest)
    place.fail(a, fmt::format("a number up to {}", largest).c_str());
  return *value;
}

/// A member of {X 0.0,Y 0.0,...}, with or without a type prefix: {FRAME: X 0.0}.
double member(const Assignment& a, const Place& place, std::string_view key) {
  std::string_view rest = a.value;
  if (!rest.starts_with('{') || !rest.ends_with('}')) place.fail(a, "a structure {...}");
  rest = rest.substr(1, rest.size() - 2);
  if (const auto colon = rest.find(':'); colon != std::string_view::npos)
    rest = rest.substr(colon + 1);
  while (!rest.empty()) {
    const auto comma = std::min(rest.find(','), rest.size());
    const std::string_view one = bare(rest.substr(0, comma));
    const auto blank = std::min(one.find(' '), one.size());
    if (one.substr(0, blank) == key) {
      const auto value = number(one.substr(blank));
      if (!value || std::abs(*value) > 1e6) place.fail(a, "a structure of numbers");
      return *value;
    }
    rest = comma < rest.size() ? rest.substr(comma + 1) : std::string_view();
  }
  place.fail(a, fmt::format("a structure with {}", key).c_str());
}

FrameMmDeg frame(const Assignment& a, const Place& place) {
  return {{member(a, place, "X"), member(a, place, "Y"), member(a, place, "Z")},
          {member(a, place, "A"), member(a, place, "B"), member(a, place, "C")}};
}

std::string text_of(std::string_view value) {
  if (value.size() >= 2 && value.front() == '"' && value.back() == '"')
    value = value.substr(1, value.size() - 2);
  return shown(bare(value), 80);
}

/// Motor speed and gear ratio, in the file's order.
struct Drives {
  std::array<double, 6> rpm{}, ratio{};
};

constexpr double kLengthMm = 1e5;

void of_axis(const Assignment& a, const Place& place, MachineData& data, Drives& drives) {
  const auto i = static_cast<std::size_t>(a.index - 1);
  MachineAxis& axis = data.axes[i];
  if (a.name == "$SOFTN_END") axis.min_rad = real(a, place, 1e5) * kRadPerDeg;
  if (a.name == "$SOFTP_END") axis.max_rad = real(a, place, 1e5) * kRadPerDeg;
  if (a.name == "$VEL_AXIS_MA") drives.rpm[i] = std::abs(real(a, place, 1e6));
  if (a.name == "$RAT_MOT_AX") {
    const double turns = member(a, place, "D");
    if (turns == 0.0) place.fail(a, "a ratio: D is 0");
    drives.ratio[i] = std::abs(member(a, place, "N") / turns);
  }
  if (drives.rpm[i] > 0.0 && drives.ratio[i] > 0.0)
    axis.max_speed_rad_s = drives.rpm[i] / 60.0 / drives.ratio[i] * kRadPerTurn;
}

void take(const Assignment& a, const Place& place, MachineData& data, Drives& drives) {
  if (a.index >= 1 && a.index <= 6) of_axis(a, place, data, drives);
  if (a.name == "$LENGTH_A") data.length_a_m = real(a, place, kLengthMm) / kMmPerM;
  if (a.name == "$LENGTH_B") data.length_b_m = real(a, place, kLengthMm) / kMmPerM;
  if (a.name == "$TX3P3" || a.name == "$TFLWP") {
    const FrameMmDeg at = frame(a, place);
    const double length_m = std::hypot(at.xyz_mm[0], at.xyz_mm[1], at.xyz_mm[2]) / kMmPerM;
    (a.name == "$TX3P3" ? data.wrist_m : data.flange_m) = length_m;
  }
  if ((a.name == "$TRAFONAME" || a.name == "$MODEL_NAME") && !a.value.empty())
    data.type = text_of(a.value);
  if (a.name == "TOOL_DATA" && a.index >= 1) {
    const FrameMmDeg tool = frame(a, place);
    const auto zero = [](double v) { return v == 0.0; };
    if (!std::all_of(tool.xyz_mm.begin(), tool.xyz_mm.end(), zero) ||
        !std::all_of(tool.abc_deg.begin(), tool.abc_deg.end(), zero))
      data.tools[a.index] = tool;
  }
}

}  // namespace

void read_machine_data(std::string_view text, const std::string& name, MachineData& data) {
  if (text.size() > kMostBytes)
    throw FileError(name, fmt::format(": {} bytes (limit {})", text.size(), kMostBytes));
  Drives drives;
  std::size_t line = 0;
  for (std::size_t at = 0; at < text.size();) {
    const auto end = std::min(text.find('\n', at), text.size());
    ++line;
    if (const auto found = assignment(text.substr(at, end - at)))
      take(*found, {name, line}, data, drives);
    at = end + 1;
  }
}

std::vector<LengthDifference> differences(const MachineData& data, const Robot& robot) {
  if (robot.joints.size() != 6)
    throw FileError(fmt::format("\"{}\" has {} joints; machine data of a six-axis arm are read",
                                robot.name, robot.joints.size()));
  std::vector<LengthDifference> found;
  const auto hold = [&](const char* variable, const std::optional<double>& stated, const char* key,
                        std::size_t joint, double robot_m) {
    if (stated && !(std::abs(std::abs(*stated) - std::abs(robot_m)) <= kSame))
      found.push_back(
          {variable, robot.joints[joint].name, key, std::abs(*stated), std::abs(robot_m)});
  };
  const auto& j = robot.joints;
  hold("$LENGTH_A", data.length_a_m, "a_mm", 0, j[0].a_m);
  hold("$LENGTH_B", data.length_b_m, "a_mm", 1, j[1].a_m);
  hold("$TX3P3", data.wrist_m, "a_mm and d_mm of the next", 2, std::hypot(j[2].a_m, j[3].d_m));
  hold("$TFLWP", data.flange_m, "d_mm", 5, j[5].d_m);
  return found;
}

Robot with_machine_data(Robot robot, const MachineData& data) {
  for (std::size_t i = 0; i < std::min(robot.joints.size(), data.axes.size()); ++i) {
    const MachineAxis& axis = data.axes[i];
    Joint& joint = robot.joints[i];
    joint.min_rad = axis.min_rad.value_or(joint.min_rad);
    joint.max_rad = axis.max_rad.value_or(joint.max_rad);
    joint.max_speed_rad_s = axis.max_speed_rad_s.value_or(joint.max_speed_rad_s);
  }
  return robot;
}

}  // namespace cellcal::calib
