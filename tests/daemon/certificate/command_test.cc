// 'cellcal certificate' and 'cellcal verify' as subprocesses.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/files/input_file.h"
#include "daemon/certificate/signed_files.h"
#include "tests/daemon/certificate/recorded.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

struct TheCertificateCommand : ::testing::Test {
  TheCertificateCommand() {
    write_archive(recorded().second, dir / "e");
    signing::make_key(dir / "k");
    sign_export("e", "k");
  }
  /// Like 'cellcal export'.
  void sign_export(const std::string& directory, const std::string& key) const {
    std::vector<std::string> names;
    for (const auto& file : std::filesystem::directory_iterator(dir / directory))
      names.push_back(file.path().filename());
    signing::sign_files(dir / directory, names,
                        {"export of session 1", "cell 4", "2026-04-01T00:00:00.000Z", ""},
                        signing::PrivateKey(dir / key), signing::Kind::kExport);
  }
  /// An export of a session, signed by its recorder.
  void export_of(const Recording& what, const std::string& directory) const {
    const TemporaryDirectory of_journal;
    Journal journal(of_journal / "j.db");
    write_archive(make_archive(journal, record(journal, what, false), dir / "none"),
                  dir / directory);
    sign_export(directory, "k");
  }
  Outcome certify(std::vector<std::string> more) {
    more.insert(more.begin(), {CELLCAL, "certificate", dir / "e", "--no-pdf"});
    return run_program(more);
  }
  Outcome verify(const std::string& what, const std::string& key) {
    return run_program({CELLCAL, "verify", dir / what, "--key", dir / key, "--json"});
  }
  TemporaryDirectory dir;
};

TEST_F(TheCertificateCommand, WritesASignedOneFromAnExportThatVerifyTakesUntilItIsChanged) {
  ASSERT_EQ(run_program({CELLCAL, "certificate", "--make-key", "--key", dir / "other"}).status, 0);
  EXPECT_EQ(run_program({CELLCAL, "certificate", "--make-key", "--key", dir / "k"}).status, 1);
  const Outcome made =
      certify({"--key", dir / "k", "--out", dir / "c", "--issued-by", "Q. Auditor", "--json"});
  ASSERT_EQ(made.status, 0) << made.err;
  const auto printed = nlohmann::json::parse(made.out);
  EXPECT_TRUE(printed["signed"]);
  const Outcome verified = verify("c", "k.pub");
  ASSERT_EQ(verified.status, 0) << verified.err;
  const auto is = nlohmann::json::parse(verified.out);
  EXPECT_EQ(is["certificate"], printed["number"]);
  EXPECT_EQ(is["signed_by"], "Q. Auditor");
  EXPECT_EQ(is["emulated"], false);
  EXPECT_EQ(is["files"].size(), 4u);

  EXPECT_EQ(certify({"--key", dir / "k", "--out", dir / "c"}).status, 1)
      << "nothing is written over";
  EXPECT_EQ(verify("c", "other.pub").status, 3);
  EXPECT_EQ(nlohmann::json::parse(verify("c", "other.pub").out)["failure"], "other_key");
  EXPECT_EQ(verify("c", "nothing.pub").status, 1);
  std::ofstream(dir / "c/certificate.html", std::ios::app) << " ";
  const Outcome changed = verify("c/certificate.html", "k.pub");
  EXPECT_EQ(changed.status, 3);
  EXPECT_EQ(nlohmann::json::parse(changed.out)["failure"], "changed_file");
  EXPECT_EQ(changed.err.find("cellcal verify: "), 0u);
}

TEST_F(TheCertificateCommand, AndVerifySayWhatIsMissingForASignatureAndWhatToDo) {
  EXPECT_EQ(certify({"--no-sign", "--out", dir / "unsigned"}).status, 0);
  EXPECT_EQ(certify({"--key", dir / "k", "--out", dir / "c"}).status, 0);
  const Outcome not_signed = verify("unsigned", "nothing.pub");
  EXPECT_EQ(not_signed.status, 1);
  EXPECT_NE(not_signed.err.find("certificate.sums: is missing: not signed"), std::string::npos)
      << not_signed.err;
  EXPECT_EQ(nlohmann::json::parse(not_signed.out)["failure"], "no_signature");
  const std::string no_file = ": No such file or directory. ";
  EXPECT_EQ(verify("c", "nothing.pub").err, "cellcal verify: " + (dir / "nothing.pub").string() +
                                                no_file +
                                                "Give the signer's public key: --key FILE.pub\n");
  EXPECT_EQ(run_program({CELLCAL, "certificate", "--make-key", "--key", dir / "etc/k"}).err,
            "cellcal certificate: " + (dir / "etc/k").string() + no_file + "Create the folder " +
                (dir / "etc").string() + ", or choose another place: --key FILE\n");
}

TEST_F(TheCertificateCommand, WritesTheDocumentInTheLanguageAskedFor) {
  const Outcome made = certify({"--language", "de", "--no-sign", "--out", dir / "c"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_TRUE(std::filesystem::exists(dir / "c/certificate.de.html"));
  EXPECT_FALSE(std::filesystem::exists(dir / "c/certificate.html"));
  EXPECT_NE(calib::read_file(dir / "c/certificate.de.html").find("Kalibrierschein"),
            std::string::npos);
  EXPECT_NE(calib::read_file(dir / "c/certificate.json").find("scatter of a touch"),
            std::string::npos);
}

TEST_F(TheCertificateCommand, OfAnEmulatedCellIsNamedByVerify) {
  export_of({.emulated = true}, "m");
  ASSERT_EQ(run_program({CELLCAL, "certificate", dir / "m", "--no-pdf", "--key", dir / "k", "--out",
                         dir / "c"})
                .status,
            0);
  const auto is = nlohmann::json::parse(verify("c/certificate.html", "k.pub").out);
  EXPECT_EQ(is["emulated"], true);
  EXPECT_TRUE(is["certificate"].get<std::string>().starts_with("emulated-")) << is;
  const Outcome checked = run_program({CELLCAL, "verify", dir / "c", "--key", dir / "k.pub"});
  EXPECT_NE(checked.out.find("emulated cell: a simulation, no real robot was touched"),
            std::string::npos)
      << checked.out;
}

TEST_F(TheCertificateCommand, WritesNothingWhereTheKeyCannotBeUsed) {
  std::ofstream(dir / "n") << "no key";
  EXPECT_EQ(certify({"--key", dir / "n", "--out", dir / "c"}).status, 1);
  EXPECT_FALSE(std::filesystem::exists(dir / "c"));
  ::setenv("CELLCAL_KEY", (dir / "nothing").c_str(), 1);
  const Outcome without = certify({"--out", dir / "c"});
  ::unsetenv("CELLCAL_KEY");
  EXPECT_EQ(without.status, 1) << without.out;
  EXPECT_NE(without.err.find(dir / "nothing"), std::string::npos) << without.err;
  EXPECT_FALSE(std::filesystem::exists(dir / "c"));
  ASSERT_EQ(certify({"--no-sign", "--out", dir / "c"}).status, 0);
  EXPECT_EQ(run_program({CELLCAL, "certificate", "--make-key", "--key", dir / "q"}).status, 0);
  EXPECT_EQ(verify("c", "q.pub").status, 1);
  EXPECT_EQ(nlohmann::json::parse(verify("c", "q.pub").out)["failure"], "no_signature");
}

TEST_F(TheCertificateCommand, SignsTheOtherFilesWhereThePdfFails) {
  std::filesystem::create_directory(dir / "bin");
  std::ofstream(dir / "bin/weasyprint") << "#!/bin/sh\nexit 1\n";
  std::filesystem::permissions(dir / "bin/weasyprint", std::filesystem::perms::owner_all);
  const std::string path = std::getenv("PATH");
  const auto issue = [&] {
    ::setenv("PATH", (dir / "bin").c_str(), 1);
    Outcome outcome =
        run_program({CELLCAL, "certificate", dir / "e", "--key", dir / "k", "--out", dir / "c"});
    ::setenv("PATH", path.c_str(), 1);
    return outcome;
  };
  const Outcome made = issue();
  EXPECT_EQ(made.status, 1);
  EXPECT_NE(made.err.find("weasyprint failed"), std::string::npos) << made.err;
  EXPECT_NE(made.err.find("signed without it"), std::string::npos) << made.err;
  const Outcome verified = verify("c", "k.pub");
  EXPECT_EQ(verified.status, 0) << verified.err;
  EXPECT_EQ(nlohmann::json::parse(verified.out)["files"].size(), 4u);
  const Outcome again = issue();
  EXPECT_EQ(again.status, 1);
  EXPECT_NE(
      again.err.find("contains a signed certificate. Choose another directory with --out DIR"),
      std::string::npos)
      << again.err;
}

TEST_F(TheCertificateCommand, RefusesWhatWasWithheldOrUpdatedOrNotDoneWithStatus3AndWrongUseWith2) {
  Journal journal(dir / "j.db");
  const std::int64_t id = record(journal, {.publish = false}, false);
  write_archive(make_archive(journal, id, dir / "none"), dir / "w");
  const Outcome withheld = run_program({CELLCAL, "certificate", dir / "w", "--out", dir / "c"});
  EXPECT_EQ(withheld.status, 3);
  EXPECT_NE(withheld.err.find("withheld"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(dir / "c"));
  const std::int64_t update = record(journal, {.stands_on = "session 1 of 2026-03-29"}, false);
  write_archive(make_archive(journal, update, dir / "none"), dir / "u");
  const Outcome updated = run_program({CELLCAL, "certificate", dir / "u", "--out", dir / "c"});
  EXPECT_EQ(updated.status, 3);
  EXPECT_NE(updated.err.find("For a certificate run a full session"), std::string::npos);
  const std::int64_t stopped = record(journal, {.ending = Ending::kAborted}, false);
  write_archive(make_archive(journal, stopped, dir / "none"), dir / "s");
  EXPECT_EQ(run_program({CELLCAL, "certificate", dir / "s", "--out", dir / "c"}).status, 3);
  EXPECT_FALSE(std::filesystem::exists(dir / "c"));
  EXPECT_EQ(run_program({CELLCAL, "certificate"}).status, 2);
  EXPECT_EQ(run_program({CELLCAL, "certificate", "7", "--make-key"}).status, 2);
}

TEST_F(TheCertificateCommand, CertifiesNothingThatDoesNotComeOutAgainToTheBit) {
  export_of({.forged_publish = true, .fit = 9}, "withheld");
  export_of({.forged_figures = true}, "tenth");
  for (const auto& [directory, where] :
       {std::pair("withheld", "/verdict/"), std::pair("tenth", "/predicted/")})
    for (const char* sign : {"--no-sign", "--no-pdf"}) {
      const Outcome made = run_program(
          {CELLCAL, "certificate", dir / directory, sign, "--key", dir / "k", "--out", dir / "c"});
      EXPECT_EQ(made.status, 3) << made.out << made.err;
      EXPECT_NE(made.err.find(std::string("first: ") + where), std::string::npos) << made.err;
      EXPECT_NE(made.err.find("no certificate"), std::string::npos) << made.err;
      EXPECT_FALSE(std::filesystem::exists(dir / "c"));
    }
}

TEST_F(TheCertificateCommand, SignsForNoExportThatNobodySignedOrThatWasChangedSince) {
  signing::make_key(dir / "cell");
  const auto status = [&](std::vector<std::string> more) {
    more.insert(more.end(), {"--key", dir / "k", "--out", dir / "c"});
    const Outcome made = certify(more);
    EXPECT_TRUE(made.status == 0 || made.err.find("--no-sign") != std::string::npos) << made.err;
    EXPECT_EQ(std::filesystem::exists(dir / "c"), made.status == 0) << made.err;
    std::filesystem::remove_all(dir / "c");
    return made.status;
  };
  EXPECT_EQ(status({}), 0);
  // Altered, with recomputed sums: a session of an emulated cell that claims to be real.
  std::filesystem::remove_all(dir / "e");
  export_of({}, "e");
  std::filesystem::rename(dir / "e/export.sums", dir / "sums");
  std::filesystem::rename(dir / "e/export.sums.sig", dir / "sig");
  EXPECT_EQ(status({}), 3);
  EXPECT_EQ(status({"--no-sign"}), 0);
  sign_export("e", "cell");
  EXPECT_EQ(status({}), 3) << "by another key";
  EXPECT_EQ(status({"--export-key", dir / "cell.pub"}), 0);
  std::filesystem::remove_all(dir / "e");
  export_of({.seed = 7}, "e");
  std::filesystem::copy_file(dir / "sums", dir / "e/export.sums",
                             std::filesystem::copy_options::overwrite_existing);
  std::filesystem::copy_file(dir / "sig", dir / "e/export.sums.sig",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(status({}), 3) << "signed for other rows";
}

}  // namespace
}  // namespace cellcal::daemon::testing
