#include "sim/experiments/constraints/layouts.h"

namespace cellcal::sim::constraints {

namespace {

using calib::TargetKind;
using Eigen::Vector3d;

/// Places of four spheres or points: those of the demo.
const Vector3d kPlaces[] = {
    {1.08, -0.32, 0.33}, {1.06, 0.38, 0.33}, {0.64, -0.62, 0.64}, {0.76, 0.56, 0.78}};
constexpr double kDiameterM = 0.0614, kDiameterSigmaM = 2e-6;
constexpr double kCentreSigmaM = 0.010;
constexpr double kLengthSigmaM = 5e-6;

calib::Target target(const std::string& id, TargetKind kind, const Vector3d& at) {
  calib::Target t;
  t.id = id;
  t.kind = kind;
  if (kind == TargetKind::kTracker) return t;
  t.has_centre = true;
  t.centre_m = at;
  t.centre_sigma_m = kCentreSigmaM;
  if (kind == TargetKind::kSphere) {
    t.diameter_m = kDiameterM;
    t.diameter_sigma_m = kDiameterSigmaM;
  }
  return t;
}

calib::Cell with(const calib::Cell& base, TargetKind kind, std::size_t count, bool lengths) {
  calib::Cell cell = base;
  cell.targets.clear();
  cell.lengths.clear();
  for (std::size_t i = 0; i < count; ++i)
    cell.targets.push_back(target("T" + std::to_string(i + 1), kind, kPlaces[i]));
  for (std::size_t a = 0; lengths && a < count; ++a)
    for (std::size_t b = a + 1; b < count; ++b)
      cell.lengths.push_back({cell.targets[a].id, cell.targets[b].id, 1.0, kLengthSigmaM});
  return cell;
}

/// Three plates facing the arm from different sides.
calib::Cell planes(const calib::Cell& base) {
  calib::Cell cell = with(base, TargetKind::kPlane, 3, false);
  const Vector3d places[] = {{1.0, 0.0, 0.35}, {0.8, 0.5, 0.5}, {0.9, -0.5, 0.6}};
  const Vector3d normals[] = {{0, 0, 1}, {-1, -1, 1}, {-1, 1, 0.6}};
  for (std::size_t i = 0; i < 3; ++i) {
    cell.targets[i].centre_m = places[i];
    cell.targets[i].has_normal = true;
    cell.targets[i].normal = normals[i].normalized();
  }
  return cell;
}

}  // namespace

std::vector<Layout> layouts(const calib::Cell& base) {
  return {{"1 sphere", with(base, TargetKind::kSphere, 1, false), false},
          {"4 spheres", with(base, TargetKind::kSphere, 4, false), false},
          {"4 spheres, lengths", with(base, TargetKind::kSphere, 4, true), true},
          {"1 wire", with(base, TargetKind::kWire, 1, false), true},
          {"3 planes", planes(base), false},
          {"4 points", with(base, TargetKind::kPoint, 4, false), false},
          {"4 points, lengths", with(base, TargetKind::kPoint, 4, true), true},
          {"tracker", with(base, TargetKind::kTracker, 1, false), true}};
}

}  // namespace cellcal::sim::constraints
