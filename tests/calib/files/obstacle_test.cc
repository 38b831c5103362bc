// Obstacles in a cell file: bodies, stands, the floor, the tool's body.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/files/toml.h"
#include "calib/model/units.h"
#include "tests/calib/files/documents.h"

namespace cellcal::calib {
namespace {

using testing::cell_of;
using testing::cell_refusal;
using testing::expect_words;
using testing::kCell;
using testing::kRobot;
using testing::refusal;
using testing::robot_refusal;
using testing::with;

constexpr const char* kBox = R"([[obstacle]]
id = "table"
shape = "box"
size_mm = [800.0, 1200.0, 50.0]
xyz_mm = [1000.0, 0.0, -100.0]
abc_deg = [30.0, 0.0, 0.0]

)";
constexpr const char* kPost = R"([[obstacle]]
id = "post"
shape = "cylinder"
diameter_mm = 80.0
height_mm = 2000.0
xyz_mm = [-700.0, -700.0, 1000.0]

)";
constexpr const char* kMesh = R"([[obstacle]]
id = "fixture"
shape = "mesh"
file = "fixture.stl"
xyz_mm = [1.0, 2.0, 3.0]

)";
constexpr const char* kTetrahedron = R"(solid t
facet normal 0 0 0
 outer loop
  vertex 0 0 0
  vertex 100 0 0
  vertex 0 100 0
 endloop
endfacet
endsolid t
)";

/// The valid cell with `text` inserted before its touch table.
std::string cell_with(const std::string& text) { return with(kCell, "[touch]", text + "[touch]"); }

TEST(ObstacleFile, ReadsBoxesCylindersAndMeshesIntoMetres) {
  const Cell cell = cell_of(cell_with(std::string(kBox) + kPost + kMesh));
  ASSERT_EQ(cell.obstacles.size(), 3u);
  const Obstacle &box = cell.obstacles[0], &post = cell.obstacles[1], &mesh = cell.obstacles[2];
  EXPECT_EQ(box.id, "table");
  EXPECT_EQ(box.shape, ObstacleShape::kBox);
  EXPECT_LT((box.size_m - Eigen::Vector3d(0.8, 1.2, 0.05)).norm(), 1e-15);
  EXPECT_LT((box.frame.translation() - Eigen::Vector3d(1.0, 0.0, -0.1)).norm(), 1e-15);
  EXPECT_NEAR(box.frame.linear()(1, 0), 0.5, 1e-12);
  EXPECT_EQ(post.shape, ObstacleShape::kCylinder);
  EXPECT_DOUBLE_EQ(post.diameter_m, 0.08);
  EXPECT_DOUBLE_EQ(post.height_m, 2.0);
  EXPECT_EQ(mesh.shape, ObstacleShape::kMesh);
  EXPECT_EQ(mesh.mesh_file, "fixture.stl");
  EXPECT_EQ(mesh.mesh, nullptr);  // text alone has no directory for files
}

TEST(ObstacleFile, ReadsStandsFloorAndTheToolsBody) {
  std::string text = with(kCell, "diameter_mm = 38.1",
                          "diameter_mm = 38.1\nstand_diameter_mm = 20\nstand_height_mm = 400");
  text = with(text, "kind = \"wire\"", "kind = \"wire\"\nstand = \"none\"");
  text = with(text, "robot = \"two.toml\"",
              "robot = \"two.toml\"\nfloor_mm = -350.5\nrequired_mm = 0.25");
  text = with(text, "tip_radius_mm = 0.6",
              "tip_radius_mm = 0.6\nradius_mm = 45\ntip_length_mm = 80\ntip_diameter_mm = 3");
  const Cell cell = cell_of(text);
  EXPECT_TRUE(cell.targets[0].has_stand);
  EXPECT_EQ(cell.targets[0].stand_diameter_m, 0.0);
  EXPECT_TRUE(cell.targets[1].has_stand);
  EXPECT_DOUBLE_EQ(cell.targets[1].stand_diameter_m, 0.02);
  EXPECT_DOUBLE_EQ(cell.targets[1].stand_height_m, 0.4);
  EXPECT_FALSE(cell.targets[2].has_stand);
  ASSERT_TRUE(cell.floor_m);
  EXPECT_DOUBLE_EQ(*cell.floor_m, -0.3505);
  EXPECT_DOUBLE_EQ(cell.tool.radius_m, 0.045);
  EXPECT_DOUBLE_EQ(cell.tool.slim_length_m, 0.08);
  EXPECT_DOUBLE_EQ(cell.tool.slim_radius_m, 0.0015);
}

TEST(ObstacleFile, TakesTheUsualToolWhereNothingIsStated) {
  const Cell cell = testing::cell();
  EXPECT_EQ(cell.tool.radius_m, Tool{}.radius_m);
  EXPECT_EQ(cell.tool.slim_length_m, Tool{}.slim_length_m);
  EXPECT_EQ(cell.tool.slim_radius_m, Tool{}.slim_radius_m);
  EXPECT_TRUE(cell.obstacles.empty());
  EXPECT_FALSE(cell.floor_m);
}

TEST(ObstacleFile, ReadsALinksRadius) {
  const std::string text =
      with(kRobot, "gear_ratio = -120.5", "gear_ratio = -120.5\nradius_mm = 85");
  const Robot robot = read_robot(TomlTable::parse(text, "robot.toml"));
  EXPECT_DOUBLE_EQ(robot.joints[0].radius_m, 0.085);
  EXPECT_EQ(robot.joints[1].radius_m, 0.0);
  const Robot again = read_robot(TomlTable::parse(robot_to_toml(robot), "again.toml"));
  EXPECT_DOUBLE_EQ(again.joints[0].radius_m, 0.085);
  EXPECT_EQ(again.joints[1].radius_m, 0.0);
  for (const char* bad : {"radius_mm = 0", "radius_mm = -5", "radius_mm = nan", "radius_mm = 1e9",
                          "radius_mm = \"85\"", "radius_mm = [85]"})
    expect_words(robot_refusal(with(kRobot, "gear_ratio = -120.5", bad)), {"joint[1].radius_mm"});
}

TEST(ObstacleFile, KeepsEverythingWhenWrittenAndThroughJson) {
  std::string text = cell_with(std::string(kBox) + kPost + kMesh);
  text = with(text, "diameter_mm = 38.1", "diameter_mm = 38.1\nstand_height_mm = 400");
  text = with(text, "kind = \"wire\"", "kind = \"wire\"\nstand = \"none\"");
  text = with(text, "robot = \"two.toml\"", "robot = \"two.toml\"\nfloor_mm = -350");
  text =
      with(text, "tip_radius_mm = 0.6", "tip_radius_mm = 0.6\nradius_mm = 45\ntip_diameter_mm = 3");
  const Cell cell = cell_of(text);
  const std::string once = cell_to_toml(cell, "two.toml");
  for (const Cell& again :
       {cell_of(once), read_cell(table_from_json(toml_to_json(once), "json"), testing::robot())}) {
    EXPECT_EQ(cell_to_toml(again, "two.toml"), once);
    ASSERT_EQ(again.obstacles.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(again.obstacles[i].id, cell.obstacles[i].id);
      EXPECT_EQ(again.obstacles[i].shape, cell.obstacles[i].shape);
      EXPECT_LT((again.obstacles[i].frame.matrix() - cell.obstacles[i].frame.matrix()).norm(),
                1e-12);
      EXPECT_LT((again.obstacles[i].size_m - cell.obstacles[i].size_m).norm(), 1e-12);
    }
    EXPECT_EQ(again.obstacles[2].mesh_file, "fixture.stl");
    EXPECT_FALSE(again.targets[2].has_stand);
    EXPECT_DOUBLE_EQ(again.targets[1].stand_height_m, 0.4);
    EXPECT_EQ(again.targets[1].stand_diameter_m, 0.0);
    EXPECT_DOUBLE_EQ(again.floor_m.value_or(0.0), -0.35);
    EXPECT_DOUBLE_EQ(again.tool.radius_m, 0.045);
    EXPECT_DOUBLE_EQ(again.tool.slim_radius_m, 0.0015);
    EXPECT_EQ(again.tool.slim_length_m, Tool{}.slim_length_m);
  }
}

TEST(ObstacleFile, NamesObstacleAndKeyOfWhatIsWrong) {
  struct Broken {
    const char *whole, *line, *now, *key;
  };
  for (const Broken& broken : std::initializer_list<Broken>{
           {kBox, "id = \"table\"", "", "id: missing"},
           {kBox, "id = \"table\"", "id = \"\"", "obstacle[1].id"},
           {kBox, "id = \"table\"", "id = \"a\\nb\"", "obstacle[1].id"},
           {kBox, "shape = \"box\"", "shape = \"cone\"", "obstacle[1].shape"},
           {kBox, "shape = \"box\"", "shape = \"cylinder\"", "diameter_mm: missing"},
           {kBox, "shape = \"box\"", "shape = \"mesh\"", "file: missing"},
           {kBox, "size_mm", "size_mn", "size_mm: missing"},
           {kBox, "size_mm = [800.0, 1200.0, 50.0]", "size_mm = [800.0, 1200.0]", "size_mm"},
           {kBox, "size_mm = [800.0, 1200.0, 50.0]", "size_mm = [800.0, nan, 5]", "finite"},
           {kBox, "size_mm = [800.0, 1200.0, 50.0]", "size_mm = [800.0, 0, 5]", "size_mm"},
           {kBox, "size_mm = [800.0, 1200.0, 50.0]", "size_mm = [800.0, 1e9, 5]", "size_mm"},
           {kBox, "xyz_mm = [1000.0, 0.0, -100.0]", "", "xyz_mm: missing"},
           {kBox, "xyz_mm = [1000.0, 0.0, -100.0]", "xyz_mm = [inf, 0, 0]", "xyz_mm"},
           {kBox, "abc_deg = [30.0, 0.0, 0.0]", "abc_deg = [30.0]", "abc_deg"},
           {kBox, "abc_deg = [30.0, 0.0, 0.0]", "file = \"x.stl\"", "unknown key"},
           {kPost, "diameter_mm = 80.0", "diameter_mm = -80.0", "diameter_mm"},
           {kPost, "height_mm = 2000.0", "height_mm = nan", "height_mm"},
           {kPost, "height_mm = 2000.0", "height_mm = 20\nsize_mm = [1, 1, 1]", "unknown key"},
           {kMesh, "file = \"fixture.stl\"", "file = \"\"", "obstacle[1].file"},
           {kMesh, "file = \"fixture.stl\"", "file = 5", "obstacle[1].file"}}) {
    SCOPED_TRACE(broken.now);
    expect_words(cell_refusal(cell_with(with(broken.whole, broken.line, broken.now))),
                 {"cell.toml:", "obstacle[1]", broken.key});
  }
  expect_words(cell_refusal(cell_with(std::string(kBox) + kBox)), {"obstacle[2].id", "twice"});
  for (const char* bad : {"floor_mm = nan", "floor_mm = 1e9", "floor_mm = [0]"})
    expect_words(cell_refusal(with(kCell, "robot = \"two.toml\"",
                                   std::string("robot = \"two.toml\"\n") + bad)),
                 {"cell.toml:3: floor_mm"});
  for (const auto& [line, key] : std::initializer_list<std::pair<const char*, const char*>>{
           {"stand = \"table\"", "stand"},
           {"stand = \"none\"\nstand_diameter_mm = 20", "there is no stand"},
           {"stand_diameter_mm = 0", "stand_diameter_mm"},
           {"stand_height_mm = nan", "stand_height_mm"},
           {"stand_height_mm = -4", "stand_height_mm"}})
    expect_words(
        cell_refusal(with(kCell, "diameter_mm = 38.1", std::string("diameter_mm = 38.1\n") + line)),
        {"target[2].", key});
  for (const char* bad : {"radius_mm = -1", "radius_mm = nan", "tip_length_mm = -1",
                          "tip_diameter_mm = inf", "tip_length_mm = 1e9"})
    expect_words(cell_refusal(with(kCell, "tip_radius_mm = 0.6", bad)), {"cell.toml:11: tool."});
}

TEST(ObstacleFile, APlaneHasNoStand) {
  expect_words(cell_refusal(with(kCell, "kind = \"wire\"", "kind = \"plane\"\nstand = \"none\"")),
               {"target[3].stand", "unknown key"});
}

class MeshOnDisk : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ("cellcal-mesh-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    write("two.toml", kRobot);
    cell_ = write("cell.toml", cell_with(kMesh));
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  std::filesystem::path folder_, cell_;
};

TEST_F(MeshOnDisk, IsReadBesideTheCellFile) {
  write("fixture.stl", kTetrahedron);
  const Cell cell = load_cell(cell_);
  ASSERT_NE(cell.obstacles[0].mesh, nullptr);
  EXPECT_EQ(cell.obstacles[0].mesh->triangles.size(), 1u);
  EXPECT_LT((cell.obstacles[0].mesh->vertices_m[1] - Eigen::Vector3d(0.1, 0, 0)).norm(), 1e-15);
}

/// Obstacle `id` with the mesh `file`.
std::string fixture(const std::string& id, const std::string& file) {
  return with(with(kMesh, "\"fixture\"", "\"" + id + "\""), "\"fixture.stl\"", "\"" + file + "\"");
}

TEST_F(MeshOnDisk, IsReadOnceForAllObstaclesThatNameIt) {
  write("fixture.stl", kTetrahedron);
  std::string many;
  for (int i = 0; i < 200; ++i) many += fixture("f" + std::to_string(i), "fixture.stl");
  const Cell cell = load_cell(write("many.toml", cell_with(many)));
  ASSERT_EQ(cell.obstacles.size(), 200u);
  for (const Obstacle& obstacle : cell.obstacles)
    EXPECT_EQ(obstacle.mesh, cell.obstacles[0].mesh) << obstacle.id;
}

TEST_F(MeshOnDisk, AllOfACellTogetherAreBounded) {
  write("a.stl", kTetrahedron);
  write("b.stl", kTetrahedron);
  write("c.stl", kTetrahedron);
  const std::string text = cell_with(fixture("first", "a.stl") + fixture("again", "a.stl") +
                                     fixture("second", "b.stl") + fixture("third", "c.stl"));
  Cell cell = cell_of(text);
  expect_words(refusal([&] { load_meshes(cell, folder_, 2); }, folder_ / "c.stl"),
               {"obstacle third", "c.stl", "3 triangles", "more than 2"});
  EXPECT_NO_THROW(load_meshes(cell, folder_, 3));
  EXPECT_LE(kMostTrianglesOfCell, 1'000'000u) << "a plan needs some 0.7 kB for each";
}

TEST_F(MeshOnDisk, ThatIsMissingOrBrokenIsRefusedWithObstacleAndFile) {
  expect_words(refusal([&] { (void)load_cell(cell_); }),
               {"obstacle fixture", "fixture.stl", "no such file"});
  write("fixture.stl", "solid\nfacet normal 0 0 1\n outer lop\n");
  expect_words(refusal([&] { (void)load_cell(cell_); }, folder_ / "fixture.stl"),
               {"obstacle fixture", "fixture.stl:3: "});
}

}  // namespace
}  // namespace cellcal::calib
