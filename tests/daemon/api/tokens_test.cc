#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <set>
#include <sstream>

#include "daemon/api/access.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon {
namespace {

using testing::TemporaryDirectory;

constexpr const char* kNow = "2026-01-01T00:00:00Z";

std::string content(const std::filesystem::path& path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

void write(const std::filesystem::path& path, const std::string& text, mode_t mode = 0600) {
  std::ofstream(path) << text;
  ::chmod(path.c_str(), mode);
}

TEST(Tokens, AreKnownAgainBehindARestartAndNotAfterTheyWereRemoved) {
  const TemporaryDirectory dir;
  std::string wall, office;
  {
    TokenStore tokens(dir / "t");
    wall = tokens.add("wall-screen", Role::kView, kNow);
    office = tokens.add("office", Role::kOperate, kNow);
    EXPECT_NE(wall, office);
    EXPECT_EQ(tokens.find(wall)->name, "wall-screen");
  }
  TokenStore tokens(dir / "t");
  EXPECT_EQ(tokens.problem(), "");
  EXPECT_EQ(tokens.find(office)->role, Role::kOperate);
  EXPECT_TRUE(tokens.remove("office"));
  EXPECT_FALSE(tokens.remove("office"));
  EXPECT_FALSE(tokens.find(office));
  EXPECT_FALSE(TokenStore(dir / "t").find(office));
  EXPECT_TRUE(TokenStore(dir / "t").find(wall));
}

TEST(Tokens, AreNotInTheirFileWhichOnlyItsOwnerReads) {
  const TemporaryDirectory dir;
  write(dir / "t.part", "left by a dead one", 0666);
  TokenStore tokens(dir / "t");
  const std::string secret = tokens.add("a", Role::kView, kNow);
  EXPECT_EQ(content(dir / "t").find(secret), std::string::npos);
  struct stat info {};
  ASSERT_EQ(::stat((dir / "t").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
}

TEST(Tokens, AreOf256BitsAndNeverTwiceTheSame) {
  std::set<std::string> seen;
  for (int i = 0; i < 1000; ++i) {
    const std::string one = random_secret();
    EXPECT_EQ(one.size(), 64u);
    EXPECT_TRUE(seen.insert(one).second);
  }
}

TEST(Tokens, NeedANameOfTheirOwn) {
  const TemporaryDirectory dir;
  TokenStore tokens(dir / "t");
  tokens.add("a", Role::kView, kNow);
  EXPECT_THROW(tokens.add("a", Role::kOperate, kNow), TokenError);
  for (const std::string& name :
       {std::string(), std::string("a b"), std::string("a/b"), std::string("a\n"),
        std::string("\xc3\xa4"), std::string(65, 'a')}) {
    EXPECT_THROW(tokens.add(name, Role::kView, kNow), TokenError) << name;
  }
  EXPECT_EQ(tokens.list().size(), 1u);
}

TEST(Tokens, AreNotNamedAsThoseWhoComeOverTheUnixSocket) {
  TemporaryDirectory dir;
  TokenStore tokens(dir / "t.json");
  EXPECT_THROW(tokens.add("local", Role::kAdminister, "t"), TokenError);
}

TEST(Tokens, OfAFileThatIsDamagedAreNotAcceptedAndTheFileIsKept) {
  const TemporaryDirectory dir;
  std::string good;
  std::string secret;
  {
    TokenStore tokens(dir / "t");
    secret = tokens.add("a", Role::kAdminister, kNow);
    good = content(dir / "t");
  }
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  std::vector<std::string> damaged{"",
                                   "{",
                                   "[]",
                                   "null",
                                   "7",
                                   good + "x",
                                   with("cellcal.tokens/1", "cellcal.tokens/9"),
                                   with("administer", "root"),
                                   with("\"a\"", "\"a b\""),
                                   with("\"created\"", "\"made\""),
                                   with("\"sha256\": \"", "\"sha256\": \"x"),
                                   std::string(2u << 20, '['),
                                   "\xff\xfe",
                                   std::string(5, '\0')};
  for (std::size_t cut = 1; cut + 2 < good.size(); cut += 7) damaged.push_back(good.substr(0, cut));
  for (const std::string& text : damaged) {
    write(dir / "t", text);
    TokenStore tokens(dir / "t");
    EXPECT_NE(tokens.problem().find((dir / "t").string()), std::string::npos) << text.substr(0, 99);
    EXPECT_FALSE(tokens.find(secret));
    EXPECT_THROW(tokens.add("b", Role::kView, kNow), TokenError);
    EXPECT_EQ(content(dir / "t"), text);
  }
}

TEST(Tokens, OfAFileThatOthersCanReadOrWriteAreNotAccepted) {
  const TemporaryDirectory dir;
  std::string secret;
  { secret = TokenStore(dir / "t").add("a", Role::kAdminister, kNow); }
  for (const mode_t mode : {0640, 0604, 0620, 0602, 0666}) {
    ::chmod((dir / "t").c_str(), mode);
    TokenStore tokens(dir / "t");
    EXPECT_NE(tokens.problem().find("chmod 600"), std::string::npos) << mode;
    EXPECT_FALSE(tokens.find(secret)) << mode;
  }
}

}  // namespace
}  // namespace cellcal::daemon
