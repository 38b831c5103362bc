#include "calib/estimate/evidence.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <list>

#include "calib/estimate/repeats.h"
#include "calib/model/error.h"
#include "calib/model/long_work.h"
#include "calib/model/product.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

struct Prior {
  double value, probability;
};
/// Smooth transmission error relative to the usual one; a factor of two either way is common.
constexpr Prior kTransmission[] = {{0.0, 0.05}, {0.5, 0.25}, {1.0, 0.40}, {2.0, 0.20}, {4.0, 0.10}};
/// In steps small enough for one to be near any actual value: with 5 and 15 arcsec alone a ripple
/// of 9 was taken for 5, with 0 and 5 one of 2.5 for 0, and the bounds were too small.
constexpr Prior kRipple[] = {{0.0, 0.25},
                             {2.5 * kRadPerArcsec, 0.35},
                             {6.0 * kRadPerArcsec, 0.25},
                             {15.0 * kRadPerArcsec, 0.15}};
/// Additional ripple of joints with functions, between the last two: the part the functions leave.
constexpr Prior kRippleBeside{10.0 * kRadPerArcsec, 0.2};
/// Relative to the compliance in the robot file, which is the largest to be expected; a third of it
/// is as common. Zero is not included: with 0 in place of 0.1, arms with a tenth of the compliance
/// were taken for rigid, and of the worst of them a quarter of the poses were outside their bound
/// (calib/estimate/README.md).
constexpr double kLargest = 1.0;
constexpr Prior kCompliance[] = {{0.1, 0.2}, {0.3, 0.4}, {kLargest, 0.4}};
/// Prior odds: three in ten arms of the largest compliance also have play. Only with the largest
/// compliance, since joints with play have more than one kind of compliance.
constexpr double kPlayed = 0.3 / 0.7;
/// Log evidence below the best (probability e^-9) from which a level is neglected.
constexpr double kNegligibleOdds = 9.0;
/// Total probability of the most likely levels whose covariances are computed; the others
/// contribute by the distance of their means alone.
constexpr double kCountedShare = 0.999;

double log_prior(const ModelLevel& level) {
  double sum = 0.0;
  for (const Prior& p : kCompliance)
    if (p.value == level.compliance) sum += std::log(p.probability);
  if (level.play > 0.0) sum += std::log(kPlayed);
  for (const Prior& p : kTransmission)
    if (p.value == level.transmission) sum += std::log(p.probability);
  for (const Prior& p : kRipple)
    if (p.value == level.ripple_rad) sum += std::log(p.probability);
  if (level.ripple_rad == kRippleBeside.value) sum += std::log(kRippleBeside.probability);
  return sum;
}

/// Without the levels that have no ripple, where the touches' noise as used leaves most of the stated
/// one to their postures.
std::vector<ModelLevel> offered(const Problem& problem, std::span<const ModelLevel> levels) {
  std::vector<ModelLevel> all(levels.begin(), levels.end()), rippled = all;
  std::erase_if(rippled, [](const ModelLevel& level) { return level.ripple_rad == 0.0; });
  const auto touches = problem.touches();
  for (std::size_t i = 0; i < touches.size(); ++i)
    if (!(touches[i].sigma_m > 0.0))
      return !rippled.empty() &&
                     problem.own_sigma_m(i) < kNoFigureShare * problem.cell().touch_sigma_m
                 ? rippled
                 : all;
  return all;
}

struct Solved {
  Step step;
  const Family* family;
};

/// Solutions of the levels, most likely first. Families and their references must outlive them.
std::vector<Solved> solve_all(std::span<const ModelLevel> levels,
                              const std::function<Family*(const ModelLevel&)>& family_of) {
  std::vector<Solved> solved;
  for (const ModelLevel& level : levels) {
    poll_cancelled();
    Family* family = family_of(level);
    Step step = family->solve(level);
    step.log_evidence += log_prior(level);
    if (step.solved) solved.push_back({std::move(step), family});
  }
  if (solved.empty())
    throw IdentifyError(IdentifyError::Kind::kUndetermined,
                        "the touches and priors do not determine the unknowns; give the targets a "
                        "centre_sigma_mm and the joints tolerances");
  std::stable_sort(solved.begin(), solved.end(), [](const Solved& a, const Solved& b) {
    return a.step.log_evidence > b.step.log_evidence;
  });
  return solved;
}

/// Mean of the levels that are not negligible, in the groups' order.
struct Weighed {
  Eigen::VectorXd mean;
  std::vector<Eigen::VectorXd> solutions;
  std::vector<double> weight;  ///< of each solution
  std::size_t counted = 0;     ///< number of levels whose covariances count
  double sum_counted = 0.0;
};

/// Weights the levels; writes them and their means to `result`.
Weighed weigh(const std::vector<Solved>& solved, Eigen::Index size, LevelMean& result) {
  const double best = solved.front().step.log_evidence;
  double sum = 0.0, sum_of_influential = 0.0;
  for (const Solved& s : solved) {
    const double likelihood = std::exp(s.step.log_evidence - best);
    sum += likelihood;
    if (best - s.step.log_evidence <= kNegligibleOdds) sum_of_influential += likelihood;
  }
  Weighed all;
  all.mean = Eigen::VectorXd::Zero(size);
  for (const Solved& s : solved) {
    const double likelihood = std::exp(s.step.log_evidence - best);
    result.levels.push_back({s.step.level, s.step.log_evidence, likelihood / sum});
    if (best - s.step.log_evidence > kNegligibleOdds) continue;
    const double weight = likelihood / sum_of_influential;
    all.weight.push_back(weight);
    all.solutions.push_back(s.family->solution(s.step));
    all.mean += weight * all.solutions.back();  // (27)
    if (all.sum_counted > kCountedShare) continue;
    ++all.counted;
    all.sum_counted += weight;
    result.ripple_rad += weight * std::pow(s.step.level.ripple_rad, 2);
    result.transmission += weight * std::pow(s.step.level.transmission, 2);
    result.compliance += weight * std::pow(s.step.level.compliance, 2);
    result.play += weight * std::pow(s.step.level.play, 2);
  }
  result.ripple_rad = std::sqrt(result.ripple_rad / all.sum_counted);
  result.transmission = std::sqrt(result.transmission / all.sum_counted);
  result.compliance = std::sqrt(result.compliance / all.sum_counted);
  result.play = std::sqrt(result.play / all.sum_counted);
  return all;
}

/// (27): covariance within the levels, and between them.
Eigen::MatrixXd covariance_of(const std::list<Eliminated>& eliminated,
                              const std::list<Family>& families, const std::vector<Solved>& solved,
                              const Weighed& all) {
  const Eigen::Index size = all.mean.size();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
  for (const Eliminated& plain : eliminated) {
    const Eigen::Index others = plain.coupling.cols();
    Eigen::MatrixXd of_others = Eigen::MatrixXd::Zero(others, others);
    double weight = 0.0;
    for (const Family& family : families) {
      std::vector<std::pair<const Step*, double>> own;
      for (std::size_t k = 0; k < all.counted; ++k)
        if (solved[k].family == &family && &family.plain() == &plain)
          own.emplace_back(&solved[k].step, all.weight[k] / all.sum_counted);
      for (const auto& [step, w] : own) weight += w;
      if (!own.empty()) family.add_covariance(own, of_others);
    }
    if (weight > 0.0) plain.add_covariance(weight, of_others, covariance);
  }
  Eigen::MatrixXd off(size, static_cast<Eigen::Index>(all.solutions.size()));
  for (std::size_t k = 0; k < all.solutions.size(); ++k)
    off.col(static_cast<Eigen::Index>(k)) =
        std::sqrt(all.weight[k]) * (all.solutions[k] - all.mean);
  add_product(1.0, off, off.transpose(), covariance);
  return covariance;
}

}  // namespace

std::vector<ModelLevel> usual_levels(bool with_play) {
  std::vector<ModelLevel> levels;
  for (const Prior& ripple : kRipple)
    for (const Prior& compliance : kCompliance)
      for (const double play : {0.0, 1.0})
        for (const Prior& transmission : kTransmission)
          if (play == 0.0 || (with_play && compliance.value == kLargest))
            levels.push_back({compliance.value, transmission.value, ripple.value, play});
  return levels;
}

std::vector<ModelLevel> levels_beside_functions(bool with_play) {
  std::vector<ModelLevel> levels = usual_levels(with_play), between = levels;
  std::erase_if(between, [](const ModelLevel& level) { return level.ripple_rad != 0.0; });
  for (ModelLevel& level : between) level.ripple_rad = kRippleBeside.value;
  levels.insert(levels.end(), between.begin(), between.end());
  return levels;
}

PlayBeforehand play_beforehand() {
  return {kPlayed, kPlayed * kCompliance[std::size(kCompliance) - 1].probability};
}

LevelSums::LevelSums(const Problem& problem, const Eigen::VectorXd& u, const Linearisation& at,
                     std::span<const ModelLevel> levels)
    : groups_(problem), start_(u(groups_.order)), levels_(offered(problem, levels)) {
  const Eigen::Index n = problem.size();
  for (const ModelLevel& level : levels_)
    if (std::ranges::find(gathered_, level.ripple_rad, &Gathered::ripple_rad) == gathered_.end())
      gathered_.push_back(
          {level.ripple_rad, Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
  add(problem, at);
}

void LevelSums::add(const Problem& problem, const Linearisation& rows) {
  const MeanRows mean = mean_rows(problem, rows);
  for (Gathered& g : gathered_) gather(problem, mean, groups_, g);  // (34)
}

/// Solutions of all levels, with what they refer to.
struct LevelSums::Solutions {
  explicit Solutions(const LevelSums& sums) {
    solved = solve_all(sums.levels_, [&](const ModelLevel& level) { return family(sums, level); });
  }

  Family* family(const LevelSums& sums, const ModelLevel& level) {
    auto f = std::find_if(families.begin(), families.end(), [&](const Family& other) {
      return other.ripple_rad() == level.ripple_rad && other.compliance() == level.compliance &&
             other.play() == level.play;
    });
    if (f != families.end()) return &*f;
    auto plain = std::find_if(eliminated.begin(), eliminated.end(), [&](const Eliminated& other) {
      return other.g.ripple_rad == level.ripple_rad;
    });
    if (plain == eliminated.end())
      plain = eliminated.emplace(
          plain, sums.groups_,
          *std::ranges::find(sums.gathered_, level.ripple_rad, &Gathered::ripple_rad));
    return &*families.emplace(f, sums.groups_, *plain, sums.start_, level.compliance, level.play);
  }

  std::list<Eliminated> eliminated;
  std::list<Family> families;
  std::vector<Solved> solved;
};

LevelMean LevelSums::mean() const {
  const std::vector<int>& order = groups_.order;
  const Eigen::Index size = start_.size();
  const Solutions levels(*this);
  LevelMean result;
  const Weighed all = weigh(levels.solved, size, result);
  const Eigen::MatrixXd covariance =
      covariance_of(levels.eliminated, levels.families, levels.solved, all);
  result.u.resize(size);
  result.u(order) = all.mean;
  result.covariance_u.resize(size, size);
  result.covariance_u(order, order) = covariance;
  return result;
}

double LevelSums::log_evidence() const {
  const Solutions levels(*this);
  std::vector<double> logs;
  for (const Solved& s : levels.solved) logs.push_back(s.step.log_evidence);
  return log_sum(logs);
}

double log_evidence(std::span<const LevelEvidence> levels) {
  std::vector<double> logs;
  for (const LevelEvidence& l : levels) logs.push_back(l.log_evidence);
  return log_sum(logs);
}

LevelMean mean_over_levels(const Problem& problem, const Eigen::VectorXd& u,
                           const Linearisation& at, std::span<const ModelLevel> levels) {
  return LevelSums(problem, u, at, levels).mean();
}

}  // namespace cellcal::calib
