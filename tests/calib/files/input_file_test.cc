// Paths other than regular files are refused before opening, without blocking or side effects.

#include "calib/files/input_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <fstream>

#include "calib/files/files.h"

namespace cellcal::calib {
namespace {

namespace fs = std::filesystem;

class ReadableFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "cellcal-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    dir_ = name;
  }
  void TearDown() override { fs::remove_all(dir_); }

  static std::string refusal(const fs::path& path, std::size_t most = 1000) {
    try {
      read_file(path, most);
      return "";
    } catch (const FileError& error) {
      EXPECT_EQ(error.file, path.string());
      return error.what();
    }
  }

  fs::path dir_;
};

TEST_F(ReadableFile, ThatIsAPipeIsRefusedWithoutWaitingForAWriter) {
  ASSERT_EQ(::mkfifo((dir_ / "p.toml").c_str(), 0600), 0);
  EXPECT_EQ(refusal(dir_ / "p.toml"), (dir_ / "p.toml").string() + ": is a pipe; name a file");
  EXPECT_THROW(load_cell(dir_ / "p.toml"), FileError);
  fs::create_symlink(dir_ / "p.toml", dir_ / "link.toml");
  EXPECT_NE(refusal(dir_ / "link.toml").find("is a pipe"), std::string::npos);
}

TEST_F(ReadableFile, ThatIsADeviceOrASocketIsRefused) {
  EXPECT_NE(refusal("/dev/zero").find("is a device"), std::string::npos) << refusal("/dev/zero");
  EXPECT_NE(refusal("/dev/null").find("is a device"), std::string::npos);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, (dir_ / "s").c_str(), sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  EXPECT_NE(refusal(dir_ / "s").find("is a socket"), std::string::npos);
  ::close(fd);
}

TEST_F(ReadableFile, ThatIsTooLargeIsRefusedByItsSizeAlone) {
  std::ofstream(dir_ / "large") << "x";
  fs::resize_file(dir_ / "large", std::uintmax_t{1} << 40);  // sparse: occupies no disk space
  EXPECT_NE(refusal(dir_ / "large").find("larger than 1000 bytes"), std::string::npos);
}

TEST_F(ReadableFile, ThatIsWithheldIsRefusedUnderAnyNameAndItsLockStays) {
  std::ofstream(dir_ / "journal.db") << "rows";
  fs::create_hard_link(dir_ / "journal.db", dir_ / "cell.toml");
  fs::create_symlink(dir_ / "journal.db", dir_ / "other.toml");
  const int fd = ::open((dir_ / "journal.db").c_str(), O_RDWR);
  struct flock lock {};
  lock.l_type = F_WRLCK;
  ASSERT_EQ(::fcntl(fd, F_SETLK, &lock), 0);
  {
    const Withheld journal(dir_ / "journal.db");
    for (const char* name : {"journal.db", "cell.toml", "other.toml"}) {
      EXPECT_NE(refusal(dir_ / name).find("is the journal of this daemon"), std::string::npos)
          << name;
    }
    // An open file description treats the process's own POSIX lock as another's.
    const int other = ::open((dir_ / "journal.db").c_str(), O_RDWR);
    struct flock seen {};
    seen.l_type = F_WRLCK;
    ASSERT_EQ(::fcntl(other, F_OFD_GETLK, &seen), 0);
    EXPECT_EQ(seen.l_type, F_WRLCK) << "the lock is still there";
    ::close(other);
  }
  ::close(fd);
  EXPECT_EQ(read_file(dir_ / "cell.toml"), "rows") << "no longer withheld";
}

TEST(Sha256Text, IsSixtyFourLowerCaseHexadecimalDigits) {
  const std::string one = sha256("");
  EXPECT_TRUE(is_sha256(one));
  EXPECT_FALSE(is_sha256(one + "0"));
  EXPECT_FALSE(is_sha256(one.substr(1)));
  EXPECT_FALSE(is_sha256("E" + one.substr(1)));
  EXPECT_FALSE(is_sha256(""));
}

}  // namespace
}  // namespace cellcal::calib
