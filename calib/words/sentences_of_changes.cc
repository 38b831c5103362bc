// What findings say of what moved or jumped in mid-session.

#include <fmt/format.h>

#include "calib/words/sentences.h"

namespace cellcal::calib::sentences {

namespace {

/// "0.52 +- 0.03 mm (+0.10, -0.50, +0.11)"
std::string shift(const std::vector<Quantity>& evidence) {
  const Quantity* by = find(evidence, "shift");
  return fmt::format("{:.2f} +- {:.2f} mm ({:+.2f}, {:+.2f}, {:+.2f})",
                     by == nullptr ? 0.0 : by->value, by == nullptr ? 0.0 : by->sigma,
                     value(evidence, "x"), value(evidence, "y"), value(evidence, "z"));
}

std::string jump_size(const FindingPart& one) {
  if (one.about.of != Subject::Of::kJoint) return shift(one.evidence);
  const Quantity* by = find(one.evidence, "turn");
  return fmt::format("{:+.3f} +- {:.3f} deg", by == nullptr ? 0.0 : by->value,
                     by == nullptr ? 0.0 : by->sigma);
}

/// "zero of A3 jumped by +0.050 +- 0.004 deg after about touch 50"
std::string jump(const FindingPart& one) {
  const std::string at = "after about " + touch_of(one.about);
  if (one.about.of == Subject::Of::kJoint)
    return fmt::format("zero of {} jumped by {} {}", one.about.name, jump_size(one), at);
  if (one.about.of == Subject::Of::kTool)
    return fmt::format("tool tip moved by {} in the flange frame {}", jump_size(one), at);
  return fmt::format("{} moved by {} {}", one.about.name, jump_size(one), at);
}

std::string one_jump(const Finding& f, const FindingPart& one) {
  const double touches = of(f, "touches");
  if (one.about.of == Subject::Of::kTool)
    return fmt::format("{} of {:.0f}. Check its fastening and calibrate again", jump(one), touches);
  // The same to all touches as that joint.
  const char* or_else = "";
  if (is_set(f, "first_joint"))
    or_else = " (or the arm's foot, or all targets together, turned by as much)";
  else if (is_set(f, "last_joint"))
    or_else = " (or the tool turned on the flange by as much)";
  return fmt::format(
      "{} of {:.0f}{}. Check belt, coupling and brake, master the joint and calibrate again",
      jump(one), touches, or_else);
}

/// Where the change is significant with the certified lengths only.
const char* or_lengths(const Finding& f) {
  return is_set(f, "or_lengths")
             ? ". Or correct the certified lengths: without them the change is not significant"
             : "";
}

}  // namespace

std::string moved_target(const Finding& f) {
  return fmt::format("{} moved by {} after {}. Clamp it and calibrate again{}", f.about.name,
                     shift(f.evidence), touch_of(f.about), or_lengths(f));
}

std::string jumped(const Finding& f) {
  if (f.parts.size() == 1) return one_jump(f, f.parts.front()) + or_lengths(f);
  std::string causes;
  for (const FindingPart& one : f.parts) causes += (causes.empty() ? "" : ", or ") + jump(one);
  return fmt::format(
      "{:.0f} touches fit more than one cause: {}. Check each, then calibrate again{}",
      of(f, "touches"), causes, or_lengths(f));
}

}  // namespace cellcal::calib::sentences
