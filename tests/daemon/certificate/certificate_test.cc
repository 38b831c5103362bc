// Content of a certificate, values not available, and hostile names.

#include "daemon/certificate/certificate.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/files/input_file.h"
#include "daemon/tasks/options.h"
#include "tests/daemon/certificate/origins.h"
#include "tests/daemon/certificate/recorded.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using certificate::CertificateData, certificate::Entry, certificate::Refused;

CertificateData first() { return make_certificate(recorded().first, "e", kIssue); }
CertificateData second() { return make_certificate(recorded().second, "e", kIssue); }

bool says(const std::string& html, const std::string& words) {
  return html.find(words) != html.npos;
}

TEST(ACertificatesWords, NameWhoAndWhatWasThere) {
  const CertificateData data = first();
  EXPECT_EQ(data.entry("robot_serial").text, "4711");
  EXPECT_EQ(data.entry("controller_serial").text, "KRC 8");
  EXPECT_EQ(data.entry("sensor").text, "board C");
  EXPECT_EQ(data.entry("sensor_serial").text, "0007");
  EXPECT_EQ(data.entry("operator").text, "J\u00fcrgen \u00c4.");
  EXPECT_EQ(data.entry("site").text, "Hall 3");
  EXPECT_EQ(data.entry("artefacts/0/serial").text, "K 1");
  EXPECT_EQ(data.entry("artefacts/0/certificate").text, "D-K-15070 412");
  EXPECT_EQ(data.entry("artefacts/0/certificate_date").text, "2026-04-01");
  EXPECT_EQ(data.entry("artefacts/0/expanded").text, "0.0040");
  EXPECT_EQ(data.entry("lowest_temperature").text, "21.0");
  const CertificateData calibrated = second();
  EXPECT_FALSE(calibrated.entry("robot_serial").stated());
  EXPECT_TRUE(says(to_html(calibrated), "<th scope=\"row\">Temperature</th><td>not recorded</td>"));
  // As found, as left.
  EXPECT_TRUE(data.content["as_found_by"].is_null());
  EXPECT_EQ(calibrated.entry("as_found_by").text, "session 1 of 2026-03-29");
  const auto error = [](const CertificateData& of, const char* when) {
    return *certificate::entry_at(figure_of(of, "say.certificate.tcp.mean"), when).value;
  };
  EXPECT_GT(error(data, "as_found"), 5.0 * error(data, "as_left"));
  EXPECT_LT(error(calibrated, "as_found"), error(data, "as_found") / 5.0);
  EXPECT_LT(error(calibrated, "as_left"), error(data, "as_left"));
  // The frame, and unidentifiable directions.
  EXPECT_GE(calibrated.content["not_identifiable"].size(), 3u);
  for (const Entry one : calibrated.content["not_identifiable"]) EXPECT_TRUE(one.stated());
  EXPECT_TRUE(says(to_html(calibrated), "base frame"));
}

/// Digits from the first that is not zero.
std::string digits_of(const std::string& number) {
  std::string digits;
  for (const char c : number)
    if (c >= '0' && c <= '9' && (c != '0' || !digits.empty())) digits += c;
  return digits;
}

TEST(AnAppendixOfParameters, HasTwoDigitsOfEachUAndTheCorrectionToTheSameDecimals) {
  const auto decimals = [](const std::string& text) {
    const std::size_t point = text.find('.');
    return point == text.npos ? 0 : text.size() - point - 1;
  };
  std::size_t seen = 0;
  const CertificateData data = first();
  for (const auto& one : data.content["parameters"]) {
    const Entry expanded = one["expanded"];
    if (!expanded.value || !(*expanded.value > 0.0)) continue;
    ++seen;
    const std::string& u = expanded.text;
    EXPECT_TRUE(*expanded.value >= 99.5 || digits_of(u).size() == 2u) << one["name"] << " " << u;
    EXPECT_EQ(decimals(one["correction"]["text"]), decimals(u)) << one["name"];
    EXPECT_NEAR(std::stod(u), *expanded.value, 0.051 * *expanded.value);
  }
  EXPECT_GT(seen, 20u);
}

TEST(ACertificatesWords, NameInterruptionsAndWhenItWentOnByTheClockOnTheWall) {
  ::setenv("TZ", "Europe/Berlin", 1);
  const CertificateData data = first();
  ::unsetenv("TZ");
  const auto& breaks = data.content["breaks"];
  ASSERT_EQ(breaks.size(), 2u);
  EXPECT_EQ(breaks[0]["what"], "interrupted");
  EXPECT_EQ(breaks[0]["phase"]["text"], "retreat");
  EXPECT_EQ(breaks[0]["event"]["text"], "robot silent");
  EXPECT_EQ(breaks[0]["local"]["text"], "2026-03-29 00:10:00 CET (UTC+0100)");
  EXPECT_EQ(breaks[1]["what"], "resumed");  // after the change to summer time
  EXPECT_EQ(breaks[1]["local"]["text"], "2026-03-29 03:25:00 CEST (UTC+0200)");
}

TEST(ACertificatesWords, SayThatInterruptionsAreNotKnownWhereRawRowsWereDropped) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const std::int64_t id = record(journal, {.phases = true}, false);
  SessionInputs inputs = read_inputs(CELLCAL_DEMO_CELL);
  inputs.options = options_to_json({});
  journal.begin(inputs, "2026-08-01T00:00:00.000Z");  // the newest one keeps its rows
  ASSERT_EQ(journal.retain({"2026-05-01T00:00:00.000Z"}, "2026-09-01T00:00:00.000Z", false).size(),
            1u);
  const CertificateData data =
      make_certificate(make_archive(journal, id, directory / "none"), "e", kIssue);
  EXPECT_EQ(data.content["breaks"], "not known");
  EXPECT_TRUE(says(to_html(data), "not known: raw rows were dropped on"));
}

TEST(ACertificatesWords, NameWhenItWentOnByItselfAfterALinkCameBack) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const std::int64_t id = record(journal, {.phases = true}, false);
  const auto note = [&](Phase from, Phase to, EventKind on, const char* utc) {
    journal.note(id, RecordChange{{from, to}, on, utc, 1.0, 0, 0.0});
  };
  note(Phase::kTransit, Phase::kRecovering, EventKind::kRobotSilent, "2026-03-28T23:10:00.000Z");
  note(Phase::kRecovering, Phase::kWatchingTheLinks, EventKind::kLinks, "2026-03-28T23:10:05.000Z");
  note(Phase::kWatchingTheLinks, Phase::kReferencing, EventKind::kDeadline,
       "2026-03-28T23:10:08.000Z");
  const CertificateData data =
      make_certificate(make_archive(journal, id, directory / "none"), "e", kIssue);
  const auto& breaks = data.content["breaks"];
  ASSERT_EQ(breaks.size(), 2u);
  EXPECT_EQ(breaks[0]["what"], "interrupted");
  EXPECT_EQ(breaks[0]["phase"]["text"], "transit");
  EXPECT_EQ(breaks[1]["what"], "resumed");
  EXPECT_EQ(breaks[1]["phase"]["text"], "watching the links");
  EXPECT_EQ(breaks[1]["event"]["text"], "deadline");
}

TEST(ACertificatesWords, HaveNoFiguresOfCheckTouchesAsFoundWhereThereAreNone) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  record(journal, {}, false);
  const std::int64_t id = record(journal, {.as_fit = true, .fit = 60, .seed = 2}, true);
  const CertificateData data =
      make_certificate(make_archive(journal, id, directory / "none"), "e", kIssue);
  ASSERT_FALSE(data.content["as_found_by"].is_null());
  for (const std::string of : {"mean", "largest", "rms"}) {
    const auto fit = figure_of(data, "say.certificate.tip.fitted." + of),
               check = figure_of(data, "say.certificate.tip.check." + of);
    EXPECT_NE(fit["as_found"]["text"], "");
    EXPECT_EQ(check["as_found"]["text"], "");
    EXPECT_NE(check["as_left"]["text"], "");
  }
}

TEST(ACertificatesWords, SayThatInterruptionsWereNotRecordedWhereNoChangeOfPhaseWas) {
  const std::string none = "<th scope=\"row\">Interruptions</th><td>none</td>",
                    not_recorded = "<th scope=\"row\">Interruptions</th><td>not recorded</td>";
  const auto breaks = [](const CertificateData& of) {
    return nlohmann::json::parse(to_json(of)).at("breaks");
  };
  EXPECT_TRUE(says(to_html(second()), none));
  EXPECT_EQ(breaks(second()), nlohmann::json::array());
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const CertificateData data = make_certificate(
      make_archive(journal, record(journal, {}, false), directory / "none"), "e", kIssue);
  EXPECT_TRUE(says(to_html(data), not_recorded));
  EXPECT_EQ(breaks(data), "not recorded");
}

TEST(ACertificatesWords, ListTheAxesOfAPositionerWithTheirBounds) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const Archive archive =
      make_archive(journal, record(journal, {.positioner = true}, false), directory / "none");
  const CertificateData data = make_certificate(archive, "e", kIssue);
  ASSERT_EQ(data.content["positioner"].size(), 1u);
  EXPECT_EQ(data.entry("positioner/0/axis").text, "E1");
  EXPECT_EQ(data.entry("positioner/0/place_u95").text, "0.025");
  EXPECT_NEAR(std::get<double>(Origins(archive).at(data.entry("positioner/0/xyz/0").from)), 1150.2,
              1e-9);
  EXPECT_TRUE(says(to_html(data), "<h2>Axes of the positioner</h2>"));
  EXPECT_TRUE(
      says(to_html(data, *calib::Language::of("de")), "<h2>Achsen des Drehkipptischs</h2>"));
  EXPECT_TRUE(says(to_dcc(data), "E1: bound of the direction (95 %)"));
  EXPECT_TRUE(says(to_dcc(data), "\\milli\\radian"));
  const auto axis = nlohmann::json::parse(to_json(data)).at("positioner").at(0);
  EXPECT_EQ(axis.at("direction_u95").at("unit"), "mrad");
  EXPECT_NEAR(axis["direction_u95"]["value"].get<double>(), 0.061, 1e-12);
  EXPECT_FALSE(says(to_html(second()), "Axes of the positioner"));
  EXPECT_FALSE(nlohmann::json::parse(to_json(second())).contains("positioner"));
}

TEST(ACertificatesWords, ListALinearUnitsFiguresWithTheirBounds) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const Archive archive =
      make_archive(journal, record(journal, {.linear_unit = true}, false), directory / "none");
  const CertificateData data = make_certificate(archive, "e", kIssue);
  EXPECT_EQ(data.entry("linear_unit/axis").text, "E1");
  EXPECT_EQ(data.entry("linear_unit/direction_u95").text, "0.081");
  ASSERT_EQ(data.content["linear_unit"]["at"].size(), 2u);
  const std::string row = "linear_unit/at/0/";
  EXPECT_EQ(data.entry(row + "position").text, "250");
  EXPECT_EQ(data.entry(row + "motion/1").text, "0.020");
  EXPECT_EQ(data.entry(row + "motion/4").unit, "mrad");
  EXPECT_NEAR(std::get<double>(Origins(archive).at(data.entry(row + "motion/4").from)), 0.05,
              1e-12);
  EXPECT_NEAR(std::get<double>(Origins(archive).at(data.entry(row + "u95/4").from)), 0.005, 1e-12);
  EXPECT_TRUE(says(to_html(data), "<h2>Linear unit</h2>"));
  EXPECT_TRUE(says(to_html(data, *calib::Language::of("de")), "<h2>Lineareinheit</h2>"));
  EXPECT_TRUE(says(to_dcc(data), "E1 at 250 mm: pitch"));
  EXPECT_TRUE(says(to_dcc(data), "\\milli\\metre\\metre\\tothe{-1}"));
  const auto unit = nlohmann::json::parse(to_json(data)).at("linear_unit");
  EXPECT_EQ(unit.at("scale").at("unit"), "mm/m");
  EXPECT_NEAR(unit.at("at").at(0).at("motion").at(5)["value"].get<double>(), 0.06, 1e-12);
  EXPECT_FALSE(says(to_html(second()), "Linear unit"));
  EXPECT_FALSE(nlohmann::json::parse(to_json(second())).contains("linear_unit"));
}

TEST(ACertificatesWords, HaveTheVerdictsOwnRule) {
  const CertificateData data = first();
  ASSERT_FALSE(data.content["decision"].is_null());
  EXPECT_EQ(data.content["decision"]["limit_by"], "default");
  EXPECT_EQ(data.entry("decision/required").text, "2.000");
  EXPECT_EQ(data.entry("decision/most_of_nominal").text, "80");
  EXPECT_TRUE(says(to_html(data), "the limit where the cell file requires none"));
  EXPECT_TRUE(says(to_html(data), "Simple acceptance"));
}

TEST(ACertificateIsRefused, OfAWithheldResultWithTheReasons) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const std::int64_t id = record(journal, {.publish = false}, false);
  try {
    make_certificate(make_archive(journal, id, directory / "none"), "session 1", kIssue);
    ADD_FAILURE();
  } catch (const Refused& refused) {
    EXPECT_EQ(refused.why, Refused::Why::kWithheld);
    EXPECT_TRUE(says(refused.what(), "session 1: the result was withheld"));
    EXPECT_GT(std::count(refused.what(), refused.what() + std::string(refused.what()).size(), '\n'),
              0);
  }
}

TEST(ACertificateIsRefused, OfASessionThatWasAbortedOrFailedWithItsCalibrationStored) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const Recording few{.ending = Ending::kAborted};
  const std::int64_t id = record(journal, few, false);
  for (const auto& [ending, word] :
       {std::pair{Ending::kAborted, "aborted"}, {Ending::kFailed, "failed"}}) {
    journal.record(id, RecordEnd{ending, "stopped\nby hand"}, "2026-03-29T01:32:00.000Z");
    const Archive archive = make_archive(journal, id, directory / "none");
    ASSERT_NE(archive.find("calibration.json"), archive.end());
    write_archive(archive, directory / word);
    try {
      make_certificate(read_archive(directory / word), "export", kIssue);
      ADD_FAILURE() << word;
    } catch (const Refused& refused) {
      EXPECT_EQ(refused.why, Refused::Why::kNotDone);
      EXPECT_TRUE(
          says(refused.what(), fmt::format("the session is {} (stopped by hand), not done", word)))
          << refused.what();
    }
  }
}

TEST(ACertificateIsRefused, OfAnUpdateWhichStandsOnAnotherSession) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const std::int64_t id = record(journal, {.stands_on = "session 12 of 2026-11-20"}, false);
  try {
    make_certificate(make_archive(journal, id, directory / "none"), "session 1", kIssue);
    ADD_FAILURE();
  } catch (const Refused& refused) {
    EXPECT_EQ(refused.why, Refused::Why::kUpdate);
    EXPECT_EQ(std::string(refused.what()),
              "session 1: an update, based on the calibration of session 12 of 2026-11-20. For a "
              "certificate run a full session: 'cellcal run'");
  }
}

TEST(ACertificateIsRefused, OfASessionWithoutACalibration) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  SessionInputs inputs = read_inputs(CELLCAL_DEMO_CELL);
  inputs.options = options_to_json({});
  const std::int64_t id = journal.begin(inputs, "2026-01-01T00:00:00.000Z");
  try {
    make_certificate(make_archive(journal, id, directory / "none"), "session 1", kIssue);
    ADD_FAILURE();
  } catch (const Refused& refused) {
    EXPECT_EQ(refused.why, Refused::Why::kNoCalibration);
  }
}

TEST(ACertificateIsRefused, OfAnExportThatWasAltered) {
  Archive altered = recorded().first;
  std::string& rows = altered["rows.jsonl"];
  const std::size_t at = rows.find("4711");
  ASSERT_NE(at, rows.npos);
  rows[at] = '5';
  EXPECT_THROW(make_certificate(altered, "e", kIssue), ArchiveError);
}

/// To save time.
void shorten(CertificateData& data) {
  for (const char* list : {"parameters", "raw_touches"}) {
    auto& rows = data.content[list];
    rows.erase(rows.begin() + 3, rows.end());
  }
}

/// Text, origin and unit of every entry.
void set_texts(nlohmann::ordered_json& content, const std::string& text) {
  if (content.is_object() && content.contains("from"))
    content["text"] = content["from"] = content["unit"] = text;
  else if (content.is_structured())
    for (auto& one : content) set_texts(one, text);
}

TEST(AHostileName, StaysTextOnACertificate) {
  CertificateData data = second();
  shorten(data);
  const auto set = [&](const std::string& text) {
    set_texts(data.content, text);
    data.scale_certificates["x"] = {text, text};
  };
  set("x");
  const std::string harmless = to_html(data);
  for (const std::string& name :
       {std::string("<script>alert(1)</script>"), std::string("\" onload=\"alert(1)"),
        std::string("' x='"), std::string("</style><img src=x>"),
        std::string("\xE2\x80\xAEgpj.exe"), std::string("\xFF\xFE\xC0\x80"), std::string("a\0b", 3),
        std::string("&lt;b"), std::string("{}"), std::string("url(http://x)"),
        std::string(5000, 'x')}) {
    set(name);
    const std::string hostile = to_html(data);
    for (const char mark : {'<', '>', '"', '\''})
      EXPECT_EQ(std::count(hostile.begin(), hostile.end(), mark),
                std::count(harmless.begin(), harmless.end(), mark))
          << name << mark;
    EXPECT_FALSE(says(hostile, "\xE2\x80\xAE"));
    EXPECT_EQ(hostile.find('\0'), hostile.npos);
    EXPECT_TRUE(nlohmann::json::accept(to_json(data)));
  }
}

TEST(ACertificateOnPaper, IsAPdfOfTheSameDocument) {
  const TemporaryDirectory directory;
  CertificateData data = second();
  shorten(data);
  std::ofstream(directory / "c.html") << to_html(data);
  certificate::write_pdf(directory / "c.html", directory / "c.pdf");
  EXPECT_TRUE(calib::read_file(directory / "c.pdf").starts_with("%PDF-"));
  EXPECT_FALSE(std::filesystem::exists(directory / "c.pdf.part"));
}

TEST(ACertificateOnPaper, HasDateIssuerSignatureTraceabilityAndResultOnItsFirstPage) {
  const TemporaryDirectory directory;
  CertificateData data = second();
  data.content["issued_by"] = Entry{"A. Name", "issue#by"};
  std::ofstream(directory / "c.html") << to_html(data);
  const auto out = directory / "page.txt";
  const std::string command = fmt::format("/usr/bin/python3 {} {} > {}", CELLCAL_FIRST_PAGE,
                                          (directory / "c.html").string(), out.string());
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string page = calib::read_file(out);
  for (const char* words : {"Issued ", "A. Name", "Reviewed by", "Traceability", "hold the scale",
                            "Calibration accepted", "Bound of a TCP position"})
    EXPECT_NE(page.find(words), page.npos) << words << " is not in: " << page;
  EXPECT_EQ(page.find("Decision rule"), page.npos) << "it is the first page alone";
}

TEST(ACertificateOnPaper, IsGivenUpWhereTheProgramTakesLongerThanItsLimit) {
  const TemporaryDirectory directory;
  std::ofstream(directory / "c.html") << "<p>";
  std::ofstream(directory / "weasyprint")
      << "#!/bin/sh\n/bin/echo x > \"$3\"\nexec /bin/sleep 20\n";
  std::filesystem::permissions(directory / "weasyprint", std::filesystem::perms::owner_all);
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", directory.path().c_str(), 1);
  std::string words;
  const auto begin = std::chrono::steady_clock::now();
  try {
    certificate::write_pdf(directory / "c.html", directory / "c.pdf",
                           std::chrono::milliseconds(500));
  } catch (const std::runtime_error& error) {
    words = error.what();
  }
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
  EXPECT_TRUE(says(words, "weasyprint was ended after 0.5 s")) << words;
  EXPECT_FALSE(std::filesystem::exists(directory / "c.pdf"));
  EXPECT_FALSE(std::filesystem::exists(directory / "c.pdf.part"));
}

TEST(ACertificateOnPaper, NamesThePackageWhereTheProgramIsMissing) {
  const TemporaryDirectory directory;
  std::ofstream(directory / "c.html") << "<p>";
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", directory.path().c_str(), 1);
  std::string words;
  try {
    certificate::write_pdf(directory / "c.html", directory / "c.pdf");
  } catch (const std::runtime_error& error) {
    words = error.what();
  }
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_TRUE(says(words, "Install the package 'weasyprint'")) << words;
  EXPECT_FALSE(std::filesystem::exists(directory / "c.pdf"));
}

}  // namespace
}  // namespace cellcal::daemon::testing
