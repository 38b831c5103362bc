#include "calib/verdict/tolerances.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

/// An arm this many tolerances off its drawing is another arm: real ones stay within five
/// (real-data tests), a wrong row of the robot file makes twenty and more and can still be
/// explained away. Before that it is told.
constexpr double kFarFromDrawing = 6.0, kBeyondTolerance = 4.0;
/// All lengths of an arm together: chance does not take them so many sigmas off.
constexpr double kFarScale = 4.0;
/// The arm itself may be off the other way, sigmas.
constexpr double kLuck = 2.0;
/// The effective radius may be off by what its prior says: chance is told, and then not believed.
constexpr double kToldRadius = 2.0, kFarRadius = 3.0;

/// Whether it is not one length alone.
bool is_of_all_lengths(const Problem& problem, const Calibration& c, const ArmScale& scale) {
  constexpr double kFarWithoutOne = 2.0;
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ArmScale others = arm_scale(problem, c, p);
    if (!(others.off * scale.off > 0.0) || !(std::abs(others.off) > kFarWithoutOne * others.sigma))
      return false;
  }
  return true;
}

/// Errors of more than so many tolerances, the farthest first; empty where there are none.
struct BeyondTolerance {
  std::string words;
  double farthest = 0.0;  ///< tolerances
};
BeyondTolerance beyond_tolerance(const Problem& problem, const Calibration& c, double most) {
  BeyondTolerance all;
  std::vector<std::pair<double, std::string>> far;
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ArmParameterKind kind = problem.arm().parameters()[p].kind;
    if (kind > ArmParameterKind::kBeta && kind != ArmParameterKind::kTcp) continue;
    const ParameterResult& found = c.parameters[static_cast<std::size_t>(p)];
    const double tolerances = std::abs(found.correction) / problem.unknowns()[p].scale;
    if (!(tolerances > most)) continue;
    all.farthest = std::max(all.farthest, tolerances);
    far.emplace_back(tolerances,
                     fmt::format("{} is off by {:.3g} {}, {:.0f} times its tolerance", found.name,
                                 found.correction * found.to_unit, found.unit, tolerances));
  }
  if (!far.empty()) all.words = farthest_words(std::move(far));
  return all;
}

/// Where the tip meets its targets elsewhere than the files say; empty within `most` sigmas.
std::string radius_words(const Problem& problem, const Calibration& c, double most) {
  int worst = -1;
  for (int tool = 0; tool < problem.arm().tool_count(); ++tool) {
    const int rho = problem.rho(tool);
    if (rho >= 0 &&
        (worst < 0 || std::abs(c.parameters[static_cast<std::size_t>(rho)].correction) >
                          std::abs(c.parameters[static_cast<std::size_t>(worst)].correction)))
      worst = rho;
  }
  if (worst < 0) return {};
  const double off_m = c.parameters[static_cast<std::size_t>(worst)].correction;
  const double sigma_m = problem.unknowns()[static_cast<std::size_t>(worst)].scale;
  if (!(std::abs(off_m) > most * sigma_m)) return {};
  return fmt::format(
      "the tip meets its targets {:+.2f} mm from where diameter and tip radius put it, {:.1f} "
      "times radius_offset_sigma_mm, as if all diameters were {:.1f} mm {} than stated; check "
      "diameter_mm and tip_radius_mm",
      off_m * 1e3, std::abs(off_m) / sigma_m, 2.0 * std::abs(off_m) * 1e3,
      off_m > 0.0 ? "larger" : "smaller");
}

}  // namespace

double ArmScale::unseen() const { return (kFarScale + kLuck) * sigma; }

ArmScale arm_scale(const Problem& problem, const Calibration& c, int but) {
  double information = 0.0, pull = 0.0;
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ArmParameterKind kind = problem.arm().parameters()[p].kind;
    if ((kind != ArmParameterKind::kD && kind != ArmParameterKind::kA) || p == but) continue;
    const Joint& joint =
        problem.arm().robot().joints[static_cast<std::size_t>(problem.arm().parameters()[p].joint)];
    const double drawn_m = kind == ArmParameterKind::kD ? joint.d_m : joint.a_m;
    const double square = std::pow(problem.unknowns()[p].scale, 2);
    information += drawn_m * drawn_m / square;
    pull += drawn_m * c.parameters[static_cast<std::size_t>(p)].correction / square;
  }
  if (!(information > 0.0)) return {};
  return {pull / information, 1.0 / std::sqrt(information)};  // (57)
}

std::string farthest_words(std::vector<std::pair<double, std::string>> off) {
  constexpr std::size_t kInWords = 3;
  std::stable_sort(off.begin(), off.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string words;
  for (std::size_t k = 0; k < std::min(kInWords, off.size()); ++k)
    words += (k == 0 ? "" : ", ") + off[k].second;
  if (off.size() > kInWords) words += fmt::format(", and {} more", off.size() - kInWords);
  return words;
}

void judge_drawing(const Problem& problem, const Calibration& c,
                   std::vector<std::string>& blocking) {
  constexpr double kAnotherArm = 50.0;
  const ArmScale scale = arm_scale(problem, c);
  if (scale.sigma > 0.0 && std::abs(scale.off) > kFarScale * scale.sigma &&
      is_of_all_lengths(problem, c, scale))
    blocking.push_back(fmt::format(
        "scale: all lengths of the arm together are {:+.2f} % off the drawing, {:.0f} times what "
        "their tolerances leave open; check what holds the scale: certified lengths, readings of "
        "trackers and wires, diameters",
        100.0 * scale.off, std::abs(scale.off) / scale.sigma));
  const BeyondTolerance far = beyond_tolerance(problem, c, kFarFromDrawing);
  if (far.words.empty()) return;
  blocking.push_back(
      "far from the drawing: " + far.words +
      "; is it the right robot file and tool, and is the arm mastered?" +
      (far.farthest < kAnotherArm ? " If all are so, state a larger tolerance" : ""));
}

void judge_radius(const Problem& problem, const Calibration& c,
                  std::vector<std::string>& blocking) {
  if (const std::string words = radius_words(problem, c, kFarRadius); !words.empty())
    blocking.push_back("effective radius: " + words);
}

void note_tolerances(const Problem& problem, const Calibration& c,
                     std::vector<std::string>& notes) {
  if (const std::string words = radius_words(problem, c, kToldRadius); !words.empty())
    notes.push_back("radius offset: " + words);
  const BeyondTolerance far = beyond_tolerance(problem, c, kBeyondTolerance);
  if (!far.words.empty())
    notes.push_back("beyond tolerance: " + far.words + "; is it the right robot file and tool?");
}

}  // namespace cellcal::calib
