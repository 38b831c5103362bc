
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "daemon/unattended/notice.h"

namespace cellcal::daemon {
namespace {

using calib::Language;

const Language kGerman = Language::of("de").value();

TEST(TheCatalogue, SaysOfEveryFailureWhatHappenedAndWhatToDoInEachLanguage) {
  for (int i = 0; i <= static_cast<int>(FailureKind::kUnexpectedEvent); ++i)
    for (const std::string begin : {"failure.", "do."}) {
      const std::string id = begin + to_string(static_cast<FailureKind>(i));
      EXPECT_TRUE(calib::sentence_of(id)) << id;
      EXPECT_NE(calib::sentence_of(id, kGerman), calib::sentence_of(id)) << id;
    }
}

Notice failed() {
  Notice notice;
  notice.news = News::kFailed;
  notice.session = 7;
  notice.kind = "calibrate";
  notice.cell = "/c\nell.toml";
  notice.failure = Failure{FailureKind::kNoContact, "touch 3 of 40 (S2): no contact"};
  return notice;
}

TEST(AMessage, SaysWhatHappenedWhatToDoAndTheEvidenceInTheLanguageThatWasAskedFor) {
  const Message german = compose(failed(), kGerman, "zelle7");
  EXPECT_EQ(german.subject, "Sitzung 7: fehlgeschlagen");
  EXPECT_NE(german.body.find("Kein Kontakt bis zum Ende der Suche."), std::string::npos)
      << german.body;
  EXPECT_NE(german.body.find("In dieser Reihenfolge prüfen"), std::string::npos) << german.body;
  EXPECT_NE(german.body.find("touch 3 of 40 (S2): no contact"), std::string::npos) << german.body;
  EXPECT_NE(german.body.find("cellcal auf zelle7"), std::string::npos) << german.body;
  EXPECT_EQ(compose(failed(), Language(), "c").subject, "Session 7: failed");
  EXPECT_NE(german.body.find("'cellcal run --resume'"), std::string::npos) << german.body;
}

TEST(AMessage, NamesTheCommandOfANewSessionWhereTheKindIsNotResumed) {
  Notice notice = failed();
  notice.anew = "cellcal check";
  for (const News news : {News::kFailed, News::kAborted, News::kInterrupted}) {
    notice.news = news;
    const std::string body = compose(notice, Language(), "c").body;
    EXPECT_NE(body.find("Then: 'cellcal check'"), std::string::npos) << body;
    EXPECT_EQ(body.find("resume"), std::string::npos) << body;
  }
}

TEST(AMessage, NamesWhyTheDaemonItselfAbortedASession) {
  Notice notice = failed();
  notice.news = News::kAborted;
  notice.failure = Failure{FailureKind::kWindowOver, "say.schedule.why.window-over"};
  const std::string body = compose(notice, kGerman, "c").body;
  EXPECT_NE(body.find("Das Zeitfenster des Zeitplans endete vor der Sitzung"), std::string::npos)
      << body;
  EXPECT_NE(body.find("das Zeitfenster ist vorbei"), std::string::npos) << body;
  notice.failure.reset();
  EXPECT_NE(compose(notice, kGerman, "c").body.find("Die Zelle ansehen."), std::string::npos);
}

TEST(AMessage, NamesTheKindInItsLanguageAndTheCellOfANewCalibration) {
  Notice notice = failed();
  notice.kind = "calibrate";
  notice.update = true;
  notice.cell = "/cells/a.toml";
  const std::string german = compose(notice, kGerman, "c").body;
  EXPECT_NE(german.find("Art: Aktualisierung"), std::string::npos) << german;
  notice.news = News::kDrifted;
  const std::string body = compose(notice, Language(), "c").body;
  EXPECT_NE(body.find("'cellcal run --cell /cells/a.toml --accept-change'"), std::string::npos)
      << body;
  notice.cell = "/my cells/a.toml";
  EXPECT_NE(compose(notice, Language(), "c").body.find("--cell '/my cells/a.toml' --accept-change"),
            std::string::npos);
  notice.advice = calib::DriftAdvice::kReMeasureTcp;
  EXPECT_NE(compose(notice, Language(), "c").body.find("measure the TCP"), std::string::npos);
}

TEST(AMessage, HasFindingsInItsLanguageAndPostsThemInEnglish) {
  Notice notice = failed();
  notice.findings = {{"say.finding.update_too_few", {{"touches", 3.0}}}, "a reader's own words"};
  const Message german = compose(notice, kGerman, "c");
  EXPECT_NE(german.body.find("Befund: 3 Antastungen sind zu wenige"), std::string::npos);
  EXPECT_NE(german.body.find("Befund: a reader's own words"), std::string::npos);
  const auto posted = nlohmann::json::parse(german.json).at("findings");
  ASSERT_EQ(posted.size(), 2U);
  EXPECT_TRUE(posted[0].get<std::string>().starts_with("3 touches are too few")) << posted[0];
}

TEST(AMessage, OfEveryKindIsWrittenInBothLanguagesAndForgesNoLine) {
  for (const News news : kAllNews) {
    for (const Language& language : {Language(), kGerman}) {
      Notice notice = failed();
      notice.news = news;
      notice.entry = "night\rly";
      notice.near_m = notice.over_m = 1e-4;
      notice.findings = {"\xff\nodd"};
      const Message message = compose(notice, language, "c");
      EXPECT_EQ(message.subject.find_first_of("\r\n"), std::string::npos);
      EXPECT_EQ(message.body.find("\nell"), std::string::npos);
      EXPECT_EQ(message.body.find('{'), std::string::npos) << message.body;
      const auto json = nlohmann::json::parse(message.json);
      EXPECT_EQ(json.at("format"), "cellcal.notice/1");
      EXPECT_EQ(json.at("news"), to_string(news));
      EXPECT_EQ(json.at("failure").at("kind"), "no-contact");
      EXPECT_EQ(json.at("session"), 7);
    }
  }
}

TEST(AMessage, NamesAReportOnlyWhereThereIsOne) {
  Notice notice = failed();
  notice.failure.reset();
  const auto has_report = [&](News news, const char* kind) {
    notice.news = news;
    notice.kind = kind;
    return compose(notice, Language(), "c").body.find("'cellcal report 7'") != std::string::npos;
  };
  EXPECT_TRUE(has_report(News::kDone, "calibrate"));
  EXPECT_TRUE(has_report(News::kWithheld, "calibrate"));
  EXPECT_FALSE(has_report(News::kFailed, "calibrate"));
  for (const char* kind : {"check", "qualify", "find", "dry-run"})
    for (const News news : {News::kDone, News::kDrifted, News::kUndecided, News::kRecovered})
      EXPECT_FALSE(has_report(news, kind)) << kind;
}

}  // namespace
}  // namespace cellcal::daemon
