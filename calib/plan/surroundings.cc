#include "calib/plan/surroundings.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>

#include "calib/model/error.h"

namespace cellcal::calib {

namespace {

using Eigen::Vector3d;

constexpr double kStandDiameterM = 0.03;
constexpr double kStandHeightM = 0.25;
constexpr double kPlateM = 0.01;  // thickness of the plate that represents a plane
/// Tolerance of GJK on cylinders: with FCL's default of 1e-6 distances are up to 1.4 mm too large,
/// with this 0.1 um.
constexpr double kGjkTolerance = 1e-10;

enum class Form { kSphere, kCylinder, kBox, kMesh, kFloor };

/// Frame at `middle` with z along `axis`.
Eigen::Isometry3d frame_along(const Vector3d& axis, const Vector3d& middle) {
  Eigen::Isometry3d frame;
  frame.linear().col(2) = axis;
  frame.linear().col(0) = axis.unitOrthogonal();
  frame.linear().col(1) = axis.cross(frame.linear().col(0));
  frame.translation() = middle;
  frame.makeAffine();
  return frame;
}

/// Trackers are outside, planes are faces of plates, and targets without a place are not obstacles.
bool has_place(const Target& target) { return has_a_centre(target.kind) && target.has_centre; }

using Hierarchy = std::shared_ptr<const fcl::CollisionGeometryd>;

Hierarchy build(const Mesh& mesh) {
  auto model = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  std::vector<fcl::Triangle> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles)
    triangles.emplace_back(static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]),
                           static_cast<std::size_t>(t[2]));
  model->beginModel(static_cast<int>(triangles.size()), static_cast<int>(mesh.vertices_m.size()));
  model->addSubModel(mesh.vertices_m, triangles);
  model->endModel();
  return model;
}

/// One hierarchy per mesh, shared while in use: obstacles of one file, and the surroundings that a
/// session rebuilds repeatedly.
Hierarchy hierarchy(const std::shared_ptr<const Mesh>& mesh) {
  static std::mutex mutex;
  static std::map<std::weak_ptr<const Mesh>, std::weak_ptr<const fcl::CollisionGeometryd>,
                  std::owner_less<>>
      known;
  const std::lock_guard lock(mutex);
  std::erase_if(known, [](const auto& entry) { return entry.second.expired(); });
  auto& entry = known[mesh];
  Hierarchy found = entry.lock();
  if (found == nullptr) entry = found = build(*mesh);
  return found;
}

}  // namespace

struct Surroundings::Thing {
  Form form = Form::kSphere;
  std::string words;
  int target = -1;
  double off_m = 0.0;
  Segment axis{Vector3d::Zero(), Vector3d::Zero()};  // spheres: both ends are the centre; cylinders
  double radius_m = 0.0;                             // spheres and cylinders
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d into = Eigen::Isometry3d::Identity();    // inverse of frame
  Vector3d low = Vector3d::Zero(), high = Vector3d::Zero();  // corners in its frame: box, mesh
  Vector3d up = Vector3d::UnitZ();                           // floor
  double height_m = 0.0;
  Hierarchy geometry;
  Vector3d middle = Vector3d::Zero();  // centre of the bounding ball; not for the floor
  double about_m = 0.0;                // radius of the bounding ball
  double bound_gap_m = 0.0;

  /// Requires the form.
  void set_ball() {
    // Allowance for rounding, so that bounds stay valid.
    constexpr double kRoundingM = 1e-9;
    // GJK on round bodies is approximate, see kGjkTolerance.
    constexpr double kGjkM = 1e-5;
    switch (form) {
      case Form::kSphere:
      case Form::kCylinder:  // a capsule's cap is no farther from the end that it covers
        middle = (axis.a + axis.b) / 2.0;
        about_m = (axis.b - axis.a).norm() / 2.0 + radius_m + kRoundingM;
        bound_gap_m = form == Form::kSphere ? 0.0 : radius_m + kGjkM;
        break;
      case Form::kBox:
      case Form::kMesh:
        middle = frame * Vector3d((low + high) / 2.0);
        about_m = (high - low).norm() / 2.0 + kRoundingM;
        bound_gap_m = std::numeric_limits<double>::max();
        break;
      case Form::kFloor: about_m = std::numeric_limits<double>::max(); break;
    }
  }

  void set_frame(const Eigen::Isometry3d& at) {
    frame = at;
    into = at.inverse();
  }
  void set_cylinder(const Eigen::Isometry3d& at, double diameter_m, double length_m) {
    form = Form::kCylinder;
    set_frame(at);
    radius_m = diameter_m / 2.0;
    axis = {at * Vector3d(0.0, 0.0, -length_m / 2.0), at * Vector3d(0.0, 0.0, length_m / 2.0)};
    geometry = std::make_shared<fcl::Cylinderd>(radius_m, length_m);
  }
  void set_obstacle(const Obstacle& obstacle) {
    words = "obstacle " + obstacle.id;
    switch (obstacle.shape) {
      case ObstacleShape::kCylinder:
        set_cylinder(obstacle.frame, obstacle.diameter_m, obstacle.height_m);
        break;
      case ObstacleShape::kBox:
        form = Form::kBox;
        set_frame(obstacle.frame);
        high = obstacle.size_m / 2.0;
        low = -high;
        geometry = std::make_shared<fcl::Boxd>(obstacle.size_m);
        break;
      case ObstacleShape::kMesh:
        if (obstacle.mesh == nullptr || obstacle.mesh->triangles.empty())
          throw PlanError(PlanError::Kind::kCell,
                          words + ": its mesh " + obstacle.mesh_file +
                              " was not read. Put the file into the cell file's folder");
        form = Form::kMesh;
        set_frame(obstacle.frame);
        low = high = obstacle.mesh->vertices_m.front();
        for (const Vector3d& vertex : obstacle.mesh->vertices_m) {
          low = low.cwiseMin(vertex);
          high = high.cwiseMax(vertex);
        }
        geometry = hierarchy(obstacle.mesh);
        break;
    }
  }
};

Surroundings::Surroundings(Surroundings&&) noexcept = default;
Surroundings::~Surroundings() = default;

std::vector<Post> posts_of(const Cell& cell) {
  std::vector<Post> posts;
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const Target& target = cell.targets[t];
    if (!has_place(target) || !target.has_stand) continue;
    const Vector3d up = stand_up(cell.robot, target);
    // From the centre down; at most as thick as the sphere, which would otherwise be untouchable.
    // It ends at the floor if that is known.
    const double radius = target.diameter_m / 2.0;
    double height = target.stand_height_m > 0.0 ? target.stand_height_m : kStandHeightM;
    const double over_floor = target.centre_m.dot(up) - radius - cell.floor_m.value_or(0.0);
    if (target.stand_height_m <= 0.0 && cell.floor_m && over_floor > 0.0) height = over_floor;
    double diameter = target.stand_diameter_m;
    if (diameter <= 0.0)
      diameter = radius > 0.0 ? std::min(kStandDiameterM, 2.0 * radius) : kStandDiameterM;
    const double length = height + radius;
    posts.push_back(
        {t, frame_along(up, target.centre_m - length / 2.0 * up), diameter / 2.0, length});
  }
  return posts;
}

Surroundings::Surroundings(const Cell& cell) {
  const Vector3d up = up_of(cell.robot);
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const Target& target = cell.targets[t];
    if (target.kind == TargetKind::kPlane && target.has_centre && target.has_normal &&
        target.extent_m > 0.0) {
      Thing plate;  // only the face is known: solid directly below it
      plate.words = "plane " + target.id;
      plate.target = static_cast<int>(t);
      plate.set_cylinder(
          frame_along(target.normal, target.centre_m - kPlateM / 2.0 * target.normal),
          target.extent_m, kPlateM);
      things_.push_back(std::move(plate));
    }
    if (!has_place(target)) continue;
    Thing ball;
    ball.words = (target.kind == TargetKind::kSphere ? "sphere " : "target ") + target.id;
    ball.target = static_cast<int>(t);
    ball.axis = {target.centre_m, target.centre_m};
    ball.radius_m = target.diameter_m / 2.0;
    ball.off_m = target.off_m;
    things_.push_back(ball);
  }
  for (const Post& post : posts_of(cell)) {
    Thing stand;
    stand.words = "the stand of " + cell.targets[post.target].id;
    stand.target = static_cast<int>(post.target);
    stand.off_m = cell.targets[post.target].off_m;
    stand.set_cylinder(post.frame, 2.0 * post.radius_m, post.length_m);
    things_.push_back(std::move(stand));
  }
  for (const Obstacle& obstacle : cell.obstacles) {
    Thing thing;
    thing.set_obstacle(obstacle);
    thing.off_m = obstacle.off_m;
    things_.push_back(std::move(thing));
  }
  if (cell.floor_m) {
    Thing floor;
    floor.form = Form::kFloor;
    floor.words = "the floor";
    floor.up = up;
    floor.height_m = *cell.floor_m;
    things_.push_back(std::move(floor));
  }
  for (Thing& thing : things_) thing.set_ball();
}

std::size_t Surroundings::size() const { return things_.size(); }
const std::string& Surroundings::words(std::size_t i) const { return things_[i].words; }
int Surroundings::target(std::size_t i) const { return things_[i].target; }

double Surroundings::off_m(std::size_t i) const { return things_[i].off_m; }

std::optional<Vector3d> Surroundings::middle_m(std::size_t i) const {
  const Thing& thing = things_[i];
  return thing.form == Form::kFloor ? std::nullopt : std::optional(thing.middle);
}

double Surroundings::coarse_bound_m(std::size_t i, const Vector3d& middle, double half_m) const {
  const Thing& thing = things_[i];
  return (middle - thing.middle).norm() - half_m - thing.about_m;
}

double Surroundings::bound_gap_m(std::size_t i) const { return things_[i].bound_gap_m; }

double Surroundings::bound_m(std::size_t i, const Segment& axis) const {
  const Thing& thing = things_[i];
  switch (thing.form) {
    case Form::kSphere:
    case Form::kCylinder:  // the enclosing capsule
      return std::max(0.0, calib::distance_m(axis, thing.axis) - thing.radius_m);
    case Form::kBox:
    case Form::kMesh: {  // between the bounding boxes
      const Vector3d a = thing.into * axis.a, b = thing.into * axis.b;
      return (a.cwiseMin(b) - thing.high).cwiseMax(thing.low - a.cwiseMax(b)).cwiseMax(0.0).norm();
    }
    case Form::kFloor: break;
  }
  return std::max(0.0, std::min(axis.a.dot(thing.up), axis.b.dot(thing.up)) - thing.height_m);
}

double Surroundings::distance_m(std::size_t i, const Segment& axis, double most_m) const {
  const Thing& thing = things_[i];
  const double bound = bound_m(i, axis);
  if (!thing.geometry || bound > most_m) return bound;  // spheres and floor: exact
  // An axis is a capsule without thickness: GJK terminates on it after a few steps, and only
  // approximates round bodies.
  constexpr double kPoint = 1e-9;
  const Vector3d along = axis.b - axis.a;
  const double length = along.norm();
  const fcl::Capsuled line(0.0, std::max(length, kPoint));
  const Eigen::Isometry3d at = frame_along(
      length > kPoint ? Vector3d(along / length) : Vector3d::UnitZ(), (axis.a + axis.b) / 2.0);
  const fcl::DistanceRequestd request(false, false, 0.0, 0.0, kGjkTolerance);
  fcl::DistanceResultd result(most_m + kPoint);  // farther parts of a mesh are skipped
  try {
    const double found =
        fcl::distance(thing.geometry.get(), thing.frame, &line, at, request, result);
    return std::max(bound, found);  // negative at intersection
  } catch (const std::exception&) {
    return bound;  // on failure of FCL the lower bound is used
  }
}

}  // namespace cellcal::calib
