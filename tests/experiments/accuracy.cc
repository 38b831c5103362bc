// The accuracy of the method's section 9, measured over random robots.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "calib/files/documents.h"
#include "calib/files/files.h"
#include "calib/identify/identify.h"
#include "calib/identify/predict.h"
#include "calib/identify/region.h"
#include "tests/experiments/session.h"

namespace {

using namespace cellcal;
using experiments::Gears;
using experiments::SessionSettings;
using experiments::TrueArm;

struct Level {
  const char* name;
  int spheres, fit;
  double touch_sigma_m;
  bool lengths, ideal;
  const char* target;
};
constexpr Level kLevels[] = {
    {"L0", 1, 50, 1e-9, false, true, "M1 < 1e-6"},
    {"L1", 1, 50, 0.03e-3, false, false, "M1 0.04/0.13  M2 0.12/0.30  M3 0.45/1.10"},
    {"L2", 4, 100, 0.03e-3, true, false, "M1 0.035/0.11 M2 0.08/0.20  M3 0.09/0.27"},
    {"L3", 6, 400, 0.03e-3, true, false, "M1 0.03/0.09  M2 0.04/0.12  M3 0.05/0.15"},
};

struct Options {
  int robots = 20, check = 30;
  Gears gears = Gears::kHarmonics;
  double gear_arcsec = 10.0;
  bool planned = true;
  std::string level, arm;
  std::uint64_t seed = 1;
};

struct Outcome {
  double m1 = 0, m1_max = 0, m2 = 0, m2_max = 0, m3 = 0, m3_max = 0, m4 = 1, m4_local = 1;
  double ratio = 0, rho_error = 0, predicted_m3 = 0;
  bool published = false;
  std::string why_not, level;
};

/// Region figures after a 6-DoF alignment.
void judge(const TrueArm& arm, const calib::Predictor& predictor,
           const std::vector<calib::JointVector>& poses, double& mean, double& max, double& rms,
           double& covered, double& u95_mean) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  Eigen::Matrix3Xd real(3, n), predicted(3, n);
  Eigen::VectorXd u95(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& q = poses[static_cast<std::size_t>(i)];
    const calib::Prediction p = predictor.calibrated(q);
    real.col(i) = arm.tip(q);
    predicted.col(i) = p.tcp.translation();
    u95[i] = p.u95_m;
  }
  const Eigen::Matrix4d motion = Eigen::umeyama(predicted, real, false);
  const Eigen::VectorXd e =
      ((motion.topLeftCorner<3, 3>() * predicted).colwise() + motion.topRightCorner<3, 1>() - real)
          .colwise()
          .norm()
          .transpose();
  mean = e.mean();
  max = e.maxCoeff();
  rms = std::sqrt(e.squaredNorm() / static_cast<double>(n));
  covered = static_cast<double>((e.array() <= u95.array()).count()) / static_cast<double>(n);
  u95_mean = u95.mean();
}

/// Postures in which the aims are judged: in front of the arm, as in the cases that the aims were
/// set with. Narrower than what predictions and plans take for the workspace.
std::vector<calib::JointVector> postures(const calib::ArmModel& arm, int count, unsigned seed) {
  constexpr double kLowDeg[] = {-60.0, -120.0, 20.0, -170.0, -110.0, -170.0};
  constexpr double kHighDeg[] = {60.0, -10.0, 145.0, 170.0, 110.0, 170.0};
  constexpr double kFloorM = 0.05;
  if (arm.joint_count() != 6) return calib::workspace_poses(arm, count, seed);
  calib::Random random(seed);
  std::vector<calib::JointVector> poses;
  while (static_cast<int>(poses.size()) < count) {
    calib::JointVector q(6);
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = random.uniform(kLowDeg[i], kHighDeg[i]) * std::numbers::pi / 180.0;
    if (arm.nominal_tip_m(q).z() > kFloorM) poses.push_back(std::move(q));
  }
  return poses;
}

std::optional<Outcome> one_robot(const calib::Robot& robot, const Level& level,
                                 const Options& options, std::uint64_t seed) {
  SessionSettings settings;
  settings.spheres = level.spheres;
  settings.fit = level.fit;
  settings.check = options.check;
  settings.touch_sigma_m = level.touch_sigma_m;
  settings.lengths = level.lengths;
  settings.ideal = level.ideal;
  settings.planned = options.planned;
  settings.truth.gears = options.gears;
  settings.truth.gear_arcsec = options.gear_arcsec;
  auto planned = plan_session(robot, settings, seed);
  if (!planned) return std::nullopt;
  const auto [cell, arm, centre, rho, touches] = carry_out(*std::move(planned), settings);
  const calib::Calibration c = calib::identify(cell, touches);
  const calib::Predictor predictor(c);
  Outcome o;
  o.m1 = c.check.mean_m;
  o.m1_max = c.check.max_m;
  o.published = c.verdict.publish;
  if (!o.published && !c.verdict.reasons.empty()) o.why_not = c.verdict.reasons.front();
  o.level = calib::words(cell, c.level);
  for (const auto& t : c.targets)
    o.rho_error = std::max(o.rho_error, std::abs(t.effective_radius_m - 0.0307 - rho));
  const calib::ArmModel model(robot, cell.tool);
  double rms = 0, u95 = 0;
  judge(arm, predictor, postures(model, 1000, 99), o.m3, o.m3_max, rms, o.m4, u95);
  o.ratio = u95 / rms;
  o.predicted_m3 = c.predicted_m3_m;
  std::vector<calib::JointVector> around;
  for (const auto& t : touches) around.push_back(t.joint_rad);
  judge(arm, predictor, calib::local_poses(model, around, centre, 0.15, 300, 98), o.m2, o.m2_max,
        rms, o.m4_local, u95);
  return o;
}

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0.0 : v[v.size() / 2];
}

void run(const calib::Robot& robot, const Level& level, const Options& options) {
  std::vector<Outcome> all;
  for (std::uint64_t k = 0; static_cast<int>(all.size()) < options.robots && k < 200; ++k)
    if (const auto o = one_robot(robot, level, options, options.seed * 1000 + k)) all.push_back(*o);
  if (all.empty()) {
    fmt::print("{}: no cell could be planned\n", level.name);
    return;
  }
  const auto column = [&](double Outcome::*field, double scale) {
    std::vector<double> v;
    for (const Outcome& o : all) v.push_back(o.*field * scale);
    return v;
  };
  const auto show = [&](const char* name, double Outcome::*mean, double Outcome::*max) {
    const auto a = column(mean, 1e3), b = column(max, 1e3);
    fmt::print("  {:<26} median {:.3g}/{:.3g}   worst {:.3g}/{:.3g}\n", name, median(a), median(b),
               *std::max_element(a.begin(), a.end()), *std::max_element(b.begin(), b.end()));
  };
  fmt::print("{}: {} sphere(s), {} touches, {} robots      targets: {}\n", level.name,
             level.spheres, level.fit, all.size(), level.target);
  show("M1 held-out touches [mm]", &Outcome::m1, &Outcome::m1_max);
  show("M2 near targets [mm]", &Outcome::m2, &Outcome::m2_max);
  show("M3 workspace [mm]", &Outcome::m3, &Outcome::m3_max);
  std::vector<double> cover, cover_local, ratio;
  int published = 0;
  std::string reasons;
  for (const Outcome& o : all) {
    if (!o.published) {
      reasons += "    withheld: " + o.why_not + "\n";
      continue;
    }
    ++published;
    cover.push_back(o.m4);
    cover_local.push_back(o.m4_local);
    ratio.push_back(o.ratio);
  }
  const auto least = [](const std::vector<double>& v) {
    return v.empty() ? 0.0 : *std::min_element(v.begin(), v.end());
  };
  fmt::print(
      "  published {}/{}; of these M4 median {:.1f} % worst {:.1f} % (near targets {:.1f} %, "
      "{:.1f} %); "
      "u95/rms median {:.2f}\n",
      published, all.size(), 100 * median(cover), 100 * least(cover), 100 * median(cover_local),
      100 * least(cover_local), median(ratio));
  fmt::print(
      "  effective radius off by [mm]: median {:.4f}, worst {:.4f}; predicted M3 median {:.3f}\n{}",
      median(column(&Outcome::rho_error, 1e3)),
      [&] {
        const auto v = column(&Outcome::rho_error, 1e3);
        return *std::max_element(v.begin(), v.end());
      }(),
      median(column(&Outcome::predicted_m3, 1e3)), reasons);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Options options;
    std::string gears = "harmonics", touches = "planned";
    options.arm = CELLCAL_EXPERIMENT_ROBOT;
    CLI::App app(
        "Accuracy over random robots, beside the targets of the method (section 9).\n"
        "Example: accuracy --robots 20 --gears spectrum");
    app.add_option("--robots", options.robots, "Per level")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    app.add_option("--gears", gears, "Truth's form")
        ->capture_default_str()
        ->check(CLI::IsMember({"none", "harmonics", "spectrum"}));
    app.add_option("--gear-arcsec", options.gear_arcsec, "rms per joint")->capture_default_str();
    app.add_option("--touches", touches, "planned or random")
        ->capture_default_str()
        ->check(CLI::IsMember({"planned", "random"}));
    app.add_option("--level", options.level, "Only this one")
        ->check(CLI::IsMember({"L0", "L1", "L2", "L3"}));
    app.add_option("--robot", options.arm, "Robot file")->capture_default_str();
    app.add_option("--seed", options.seed, "")->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    options.gears = gears == "none"       ? Gears::kNone
                    : gears == "spectrum" ? Gears::kSpectrum
                                          : Gears::kHarmonics;
    options.planned = touches == "planned";
    const calib::Robot robot = calib::load_robot(options.arm);
    for (const Level& level : kLevels) {
      if (!options.level.empty() && options.level != level.name) continue;
      calib::Robot arm = robot;
      if (level.ideal)
        for (calib::Joint& joint : arm.joints) {
          joint.mass_kg = 0.0;
          joint.compliance_sigma_rad_per_nm = 0.0;
        }
      run(arm, level, options);
    }
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "accuracy: %s\n", e.what());
    return 1;
  }
}
