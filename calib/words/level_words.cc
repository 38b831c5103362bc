#include "calib/words/level_words.h"

#include <fmt/format.h>

#include <map>
#include <string>

namespace cellcal::calib {

namespace {

std::string mean_words(const Calibration& c) {
  if (c.levels.empty()) return "mean over levels, weighted by evidence";
  double play = 0.0;
  std::map<double, double> share;  // by the size of the compliance
  for (const LevelEvidence& l : c.levels) {
    share[l.level.compliance] += l.probability;
    play += l.level.play > 0.0 ? l.probability : 0.0;
  }
  std::string compliance;
  for (const auto& [size, probability] : share)
    compliance += fmt::format("{}{:g} x prior ({:.0f} %)", compliance.empty() ? "" : ", ", size,
                              100.0 * probability);
  return fmt::format(
      "mean over {} levels, weighted by evidence. Joint compliance: {}{}. "
      "Likeliest level ({:.0f} %): {}",
      c.levels.size(), compliance,
      c.level.play > 0.0 ? fmt::format("; play ({:.0f} %)", 100.0 * play) : "",
      100.0 * c.levels.front().probability, words(c.cell, c.levels.front().level));
}

}  // namespace

std::string reason_words(const Calibration& c) {
  switch (c.level_reason.choice) {
    case LevelChoice::kNone:
      return {};
    case LevelChoice::kAskedFor:
      return "as requested";
    case LevelChoice::kMeanByEvidence:
      return mean_words(c);
    case LevelChoice::kNothingIdentified:
      return "nothing was identified; the nominal arm";
    case LevelChoice::kRecorded:
      return c.level_reason.text;
  }
  return {};
}

std::string level_and_reason_words(const Calibration& c) {
  const LevelChoice choice = c.level_reason.choice;
  const bool of_a_level =
      choice == LevelChoice::kAskedFor || choice == LevelChoice::kMeanByEvidence;
  return (of_a_level ? words(c.cell, c.level) + "; " : "") + reason_words(c);
}

}  // namespace cellcal::calib
