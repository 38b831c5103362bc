
#include <gtest/gtest.h>

#include <fstream>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "daemon/cell_form/cell_form.h"
#include "example.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using Why = CellNotWritten::Why;

struct ACellShelf : ::testing::Test {
  std::optional<Why> refused(const std::string& name, const CellForm& of,
                             const std::string& instead_of) {
    try {
      shelf.write(name, of, instead_of);
      return std::nullopt;
    } catch (const CellNotWritten& not_written) {
      words = not_written.what();
      return not_written.why;
    }
  }

  TemporaryDirectory dir;
  CellFileStore shelf{dir / "cells"};
  CellForm form = form_from_json(example(), dir / "cells" / "weld.toml");
  std::string words;
};

TEST_F(ACellShelf, WritesACellThatLoadsAndShowsItAgain) {
  EXPECT_TRUE(shelf.names().empty());
  EXPECT_FALSE(shelf.find("weld"));
  const std::filesystem::path file = shelf.write("weld", form, "");
  EXPECT_EQ(file, dir / "cells" / "weld.toml");
  EXPECT_EQ(calib::load_cell(file).targets.size(), 3u);
  EXPECT_EQ(shelf.names(), std::vector<std::string>{"weld"});
  const auto shown = shelf.find("weld");
  ASSERT_TRUE(shown && shown->form);
  EXPECT_EQ(to_json(*shown->form), to_json(form));
  EXPECT_EQ(shown->sha256, calib::sha256(calib::read_file(file)));
}

TEST_F(ACellShelf, ReplacesOnlyWhatWasShownAndKeepsItBeside) {
  const std::filesystem::path file = shelf.write("weld", form, "");
  const std::string before = calib::read_file(file), seen = shelf.find("weld")->sha256;
  form.spheres[0].diameter_mm = 40.0;
  EXPECT_EQ(refused("weld", form, ""), Why::kThere);
  EXPECT_EQ(refused("weld", form, std::string(64, '0')), Why::kChanged);
  EXPECT_EQ(refused("other", form, seen), Why::kChanged) << "that one is gone";
  EXPECT_EQ(calib::read_file(file), before);
  EXPECT_EQ(refused("weld", form, seen), std::nullopt);
  EXPECT_EQ(calib::read_file(file.string() + ".before"), before);
  EXPECT_EQ(shelf.find("weld")->form->spheres[0].diameter_mm, 40.0);
  EXPECT_EQ(shelf.names(), std::vector<std::string>{"weld"});
}

TEST_F(ACellShelf, KeepsWhatSomebodyHasAddedByHand) {
  const std::filesystem::path file = shelf.write("weld", form, "");
  const auto plane = [](const std::filesystem::path& of) {
    return calib::load_cell(of).targets.back().kind == calib::TargetKind::kPlane;
  };
  std::ofstream(file, std::ios::app) << "[[target]]\nid = \"p\"\nkind = \"plane\"\ncentre_mm = [1, "
                                        "2, 3]\nnormal = [0, 0, 1]\n";
  const auto shown = shelf.find("weld");
  ASSERT_TRUE(shown->form);
  EXPECT_EQ(shown->kept, std::vector<std::string>{"target p"});
  EXPECT_EQ(refused("weld", form, shown->sha256), std::nullopt);
  EXPECT_TRUE(plane(file));
  EXPECT_TRUE(plane(shelf.write("copy", form, "", calib::read_file(file))))
      << "of the file that it was read of";
  std::ofstream(file) << "this is no TOML";
  EXPECT_FALSE(shelf.find("weld")->form);
  EXPECT_EQ(refused("weld", form, shelf.find("weld")->sha256), Why::kMore);
}

/// ASCII STL of one triangle.
std::string triangle(const std::string& corner, const std::string& other = "100 0 0") {
  return "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex " + other + "\nvertex " +
         corner + "\nendloop\nendfacet\nendsolid s\n";
}

TEST_F(ACellShelf, KeepsAnStlFileThatAnObstacleOfAFormNames) {
  const CellFileStore::KeptMesh kept = shelf.keep_mesh(triangle("0 50 20"), "fixture.stl");
  EXPECT_EQ(kept.triangles, 1u);
  EXPECT_EQ(kept.low_mm, (Triple{0, 0, 0}));
  EXPECT_NEAR(kept.high_mm[2], 20.0, 1e-9);
  nlohmann::json json = example();
  json["obstacles"] = {{{"id", "fixture"},
                        {"shape", "mesh"},
                        {"file", kept.file.string()},
                        {"xyz_mm", {1000, 0, 100}}}};
  form = form_from_json(json, dir / "cells" / "weld.toml");
  const std::filesystem::path file = shelf.write("weld", form, "");
  EXPECT_EQ(calib::load_cell(file).obstacles.at(0).mesh->triangles.size(), 1u);
  EXPECT_EQ(to_json(*shelf.find("weld")->form), to_json(form));
  EXPECT_EQ(shelf.names(), std::vector<std::string>{"weld"}) << "an STL file is no cell";
  std::ofstream(kept.file) << triangle("0 0.3 0.2", "0.4 0 0");
  const auto metres = fault_in(form);
  ASSERT_TRUE(metres);
  EXPECT_EQ(metres->key, "obstacles.0.file");
  EXPECT_NE(metres->words.find("0.4 x 0.3 x 0.2 mm"), std::string::npos) << metres->words;
  std::filesystem::remove(kept.file);
  EXPECT_EQ(refused("other", form, ""), Why::kUnusable) << "the arm could hit what is not there";
  EXPECT_NE(words.find("fixture"), std::string::npos) << words;
}

TEST_F(ACellShelf, RefusesWhatIsNoStlFileAndMoreThan50OfThem) {
  for (const std::string& bytes :
       {std::string(), std::string("solid"), std::string(83, '\0'), std::string(200, '\xff'),
        triangle("0 nan 0"), triangle("1e9 0 0"), std::string("<html>") + std::string(500, ' ')}) {
    try {
      (void)shelf.keep_mesh(bytes, "fixture.stl");
      ADD_FAILURE() << bytes.substr(0, 40);
    } catch (const calib::FileError& error) {
      EXPECT_NE(std::string(error.what()).find("fixture.stl"), std::string::npos) << error.what();
    }
  }
  EXPECT_FALSE(std::filesystem::exists(dir / "cells"));
  for (int k = 1; k <= 50; ++k) (void)shelf.keep_mesh(triangle("0 50 " + std::to_string(k)), "f");
  EXPECT_THROW((void)shelf.keep_mesh(triangle("0 50 51"), "f"), CellNotWritten);
  EXPECT_NO_THROW((void)shelf.keep_mesh(triangle("0 50 50"), "f")) << "it is there already";
}

TEST_F(ACellShelf, WritesNothingThatContradictsItself) {
  form.lengths[0].mm = 900.0;  // the centres are 600 mm apart
  EXPECT_EQ(refused("weld", form, ""), Why::kUnusable);
  form.lengths.clear();
  form.spheres[1].id = "S1";
  EXPECT_EQ(refused("weld", form, ""), Why::kUnusable);
  form.spheres.clear();
  EXPECT_EQ(refused("weld", form, ""), Why::kUnusable);
  EXPECT_FALSE(std::filesystem::exists(dir / "cells" / "weld.toml"));
}

TEST_F(ACellShelf, LeavesItsFolderByNoName) {
  for (const char* name : {"", "../weld", "a/b", ".", "..", "a.toml", "a b", "\n"}) {
    EXPECT_EQ(refused(name, form, ""), Why::kName) << name;
    EXPECT_THROW((void)shelf.find(name), CellNotWritten) << name;
  }
  EXPECT_EQ(refused(std::string(65, 'a'), form, ""), Why::kName);
}

TEST_F(ACellShelf, ThatCannotBeWrittenSaysSo) {
  std::ofstream(dir / "cells") << "a file where the folder should be";
  EXPECT_EQ(refused("weld", form, ""), Why::kStorage);
  EXPECT_NE(words.find("cells"), std::string::npos) << words;
  EXPECT_NE(words.find("cellcal new-cell -o"), std::string::npos) << "what to do: " << words;
}

}  // namespace
}  // namespace cellcal::daemon::testing
