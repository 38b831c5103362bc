#include "tests/experiments/paper/figures.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace cellcal::sim::paper {

namespace {

using svg::Point;

constexpr const char* kBefore = "#2b6cb0";  // the paper's blue: without compensation
constexpr const char* kPaper = "#dd8a1f";
constexpr const char* kOurs = "#c53030";  // the paper's red: compensated
// A noise-free fit ends at the last bit of a double; smaller values are not meaningful.
constexpr double kFloorMm = 1e-12;

std::vector<Point> curve_mm(const std::vector<double>& mean_m) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < mean_m.size(); ++i)
    points.push_back({static_cast<double>(i), std::max(mean_m[i] * 1e3, kFloorMm)});
  return points;
}

Figure convergence(const Solved& simulation) {
  Chart chart;
  chart.title = "Figure 6: mean distance from the sphere, 50 touches without noise";
  chart.x_label = "iteration";
  chart.y_label = "mean |distance - R| / mm";
  chart.logarithmic_y = true;
  chart.series = {{"paper's estimator", kPaper, Mark::kLine, curve_mm(simulation.paper_mean_m)},
                  {"cellcal", kOurs, Mark::kLine, curve_mm(simulation.ours_mean_m)}};
  return {"figure-6.svg",
          "Convergence. The paper's estimator ends where its linearised model ends; the exact "
          "chain has no such floor. After its fourth iteration cellcal only adjusts what the "
          "touches do not determine.",
          draw(chart)};
}

std::vector<Eigen::Vector3d> around(const Task& task, const calib::ArmModel& model,
                                    const Eigen::VectorXd& x, const Eigen::Vector3d& centre) {
  std::vector<Eigen::Vector3d> points;
  for (const calib::Touch& touch : task.touches)
    if (touch.set == calib::TouchSet::kFit)
      points.push_back(model.position(model.prepare(touch.joint_rad), x.data()) - centre);
  return points;
}

Figure on_the_sphere(const Solved& simulation) {
  const Task& task = simulation.task;
  const calib::ArmModel model(task.cell.robot, task.cell.tool);
  const auto nominal = around(task, model, Eigen::VectorXd::Zero(model.size()), task.centre_m);
  const auto view = [&](const std::string& title, const calib::Calibration& result) {
    // Each result has its own sphere centre: the frame is not identifiable.
    return SphereView{
        title,
        task.radius_m,
        {{"nominal arm, true centre", kBefore, nominal},
         {"compensated, identified centre", kOurs,
          around(task, model, arm_errors(model, result), result.targets.at(0).centre_m)}}};
  };
  return {"figure-7.svg", "Tip positions of the fit touches around the sphere.",
          draw("Figure 7: tip positions before and after compensation",
               {view("paper's estimator", simulation.paper), view("cellcal", simulation.ours)})};
}

std::vector<Point> per_touch_mm(const calib::Calibration& result, const Task& task,
                                calib::TouchSet set, bool before) {
  std::vector<Point> points;
  double number = 0.0;
  for (const calib::TouchResidual& residual : result.residuals) {
    if (task.touches.at(residual.touch).set != set) continue;
    const double error = std::abs(before ? residual.before_m : residual.after_m) * 1e3;
    points.push_back({++number, std::max(error, kFloorMm)});
  }
  return points;
}

Figure per_touch(const Solved& solved, calib::TouchSet set, const std::string& number,
                 const std::string& what) {
  Chart chart;
  chart.title = "Figure " + number + ": distance from the sphere, " + what;
  chart.x_label = "touch";
  chart.y_label = "|distance - R| / mm";
  chart.logarithmic_y = true;
  chart.series = {
      {"before (best sphere)", kBefore, Mark::kDot,
       per_touch_mm(solved.paper, solved.task, set, true)},
      {"paper's estimator", kPaper, Mark::kDot,
       per_touch_mm(solved.paper, solved.task, set, false)},
      {"cellcal", kOurs, Mark::kDot, per_touch_mm(solved.ours, solved.task, set, false)}};
  return {"figure-" + number + ".svg", "Before and after compensation, " + what + ".", draw(chart)};
}

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace

std::vector<Figure> make_figures(const Solved& simulation, const Solved& experiment) {
  return {convergence(simulation), on_the_sphere(simulation),
          per_touch(simulation, calib::TouchSet::kFit, "8", "50 fit touches without noise"),
          per_touch(experiment, calib::TouchSet::kCheck, "11", "30 unseen touches, noise 0.03 mm")};
}

void write_figures(const std::vector<Figure>& figures, const std::string& table,
                   const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::string page =
      "<!doctype html><meta charset='utf-8'><title>The seed paper, rerun</title>\n"
      "<style>body{font-family:sans-serif;max-width:860px;margin:2em auto;color:#222}"
      "figure{margin:2em 0}figcaption{color:#555;font-size:14px}"
      "pre{background:#f6f7f8;padding:1em;overflow-x:auto;font-size:12px}</style>\n"
      "<h1>The seed paper, rerun</h1>\n";
  for (const Figure& figure : figures) {
    write(folder / figure.file, figure.svg);
    page += "<figure>" + figure.svg + "<figcaption>" + figure.caption + "</figcaption></figure>\n";
  }
  page += "<pre>" + svg::escape(table) + "</pre>\n";
  write(folder / "figures.html", page);
}

namespace {

using svg::Anchor, svg::Paint, svg::Point, svg::Svg;

constexpr double kWidth = 760.0, kHeight = 420.0;
constexpr double kLeft = 78.0, kRight = 20.0, kTop = 66.0, kBottom = 52.0;
constexpr Paint kGrid{.stroke = "#e4e4e4"}, kFrame{.stroke = "#888"};
constexpr Paint kTick{.fill = "#333", .font_size = 12.0}, kLabel{.fill = "#333", .font_size = 13.0};
constexpr Paint kTitle{.fill = "#111", .font_size = 15.0, .bold = true};
constexpr int kMostLabels = 9;

struct Axis {
  double low = 0.0, high = 1.0;
  std::vector<double> ticks;
};

/// 1, 2 or 5 times a power of ten, for about six ticks.
double nice_step(double span) {
  const double raw = span / 6.0;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (double factor : {1.0, 2.0, 5.0})
    if (raw <= factor * power) return factor * power;
  return 10.0 * power;
}

Axis linear_axis(double low, double high, bool from_zero) {
  if (from_zero) low = std::min(low, 0.0);
  if (!(high > low)) high = low + 1.0;
  const double step = nice_step(high - low);
  Axis axis{std::floor(low / step) * step, std::ceil(high / step) * step, {}};
  const int count = static_cast<int>(std::lround((axis.high - axis.low) / step));
  for (int i = 0; i <= count; ++i) axis.ticks.push_back(axis.low + i * step);
  return axis;
}

/// In decades: ticks are exponents.
Axis decade_axis(double low, double high) {
  Axis axis{std::floor(std::log10(low)), std::ceil(std::log10(high)), {}};
  if (axis.high <= axis.low) axis.high = axis.low + 1.0;
  const double step = std::ceil((axis.high - axis.low) / kMostLabels);
  for (double tick = axis.low; tick <= axis.high + 1e-9; tick += step) axis.ticks.push_back(tick);
  return axis;
}

struct Frame {
  Axis x, y;
  bool logarithmic;

  Point at(Point value) const {
    const double level = logarithmic ? std::log10(value.y) : value.y;
    return {kLeft + (value.x - x.low) / (x.high - x.low) * (kWidth - kLeft - kRight),
            kHeight - kBottom - (level - y.low) / (y.high - y.low) * (kHeight - kTop - kBottom)};
  }
};

Frame frame_of(const Chart& chart) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Point low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};
  for (const Series& series : chart.series) {
    for (const Point& point : series.points) {
      if (!std::isfinite(point.x) || !std::isfinite(point.y))
        throw std::invalid_argument(chart.title + ": a value of " + series.name + " is not finite");
      if (chart.logarithmic_y && !(point.y > 0.0))
        throw std::invalid_argument(chart.title + ": a value of " + series.name +
                                    " is not positive");
      low = {std::min(low.x, point.x), std::min(low.y, point.y)};
      high = {std::max(high.x, point.x), std::max(high.y, point.y)};
    }
  }
  if (!(low.x <= high.x)) throw std::invalid_argument(chart.title + ": nothing to draw");
  return {linear_axis(low.x, high.x, true),
          chart.logarithmic_y ? decade_axis(low.y, high.y) : linear_axis(low.y, high.y, true),
          chart.logarithmic_y};
}

std::string label(double value) {
  if (value != 0.0 && std::abs(value) < 1e-12) value = 0.0;
  return fmt::format("{:g}", std::round(value * 1e9) / 1e9);
}

void draw_frame(Svg& svg, const Chart& chart, const Frame& frame) {
  const double right = kWidth - kRight, bottom = kHeight - kBottom;
  for (double tick : frame.y.ticks) {
    const double y = frame.at({frame.x.low, frame.logarithmic ? std::pow(10.0, tick) : tick}).y;
    svg.line({kLeft, y}, {right, y}, kGrid);
    const std::string words = frame.logarithmic && (tick < -3.0 || tick > 3.0)
                                  ? fmt::format("1e{:g}", tick)
                                  : label(frame.logarithmic ? std::pow(10.0, tick) : tick);
    svg.text({kLeft - 8.0, y + 4.0}, Anchor::kEnd, kTick, words);
  }
  for (double tick : frame.x.ticks) {
    const double x = frame.at({tick, frame.logarithmic ? 1.0 : 0.0}).x;
    svg.line({x, bottom}, {x, bottom + 5.0}, kFrame);
    svg.text({x, bottom + 19.0}, Anchor::kMiddle, kTick, label(tick));
  }
  svg.line({kLeft, kTop}, {kLeft, bottom}, kFrame);
  svg.line({kLeft, bottom}, {right, bottom}, kFrame);
  svg.text({kLeft, 24.0}, Anchor::kStart, kTitle, chart.title);
  svg.text({(kLeft + right) / 2.0, kHeight - 12.0}, Anchor::kMiddle, kLabel, chart.x_label);
  svg.vertical_text({20.0, (kTop + bottom) / 2.0}, kLabel, chart.y_label);
}

void draw_legend(Svg& svg, const Chart& chart) {
  constexpr double kPerLetter = 6.6;  // 12 px sans-serif, upper estimate
  double x = kLeft;
  for (const Series& series : chart.series) {
    if (series.mark == Mark::kLine)
      svg.line({x, 46.0}, {x + 18.0, 46.0}, Paint{.stroke = series.colour, .stroke_width = 2.5});
    else
      svg.circle({x + 9.0, 46.0}, 4.0, Paint{.fill = series.colour});
    svg.text({x + 24.0, 50.0}, Anchor::kStart, kTick, series.name);
    x += 24.0 + kPerLetter * static_cast<double>(series.name.size()) + 18.0;
  }
}

}  // namespace

std::string draw(const Chart& chart) {
  const Frame frame = frame_of(chart);
  Svg svg(kWidth, kHeight);
  draw_frame(svg, chart, frame);
  draw_legend(svg, chart);
  for (const Series& series : chart.series) {
    std::vector<Point> pixels;
    for (const Point& point : series.points) pixels.push_back(frame.at(point));
    if (series.mark == Mark::kLine)
      svg.path(pixels, Paint{.stroke = series.colour, .stroke_width = 2.0});
    for (const Point& pixel : pixels)
      svg.circle(pixel, series.mark == Mark::kDot ? 3.6 : 2.2, Paint{.fill = series.colour});
  }
  return std::move(svg).finish();
}

namespace {

using Eigen::Vector3d;

constexpr double kPanel = 380.0, kViewTop = 62.0, kViewBottom = 8.0;
constexpr double kShare = 0.42;  // radius of the drawn sphere relative to the panel's width
constexpr int kArcPoints = 60;
constexpr double kAzimuth = 3.7, kElevation = 0.5;  // rad; the viewpoint, on the side of the arm
constexpr double kBehind = 0.3;                     // opacity of parts hidden by the sphere
constexpr Paint kBall{.fill = "#f3f4f6", .stroke = "#9aa0a6"}, kArc{.stroke = "#d5d8dc"};
constexpr Paint kHeading{.fill = "#111", .font_size = 15.0, .bold = true};
constexpr Paint kViewTitle{.fill = "#111", .font_size = 13.0, .bold = true};
constexpr Paint kCloudName{.fill = "#333", .font_size = 12.0};

/// Right and up on the page and towards the viewer, for a point in the base frame.
Vector3d seen(const Vector3d& p) {
  const double ca = std::cos(kAzimuth), sa = std::sin(kAzimuth);
  const double ce = std::cos(kElevation), se = std::sin(kElevation);
  const Vector3d right(-sa, ca, 0.0), eye(ca * ce, sa * ce, se);
  return {right.dot(p), eye.cross(right).dot(p), eye.dot(p)};
}

struct Panel {
  double x0, scale;
  Point at(const Vector3d& view) const {
    return {x0 + kPanel / 2.0 + scale * view.x(), kViewTop + kPanel / 2.0 - scale * view.y()};
  }
};

void draw_grid(Svg& svg, const Panel& panel, double radius) {
  svg.circle(panel.at(Vector3d::Zero()), panel.scale * radius, kBall);
  const auto arc = [&](auto point_of) {
    std::vector<Point> piece;
    for (int i = 0; i <= kArcPoints; ++i) {
      const Vector3d view = seen(radius * point_of(2.0 * std::numbers::pi * i / kArcPoints));
      if (view.z() >= 0.0) {
        piece.push_back(panel.at(view));
      } else if (!piece.empty()) {
        svg.path(piece, kArc);
        piece.clear();
      }
    }
    if (piece.size() > 1) svg.path(piece, kArc);
  };
  for (int i = 0; i < 6; ++i) {
    const double longitude = std::numbers::pi * i / 6.0;
    arc([&](double t) {
      return Vector3d(std::cos(t) * std::cos(longitude), std::cos(t) * std::sin(longitude),
                      std::sin(t));
    });
  }
  for (int i = -2; i <= 2; ++i) {
    const double latitude = std::numbers::pi * i / 6.0;
    arc([&](double t) {
      return Vector3d(std::cos(latitude) * std::cos(t), std::cos(latitude) * std::sin(t),
                      std::sin(latitude));
    });
  }
}

bool hidden(const Vector3d& view, double radius) {
  return view.z() < 0.0 && view.head<2>().norm() < radius;
}

void draw_panel(Svg& svg, const SphereView& view, const Panel& panel) {
  struct Dot {
    Vector3d view;
    std::string colour;
  };
  std::vector<Dot> dots;
  for (const Cloud& cloud : view.clouds)
    for (const Vector3d& point : cloud.points_m) dots.push_back({seen(point), cloud.colour});
  std::sort(dots.begin(), dots.end(),
            [](const Dot& a, const Dot& b) { return a.view.z() < b.view.z(); });
  draw_grid(svg, panel, view.radius_m);
  for (const Dot& dot : dots)
    svg.circle(panel.at(dot.view), 3.6,
               Paint{.fill = dot.colour,
                     .stroke = "white",
                     .opacity = hidden(dot.view, view.radius_m) ? kBehind : 1.0});
  svg.text({panel.x0 + kPanel / 2.0, 66.0}, Anchor::kMiddle, kViewTitle, view.title);
}

}  // namespace

std::string draw(const std::string& heading, const std::vector<SphereView>& views) {
  Svg svg(kPanel * static_cast<double>(views.size()), kViewTop + kPanel + kViewBottom);
  svg.text({16.0, 24.0}, Anchor::kStart, kHeading, heading);
  double x = 16.0;
  if (!views.empty()) {
    for (const Cloud& cloud : views.front().clouds) {
      svg.circle({x + 5.0, 42.0}, 4.0, Paint{.fill = cloud.colour});
      svg.text({x + 15.0, 46.0}, Anchor::kStart, kCloudName, cloud.name);
      x += 15.0 + 6.6 * static_cast<double>(cloud.name.size()) + 18.0;
    }
  }
  for (std::size_t i = 0; i < views.size(); ++i)
    draw_panel(svg, views[i],
               {kPanel * static_cast<double>(i), kShare * kPanel / views[i].radius_m});
  return std::move(svg).finish();
}

}  // namespace cellcal::sim::paper
