
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

struct a_cell_shelf : ::testing::Test {
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

TEST_F(a_cell_shelf, writes_a_cell_that_loads_and_shows_it_again) {
  EXPECT_TRUE(shelf.names().empty());
  EXPECT_FALSE(shelf.look("weld"));
  const std::filesystem::path file = shelf.write("weld", form, "");
  EXPECT_EQ(file, dir / "cells" / "weld.toml");
  EXPECT_EQ(calib::load_cell(file).targets.size(), 3u);
  EXPECT_EQ(shelf.names(), std::vector<std::string>{"weld"});
  const auto shown = shelf.look("weld");
  ASSERT_TRUE(shown && shown->form);
  EXPECT_EQ(to_json(*shown->form), to_json(form));
  EXPECT_EQ(shown->sha256, calib::sha256(calib::read_file(file)));
}

TEST_F(a_cell_shelf, replaces_only_what_was_shown_and_keeps_it_beside) {
  const std::filesystem::path file = shelf.write("weld", form, "");
  const std::string before = calib::read_file(file), seen = shelf.look("weld")->sha256;
  form.spheres[0].diameter_mm = 40.0;
  EXPECT_EQ(refused("weld", form, ""), Why::kThere);
  EXPECT_EQ(refused("weld", form, std::string(64, '0')), Why::kChanged);
  EXPECT_EQ(refused("other", form, seen), Why::kChanged) << "that one is gone";
  EXPECT_EQ(calib::read_file(file), before);
  EXPECT_EQ(refused("weld", form, seen), std::nullopt);
  EXPECT_EQ(calib::read_file(file.string() + ".before"), before);
  EXPECT_EQ(shelf.look("weld")->form->spheres[0].diameter_mm, 40.0);
  EXPECT_EQ(shelf.names(), std::vector<std::string>{"weld"});
}

TEST_F(a_cell_shelf, keeps_what_somebody_has_added_by_hand) {
  const std::filesystem::path file = shelf.write("weld", form, "");
  std::ofstream(file, std::ios::app)
      << "[[obstacle]]\nid = \"t\"\nshape = \"box\"\nsize_mm = [1, 1, 1]\nxyz_mm = [0, 0, 0]\n";
  const auto shown = shelf.look("weld");
  ASSERT_TRUE(shown->form);
  EXPECT_EQ(shown->kept, std::vector<std::string>{"obstacle t"});
  EXPECT_EQ(refused("weld", form, shown->sha256), std::nullopt);
  EXPECT_EQ(calib::load_cell(file).obstacles.size(), 1u);
  const std::filesystem::path copy = shelf.write("copy", form, "", file);
  EXPECT_EQ(calib::load_cell(copy).obstacles.size(), 1u) << "of the file that it was read of";
  std::ofstream(file) << "this is no TOML";
  EXPECT_FALSE(shelf.look("weld")->form);
  EXPECT_EQ(refused("weld", form, shelf.look("weld")->sha256), Why::kMore);
}

TEST_F(a_cell_shelf, writes_nothing_that_contradicts_itself) {
  form.lengths[0].mm = 900.0;  // the centres are 600 mm apart
  EXPECT_EQ(refused("weld", form, ""), Why::kUnusable);
  form.lengths.clear();
  form.spheres[1].id = "S1";
  EXPECT_EQ(refused("weld", form, ""), Why::kUnusable);
  form.spheres.clear();
  EXPECT_EQ(refused("weld", form, ""), Why::kUnusable);
  EXPECT_FALSE(std::filesystem::exists(dir / "cells" / "weld.toml"));
}

TEST_F(a_cell_shelf, leaves_its_folder_by_no_name) {
  for (const char* name : {"", "../weld", "a/b", ".", "..", "a.toml", "a b", "\n"}) {
    EXPECT_EQ(refused(name, form, ""), Why::kName) << name;
    EXPECT_THROW((void)shelf.look(name), CellNotWritten) << name;
  }
  EXPECT_EQ(refused(std::string(65, 'a'), form, ""), Why::kName);
}

TEST_F(a_cell_shelf, that_cannot_be_written_says_so) {
  std::ofstream(dir / "cells") << "a file where the folder should be";
  EXPECT_EQ(refused("weld", form, ""), Why::kStorage);
  EXPECT_NE(words.find("cells"), std::string::npos) << words;
  EXPECT_NE(words.find("cellcal new-cell -o"), std::string::npos) << "what to do: " << words;
}

}  // namespace
}  // namespace cellcal::daemon::testing
