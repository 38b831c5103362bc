#include "sim/experiments/paper/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "calib/svg/svg.h"
#include "sim/experiments/paper/accuracy.h"
#include "sim/experiments/paper/chart.h"
#include "sim/experiments/paper/sphere_view.h"

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

}  // namespace cellcal::sim::paper
