#include "calib/result/level.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "calib/model/units.h"
#include "calib/result/calibration.h"
#include "calib/result/finding_phrase.h"

namespace cellcal::calib {

namespace {

/// Published transmission errors of industrial arms are 10 to 60 arcsec per revolution; the lower
/// end, since the evidence may raise it.
constexpr double kTypicalTransmissionRad = 10.0 * kRadPerArcsec;
/// Amplitudes fall off as 1/h, the spectrum of a random walk: the weakest assumption for a function
/// of known size only. Higher frequencies are covered by the ripple.
const std::vector<int> kTypicalOrders = {1, 2, 3, 4};

/// Sag of a joint without stated compliance, 1 sigma at its largest load, and the smallest load
/// considered.
constexpr double kTypicalSagRad = 3e-3;
constexpr double kLeastLoadNm = 100.0;
/// Half the lost motion of a worn gear, 1 sigma, and the share of the largest load that closes it:
/// elastic backlash closes gradually.
constexpr double kTypicalPlayRad = 30.0 * kRadPerArcsec;
constexpr double kClosesOfLargest = 0.1;
/// Unstated link masses by length, as for arms with about ten kilograms of payload.
constexpr double kTypicalMassKgPerM = 40.0;
constexpr double kGravity = 9.81;

bool stated(const Robot& robot, double Joint::*field) {
  return std::any_of(robot.joints.begin(), robot.joints.end(),
                     [&](const Joint& j) { return j.*field > 0.0; });
}

/// Masses in proportion to the links' lengths, each centred between its joints.
void assume_masses(Robot& robot) {
  double heaviest = 0.0;
  for (std::size_t i = robot.first_turning() + 1; i < robot.joints.size(); ++i) {
    Joint& joint = robot.joints[i];
    joint.mass_kg = kTypicalMassKgPerM * std::hypot(joint.a_m, joint.d_m);
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(joint.alpha_rad, Eigen::Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(joint.beta_rad, Eigen::Vector3d::UnitY()))
                                     .toRotationMatrix();
    joint.com_m = turn.transpose() * Eigen::Vector3d(-joint.a_m, 0.0, -joint.d_m) / 2.0;
    // The centre may lie anywhere between the joints: uniform, sigma 1/sqrt(12) of the link.
    joint.moment_sigma_kg_m = joint.mass_kg * joint.com_m.norm() * std::numbers::inv_sqrt3;  // (10)
    heaviest = std::max(heaviest, joint.moment_sigma_kg_m);
  }
  constexpr double kOfTheHeaviest = 0.1;  // smaller loads are not visible
  for (Joint& joint : robot.joints)
    if (joint.moment_sigma_kg_m < kOfTheHeaviest * heaviest) joint.moment_sigma_kg_m = 0.0;
}

/// Largest load of each joint [N m], with the arm stretched out and everything on it. 0: the axis is
/// vertical and carries no load.
std::vector<double> largest_load_nm(const Robot& robot, const Cell& cell) {
  const Eigen::Vector3d axis = robot.base_fixed.linear().col(2);
  const bool upright = axis.cross(robot.gravity_m_s2).norm() < 0.01 * robot.gravity_m_s2.norm();
  double mass = cell.tool.mass_kg, moment = cell.tool.mass_kg * cell.tool.com_m.norm();
  for (const Tool& tool : cell.other_tools) {
    mass += tool.mass_kg;
    moment += tool.mass_kg * tool.com_m.norm();
  }
  std::vector<double> load(robot.joints.size());
  for (std::size_t i = robot.joints.size(); i-- > 0;) {
    const Joint& joint = robot.joints[i];
    const double length = std::hypot(joint.a_m, joint.d_m);
    moment += mass * length + joint.mass_kg * std::max(0.0, length - joint.com_m.norm());
    mass += joint.mass_kg;
    load[i] =
        i == robot.first_turning() && upright ? 0.0 : std::max(kLeastLoadNm, kGravity * moment);
  }
  return load;
}

double largest_transmission_rad(const Cell& cell) {
  double largest = 0.0;
  for (const Joint& joint : cell.robot.joints)
    largest = std::max(largest, joint.harmonic_sigma_rad);
  return largest;
}

/// Parts of the model by evidence of the touches or by the robot file.
void add_learnt(const Robot& robot, Phrase& all) {
  if (stated(robot, &Joint::bearing_sigma_rad_per_nm))
    all = joined("say.join.comma", all, "say.level.bearings");
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (const Joint& joint : robot.joints) {
    double rms_rad = std::hypot(joint.function_sigma_rad, joint.function_fast_sigma_rad);
    for (const JointWave& wave : joint.waves) rms_rad = std::hypot(rms_rad, wave.sigma_rad);
    if (!(rms_rad > 0.0)) continue;
    const double arcsec = rms_rad / kRadPerArcsec;
    least = std::min(least, arcsec);
    most = std::max(most, arcsec);
  }
  if (most > 0.0)
    all =
        joined("say.join.comma", all, {"say.level.functions", {{"least", least}, {"most", most}}});
}

Phrase mean_phrase(const Calibration& c) {
  if (c.levels.empty()) return "say.level.mean.unknown";
  double play = 0.0;
  std::map<double, double> share;  // by size of the compliance
  for (const LevelEvidence& l : c.levels) {
    share[l.level.compliance] += l.probability;
    play += l.level.play > 0.0 ? l.probability : 0.0;
  }
  Phrase sizes;
  for (const auto& [size, probability] : share)
    sizes = joined("say.join.comma", sizes,
                   {"say.level.mean.size", {{"size", size}, {"percent", 100.0 * probability}}});
  return {c.level.play > 0.0 ? "say.level.mean.play" : "say.level.mean",
          {{"levels", c.levels.size()},
           {"sizes", sizes},
           {"play", 100.0 * play},
           {"percent", 100.0 * c.levels.front().probability},
           {"likeliest", phrase(c.cell, c.levels.front().level)}}};
}

}  // namespace

Cell at_level(const Cell& cell, const ModelLevel& level, std::span<const Touch> touches) {
  Cell result = at_level(cell, level);
  for (Tool& tool : result.other_tools)
    if (std::none_of(touches.begin(), touches.end(), [&](const Touch& touch) {
          return touch.set == TouchSet::kFit && touch.tool == tool.id;
        })) {
      tool.tcp_sigma_m.setZero();
      tool.deflection_sigma = 0.0;
    }
  return result;
}

Cell at_level(const Cell& cell, const ModelLevel& level) {
  Cell result = cell;
  const bool named = largest_transmission_rad(cell) > 0.0;
  const bool compliance_stated = stated(cell.robot, &Joint::compliance_sigma_rad_per_nm);
  if (level.compliance > 0.0 && !compliance_stated && !stated(cell.robot, &Joint::mass_kg))
    assume_masses(result.robot);
  const std::vector<double> load_nm = largest_load_nm(result.robot, cell);
  for (std::size_t i = cell.robot.first_turning(); i < load_nm.size(); ++i) {
    Joint& joint = result.robot.joints[i];
    if (level.compliance > 0.0 && !compliance_stated && load_nm[i] > 0.0)
      joint.compliance_sigma_rad_per_nm = kTypicalSagRad / load_nm[i];  // (9)
    joint.compliance_sigma_rad_per_nm *= level.compliance;
    if (!named) {
      joint.harmonics = kTypicalOrders;
      joint.harmonic_falloff = 1.0;
      joint.gear_ratio = 1.0;
      joint.harmonic_sigma_rad = kTypicalTransmissionRad;
    }
    joint.harmonic_sigma_rad *= level.transmission;
    if (level.play <= 0.0 || load_nm[i] == 0.0) continue;
    joint.play_sigma_rad = level.play * kTypicalPlayRad;
    joint.play_closes_nm = kClosesOfLargest * load_nm[i];
  }
  return result;
}

Phrase phrase(const Cell& cell, const ModelLevel& level) {
  Phrase all("say.level.geometry");
  const auto add = [&all](const Phrase& part) { all = joined("say.join.comma", all, part); };
  if (cell.tool.deflection_sigma > 0.0 ||
      std::any_of(cell.other_tools.begin(), cell.other_tools.end(),
                  [](const Tool& tool) { return tool.deflection_sigma > 0.0; }))
    add("say.level.bending");
  constexpr double kShown = 0.005;  // of the prior
  if (level.compliance > 0.0)
    add(std::abs(level.compliance - 1.0) < kShown
            ? Phrase("say.level.compliance")
            : Phrase("say.level.compliance.sized", {{"size", level.compliance}}));
  if (level.play > 0.0) add("say.level.play");
  if (level.transmission > 0.0)
    add({"say.level.transmission",
         {{"arcsec", largest_transmission_rad(at_level(cell, level)) / kRadPerArcsec}}});
  add_learnt(cell.robot, all);
  if (level.ripple_rad > 0.0)
    add({"say.level.ripple", {{"arcsec", level.ripple_rad / kRadPerArcsec}}});
  return all;
}

std::string words(const Cell& cell, const ModelLevel& level) { return words(phrase(cell, level)); }

Phrase reason_phrase(const Calibration& c) {
  switch (c.level_reason.choice) {
    case LevelChoice::kNone: return {};
    case LevelChoice::kAskedFor: return "say.level.asked_for";
    case LevelChoice::kMeanByEvidence: return mean_phrase(c);
    case LevelChoice::kNothingIdentified: return "say.level.nothing_identified";
    case LevelChoice::kRecorded: return c.level_reason.text;
  }
  return {};
}

Phrase level_and_reason_phrase(const Calibration& c) {
  const LevelChoice choice = c.level_reason.choice;
  const bool of_a_level =
      choice == LevelChoice::kAskedFor || choice == LevelChoice::kMeanByEvidence;
  if (!of_a_level) return reason_phrase(c);
  return joined("say.join.semicolon", phrase(c.cell, c.level), reason_phrase(c));
}

std::string level_and_reason_words(const Calibration& c) {
  return words(level_and_reason_phrase(c));
}

}  // namespace cellcal::calib
