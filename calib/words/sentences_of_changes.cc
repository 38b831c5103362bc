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

std::string jumped_subject(const FindingPart& one) {
  if (one.about.of == Subject::Of::kJoint) return one.about.name + "'s zero";
  if (one.about.of == Subject::Of::kTool) return "the tool's tip on the flange";
  return one.about.name;
}

std::string one_jump(const Finding& f, const FindingPart& one) {
  const double touches = of(f, "touches");
  if (one.about.of == Subject::Of::kTool)
    return fmt::format(
        "its tip seems to have moved by {} on the flange after about {} (of {:.0f}). Check its "
        "fastening and calibrate again",
        jump_size(one), touch_of(one.about), touches);
  // The same to all touches as that joint.
  const char* or_else = "";
  if (is_set(f, "first_joint"))
    or_else = " (or the arm's foot, or all targets together, turned by as much)";
  else if (is_set(f, "last_joint"))
    or_else = " (or the tool turned on the flange by as much)";
  return fmt::format(
      "the zero of {} seems to have jumped by {} after about {} (of {:.0f}){}. Look for a slipping "
      "belt, coupling or brake, master the joint and calibrate again",
      one.about.name, jump_size(one), touch_of(one.about), touches, or_else);
}

}  // namespace

std::string moved_target(const Finding& f) {
  return fmt::format("{} moved by {} after {}. Clamp it, and repeat from there{}", f.about.name,
                     shift(f.evidence), touch_of(f.about),
                     is_set(f, "or_lengths") ? ", or mend the lengths" : "");
}

std::string jumped(const Finding& f) {
  std::string text;
  if (f.parts.size() == 1) {
    text = one_jump(f, f.parts.front());
  } else {
    for (const FindingPart& one : f.parts)
      text += fmt::format("{}{} by {} after about {}", text.empty() ? "" : ", or ",
                          jumped_subject(one), jump_size(one), touch_of(one.about));
    text = fmt::format(
        "the touches ({:.0f}) do not tell for certain which: {}. Check these and calibrate again",
        of(f, "touches"), text);
  }
  return text + (is_set(f, "or_lengths")
                     ? "; or mend the certified lengths, without which nothing jumped"
                     : "");
}

}  // namespace cellcal::calib::sentences
