// Files are read as their kind before they are written.

#include <gtest/gtest.h>

#include <filesystem>

#include "calib/export/krl_text.h"
#include "calib/export/rigid_arm.h"
#include "calib/export/urdf.h"
#include "calib/files/calibration_json.h"
#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/model/error.h"
#include "daemon/cli/offline.h"
#include "tests/calib/random_calibration.h"
#include "tests/calib/simulate.h"

namespace cellcal::daemon {
namespace {

namespace fs = std::filesystem;

struct Kind {
  const char* name;
  Reader reader;
  std::string good;
};

std::vector<Kind> kinds() {
  const calib::Cell& cell = calib::testing::demo_cell();
  static const calib::CellText files = calib::read_cell_text(CELLCAL_DEMO_CELL);
  calib::Random random(1);
  const auto calibration = calib::testing::random_calibration(cell, random, 1.0);
  std::string joints, zeros;
  for (const calib::Joint& joint : cell.robot.joints) {
    joints += (joints.empty() ? "" : ",") + joint.name;
    zeros += zeros.empty() ? "10.0" : ",10.0";
  }
  return {{"robot", as_robot, calib::robot_to_toml(cell.robot)},
          {"cell",
           [](const auto& text, const auto& name) {
             calib::parse_cell({name, text, files.robot_name, files.robot_text});
           },
           files.cell_text},
          {"urdf", [](const auto& text, const auto& name) { calib::read_urdf(text, name); },
           calib::urdf_of(calib::joint_frames(calib::nominal_rigid_arm(cell)), "arm", "made")},
          {"touches",
           [&](const auto& text, const auto& name) { calib::parse_touches(text, name, cell); },
           calib::format_touches({}, cell.robot)},
          {"joints",
           [&](const auto& text, const auto& name) { calib::parse_joints(text, name, cell.robot); },
           joints + "\n" + zeros + "\n"},
          {"calibration", calib::calibration_from_json, calib::calibration_to_json(calibration)},
          {"krl", as_krl, "DEF P()\nPTP XP1\nEND\n"}};
}

TEST(AFileOfEachKind, IsWrittenAsItIsWhereItsReaderTakesIt) {
  const fs::path file = fs::temp_directory_path() / "cellcal_read_back_test";
  for (const Kind& kind : kinds()) {
    SCOPED_TRACE(kind.name);
    EXPECT_NO_THROW(put_as(kind.reader, kind.good, file));
    EXPECT_EQ(calib::read_file(file), kind.good);
    fs::remove(file);
  }
}

TEST(AFileOfEachKind, IsNotWrittenWhereItsReaderRefusesIt) {
  const fs::path file = fs::temp_directory_path() / "cellcal_read_back_refused";
  fs::remove(file);
  for (const Kind& kind : kinds())
    for (const std::string& bad :
         {std::string("\xff\xfe{\0[=", 6), std::string(calib::krl::kMostLineBytes + 1, ',')}) {
      SCOPED_TRACE(kind.name);
      try {
        put_as(kind.reader, bad, file);
        ADD_FAILURE() << "written: " << bad.substr(0, 40);
      } catch (const calib::FileError& error) {
        EXPECT_NE(std::string(error.what()).find(file.string()), std::string::npos);
        EXPECT_NE(std::string(error.what()).find("not written"), std::string::npos);
      }
      EXPECT_FALSE(fs::exists(file));
    }
}

}  // namespace
}  // namespace cellcal::daemon
