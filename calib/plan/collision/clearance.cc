#include "calib/plan/collision/clearance.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <vector>

#include "calib/model/random.h"
#include "calib/plan/collision/bodies.h"
#include "calib/plan/collision/surroundings.h"

namespace cellcal::calib {

namespace {

constexpr double kBodyMarginM = 0.02;  // for everything but the tip
constexpr double kSearchMarginM =
    0.005;  // of the tool from what it touches: contact holds it there
/// Distances beyond margin and this need not be exact: they only say how far a move may be looked
/// ahead, which their lower bounds say nearly as well.
constexpr double kNearM = 0.05;
/// Pieces of a move so short that no point moves further are not halved again, whatever the margin.
constexpr double kShortM = 0.0005;
/// A corner is tried at these shares of its legs, one after the other, each with so many postures.
constexpr double kSmallerCorner = 0.6, kLeastCornerShare = 0.02;
constexpr int kMostLooks = 256;
constexpr int kPostures = 64;  // that decide which links are neighbours
constexpr unsigned kSeed = 1;

constexpr double kFar = std::numeric_limits<double>::max();

struct Mode {
  double tip_margin_m = 0.0;
  int touched = -1;  ///< target that a search may touch
};

struct Pair {
  std::size_t inner, outer;  ///< bodies; the outer one is moved by more joints
};

/// The worst that was found.
struct Finding {
  double slack_m = kFar;  ///< distance less margin
  double gap_m = 0.0;
  std::size_t body = 0;
  std::string other;
  bool low = false;  ///< below the lowest target
};

}  // namespace

struct Clearance::Impl {
  Impl(const Cell& cell, const ArmModel& arm)
      : bodies(arm),
        things(cell),
        up(up_of(cell.robot)),
        hand(cell.robot.joints.size() - 1),
        passable(cell.passable) {
    if (!cell.floor_m)
      for (const Target& target : cell.targets)
        if (has_a_centre(target.kind) && target.has_centre)
          lowest_m = std::min(lowest_m, target.centre_m.dot(up) - kBelowTargetsM);
    find_pairs(cell.robot);
  }

  /// Distance of body and thing less its margin; `exact` within kNearM. kFar: they may meet.
  double slack_m(std::size_t body, std::size_t thing, const Segment& axis, const Mode& mode,
                 bool exact, double& margin_m) const {
    const Body& b = bodies.list()[body];
    margin_m = b.is_tip ? mode.tip_margin_m : kBodyMarginM;
    if (mode.touched >= 0 && things.target(thing) == mode.touched) {
      if (b.is_tip) return kFar;
      margin_m = kSearchMarginM;
    }
    const double around = b.radius_m + margin_m;
    const double near = exact ? kNearM : 0.0;
    double distance = things.bound_m(thing, axis);
    if (distance < around + near) distance = things.distance_m(thing, axis, around + near);
    return distance - around;
  }

  /// Fills `slack` (per body, then per pair) or, where it is null, stops at the first that is hit.
  bool look(const JointVector& q, const Mode& mode, std::vector<double>* slack,
            Finding* worst) const {
    thread_local std::vector<Segment> axes;
    bodies.place(q, axes);
    const auto& list = bodies.list();
    const bool exact = slack != nullptr || worst != nullptr;
    bool is_clear = true;
    const auto note = [&](double value, double margin, std::size_t body, const std::string& other,
                          bool low) {
      if (value >= 0.0) return true;
      is_clear = false;
      if (worst != nullptr && value < worst->slack_m)
        *worst = {value, value + margin, body, other, low};
      return worst != nullptr;
    };
    if (slack != nullptr) slack->assign(list.size() + pairs.size(), kFar);
    static const std::string kNothing;
    for (std::size_t k = 0; k < list.size(); ++k) {
      if (!list[k].meets_cell) continue;
      double least = kFar;
      if (k >= hand && lowest_m < kFar) {  // hand, wrist and tool
        least = std::min(axes[k].a.dot(up), axes[k].b.dot(up)) - lowest_m;
        if (k > hand) least = kFar;
        if (!note(least, 0.0, k, kNothing, true)) return false;
      }
      for (std::size_t i = 0; i < things.size(); ++i) {
        double margin = 0.0;
        const double value = slack_m(k, i, axes[k], mode, exact, margin);
        least = std::min(least, value);
        if (!note(value, margin, k, things.words(i), false)) return false;
      }
      if (slack != nullptr) (*slack)[k] = least;
    }
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      const double value = pair_slack_m(pairs[p], axes);
      if (!note(value, kBodyMarginM, pairs[p].outer, list[pairs[p].inner].words, false))
        return false;
      if (slack != nullptr) (*slack)[list.size() + p] = value;
    }
    return is_clear;
  }

  bool passes(const JointVector& from, const JointVector& to) const {
    return !passable || passable(from, to);
  }

  bool look_along(const JointVector& from, const JointVector& to, const Mode& mode,
                  Finding* worst) const {
    struct Piece {
      double begin, end;
      std::vector<double> slack0, slack1;
    };
    JointVector q(from.size());
    const auto at = [&](double share, std::vector<double>& slack) {
      for (std::size_t i = 0; i < q.size(); ++i) q[i] = from[i] + share * (to[i] - from[i]);
      return look(q, mode, &slack, worst);
    };
    Piece all{0.0, 1.0, {}, {}};
    if (!at(0.0, all.slack0) || !at(1.0, all.slack1)) return false;
    const std::vector<double> path = paths_m(from, to), margin = margins_m(mode);
    std::deque<Piece> open;
    open.push_back(std::move(all));
    while (!open.empty()) {  // the middles of long pieces first: there most blocked moves are seen
      Piece piece = std::move(open.front());
      open.pop_front();
      bool done = true;
      for (std::size_t k = 0; k < path.size() && done; ++k) {
        const double moved = path[k] * (piece.end - piece.begin);  // (64)
        done = moved <= std::max(kShortM, piece.slack0[k] + piece.slack1[k] +
                                              2.0 * (1.0 - kMarginKept) * margin[k]);
      }
      if (done) continue;
      const double middle = (piece.begin + piece.end) / 2.0;
      std::vector<double> slack;
      if (!at(middle, slack)) return false;
      open.push_back({piece.begin, middle, std::move(piece.slack0), slack});
      open.push_back({middle, piece.end, std::move(slack), std::move(piece.slack1)});
    }
    return true;
  }

  Corner corner(const JointVector& from, const JointVector& at, const JointVector& to,
                const Mode& mode) const {
    if (passable) return {};
    const auto on_leg = [&](const JointVector& other, double share) {
      JointVector q(at);
      for (std::size_t i = 0; i < q.size(); ++i) q[i] += share * (other[i] - at[i]);
      return q;
    };
    for (double share = kMostCornerShare; share > kLeastCornerShare; share *= kSmallerCorner) {
      int looks = kMostLooks;
      if (is_clear({at, on_leg(from, share), on_leg(to, share)}, mode, looks))
        return {share, share};
    }
    return {};
  }

  /// All postures of a triangle: those of a piece of it are no farther from its middle than its
  /// corners, since levers times turns are convex.
  bool is_clear(const std::array<JointVector, 3>& triangle, const Mode& mode, int& looks) const {
    if (--looks < 0) return false;
    JointVector middle(triangle[0]);
    for (std::size_t i = 0; i < middle.size(); ++i)
      middle[i] = (triangle[0][i] + triangle[1][i] + triangle[2][i]) / 3.0;
    std::vector<double> slack;
    if (!look(middle, mode, &slack, nullptr)) return false;
    const std::vector<double> margin = margins_m(mode);
    bool done = true;
    for (const JointVector& corner : triangle) {
      const std::vector<double> path = paths_m(middle, corner);
      for (std::size_t k = 0; k < path.size(); ++k)
        done = done && path[k] <= std::max(kShortM / 2.0,  // (72)
                                           slack[k] + (1.0 - kMarginKept) * margin[k]);
    }
    if (done) return true;
    const auto between = [](const JointVector& a, const JointVector& b) {
      JointVector q(a);
      for (std::size_t i = 0; i < q.size(); ++i) q[i] = (a[i] + b[i]) / 2.0;
      return q;
    };
    const JointVector ab = between(triangle[0], triangle[1]), bc = between(triangle[1], triangle[2]),
                      ca = between(triangle[2], triangle[0]);
    return is_clear({ab, bc, ca}, mode, looks) && is_clear({triangle[0], ab, ca}, mode, looks) &&
           is_clear({ab, triangle[1], bc}, mode, looks) &&
           is_clear({ca, bc, triangle[2]}, mode, looks);
  }

  Hit of(const Finding& worst) const {
    return {worst.low ? Hit::Kind::kBelowTargets : Hit::Kind::kTooNear,
            bodies.list()[worst.body].words, worst.other, worst.gap_m};
  }

  Bodies bodies;
  Surroundings things;
  Eigen::Vector3d up;
  std::size_t hand;  ///< the body of the last link
  Passable passable;
  double lowest_m = kFar;
  std::vector<Pair> pairs;

 private:
  double pair_slack_m(const Pair& pair, const std::vector<Segment>& axes) const {
    const Body &inner = bodies.list()[pair.inner], &outer = bodies.list()[pair.outer];
    return distance_m(axes[pair.inner], axes[pair.outer]) - inner.radius_m - outer.radius_m -
           kBodyMarginM;
  }

  /// No point of the body's axis moves further; of pairs, seen from the inner body.
  std::vector<double> paths_m(const JointVector& from, const JointVector& to) const {
    const auto& list = bodies.list();
    const auto path = [&](const Body& body, int first) {
      double sum = 0.0;
      for (std::size_t j = static_cast<std::size_t>(first); j < from.size(); ++j)
        sum += std::abs(to[j] - from[j]) * body.lever[j];
      return sum;
    };
    std::vector<double> result;
    for (const Body& body : list) result.push_back(body.meets_cell ? path(body, 0) : 0.0);
    for (const Pair& pair : pairs)
      result.push_back(path(list[pair.outer], list[pair.inner].joint + 1));
    return result;
  }

  std::vector<double> margins_m(const Mode& mode) const {
    std::vector<double> result;
    for (const Body& body : bodies.list())
      result.push_back(body.is_tip ? mode.tip_margin_m
                                   : (mode.touched >= 0 ? kSearchMarginM : kBodyMarginM));
    result.resize(result.size() + pairs.size(), kBodyMarginM);
    return result;
  }

  void find_pairs(const Robot& robot) {
    const auto& list = bodies.list();
    std::vector<Pair> all;
    for (std::size_t inner = 0; inner < list.size(); ++inner)
      for (std::size_t outer = inner + 1; outer < list.size(); ++outer)
        if (list[outer].joint > list[inner].joint) all.push_back({inner, outer});
    std::vector<int> close(all.size(), 0);
    Random random(kSeed);
    std::vector<Segment> axes;
    for (int k = 0; k < kPostures; ++k) {
      JointVector q;
      for (const Joint& joint : robot.joints)
        q.push_back(random.uniform(joint.min_rad, joint.max_rad));
      bodies.place(q, axes);
      for (std::size_t p = 0; p < all.size(); ++p) close[p] += pair_slack_m(all[p], axes) < 0.0;
    }
    for (std::size_t p = 0; p < all.size(); ++p)
      if (2 * close[p] <= kPostures) pairs.push_back(all[p]);
  }
};

Clearance::Clearance(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Clearance::Clearance(const Cell& cell, const ArmModel& arm)
    : impl_(std::make_unique<Impl>(cell, arm)) {}
Clearance Clearance::blind() { return Clearance(nullptr); }
Clearance::Clearance(Clearance&&) noexcept = default;
Clearance::~Clearance() = default;

bool Clearance::clear(const JointVector& q, double tip_margin_m) const {
  return impl_ == nullptr ||
         (impl_->look(q, {tip_margin_m, -1}, nullptr, nullptr) && impl_->passes(q, q));
}

bool Clearance::clear(const JointVector& from, const JointVector& to, double tip_margin_m) const {
  return impl_ == nullptr ||
         (impl_->look_along(from, to, {tip_margin_m, -1}, nullptr) && impl_->passes(from, to));
}

bool Clearance::clear_search(const JointVector& from, const JointVector& to, std::size_t target,
                             double tip_margin_m) const {
  return impl_ == nullptr ||
         (impl_->look_along(from, to, {tip_margin_m, static_cast<int>(target)}, nullptr) &&
          impl_->passes(from, to));
}

Corner Clearance::corner(const JointVector& from, const JointVector& at, const JointVector& to,
                         double tip_margin_m) const {
  if (impl_ == nullptr) return {kMostCornerShare, kMostCornerShare};
  return impl_->corner(from, at, to, {tip_margin_m, -1});
}

std::optional<Hit> Clearance::hit(const JointVector& q, double tip_margin_m) const {
  if (impl_ == nullptr) return std::nullopt;
  Finding worst;
  const bool is_clear = impl_->look(q, {tip_margin_m, -1}, nullptr, &worst);
  if (!is_clear) return impl_->of(worst);
  if (!impl_->passes(q, q)) return Hit{Hit::Kind::kImpassable};
  return std::nullopt;
}

std::optional<Hit> Clearance::hit(const JointVector& from, const JointVector& to,
                                  double tip_margin_m) const {
  if (impl_ == nullptr) return std::nullopt;
  Finding worst;
  const bool is_clear = impl_->look_along(from, to, {tip_margin_m, -1}, &worst);
  if (!is_clear) return impl_->of(worst);
  if (!impl_->passes(from, to)) return Hit{Hit::Kind::kImpassable};
  return std::nullopt;
}

std::optional<Hit> Clearance::hit_search(const JointVector& from, const JointVector& to,
                                         std::size_t target, double tip_margin_m) const {
  if (impl_ == nullptr) return std::nullopt;
  Finding worst;
  const bool is_clear =
      impl_->look_along(from, to, {tip_margin_m, static_cast<int>(target)}, &worst);
  if (!is_clear) return impl_->of(worst);
  if (!impl_->passes(from, to)) return Hit{Hit::Kind::kImpassable};
  return std::nullopt;
}

}  // namespace cellcal::calib
