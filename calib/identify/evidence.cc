#include "calib/identify/evidence.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <list>
#include <numbers>

#include "calib/files/error.h"

namespace cellcal::calib {

namespace {

constexpr double kRadPerArcsec = std::numbers::pi / 180.0 / 3600.0;

struct Prior {
  double value, probability;
};
/// Smooth transmission error relative to the usual: a factor of two either way is common.
constexpr Prior kTransmission[] = {{0.0, 0.05}, {0.5, 0.25}, {1.0, 0.40}, {2.0, 0.20}, {4.0, 0.10}};
constexpr Prior kRipple[] = {{0.0, 0.45}, {5.0 * kRadPerArcsec, 0.45}, {15.0 * kRadPerArcsec, 0.1}};
/// The robot file's is the largest that one would expect; a third of it is as usual.
constexpr Prior kCompliance[] = {{0.0, 0.1}, {0.3, 0.5}, {1.0, 0.4}};
/// A level this much less likely than the best (e^-9) has no say.
constexpr double kHopeless = 9.0;
/// Precision of unknowns without a prior: a hair, so that every level stays solvable, and the same
/// in every level, so that it cancels.
constexpr double kFlat = 1e-8;

double log_prior(const ModelLevel& level) {
  double sum = 0.0;
  for (const Prior& p : kCompliance)
    if (p.value == level.compliance) sum += std::log(p.probability);
  for (const Prior& p : kTransmission)
    if (p.value == level.transmission) sum += std::log(p.probability);
  for (const Prior& p : kRipple)
    if (p.value == level.ripple_rad) sum += std::log(p.probability);
  return sum;
}

/// A hair of information keeps a centre without prior, which turns with the frame, finite.
constexpr double kHair = 1.0 + 1e-12;

bool is_load(ArmParameterKind kind) {
  return kind == ArmParameterKind::kCompliance || kind == ArmParameterKind::kLoad;
}
bool is_transmission(ArmParameterKind kind) {
  return kind == ArmParameterKind::kCosine || kind == ArmParameterKind::kSine;
}

/// The unknowns in three groups, one behind the other: those that every level has with the same
/// prior; compliance; transmission. What a level leaves out or scales is then a block.
struct Groups {
  explicit Groups(const Problem& problem) {
    std::vector<int> compliant, wobbling;
    for (int i = 0; i < problem.size(); ++i) {
      const bool arm = i < problem.arm_size();
      const auto kind = arm ? problem.arm().parameters()[i].kind : ArmParameterKind::kTheta;
      (is_load(kind) ? compliant : is_transmission(kind) ? wobbling : order).push_back(i);
    }
    plain = static_cast<Eigen::Index>(order.size());
    compliance = static_cast<Eigen::Index>(compliant.size());
    transmission = static_cast<Eigen::Index>(wobbling.size());
    order.insert(order.end(), compliant.begin(), compliant.end());
    order.insert(order.end(), wobbling.begin(), wobbling.end());
    precision.resize(problem.size());
    mean.resize(problem.size());
    for (Eigen::Index k = 0; k < precision.size(); ++k) {
      const Unknown& unknown = problem.unknowns()[order[static_cast<std::size_t>(k)]];
      precision[k] = unknown.prior_weight > 0.0 ? std::pow(unknown.prior_weight, 2) : kFlat;
      mean[k] = unknown.prior_mean_u;
    }
  }

  std::vector<int> order;  ///< the problem's index of each
  Eigen::Index plain = 0, compliance = 0, transmission = 0;
  Eigen::VectorXd precision, mean;  ///< priors, in this order
};

/// What all levels of one ripple share: J'WJ, the gradient of the touches at u, and the misfit.
struct Gathered {
  double ripple_rad = 0.0;
  Eigen::MatrixXd gram;
  Eigen::VectorXd gradient;
  double square = 0.0, log_weight = 0.0;
};

void gather(const Problem& problem, const Linearisation& at, const Groups& groups, Gathered& g) {
  // From the weights of the linearisation to those of this ripple.
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(at.residual.size());
  for (const auto& [touch, row] : at.touch_row) {
    const double own = problem.own_sigma_m(touch);
    const double sigma = std::hypot(own, g.ripple_rad * problem.joint_lever_m(touch));
    weight.segment(row, problem.rows(touch)).setConstant(problem.sigma_m(touch) / sigma);
    g.log_weight += 2.0 * problem.rows(touch) * std::log(own / sigma);
  }
  const Eigen::Index n = problem.size();
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(n);
  // By blocks that stay in the cache, however many touches there are.
  constexpr Eigen::Index kRows = 128;
  RowMajor rows;
  Eigen::VectorXd residual;
  for (Eigen::Index first = 0; first < at.residual.size(); first += kRows) {
    const Eigen::Index count = std::min(kRows, at.residual.size() - first);
    const auto w = weight.segment(first, count);
    rows = w.asDiagonal() * at.jacobian.middleRows(first, count);
    residual = w.cwiseProduct(at.residual.segment(first, count));
    gram.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
    gradient.noalias() += rows.transpose() * residual;
    g.square += residual.squaredNorm();
  }
  gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
  g.gram += gram(groups.order, groups.order);
  g.gradient += gradient(groups.order);
}

/// One level's Gauss-Newton step from u and its evidence. `rest`: the plain unknowns and, where the
/// level has it, compliance.
struct Step {
  ModelLevel level;
  bool solved = false;
  double log_evidence = 0.0;
  Eigen::VectorXd rest;                 ///< L^-1 of the right side, transmission taken out
  Eigen::VectorXd transmission;         ///< step; empty where the level has none
  Eigen::LLT<Eigen::MatrixXd> reduced;  ///< information on transmission, the rest integrated out
};

/// The levels of one ripple and one compliance: they differ in the prior of the transmission alone,
/// so that all other unknowns are eliminated once (Schur complement).
class Family {
 public:
  Family(const Groups& groups, const Gathered& gathered, const Eigen::VectorXd& u,
         double compliance)
      : groups_(groups), g_(gathered), u_(u), compliance_(compliance) {
    size_ = groups.plain + (compliance > 0.0 ? groups.compliance : 0);
    const Eigen::Index t = groups.transmission;
    precision_ = groups.precision.head(size_);
    if (compliance > 0.0) precision_.tail(size_ - groups.plain) /= compliance * compliance;
    Eigen::MatrixXd information = g_.gram.topLeftCorner(size_, size_);
    information.diagonal() = kHair * (information.diagonal() + precision_);
    factor_.compute(information);
    if (factor_.info() != Eigen::Success) return;
    coupling_ = g_.gram.block(0, g_.gram.cols() - t, size_, t);
    factor_.matrixL().solveInPlace(coupling_);
    reduced_ = g_.gram.bottomRightCorner(t, t);
    reduced_.diagonal() *= kHair;
    reduced_.noalias() -= coupling_.transpose() * coupling_;
    log_det_ = log_det(factor_);
  }

  Step solve(const ModelLevel& level) {
    Step s;
    s.level = level;
    if (factor_.info() != Eigen::Success) return s;
    const Right& right = level.transmission > 0.0 ? right_with() : right_without();
    double square = right.square, gain = right.rest.squaredNorm();
    double log_dets = log_det_, log_precision = precision_.array().log().sum();
    s.rest = right.rest;
    if (level.transmission > 0.0) {
      const Eigen::Index t = groups_.transmission;
      const Eigen::VectorXd precision =
          groups_.precision.tail(t) / (level.transmission * level.transmission);
      const Eigen::VectorXd off = u_.tail(t) - groups_.mean.tail(t);
      Eigen::MatrixXd reduced = reduced_;
      reduced.diagonal() += kHair * precision;
      s.reduced.compute(reduced);
      if (s.reduced.info() != Eigen::Success) return s;
      const Eigen::VectorXd pull = right.transmission - precision.cwiseProduct(off);
      s.transmission = s.reduced.solve(pull);
      s.rest.noalias() -= coupling_ * s.transmission;
      square += precision.dot(off.cwiseAbs2());
      gain += pull.dot(s.transmission);
      log_dets += log_det(s.reduced);
      log_precision += precision.array().log().sum();
    }
    s.log_evidence =
        0.5 * (g_.log_weight - (square - gain) - log_dets + log_precision) + log_prior(level);
    s.solved = true;
    return s;
  }

  /// The level's solution; 0 for unknowns that it has not.
  Eigen::VectorXd solution(const Step& s) const {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(u_.size());
    u.head(size_) = u_.head(size_) + factor_.matrixU().solve(s.rest);
    if (s.transmission.size() > 0)
      u.tail(groups_.transmission) = u_.tail(groups_.transmission) + s.transmission;
    return u;
  }

  /// Adds the mean of the levels' covariances, each times its weight.
  void add_covariance(const std::vector<std::pair<const Step*, double>>& steps,
                      Eigen::MatrixXd& covariance) const {
    const Eigen::Index t = groups_.transmission;
    double weight = 0.0;
    Eigen::MatrixXd inner = Eigen::MatrixXd::Zero(t, t);
    for (const auto& [step, w] : steps) {
      weight += w;
      if (step->transmission.size() > 0)
        inner += w * step->reduced.solve(Eigen::MatrixXd::Identity(t, t));
    }
    Eigen::MatrixXd root = Eigen::MatrixXd::Identity(size_, size_);
    factor_.matrixL().solveInPlace(root);
    Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(size_, size_);
    inverse.selfadjointView<Eigen::Lower>().rankUpdate(root.transpose(), weight);
    inverse.triangularView<Eigen::StrictlyUpper>() = inverse.transpose();
    covariance.topLeftCorner(size_, size_) += inverse;
    const Eigen::MatrixXd through = factor_.matrixU().solve(coupling_);
    const Eigen::MatrixXd shared = through * inner;
    covariance.topLeftCorner(size_, size_).noalias() += shared * through.transpose();
    covariance.block(0, covariance.cols() - t, size_, t) -= shared;
    covariance.block(covariance.rows() - t, 0, t, size_) -= shared.transpose();
    covariance.bottomRightCorner(t, t) += inner;
  }

  double ripple_rad() const { return g_.ripple_rad; }
  double compliance() const { return compliance_; }

 private:
  /// Right side at the point that the step starts from: an unknown that the level has not goes to
  /// 0 first, which is not the level's to choose.
  struct Right {
    bool known = false;
    double square = 0.0;
    Eigen::VectorXd rest;          ///< L^-1 of the right side
    Eigen::VectorXd transmission;  ///< of the touches, rest taken out
  };

  static double log_det(const Eigen::LLT<Eigen::MatrixXd>& factor) {
    return 2.0 * factor.matrixLLT().diagonal().array().log().sum();
  }

  const Right& right_with() { return right(with_, groups_.transmission); }
  const Right& right_without() { return right(without_, 0); }

  const Right& right(Right& r, Eigen::Index transmission) {
    if (r.known) return r;
    r.known = true;
    const Eigen::Index missing = u_.size() - size_ - transmission;
    Eigen::VectorXd gradient = g_.gradient;
    r.square = g_.square;
    if (missing > 0) {
      const Eigen::VectorXd forced = -u_.segment(size_, missing);
      const auto columns = g_.gram.middleCols(size_, missing);
      const Eigen::VectorXd pulled = columns * forced;
      r.square += 2.0 * g_.gradient.segment(size_, missing).dot(forced) +
                  forced.dot(pulled.segment(size_, missing));
      gradient += pulled;
    }
    const Eigen::VectorXd off = u_.head(size_) - groups_.mean.head(size_);
    r.square += precision_.dot(off.cwiseAbs2());
    r.rest = -gradient.head(size_) - precision_.cwiseProduct(off);
    factor_.matrixL().solveInPlace(r.rest);
    r.transmission = -gradient.tail(transmission);
    if (transmission > 0) r.transmission.noalias() -= coupling_.transpose() * r.rest;
    return r;
  }

  const Groups& groups_;
  const Gathered& g_;
  const Eigen::VectorXd& u_;
  double compliance_;
  Eigen::Index size_ = 0;
  Eigen::VectorXd precision_;
  Eigen::LLT<Eigen::MatrixXd> factor_;  ///< L L' of the rest's information
  Eigen::MatrixXd coupling_;            ///< L^-1 times the block of rest by transmission
  Eigen::MatrixXd reduced_;             ///< transmission's block, rest integrated out, no prior
  double log_det_ = 0.0;
  Right with_, without_;
};

}  // namespace

std::vector<ModelLevel> usual_levels() {
  std::vector<ModelLevel> levels;
  for (const Prior& ripple : kRipple)
    for (const Prior& compliance : kCompliance)
      for (const Prior& transmission : kTransmission)
        levels.push_back({compliance.value, transmission.value, ripple.value});
  return levels;
}

struct LevelSums::Impl {
  Groups groups;
  Eigen::VectorXd start;  ///< in the groups' order
  std::vector<ModelLevel> levels;
  std::vector<Gathered> gathered;  ///< per ripple

  const Gathered& of(double ripple_rad) const {
    return *std::find_if(gathered.begin(), gathered.end(),
                         [&](const Gathered& g) { return g.ripple_rad == ripple_rad; });
  }
};

LevelSums::LevelSums(const Problem& problem, const Eigen::VectorXd& u, const Linearisation& at,
                     std::span<const ModelLevel> levels)
    : impl_(new Impl{Groups(problem), {}, {levels.begin(), levels.end()}, {}}) {
  impl_->start = u(impl_->groups.order);
  const Eigen::Index n = problem.size();
  for (const ModelLevel& level : levels) {
    if (std::any_of(impl_->gathered.begin(), impl_->gathered.end(),
                    [&](const Gathered& g) { return g.ripple_rad == level.ripple_rad; }))
      continue;
    impl_->gathered.push_back(
        {level.ripple_rad, Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
    gather(problem, at, impl_->groups, impl_->gathered.back());
  }
}

LevelSums::~LevelSums() = default;
LevelSums::LevelSums(LevelSums&&) noexcept = default;
LevelSums& LevelSums::operator=(LevelSums&&) noexcept = default;

void LevelSums::add(const Problem& problem, const Linearisation& rows) {
  for (Gathered& g : impl_->gathered) gather(problem, rows, impl_->groups, g);
}

LevelMean LevelSums::mean() const {
  const Groups& groups = impl_->groups;
  const Eigen::Index size = impl_->start.size();
  std::list<Family> families;
  struct Solved {
    Step step;
    const Family* family;
  };
  std::vector<Solved> solved;
  for (const ModelLevel& level : impl_->levels) {
    auto f = std::find_if(families.begin(), families.end(), [&](const Family& other) {
      return other.ripple_rad() == level.ripple_rad && other.compliance() == level.compliance;
    });
    if (f == families.end())
      f = families.emplace(f, groups, impl_->of(level.ripple_rad), impl_->start, level.compliance);
    Step step = f->solve(level);
    if (step.solved) solved.push_back({std::move(step), &*f});
  }
  if (solved.empty())
    throw IdentifyError(
        "the touches and priors do not determine the unknowns; give the targets a "
        "centre_sigma_mm and the joints tolerances");
  std::stable_sort(solved.begin(), solved.end(), [](const Solved& a, const Solved& b) {
    return a.step.log_evidence > b.step.log_evidence;
  });
  const double best = solved.front().step.log_evidence;
  double sum = 0.0;
  for (const Solved& s : solved) sum += std::exp(s.step.log_evidence - best);

  LevelMean result;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(size);
  std::vector<Eigen::VectorXd> solutions;  // of the levels that have a say
  for (const Solved& s : solved) {
    const double p = std::exp(s.step.log_evidence - best) / sum;
    result.levels.push_back({s.step.level, s.step.log_evidence, p});
    if (best - s.step.log_evidence > kHopeless) continue;
    solutions.push_back(s.family->solution(s.step));
    mean += p * solutions.back();
    result.ripple_rad += p * std::pow(s.step.level.ripple_rad, 2);
    result.transmission += p * std::pow(s.step.level.transmission, 2);
  }
  result.ripple_rad = std::sqrt(result.ripple_rad);
  result.transmission = std::sqrt(result.transmission);
  // Within the levels, and between them.
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
  for (const Family& family : families) {
    std::vector<std::pair<const Step*, double>> heard;
    for (std::size_t k = 0; k < solutions.size(); ++k)
      if (solved[k].family == &family)
        heard.emplace_back(&solved[k].step, result.levels[k].probability);
    if (!heard.empty()) family.add_covariance(heard, covariance);
  }
  for (std::size_t k = 0; k < solutions.size(); ++k) {
    const Eigen::VectorXd off = solutions[k] - mean;
    covariance.noalias() += (result.levels[k].probability * off) * off.transpose();
  }
  result.u.resize(size);
  result.u(groups.order) = mean;
  result.covariance_u.resize(size, size);
  result.covariance_u(groups.order, groups.order) = covariance;
  return result;
}

LevelMean mean_over_levels(const Problem& problem, const Eigen::VectorXd& u,
                           const Linearisation& at, std::span<const ModelLevel> levels) {
  return LevelSums(problem, u, at, levels).mean();
}

}  // namespace cellcal::calib
