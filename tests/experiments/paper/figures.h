#pragma once
// The paper's Figures 6, 7, 8 and 11, drawn from a run.

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "calib/export/svg.h"
#include "calib/result/calibration.h"
#include "tests/experiments/paper/task.h"

namespace cellcal::sim::paper {

/// One task and the results of both estimators.
struct Solved {
  Task task;
  calib::Calibration paper, ours;
  std::vector<double> paper_mean_m;  ///< mean of Eq. 39 over the fit touches, per iteration
  std::vector<double> ours_mean_m;
};

struct Figure {
  std::string file;  ///< "figure-6.svg"
  std::string caption;
  std::string svg;
};

std::vector<Figure> make_figures(const Solved& simulation, const Solved& experiment);

/// Writes each figure, and figures.html with all of them and the plain text `table`. Throws
/// std::runtime_error naming a file that cannot be written.
void write_figures(const std::vector<Figure>& figures, const std::string& table,
                   const std::filesystem::path& folder);

// A chart with one x and one y axis: curves over numbers, or markers.

enum class Mark { kLine, kDot };

struct Series {
  std::string name;
  std::string colour;
  Mark mark = Mark::kLine;
  std::vector<svg::Point> points;
};

struct Chart {
  std::string title, x_label, y_label;
  bool logarithmic_y = false;
  std::vector<Series> series;
};

/// Throws std::invalid_argument for a chart without points, and for values that are not positive
/// on a logarithmic axis.
std::string draw(const Chart& chart);

// Points around a sphere in orthographic projection.

struct Cloud {
  std::string name;
  std::string colour;
  std::vector<Eigen::Vector3d> points_m;  ///< relative to the sphere's centre
};

/// One view of the sphere; clouds are drawn from back to front, hidden points faintly.
struct SphereView {
  std::string title;
  double radius_m = 0.0;
  std::vector<Cloud> clouds;
};

/// Draws views next to each other under one heading.
std::string draw(const std::string& heading, const std::vector<SphereView>& views);

}  // namespace cellcal::sim::paper
