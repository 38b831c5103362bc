#include "calib/plan/clearance.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <span>
#include <vector>

#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "calib/plan/bodies.h"
#include "calib/plan/surroundings.h"
#include "calib/plan/track.h"

namespace cellcal::calib {

namespace {

constexpr double kSearchMarginM = 0.005;  // of the tool from its target, at contact
/// Distances beyond margin plus this need not be exact: they only determine the look-ahead of a
/// move, for which lower bounds are nearly as good.
constexpr double kNearM = 0.05;
/// Pieces of a move with less motion of any point than this are not halved further, regardless of
/// the margin.
constexpr double kShortM = 0.0005;
/// Shares of the legs at which a corner is tried, in decreasing order, each with a limited number
/// of postures.
constexpr double kSmallerCorner = 0.6, kLeastCornerShare = 0.02;
constexpr int kMostCornerPostures = 256;
constexpr int kPostures = 64;  // samples that decide which links are neighbours
constexpr unsigned kSeed = 1;

constexpr double kFar = std::numeric_limits<double>::max();

struct Mode {
  int touched = -1;   ///< target that a search may touch
  bool past = false;  ///< contact with it: it is ignored
};

struct Pair {
  std::size_t inner, outer;  ///< bodies; the outer one is moved by more joints
  bool is_rooted = false;    ///< a tool that begins in the link's capsule, and may come back to it
};

/// The worst violation.
struct Encounter {
  double slack_m = kFar;  ///< distance minus margin
  double gap_m = 0.0;
  std::size_t body = 0;
  std::string other;
  bool low = false;  ///< below the lowest target
};

std::string near_words(const Hit& hit) {
  constexpr double kTouching = 1e-6, kRoundingMm = 1e-3;
  std::string text = hit.gap_m < kTouching
                         ? fmt::format("{} runs into {}", hit.body, hit.other)
                         : fmt::format("{} comes within {:.0f} mm of {}", hit.body,
                                       std::ceil(hit.gap_m * kMmPerM - kRoundingMm), hit.other);
  if (hit.assumed_radius_m > 0.0)
    text += fmt::format(" (its radius of {:.0f} mm is assumed: radius_mm of the robot file)",
                        hit.assumed_radius_m * kMmPerM);
  return text;
}

}  // namespace

struct Clearance::Impl {
  Impl(const Cell& cell, const ArmModel& arm)
      : bodies(arm),
        things(cell),
        unit(cell.robot),
        up(up_of(cell.robot)),
        hand(cell.robot.joints.size() - 1),
        passable(cell.passable) {
    if (!cell.floor_m)
      for (const Target& target : cell.targets)
        if (has_a_centre(target.kind) && target.has_centre)
          lowest_m = std::min(lowest_m, target.centre_m.dot(up) - kBelowTargetsM);
    find_pairs(cell.robot);
    for (std::size_t i = 0; i < things.size(); ++i) {
      places.push_back(place_of(i));
      is_off = is_off || unit.any() || things.off_m(i) > 0.0;
    }
  }

  /// Empty without a linear unit, and of the floor, on which it stands.
  std::optional<TrackOff::Place> place_of(std::size_t thing) const {
    const auto middle_m = things.middle_m(thing);
    return unit.any() && middle_m ? std::optional(unit.place(*middle_m)) : std::nullopt;
  }

  /// How far off arm and object may be from each other by the priors of linear unit and positioner;
  /// empty without.
  void set_off_m(std::span<const double> q, std::vector<double>& off_m) const {
    off_m.clear();
    for (std::size_t i = 0; is_off && i < places.size(); ++i)
      off_m.push_back(std::hypot(places[i] ? unit.off_m(*places[i], q[0]) : 0.0, things.off_m(i)));
  }

  /// Margin between body and object; empty if contact is allowed. Convex along a move, so that the
  /// mean of those at its ends bounds that at its middle, as (64) needs.
  std::optional<double> margin_m(const Body& body, std::size_t thing, const Mode& mode,
                                 const std::vector<double>& off_m) const {
    if (mode.touched < 0 || things.target(thing) != mode.touched) {
      const double usual_m = body.is_tip ? kTipMarginM : kBodyMarginM;
      return off_m.empty() ? usual_m : std::hypot(usual_m, off_m[thing]);  // (64a), (64b)
    }
    if (body.is_tip || mode.past) return std::nullopt;
    return kSearchMarginM;
  }

  /// Height of the hand above its lower limit; kFar for other bodies, and if a floor is stated.
  double height_m(std::size_t body, const Segment& axis) const {
    if (body != hand || lowest_m == kFar) return kFar;
    return std::min(axis.a.dot(up), axis.b.dot(up)) - lowest_m;
  }

  /// Smallest slack of the posture; kFar if nothing is hit.
  Encounter worst_of(const JointVector& q, const Mode& mode) const {
    thread_local std::vector<Segment> axes;
    thread_local std::vector<double> off_m;
    bodies.place(q, axes);
    set_off_m(q, off_m);
    const auto& list = bodies.list();
    Encounter worst;
    const auto note = [&](double value, double margin, std::size_t body, const std::string& other,
                          bool low) {
      if (value < 0.0 && value < worst.slack_m) worst = {value, value + margin, body, other, low};
    };
    static const std::string kNothing;
    for (std::size_t k = 0; k < list.size(); ++k) {
      if (!list[k].meets_cell) continue;
      note(height_m(k, axes[k]), 0.0, k, kNothing, true);
      for (std::size_t i = 0; i < things.size(); ++i) {
        const auto margin = margin_m(list[k], i, mode, off_m);
        if (!margin) continue;
        const double around = list[k].radius_m + *margin, near = around + kNearM;
        double distance = things.bound_m(i, axes[k]);
        if (distance < near) distance = things.distance_m(i, axes[k], near);
        note(distance - around, *margin, k, things.words(i), false);
      }
    }
    for (const Pair& pair : pairs)
      note(pair_slack_m(pair, axes), pair_margin_m(pair, axes), pair.outer, list[pair.inner].words,
           false);
    return worst;
  }

  /// Bounds of the slack of each body and pair in one posture, refined together when a decision depends
  /// on them. Beyond kNearM the lower bound is used.
  struct Around {
    std::vector<Segment> axes;
    std::vector<double> off_m, low, high;
  };

  /// False if something is hit.
  bool posture_is_clear(std::span<const double> q, const Mode& mode, Around& around) const {
    bodies.place(q, around.axes);
    set_off_m(q, around.off_m);
    const auto& list = bodies.list();
    around.low.assign(list.size() + pairs.size(), kFar);
    around.high.assign(list.size() + pairs.size(), kFar);
    for (std::size_t k = 0; k < list.size(); ++k) {
      if (!list[k].meets_cell) continue;
      bound(k, mode, around);
      if (around.low[k] < 0.0 && around.high[k] >= 0.0) settle(k, mode, around);
      if (around.low[k] < 0.0) return false;
    }
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      const double value = pair_slack_m(pairs[p], around.axes);
      if (value < 0.0) return false;
      around.low[list.size() + p] = around.high[list.size() + p] = value;
    }
    return true;
  }

  bool passes(const JointVector& from, const JointVector& to) const {
    return !passable || passable(from, to);
  }

  bool path_is_clear(const JointVector& from, const JointVector& to, const Mode& mode,
                     Encounter* worst) const {
    struct Piece {
      double begin, end;
      std::size_t first, last;  // postures
    };
    thread_local std::deque<Around> postures;  // reused by the next move, for its allocations
    thread_local std::vector<Piece> open;
    thread_local std::vector<double> path, margin;
    thread_local JointVector q;
    q.resize(from.size());
    std::size_t count = 0;
    const auto at = [&](double share) {
      for (std::size_t i = 0; i < q.size(); ++i) q[i] = from[i] + share * (to[i] - from[i]);
      if (postures.size() == count) postures.emplace_back();
      const bool is_clear = posture_is_clear(q, mode, postures[count++]);
      if (!is_clear && worst != nullptr) *worst = worst_of(q, mode);
      return is_clear;
    };
    if (!at(0.0) || !at(1.0)) return false;
    set_paths_m(from, to, path);
    set_margins_m(mode, margin);
    open.assign(1, {0.0, 1.0, 0, 1});
    // Midpoints of long pieces first: most blocked moves are detected there.
    for (std::size_t next = 0; next < open.size(); ++next) {
      const Piece piece = open[next];
      if (is_passed(path, piece.end - piece.begin, margin, mode, postures[piece.first],
                    postures[piece.last]))
        continue;
      const double middle = (piece.begin + piece.end) / 2.0;
      const std::size_t there = count;
      if (!at(middle)) return false;
      open.push_back({piece.begin, middle, piece.first, there});
      open.push_back({middle, piece.end, there, piece.last});
    }
    return true;
  }

  bool is_clear(const JointVector& from, const JointVector& to, const Mode& mode) const {
    return path_is_clear(from, to, mode, nullptr) && passes(from, to);
  }

  std::optional<Hit> hit(const JointVector& from, const JointVector& to, const Mode& mode) const {
    Encounter worst;
    if (!path_is_clear(from, to, mode, &worst)) return of(worst);
    if (!passes(from, to)) return Hit{Hit::Kind::kImpassable};
    return std::nullopt;
  }

  /// (64) for every body and pair between two postures that span this share of the move.
  bool is_passed(const std::vector<double>& path, double share, const std::vector<double>& margin,
                 const Mode& mode, Around& first, Around& last) const {
    const auto reaches = [&](std::size_t k, double slack) {
      return path[k] * share <= std::max(kShortM, slack + 2.0 * (1.0 - kMarginKept) * margin[k]);
    };
    bool open = false;
    for (std::size_t k = 0; k < path.size(); ++k) {
      if (reaches(k, first.low[k] + last.low[k])) continue;
      if (!reaches(k, first.high[k] + last.high[k])) return false;
      open = true;
    }
    for (std::size_t k = 0; open && k < path.size(); ++k) {
      if (reaches(k, first.low[k] + last.low[k])) continue;
      settle(k, mode, first);
      settle(k, mode, last);
      if (!reaches(k, first.low[k] + last.low[k])) return false;
    }
    return true;
  }

  Corner corner(const JointVector& from, const JointVector& at, const JointVector& to,
                const Mode& mode) const {
    if (passable) return {};
    for (double share = kMostCornerShare; share > kLeastCornerShare; share *= kSmallerCorner) {
      int postures_left = kMostCornerPostures;
      if (is_clear({at, interpolated(at, from, share), interpolated(at, to, share)}, mode,
                   postures_left))
        return {share, share};
    }
    return {};
  }

  /// All postures of a triangle: none is farther from its centre than the corners, since levers
  /// times turns are convex.
  bool is_clear(const std::array<JointVector, 3>& triangle, const Mode& mode,
                int& postures_left) const {
    if (--postures_left < 0) return false;
    JointVector middle(triangle[0]);
    for (std::size_t i = 0; i < middle.size(); ++i)
      middle[i] = (triangle[0][i] + triangle[1][i] + triangle[2][i]) / 3.0;
    thread_local Around around;
    if (!posture_is_clear(middle, mode, around)) return false;
    if (is_held(triangle, middle, mode, around)) return true;
    const auto between = [](const JointVector& a, const JointVector& b) {
      JointVector q(a);
      for (std::size_t i = 0; i < q.size(); ++i) q[i] = (a[i] + b[i]) / 2.0;
      return q;
    };
    const JointVector ab = between(triangle[0], triangle[1]),
                      bc = between(triangle[1], triangle[2]),
                      ca = between(triangle[2], triangle[0]);
    return is_clear({ab, bc, ca}, mode, postures_left) &&
           is_clear({triangle[0], ab, ca}, mode, postures_left) &&
           is_clear({ab, triangle[1], bc}, mode, postures_left) &&
           is_clear({ca, bc, triangle[2]}, mode, postures_left);
  }

  /// (72): no body moves farther from the centre to a corner than its slack there.
  bool is_held(const std::array<JointVector, 3>& triangle, const JointVector& middle,
               const Mode& mode, Around& around) const {
    thread_local std::vector<double> path, margin, farthest;
    set_margins_m(mode, margin);
    farthest.assign(margin.size(), 0.0);
    for (const JointVector& corner : triangle) {
      set_paths_m(middle, corner, path);
      const double wider_m = wider_by_m(corner, around.off_m);
      for (std::size_t k = 0; k < path.size(); ++k)
        farthest[k] = std::max(farthest[k], path[k] + wider_m);
    }
    const auto reaches = [&](std::size_t k, double slack) {
      return farthest[k] <= std::max(kShortM / 2.0, slack + (1.0 - kMarginKept) * margin[k]);
    };
    for (std::size_t k = 0; k < margin.size(); ++k)
      if (!reaches(k, around.high[k])) return false;
    for (std::size_t k = 0; k < margin.size(); ++k) {
      if (reaches(k, around.low[k])) continue;
      settle(k, mode, around);
      if (!reaches(k, around.low[k])) return false;
    }
    return true;
  }

  /// Most that a margin is wider there than with these.
  double wider_by_m(const JointVector& q, const std::vector<double>& than_m) const {
    thread_local std::vector<double> off_m;
    set_off_m(q, off_m);
    double most = 0.0;
    for (std::size_t i = 0; i < off_m.size(); ++i) most = std::max(most, off_m[i] - than_m[i]);
    return most;
  }

  Hit of(const Encounter& worst) const {
    const Body& body = bodies.list()[worst.body];
    return {worst.low ? Hit::Kind::kBelowTargets : Hit::Kind::kTooNear, body.words, worst.other,
            worst.gap_m, body.assumed ? body.radius_m : 0.0};
  }

  Bodies bodies;
  Surroundings things;
  TrackOff unit;
  std::vector<std::optional<TrackOff::Place>> places;  ///< of the objects
  bool is_off = false;                                 ///< any of set_off_m()
  Eigen::Vector3d up;
  std::size_t hand;  ///< the body of the last link
  Passable passable;
  double lowest_m = kFar;
  std::vector<Pair> pairs;

 private:
  /// Bounds of a body's slack over all objects.
  void bound(std::size_t k, const Mode& mode, Around& around) const {
    const Body& body = bodies.list()[k];
    const Segment& axis = around.axes[k];
    const Eigen::Vector3d middle = (axis.a + axis.b) / 2.0;
    const double half = (axis.b - axis.a).norm() / 2.0;
    double &low = around.low[k], &high = around.high[k];
    low = high = height_m(k, axis);
    for (std::size_t i = 0; i < things.size(); ++i) {
      const auto margin = margin_m(body, i, mode, around.off_m);
      if (!margin) continue;
      const double keeps = body.radius_m + *margin;
      // The object determines neither bound.
      if (const double far_off = things.coarse_bound_m(i, middle, half) - keeps;
          far_off >= low && far_off >= high)
        continue;
      const double distance = things.bound_m(i, axis);
      low = std::min(low, distance - keeps);
      high = std::min(high, distance < keeps + kNearM ? distance - keeps + things.bound_gap_m(i)
                                                      : distance - keeps);
    }
  }

  /// Sets both bounds to the body's exact slack.
  void settle(std::size_t k, const Mode& mode, Around& around) const {
    if (around.low[k] == around.high[k]) return;
    const Body& body = bodies.list()[k];
    const Segment& axis = around.axes[k];
    double least = height_m(k, axis);
    const auto each = [&](bool in_doubt) {
      for (std::size_t i = 0; i < things.size(); ++i) {
        const auto margin = margin_m(body, i, mode, around.off_m);
        if (!margin) continue;
        const double keeps = body.radius_m + *margin;
        double distance = things.bound_m(i, axis);
        const bool doubtful = things.bound_gap_m(i) > 0.0 && distance < keeps + kNearM;
        if (doubtful != in_doubt || distance - keeps >= least) continue;
        if (in_doubt) distance = things.distance_m(i, axis, keeps + kNearM);
        least = std::min(least, distance - keeps);
      }
    };
    each(false);  // other objects can be skipped if they are farther
    each(true);
    around.low[k] = around.high[k] = least;
  }

  double pair_slack_m(const Pair& pair, const std::vector<Segment>& axes) const {
    return distance_m(axes[pair.inner], axes[pair.outer]) - radii_m(pair) -
           pair_margin_m(pair, axes);
  }

  double radii_m(const Pair& pair) const {
    return bodies.list()[pair.inner].radius_m + bodies.list()[pair.outer].radius_m;
  }

  /// A rooted tool comes no nearer to the link than its root does, less the margin: the place of its axis nearest to
  /// the end that it turns about.
  double pair_margin_m(const Pair& pair, const std::vector<Segment>& axes) const {
    if (!pair.is_rooted) return kBodyMarginM;
    const Segment &link = axes[pair.inner], &tool = axes[pair.outer];
    const Eigen::Vector3d along = tool.b - tool.a;
    const double share = (link.b - tool.a).dot(along) / along.squaredNorm();
    const Eigen::Vector3d root = tool.a + std::clamp(share, 0.0, 1.0) * along;
    return std::min(kBodyMarginM, distance_m(link, {root, root}) - radii_m(pair) - kBodyMarginM);
  }

  /// Upper bounds of the motion of the body's axis; for pairs relative to the inner body.
  void set_paths_m(const JointVector& from, const JointVector& to,
                   std::vector<double>& result) const {
    const auto& list = bodies.list();
    const auto path = [&](const Body& body, int first) {
      double sum = 0.0;
      for (std::size_t j = static_cast<std::size_t>(first); j < from.size(); ++j)
        sum += std::abs(to[j] - from[j]) * body.lever[j];
      return sum;
    };
    result.clear();
    for (const Body& body : list) result.push_back(body.meets_cell ? path(body, 0) : 0.0);
    for (const Pair& pair : pairs)  // of a rooted one both distances change
      result.push_back((pair.is_rooted ? 2.0 : 1.0) *
                       path(list[pair.outer], list[pair.inner].joint + 1));
  }

  void set_margins_m(const Mode& mode, std::vector<double>& result) const {
    result.clear();
    for (const Body& body : bodies.list())
      result.push_back(body.is_tip ? kTipMarginM
                                   : (mode.touched >= 0 ? kSearchMarginM : kBodyMarginM));
    result.resize(result.size() + pairs.size(), kBodyMarginM);
  }

  void find_pairs(const Robot& robot) {
    const auto& list = bodies.list();
    std::vector<Pair> all;
    for (std::size_t inner = 0; inner < list.size(); ++inner)
      for (std::size_t outer = inner + 1; outer < list.size(); ++outer)
        if (list[outer].joint > list[inner].joint) all.push_back({inner, outer});
    std::vector<int> close(all.size(), 0);
    std::vector<bool> returns(all.size(), false);
    Random random(kSeed);
    std::vector<Segment> axes;
    for (int k = 0; k < kPostures; ++k) {
      JointVector q;
      for (const Joint& joint : robot.joints)
        q.push_back(random.uniform(joint.min_rad, joint.max_rad));
      bodies.place(q, axes);
      for (std::size_t p = 0; p < all.size(); ++p) close[p] += pair_slack_m(all[p], axes) < 0.0;
      bend_wrist(robot, k % 2 == 0, q);
      bodies.place(q, axes);
      for (std::size_t p = 0; p < all.size(); ++p)
        returns[p] = returns[p] || comes_back(all[p], axes);
    }
    for (std::size_t p = 0; p < all.size(); ++p) {
      all[p].is_rooted = 2 * close[p] > kPostures;
      if (!all[p].is_rooted || returns[p]) pairs.push_back(all[p]);
    }
  }

  /// To its limit, where a tool comes nearest to the links before it.
  void bend_wrist(const Robot& robot, bool up, JointVector& q) const {
    if (hand == 0) return;
    const Joint& joint = robot.joints[hand - 1];
    q[hand - 1] = up ? joint.max_rad : joint.min_rad;
  }

  bool comes_back(Pair pair, const std::vector<Segment>& axes) const {
    pair.is_rooted =
        pair.outer > hand && (axes[pair.outer].b - axes[pair.outer].a).norm() > kShortM;
    return pair.is_rooted && pair_slack_m(pair, axes) < 0.0;
  }
};

Clearance::Clearance(Hidden<Impl> impl) : impl_(std::move(impl)) {}
Clearance::Clearance(const Cell& cell, const ArmModel& arm) : impl_(make_hidden<Impl>(cell, arm)) {}
Clearance Clearance::blind() { return Clearance(Hidden<Impl>(nullptr, nullptr)); }

bool Clearance::clear(const JointVector& q) const {
  thread_local Impl::Around around;
  return impl_ == nullptr || (impl_->posture_is_clear(q, {}, around) && impl_->passes(q, q));
}

bool Clearance::clear(const JointVector& from, const JointVector& to) const {
  return impl_ == nullptr || impl_->is_clear(from, to, {});
}

bool Clearance::clear_search(const JointVector& from, const JointVector& to,
                             std::size_t target) const {
  return impl_ == nullptr || impl_->is_clear(from, to, {static_cast<int>(target)});
}

bool Clearance::clear_past(const JointVector& from, const JointVector& to,
                           std::size_t target) const {
  return impl_ == nullptr || impl_->is_clear(from, to, {static_cast<int>(target), true});
}

Corner Clearance::corner(const JointVector& from, const JointVector& at,
                         const JointVector& to) const {
  if (impl_ == nullptr) return {kMostCornerShare, kMostCornerShare};
  return impl_->corner(from, at, to, {});
}

std::optional<Hit> Clearance::hit(const JointVector& q) const {
  if (impl_ == nullptr) return std::nullopt;
  if (const Encounter worst = impl_->worst_of(q, {}); worst.slack_m < kFar) return impl_->of(worst);
  if (!impl_->passes(q, q)) return Hit{Hit::Kind::kImpassable};
  return std::nullopt;
}

std::optional<Hit> Clearance::hit(const JointVector& from, const JointVector& to) const {
  return impl_ == nullptr ? std::nullopt : impl_->hit(from, to, {});
}

std::optional<Hit> Clearance::hit_search(const JointVector& from, const JointVector& to,
                                         std::size_t target) const {
  return impl_ == nullptr ? std::nullopt : impl_->hit(from, to, {static_cast<int>(target)});
}

std::string words(const Hit& hit) {
  switch (hit.kind) {
    case Hit::Kind::kTooNear: return near_words(hit);
    case Hit::Kind::kBelowTargets:
      return fmt::format(
          "{} comes more than {:.0f} mm below the lowest target (no floor_mm in the cell file)",
          hit.body, kBelowTargetsM * kMmPerM);
    case Hit::Kind::kImpassable:
      return "the way leads near a singularity, or an axis beyond its correction limit";
  }
  return {};
}

std::string words_or(const std::optional<Hit>& hit, const char* otherwise) {
  return hit ? words(*hit) : otherwise;
}

}  // namespace cellcal::calib
