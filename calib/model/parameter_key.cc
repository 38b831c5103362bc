#include "calib/model/parameter_key.h"

#include <array>
#include <charconv>
#include <initializer_list>
#include <system_error>

#include "calib/model/enum_table.h"

namespace cellcal::calib {

namespace {

constexpr std::array kAxis = {"x", "y", "z"};
/// By AxisError.
constexpr std::array kAxisErrorNames = {"x",     "y",          "rx",        "ry",
                                        "scale", "compliance", "bearing_x", "bearing_y"};
static_assert(kAxisErrorNames.size() == kAxisErrors);

template <class T>
const T& part(const std::vector<T>& all, int index) {
  return all.at(static_cast<std::size_t>(index));
}

const Tool& tool_of(const Cell& cell, int index) {
  return index == 0 ? cell.tool : part(cell.other_tools, index - 1);
}

const char* axis_of(const ParameterKey& key) {
  return kAxis.at(static_cast<std::size_t>(key.axis));
}

/// Name of the part that the parameter belongs to.
std::string owner(const Cell& cell, const ParameterKey& key) {
  if (key.joint >= 0) return part(cell.robot.joints, key.joint).name;
  if (key.target >= 0) return part(cell.targets, key.target).id;
  if (key.carrier >= 0) return part(cell.robot.positioner, key.carrier).name;
  // The only tip of a cell needs no name, and its radius is common to all touches.
  if (key.kind == ParameterKind::kEffectiveRadius && cell.tool.id.empty()) return "touch";
  return tool_of(cell, key.tool).name();
}

/// Name of the quantity within the part.
std::string what(const Cell& cell, const ParameterKey& key) {
  switch (key.kind) {
    case ParameterKind::kGuide:
      return own_name(GuideMotion{key.axis}) +
             (key.harmonic == 0 ? "_slope" : std::to_string(key.harmonic));
    case ParameterKind::kLoad:
      return "load_" + part(cell.robot.joints, key.link).name + "_" + axis_of(key);
    case ParameterKind::kCosine: return "cos" + std::to_string(key.harmonic);
    case ParameterKind::kSine: return "sin" + std::to_string(key.harmonic);
    case ParameterKind::kFunctionCosine: return "fcos" + std::to_string(key.harmonic);
    case ParameterKind::kFunctionSine: return "fsin" + std::to_string(key.harmonic);
    case ParameterKind::kBearing: return std::string("bearing_") + axis_of(key);
    case ParameterKind::kDeflection: return "c_t";
    case ParameterKind::kEffectiveRadius: return "rho";
    case ParameterKind::kTcp:
    case ParameterKind::kCentre: return axis_of(key);
    case ParameterKind::kPositioner: return kAxisErrorNames.at(static_cast<std::size_t>(key.axis));
    case ParameterKind::kTilt: return key.axis == 0 ? "tilt1" : "tilt2";
    case ParameterKind::kTurn: return std::string("r") + axis_of(key);
    case ParameterKind::kProbeTurn: return std::string("probe_r") + axis_of(key);
    default: return own_name(key.kind);
  }
}

/// Order of "cos3"; 0 if invalid.
int order_of(std::string_view digits) {
  int order = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), order);
  const bool whole = error == std::errc() && end == digits.data() + digits.size();
  return whole && order > 0 ? order : 0;
}

/// Finds a parameter of a cell by name.
class Search {
 public:
  Search(const Cell& cell, std::string_view name) : cell_(cell), name_(name) {}

  std::optional<ParameterKey> found() {
    consider(latch_delay_parameter());
    for (std::size_t j = 0; j < cell_.robot.joints.size() && !key_; ++j) joint(j);
    for (std::size_t j = 0; j < cell_.robot.positioner.size() && !key_; ++j)
      for (int error = 0; error < kAxisErrors; ++error)
        consider(positioner_parameter(j, AxisError{error}));
    for (std::size_t k = 0; k <= cell_.other_tools.size() && !key_; ++k) tool(k);
    for (std::size_t t = 0; t < cell_.targets.size() && !key_; ++t) target(t);
    return key_;
  }

 private:
  /// Names may contain dots themselves.
  bool is_of(const std::string& owner) const {
    return name_.size() > owner.size() && name_.starts_with(owner) && name_[owner.size()] == '.';
  }
  void consider(const ParameterKey& key) {
    if (!key_ && parameter_name(cell_, key) == name_) key_ = key;
  }

  void joint(std::size_t index) {
    const std::string& owner = cell_.robot.joints[index].name;
    if (!is_of(owner)) return;
    for (const ParameterKind kind :
         {ParameterKind::kTheta, ParameterKind::kD, ParameterKind::kA, ParameterKind::kAlpha,
          ParameterKind::kBeta, ParameterKind::kCompliance, ParameterKind::kStiffening,
          ParameterKind::kPlay})
      consider(joint_parameter(kind, index));
    std::string_view rest = name_.substr(owner.size() + 1);
    for (const GuideMotion motion : all_values<GuideMotion>())
      if (const std::string_view word = own_name(motion); rest.starts_with(word))
        consider(guide_parameter(index, motion, order_of(rest.substr(word.size()))));
    for (const int axis : {0, 1}) consider(bearing_parameter(index, axis));
    if (rest.starts_with("load_"))
      for (std::size_t link = index; link < cell_.robot.joints.size(); ++link)
        for (const int axis : {0, 1, 2}) consider(load_parameter(index, link, axis));
    if (rest.starts_with('f')) rest.remove_prefix(1);
    constexpr std::size_t kPrefix = 3;  // "cos", "sin"
    if (rest.size() <= kPrefix) return;
    if (const int order = order_of(rest.substr(kPrefix)); order > 0)
      for (const ParameterKind kind :
           {ParameterKind::kCosine, ParameterKind::kSine, ParameterKind::kFunctionCosine,
            ParameterKind::kFunctionSine})
        consider(wave_parameter(kind, index, order));
  }

  void tool(std::size_t index) {
    consider(tool_parameter(ParameterKind::kDeflection, index));
    for (const int axis : {0, 1, 2}) consider(tool_parameter(ParameterKind::kTcp, index, axis));
    consider(tool_parameter(ParameterKind::kEffectiveRadius, index));
  }

  void target(std::size_t index) {
    if (!is_of(cell_.targets[index].id)) return;
    for (const int axis : {0, 1, 2})
      for (const ParameterKind kind :
           {ParameterKind::kCentre, ParameterKind::kTurn, ParameterKind::kProbeTurn})
        consider(target_parameter(kind, index, axis));
    for (const int axis : {0, 1}) consider(target_parameter(ParameterKind::kTilt, index, axis));
    consider(target_parameter(ParameterKind::kShift, index));
    consider(target_parameter(ParameterKind::kRadius, index));
  }

  const Cell& cell_;
  std::string_view name_;
  std::optional<ParameterKey> key_;
};

}  // namespace

ParameterKey joint_parameter(ParameterKind kind, std::size_t joint) {
  return {.kind = kind, .joint = static_cast<int>(joint)};
}

ParameterKey guide_parameter(std::size_t joint, GuideMotion motion, int order) {
  return {.kind = ParameterKind::kGuide,
          .joint = static_cast<int>(joint),
          .harmonic = order,
          .axis = static_cast<int>(motion)};
}

ParameterKey load_parameter(std::size_t joint, std::size_t link, int axis) {
  return {.kind = ParameterKind::kLoad,
          .joint = static_cast<int>(joint),
          .axis = axis,
          .link = static_cast<int>(link)};
}

ParameterKey bearing_parameter(std::size_t joint, int axis) {
  return {.kind = ParameterKind::kBearing, .joint = static_cast<int>(joint), .axis = axis};
}

ParameterKey wave_parameter(ParameterKind kind, std::size_t joint, int harmonic) {
  return {.kind = kind, .joint = static_cast<int>(joint), .harmonic = harmonic};
}

ParameterKey tool_parameter(ParameterKind kind, std::size_t tool, int axis) {
  return {.kind = kind, .axis = axis, .tool = static_cast<int>(tool)};
}

ParameterKey latch_delay_parameter() { return {.kind = ParameterKind::kLatchDelay}; }

ParameterKey positioner_parameter(std::size_t carrier, AxisError error) {
  return {.kind = ParameterKind::kPositioner,
          .axis = static_cast<int>(error),
          .carrier = static_cast<int>(carrier)};
}

ParameterKey target_parameter(ParameterKind kind, std::size_t target, int axis) {
  return {.kind = kind, .axis = axis, .target = static_cast<int>(target)};
}

std::string parameter_name(const Cell& cell, const ParameterKey& key) {
  if (key.kind == ParameterKind::kLatchDelay) return what(cell, key);  // not specific to a part
  return owner(cell, key) + "." + what(cell, key);
}

std::optional<ParameterKey> parameter_key(const Cell& cell, std::string_view name) {
  return Search(cell, name).found();
}

}  // namespace cellcal::calib
