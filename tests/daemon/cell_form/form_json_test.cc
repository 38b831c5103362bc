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

TEST(a_form, is_read_from_json_and_makes_a_cell_that_the_reader_of_cell_files_takes) {
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

TEST(a_form, is_found_again_in_the_file_that_was_made_of_it) {
  const CellForm form = form_from_json(example(), "/cells/a.toml");
  const auto again = form_in(cell_text(form), "/cells/a.toml");
  ASSERT_TRUE(again);
  EXPECT_EQ(to_json(*again), to_json(form));
  EXPECT_EQ(cell_text(*again), cell_text(form));
}

TEST(a_form, opens_any_cell_file_and_keeps_what_it_does_not_show) {
  std::string text = cell_text(form_from_json(example(), "/cells/a.toml"));
  EXPECT_TRUE(beyond(*form_in(text, "/cells/a.toml"), text).empty());
  text.replace(text.find("\nsigma_mm = 0.03"), 16, "\nsigma_mm = 0.05");
  text +=
      "[[obstacle]]\nid = \"t\"\nshape = \"box\"\nsize_mm = [1, 1, 1]\nxyz_mm = [0, 0, 0]\n"
      "[[target]]\nid = \"plate\"\nkind = \"plane\"\ncentre_mm = [1, 2, 3]\nnormal = [0, 0, 1]\n";
  auto form = form_in(text, "/cells/a.toml");
  ASSERT_TRUE(form);
  const std::vector<std::string> kept = beyond(*form, text);
  EXPECT_EQ(kept, (std::vector<std::string>{"target plate", "touch.sigma_mm", "obstacle t"}));
  form->spheres[0].diameter_mm = 30.0;
  const std::string now = cell_text_with(*form, text, "/cells");
  const calib::Cell cell = calib::parse_cell({"a.toml", now, form->robot.name, form->robot.text});
  EXPECT_EQ(cell.targets[0].diameter_m, 0.030);
  EXPECT_EQ(cell.targets.back().id, "plate");
  EXPECT_EQ(cell.obstacles.size(), 1u);
  EXPECT_EQ(cell.touch_sigma_m, 0.05e-3);
  EXPECT_FALSE(form_in("robot = \"kr5_r1400\"\n", "/cells/a.toml"));
  EXPECT_THROW((void)form_in("robot = ", "/cells/a.toml"), calib::FileError);
}

TEST(a_form, writes_a_cell_file_of_another_hand_again_without_changing_what_it_says) {
  const std::string text = calib::read_file(CELLCAL_DEMO_CELL);
  const auto form = form_in(text, CELLCAL_DEMO_CELL);
  ASSERT_TRUE(form);
  const std::string now =
      cell_text_with(*form, text, std::filesystem::path(CELLCAL_DEMO_CELL).parent_path());
  const calib::Cell before = calib::load_cell(CELLCAL_DEMO_CELL);
  const calib::Cell after = calib::parse_cell({"a.toml", now, form->robot.name, form->robot.text});
  EXPECT_EQ(calib::cell_to_toml(after, "r"), calib::cell_to_toml(before, "r"));
}

TEST(a_sphere, that_was_taught_lies_below_the_tip_by_its_radius) {
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

TEST(a_form, that_is_wrong_is_refused_with_the_key_and_what_it_must_be) {
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
  for (const json& no_form : {json(), json(3), json::array(), json::object(), json("form")})
    EXPECT_NE(refusal_of_form(no_form), "") << no_form;
  for (const char* key : {"robot", "tool", "spheres"}) {
    json less = example();
    less.erase(key);
    EXPECT_NE(refusal_of_form(less).find(key), std::string::npos) << key;
  }
}

TEST(a_form, cannot_bring_keys_into_the_file_by_its_words) {
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
