#include "calib/identify/moved.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "calib/files/error.h"
#include "calib/files/iso_time.h"
#include "calib/identify/discrepancy.h"
#include "calib/identify/outliers.h"

namespace cellcal::calib {

namespace {

/// Touches of one target on either side of a move, at least: three for where it is, and two more.
constexpr std::size_t kLeastEachSide = 5;
/// So many places of a target's sequence are tried; a move between two of them is seen by both.
constexpr std::size_t kSplits = 7;
/// Squared sigmas of a shift, three degrees of freedom: worth a closer look, and believed.
constexpr double kSuspect = 16.0;
constexpr double kConfirmed = 25.0;
/// At most so many closer looks, each of which costs an identification.
constexpr std::size_t kLooks = 3;
/// So many touches of one target left out are no gross errors any more: it may have moved so far
/// that all from there on were. Fewer cannot speak for a move; gross errors would find one.
constexpr std::size_t kManyLeftOut = 3;
/// And where: two rates have to be likelier than one by this much (e^10). Five of 67 do if they are
/// the last ones; three of the last five and one before do not.
constexpr double kNoChance = 10.0;
/// What is looked for, 1 sigma in each direction. What a touch or two leave open is not filled with
/// moves of centimetres, which nobody would overlook.
constexpr double kUsualMoveM = 1e-3;
/// An arm that warms up grows by 25e-6 of what it reaches, and its play is not the same all day;
/// each makes targets seem to creep by about this, in each direction.
constexpr double kCreepM = 0.02e-3;

using ThreeRows = Eigen::Matrix<double, 3, Eigen::Dynamic>;

/// What some rows say about a shift d of their target, all other unknowns left free: with G its
/// columns, information G'G - G'J S J'G and pull G'r.
struct Said {
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();  ///< G'G
  ThreeRows by_all;                                  ///< G'J
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();    ///< G'r

  explicit Said(Eigen::Index unknowns) : by_all(ThreeRows::Zero(3, unknowns)) {}

  void add(const Linearisation& linear, int row, int rows, int first) {
    for (int k = row; k < row + rows; ++k) {
      const Eigen::Vector3d g = linear.jacobian.row(k).segment<3>(first).transpose();
      square += g * g.transpose();
      by_all.noalias() += g * linear.jacobian.row(k);
      pull += linear.residual[k] * g;
    }
  }

  /// By which the shift differs from none.
  double squared_sigmas(const Eigen::MatrixXd& covariance_u, double usual_u) const {
    Eigen::Matrix3d information = square - by_all * covariance_u * by_all.transpose();
    information.diagonal().array() += 1.0 / (usual_u * usual_u);
    const Eigen::LDLT<Eigen::Matrix3d> factor(information);
    return factor.isPositive() ? pull.dot(factor.solve(pull)) : 0.0;
  }
};

struct Split {
  std::size_t at = 0;  ///< first touch behind it
  double squared_sigmas = 0.0;
};

/// The split of a target's touches in use that speaks most for a move.
Split loudest_split(const Problem& problem, const Estimate& e, const std::vector<int>& row_of,
                    const TargetBlock& block, const std::vector<std::size_t>& used) {
  Split best;
  const double usual_u =
      kUsualMoveM / problem.unknowns()[static_cast<std::size_t>(block.first)].scale;
  const auto scan = [&](std::size_t first, std::size_t last, std::size_t step) {
    // From the last touch back, so that what the later ones say is summed up once.
    Said later(problem.size());
    for (std::size_t k = used.size(); k-- > first;) {
      later.add(e.posterior.linear, row_of[used[k]], problem.rows(used[k]), block.first);
      if (k > last || (k - first) % step != 0) continue;
      const double said = later.squared_sigmas(e.posterior.covariance_u, usual_u);
      if (said > best.squared_sigmas) best = {k, said};
    }
  };
  const std::size_t first = kLeastEachSide, last = used.size() - kLeastEachSide;
  const std::size_t step = std::max<std::size_t>(1, used.size() / (kSplits + 1));
  scan(first, last, step);
  if (best.squared_sigmas > kSuspect && step > 1)
    scan(best.at > first + step ? best.at - step : first, std::min(best.at + step, last), 1);
  return best;
}

/// Where touches begin or cease to be left out: the split for which two rates explain best which
/// ones are; none where gross errors that fall together by chance would do.
std::optional<std::size_t> split_of_left_out(const std::vector<std::size_t>& own,
                                             const std::vector<bool>& use) {
  const auto log_likelihood = [](double out, double of) {
    const double in = of - out;
    return (out > 0.0 ? out * std::log(out / of) : 0.0) + (in > 0.0 ? in * std::log(in / of) : 0.0);
  };
  double all = 0.0, before = 0.0;
  for (const std::size_t i : own) all += use[i] ? 0.0 : 1.0;
  std::size_t best = kLeastEachSide;
  double most = -1e300;
  for (std::size_t k = 0; k + kLeastEachSide <= own.size(); ++k) {
    if (k >= kLeastEachSide) {
      const auto behind = static_cast<double>(own.size() - k);
      const double likelihood =
          log_likelihood(before, static_cast<double>(k)) + log_likelihood(all - before, behind);
      if (likelihood > most) {
        most = likelihood;
        best = k;
      }
    }
    before += use[own[k]] ? 0.0 : 1.0;
  }
  const double at_random = log_likelihood(all, static_cast<double>(own.size()));
  return most - at_random > kNoChance ? std::optional(best) : std::nullopt;
}

/// Whether a target has no fit touch, or more of them are left out than gross errors would be: then
/// it does not stand where the others say either. Of a move that is known from the evidence of all
/// touches, a few may be on the wrong side.
bool disagree(const Calibration& c, const std::vector<Touch>& touches, const std::string& target,
              bool known) {
  const double most = known ? 0.4 : 0.2;
  const FitTouches own = fit_touches_of(target, touches, c);
  return own.all == 0 || own.left_out > most * own.all;
}

/// Identifies with the target taken as two and says by how much they lie apart; 0 where that does
/// not come out.
MovedTarget measured(const Cell& cell, const std::vector<Touch>& touches,
                     const IdentifyOptions& options, const Calibration& as_one, MovedTarget moved) {
  std::optional<Eigen::Vector3d> centre_m;
  for (const TargetResult& t : as_one.targets)
    if (t.id == moved.target) centre_m = t.centre_m + moved.shift_m;
  const TwoPlaces places = as_two(cell, touches, moved.target, moved.after_touch, centre_m,
                                  std::max(kUsualMoveM, moved.shift_m.norm()));
  const bool known = moved.shift_m.norm() > 0.0;
  moved.squared_sigmas = 0.0;
  Calibration two;
  try {
    two = identify_as_stated(places.cell, places.touches, options);
  } catch (const IdentifyError&) {
    return moved;  // too little on one side to tell
  }
  if (disagree(two, places.touches, moved.target, known) ||
      disagree(two, places.touches, places.later, known))
    return moved;
  // What the arm does beside its model pulls targets about, and is still there with two of them.
  if (two.discrepancy.alike > kFieldSigmas) return moved;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  Eigen::MatrixXd by = Eigen::MatrixXd::Zero(3, two.covariance.cols());
  for (std::size_t p = 0; p < two.parameters.size(); ++p)
    for (int axis = 0; axis < 3; ++axis) {
      const std::string name = std::string(".") + "xyz"[axis];
      const bool is_later = two.parameters[p].name == places.later + name;
      if (!is_later && two.parameters[p].name != moved.target + name) continue;
      by(axis, static_cast<Eigen::Index>(p)) = is_later ? 1.0 : -1.0;
      shift[axis] +=
          (is_later ? 1.0 : -1.0) * (two.parameters[p].nominal + two.parameters[p].correction);
    }
  const Eigen::Matrix3d covariance =
      by * two.covariance * by.transpose() + kCreepM * kCreepM * Eigen::Matrix3d::Identity();
  moved.shift_m = shift;
  moved.sigma_m = std::sqrt(shift.dot(covariance * shift)) / shift.norm();
  moved.squared_sigmas = shift.dot(covariance.ldlt().solve(shift));
  return moved;
}

}  // namespace

std::vector<std::size_t> in_order(std::span<const Touch> touches) {
  std::vector<std::size_t> order(touches.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<double> seconds;
  for (const Touch& touch : touches) {
    const auto time = seconds_of(touch.time);
    if (!time) return order;
    seconds.push_back(*time);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return seconds[a] < seconds[b]; });
  return order;
}

std::vector<MovedTarget> suspected_moves(const Problem& problem, const Estimate& e,
                                         double chi2_per_dof) {
  std::vector<int> row_of(problem.touches().size(), -1);
  for (const auto& [touch, row] : e.posterior.linear.touch_row) row_of[touch] = row;
  std::vector<std::vector<std::size_t>> sequence(problem.blocks().size());
  for (const std::size_t i : in_order(problem.touches()))
    if (problem.touches()[i].set == TouchSet::kFit)
      sequence[static_cast<std::size_t>(problem.block_of(i))].push_back(i);
  std::vector<MovedTarget> suspects;
  for (std::size_t b = 0; b < sequence.size(); ++b) {
    const std::vector<std::size_t>& own = sequence[b];
    const TargetBlock& block = problem.blocks()[b];
    if (!has_a_centre(problem.cell().targets[block.target].kind)) continue;
    if (own.size() < 2 * kLeastEachSide) continue;
    MovedTarget suspect;
    suspect.target = problem.cell().targets[block.target].id;
    std::vector<std::size_t> used;
    for (const std::size_t i : own)
      if (row_of[i] >= 0) used.push_back(i);
    if (used.size() >= 2 * kLeastEachSide) {
      const Split split = loudest_split(problem, e, row_of, block, used);
      suspect.squared_sigmas = split.squared_sigmas / std::max(1.0, chi2_per_dof);
      if (suspect.squared_sigmas > kSuspect) {
        suspect.after_touch = used[split.at - 1];
        suspects.push_back(suspect);
      }
    }
    if (own.size() - used.size() < kManyLeftOut) continue;
    if (const auto split = split_of_left_out(own, e.use)) {
      suspect.after_touch = own[*split - 1];
      suspect.many_left_out = true;
      // Before all others: what is left out is far off.
      constexpr double kFarOff = 1e6;
      suspect.squared_sigmas += kFarOff;
      suspects.push_back(suspect);
    }
  }
  std::stable_sort(suspects.begin(), suspects.end(),
                   [](const MovedTarget& a, const MovedTarget& b) {
                     return a.squared_sigmas > b.squared_sigmas;
                   });
  if (suspects.size() > kLooks) suspects.resize(kLooks);
  return suspects;
}

std::vector<std::size_t> share_of(std::span<const Touch> touches, std::size_t most) {
  const std::size_t every = (touches.size() + most - 1) / most;
  std::map<std::pair<std::string, TouchSet>, std::size_t> seen;
  std::vector<std::size_t> share;
  for (const std::size_t i : in_order(touches))
    if (seen[{touches[i].target, touches[i].set}]++ % every == 0) share.push_back(i);
  std::sort(share.begin(), share.end());
  return share;
}

std::string id_after_move(const Cell& cell, const std::string& id) {
  std::string later = id;
  do later += " later";
  while (std::any_of(cell.targets.begin(), cell.targets.end(),
                     [&](const Target& target) { return target.id == later; }));
  return later;
}

TwoPlaces as_two(const Cell& cell, const std::vector<Touch>& touches, const std::string& target,
                 std::size_t after_touch, const std::optional<Eigen::Vector3d>& centre_m,
                 double sigma_m) {
  TwoPlaces two{cell, touches, id_after_move(cell, target)};
  Target later = cell.targets[cell.target_index(target)];
  later.id = two.later;
  later.centre_sigma_m = 0.0;
  if (centre_m) {
    later.has_centre = true;
    later.centre_m = *centre_m;
    later.centre_sigma_m = sigma_m;
  }
  two.cell.targets.push_back(later);
  bool passed = false;
  for (const std::size_t i : in_order(touches)) {
    if (passed && two.touches[i].target == target) two.touches[i].target = later.id;
    passed = passed || i == after_touch;
  }
  return two;
}

void confirm_moves(const Cell& cell, const std::vector<Touch>& touches,
                   const IdentifyOptions& options, Calibration& calibration) {
  std::optional<MovedTarget> worst;
  for (const MovedTarget& suspect : calibration.moved) {
    std::vector<Touch> kept = touches;
    if (!suspect.many_left_out)
      for (const Outlier& outlier : calibration.outliers)
        kept[outlier.touch].set = TouchSet::kCheck;
    MovedTarget moved = measured(cell, kept, options, calibration, suspect);
    if (moved.squared_sigmas > kConfirmed &&
        (!worst || moved.squared_sigmas > worst->squared_sigmas))
      worst = moved;
  }
  calibration.moved.clear();
  if (!worst) return;
  calibration.moved.push_back(*worst);
  calibration.verdict.publish = false;
  auto& reasons = calibration.verdict.reasons;
  const Eigen::Vector3d mm = worst->shift_m * 1e3;
  reasons.insert(
      reasons.begin(),
      fmt::format("moved target: {} moved by {:.2f} +- {:.2f} mm ({:+.2f}, {:+.2f}, {:+.2f}) after "
                  "{}; clamp it, and repeat from there",
                  worst->target, mm.norm(), worst->sigma_m * 1e3, mm.x(), mm.y(), mm.z(),
                  touch_words(worst->after_touch, touches[worst->after_touch])));
}

}  // namespace cellcal::calib
