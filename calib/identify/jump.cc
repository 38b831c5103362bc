#include "calib/identify/jump.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "calib/files/error.h"
#include "calib/identify/moved.h"
#include "calib/identify/repeats.h"
#include "calib/identify/target_place.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
/// What is looked for, 1 sigma: of a joint's zero; of tool and target in each direction.
constexpr double kUsualSlipRad = 0.1 / kDegPerRad;
constexpr double kUsualKnockM = 1e-3;
/// Squared sigmas of a jump that are worth a closer look.
constexpr double kSuspect = 12.0;
/// So many places of the session are tried at first; a jump between two is seen by both.
constexpr std::size_t kPlaces = 15;
/// Less is not worth identifying anew without it.
constexpr double kWorthTrying = 9.0;
/// Of more touches a share says what jumped as well, and all would take longer only.
constexpr std::size_t kMostTouches = 1000;
/// Touches on either side of a jump, at least.
constexpr std::size_t kLeastEachSide = 5;
/// Beyond this many sigmas a touch is left out, in the estimate too.
constexpr double kGate = 4.0;
/// What leaving a touch out costs in log evidence: as much as a touch at the gate.
constexpr double kLeftOut = kGate * kGate / 2.0;
/// By which log evidence a jump has to beat that nothing changed, and to beat another jump.
constexpr double kBelieved = 6.0;
constexpr double kClear = 5.0;
/// Squared sigmas of its size, found with it undone: what is likelier with any jump at all, however
/// large, is something else (a target's touches that bear another's name).
constexpr double kSized = 16.0;

/// Columns by which a touch's whitened rows follow jumps: of each joint's zero, then of the tool's
/// tip along the flange's axes. SI.
using JumpRows = Eigen::Matrix<double, 3, Eigen::Dynamic>;

int jump_columns(const Problem& problem) { return problem.arm().joint_count() + 3; }

void by_jumps(const Problem& problem, const Problem::At& at, std::size_t touch, JumpRows& rows) {
  double residual[3];
  Eigen::Vector3d direction;
  problem.residual_m(touch, at, residual, nullptr, nullptr, &direction);
  ArmChain chain;
  problem.arm().walk(problem.pose(touch), at.arm, chain);
  const int joints = problem.arm().joint_count(), count = problem.rows(touch);
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector3d n = (count == 1 ? direction : Eigen::Vector3d(Eigen::Vector3d::Unit(k))) /
                              problem.sigma_m(touch);
    for (int i = 0; i < joints; ++i) {
      const auto& link = chain.link[static_cast<std::size_t>(i)];
      const int sign = problem.arm().robot().joints[static_cast<std::size_t>(i)].sign;
      rows(k, i) = sign * n.dot(link.z.cross(chain.tip - link.z_origin));
    }
    rows.row(k).tail<3>() = n.transpose() * chain.flange;
  }
}

/// Information and pull of a jump of some columns, everything else left free; what is looked for
/// included.
double squared_sigmas(Eigen::MatrixXd information, const Eigen::VectorXd& pull, double usual) {
  information.diagonal().array() += 1.0 / (usual * usual);
  const Eigen::LDLT<Eigen::MatrixXd> factor(information);
  return factor.isPositive() ? pull.dot(factor.solve(pull)) : 0.0;
}

}  // namespace

std::vector<Jump> suspected_jump(const Problem& problem, const Estimate& e, double chi2_per_dof) {
  std::vector<int> row_of(problem.touches().size(), -1);
  for (const auto& [touch, row] : e.posterior.linear.touch_row) row_of[touch] = row;
  std::vector<std::size_t> order = in_order(problem.touches());
  std::erase_if(order, [&](std::size_t i) { return row_of[i] < 0; });
  if (order.size() < 2 * kLeastEachSide) return {};
  const std::size_t places = std::min(kPlaces, order.size() - 2 * kLeastEachSide + 1);
  const auto place = [&](std::size_t k) {  // first touch behind it
    return kLeastEachSide +
           k * (order.size() - 2 * kLeastEachSide) / std::max<std::size_t>(1, places - 1);
  };
  const int columns = jump_columns(problem), joints = columns - 3;
  // From the last touch back, so that what the later ones say is summed up once.
  Eigen::MatrixXd square = Eigen::MatrixXd::Zero(columns, columns);
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(columns);
  Eigen::MatrixXd by_all = Eigen::MatrixXd::Zero(problem.size(), columns);
  std::vector<Eigen::MatrixXd> squares(places);
  std::vector<Eigen::VectorXd> pulls(places);
  Eigen::MatrixXd all(problem.size(), columns * static_cast<Eigen::Index>(places));
  const Eigen::VectorXd x = problem.to_si(e.u);
  const Problem::At at = problem.at(x.data());
  const Linearisation& linear = e.posterior.linear;
  JumpRows g(3, columns);
  std::size_t next = places;
  for (std::size_t k = order.size(); k-- > 0 && next > 0;) {
    const int row = row_of[order[k]], rows = problem.rows(order[k]);
    by_jumps(problem, at, order[k], g);
    const auto own = g.topRows(rows);
    square.noalias() += own.transpose() * own;
    pull.noalias() += own.transpose() * linear.residual.segment(row, rows);
    by_all.noalias() += linear.jacobian.middleRows(row, rows).transpose() * own;
    if (k != place(next - 1)) continue;
    --next;
    squares[next] = square;
    pulls[next] = pull;
    all.middleCols(columns * static_cast<Eigen::Index>(next), columns) = by_all;
  }
  const Eigen::MatrixXd held = e.posterior.covariance_u * all;
  Jump best;
  for (std::size_t p = 0; p < places; ++p) {
    const Eigen::Index first = columns * static_cast<Eigen::Index>(p);
    const auto consider = [&](Jump::What what, const std::string& name, int from, int count,
                              double usual) {
      const Eigen::MatrixXd information =
          squares[p].block(from, from, count, count) -
          all.middleCols(first + from, count).transpose() * held.middleCols(first + from, count);
      const double said = squared_sigmas(information, pulls[p].segment(from, count), usual) /
                          std::max(1.0, chi2_per_dof);
      if (said <= best.squared_sigmas) return;
      best.what = what;
      best.name = name;
      best.after_touch = order[place(p) - 1];
      best.squared_sigmas = said;
    };
    for (int i = 0; i < joints; ++i)
      consider(Jump::What::kJoint, problem.arm().robot().joints[static_cast<std::size_t>(i)].name,
               i, 1, kUsualSlipRad);
    consider(Jump::What::kTool, "tool", joints, 3, kUsualKnockM);
  }
  if (best.squared_sigmas < kSuspect) return {};
  return {best};
}

namespace {

/// One that may have jumped, and its columns.
struct Suspect {
  Jump::What what = Jump::What::kJoint;
  std::string name;
  std::size_t index = 0;  ///< of the joint or target
  Eigen::Index first = 0;
  Eigen::Index size = 1;
  double usual = 0.0;
  int unknown = -1;  ///< of a target: its first
};

/// The jump of one suspect: by `size`, from touch `behind` of the sequence on.
struct Found {
  std::size_t behind = 0;
  Eigen::VectorXd size;
  Eigen::MatrixXd information;  ///< of it, all else left free
  double squared_sigmas = 0.0;
};

/// All fit touches in their order, linearised where a calibration of them ended.
class Sequence {
 public:
  Sequence(const Cell& cell, const std::vector<Touch>& touches, const Calibration& c)
      : levelled_(at_level(cell, ModelLevel{})),
        arm_(levelled_.robot, levelled_.tool),
        problem_(levelled_, arm_, touches, starting_places(levelled_, arm_, touches)) {
    weigh_repeats(problem_);
    problem_.set_ripple(c.level.ripple_rad);
    const int n = problem_.size();
    Eigen::VectorXd x(n), u(n);
    for (int i = 0; i < n; ++i) {
      const ParameterResult& p = c.parameters[static_cast<std::size_t>(i)];
      const Unknown& unknown = problem_.unknowns()[static_cast<std::size_t>(i)];
      x[i] = p.nominal + p.correction;
      u[i] = (x[i] - unknown.origin) / unknown.scale;
    }
    std::vector<bool> fit(touches.size());
    for (std::size_t i = 0; i < fit.size(); ++i) fit[i] = touches[i].set == TouchSet::kFit;
    linear_ = linearise(problem_, u, fit);
    set_prior(c, u);
    fill_columns(x);
    for (const std::size_t i : in_order(touches))
      if (fit[i]) order_.push_back(i);
    row_.resize(touches.size(), -1);
    for (const auto& [touch, row] : linear_.touch_row) row_[touch] = row;
  }

  const Problem& problem() const { return problem_; }
  const std::vector<std::size_t>& order() const { return order_; }
  const std::vector<Suspect>& suspects() const { return suspects_; }

  /// Where and by how much it jumped, if it did: touches far off count for nothing in the end, but
  /// which they are is left open at first, and so is where the jump was.
  std::optional<Found> robust(const Suspect& suspect) const {
    constexpr double kStep = 3.0;
    constexpr int kRoundsAtGate = 3;
    Eigen::VectorXd residual = linear_.residual;
    double width = std::max(kGate, residual.head(linear_.length_row).lpNorm<Eigen::Infinity>());
    std::optional<Found> found;
    for (int at_gate = 0; at_gate < kRoundsAtGate;) {
      const double gate = kGate * std::max(1.0, scatter(residual));
      if (width <= gate) ++at_gate;
      width = std::max(width, gate);
      const Eigen::VectorXd weight = weights(residual, width);
      found = best_place(suspect, weight, {}, residual);
      if (!found) return {};
      width /= kStep;
    }
    return found;
  }

  /// A further jump at a place that is known already, of touches that are within the gate.
  std::optional<Found> at(const Suspect& suspect, std::size_t behind) const {
    Eigen::VectorXd residual = linear_.residual;
    const double gate = kGate * std::max(1.0, scatter(residual));
    return best_place(suspect, weights(residual, gate), behind, residual);
  }

  /// Where the jump, which these touches have undone from `behind` on, is placed best.
  std::size_t placed(const Suspect& suspect, const Found& found) const {
    std::vector<double> jumped(order_.size()), not_jumped = jumped;
    for (std::size_t k = 0; k < order_.size(); ++k) {
      const int row = row_[order_[k]], rows = problem_.rows(order_[k]);
      const Eigen::VectorXd is = linear_.residual.segment(row, rows);
      const Eigen::VectorXd by =
          by_jump_.block(row, suspect.first, rows, suspect.size) * found.size;
      const auto cost = [&](const Eigen::VectorXd& r) {
        return std::min(r.squaredNorm(), kGate * kGate);
      };
      jumped[k] = cost(k >= found.behind ? is : Eigen::VectorXd(is + by));
      not_jumped[k] = cost(k >= found.behind ? Eigen::VectorXd(is - by) : is);
    }
    double sum = std::accumulate(jumped.begin(), jumped.end(), 0.0), least = sum;
    std::size_t best = found.behind;
    double at_found = 0.0;
    std::vector<double> total(order_.size());
    for (std::size_t k = 0; k < order_.size(); ++k) {
      total[k] = sum;
      sum += not_jumped[k] - jumped[k];
    }
    at_found = least = total[found.behind];
    for (std::size_t k = kLeastEachSide; k + kLeastEachSide <= order_.size(); ++k)
      if (total[k] < least) {
        least = total[k];
        best = k;
      }
    return least < at_found ? best : found.behind;
  }

 private:
  void set_prior(const Calibration& c, const Eigen::VectorXd& u) {
    constexpr double kLeastTransmission = 0.3;
    const double transmission = std::max(kLeastTransmission, c.level.transmission);
    const int n = problem_.size();
    information_ = Eigen::MatrixXd::Zero(n, n);
    gradient_ = Eigen::VectorXd::Zero(n);
    for (int i = 0; i < n; ++i) {
      const Unknown& unknown = problem_.unknowns()[static_cast<std::size_t>(i)];
      double weight = unknown.prior_weight;
      if (i < problem_.arm_size()) {
        const ArmParameterKind kind = arm_.parameters()[static_cast<std::size_t>(i)].kind;
        if (kind == ArmParameterKind::kCosine || kind == ArmParameterKind::kSine)
          weight /= transmission;
      }
      information_(i, i) = weight * weight;
      gradient_[i] = weight * weight * (u[i] - unknown.prior_mean_u);
    }
    const Eigen::Index lengths = linear_.jacobian.rows() - linear_.length_row;
    information_.noalias() +=
        linear_.jacobian.bottomRows(lengths).transpose() * linear_.jacobian.bottomRows(lengths);
    gradient_.noalias() +=
        linear_.jacobian.bottomRows(lengths).transpose() * linear_.residual.tail(lengths);
  }

  void fill_columns(const Eigen::VectorXd& x) {
    const int own = jump_columns(problem_), joints = own - 3;
    for (int i = 0; i < joints; ++i)
      suspects_.push_back({Jump::What::kJoint,
                           arm_.robot().joints[static_cast<std::size_t>(i)].name,
                           static_cast<std::size_t>(i), i, 1, kUsualSlipRad});
    suspects_.push_back({Jump::What::kTool, "tool", 0, joints, 3, kUsualKnockM});
    Eigen::Index columns = own;
    for (const TargetBlock& block : problem_.blocks()) {
      const Target& target = levelled_.targets[block.target];
      if (!has_a_centre(target.kind)) continue;
      suspects_.push_back(
          {Jump::What::kTarget, target.id, block.target, columns, 3, kUsualKnockM, block.first});
      columns += 3;
    }
    by_jump_ = Eigen::MatrixXd::Zero(linear_.length_row, columns);
    const Problem::At at = problem_.at(x.data());
    JumpRows g(3, own);
    for (const auto& [touch, row] : linear_.touch_row) {
      const int rows = problem_.rows(touch);
      by_jumps(problem_, at, touch, g);
      by_jump_.block(row, 0, rows, own) = g.topRows(rows);
    }
    for (const Suspect& s : suspects_)
      if (s.what == Jump::What::kTarget)
        by_jump_.middleCols(s.first, 3) =
            linear_.jacobian.block(0, s.unknown, linear_.length_row, 3) /
            problem_.unknowns()[static_cast<std::size_t>(s.unknown)].scale;
  }

  /// Median of |r| in what it is of normal ones.
  double scatter(const Eigen::VectorXd& residual) const {
    constexpr double kMedian = 0.6745;
    std::vector<double> size(residual.data(), residual.data() + linear_.length_row);
    for (double& r : size) r = std::abs(r);
    const auto middle = size.begin() + static_cast<std::ptrdiff_t>(size.size() / 2);
    std::nth_element(size.begin(), middle, size.end());
    return *middle / kMedian;
  }

  /// Geman and McClure's: full for honest touches, none for gross ones.
  Eigen::VectorXd weights(const Eigen::VectorXd& residual, double width) const {
    Eigen::VectorXd result(linear_.length_row);
    const double square = width * width;
    for (const auto& [touch, row] : linear_.touch_row) {
      const int rows = problem_.rows(touch);
      const double off = residual.segment(row, rows).lpNorm<Eigen::Infinity>();
      result.segment(row, rows).setConstant(std::pow(square / (square + off * off), 2));
    }
    return result;
  }

  /// With each touch weighed so: the place where the jump takes most away, or `only` that, and what
  /// is left of the residuals then.
  std::optional<Found> best_place(const Suspect& suspect, const Eigen::VectorXd& weight,
                                  std::optional<std::size_t> only,
                                  Eigen::VectorXd& residual) const {
    const Eigen::Index rows = linear_.length_row, d = suspect.size;
    const auto j = linear_.jacobian.topRows(rows);
    const auto r = linear_.residual.head(rows);
    const RowMajor weighed = weight.cwiseSqrt().asDiagonal() * j;
    Eigen::MatrixXd information = information_;
    information.selfadjointView<Eigen::Lower>().rankUpdate(weighed.transpose());
    const Eigen::LLT<Eigen::MatrixXd> factor(information);
    if (factor.info() != Eigen::Success) return {};
    const Eigen::VectorXd gradient =
        gradient_ + j.transpose() * weight.cwiseProduct(Eigen::VectorXd(r));
    const Eigen::VectorXd step = -factor.solve(gradient);
    const Eigen::VectorXd left = r + j * step;
    const auto g = by_jump_.middleCols(suspect.first, d);
    // Of every touch what it says of a jump, and with L the information's factor L^-1 of what goes
    // with that.
    const Eigen::MatrixXd lower = factor.matrixL().solve(Eigen::MatrixXd(j.transpose()));
    Eigen::MatrixXd square = Eigen::MatrixXd::Zero(d, d),
                    by_all = Eigen::MatrixXd::Zero(lower.rows(), d);
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(d);
    Found best;
    Eigen::MatrixXd best_by_all;
    std::size_t own = 0, all = 0;
    const auto involved = [&](std::size_t touch) {
      return suspect.what != Jump::What::kTarget ||
             levelled_.targets[suspect.index].id == problem_.touches()[touch].target;
    };
    for (const std::size_t touch : order_) all += involved(touch) ? 1 : 0;
    for (std::size_t k = order_.size(); k-- > 0;) {
      const std::size_t touch = order_[k];
      if (!involved(touch)) continue;
      ++own;
      for (Eigen::Index i = row_[touch]; i < row_[touch] + problem_.rows(touch); ++i) {
        const Eigen::VectorXd column = g.row(i).transpose();
        square.noalias() += weight[i] * column * column.transpose();
        by_all.noalias() += weight[i] * lower.col(i) * column.transpose();
        pull.noalias() -= weight[i] * left[i] * column;
      }
      if (only ? k != *only : own < kLeastEachSide || all - own < kLeastEachSide) continue;
      Eigen::MatrixXd free = square - by_all.transpose() * by_all;
      const double said = squared_sigmas(free, pull, suspect.usual);
      if (!only && said <= best.squared_sigmas) continue;
      best.behind = k;
      best.squared_sigmas = said;
      best.information = free;
      free.diagonal().array() += 1.0 / (suspect.usual * suspect.usual);
      best.size = free.ldlt().solve(pull);
      best_by_all = by_all;
    }
    if (best.size.size() == 0) return {};
    const Eigen::VectorXd moved =
        step - factor.matrixU().solve(Eigen::VectorXd(best_by_all * best.size));
    residual.head(rows) = r + j * moved;
    for (std::size_t k = best.behind; k < order_.size(); ++k) {
      const int row = row_[order_[k]], count = problem_.rows(order_[k]);
      residual.segment(row, count) += g.middleRows(row, count) * best.size;
    }
    return best;
  }

  Cell levelled_;
  ArmModel arm_;
  Problem problem_;
  Linearisation linear_;
  Eigen::MatrixXd information_;  ///< of priors and certified lengths
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd by_jump_;
  std::vector<Suspect> suspects_;
  std::vector<std::size_t> order_;
  std::vector<int> row_;
};

/// How likely the touches are, whatever level, arm and places; each one that was left out costs as
/// much as one at the gate. Natural logarithm.
double log_evidence(const Calibration& c) {
  double best = -std::numeric_limits<double>::infinity(), sum = 0.0;
  for (const LevelEvidence& l : c.levels) best = std::max(best, l.log_evidence);
  for (const LevelEvidence& l : c.levels) sum += std::exp(l.log_evidence - best);
  return best + std::log(sum) - kLeftOut * static_cast<double>(c.outliers.size());
}

/// By which the density of a jump is below that of a small one: heavy tails (Student's t, three
/// degrees of freedom), since what is knocked hard is knocked all the same.
double surprise(const Eigen::VectorXd& size, double usual) {
  constexpr double kFreedom = 3.0;
  return 0.5 * (kFreedom + static_cast<double>(size.size())) *
         std::log1p(size.squaredNorm() / (kFreedom * usual * usual));
}

/// The same touches by an arm that did not jump: a joint turned by as much, or, for the tool, the
/// joints at which the tip would have been there.
void undo(const ArmModel& arm, const Suspect& suspect, const Eigen::VectorXd& size, Touch& touch) {
  if (suspect.what == Jump::What::kJoint) {
    touch.joint_rad[suspect.index] += size[0];
    return;
  }
  const Eigen::Isometry3d flange = arm.nominal_tcp(touch.joint_rad) * arm.tool().tcp.inverse();
  const Eigen::Vector3d there =
      arm.nominal_tip_m(touch.joint_rad) + flange.linear() * Eigen::Vector3d(size);
  constexpr int kSteps = 3;
  constexpr double kDamping = 1e-4;  // [m^2], of posture in which the tip hardly moves one way
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::MatrixXd by = arm.nominal_jacobian(touch.joint_rad).topRows<3>();
    const Eigen::Matrix3d square =
        by * by.transpose() + kDamping * kDamping * Eigen::Matrix3d::Identity();
    const Eigen::VectorXd turn =
        by.transpose() * square.ldlt().solve(there - arm.nominal_tip_m(touch.joint_rad));
    for (std::size_t i = 0; i < touch.joint_rad.size(); ++i)
      touch.joint_rad[i] += turn[static_cast<Eigen::Index>(i)];
  }
}

/// Whether nothing else is wrong. Check touches near the jump may be on its wrong side, and one or
/// two touches near it left out for that.
bool mended(const Calibration& c) {
  constexpr double kMostLeftOut = 0.1;
  if (static_cast<double>(c.outliers.size()) > kMostLeftOut * c.before.count) return false;
  return std::all_of(c.verdict.reasons.begin(), c.verdict.reasons.end(), [](const std::string& r) {
    for (const char* harmless : {"scope:", "no check touches:", "check touches:", "outliers:"})
      if (r.starts_with(harmless)) return true;
    return false;
  });
}

/// Everything that is asked of one session.
class Search {
 public:
  Search(const Cell& cell, const std::vector<Touch>& touches, const IdentifyOptions& options,
         const Calibration& calibration)
      : cell_(cell),
        touches_(touches),
        options_(options),
        stated_(cell, touches, calibration),
        log_evidence_(log_evidence(calibration)),
        in_order_(in_order(touches)) {}

  /// Of one that is known.
  double log_odds(const Jump& known) const {
    for (const Suspect& suspect : stated_.suspects()) {
      if (suspect.what != known.what || suspect.name != known.name) continue;
      Found found;
      while (found.behind + 1 < stated_.order().size() &&
             stated_.order()[found.behind] != known.after_touch)
        ++found.behind;
      ++found.behind;
      if (known.what == Jump::What::kJoint)
        found.size = Eigen::VectorXd::Constant(1, known.angle_rad);
      else
        found.size = known.shift_m;
      double chi2 = 1.0;
      const auto jump = known.what == Jump::What::kTarget ? moved(suspect, found, chi2)
                                                          : undone(suspect, found, chi2);
      if (jump) return jump->log_odds / chi2;
    }
    return 0.0;
  }

  std::vector<Jump> all() const {
    std::vector<Jump> jumps;
    double scatter = 1.0;
    double best = -std::numeric_limits<double>::infinity();
    for (const Suspect& suspect : stated_.suspects()) {
      const auto found = stated_.robust(suspect);
      if (!found || found->squared_sigmas < kWorthTrying) continue;
      std::optional<Jump> jump;
      double chi2 = 1.0;
      try {
        jump = suspect.what == Jump::What::kTarget ? moved(suspect, *found, chi2)
                                                   : undone(suspect, *found, chi2);
      } catch (const IdentifyError&) {
        continue;  // too little on one side to tell
      }
      if (!jump) continue;
      if (jump->log_odds > best) {
        best = jump->log_odds;
        scatter = std::max(1.0, chi2);
      }
      jumps.push_back(*jump);
    }
    // Touches that scatter more than stated say less.
    for (Jump& jump : jumps)
      jump.log_odds =
          jump.log_odds / scatter - std::log(static_cast<double>(stated_.order().size()));
    return jumps;
  }

 private:
  std::vector<Touch> with_undone(const Suspect& suspect, const Found& found) const {
    std::vector<Touch> touches = touches_;
    bool passed = false;
    for (const std::size_t i : in_order_) {
      passed = passed || i == stated_.order()[found.behind];
      if (passed) undo(stated_.problem().arm(), suspect, found.size, touches[i]);
    }
    return touches;
  }

  std::optional<Jump> undone(const Suspect& suspect, Found found, double& chi2) const {
    constexpr int kRounds = 3;
    std::optional<Jump> jump;
    for (int round = 0; round < kRounds; ++round) {
      const std::vector<Touch> touches = with_undone(suspect, found);
      const Calibration c = identify_as_stated(cell_, touches, options_);
      const Sequence sequence(cell_, touches, c);
      const auto further = sequence.at(suspect, found.behind);
      if (!further) return {};
      const auto d = static_cast<Eigen::Index>(suspect.size);
      const Eigen::MatrixXd usual =
          Eigen::MatrixXd::Identity(d, d) + suspect.usual * suspect.usual * further->information;
      chi2 = std::max(1.0, c.chi2_per_dof);
      const Eigen::VectorXd size = found.size;
      jump.emplace();
      jump->what = suspect.what;
      jump->name = suspect.name;
      jump->after_touch = stated_.order()[found.behind - 1];
      jump->log_odds = log_evidence(c) - log_evidence_ - 0.5 * std::log(usual.determinant()) -
                       surprise(size, suspect.usual);
      jump->mends = mended(c);
      const Eigen::MatrixXd covariance = further->information.inverse() * chi2;
      jump->squared_sigmas = size.dot(further->information * size) / chi2;
      jump->sigma = std::sqrt(size.dot(covariance * size)) / size.norm();
      if (suspect.what == Jump::What::kJoint)
        jump->angle_rad = size[0];
      else
        jump->shift_m = size;
      const std::size_t placed = sequence.placed(suspect, found);
      found.size += further->size;
      found.behind = placed;
    }
    return jump;
  }

  std::optional<Jump> moved(const Suspect& suspect, const Found& found, double& chi2) const {
    // Its last touch before.
    std::size_t last = found.behind;
    while (last > 0 && touches_[stated_.order()[last - 1]].target != suspect.name) --last;
    if (last == 0) return {};
    Jump jump;
    jump.what = Jump::What::kTarget;
    jump.name = suspect.name;
    jump.after_touch = stated_.order()[last - 1];
    const auto place = [](const Calibration& c, const std::string& id) {
      for (const TargetResult& t : c.targets)
        if (t.id == id) return t.centre_m;
      throw IdentifyError("no touches of " + id);
    };
    // First where it is then, whatever the cell file says; then as one that is within the usual of
    // there, which is what its evidence has to be compared with.
    TwoPlaces two = as_two(cell_, touches_, suspect.name, jump.after_touch);
    const Eigen::Vector3d there =
        place(identify_as_stated(two.cell, two.touches, options_), two.later);
    two = as_two(cell_, touches_, suspect.name, jump.after_touch, there, suspect.usual);
    const Calibration c = identify_as_stated(two.cell, two.touches, options_);
    jump.shift_m = place(c, two.later) - place(c, suspect.name);
    chi2 = std::max(1.0, c.chi2_per_dof);
    jump.log_odds = log_evidence(c) - log_evidence_ - surprise(jump.shift_m, suspect.usual);
    jump.squared_sigmas = found.squared_sigmas / chi2;
    jump.sigma = found.size.norm() / std::sqrt(jump.squared_sigmas);
    jump.mends = mended(c);
    return jump;
  }

  const Cell& cell_;
  const std::vector<Touch>& touches_;
  const IdentifyOptions& options_;
  Sequence stated_;
  double log_evidence_;
  std::vector<std::size_t> in_order_;
};

}  // namespace

std::vector<Jump> jumps_by_odds(const Cell& cell, const std::vector<Touch>& touches,
                                const IdentifyOptions& options, const Calibration& calibration) {
  const std::size_t stride = touches.size() / kMostTouches + 1;
  std::vector<Jump> jumps;
  try {
    if (stride == 1) {
      jumps = Search(cell, touches, options, calibration).all();
    } else {
      std::vector<Touch> share;
      for (std::size_t i = 0; i < touches.size(); i += stride) share.push_back(touches[i]);
      jumps = Search(cell, share, options, identify_as_stated(cell, share, options)).all();
      for (Jump& jump : jumps) jump.after_touch *= stride;
    }
  } catch (const IdentifyError&) {
    return {};  // the share says too little
  }
  std::stable_sort(jumps.begin(), jumps.end(),
                   [](const Jump& a, const Jump& b) { return a.log_odds > b.log_odds; });
  return jumps;
}

std::vector<Jump> believed(std::vector<Jump> jumps) {
  std::erase_if(
      jumps, [](const Jump& j) { return j.log_odds < kBelieved || !(j.squared_sigmas > kSized); });
  if (jumps.empty()) return jumps;
  const double best = jumps.front().log_odds;
  std::erase_if(jumps, [&](const Jump& j) { return j.log_odds < best - kClear; });
  return jumps;
}

namespace {

std::string sized(const Jump& jump) {
  if (jump.what == Jump::What::kJoint)
    return fmt::format("{:+.3f} +- {:.3f} deg", jump.angle_rad * kDegPerRad,
                       jump.sigma * kDegPerRad);
  const Eigen::Vector3d mm = jump.shift_m * 1e3;
  return fmt::format("{:.2f} +- {:.2f} mm ({:+.2f}, {:+.2f}, {:+.2f})", mm.norm(), jump.sigma * 1e3,
                     mm.x(), mm.y(), mm.z());
}

std::string subject(const Jump& jump) {
  switch (jump.what) {
    case Jump::What::kJoint:
      return jump.name + "'s zero";
    case Jump::What::kTool:
      return "the tool's tip on the flange";
    case Jump::What::kTarget:
      return jump.name;
  }
  return "";
}

std::string words_of_one(const Cell& cell, const Jump& jump, std::size_t touches) {
  if (jump.what == Jump::What::kTool)
    return fmt::format(
        "knocked tool: its tip seems to have moved by {} on the flange after touch {} (of {}); "
        "check its fastening and calibrate again",
        sized(jump), jump.after_touch + 1, touches);
  // The same to all touches as that joint.
  const char* or_else = "";
  if (jump.name == cell.robot.joints.front().name)
    or_else = " (or the arm's foot, or all targets together, turned by as much)";
  else if (jump.name == cell.robot.joints.back().name)
    or_else = " (or the tool turned on the flange by as much)";
  return fmt::format(
      "slipped joint: the zero of {} seems to have jumped by {} after touch {} (of {}){}; look for "
      "a slipping belt, coupling or brake, master the joint and calibrate again",
      jump.name, sized(jump), jump.after_touch + 1, touches, or_else);
}

std::string words_of_several(const std::vector<Jump>& jumps, std::size_t touches) {
  std::string candidates;
  for (const Jump& jump : jumps)
    candidates += fmt::format("{}{} by {} after touch {}", candidates.empty() ? "" : ", or ",
                              subject(jump), sized(jump), jump.after_touch + 1);
  return fmt::format(
      "something moved in the middle of the session (of {} touches), and they do not tell for "
      "certain what: {}; check these and calibrate again",
      touches, candidates);
}

/// Whether it jumped, as far as touches tell without certified lengths: wrong ones pull at the arm.
bool without_lengths(Cell cell, const std::vector<Touch>& touches, const IdentifyOptions& options,
                     const Jump& jump) {
  if (touches.size() > kMostTouches) return true;  // they say enough of themselves
  constexpr double kAnyLengthM = 10.0;
  for (CertifiedLength& length : cell.lengths) length.sigma_m = kAnyLengthM;
  try {
    const Calibration c = identify_as_stated(cell, touches, options);
    return Search(cell, touches, options, c).log_odds(jump) > 0.0;
  } catch (const IdentifyError&) {
    return true;  // the touches alone determine nothing, and so do not speak against it
  }
}

}  // namespace

void tell_of_jumps(const Cell& cell, const std::vector<Touch>& touches,
                   const IdentifyOptions& options, Calibration& calibration) {
  const std::vector<Jump>& jumps = calibration.jumped;
  if (jumps.empty()) return;
  std::string reason = jumps.size() == 1 ? words_of_one(cell, jumps.front(), touches.size())
                                         : words_of_several(jumps, touches.size());
  if (!cell.lengths.empty() && !without_lengths(cell, touches, options, jumps.front()))
    reason += "; or mend the certified lengths, without which nothing jumped";
  calibration.verdict.publish = false;
  auto& reasons = calibration.verdict.reasons;
  // Touches on the other side of it are no gross errors.
  if (jumps.front().mends)
    std::erase_if(reasons, [](const std::string& r) { return r.starts_with("outliers:"); });
  reasons.insert(reasons.begin(), std::move(reason));
}

}  // namespace cellcal::calib
