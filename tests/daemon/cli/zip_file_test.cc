// Files out of ZIP archives.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "calib/files/input_file.h"
#include "calib/model/error.h"
#include "daemon/cli/backup.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

constexpr std::size_t kMostUnzipped = 1u << 20;

std::string archive_of(const std::string& name) {
  return calib::read_file(std::filesystem::path(CELLCAL_ZIP_CORPUS) / name);
}

std::vector<ZippedFile> unzipped(const std::string& name, std::size_t most = kMostUnzipped) {
  return unzip(
      archive_of(name), name, [](std::string_view path) { return path.ends_with("t"); }, most);
}

std::string unzip_refusal(const std::string& name, std::size_t most = kMostUnzipped) {
  try {
    unzipped(name, most);
  } catch (const calib::FileError& error) {
    return error.what();
  }
  return {};
}

TEST(AnArchive, GivesTheFilesThatAreWanted) {
  const auto deflated = unzipped("deflated.zip");
  ASSERT_EQ(deflated.size(), 1U);
  EXPECT_EQ(deflated[0].path, "KRC/R1/Program/pick.dat");
  EXPECT_EQ(deflated[0].text, "DEFDAT PICK\nENDDAT\n");
  const auto stored = unzipped("stored.zip");
  ASSERT_EQ(stored.size(), 2U);
  EXPECT_EQ(stored[0].text, "$LENGTH_A=180.0\n");
}

TEST(AnArchive, HasFoldersBehindEitherSlash) {
  std::string windows = archive_of("deflated.zip");
  const std::string path = "KRC/R1/Program/pick.dat";
  for (std::size_t at = 0; (at = windows.find(path, at)) != std::string::npos;)
    windows.replace(at, path.size(), "KRC\\R1\\Program\\pick.dat");
  const auto files = unzip(
      windows, "w.zip", [&](std::string_view one) { return one == path; }, kMostUnzipped);
  ASSERT_EQ(files.size(), 1U);
  EXPECT_EQ(files[0].path, path);
}

TEST(AnArchiveThatIsDamagedOrTooLarge, IsRefusedByName) {
  for (const char* name : {"cut.zip", "outside.zip", "encrypted.zip", "method.zip", "changed.zip",
                           "count.zip", "none.zip"})
    EXPECT_EQ(unzip_refusal(name).substr(0, std::string(name).size()), name);
  EXPECT_NE(unzip_refusal("encrypted.zip").find("is encrypted"), std::string::npos);
  EXPECT_NE(unzip_refusal("changed.zip").find("damaged"), std::string::npos);
  EXPECT_NE(unzip_refusal("deflated.zip", 5).find("MB"), std::string::npos);
}

TEST(AnArchiveThatIsEmpty, SaysSoWhereverItIsGiven) {
  const TemporaryDirectory dir;
  const std::string file = dir / "backup.zip";
  std::ofstream(file).flush();
  const std::string words = file + ": empty (0 bytes). Copy it again";
  for (const auto& read : {std::function<void()>([&] { read_backup(file); }),
                           std::function<void()>([&] { read_machine_files({file}); })})
    try {
      read();
      ADD_FAILURE() << "read";
    } catch (const calib::FileError& error) {
      EXPECT_EQ(error.what(), words);
    }
}

}  // namespace
}  // namespace cellcal::daemon::testing
