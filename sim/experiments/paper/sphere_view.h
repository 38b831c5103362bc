#pragma once
// Points around a sphere in orthographic projection.

#include <Eigen/Core>
#include <string>
#include <vector>

namespace cellcal::sim::paper {

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
