#include "calib/result/unidentifiable.h"

#include <array>

namespace cellcal::calib {

namespace {

constexpr std::array kUnidentifiableNames = {
    std::pair{UnidentifiableKind::kZeroOfFirstJoint, "zero_of_first_joint"},
    std::pair{UnidentifiableKind::kHeightOfBase, "height_of_base"},
    std::pair{UnidentifiableKind::kBehindLastJoint, "behind_last_joint"},
    std::pair{UnidentifiableKind::kNothingMoves, "nothing_moves"},
    std::pair{UnidentifiableKind::kNoEffect, "no_effect"},
    std::pair{UnidentifiableKind::kScale, "scale"},
    std::pair{UnidentifiableKind::kWeak, "weak"},
    std::pair{UnidentifiableKind::kRecorded, "recorded"},
};

/// "A1.d, A2.a and 3 more"
std::string list(const Cell& cell, const UnidentifiableDirection& d) {
  std::vector<std::string> names;
  for (const ParameterKey& key : d.parameters) names.push_back(parameter_name(cell, key));
  if (d.more_parameters > 0) names.push_back(std::to_string(d.more_parameters) + " more");
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  return text;
}

std::string weak_words(const Cell& cell, const UnidentifiableDirection& d) {
  const bool alone = d.parameters.size() + d.more_parameters == 1;
  return list(cell, d) +
         (alone ? " is not determined by these touches; its tolerance decides"
                : " cannot be separated by these touches; their tolerances decide") +
         (d.kind == UnidentifiableKind::kScale
              ? ". All lengths scale together: touch a second sphere at a certified distance"
              : ". Touch in other postures");
}

std::string sentence(const Cell& cell, const UnidentifiableDirection& d) {
  switch (d.kind) {
    case UnidentifiableKind::kZeroOfFirstJoint:
      return "zero of " + cell.robot.joints.at(0).name +
             ": the same as turning all targets about the base axis. Fixed by convention (gauge)";
    case UnidentifiableKind::kHeightOfBase:
      return "height of the arm on its base (" +
             parameter_name(cell, joint_parameter(ParameterKind::kD, 0)) +
             "): the same as lowering all targets. Fixed by convention (gauge)";
    case UnidentifiableKind::kBehindLastJoint:
      return list(cell, d) +
             " move the tip in three directions only, behind the last axis: one combination is not "
             "observable. Fixed by convention (gauge)";
    case UnidentifiableKind::kNothingMoves:
      return list(cell, d) +
             " can change together without moving anything. Fixed by convention (gauge)";
    case UnidentifiableKind::kNoEffect:
      return list(cell, d) +
             " moves the tip by less than 0.001 mm: not observable, and without effect; its "
             "tolerance decides";
    case UnidentifiableKind::kScale:
    case UnidentifiableKind::kWeak:
      return weak_words(cell, d);
    case UnidentifiableKind::kRecorded:
      return d.text;
  }
  return {};
}

}  // namespace

const char* to_string(UnidentifiableKind kind) {
  for (const auto& [one, name] : kUnidentifiableNames)
    if (one == kind) return name;
  return "";
}

std::optional<UnidentifiableKind> unidentifiable_kind(const std::string& name) {
  for (const auto& [kind, its] : kUnidentifiableNames)
    if (name == its) return kind;
  return std::nullopt;
}

std::string words(const Cell& cell, const UnidentifiableDirection& d) {
  std::string text = sentence(cell, d);
  if (d.more_as_weak > 0)
    text += ". " + std::to_string(d.more_as_weak) + " further directions are as weak";
  return text;
}

}  // namespace cellcal::calib
