#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/words/sentences.h"

namespace cellcal::calib::sentences {

namespace {

/// So many of several are named; of the others how many they are.
constexpr std::size_t kInWords = 3;

}  // namespace

double of(const Finding& f, const char* name) { return value(f.evidence, name); }

double sigma_of(const Finding& f, const char* name) {
  const Quantity* its = find(f.evidence, name);
  return its == nullptr ? 0.0 : its->sigma;
}

bool has(const Finding& f, const char* name) { return find(f.evidence, name) != nullptr; }

bool is_set(const Finding& f, const char* name) { return has(f, name) && of(f, name) != 0.0; }

bool is_one(const Finding& f, const char* name) { return of(f, name) == 1.0; }

std::string touch_of(const Subject& subject) {
  Touch touch;
  touch.line = subject.line;
  return touch_words(subject.touch.value_or(0), touch);
}

std::string length_of(const Finding& f) { return f.about.name + "-" + f.about.other_end; }

const char* where(const Finding& f) {
  return is_set(f, "workspace") ? "over the workspace" : "near the targets";
}

std::string list(const Finding& f, const std::function<std::string(const FindingPart&)>& one) {
  std::string text;
  for (std::size_t k = 0; k < std::min(kInWords, f.parts.size()); ++k)
    text += (k == 0 ? "" : ", ") + one(f.parts[k]);
  if (f.parts.size() > kInWords) text += fmt::format(", and {} more", f.parts.size() - kInWords);
  return text;
}

const char* again(const Finding& f) {
  switch (f.about.target_kind.value_or(TargetKind::kSphere)) {
    case TargetKind::kSphere:
    case TargetKind::kPlane:
      return "Clean it and touch it again";
    case TargetKind::kWire:
      return "Check that it runs free and measure again";
    case TargetKind::kPoint:
      return "Check that the tip seats in it and touch it again";
    case TargetKind::kTracker:
      return "Check the line of sight and the reflector, and measure again";
  }
  return "";
}

std::string reading_off(const Quantity& longer) {
  return fmt::format("{:.2f} +- {:.2f} mm too {}", std::abs(longer.value), longer.sigma,
                     longer.value < 0.0 ? "long" : "short");
}

}  // namespace cellcal::calib::sentences
