#include "calib/verdict/verdict.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>

#include "calib/consistency/artefact_bias.h"
#include "calib/consistency/duplicates.h"
#include "calib/consistency/lengths.h"
#include "calib/consistency/outliers.h"
#include "calib/estimate/solve.h"
#include "calib/estimate/target_place.h"
#include "calib/verdict/temperature.h"
#include "calib/verdict/tolerances.h"

namespace cellcal::calib {

namespace {

/// Residuals twice as large as stated leave chi^2/dof at 4: the noise is not what the cell file
/// says, or the arm has errors that the model lacks.
constexpr double kChi2Limit = 4.0;
/// A tenth of all may be gross errors, and chance makes more of it.
constexpr double kOutlierShare = 0.15;
/// Held-out touches may be worse than the calibration predicts for them, but not by this much.
constexpr double kCheckRatio = 2.0;
/// Of the check touches, too, a few are gross errors: one, or one in so many, where there are
/// enough, further off than so many times what is predicted for them.
constexpr std::size_t kEnoughChecks = 8, kOneGrossOf = 10;
constexpr double kGrossCheck = 4.0;
/// Of one target's: with so many left out the others say too little of its place, unless there are
/// enough of them; then so many are still chance.
constexpr double kOutlierShareOfTarget = 0.20, kOutlierShareOfMany = 1.0 / 3.0;
constexpr int kEnoughOthers = 15;
/// And the others are as stated: chi^2 per degree of freedom.
constexpr double kAsStated = 1.5;
/// One touch left out is the usual case where so many remain, and what the outliers are for.
constexpr int kEnoughBesideOne = 4;
/// Of the geometry's directions: with less the result is the tolerances, not the touches.
constexpr double kToldShare = 0.5;
/// A session that has made fewer of each target has only begun.
constexpr std::size_t kBegunPerTarget = 5;
/// That suffice for most cells; what a first session says to go on with.
constexpr int kUsualTouches = 40, kUsualChecks = 10;
/// A joint or tool does not give against its load; noise may say so by this many sigmas.
constexpr double kAgainstLoad = 5.0;
/// With a perfect arm a target's touches would hold its place to sigma / sqrt(n lambda), lambda the
/// smallest eigenvalue of the mean of the outer products of what they say about it. Where that is
/// worse than this they say more about the target's place than about the arm.
constexpr double kPlaceSigmaM = 0.3e-3;
/// At this distance, where a target turns: the region that counts as near it.
constexpr double kPlaceLeverM = 0.150;
/// Certified lengths hold the scale where sigma over length of all together is no more than this.
constexpr double kLengthScaleSigma = 5e-4;
/// A tracker measures lengths itself, and so does a wire. Their touches hold the scale where, with
/// a perfect arm, they would hold it to this; a tracker's from at least this many places.
constexpr double kScaleSigma = 1e-4;
constexpr int kScalePlaces = 4;

/// Mean 3-D error that a result may be published with where the cell file asks for none
/// (required_mm): what industrial arms have as they are delivered. More is no calibration.
constexpr double kRequiredM = 2e-3;
/// And of the nominal arm's own error: closer to it than this, and nobody could tell that anything
/// was gained.
constexpr double kOfNominal = 0.8;

/// Fit touches of a block that are in use.
std::vector<std::size_t> used_touches(const Problem& problem, const Calibration& c, int block) {
  std::vector<std::size_t> used;
  for (const TouchResidual& r : c.residuals)
    if (problem.block_of(r.touch) == block && !r.outlier &&
        problem.touches()[r.touch].set == TouchSet::kFit)
      used.push_back(r.touch);
  return used;
}

/// Smallest eigenvalue of what these touches say about the place of their target [1/m^2].
double least_information(const Problem& problem, const Eigen::VectorXd& x, const TargetBlock& block,
                         const std::vector<std::size_t>& touches) {
  const TargetKind kind = problem.cell().targets[block.target].kind;
  Eigen::VectorXd lever = Eigen::VectorXd::Ones(block.place);
  if (kind == TargetKind::kPlane) lever.head<2>().setConstant(kPlaceLeverM);
  if (kind == TargetKind::kTracker) lever.tail<3>().setConstant(kPlaceLeverM);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(block.place, block.place);
  const Problem::At at = problem.at(x.data());
  double r[Problem::kMostRows], by_target[Problem::kMostRows * TargetBlock::kMost];
  for (const std::size_t i : touches) {
    problem.residual_m(i, at, r, nullptr, by_target);
    const Eigen::MatrixXd j =
        Eigen::Map<const RowMajor>(by_target, problem.place_rows(i), block.size())
            .leftCols(block.place) *
        lever.cwiseInverse().asDiagonal();
    information += j.transpose() * j / std::pow(problem.sigma_m(i), 2);
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(information).eigenvalues()[0];  // (56)
}

/// Wires as long as what is to be measured with them; one as short as a sphere's radius is no rule.
bool wire_holds_scale(const Problem& problem, const std::vector<std::size_t>& touches) {
  double information = 0.0;
  for (const std::size_t i : touches)
    if (const double length_m = problem.touches()[i].radius_m; length_m > kPlaceLeverM)
      information += std::pow(length_m / problem.sigma_m(i), 2);  // (55)
  return information * kScaleSigma * kScaleSigma > 1.0;
}

bool tracker_holds_scale(const Problem& problem, const std::vector<std::size_t>& touches) {
  std::vector<Eigen::Vector3d> readings;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const std::size_t i : touches) {
    const double* m = problem.touches()[i].tracker_m;
    const Eigen::Vector3d reading(m[0], m[1], m[2]);
    // A place that was visited again is no other place.
    if (std::none_of(readings.begin(), readings.end(), [&](const Eigen::Vector3d& other) {
          return (other - reading).norm() < kPlaceLeverM;
        }))
      readings.push_back(reading);
    middle += reading / static_cast<double>(touches.size());
  }
  if (static_cast<int>(readings.size()) < kScalePlaces) return false;
  double information = 0.0;
  for (const std::size_t i : touches)
    information +=
        (Eigen::Map<const Eigen::Vector3d>(problem.touches()[i].tracker_m) - middle).squaredNorm() /
        std::pow(problem.sigma_m(i), 2);
  return information * kScaleSigma * kScaleSigma > 1.0;
}

/// None without covariance.
std::vector<HeldOut> held_out(const Problem& problem, const Calibration& c) {
  if (c.covariance.rows() != problem.size()) return {};
  Eigen::VectorXd x(problem.size());
  for (int i = 0; i < problem.size(); ++i)
    x[i] = c.parameters[static_cast<std::size_t>(i)].nominal +
           c.parameters[static_cast<std::size_t>(i)].correction;
  const Problem::At at = problem.at(x.data());
  std::vector<HeldOut> all;
  for (std::size_t t = 0; t < problem.touches().size(); ++t) {
    if (problem.touches()[t].set != TouchSet::kCheck || problem.block_of(t) < 0) continue;
    const TargetBlock& block = problem.blocks()[problem.block_of(t)];
    const int rows = problem.rows(t), shared = problem.shared_size();
    Eigen::VectorXd residual(rows);
    RowMajor by_shared(rows, shared), by_target(rows, block.size());
    problem.residual_m(t, at, residual.data(), by_shared.data(), by_target.data());
    RowMajor j = RowMajor::Zero(rows, problem.size());
    j.leftCols(shared) = by_shared;
    j.middleCols(block.first, block.size()) = by_target;
    const Eigen::VectorXd variance = (j * c.covariance).cwiseProduct(j).rowwise().sum().array() +
                                     std::pow(problem.sigma_m(t), 2);
    all.push_back(
        // (58)
        {t, residual.cwiseAbs2().cwiseQuotient(variance).sum(), static_cast<double>(rows)});
  }
  return all;
}

/// Root of the mean square; 0 of none.
double rms_of(std::span<const HeldOut> touches) {
  double sum = 0.0, rows = 0.0;
  for (const HeldOut& one : touches) {
    sum += one.square;
    rows += one.rows;
  }
  return rows == 0.0 ? 0.0 : std::sqrt(sum / rows);
}

}  // namespace

/// What to do about a target whose touches do not fit.
const char* again_words(TargetKind kind) {
  switch (kind) {
    case TargetKind::kSphere:
    case TargetKind::kPlane:
      return "clean it and touch it again";
    case TargetKind::kWire:
      return "check that it runs free and measure again";
    case TargetKind::kPoint:
      return "check that the tip seats in it and touch it again";
    case TargetKind::kTracker:
      return "check the line of sight and the reflector, and measure again";
  }
  return "";
}

/// What is against the touches in use of each target: too many were left out.
void judge_outliers(const Problem& problem, const Calibration& c,
                    std::vector<std::string>& blocking) {
  const auto touches = problem.touches();
  std::vector<int> fit(problem.blocks().size(), 0), outliers = fit;
  for (const TouchResidual& r : c.residuals) {
    if (touches[r.touch].set != TouchSet::kFit) continue;
    const auto block = static_cast<std::size_t>(problem.block_of(r.touch));
    ++fit[block];
    if (r.outlier) ++outliers[block];
  }
  const int all = std::accumulate(fit.begin(), fit.end(), 0),
            out = std::accumulate(outliers.begin(), outliers.end(), 0);
  if (out > kOutlierShare * all) {
    blocking.push_back(
        fmt::format("outliers: {} of {} fit touches are not what their target allows", out, all));
    return;
  }
  for (std::size_t b = 0; b < fit.size(); ++b) {
    const double most = fit[b] - outliers[b] < kEnoughOthers || c.chi2_per_dof > kAsStated
                            ? kOutlierShareOfTarget
                            : kOutlierShareOfMany;
    if (outliers[b] > 0 && outliers[b] >= most * fit[b] &&
        (outliers[b] > 1 || fit[b] - 1 < kEnoughBesideOne)) {
      const Target& target = problem.cell().targets[problem.blocks()[b].target];
      blocking.push_back(fmt::format(
          "outliers: {} of {} fit touches of {} are not what it allows, and the others say too "
          "little of where it is; {}",
          outliers[b], fit[b], target.id, again_words(target.kind)));
    }
  }
}

/// What the calibration foresees of itself where its scope is: below what was asked for, and below
/// what the nominal arm does there.
void judge_predicted(const Problem& problem, const Calibration& c, bool workspace,
                     std::vector<std::string>& blocking) {
  if (!(c.nominal_m3_m > 0.0)) return;
  const double predicted_m = workspace ? c.predicted_m3_m : c.predicted_m2_m;
  const double nominal_m = workspace ? c.nominal_m3_m : c.nominal_m2_m;
  const char* where = workspace ? "over the workspace" : "near the targets";
  const double required_m = problem.cell().required_m.value_or(kRequiredM);
  if (predicted_m > required_m)
    blocking.push_back(fmt::format(
        "required: {:.2f} mm predicted {}, {:.2f} mm {}; make more touches in postures more "
        "unlike, "
        "or state a larger required_mm",
        predicted_m * 1e3, where, required_m * 1e3,
        problem.cell().required_m ? "required by the cell file (required_mm)"
                                  : "allowed where the cell file states no required_mm"));
  if (predicted_m > kOfNominal * nominal_m)
    blocking.push_back(
        fmt::format("no gain: {:.2f} mm predicted {}, {:.2f} mm with the nominal arm ({:.0f} %, at "
                    "most {:.0f} % "
                    "is a gain); make more touches in postures more unlike",
                    predicted_m * 1e3, where, nominal_m * 1e3, 100.0 * predicted_m / nominal_m,
                    100.0 * kOfNominal));
}

/// What was gained, of a result that may be used.
std::string gain_words(const Problem& problem, const Calibration& c, bool workspace) {
  const double predicted_m = workspace ? c.predicted_m3_m : c.predicted_m2_m;
  const double nominal_m = workspace ? c.nominal_m3_m : c.nominal_m2_m;
  return fmt::format(
      "gain: {:.2f} mm predicted {}, {:.2f} mm with the nominal arm ({:.0f} %); {:.2f} mm {}",
      predicted_m * 1e3, workspace ? "over the workspace" : "near the targets", nominal_m * 1e3,
      100.0 * predicted_m / nominal_m, problem.cell().required_m.value_or(kRequiredM) * 1e3,
      problem.cell().required_m ? "required" : "allowed (required_mm not stated)");
}

/// What the model does not explain: how much, and what tells it from noise. Empty where there is
/// none.
std::string model_error_words(const Problem& problem, const Calibration& c) {
  const Discrepancy& d = c.discrepancy;
  if (!(d.sigma_m > 0.0)) return {};
  const bool measured = c.repeats.degrees_of_freedom > 0.0;
  constexpr double kDegPerRad = 57.29577951308232;
  if (!d.estimated)
    return fmt::format(
        "model error: the touches scatter by {:.3f} mm, and {}; {:.3f} mm of it are in every bound "
        "as an error of the arm. {}",
        c.touch_noise_m * 1e3,
        measured ? fmt::format("repeated ones by {:.3f} mm", c.repeats.scatter_m * 1e3)
                 : std::string("no repeats show that it is noise"),
        d.sigma_m * 1e3,
        measured
            ? "More touches do not reduce it"
            : "Touch five places four times each: what repeats scatter is noise, and leaves the "
              "bounds");
  return fmt::format(
      "model error: {:.3f} mm (1 sigma, each direction) that the model does not explain, beside a "
      "touch noise of {:.3f} mm{}{}; it is in every bound, and more touches do not reduce it{}",
      d.sigma_m * 1e3, d.noise_m * 1e3, measured ? " (repeats)" : "",
      d.reach_rad > 0.0
          ? fmt::format(", alike over {:.0f} deg of the main axes", d.reach_rad * kDegPerRad)
          : std::string(),
      measured
          ? ""
          : fmt::format(". Touch five places four times each to measure the noise, and state "
                        "in sigma_mm ({:.3f}) what the instrument repeats to, not what the fit "
                        "leaves",
                        problem.cell().touch_sigma_m * 1e3));
}

/// Two certificates of one length; all else is too uncertain to say which of them is wrong.
void judge_certified_twice(const Calibration& c, std::vector<std::string>& blocking) {
  for (std::size_t a = 0; a < c.lengths.size(); ++a)
    for (std::size_t b = a + 1; b < c.lengths.size(); ++b) {
      const LengthResult &one = c.lengths[a], &other = c.lengths[b];
      // As if the other certificate were all that is said of the one.
      LengthResult by_other = one;
      by_other.by_others_m = other.certified_m;
      by_other.sigma_m = other.certified_sigma_m;
      if (!same_ends(one, other) || !is_contradicted(by_other)) continue;
      blocking.push_back(fmt::format(
          "certified length: {} and {} are certified as {:.3f} mm and as {:.3f} mm apart, which "
          "cannot both be right; leave the wrong one out",
          one.from, one.to, one.certified_m * 1e3, other.certified_m * 1e3));
    }
}

/// The certified length that all else contradicts most: one that is wrong pulls at the others.
void judge_lengths(const Calibration& c, std::vector<std::string>& blocking) {
  const LengthResult* worst = worst_contradicted(c.lengths);
  if (worst == nullptr) {
    judge_certified_twice(c, blocking);
    return;
  }
  const auto others = std::count_if(c.lengths.begin(), c.lengths.end(), is_contradicted) - 1;
  blocking.push_back(fmt::format(
      "certified length: by all else {} and {} lie {:.3f} +- {:.3f} mm apart instead of {:.3f} mm, "
      "{:.0f} times what both leave open{}; check it and that neither was moved",
      worst->from, worst->to, std::max(0.0, worst->by_others_m) * 1e3, worst->sigma_m * 1e3,
      worst->certified_m * 1e3, contradiction(*worst),
      others > 0
          ? fmt::format(" ({} more {} contradicted, by less)", others, others == 1 ? "is" : "are")
          : ""));
}

/// The sphere's diameter, or the wire's zero, that all else contradicts most.
void judge_sizes(const Calibration& c, std::vector<std::string>& blocking) {
  const SizeResult* worst = worst_contradicted(c.sizes);
  // What was touched from one side, or in a plane, moves for its size to second order.
  if (worst != nullptr && std::none_of(blocking.begin(), blocking.end(), [&](const std::string& r) {
        return r.starts_with("too few directions: " + worst->target + " ");
      }))
    blocking.push_back(
        fmt::format("size: all else would have {}, {:.0f} times what both leave open; check it, "
                    "and that the target is clean",
                    size_words(c.cell, *worst), contradiction(*worst)));
}

/// Loads that bend the arm the wrong way.
void judge_loads(const Problem& problem, const Calibration& c, std::vector<std::string>& blocking) {
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ArmParameterKind kind = problem.arm().parameters()[p].kind;
    if (kind != ArmParameterKind::kCompliance && kind != ArmParameterKind::kDeflection) continue;
    const ParameterResult& found = c.parameters[static_cast<std::size_t>(p)];
    if (found.sigma > 0.0 && found.nominal + found.correction < -kAgainstLoad * found.sigma)
      blocking.push_back(fmt::format(
          "against gravity: {} is negative by {:.0f} of its sigmas, as if the load pushed up; "
          "check gravity and base in robot and cell file",
          found.name, -(found.nominal + found.correction) / found.sigma));
  }
}

/// Each of the lengths once, the most certain of those between the same two ends; where the touches
/// do not hold both ends a length says nothing of the arm.
std::vector<Problem::Length> different_lengths(const Problem& problem,
                                               const std::vector<int>& loose) {
  const auto is_loose = [&](int block) {
    return std::find(loose.begin(), loose.end(), block) != loose.end();
  };
  std::vector<Problem::Length> different;
  for (const Problem::Length& length : problem.lengths()) {
    if (is_loose(length.block_a) || is_loose(length.block_b)) continue;
    const auto known =
        std::find_if(different.begin(), different.end(), [&](const Problem::Length& other) {
          return std::minmax(length.block_a, length.block_b) ==
                 std::minmax(other.block_a, other.block_b);
        });
    if (known == different.end())
      different.push_back(length);
    else if (length.sigma_m < known->sigma_m)
      *known = length;
  }
  return different;
}

bool hold_scale(const std::vector<Problem::Length>& lengths) {
  double information = 0.0;
  for (const Problem::Length& length : lengths)
    information += std::pow(length.length_m / length.sigma_m, 2);  // (54)
  return information * kLengthScaleSigma * kLengthScaleSigma >= 1.0;
}

/// Others than its certificate say how long it is, so well that they would hold the scale
/// themselves; or it was measured twice. A certificate that is written down twice does not count.
bool is_checked(const Calibration& c, const LengthResult& length) {
  return length.sigma_m < kLengthScaleSigma * length.certified_m ||
         std::any_of(c.lengths.begin(), c.lengths.end(), [&](const LengthResult& other) {
           return same_ends(length, other) && other.certified_m != length.certified_m;
         });
}

/// Where all hangs on one certificate; empty where it does not.
std::string unchecked_scale(const Calibration& c, std::size_t holding) {
  if (c.lengths.empty() || std::any_of(c.lengths.begin(), c.lengths.end(),
                                       [&](const LengthResult& l) { return is_checked(c, l); }))
    return {};
  const LengthResult& best = *std::min_element(
      c.lengths.begin(), c.lengths.end(), [](const LengthResult& a, const LengthResult& b) {
        return least_seen_error_m(a) < least_seen_error_m(b);
      });
  if (holding > 1)
    return fmt::format(
        "unchecked scale: the touches are too few to check one of the {} certified lengths by the "
        "others; wrong by less than {:.1f} mm even the best checked ({} and {}) would not be "
        "noticed. Make more touches of each target",
        holding, least_seen_error_m(best) * 1e3, best.from, best.to);
  return fmt::format(
      "unchecked scale: nothing but its certificate says that {} and {} lie {:.3f} mm apart; wrong "
      "by less than {:.1f} mm it would not be noticed, and all lengths of the arm would be wrong "
      "in "
      "proportion. Certify a second length between touched targets, or have this one measured "
      "again",
      best.from, best.to, best.certified_m * 1e3, least_seen_error_m(best) * 1e3);
}

/// Why the result claims nothing away from the targets, and what would hold the scale.
std::string near_targets_words(const Problem& problem, const std::vector<int>& loose) {
  const bool sized =
      std::any_of(problem.blocks().begin(), problem.blocks().end(), [&](const TargetBlock& block) {
        return problem.cell().targets[block.target].kind == TargetKind::kSphere;
      });
  const bool centred =
      std::any_of(problem.blocks().begin(), problem.blocks().end(), [&](const TargetBlock& block) {
        return has_a_centre(problem.cell().targets[block.target].kind);
      });
  const std::string why =
      problem.lengths().empty() ? "no certified length was touched"
      : !loose.empty() && different_lengths(problem, loose).empty()
          ? "no certified length has ends that the touches hold"
          : "the certified lengths are not certain enough (all together worse than 0.5 mm per "
            "metre)";
  return fmt::format(
      "scope: {}, so only the {} the scale; the result claims nothing away from the targets. {}",
      why, sized ? "size of the spheres holds" : "drawing's tolerances hold",
      !loose.empty() ? "Touch each target from more sides"
      : centred
          ? "Touch two targets at a certified distance"
          : "Add two targets with centres at a certified distance (spheres, points), or readings "
            "of a tracker or a long wire");
}

/// Targets of the cell file without a touch; empty where there are none.
std::string untouched_targets(const Problem& problem) {
  const auto& targets = problem.cell().targets;
  std::vector<std::string> names;
  for (std::size_t t = 0; t < targets.size(); ++t)
    if (std::none_of(problem.blocks().begin(), problem.blocks().end(),
                     [&](const TargetBlock& block) { return block.target == t; }) &&
        std::none_of(problem.touches().begin(), problem.touches().end(),
                     [&](const Touch& touch) { return touch.target == targets[t].id; }))
      names.push_back(targets[t].id);
  if (names.empty()) return {};
  const auto& lengths = problem.cell().lengths;
  const auto idle =
      std::count_if(lengths.begin(), lengths.end(), [&](const CertifiedLength& length) {
        return std::any_of(names.begin(), names.end(), [&](const std::string& name) {
          return name == length.from || name == length.to;
        });
      });
  std::string words = fmt::format("not touched: {} of the cell file", fmt::join(names, ", "));
  if (idle > 0)
    words += fmt::format("; {} certified length{} there and hold{} nothing", idle,
                         idle == 1 ? " ends" : "s end", idle == 1 ? "s" : "");
  return words;
}

/// Targets that the touches put far from where the cell file states them; empty where none is.
std::string far_centres(const Problem& problem, const Calibration& c) {
  constexpr double kFarCentre = 5.0;
  std::vector<std::pair<double, std::string>> far;
  for (const TargetResult& found : c.targets) {
    const Target& target = problem.cell().targets[problem.cell().target_index(found.id)];
    if (!centre_is_held(target)) continue;
    const double off_m = (found.centre_m - target.centre_m).norm();
    if (off_m > kFarCentre * target.centre_sigma_m)
      far.emplace_back(off_m / target.centre_sigma_m,
                       fmt::format("{} by {:.1f} mm, {:.0f} times its centre_sigma_mm", target.id,
                                   off_m * 1e3, off_m / target.centre_sigma_m));
  }
  if (far.empty()) return {};
  for (const TargetResult& one : c.targets)
    for (const TargetResult& other : c.targets) {
      const Target& a = problem.cell().targets[problem.cell().target_index(one.id)];
      const Target& b = problem.cell().targets[problem.cell().target_index(other.id)];
      if (!(one.id < other.id) || !centre_is_held(a) || !centre_is_held(b)) continue;
      const double sigma_m = kFarCentre * std::max(a.centre_sigma_m, b.centre_sigma_m);
      if ((a.centre_m - b.centre_m).norm() < 2.0 * sigma_m) continue;
      if ((one.centre_m - b.centre_m).norm() < sigma_m &&
          (other.centre_m - a.centre_m).norm() < sigma_m)
        return fmt::format(
            "stated centre: {} was touched where the cell file states {}, and {} where it states "
            "{}; exchange their centre_mm, or the ids of their touches",
            a.id, b.id, b.id, a.id);
    }
  return fmt::format(
      "stated centre: not where the cell file states it is {}; check centre_mm, of the arm's base "
      "frame",
      farthest_words(std::move(far)));
}

bool is_note(std::string_view reason) {
  for (const std::string_view opening :
       {"scope: ", "no check touches: ", "since the last one: ", "unchecked scale: ",
        "not touched: ", "gross check touches: ", "stated centre: ", "beyond tolerance: ",
        "radius offset: ", "unseen place: ", "not judged: ", "temperature: ", "model error: ",
        "gain: "})
    if (reason.starts_with(opening)) return true;
  return false;
}

std::vector<std::size_t> gross_check_touches(const Problem& problem, const Calibration& c) {
  std::vector<HeldOut> all = held_out(problem, c);
  if (all.size() < kEnoughChecks) return {};
  std::stable_sort(all.begin(), all.end(), [](const HeldOut& a, const HeldOut& b) {
    return a.square / a.rows > b.square / b.rows;
  });
  const std::size_t most = std::max<std::size_t>(1, all.size() / kOneGrossOf);
  std::size_t aside = 0;
  while (rms_of(std::span(all).subspan(aside)) > kCheckRatio) {
    if (aside == most || all[aside].square < kGrossCheck * kGrossCheck * all[aside].rows) return {};
    ++aside;
  }
  std::vector<std::size_t> touches;
  for (std::size_t k = 0; k < aside; ++k) touches.push_back(all[k].touch);
  return touches;
}

/// How far from its stated place a nominal tip met its target; none where that is not stated.
std::optional<double> met_off_m(const Problem& problem, const Touch& touch) {
  const Cell& cell = problem.cell();
  const Target& target = cell.targets[cell.target_index(touch.target)];
  const bool plane = target.kind == TargetKind::kPlane && target.has_normal;
  if (!target.has_centre || (!plane && target.kind != TargetKind::kSphere)) return std::nullopt;
  const Eigen::Vector3d from_centre =
      problem.arm().nominal_tip_m(touch.joint_rad) - target.centre_m;
  const double surface =
      plane ? from_centre.dot(target.normal) : from_centre.norm() - target.diameter_m / 2.0;
  return std::abs(surface - cell.tool.tip_radius_m);
}

/// A first session: fewer touches than a calibration begins with.
bool has_only_begun(const Problem& problem) {
  const auto fit = std::count_if(problem.touches().begin(), problem.touches().end(),
                                 [](const Touch& touch) { return touch.set == TouchSet::kFit; });
  return static_cast<std::size_t>(fit) < kBegunPerTarget * problem.blocks().size();
}

/// What a first session has shown.
std::string begun_words(const Problem& problem) {
  int met = 0;
  double farthest_m = 0.0;
  for (const Touch& touch : problem.touches())
    if (const auto off = met_off_m(problem, touch)) {
      ++met;
      farthest_m = std::max(farthest_m, *off);
    }
  const std::size_t all = problem.touches().size();
  return fmt::format(
      "too few touches: the cell works, {} of {} touches {}. Now calibrate with {} touches and {} "
      "to check",
      met > 0 ? static_cast<std::size_t>(met) : all, all,
      met > 0 ? fmt::format("within {:.1f} mm of where the cell file has their targets",
                            farthest_m * 1e3)
              : "made",
      kUsualTouches, kUsualChecks);
}

Verdict judge(const Problem& problem, const Calibration& c) {
  Verdict verdict;
  std::size_t wanting = 0;  // of what blocks, how much more touches would mend
  std::vector<std::string> blocking;
  if (c.chi2_per_dof > kChi2Limit)
    blocking.push_back(fmt::format(
        "chi^2: the touches scatter {:.1f} times more than {} ({:.3f} instead of {:.3f} mm). State "
        "what the instrument repeats to, not what the fit leaves; five places touched four times "
        "each measure it",
        std::sqrt(c.chi2_per_dof),
        c.repeats.degrees_of_freedom > 0.0 ? "repeated ones and the cell file state"
                                           : "the cell file states",
        c.touch_noise_m * 1e3,
        (c.repeats.used_m > 0.0 ? c.repeats.used_m : problem.cell().touch_sigma_m) * 1e3));
  if (std::string words = copies_words(problem.touches()); !words.empty())
    blocking.push_back(std::move(words));
  judge_outliers(problem, c, blocking);
  if (c.observability.told < kToldShare * c.observability.directions) {
    ++wanting;
    blocking.push_back(fmt::format(
        "rank: the touches tell {} of the {} directions of the geometry better than the "
        "tolerances do; make more, in postures more unlike",
        c.observability.told, c.observability.directions));
  }
  Eigen::VectorXd x(problem.size());
  for (int i = 0; i < problem.size(); ++i) {
    const ParameterResult& found = c.parameters[static_cast<std::size_t>(i)];
    x[i] = found.nominal + found.correction;
  }
  std::vector<int> loose;  // blocks whose touches do not hold their place
  std::string rule;        // what holds the scale beside certified lengths
  int trackers = 0, wires = 0;
  for (std::size_t b = 0; b < problem.blocks().size(); ++b) {
    const TargetBlock& block = problem.blocks()[b];
    const Target& target = problem.cell().targets[block.target];
    if (target.kind == TargetKind::kPoint) continue;  // one touch tells all three directions
    const auto used = used_touches(problem, c, static_cast<int>(b));
    if (target.kind == TargetKind::kTracker && tracker_holds_scale(problem, used)) {
      rule = "the places that " + target.id + " measured hold";
      ++trackers;
    }
    if (target.kind == TargetKind::kWire && wire_holds_scale(problem, used)) {
      rule = "the lengths of " + target.id + " hold";
      ++wires;
    }
    if (least_information(problem, x, block, used) * kPlaceSigmaM * kPlaceSigmaM > 1.0) continue;
    if (used.empty()) {
      loose.push_back(static_cast<int>(b));
      blocking.push_back("too few directions: all touches of " + target.id + " were left out");
      continue;
    }
    loose.push_back(static_cast<int>(b));
    const char* what =
        target.kind == TargetKind::kPlane
            ? "touched {} at places too near each other or in a line; touch it farther apart in "
              "two directions"
        : target.kind == TargetKind::kTracker
            ? "read {} at places too near each other or in a line; measure farther apart"
        : target.kind == TargetKind::kWire
            ? "pulled {} in directions too much alike; measure from more sides"
            : "touched {} in directions too much alike; touch it from more sides";
    ++wanting;
    blocking.push_back(fmt::format(
        "too few directions: {} was {}", target.id,
        fmt::format(fmt::runtime(what),
                    fmt::format("{} time{}", used.size(), used.size() == 1 ? "" : "s"))));
  }
  judge_lengths(c, blocking);
  judge_sizes(c, blocking);
  judge_loads(problem, c, blocking);
  judge_radius(problem, c, blocking);
  judge_drawing(problem, c, blocking);
  std::vector<HeldOut> checks = held_out(problem, c);
  std::erase_if(checks, [&](const HeldOut& one) { return c.residuals[one.touch].outlier; });
  checks.insert(checks.end(), c.unseen.held_out.begin(), c.unseen.held_out.end());
  if (const double ratio = rms_of(checks); ratio > kCheckRatio) {
    blocking.push_back(
        fmt::format("check touches: held-out touches leave {:.3f} mm rms, {:.1f} times what the "
                    "calibration predicts for them",
                    c.check.rms_m * 1e3, ratio));
    constexpr int kInWords = 3;
    int elsewhere = 0;
    for (const TouchResidual& r : c.residuals) {
      if (problem.touches()[r.touch].set != TouchSet::kCheck || r.outlier || std::isnan(r.after_m))
        continue;
      const auto other = lies_on(problem, c, r);
      if (other && ++elsewhere <= kInWords)
        blocking.back() += fmt::format("; {} of {} lies on {}: correct its target",
                                       touch_words(r.touch, problem.touches()[r.touch]),
                                       problem.touches()[r.touch].target, *other);
    }
    if (elsewhere > kInWords) blocking.back() += fmt::format("; and {} more", elsewhere - kInWords);
  }

  if (wanting > 0 && wanting == blocking.size() && has_only_begun(problem)) {
    verdict.too_few = true;
    verdict.reasons.push_back(begun_words(problem));
    if (std::string words = untouched_targets(problem); !words.empty())
      verdict.reasons.push_back(std::move(words));
    return verdict;
  }
  const auto lengths = different_lengths(problem, loose);
  const bool lengths_hold = hold_scale(lengths);
  verdict.workspace = lengths_hold || !rule.empty();
  judge_predicted(problem, c, verdict.workspace, blocking);
  verdict.publish = blocking.empty();
  verdict.reasons = std::move(blocking);
  if (!rule.empty()) verdict.reasons.push_back("scope: " + rule + " the scale");
  // Wires are of one instrument, and have their scale in common.
  const bool alone =
      !rule.empty() && !lengths_hold && trackers <= 1 && (trackers == 0 || wires == 0);
  if (const ArmScale scale = arm_scale(problem, c); alone && scale.sigma > 0.0)
    verdict.reasons.push_back(fmt::format(
        "unchecked scale: nothing but these readings says how long everything is; wrong by less "
        "than {:.2f} % it would not be noticed, and all lengths of the arm would be wrong in "
        "proportion. Certify a length between touched targets",
        100.0 * scale.unseen()));
  if (lengths_hold) {
    std::string words = fmt::format("scope: {} certified length{} the scale, touched at both ends",
                                    lengths.size(), lengths.size() == 1 ? " holds" : "s hold");
    // What all certificates have in common only the arm's tolerances contradict.
    if (const ArmScale scale = arm_scale(problem, c);
        lengths.size() > 1 && rule.empty() && scale.sigma > 0.0)
      words += fmt::format("; an error that all of them share would be noticed from {:.2f} % on",
                           100.0 * scale.unseen());
    verdict.reasons.push_back(std::move(words));
    if (std::string unchecked = unchecked_scale(c, lengths.size()); !unchecked.empty())
      verdict.reasons.push_back(std::move(unchecked));
  }
  if (!verdict.workspace) verdict.reasons.push_back(near_targets_words(problem, loose));
  if (verdict.publish && c.nominal_m3_m > 0.0)
    verdict.reasons.push_back(gain_words(problem, c, verdict.workspace));
  if (std::string words = model_error_words(problem, c); !words.empty())
    verdict.reasons.push_back(std::move(words));
  if (std::string words = untouched_targets(problem); !words.empty())
    verdict.reasons.push_back(std::move(words));
  if (std::string words = far_centres(problem, c); !words.empty())
    verdict.reasons.push_back(std::move(words));
  if (verdict.publish) note_tolerances(problem, c, verdict.reasons);
  std::vector<std::pair<double, std::string>> gross;
  for (const TouchResidual& r : c.residuals) {
    const Touch& touch = problem.touches()[r.touch];
    if (touch.set != TouchSet::kCheck || !r.outlier) continue;
    const auto other = lies_on(problem, c, r);
    gross.emplace_back(std::abs(r.whitened),
                       fmt::format("{} of {} is {:.2f} mm off{}", touch_words(r.touch, touch),
                                   touch.target, std::abs(r.after_m) * 1e3,
                                   other ? " and lies on " + *other + ": correct its target" : ""));
  }
  if (!gross.empty())
    verdict.reasons.push_back("gross check touches: " + farthest_words(std::move(gross)) +
                              "; judged without");
  if (std::string words = temperature_words(problem.touches()); !words.empty())
    verdict.reasons.push_back(std::move(words));
  for (const UnseenTarget& unseen : c.unseen.targets)
    verdict.reasons.push_back(
        unseen.why_not.empty()
            ? fmt::format(
                  "unseen place: {}, that no fit touch is of: {} check touches leave {:.3f} "
                  "mm rms about the place that fits them ({:.1f} degrees of freedom)",
                  unseen.target, unseen.touches, unseen.rms_m * 1e3, unseen.degrees_of_freedom)
            : fmt::format("not judged: {}, that no fit touch is of: {}", unseen.target,
                          unseen.why_not));
  if (c.check.count == 0)
    verdict.reasons.push_back("no check touches: the residuals are of the fit itself");
  return verdict;
}

}  // namespace cellcal::calib
