// The cell to scale, in top and side view: base and targets, certified lengths dashed.

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "calib/model/units.h"
#include "calib/svg/svg.h"
#include "daemon/report/plan_picture.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {
namespace {

using svg::Anchor, svg::Point, svg::Svg;

constexpr double kPanelWidth = 460.0;
constexpr double kPanelHeight = 360.0;
constexpr double kPictureLeft = 52.0;
constexpr double kPictureTop = 24.0;
constexpr double kPictureRight = 14.0;
constexpr double kPictureBottom = 40.0;
constexpr double kMarginMm = 150.0;
constexpr double kLeastRadius = 3.5;  // px, so that a small sphere stays visible
constexpr std::size_t kPictureLabelLength = 14;

struct Ball {
  std::string id;
  Eigen::Vector3d centre_mm;
  double radius_mm = 0.0;
};

// A tracker is outside the cell.
bool is_tracker(const View& view, const calib::TargetResult& target) {
  const calib::Target* in_cell = view.cell_target(target.id);
  return in_cell && in_cell->kind == calib::TargetKind::kTracker;
}

std::vector<Ball> balls_of(const View& view) {
  std::vector<Ball> balls;
  for (const calib::TargetResult& target : view.result.targets) {
    if (is_tracker(view, target)) continue;
    const Eigen::Vector3d centre = target.centre_m * calib::kMmPerM;
    const double radius = target.effective_radius_m * calib::kMmPerM;
    if (!is_usable_mm(centre.x()) || !is_usable_mm(centre.y()) || !is_usable_mm(centre.z())) {
      continue;
    }
    balls.push_back({target.id, centre, is_usable_mm(radius) ? std::max(radius, 0.0) : 0.0});
  }
  return balls;
}

struct Axis {
  int index;
  char name;
};

// One view; `across` and `upward` select two of x, y, z.
class PanelDrawing {
 public:
  PanelDrawing(const std::vector<Ball>& balls, Axis across, Axis upward, std::string_view heading)
      : balls_(balls),
        across_(across),
        upward_(upward),
        svg_(kPanelWidth, kPanelHeight, "chart cell", heading) {
    fit_scales();
    draw_grid();
    svg_.text({0.0, kPictureTop - 10.0}, Anchor::kStart, "panel", heading);
  }

  void draw_lengths(const std::vector<calib::CertifiedLength>& lengths) {
    for (const calib::CertifiedLength& length : lengths) {
      const Ball* from = find(length.from);
      const Ball* to = find(length.to);
      if (from && to) svg_.line(at(from->centre_mm), at(to->centre_mm), "certified");
    }
  }

  std::string finish() && {
    draw_base();
    for (const Ball& ball : balls_) {
      const double radius = std::max(ball.radius_mm * px_per_mm_, kLeastRadius);
      const Point centre = at(ball.centre_mm);
      svg_.circle(centre, radius, "ball", ball.id);
      labels_.keep_free({centre.x - radius, centre.y - radius}, 2.0 * radius, 2.0 * radius);
    }
    for (const Ball& ball : balls_) draw_label(ball);
    return std::move(svg_).finish();
  }

 private:
  void fit_scales() {
    Eigen::Vector2d least(-kMarginMm, -kMarginMm);
    Eigen::Vector2d most(kMarginMm, kMarginMm);
    for (const Ball& ball : balls_) {
      const Eigen::Vector2d centre(ball.centre_mm[across_.index], ball.centre_mm[upward_.index]);
      const double reach = ball.radius_mm + kMarginMm;
      least = least.cwiseMin((centre.array() - reach).matrix());
      most = most.cwiseMax((centre.array() + reach).matrix());
    }
    const double width = kPanelWidth - kPictureLeft - kPictureRight;
    const double height = kPanelHeight - kPictureTop - kPictureBottom;
    px_per_mm_ = std::min(width / (most.x() - least.x()), height / (most.y() - least.y()));
    const Eigen::Vector2d middle = 0.5 * (least + most);
    const double half_width = 0.5 * width / px_per_mm_;
    const double half_height = 0.5 * height / px_per_mm_;
    x_ = {middle.x() - half_width, middle.x() + half_width, kPictureLeft,
          kPanelWidth - kPictureRight};
    y_ = {middle.y() - half_height, middle.y() + half_height, kPanelHeight - kPictureBottom,
          kPictureTop};
  }

  void draw_grid() {
    const std::vector<double> columns = round_ticks(x_.from, x_.to, 6);
    const std::vector<std::string> column_labels = tick_labels(columns);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const double x = x_(columns[i]);
      svg_.line({x, kPictureTop}, {x, kPanelHeight - kPictureBottom}, "grid");
      svg_.text({x, kPanelHeight - kPictureBottom + 16.0}, Anchor::kMiddle, "tick",
                column_labels[i]);
    }
    const std::vector<double> rows = round_ticks(y_.from, y_.to, 6);
    const std::vector<std::string> row_labels = tick_labels(rows);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double y = y_(rows[i]);
      svg_.line({kPictureLeft, y}, {kPanelWidth - kPictureRight, y}, "grid");
      svg_.text({kPictureLeft - 7.0, y + 4.0}, Anchor::kEnd, "tick", row_labels[i]);
    }
    svg_.text({kPanelWidth - kPictureRight, kPanelHeight - kPictureBottom + 33.0}, Anchor::kEnd,
              "tick", fmt::format("{} across, {} up, mm", across_.name, upward_.name));
  }

  void draw_base() {
    const Point origin{x_(0.0), y_(0.0)};
    constexpr double kArrow = 30.0;
    svg_.line(origin, {origin.x + kArrow, origin.y}, "axis");
    svg_.line(origin, {origin.x, origin.y - kArrow}, "axis");
    svg_.rectangle({origin.x - 5.0, origin.y - 5.0}, 10.0, 10.0, "base");
    svg_.text({origin.x + kArrow + 4.0, origin.y + 4.0}, Anchor::kStart, "label",
              std::string(1, across_.name));
    svg_.text({origin.x, origin.y - kArrow - 4.0}, Anchor::kMiddle, "label",
              std::string(1, upward_.name));
    svg_.text({origin.x, origin.y + 20.0}, Anchor::kMiddle, "label", "base");
    labels_.keep_free({origin.x - 18.0, origin.y - kArrow - 14.0}, kArrow + 32.0, kArrow + 36.0);
  }

  void draw_label(const Ball& ball) {
    const std::string words = shorten(ball.id, kPictureLabelLength);
    const double radius = std::max(ball.radius_mm * px_per_mm_, kLeastRadius);
    svg_.text(
        labels_.beside(at(ball.centre_mm), radius, std::min(words.size(), kPictureLabelLength)),
        Anchor::kStart, "label strong", words);
  }

  Point at(const Eigen::Vector3d& mm_in_base) const {
    return {x_(mm_in_base[across_.index]), y_(mm_in_base[upward_.index])};
  }

  const Ball* find(const std::string& id) const {
    const auto found = std::find_if(balls_.begin(), balls_.end(),
                                    [&id](const Ball& ball) { return ball.id == id; });
    return found == balls_.end() ? nullptr : &*found;
  }

  const std::vector<Ball>& balls_;
  Axis across_, upward_;
  Svg svg_;
  Scale x_, y_;
  double px_per_mm_ = 1.0;
  Labels labels_{kPictureLeft, kPictureTop, kPanelWidth};
};

}  // namespace

std::string cell_picture(const View& view) {
  const std::vector<Ball> balls = balls_of(view);
  if (balls.empty()) return {};
  constexpr Axis kX{0, 'x'};
  constexpr Axis kY{1, 'y'};
  constexpr Axis kZ{2, 'z'};
  PanelDrawing above(balls, kX, kY, "From above");
  PanelDrawing side(balls, kX, kZ, "From the side, looking along +y");
  above.draw_lengths(view.result.cell.lengths);
  side.draw_lengths(view.result.cell.lengths);
  std::string body = fmt::format("<div class=\"pair\">{}{}</div>\n", std::move(above).finish(),
                                 std::move(side).finish());
  body += fmt::format(
      "<p class=\"note\">Targets to scale in the robot&rsquo;s base frame, where the touches found "
      "them.{}</p>\n",
      view.result.cell.lengths.empty() ? "" : " Dashed: certified lengths.");
  const auto trackers = static_cast<std::size_t>(
      std::count_if(view.result.targets.begin(), view.result.targets.end(),
                    [&](const calib::TargetResult& target) { return is_tracker(view, target); }));
  const std::size_t left_out = view.result.targets.size() - trackers - balls.size();
  if (left_out > 0) {
    body += fmt::format("<p class=\"warn\">{} no usable centre and cannot be drawn.</p>\n",
                        counted(left_out, "target has", "targets have"));
  }
  return section("cell", "The cell", body);
}

}  // namespace cellcal::daemon::report
