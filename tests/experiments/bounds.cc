// Contributions to the factor between u95 and the true error, one after another, and the smallest
// possible factor.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/trial.h"

namespace {

using namespace cellcal;
using experiments::median;

constexpr int kPostures = 1000, kWorkspacePoses = 200, kArmsDrawn = 1000;
constexpr unsigned kPosturesSeed = 99, kRegionSeed = 20240924;

double quantile(std::vector<double> values, double share) {
  const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double rms(const std::vector<double>& values) {
  return std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0) /
                   static_cast<double>(values.size()));
}

/// Tips at a calibration, and their derivatives by parameters, base and joints; three rows per pose.
struct Seen {
  Seen(const calib::ArmModel& arm, const Eigen::VectorXd& x,
       const std::vector<calib::JointVector>& poses)
      : tips(3, static_cast<Eigen::Index>(poses.size())),
        moves(3 * tips.cols(), arm.size()),
        rigid(3 * tips.cols(), 6) {
    Eigen::Matrix3Xd jacobian(3, arm.size());
    for (Eigen::Index k = 0; k < tips.cols(); ++k) {
      const auto& q = poses[static_cast<std::size_t>(k)];
      tips.col(k) = arm.position(arm.prepare(q), x.data(), jacobian);
      moves.middleRows<3>(3 * k) = jacobian;
      rigid.middleRows<3>(3 * k) = calib::base_motion(tips.col(k));
      by_joint.push_back(arm.nominal_jacobian(q).topRows<3>());
    }
  }

  /// The base motion that compensates each parameter over these of the poses.
  Eigen::MatrixXd taken_up(const std::vector<Eigen::Index>& at) const {
    Eigen::MatrixXd r(3 * static_cast<Eigen::Index>(at.size()), 6), m(r.rows(), moves.cols());
    Eigen::Index row = 0;
    for (const Eigen::Index k : at) {
      r.middleRows<3>(row) = rigid.middleRows<3>(3 * k);
      m.middleRows<3>(row) = moves.middleRows<3>(3 * k);
      row += 3;
    }
    return calib::least_squares(r, m);
  }

  std::vector<Eigen::Index> all() const {
    std::vector<Eigen::Index> at(static_cast<std::size_t>(tips.cols()));
    std::iota(at.begin(), at.end(), 0);
    return at;
  }

  Eigen::Matrix3Xd tips;
  Eigen::MatrixXd moves, rigid;
  std::vector<Eigen::Matrix3Xd> by_joint;
};

/// Alignment of the base: its motion with each parameter, and the uncertainty of that motion.
struct Base {
  Eigen::MatrixXd taken_up;
  Eigen::Matrix<double, 6, 6> unknown = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Over all poses or any half of them, (36).
Base base_of_halves(const Seen& workspace, const Eigen::MatrixXd& covariance) {
  std::vector<Eigen::MatrixXd> each{workspace.taken_up(workspace.all())};
  for (int axis = 0; axis < 3; ++axis) {
    auto order = workspace.all();
    std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
      return workspace.tips(axis, a) < workspace.tips(axis, b);
    });
    const auto middle = order.begin() + static_cast<std::ptrdiff_t>(order.size() / 2);
    each.push_back(workspace.taken_up({order.begin(), middle}));
    each.push_back(workspace.taken_up({middle, order.end()}));
  }
  Base base{Eigen::MatrixXd::Zero(6, covariance.cols())};
  for (const auto& a : each) base.taken_up += a / static_cast<double>(each.size());
  for (const auto& a : each) {
    const Eigen::MatrixXd off = a - base.taken_up;
    base.unknown += off * covariance * off.transpose() / static_cast<double>(each.size());
  }
  return base;
}

std::vector<Eigen::Matrix3d> covariances(const Seen& seen, const Base& base,
                                         const Eigen::MatrixXd& covariance, double ripple_rad2,
                                         double field_m2) {
  std::vector<Eigen::Matrix3d> all;
  for (Eigen::Index k = 0; k < seen.tips.cols(); ++k) {
    const Eigen::MatrixXd b = seen.rigid.middleRows<3>(3 * k);
    const Eigen::MatrixXd j = seen.moves.middleRows<3>(3 * k) - b * base.taken_up;
    const Eigen::Matrix3Xd& v = seen.by_joint[static_cast<std::size_t>(k)];
    Eigen::Matrix3d c = j * covariance * j.transpose() + b * base.unknown * b.transpose() +
                        ripple_rad2 * v * v.transpose();
    c.diagonal().array() += field_m2;
    all.push_back(c);
  }
  return all;
}

double foreseen_rms(const std::vector<Eigen::Matrix3d>& all) {
  double sum = 0.0;
  for (const auto& c : all) sum += c.trace();
  return std::sqrt(sum / static_cast<double>(all.size()));
}

std::vector<double> radii(const std::vector<Eigen::Matrix3d>& all) {
  std::vector<double> r;
  for (const auto& c : all) r.push_back(calib::radius_95(c));
  return r;
}

/// A root F with F F' = covariance, which may be singular and has mixed units.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd inverse = (sigma.array() > 0.0).select(sigma.cwiseInverse(), 0.0);
  const auto pairs = calib::eigenpairs(inverse.asDiagonal() * covariance * inverse.asDiagonal());
  return sigma.asDiagonal() * pairs.vectors * pairs.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

/// After each step, u95 so far (at first its substitute) divided by the true rms.
constexpr const char* kSteps[] = {
    "rms that the covariance foresees, base fixed where it is judged",
    "and with ripple, once",
    "and with scatter beyond what is stated (chi^2/dof)",
    "95 % radius instead of rms",
    "ripple twice",
    "base measured over the estimator's own workspace",
    "base measured over that or any half of it",
    "98 % of the arms: u95",
};

struct Parts {
  std::vector<double> steps;  ///< one for each of kSteps
  double rms_m = 0.0, ripple_arcsec = 0.0;
  /// 85 % of the positions have an error below this share of their u95.
  double holds_85 = 0.0;
  /// For a truth drawn from this covariance: u95 divided by the usual rms, such that 98 % of arms
  /// have 95 % of their positions inside, and such that 99 % have 85 %.
  double ideal_95_98 = 0.0, ideal_85_99 = 0.0;
};

void draw_arms(const Seen& seen, const Base& own, const Eigen::MatrixXd& covariance,
               double ripple_rad, const std::vector<double>& radius, Parts& parts) {
  const Eigen::MatrixXd root = (seen.moves - seen.rigid * own.taken_up) * root_of(covariance);
  calib::Random random(kRegionSeed);
  std::vector<double> needed_95, needed_85, all_rms;
  for (int arm = 0; arm < kArmsDrawn; ++arm) {
    Eigen::VectorXd draw(root.cols());
    for (double& value : draw) value = random.normal();
    const Eigen::VectorXd off = root * draw;
    std::vector<double> ratio, error;
    for (Eigen::Index k = 0; k < seen.tips.cols(); ++k) {
      const Eigen::Matrix3Xd& v = seen.by_joint[static_cast<std::size_t>(k)];
      Eigen::VectorXd ripple(v.cols());
      for (double& value : ripple) value = ripple_rad * random.normal();
      error.push_back((off.segment<3>(3 * k) + v * ripple).norm());
      ratio.push_back(error.back() / radius[static_cast<std::size_t>(k)]);
    }
    needed_95.push_back(quantile(ratio, 0.95));
    needed_85.push_back(quantile(ratio, 0.85));
    all_rms.push_back(rms(error));
  }
  const double usual = mean(radius) / median(all_rms);
  parts.ideal_95_98 = usual * quantile(needed_95, 0.98);
  parts.ideal_85_99 = usual * quantile(needed_85, 0.99);
}

Parts parts_of(const experiments::Session& session, const calib::Calibration& c) {
  const calib::Cell levelled = calib::at_level(c.cell, c.level);
  const calib::ArmModel arm(levelled), nominal(c.cell.robot, c.cell.tool);
  std::map<calib::ParameterKey, Eigen::Index> index;
  for (std::size_t i = 0; i < c.parameters.size(); ++i)
    index[c.parameters[i].key] = static_cast<Eigen::Index>(i);
  const auto place = [&](int i) {
    const auto found = index.find(arm.parameters()[static_cast<std::size_t>(i)]);
    return found == index.end() ? Eigen::Index{-1} : found->second;
  };
  Eigen::VectorXd x = Eigen::VectorXd::Zero(arm.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(arm.size(), arm.size());
  for (int i = 0; i < arm.size(); ++i) {
    const Eigen::Index at = place(i);
    if (at < 0) continue;
    const auto& parameter = c.parameters[static_cast<std::size_t>(at)];
    x[i] = parameter.nominal + parameter.correction;
    for (int j = 0; j < arm.size(); ++j)
      if (place(j) >= 0) covariance(i, j) = c.covariance(at, place(j));
  }
  const auto poses = experiments::postures(nominal, kPostures, kPosturesSeed);
  const Seen seen(arm, x, poses);
  const Seen workspace(arm, x, calib::workspace_poses(arm, kWorkspacePoses, kRegionSeed));

  Eigen::Matrix3Xd real(3, seen.tips.cols());
  for (Eigen::Index k = 0; k < real.cols(); ++k)
    real.col(k) = session.world.arm.tip(poses[static_cast<std::size_t>(k)]);
  const Eigen::Isometry3d motion = calib::rigid_motion(seen.tips, real);
  std::vector<double> error, ratio, u95;
  const calib::Predictor predictor(c);
  for (Eigen::Index k = 0; k < real.cols(); ++k) {
    error.push_back((motion * seen.tips.col(k) - real.col(k)).norm());
    u95.push_back(predictor.calibrated(poses[static_cast<std::size_t>(k)]).u95_m);
    ratio.push_back(error.back() / u95.back());
  }

  const Base own{seen.taken_up(seen.all())}, whole{workspace.taken_up(workspace.all())};
  const Base halves = base_of_halves(workspace, covariance);
  const double ripple = c.level.ripple_rad * c.level.ripple_rad;
  const double field = c.discrepancy.sigma_m * c.discrepancy.sigma_m;
  const Eigen::MatrixXd stated = covariance / std::max(1.0, c.chi2_per_dof);
  const auto once = covariances(seen, own, covariance, ripple, field);
  Parts parts;
  parts.rms_m = rms(error);
  parts.ripple_arcsec = c.level.ripple_rad / calib::kRadPerArcsec;
  parts.holds_85 = quantile(ratio, 0.85);
  parts.steps = {foreseen_rms(covariances(seen, own, stated, 0.0, field)),
                 foreseen_rms(covariances(seen, own, stated, ripple, field)),
                 foreseen_rms(once),
                 mean(radii(once)),
                 mean(radii(covariances(seen, own, covariance, 2.0 * ripple, field))),
                 mean(radii(covariances(seen, whole, covariance, 2.0 * ripple, field))),
                 mean(radii(covariances(seen, halves, covariance, 2.0 * ripple, field))),
                 mean(u95)};
  for (double& step : parts.steps) step /= parts.rms_m;
  draw_arms(seen, own, covariance, c.level.ripple_rad, radii(once), parts);
  return parts;
}

void print(const std::vector<Parts>& all) {
  const auto column = [&](auto&& of) {
    std::vector<double> values;
    for (const Parts& p : all) values.push_back(of(p));
    return values;
  };
  fmt::print("{} arms, true rms {:.4f} mm, ripple found {:.2f} arcsec (medians)\n", all.size(),
             1e3 * median(column([](const Parts& p) { return p.rms_m; })),
             median(column([](const Parts& p) { return p.ripple_arcsec; })));
  for (std::size_t s = 0; s < std::size(kSteps); ++s) {
    const auto v = column([&](const Parts& p) { return p.steps[s]; });
    fmt::print("  {:<66} {:.2f}   ({:.2f} to {:.2f})\n", kSteps[s], median(v), quantile(v, 0.05),
               quantile(v, 0.95));
  }
  const auto holds = column([](const Parts& p) { return p.holds_85; });
  double sum = 0.0, square = 0.0;
  for (const double h : holds) {
    sum += std::log(h) / static_cast<double>(all.size());
    square += std::pow(std::log(h), 2) / static_cast<double>(all.size());
  }
  constexpr double kNormal99 = 2.326;
  const double sigma = std::sqrt(std::max(0.0, square - sum * sum));
  const double one_of_100 = std::exp(sum + kNormal99 * sigma);
  const double ratio = median(column([](const Parts& p) { return p.steps.back(); }));
  fmt::print(
      "  share of u95 that holds 85 % of an arm's positions: median {:.2f}, worst {:.2f}; "
      "differs from arm to arm by a factor exp({:.2f}), 1 sigma\n",
      median(holds), *std::max_element(holds.begin(), holds.end()), sigma);
  fmt::print("  least median ratio with which 99 of 100 such arms have 85 % inside: {:.2f}\n",
             ratio * one_of_100);
  fmt::print("  least were the covariance exact: {:.2f}; and 95 % inside on 98 of 100: {:.2f}\n",
             median(column([](const Parts& p) { return p.ideal_85_99; })),
             median(column([](const Parts& p) { return p.ideal_95_98; })));
}

}  // namespace

int main(int argc, char** argv) {
  try {
    int robots = 40;
    std::uint64_t seed = 61;
    std::string level = "L2", gears = "harmonics", touches = "planned",
                file = CELLCAL_EXPERIMENT_ROBOT;
    experiments::Trial trial;
    cellcal::CommandLine app(
        "Where the factor between u95 and the true error comes from.\n"
        "Example: bounds --level L3 --gears spectrum --gear-arcsec 20");
    app.option("--robots", robots, "").between(3, 1000);
    app.option("--seed", seed, "");
    app.option("--level", level, "").one_of({"L2", "L3"});
    app.option("--gears", gears, "Truth's form").one_of({"none", "harmonics", "spectrum"});
    app.option("--gear-arcsec", trial.gear_arcsec, "rms per joint");
    app.option("--touches", touches, "planned or random").one_of({"planned", "random"});
    app.option("--robot", file, "Robot file");
    if (const auto code = app.parse(argc, argv)) return *code;
    trial.spheres = level == "L3" ? 6 : 4;
    trial.fit = level == "L3" ? 400 : 100;
    trial.gears = gears == "none"       ? experiments::Gears::kNone
                  : gears == "spectrum" ? experiments::Gears::kSpectrum
                                        : experiments::Gears::kHarmonics;
    if (touches == "random") trial.criterion = calib::Criterion::kRandom;
    const calib::Robot robot = calib::load_robot(file);
    std::vector<Parts> all;
    for (std::uint64_t k = 0; static_cast<int>(all.size()) < robots && k < 2000; ++k) {
      const auto session = experiments::measured(robot, trial, seed * 1000 + k);
      if (!session) continue;
      const auto c =
          calib::identify(session->world.cell, session->touches, {}, calib::shipped_robots);
      if (c.verdict.publish()) all.push_back(parts_of(*session, c));
    }
    if (all.size() < 3) {
      fmt::print("no three cells could be planned and published\n");
      return 1;
    }
    print(all);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "bounds: %s\n", e.what());
    return 1;
  }
}
