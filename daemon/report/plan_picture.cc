#include "daemon/report/plan_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "daemon/report/say.h"

namespace cellcal::daemon::report {

namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using svg::Anchor, svg::Point, svg::Svg;

constexpr double kWidth = 460.0, kHeight = 430.0;
constexpr double kLeft = 52.0, kTop = 24.0, kRight = 14.0, kBottom = 40.0;
constexpr double kPlanMarginMm = 120.0;
constexpr double kApproachMm = 75.0;  // invisible if drawn to scale
constexpr double kEndRadius = 1.7;    // px, at the start of an approach
constexpr std::size_t kPlanLabelLength = 18;

/// Polygon clipped to the frame (Sutherland and Hodgman).
std::vector<Point> clipped(std::vector<Point> polygon) {
  const std::array<std::array<double, 3>, 4> sides{{{1, 0, -kLeft},  // a x + b y + c >= 0
                                                    {-1, 0, kWidth - kRight},
                                                    {0, 1, -kTop},
                                                    {0, -1, kHeight - kBottom}}};
  for (const auto& [a, b, c] : sides) {
    const auto inside = [&, a = a, b = b, c = c](Point p) { return a * p.x + b * p.y + c; };
    std::vector<Point> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Point from = polygon[i], to = polygon[(i + 1) % polygon.size()];
      const double d0 = inside(from), d1 = inside(to);
      if (d0 >= 0.0) kept.push_back(from);
      if ((d0 < 0.0) != (d1 < 0.0)) {
        const double s = d0 / (d0 - d1);
        kept.push_back({from.x + s * (to.x - from.x), from.y + s * (to.y - from.y)});
      }
    }
    polygon = std::move(kept);
  }
  if (!polygon.empty()) polygon.push_back(polygon.front());  // closed
  return polygon;
}

/// Line clipped to the frame; false where it is outside (Liang and Barsky).
bool clip(Point& from, Point& to) {
  double begin = 0.0, end = 1.0;
  const double dx = to.x - from.x, dy = to.y - from.y;
  for (const auto& [p, q] :
       {std::pair(-dx, from.x - kLeft), std::pair(dx, kWidth - kRight - from.x),
        std::pair(-dy, from.y - kTop), std::pair(dy, kHeight - kBottom - from.y)}) {
    if (p == 0.0) {
      if (q < 0.0) return false;
    } else if (p < 0.0) {
      begin = std::max(begin, q / p);
    } else {
      end = std::min(end, q / p);
    }
  }
  if (!(begin < end)) return false;
  const Point old = from;
  from = {old.x + begin * dx, old.y + begin * dy};
  to = {old.x + end * dx, old.y + end * dy};
  return true;
}

/// Common bounds and scale of both views.
struct Frame {
  Vector3d least = Vector3d::Constant(-kPlanMarginMm), most = Vector3d::Constant(kPlanMarginMm);
  double px_per_mm = 1.0;

  /// Solids count only as far as they lie within the reach.
  Frame(const PlanScene& scene, const std::vector<Vector2d>& from_above,
        const std::vector<Vector2d>& from_side) {
    Vector3d low = Vector3d::Zero(), high = Vector3d::Zero();
    for (const Vector2d& p : from_above) {
      low.head<2>() = low.head<2>().cwiseMin(p);
      high.head<2>() = high.head<2>().cwiseMax(p);
    }
    for (const Vector2d& p : from_side) {
      low.z() = std::min(low.z(), p.y());
      high.z() = std::max(high.z(), p.y());
    }
    const auto hold = [this](const Vector3d& p, double around) {
      if (!p.allFinite() || !std::isfinite(around)) return;
      least = least.cwiseMin((p.array() - around).matrix());
      most = most.cwiseMax((p.array() + around).matrix());
    };
    for (const PlanScene::Rod& rod : scene.arm) {
      hold(rod.a, rod.radius);
      hold(rod.b, rod.radius);
    }
    for (const PlanScene::Ball& ball : scene.balls) hold(ball.centre, ball.radius + kPlanMarginMm);
    for (const PlanScene::Axle& axle : scene.axles) {
      hold(axle.a, 0.0);
      hold(axle.b, 0.0);
    }
    for (const PlanScene::Solid& solid : scene.solids)
      for (const Vector3d& corner : solid.corners) hold(corner.cwiseMax(low).cwiseMin(high), 0.0);
    if (scene.floor_z && std::isfinite(*scene.floor_z))
      least.z() = std::min(least.z(), *scene.floor_z - kPlanMarginMm / 2.0);
    const double width = kWidth - kLeft - kRight, height = kHeight - kTop - kBottom;
    const Vector3d size = most - least;
    px_per_mm = std::min({width / size.x(), height / size.y(), height / size.z()});
  }
};

class PlanPanel : public PicturePanel {
 public:
  PlanPanel(const PlanScene& scene, const Frame& frame, int upward,
            const std::vector<Vector2d>& reach, std::string_view heading)
      : PicturePanel(kHeight, "chart plan", 0, upward, heading), scene_(scene) {
    draw_grid(seen(0.5 * (frame.least + frame.most)), frame.px_per_mm);
    floor();
    for (std::size_t i = 0; i < reach.size(); ++i)
      shows_reach_ = line(at(reach[i]), at(reach[(i + 1) % reach.size()]), "reach") || shows_reach_;
    for (const PlanScene::Solid& solid : scene.solids) outline(solid);
    arm();
    axles();
    balls();
    labels();
    draw_heading();
  }

  /// True if part of the reach lies inside the frame.
  bool shows_reach() const { return shows_reach_; }

 private:
  bool line(Point from, Point to, const char* css_class) {
    if (!clip(from, to)) return false;
    svg_.line(from, to, css_class);
    return true;
  }

  void polygon(const std::vector<Vector2d>& corners, const char* css_class) {
    std::vector<Point> points;
    for (const Vector2d& corner : corners) points.push_back(at(corner));
    svg_.path(clipped(std::move(points)), css_class);
  }

  void floor() {
    if (!scene_.floor_z || upward_ != 2 || !y_.holds(*scene_.floor_z)) return;
    const double y = y_(*scene_.floor_z);
    svg_.rectangle({kLeft, y}, kWidth - kLeft - kRight, kHeight - kBottom - y, "solid");
    svg_.line({kLeft, y}, {kWidth - kRight, y}, "axis");
    svg_.text({kWidth - kRight - 4.0, y + 13.0}, Anchor::kEnd, "tick",
              say("say.report.view.floor"));
  }

  void outline(const PlanScene::Solid& solid) {
    std::vector<Vector2d> corners;
    for (const Vector3d& corner : solid.corners) corners.push_back(seen(corner));
    corners = outline_of(std::move(corners));
    polygon(corners, solid.id.empty() ? "stand" : "solid");
    if (solid.id.empty() || corners.empty()) return;
    // Labelled in the middle of its visible part.
    Vector2d low = corners.front(), high = corners.front();
    for (const Vector2d& corner : corners) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
    low = low.cwiseMax(Vector2d(x_.from, y_.from));
    high = high.cwiseMin(Vector2d(x_.to, y_.to));
    if ((low.array() < high.array()).all())
      names_.emplace_back(at(Vector2d(0.5 * (low + high))), shorten(solid.id, kPlanLabelLength));
  }

  void arm() {
    constexpr int kAround = 24;
    for (const PlanScene::Rod& rod : scene_.arm) {
      std::vector<Vector2d> points;
      for (int k = 0; k < kAround; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / kAround;
        const Vector2d off = rod.radius * Vector2d(std::cos(angle), std::sin(angle));
        points.push_back(seen(rod.a) + off);
        points.push_back(seen(rod.b) + off);
      }
      polygon(outline_of(std::move(points)), rod.tool ? "tool" : "link");
    }
    for (const PlanScene::Rod& rod : scene_.arm) {
      line(at(rod.a), at(rod.b), "bone");
      if (!rod.tool) svg_.circle(at(rod.a), 2.6, "joint");
    }
    const Point origin = at(Vector2d::Zero().eval());
    svg_.rectangle({origin.x - 5.0, origin.y - 5.0}, 10.0, 10.0, "base");
    keep_free(origin, 8.0);
    if (!scene_.arm.empty()) keep_free(at(scene_.arm.back().b), 4.0);
  }

  void axles() {
    for (const PlanScene::Axle& axle : scene_.axles) {
      line(at(axle.a), at(axle.b), "axis");
      names_.emplace_back(at(axle.b), shorten(axle.id, kPlanLabelLength));
    }
  }

  void balls() {
    for (const PlanScene::Ball& ball : scene_.balls)
      svg_.circle(at(ball.centre), radius(ball), "ball", words(ball));
    for (const PlanScene::Approach& a : scene_.approaches) {
      const Point surface = at(a.contact), begin = at((a.contact + kApproachMm * a.normal).eval());
      svg_.line(begin, surface, a.check ? "approach check" : "approach fit");
      svg_.circle(begin, kEndRadius, a.check ? "begin check" : "begin fit",
                  say({a.check ? "say.report.plan.touch.check" : "say.report.plan.touch",
                       {{"n", a.number}}}));
    }
  }

  static std::string words(const PlanScene::Ball& ball) {
    return ball.check > 0 ? fmt::format("{}: {} + {}", ball.id, ball.fit, ball.check)
                          : fmt::format("{}: {}", ball.id, ball.fit);
  }

  void labels() {
    const auto around = [this](const PlanScene::Ball& ball) {
      return radius(ball) + kApproachMm * px_per_mm_;
    };
    for (const PlanScene::Ball& ball : scene_.balls) keep_free(at(ball.centre), around(ball));
    for (const PlanScene::Ball& ball : scene_.balls)
      draw_label(ball, around(ball), words(ball), kPlanLabelLength);
    for (const auto& [place, name] : names_) svg_.text(place, Anchor::kMiddle, "label", name);
  }

  const PlanScene& scene_;
  bool shows_reach_ = false;
  std::vector<std::pair<Point, std::string>> names_;
};

}  // namespace

PicturePanel::PicturePanel(double height, const char* css_class, int across, int upward,
                           std::string_view heading)
    : across_(across),
      upward_(upward),
      height_(height),
      heading_(heading),
      svg_(kWidth, height, css_class, heading),
      labels_(kLeft, kTop, kWidth) {}

Eigen::Array2d PicturePanel::inner() const {
  return {kWidth - kLeft - kRight, height_ - kTop - kBottom};
}

void PicturePanel::draw_grid(const Vector2d& middle, double px_per_mm) {
  px_per_mm_ = px_per_mm;
  const Vector2d half = 0.5 * inner() / px_per_mm;
  x_ = {middle.x() - half.x(), middle.x() + half.x(), kLeft, kWidth - kRight};
  y_ = {middle.y() - half.y(), middle.y() + half.y(), height_ - kBottom, kTop};
  const std::vector<double> columns = round_ticks(x_.from, x_.to, 6),
                            rows = round_ticks(y_.from, y_.to, 6);
  const std::vector<std::string> column_labels = tick_labels(columns),
                                 row_labels = tick_labels(rows);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const double x = x_(columns[i]);
    svg_.line({x, y_.at_to}, {x, y_.at_from}, "grid");
    svg_.text({x, y_.at_from + 16.0}, Anchor::kMiddle, "tick", column_labels[i]);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double y = y_(rows[i]);
    svg_.line({x_.at_from, y}, {x_.at_to, y}, "grid");
    svg_.text({x_.at_from - 7.0, y + 4.0}, Anchor::kEnd, "tick", row_labels[i]);
  }
  svg_.text(
      {x_.at_to, y_.at_from + 33.0}, Anchor::kEnd, "tick",
      say({"say.report.view.axes",
           {{"across", std::string(1, "xyz"[across_])}, {"up", std::string(1, "xyz"[upward_])}}}));
}

void PicturePanel::draw_heading() {
  svg_.text({0.0, kTop - 10.0}, Anchor::kStart, "panel", heading_);
}

void PicturePanel::draw_label(const PlanScene::Ball& ball, double radius, std::string_view words,
                              std::size_t longest) {
  const std::string text = shorten(words, longest);
  svg_.text(labels_.beside(at(ball.centre), radius, std::min(text.size(), longest)), Anchor::kStart,
            "label strong", text);
}

double PicturePanel::radius(const PlanScene::Ball& ball) const {
  constexpr double kLeastRadius = 3.5;
  return std::max(ball.radius * px_per_mm_, kLeastRadius);
}

void PicturePanel::keep_free(Point centre, double around) {
  labels_.keep_free({centre.x - around, centre.y - around}, 2.0 * around, 2.0 * around);
}

std::string PlanScene::heading(int upward) const {
  if (upward == 1) return say(z_is_up ? "say.report.view.above" : "say.report.view.along_z");
  return say(z_is_up ? "say.report.view.side" : "say.report.view.along_y");
}

PlanViews plan_views(const calib::Cell& cell, const calib::Plan& plan) {
  const PlanScene scene = scene_of(cell, plan);
  PlanViews views;
  const auto from_above = reach_of(cell, 0, 1), from_side = reach_of(cell, 0, 2);
  const Frame frame(scene, from_above, from_side);
  PlanPanel one(scene, frame, 1, from_above, scene.heading(1));
  PlanPanel other(scene, frame, 2, from_side, scene.heading(2));
  const bool shows_reach = one.shows_reach() || other.shows_reach();
  views.above = std::move(one).finish();
  views.side = std::move(other).finish();
  views.legend =
      say({"say.report.plan.legend", {{"mm", kApproachMm}}}) +
      say(shows_reach ? "say.report.plan.legend.dashed" : "say.report.plan.legend.inside") +
      (scene.axles.empty() ? "" : say("say.report.plan.legend.axes"));
  return views;
}

}  // namespace cellcal::daemon::report
