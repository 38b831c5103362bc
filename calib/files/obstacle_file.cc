#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

constexpr std::size_t kMaxObstacles = 1000;
constexpr Range kSizeMm{1e-2, 1e5};
constexpr Range kStandMm{0.1, 1e4};
constexpr std::size_t kLongestId = 80;

constexpr NumberKey<Obstacle> kCylinder[] = {
    {"diameter_mm", &Obstacle::diameter_m, kMilli, kSizeMm, kNeeded},
    {"height_mm", &Obstacle::height_m, kMilli, kSizeMm, kNeeded}};
constexpr NumberKey<Target> kStand[] = {
    {"stand_diameter_mm", &Target::stand_diameter_m, kMilli, kStandMm},
    {"stand_height_mm", &Target::stand_height_m, kMilli, kStandMm}};

Obstacle read_obstacle(const TomlTable& t, const Robot& robot) {
  Obstacle obstacle;
  obstacle.id = t.string("id");
  if (obstacle.id.empty() || shown(obstacle.id, kLongestId) != obstacle.id)
    t.fail("id", "must be a name of 1 to 80 bytes without control characters: messages name it");
  const std::string shape = t.word("shape", {"box", "cylinder", "mesh"});
  if (shape == "box") {
    obstacle.size_m = read_vector(t, "size_mm", kSizeMm) / kMmPerM;
  } else if (shape == "cylinder") {
    obstacle.shape = ObstacleShape::kCylinder;
    read_numbers(t, kCylinder, obstacle);
  } else {
    obstacle.shape = ObstacleShape::kMesh;
    obstacle.mesh_file = t.string("file");
    if (obstacle.mesh_file.empty()) t.fail("file", "must name an STL file");
  }
  obstacle.frame = read_frame(t);
  obstacle.carried_by = read_carrier(t, robot);
  t.refuse_unknown();
  return obstacle;
}

using Eigen::Vector3d;

constexpr std::size_t kMostBytes = 128u << 20;  // ASCII: about 270 bytes per triangle
constexpr std::size_t kHeader = 84, kRecord = 50, kNormal = 12;
constexpr double kFurthestMm = 1e5;
constexpr double kLeastAreaMm2 = 1e-9;
constexpr const char* kExport = "Export it as STL in millimetres";

/// Builds a mesh; shared corners are stored once.
class Builder {
 public:
  void add(const std::array<Vector3d, 3>& mm) {
    const double twice = (mm[1] - mm[0]).cross(mm[2] - mm[0]).norm();
    if (!(twice > 2.0 * kLeastAreaMm2)) return;
    mesh_.triangles.push_back({index(mm[0]), index(mm[1]), index(mm[2])});
  }
  Mesh take() { return std::move(mesh_); }

 private:
  struct Hash {
    std::size_t operator()(const std::array<double, 3>& mm) const {
      std::size_t sum = 0;
      constexpr std::size_t kMix = 0x9e3779b97f4a7c15;  // 2^64 over the golden ratio
      for (const double x : mm) sum = (sum ^ std::hash<double>()(x)) * kMix;
      return sum;
    }
  };

  int index(const Vector3d& mm) {
    const auto [found, is_new] =
        index_.try_emplace({mm.x(), mm.y(), mm.z()}, static_cast<int>(mesh_.vertices_m.size()));
    if (is_new) mesh_.vertices_m.push_back(mm / kMmPerM);
    return found->second;
  }

  Mesh mesh_;
  std::unordered_map<std::array<double, 3>, int, Hash> index_;
};

bool in_range(double mm) { return std::isfinite(mm) && std::abs(mm) <= kFurthestMm; }

std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k)  // little endian on every machine
    value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + k])) << (8 * k);
  return value;
}

/// That of the header, also with other bytes behind the last facet; without one as many as the file holds.
std::size_t count_facets(std::string_view bytes, const std::string& name) {
  const std::size_t stated = number_at(bytes, kHeader - 4), rest = bytes.size() - kHeader;
  const bool whole = rest % kRecord == 0;
  const std::size_t count = stated == 0 && whole ? rest / kRecord : stated;
  // Whole facets after the last one may belong to the mesh: two readings.
  if (rest < kRecord * count || (whole && rest > kRecord * count))
    throw FileError(
        name,
        fmt::format(": byte {}: not an STL file, or damaged: its header's {} triangles need {} "
                    "bytes, but it has {}. {}",
                    kHeader - 4, count, kHeader + kRecord * count, bytes.size(), kExport));
  if (count > kMostTriangles)
    throw FileError(name, fmt::format(": byte {}: {} triangles, more than {}; export it coarser",
                                      kHeader - 4, count, kMostTriangles));
  return count;
}

Mesh read_binary(std::string_view bytes, const std::string& name) {
  const std::size_t count = count_facets(bytes, name);
  Builder mesh;
  for (std::size_t i = 0; i < count; ++i) {
    std::array<Vector3d, 3> mm;
    for (std::size_t k = 0; k < 9; ++k) {
      const std::size_t at = kHeader + kRecord * i + kNormal + 4 * k;
      const double value = std::bit_cast<float>(number_at(bytes, at));
      if (!in_range(value))
        throw FileError(
            name,
            fmt::format(": byte {}: a corner of triangle {} is not within 100 m of the origin", at,
                        i + 1));
      mm[k / 3][static_cast<Eigen::Index>(k % 3)] = value;
    }
    mesh.add(mm);
  }
  return mesh.take();
}

/// Words of a text, each with its line number.
class Words {
 public:
  Words(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  std::string_view next() {
    skip();
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }
  bool ended() {
    skip();
    return at_ == text_.size();
  }
  void skip_line() {
    while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  }
  /// True for `wanted` in any case, also if "end" and its rest are two words.
  bool is(std::string_view word, std::string_view wanted) {
    if (wanted.starts_with("end") && same_letters(word, "end")) {
      wanted.remove_prefix(word.size());
      word = next();
    }
    return same_letters(word, wanted);
  }
  void expect(std::string_view wanted) {
    const std::string_view word = next();
    if (!is(word, wanted))
      fail(fmt::format("\"{}\" is expected, but there is \"{}\"", wanted, shown(word)));
  }
  double number() {
    std::string_view word = next();
    const std::string_view whole = word;
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size())
      fail(fmt::format("\"{}\" is not a number", shown(whole)));
    return value;
  }
  double coordinate() {
    const double mm = number();
    if (!in_range(mm)) fail("a corner is not within 100 m of the origin");
    return mm;
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw FileError(name_, fmt::format(":{}: {}", line_, what));
  }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  void skip() {
    for (; at_ < text_.size() && is_space(text_[at_]); ++at_) line_ += text_[at_] == '\n';
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t at_ = 0;
  long line_ = 1;
};

Mesh read_ascii(std::string_view text, const std::string& name) {
  Words words(text, name);
  Builder mesh;
  std::size_t count = 0;
  while (!words.ended()) {
    words.expect("solid");
    words.skip_line();  // the solid's name
    for (;;) {
      const std::string_view word = words.next();
      if (words.is(word, "endsolid")) {
        words.skip_line();
        break;
      }
      if (!same_letters(word, "facet"))
        words.fail(
            fmt::format("\"facet\" or \"endsolid\" is expected, but there is \"{}\"", shown(word)));
      if (++count > kMostTriangles)
        words.fail(fmt::format("more than {} triangles; export it coarser", kMostTriangles));
      words.expect("normal");
      for (int k = 0; k < 3; ++k) (void)words.next();  // normals, possibly nan
      words.expect("outer");
      words.expect("loop");
      std::array<Vector3d, 3> mm;
      for (Vector3d& corner : mm) {
        words.expect("vertex");
        for (Eigen::Index k = 0; k < 3; ++k) corner[k] = words.coordinate();
      }
      words.expect("endloop");
      words.expect("endfacet");
      mesh.add(mm);
    }
  }
  return mesh.take();
}

constexpr std::string_view kZip = "PK\x03\x04";

/// Name of another CAD format by the file's first bytes; empty: unknown.
std::string_view other_format(std::string_view text) {
  constexpr std::pair<std::string_view, std::string_view> kBeginnings[] = {
      {kZip, "ZIP (3MF is one)"}, {"ISO-10303-21", "STEP"}, {"#VRML", "VRML"}, {"ply", "PLY"}};
  text = trimmed(text);
  for (const auto& [beginning, format] : kBeginnings)
    if (text.starts_with(beginning)) return format;
  while (text.starts_with('#'))
    text = trimmed(text.substr(std::min(text.find('\n'), text.size())));  // OBJ's comments
  for (const std::string_view word : {"mtllib", "usemtl", "o", "g", "v", "vn", "vt"})
    if (text.starts_with(word) &&
        kBlanks.find(text.substr(word.size(), 1)) != std::string_view::npos)
      return "OBJ";
  return {};
}

}  // namespace

std::vector<Obstacle> read_obstacles(const TomlTable& document, const Robot& robot) {
  std::vector<Obstacle> obstacles;
  std::set<std::string> ids;
  for (const TomlTable& table : document.tables("obstacle")) {
    if (obstacles.size() == kMaxObstacles) table.fail("id", "a cell holds at most 1000 obstacles");
    obstacles.push_back(read_obstacle(table, robot));
    if (!ids.insert(obstacles.back().id).second)
      table.fail("id", "\"" + shown(obstacles.back().id) + "\" occurs twice");
  }
  return obstacles;
}

int read_carrier(const TomlTable& table, const Robot& robot) {
  const std::string on = table.string_or("on", "floor");
  if (on == "floor") return 0;
  const auto found = std::ranges::find(robot.positioner, on, &PositionerAxis::name);
  if (found != robot.positioner.end())
    return static_cast<int>(found - robot.positioner.begin()) + 1;
  std::string known = "\"floor\"";
  for (const PositionerAxis& axis : robot.positioner) known += " or \"" + axis.name + "\"";
  table.fail("on",
             robot.positioner.empty()
                 ? "\"" + shown(on) +
                       "\": the robot file has no [[positioner]]. Add its axes there, or leave "
                       "the key out"
                 : "\"" + shown(on) + "\" is no axis of the robot file's positioner; use " + known);
}

std::string carrier_to_toml(int carried_by, const Robot& robot) {
  if (carried_by == 0) return {};
  const std::size_t last = static_cast<std::size_t>(carried_by) - 1;
  return fmt::format("on = {}\n", toml_string(robot.positioner.at(last).name));
}

std::string obstacles_to_toml(const std::vector<Obstacle>& obstacles, const Robot& robot) {
  std::string out;
  for (const Obstacle& o : obstacles) {
    out += fmt::format("\n[[obstacle]]\nid = {}\n", toml_string(o.id));
    switch (o.shape) {
      case ObstacleShape::kBox:
        out += fmt::format("shape = \"box\"\nsize_mm = {}\n", vector_to_toml(o.size_m * kMmPerM));
        break;
      case ObstacleShape::kCylinder:
        out += "shape = \"cylinder\"\n" + numbers_to_toml(kCylinder, o);
        break;
      case ObstacleShape::kMesh:
        out += fmt::format("shape = \"mesh\"\nfile = {}\n", toml_string(o.mesh_file));
        break;
    }
    out += frame_to_toml(o.frame) + carrier_to_toml(o.carried_by, robot);
  }
  return out;
}

void read_stand(const TomlTable& t, Target& target) {
  target.has_stand = !t.has("stand") || t.word("stand", {"post", "none"}) == "post";
  for (const char* key : {"stand_diameter_mm", "stand_height_mm"})
    if (!target.has_stand && t.has(key)) t.fail(key, "there is no stand; leave it out");
  read_numbers(t, kStand, target);
}

std::string stand_to_toml(const Target& target) {
  return target.has_stand ? numbers_to_toml(kStand, target) : "stand = \"none\"\n";
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

Mesh parse_stl(std::string_view bytes, const std::string& name) {
  std::string_view text = bytes;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  Mesh mesh;
  if (bytes.size() >= kHeader && bytes[kHeader - 1] == '\0' && !bytes.starts_with(kZip)) {
    // Binary files are recognised by their triangle count, the last byte of which is 0: many begin with "solid".
    mesh = read_binary(bytes, name);
  } else if (same_letters(trimmed(text).substr(0, 5), "solid")) {
    mesh = read_ascii(text, name);
  } else if (const std::string_view other = other_format(text); !other.empty()) {
    throw FileError(name, fmt::format(": {}, not an STL file. {}", other, kExport));
  } else if (bytes.size() < kHeader) {
    throw FileError(
        name,
        fmt::format(": byte {}: ends before an STL's header does. Check that it is the right file",
                    bytes.size()));
  } else {
    throw FileError(name, fmt::format(": not an STL file. {}", kExport));
  }
  if (mesh.triangles.empty()) throw FileError(name, ": no triangles in it. Export the mesh again");
  return mesh;
}

Mesh load_stl(const std::filesystem::path& path) {
  return parse_stl(read_file(path, kMostBytes), path.string());
}

}  // namespace cellcal::calib
