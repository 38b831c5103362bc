#include "calib/files/obstacle_file.h"

#include <fmt/format.h>

#include <map>
#include <set>

#include "calib/files/documents.h"
#include "calib/files/files.h"
#include "calib/files/stl.h"
#include "calib/model/units.h"
#include "calib/syntax/shown.h"
#include "calib/syntax/toml_json.h"

namespace cellcal::calib {

namespace {

constexpr std::size_t kMaxObstacles = 1000;
constexpr Range kPlaceMm{-1e5, 1e5};
constexpr Range kSizeMm{1e-2, 1e5};
constexpr std::size_t kLongestId = 80;

Obstacle read_obstacle(const TomlTable& t) {
  Obstacle obstacle;
  obstacle.id = t.string("id");
  if (obstacle.id.empty() || shown(obstacle.id, kLongestId) != obstacle.id)
    t.fail("id", "must be a name of 1 to 80 bytes without control characters: messages name it");
  const std::string shape = t.word("shape", {"box", "cylinder", "mesh"});
  if (shape == "box") {
    const auto size = t.numbers("size_mm", 3, kSizeMm);
    obstacle.size_m = Eigen::Vector3d(size[0], size[1], size[2]) / kMmPerM;
  } else if (shape == "cylinder") {
    obstacle.shape = ObstacleShape::kCylinder;
    obstacle.diameter_m = t.number("diameter_mm", kSizeMm) / kMmPerM;
    obstacle.height_m = t.number("height_mm", kSizeMm) / kMmPerM;
  } else {
    obstacle.shape = ObstacleShape::kMesh;
    obstacle.mesh_file = t.string("file");
    if (obstacle.mesh_file.empty()) t.fail("file", "must name an STL file");
  }
  FrameMmDeg frame;
  const auto xyz = t.numbers("xyz_mm", 3, kPlaceMm);
  const auto abc = t.numbers_or("abc_deg", {0, 0, 0}, {-3600.0, 3600.0});
  std::copy(xyz.begin(), xyz.end(), frame.xyz_mm.begin());
  std::copy(abc.begin(), abc.end(), frame.abc_deg.begin());
  obstacle.frame = to_isometry(frame);
  t.refuse_unknown();
  return obstacle;
}

std::string mm(double m) { return toml_number(m * kMmPerM); }

}  // namespace

std::vector<Obstacle> read_obstacles(const TomlTable& document) {
  std::vector<Obstacle> obstacles;
  std::set<std::string> ids;
  for (const TomlTable& table : document.tables("obstacle")) {
    if (obstacles.size() == kMaxObstacles) table.fail("id", "a cell holds at most 1000 obstacles");
    obstacles.push_back(read_obstacle(table));
    if (!ids.insert(obstacles.back().id).second)
      table.fail("id", "\"" + shown(obstacles.back().id) + "\" stands twice");
  }
  return obstacles;
}

std::string obstacles_to_toml(const std::vector<Obstacle>& obstacles) {
  std::string out;
  for (const Obstacle& o : obstacles) {
    out += fmt::format("\n[[obstacle]]\nid = {}\n", toml_string(o.id));
    switch (o.shape) {
      case ObstacleShape::kBox:
        out += fmt::format("shape = \"box\"\nsize_mm = [{}, {}, {}]\n", mm(o.size_m.x()),
                           mm(o.size_m.y()), mm(o.size_m.z()));
        break;
      case ObstacleShape::kCylinder:
        out += fmt::format("shape = \"cylinder\"\ndiameter_mm = {}\nheight_mm = {}\n",
                           mm(o.diameter_m), mm(o.height_m));
        break;
      case ObstacleShape::kMesh:
        out += fmt::format("shape = \"mesh\"\nfile = {}\n", toml_string(o.mesh_file));
        break;
    }
    const FrameMmDeg f = to_frame(o.frame);
    out +=
        fmt::format("xyz_mm = [{}, {}, {}]\nabc_deg = [{}, {}, {}]\n", toml_number(f.xyz_mm[0]),
                    toml_number(f.xyz_mm[1]), toml_number(f.xyz_mm[2]), toml_number(f.abc_deg[0]),
                    toml_number(f.abc_deg[1]), toml_number(f.abc_deg[2]));
  }
  return out;
}

void read_stand(const TomlTable& t, Target& target) {
  constexpr Range kStandMm{0.1, 1e4};
  target.has_stand = !t.has("stand") || t.word("stand", {"post", "none"}) == "post";
  for (const char* key : {"stand_diameter_mm", "stand_height_mm"})
    if (!target.has_stand && t.has(key)) t.fail(key, "there is no stand; leave it out");
  if (t.has("stand_diameter_mm"))
    target.stand_diameter_m = t.number("stand_diameter_mm", kStandMm) / kMmPerM;
  if (t.has("stand_height_mm"))
    target.stand_height_m = t.number("stand_height_mm", kStandMm) / kMmPerM;
}

std::string stand_to_toml(const Target& target) {
  if (!target.has_stand) return "stand = \"none\"\n";
  std::string out;
  if (target.stand_diameter_m > 0.0)
    out += fmt::format("stand_diameter_mm = {}\n", mm(target.stand_diameter_m));
  if (target.stand_height_m > 0.0)
    out += fmt::format("stand_height_mm = {}\n", mm(target.stand_height_m));
  return out;
}

void load_meshes(Cell& cell, const std::filesystem::path& folder, std::size_t most_triangles) {
  std::map<std::string, std::shared_ptr<const Mesh>> read;
  std::size_t triangles = 0;
  for (Obstacle& obstacle : cell.obstacles) {
    if (obstacle.shape != ObstacleShape::kMesh) continue;
    std::shared_ptr<const Mesh>& mesh = read[obstacle.mesh_file];
    if (mesh == nullptr) {
      try {
        mesh = std::make_shared<const Mesh>(load_stl(folder / obstacle.mesh_file));
      } catch (const FileError& error) {
        FileError named("obstacle " + obstacle.id + ": " + error.what());
        named.file = error.file;
        throw named;
      }
      triangles += mesh->triangles.size();
      if (triangles > most_triangles) {
        FileError too_many(fmt::format(
            "obstacle {}: with {} the meshes of this cell have {} triangles, more than {}; export "
            "them coarser, or put boxes in their place",
            obstacle.id, shown(obstacle.mesh_file), triangles, most_triangles));
        too_many.file = (folder / obstacle.mesh_file).string();
        throw too_many;
      }
    }
    obstacle.mesh = mesh;
  }
}

}  // namespace cellcal::calib
