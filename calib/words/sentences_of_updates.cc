// What findings say of an update: what changed since the last calibration, or why it takes a full session.

#include <fmt/format.h>

#include "calib/words/sentences.h"

namespace cellcal::calib::sentences {

namespace {

constexpr double kUpdateCoverage = 2.0;
constexpr const char* kFullSession = "Run a full session: 'cellcal run --cell CELL'";

/// What was found to have changed, with its size.
std::string change(const Subject& about, const std::vector<Quantity>& evidence) {
  const auto quantity = [&](const char* name, const char* form) -> std::string {
    const Quantity* q = find(evidence, name);
    return q == nullptr
               ? std::string()
               : fmt::format(fmt::runtime(form), q->value, kUpdateCoverage * q->sigma, q->unit);
  };
  const std::string shift = quantity("shift", "{:.2f} +- {:.2f} {} (k=2)");
  if (about.of == Subject::Of::kTool) return fmt::format("tool shifted by {}", shift);
  if (about.of == Subject::Of::kTarget) return fmt::format("{} moved by {}", about.name, shift);
  if (about.of == Subject::Of::kJoint)
    return fmt::format("zero of {} off by {}", about.name,
                       quantity("turn", "{:+.3f} +- {:.3f} {} (k=2)"));
  if (const std::string growth = quantity("growth", "{:+.0f} +- {:.0f} {} (k=2)"); !growth.empty())
    return fmt::format("whole arm grown by {}", growth);
  if (const std::string off = quantity("off", "{:+.2f} +- {:.2f} {} (k=2)"); !off.empty())
    return fmt::format("one touch alone {} off", off);
  return "nothing changed";
}

/// What has to be done as well as the update.
const char* besides(const Finding& f) {
  switch (f.about.of) {
    case Subject::Of::kTool:
      return ". Check the tool's fastening";
    case Subject::Of::kTarget:
      return ". Clamp its stand and have its certified lengths measured again";
    case Subject::Of::kJoint:
      return ". Check its mastering, belt, coupling and brake";
    default:
      return "";
  }
}

/// "probability 99.0 %, 8 touches"
std::string support(const Finding& f) {
  return fmt::format("probability {:.1f} %, {:.0f} touches", of(f, "probability"),
                     of(f, "touches"));
}

std::string accuracy(const Finding& f) {
  return fmt::format("{:.3f} mm predicted over the workspace, {:.3f} mm before the change",
                     of(f, "reached"), of(f, "before"));
}

}  // namespace

std::string updated(const Finding& f) {
  return fmt::format("{}, {} on top of {}; {}{}", change(f.about, f.evidence), support(f), f.text,
                     accuracy(f), besides(f));
}

std::string update_not_needed(const Finding& f) {
  return fmt::format("{}, {}; {} holds. Keep that calibration", change(f.about, f.evidence),
                     support(f), f.text);
}

std::string update_contradicted(const Finding& f) {
  const std::string second =
      f.parts.empty() ? std::string()
                      : "; next likely: " + change(f.parts.front().about, f.parts.front().evidence);
  return fmt::format("more than one change found ({:.0f} touches): {}{}. {}", of(f, "touches"),
                     change(f.about, f.evidence), second, kFullSession);
}

std::string update_not_resolved(const Finding& f) {
  return fmt::format("{}, {}: not resolved; {}. {}", change(f.about, f.evidence), support(f),
                     accuracy(f), kFullSession);
}

std::string update_not_found(const Finding& f) {
  return fmt::format(
      "{} not found at the place from {}. "
      "Check stand and tool; then run a full session: 'cellcal run --cell CELL --find'",
      f.parts.empty() ? "a sphere was"
                      : list(f, [](const FindingPart& one) { return one.about.name; }) +
                            (f.parts.size() == 1 ? " was" : " were"),
      f.text);
}

std::string update_too_few(const Finding& f) {
  return fmt::format("{:.0f} touches are too few. Clean tip and spheres and try again",
                     of(f, "touches"));
}

}  // namespace cellcal::calib::sentences
