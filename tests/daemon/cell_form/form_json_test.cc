#include <gtest/gtest.h>

#include <limits>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/model/error.h"
#include "daemon/cell_form/cell_form.h"
#include "daemon/cell_form/cell_text.h"
#include "example.h"

namespace cellcal::daemon::testing {
namespace {

using nlohmann::json;

std::string refusal_of_form(const json& form) {
  try {
    (void)form_from_json(form, "/cells/a.toml");
    return "";
  } catch (const calib::FileError& refused) {
    return refused.what();
  }
}

TEST(AForm, IsReadFromJsonAndMakesACellThatTheReaderOfCellFilesTakes) {
  const CellForm form = form_from_json(example(), "/cells/a.toml");
  EXPECT_EQ(objection(form), "");
  const calib::Cell cell = cell_of(form);
  ASSERT_EQ(cell.targets.size(), 3u);
  EXPECT_TRUE(cell.targets[0].has_centre);
  EXPECT_FALSE(cell.targets[2].has_centre) << "it is looked for in its box";
  EXPECT_EQ(cell.lengths.size(), 1u);
  const std::string text = cell_text(form);
  EXPECT_NE(text.find("certificate = \"DKD-1\"\ncertificate_date = \"2026-04-01\""),
            std::string::npos);
  EXPECT_NE(text.find("serial = \"77\""), std::string::npos);
}

TEST(AForm, IsFoundAgainInTheFileThatWasMadeOfIt) {
  const CellForm form = form_from_json(example(), "/cells/a.toml");
  const auto again = form_in(cell_text(form), "/cells/a.toml");
  ASSERT_TRUE(again);
  EXPECT_EQ(to_json(*again), to_json(form));
  EXPECT_EQ(cell_text(*again), cell_text(form));
}

TEST(AForm, OpensAnyCellFileAndKeepsWhatItDoesNotShow) {
  std::string text = cell_text(form_from_json(example(), "/cells/a.toml"));
  EXPECT_TRUE(beyond(*form_in(text, "/cells/a.toml"), text).empty());
  text.replace(text.find("\nsigma_mm = 0.03"), 16, "\nsigma_mm = 0.05");
  text +=
      "[[obstacle]]\nid = \"t\"\nshape = \"box\"\nsize_mm = [1, 1, 1]\nxyz_mm = [0, 0, 0]\n"
      "[[target]]\nid = \"plate\"\nkind = \"plane\"\ncentre_mm = [1, 2, 3]\nnormal = [0, 0, 1]\n";
  auto form = form_in(text, "/cells/a.toml");
  ASSERT_TRUE(form);
  const std::vector<std::string> kept = beyond(*form, text);
  EXPECT_EQ(kept, (std::vector<std::string>{"target plate", "touch.sigma_mm"}));
  form->spheres[0].diameter_mm = 30.0;
  const std::string now = cell_text_with(*form, text);
  const calib::Cell cell = calib::parse_cell({"a.toml", now, form->robot.name, form->robot.text});
  EXPECT_EQ(cell.targets[0].diameter_m, 0.030);
  EXPECT_EQ(cell.targets.back().id, "plate");
  EXPECT_EQ(cell.obstacles.size(), 1u);
  EXPECT_EQ(cell.touch_sigma_m, 0.05e-3);
  EXPECT_FALSE(form_in("robot = \"kr5_r1400\"\n", "/cells/a.toml"));
  EXPECT_THROW((void)form_in("robot = ", "/cells/a.toml"), calib::FileError);
}

TEST(AForm, WritesACellFileOfAnotherHandAgainWithoutChangingWhatItSays) {
  const std::string text = calib::read_file(CELLCAL_DEMO_CELL);
  const auto form = form_in(text, CELLCAL_DEMO_CELL);
  ASSERT_TRUE(form);
  const std::string now = cell_text_with(*form, text);
  const calib::Cell before = calib::load_cell(CELLCAL_DEMO_CELL);
  const calib::Cell after = calib::parse_cell({"a.toml", now, form->robot.name, form->robot.text});
  EXPECT_EQ(calib::cell_to_toml(after, "r"), calib::cell_to_toml(before, "r"));
}

TEST(ARefusedForm, NamesTheFieldThatIsAtFault) {
  const auto key_of = [](const char* pointer, const json& value) {
    json form = example();
    form[json::json_pointer(pointer)] = value;
    const auto fault = fault_in(form_from_json(form, "/cells/a.toml"));
    return fault ? fault->key : "";
  };
  EXPECT_EQ(key_of("/spheres/1/diameter_mm", -50), "spheres.1.diameter_mm");
  EXPECT_EQ(key_of("/spheres/1/id", "S1"), "spheres.1.id");
  EXPECT_EQ(key_of("/lengths/0/mm", 900), "lengths.0.mm") << "the centres are 600 mm apart";
  EXPECT_EQ(key_of("/lengths/0/certificate_date", "soon"), "lengths.0.certificate_date");
  EXPECT_EQ(key_of("/tool/mass_kg", 80), "tool.mass_kg") << "of an arm for 5 kg";
  EXPECT_EQ(key_of("/spheres/2/box_mm", json::parse("[[1100, -50, 350], [1000, 50, 450]]")),
            "spheres.2.box_mm");
  EXPECT_EQ(key_of("/tool/tip_radius_mm", 0), "") << "nothing is wrong";
  json twice = example();
  twice["spheres"][1]["id"] = "S1";
  EXPECT_EQ(fault_in(form_from_json(twice, "/cells/a.toml"))->words,
            "target[2].id: \"S1\" occurs twice")
      << "no file has a line of it";
}

TEST(AKeyOfAFile, IsThatOfTheForm) {
  EXPECT_EQ(form_key("target[2].diameter_mm"), "spheres.1.diameter_mm");
  EXPECT_EQ(form_key("target[1].search_high_mm"), "spheres.0.box_mm");
  EXPECT_EQ(form_key("length[1].between"), "lengths.0.from");
  EXPECT_EQ(form_key("obstacle[3].xyz_mm"), "obstacles.2.xyz_mm");
  EXPECT_EQ(form_key(".spheres[0].centre_mm[2]"), "spheres.0.centre_mm");
  EXPECT_EQ(form_key(".tool.xyz_mm[1]"), "tool.xyz_mm");
  EXPECT_EQ(form_key("robot"), "robot");
  for (const char* other : {"", "target[0].id", "target[x].id", "target[99999999999999999999].id",
                            "plane[1].id", "target[1", "]["})
    EXPECT_EQ(form_key(other), "") << other;
}

json with_obstacles() {
  json form = example();
  form["tool"]["com_mm"] = {30, 25, 205};
  form["obstacles"] = json::parse(R"([
    {"id": "table", "shape": "box", "size_mm": [800, 600, 20], "xyz_mm": [1000, 0, 90], "abc_deg": [30, 0, 0]},
    {"id": "pillar", "shape": "cylinder", "diameter_mm": 120, "height_mm": 1500, "xyz_mm": [0, 1200, 750]}])");
  return form;
}

TEST(AForm, HasObstaclesAndTheLoadWhichAreFoundAgainInItsFile) {
  const CellForm form = form_from_json(with_obstacles(), "/cells/a.toml");
  EXPECT_EQ(objection(form), "");
  const calib::Cell cell = cell_of(form);
  ASSERT_EQ(cell.obstacles.size(), 2u);
  EXPECT_EQ(cell.obstacles[0].size_m, Eigen::Vector3d(0.8, 0.6, 0.02));
  EXPECT_NEAR(cell.obstacles[0].frame.linear()(1, 0), 0.5, 1e-12) << "A turns about z";
  EXPECT_EQ(cell.obstacles[1].height_m, 1.5);
  EXPECT_EQ(cell.tool.com_m, Eigen::Vector3d(0.030, 0.025, 0.205));
  const std::string text = cell_text(form);
  const auto again = form_in(text, "/cells/a.toml");
  ASSERT_TRUE(again);
  EXPECT_EQ(to_json(*again), to_json(form));
  EXPECT_TRUE(beyond(*again, text).empty());
  CellForm fewer = *again;
  fewer.obstacles.pop_back();
  EXPECT_EQ(form_in(cell_text_with(fewer, text), "/cells/a.toml")->obstacles.size(), 1u)
      << "what is removed in the form does not come back from the file before";
}

TEST(AForm, HasAFloorWhichIsFoundAgainInItsFileUntilItIsTakenAway) {
  json with_floor = example();
  with_floor["floor_mm"] = -20.5;
  CellForm form = form_from_json(with_floor, "/cells/a.toml");
  EXPECT_NEAR(cell_of(form).floor_m.value(), -0.0205, 1e-12);
  const std::string text = cell_text(form);
  EXPECT_EQ(to_json(*form_in(text, "/cells/a.toml")), to_json(form));
  EXPECT_TRUE(beyond(form, text).empty());
  form.floor_mm.reset();
  EXPECT_FALSE(form_in(cell_text_with(form, text), "/cells/a.toml")->floor_mm);
  with_floor["floor_mm"] = "low";
  EXPECT_THROW((void)form_from_json(with_floor, "/cells/a.toml"), calib::FileError);
}

TEST(AForm, IsDrawnBeforeItHasASphere) {
  json form = with_obstacles();
  form["spheres"] = json::array();
  form["lengths"] = json::array();
  const calib::Cell sketch = sketch_of(form_from_json(form, "/cells/a.toml"));
  EXPECT_TRUE(sketch.targets.empty());
  EXPECT_EQ(sketch.obstacles.size(), 2u);
  EXPECT_EQ(sketch_of(form_from_json(with_obstacles(), "/cells/a.toml")).targets.size(), 3u);
}

TEST(PlacesForSpheres, AreProposedClearOfTheObstaclesForAllSpheresOfTheForm) {
  json form = with_obstacles();
  form["obstacles"][0]["xyz_mm"] = {1000, 0, 500};
  form["lengths"] = json::array();
  const SuggestedPlaces places = suggest_places(form_from_json(form, "/cells/a.toml"));
  ASSERT_EQ(places.spheres.size(), 3u);
  EXPECT_GT(places.mean_mm, 0.0);
  EXPECT_GT(places.u95_mm, places.mean_mm);
  form["spheres"] = to_json(places.spheres);
  EXPECT_EQ(objection(form_from_json(form, "/cells/a.toml")), "");
  for (const SphereForm& sphere : places.spheres) {
    ASSERT_TRUE(sphere.centre_mm) << sphere.id;
    EXPECT_FALSE(sphere.box_mm) << sphere.id;
    const Triple& centre = *sphere.centre_mm;
    const bool in_table = std::abs(centre[0] - 1000) < 300 && std::abs(centre[1]) < 300 &&
                          std::abs(centre[2] - 500) < 30;
    EXPECT_FALSE(in_table) << sphere.id;
  }
  EXPECT_EQ(places.spheres[0].serial, "77") << "all but the place is the sphere's own";
}

TEST(ACellFileFromElsewhere, OpensWithWhatTheFormDoesNotShowAndNamesWhatIsNotHere) {
  std::string text = cell_text(form_from_json(with_obstacles(), "/cells/a.toml"));
  EXPECT_TRUE(uploaded_cell(text, "cell file").kept.empty());
  EXPECT_TRUE(uploaded_cell(text, "cell file").missing.empty());
  text.replace(text.find("\"kr5_r1400\""), 11, "\"/etc/passwd\"");
  text +=
      "[[obstacle]]\nid = \"f\"\nshape = \"mesh\"\nfile = \"/etc/shadow\"\nxyz_mm = [0, 0, 0]\n"
      "[[target]]\nid = \"plate\"\nkind = \"plane\"\ncentre_mm = [1, 2, 3]\nnormal = [0, 0, 1]\n";
  const UploadedCell read = uploaded_cell(text, "cell file");
  EXPECT_EQ(read.kept, std::vector<std::string>{"target plate"});
  EXPECT_EQ(read.missing, (std::vector<std::string>{"/etc/passwd", "/etc/shadow"}));
  EXPECT_EQ(read.form.robot.reference, "");
  EXPECT_EQ(read.form.obstacles.back().file, "") << "no file is opened by what a text names";
  EXPECT_EQ(read.form.spheres.size(), 3u);
}

TEST(ACellFileFromElsewhere, ThatIsWrongIsRefusedWithLineAndKey) {
  const std::string text = cell_text(form_from_json(with_obstacles(), "/cells/a.toml"));
  const auto refusal = [](const std::string& hostile) -> std::string {
    try {
      (void)uploaded_cell(hostile, "cell file");
      return "";
    } catch (const calib::FileError& refused) {
      return refused.what();
    }
  };
  const auto with = [&](const std::string& what, const std::string& instead) {
    std::string changed = text;
    changed.replace(changed.find(what), what.size(), instead);
    return refusal(changed);
  };
  EXPECT_EQ(refusal(text), "");
  EXPECT_NE(with("diameter_mm = 50.0", "diameter_mm = nan").find("diameter_mm"), std::string::npos);
  EXPECT_NE(with("shape = \"box\"", "shape = \"cone\"").find("shape"), std::string::npos);
  EXPECT_NE(with("[touch]", "colour = 1\n[touch]"), "");
  EXPECT_NE(with("\n[tool]", "\n[[tool]]\nid = \"a\"").find("several tools"), std::string::npos);
  for (const std::string& no_cell :
       {std::string(), std::string("\0\xff", 2), std::string("robot = "), std::string("robot = 3"),
        std::string("format = \"cellcal.cell/1\"\nrobot = \"kr5_r1400\"\n"), text.substr(0, 900),
        std::string(100000, '['), "a" + std::string(100000, '.') + "b = 1"})
    EXPECT_NE(refusal(no_cell), "") << no_cell.substr(0, 40);
}

TEST(ASphere, ThatWasTaughtLiesBelowTheTipByItsRadius) {
  json form = example();
  json& sphere = form["spheres"][2];
  sphere.erase("box_mm");
  sphere["joints_deg"] = {0, -90, 90, 0, 45, 0};
  const CellForm taught = form_from_json(form, "/cells/a.toml");
  const Triple tip = tip_mm(taught, {0, -90, 90, 0, 45, 0});
  ASSERT_TRUE(taught.spheres[2].centre_mm);
  const Triple centre = *taught.spheres[2].centre_mm;
  EXPECT_NEAR(centre[0], tip[0], 1e-9);
  EXPECT_NEAR(centre[1], tip[1], 1e-9);
  EXPECT_NEAR(centre[2], tip[2] - 25.0, 1e-9);
}

TEST(AForm, ThatIsWrongIsRefusedWithTheKeyAndWhatItMustBe) {
  const auto with = [](const char* pointer, const json& value) {
    json form = example();
    form[json::json_pointer(pointer)] = value;
    return refusal_of_form(form);
  };
  EXPECT_EQ(refusal_of_form(example()), "");
  EXPECT_NE(with("/robot", "kr9").find("form.robot: \"kr9\" is not a shipped robot"),
            std::string::npos);
  for (const char* path : {"/etc/passwd", "../kr5_r1400", "kr5_r1400.toml", ""})
    EXPECT_NE(with("/robot", path), "") << "no file is read for somebody on the network: " << path;
  EXPECT_NE(with("/tool/xyz_mm", {1, 2}).find("tool.xyz_mm"), std::string::npos);
  EXPECT_NE(with("/tool/xyz_mm", "1 2 3").find("tool.xyz_mm"), std::string::npos);
  EXPECT_NE(with("/tool/xyz_mm/0", std::numeric_limits<double>::infinity()), "");
  EXPECT_NE(with("/tool/length_mm", 5).find("length_mm"), std::string::npos)
      << "nothing is passed over";
  EXPECT_NE(with("/spheres/0/diameter_mm", nullptr).find("spheres[0].diameter_mm"),
            std::string::npos);
  EXPECT_NE(with("/spheres/0/colour", "red").find("colour"), std::string::npos);
  EXPECT_NE(with("/spheres/0/id", std::string(1000, 'S')).find("spheres[0].id"), std::string::npos);
  EXPECT_NE(with("/spheres/0/id", "S\n1").find("spheres[0].id"), std::string::npos);
  EXPECT_NE(with("/spheres/2/joints_deg", {1, 2, 3}).find("there must be 6 angles"),
            std::string::npos);
  EXPECT_NE(with("/spheres/2/joints_deg", {0, -90, 400, 0, 45, 0})
                .find("spheres[2].joints_deg: A3 at 400 deg is beyond its limits"),
            std::string::npos);
  EXPECT_NE(with("/spheres/0/joints_deg", {1, 2, 3, 4, 5, 6}).find("give one"), std::string::npos);
  EXPECT_NE(
      with("/spheres", json(std::vector<json>(101, example()["spheres"][0]))).find("100 rows"),
      std::string::npos);
  EXPECT_NE(with("/lengths/0/mm", "600"), "");
  EXPECT_NE(with("/lengths/0/more", 1), "");
  const auto obstacle = [](const char* key, const json& value) {
    json form = with_obstacles();
    form["obstacles"][0][key] = value;
    return refusal_of_form(form);
  };
  EXPECT_NE(obstacle("shape", "cone").find("obstacles[0].shape"), std::string::npos);
  EXPECT_NE(obstacle("shape", "cylinder").find("diameter_mm"), std::string::npos);
  EXPECT_NE(obstacle("size_mm", {1, 2}).find("obstacles[0].size_mm"), std::string::npos);
  EXPECT_NE(obstacle("colour", "red").find("colour"), std::string::npos);
  json mesh = with_obstacles();
  mesh["obstacles"][0] = {{"id", "f"}, {"shape", "mesh"}, {"xyz_mm", {0, 0, 0}}};
  EXPECT_NE(refusal_of_form(mesh).find("\"file\" is missing"), std::string::npos);
  for (const char* file :
       {"/etc/passwd", "fixture.stl", "../x.mesh.stl", "/cells/none.mesh.stl", ""}) {
    mesh["obstacles"][0]["file"] = file;
    EXPECT_NE(refusal_of_form(mesh).find("obstacles[0].file"), std::string::npos)
        << "no file is read for somebody on the network: " << file;
  }
  for (const json& no_form : {json(), json(3), json::array(), json::object(), json("form")})
    EXPECT_NE(refusal_of_form(no_form), "") << no_form;
  for (const char* key : {"robot", "tool", "spheres"}) {
    json less = example();
    less.erase(key);
    EXPECT_NE(refusal_of_form(less).find(key), std::string::npos) << key;
  }
}

TEST(AForm, CannotBringKeysIntoTheFileByItsWords) {
  json form = example();
  form["spheres"][0]["id"] = "S1\"] #";
  form["spheres"][0]["certificate"] = "\"\nfloor_mm = -900 #";
  EXPECT_NE(refusal_of_form(form), "");
  form["spheres"][0]["certificate"] = "\" floor_mm = -900";
  const CellForm read = form_from_json(form, "/cells/a.toml");
  EXPECT_EQ(cell_text(read).find("\nfloor_mm"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon::testing
