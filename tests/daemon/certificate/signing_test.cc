// Signatures of files, and every way to invalidate them.

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <optional>

#include "calib/files/input_file.h"
#include "daemon/certificate/signed_files.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::signing {
namespace {

using daemon::testing::TemporaryDirectory;
using Why = NotVerified::Why;
namespace fs = std::filesystem;

void write(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::string refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const KeyError& error) {
    return error.what();
  }
  return "";
}

struct SignedFiles : ::testing::Test {
  SignedFiles() {
    make_key(dir / "k");
    make_key(dir / "other");
    fs::create_directory(dir / "c");
    write(dir / "c/a.html", "<p>0.096 mm</p>");
    write(dir / "c/a.pdf", std::string("%PDF\0\xFF", 6));
    sign_files(dir / "c", {"a.html", "a.pdf"},
               {"7-abc", "Q. Auditor\n# key: 0", "2026-04-02T08:00:00.000Z", ""},
               PrivateKey(dir / "k"));
  }
  /// The reason; empty: the files are as signed.
  std::optional<Why> verify(const std::string& what, const std::string& key = "k.pub") {
    try {
      const Verified verified = verify_files(dir / what, PublicKey(dir / key));
      EXPECT_EQ(verified.statement.certificate, "7-abc");
      return std::nullopt;
    } catch (const NotVerified& error) {
      EXPECT_NE(std::string(error.what()).find(dir.path().string()), std::string::npos);
      return error.why;
    }
  }
  std::string words(const std::string& what) {
    try {
      verify_files(dir / what, PublicKey(dir / "k.pub"));
    } catch (const NotVerified& error) {
      return error.what();
    }
    return "";
  }
  /// Changes every byte of the file, one at a time.
  void expect_each_byte_counts(const std::string& name, const std::string& verified_by) {
    const std::string whole = calib::read_file(dir / name);
    for (std::size_t i = 0; i < whole.size(); ++i) {
      std::string other = whole;
      other[i] = static_cast<char>(other[i] ^ 1);
      write(dir / name, other);
      EXPECT_NE(verify(verified_by), std::nullopt) << name << " byte " << i;
    }
    write(dir / name, whole.substr(0, whole.size() - 1));
    EXPECT_NE(verify(verified_by), std::nullopt);
    write(dir / name, whole + "\n");
    EXPECT_NE(verify(verified_by), std::nullopt);
    write(dir / name, whole);
    EXPECT_EQ(verify(verified_by), std::nullopt);
  }

  TemporaryDirectory dir;
};

TEST_F(SignedFiles, SayWhoAndWhenAndAreAllVerified) {
  const Verified verified = verify_files(dir / "c", PublicKey(dir / "k.pub"));
  EXPECT_EQ(verified.files, (std::vector<std::string>{"a.html", "a.pdf"}));
  EXPECT_EQ(verified.statement.by, "Q. Auditor # key: 0");  // in one line, for any name
  EXPECT_EQ(verified.statement.utc, "2026-04-02T08:00:00.000Z");
  EXPECT_EQ(verified.statement.key, PublicKey(dir / "k.pub").fingerprint());
  EXPECT_EQ(verify_files(dir / "c/a.pdf", PublicKey(dir / "k.pub")).files,
            std::vector<std::string>{"a.pdf"});
}

TEST_F(SignedFiles, AreVerifiedByOpensslAndSha256sumAlone) {
  const std::string at = "cd '" + dir.path().string() + "/c' && ";
  EXPECT_EQ(
      std::system(
          (at +
           "openssl pkeyutl -verify -pubin -inkey ../k.pub -rawin -in certificate.sums -sigfile "
           "certificate.sums.sig > /dev/null && sha256sum --quiet --strict -c certificate.sums")
              .c_str()),
      0);
  EXPECT_NE(
      std::system(
          (at +
           "openssl pkeyutl -verify -pubin -inkey ../other.pub -rawin -in certificate.sums -sigfile "
           "certificate.sums.sig > /dev/null 2>&1")
              .c_str()),
      0);
}

TEST_F(SignedFiles, OfAnExportHaveNamesOfTheirOwnAndAreVerifiedLikewise) {
  fs::create_directory(dir / "x");
  write(dir / "x/rows.jsonl", "{}");
  const Statement statement{"export of session 7", "anna", "2026-04-02T08:00:00.000Z", ""};
  sign_files(dir / "x", {"rows.jsonl"}, statement, PrivateKey(dir / "k"), Kind::kExport);
  EXPECT_TRUE(has_signature(dir / "x", Kind::kExport));
  EXPECT_FALSE(has_signature(dir / "x", Kind::kCertificate));
  const Verified verified = verify_files(dir / "x", PublicKey(dir / "k.pub"));
  EXPECT_EQ(verified.kind, Kind::kExport);
  EXPECT_EQ(verified.statement.certificate, "export of session 7");
  EXPECT_EQ(verify("c"), std::nullopt) << "a certificate's";
  EXPECT_THROW(verify_files(dir / "c", PublicKey(dir / "k.pub"), Kind::kExport), NotVerified);
  write(dir / "x/rows.jsonl", "[]");
  EXPECT_THROW(verify_files(dir / "x", PublicKey(dir / "k.pub")), NotVerified);
}

TEST_F(SignedFiles, ThatWereChangedAreToldFromOthers) {
  write(dir / "c/a.html", "<p>0.095 mm</p>");
  EXPECT_EQ(verify("c/a.html"), Why::kChangedFile);
  EXPECT_EQ(verify("c"), Why::kChangedFile);
  EXPECT_EQ(verify("c/a.pdf"), std::nullopt);
  write(dir / "c/b.html", "<p>");
  EXPECT_EQ(verify("c/b.html"), Why::kNotListed);
  fs::rename(dir / "c/a.pdf", dir / "c/renamed.pdf");
  EXPECT_EQ(verify("c/renamed.pdf"), std::nullopt);
  write(dir / "c/a.html", "<p>0.096 mm</p>");
  EXPECT_EQ(verify("c"), Why::kMissingFile);
  EXPECT_THROW(verify("c/nothing"), std::runtime_error);
}

TEST_F(SignedFiles, WithOneMoreAmongThemAreNotVerifiedAndItIsNamed) {
  write(dir / "c/certificate.pdf", "%PDF forged");
  EXPECT_EQ(verify("c"), Why::kNotListed);
  EXPECT_NE(words("c").find("certificate.pdf"), std::string::npos);
  EXPECT_EQ(verify("c/a.pdf"), std::nullopt);
  fs::remove(dir / "c/certificate.pdf");
  EXPECT_EQ(verify("c"), std::nullopt);
  fs::copy_file(dir / "c/a.pdf", dir / "c/b\x1b[2J.pdf");  // nor an identical copy
  EXPECT_EQ(verify("c"), Why::kNotListed);
  EXPECT_EQ(words("c").find('\x1b'), std::string::npos);
  fs::remove(dir / "c/b\x1b[2J.pdf");
  fs::create_directory(dir / "c/more");
  EXPECT_EQ(verify("c"), Why::kNotListed);
}

TEST_F(SignedFiles, AreEachHeldAgainstTheirOwnSum) {
  const auto only_the_page_is_copied = fs::copy_options::overwrite_existing;
  fs::copy_file(dir / "c/a.html", dir / "c/a.pdf", only_the_page_is_copied);
  EXPECT_EQ(verify("c"), Why::kChangedFile);
  EXPECT_EQ(verify("c/a.pdf"), Why::kChangedFile);
  EXPECT_EQ(verify("c/a.html"), std::nullopt);
}

TEST_F(SignedFiles, ThatWereRenamedAreToldByTheNameThatWasSigned) {
  fs::rename(dir / "c/a.pdf", dir / "c/b.html");
  EXPECT_EQ(verify_files(dir / "c/b.html", PublicKey(dir / "k.pub")).files,
            std::vector<std::string>{"a.pdf"});
}

TEST_F(SignedFiles, HavePlainNamesEachOnce) {
  const PrivateKey key(dir / "k");
  const std::string good = calib::read_file(dir / "c" / kSums),
                    sum = calib::sha256(calib::read_file(dir / "c/a.html"));
  write(dir / "b.html", "<p>0.096 mm</p>");
  for (const std::string& name :
       {std::string("../b.html"), std::string("/etc/hosts"), std::string("."), std::string(".."),
        std::string("a\x1b[2Jb"), std::string("a.html"), std::string(kSums),
        std::string(kSignature)}) {
    const std::string text = good + sum + "  " + name + "\n";
    write(dir / "c" / kSums, text);
    write(dir / "c" / kSignature, key.sign(text));
    EXPECT_EQ(verify("c"), Why::kDamagedSignature) << name;
  }
}

TEST_F(SignedFiles, OfAnotherKeyAreToldFromDamagedOnes) {
  EXPECT_EQ(verify("c", "other.pub"), Why::kOtherKey);
  // Another key's signature, claimed to be of the expected key.
  const std::string text = calib::read_file(dir / "c" / kSums);
  write(dir / "c" / kSignature, PrivateKey(dir / "other").sign(text));
  EXPECT_EQ(verify("c"), Why::kDamagedSignature);
}

TEST_F(SignedFiles, AreNotVerifiedWithAnyByteChanged) {
  expect_each_byte_counts(std::string("c/") + kSums, "c");
  expect_each_byte_counts(std::string("c/") + kSignature, "c/a.html");
}

TEST_F(SignedFiles, WithoutASignatureSaySo) {
  fs::remove(dir / "c" / kSignature);
  EXPECT_EQ(verify("c"), Why::kNoSignature);
  fs::remove(dir / "c" / kSums);
  EXPECT_EQ(verify("c/a.html"), Why::kNoSignature);
}

TEST_F(SignedFiles, AreNotLookedForOutsideOfTheirDirectory) {
  write(dir / "c" / kSums, "# cellcal.signature/1\n# key: " + std::string(64, '0') + "\n" +
                               std::string(64, 'a') + "  ../k\n");
  EXPECT_EQ(verify("c"), Why::kDamagedSignature);
  for (const char* text : {"", "x", "# cellcal.signature/1\n", "# cellcal.signature/2\n# key: 0\n",
                           "# cellcal.signature/1\nfoo\n"}) {
    write(dir / "c" / kSums, text);
    EXPECT_EQ(verify("c"), Why::kDamagedSignature) << text;
  }
}

TEST_F(SignedFiles, NeedAKeyThatOnlyItsOwnerMayReadAndThatIsNeverWrittenOver) {
  struct stat status {};
  ASSERT_EQ(::stat((dir / "k").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777U, 0600U);
  const std::string before = calib::read_file(dir / "k");
  EXPECT_NE(refusal([&] { make_key(dir / "k"); }).find("never overwritten"), std::string::npos);
  fs::remove(dir / "other");  // its public part still exists
  EXPECT_NE(refusal([&] { make_key(dir / "other"); }).find("other.pub: exists"), std::string::npos);
  fs::create_symlink(dir / "nowhere", dir / "link");
  EXPECT_NE(refusal([&] { make_key(dir / "link"); }), "");
  EXPECT_EQ(calib::read_file(dir / "k"), before);
  for (const mode_t mode : {0640U, 0604U, 0660U, 0610U, 0601U}) {
    ::chmod((dir / "k").c_str(), mode);
    EXPECT_NE(refusal([&] { PrivateKey key(dir / "k"); }).find("Set 0600"), std::string::npos)
        << mode;
  }
  ::chmod((dir / "k").c_str(), 0400);
  EXPECT_EQ(refusal([&] { PrivateKey key(dir / "k"); }), "");
}

TEST_F(SignedFiles, AreNotToBeMadeWithOtherRightsWhereRightsDoNotHelp) {
  const std::string words = refusal([&] { make_key(dir / std::string(300, 'k')); });
  EXPECT_NE(words.find("File name too long. Choose another place: --key FILE"), std::string::npos)
      << words;
  EXPECT_NE(refusal([&] { make_key(dir / "no/k"); }).find("Create the folder "), std::string::npos);
}

TEST_F(SignedFiles, HaveNoKeyOnAReadOnlyFileSystemWhichRightsDoNotChange) {
  enum { kAdvised, kOtherwise, kNotPermitted };
  fs::create_directory(dir / "disk");
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const bool mounted = ::unshare(CLONE_NEWNS | (::geteuid() == 0 ? 0 : CLONE_NEWUSER)) == 0 &&
                         ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
                         ::mount("none", (dir / "disk").c_str(), "tmpfs", MS_RDONLY, nullptr) == 0;
    const std::string words = mounted ? refusal([&] { make_key(dir / "disk/k"); }) : "";
    const bool advised = words.ends_with("Read-only file system. Choose another place: --key FILE");
    ::_exit(!mounted ? kNotPermitted : advised ? kAdvised : kOtherwise);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == kNotPermitted) GTEST_SKIP() << "mounting is not permitted here";
  EXPECT_EQ(WEXITSTATUS(status), kAdvised);
}

TEST_F(SignedFiles, HaveBothPartsOfAKeyOrNone) {
  const fs::path key = dir / std::string(253, 'k');  // 255 bytes are permitted, without ".pub"
  EXPECT_NE(refusal([&] { make_key(key); }).find("File name too long"), std::string::npos);
  EXPECT_FALSE(fs::exists(key));
}

TEST_F(SignedFiles, GoWithoutAKeyOnlyWhereThereIsNone) {
  EXPECT_FALSE(key_if_there(dir / "nothing"));
  EXPECT_FALSE(key_if_there(dir / "nothing/k"));
  ASSERT_TRUE(key_if_there(dir / "k"));
  EXPECT_EQ(key_if_there(dir / "k")->fingerprint(), PublicKey(dir / "k.pub").fingerprint());
  fs::create_symlink("loop", dir / "loop");
  EXPECT_NE(refusal([&] { key_if_there(dir / "loop/k"); }).find("loop/k: cannot be accessed: "),
            std::string::npos);
  fs::create_symlink(dir / "nowhere", dir / "dangling");
  EXPECT_NE(refusal([&] { key_if_there(dir / "dangling"); }).find("dangling"), std::string::npos);
}

TEST_F(SignedFiles, NeedAKeyOfTheirKind) {
  const std::string at = "cd '" + dir.path().string() + "' && umask 077 && ";
  ASSERT_EQ(
      std::system(
          (at +
           "openssl genpkey -algorithm ed25519 -out plain && openssl pkey -in plain -pubout -out plain.pub && "
           "openssl genpkey -algorithm x25519 -out x && openssl pkey -in x -pubout -out x.pub && "
           "openssl pkey -in plain -aes256 -passout pass:secret -out locked")
              .c_str()),
      0);
  EXPECT_EQ(PrivateKey(dir / "plain").fingerprint(), PublicKey(dir / "plain.pub").fingerprint());
  write(dir / "rubbish", "-----BEGIN PRIVATE KEY-----\nAAAA\n-----END PRIVATE KEY-----\n");
  write(dir / "large", std::string(100000, 'x'));
  for (const char* name : {"x", "locked", "rubbish", "large"}) {
    ::chmod((dir / name).c_str(), 0600);
    EXPECT_NE(refusal([&] { PrivateKey key(dir / name); }).find(name), std::string::npos) << name;
  }
  for (const char* name : {"x.pub", "plain", "rubbish", "large", "nothing"})
    EXPECT_NE(refusal([&] { PublicKey key(dir / name); }).find(name), std::string::npos) << name;
  fs::create_directory(dir / "folder");
  EXPECT_NE(refusal([&] { PrivateKey key(dir / "folder"); }), "");
}

}  // namespace
}  // namespace cellcal::daemon::signing
