// The whole document: valid, self-contained, deterministic, for any content of the session.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "daemon/report/report.h"
#include "tests/daemon/report/fixture.h"
#include "tests/daemon/report/html_checker.h"

namespace cellcal::daemon::report::testing {
namespace {

TEST(HtmlChecker, FindsWhatItIsMadeToFind) {
  const std::string head = "<!doctype html>\n";
  EXPECT_TRUE(complaints(head + "<p class=\"a\">x &amp; y<br></p>\n").empty());
  EXPECT_FALSE(complaints("<p></p>").empty());
  EXPECT_FALSE(complaints(head + "<p><b></p></b>").empty());
  EXPECT_FALSE(complaints(head + "<p>").empty());
  EXPECT_FALSE(complaints(head + "<script></script>").empty());
  EXPECT_FALSE(complaints(head + "<p onclick=\"x\"></p>").empty());
  EXPECT_FALSE(complaints(head + "<p>a & b</p>").empty());
  EXPECT_FALSE(complaints(head + "<p>a > b</p>").empty());
  EXPECT_FALSE(complaints(head + "<svg><line x1=\"nan\"/></svg>").empty());
  EXPECT_FALSE(complaints(head + "<svg><path d=\"M1 inf\"/></svg>").empty());
  EXPECT_FALSE(complaints(head + "<svg><circle r=\"-1\"/></svg>").empty());
}

class AnyShape : public ::testing::TestWithParam<SessionShape> {};

TEST_P(AnyShape, GivesASoundDocument) {
  const std::string html = html_report(made_up_session(GetParam()));
  EXPECT_EQ(joined(complaints(html)), "");
  EXPECT_TRUE(html.ends_with("</html>\n"));
}

INSTANTIATE_TEST_SUITE_P(
    Report, AnyShape,
    ::testing::Values(SessionShape{}, SessionShape{.spheres = 1, .certified_lengths = false},
                      SessionShape{.spheres = 1, .fit = 1, .check = 0, .outliers = 0},
                      SessionShape{.fit = 0, .check = 5, .outliers = 0},
                      SessionShape{.spheres = 2, .fit = 1, .check = 1, .outliers = 0},
                      SessionShape{.spheres = 3, .fit = 50, .check = 0, .joints = 7},
                      SessionShape{.spheres = 8, .fit = 340, .check = 60, .outliers = 9},
                      SessionShape{.spheres = 0, .outliers = 0}, SessionShape{.joints = 0},
                      SessionShape{.spheres = 40, .fit = 80, .joints = 1}));

TEST(Document, OfAnArmThatWasNotIdentifiedIsSoundAndSaysWhy) {
  ReportInput session = made_up_session();
  session.calibration = calib::not_identified(session.calibration.cell, session.touches, {},
                                              "the estimate did not converge");
  const std::string html = html_report(session);
  EXPECT_EQ(joined(complaints(html)), "");
  EXPECT_NE(html.find("Not publishable"), std::string::npos);
  EXPECT_NE(html.find("not identified: the estimate did not converge"), std::string::npos);
}

TEST(Document, OfNothingAtAllIsSoundAndRefuses) {
  const std::string html = html_report(ReportInput{});
  EXPECT_EQ(joined(complaints(html)), "");
  EXPECT_NE(html.find("Not publishable"), std::string::npos);
}

TEST(Document, NeedsNothingFromElsewhereAndRunsNothing) {
  const std::string html = html_report(made_up_session());
  for (const char* forbidden :
       {"http://", "https://", "src=", "href=", "url(", "@import", "<script", "javascript:"}) {
    EXPECT_EQ(html.find(forbidden), std::string::npos) << forbidden;
  }
  EXPECT_NE(html.find("default-src &#39;none&#39;"), std::string::npos);
}

TEST(Document, IsTheSameForTheSameInput) {
  EXPECT_EQ(html_report(made_up_session()), html_report(made_up_session()));
}

TEST(Document, HasItsSectionsInTheOrderOfReading) {
  const std::string html = html_report(made_up_session());
  std::size_t last = html.find("id=\"verdict\"");
  ASSERT_NE(last, std::string::npos);
  for (const char* id :
       {"figures", "meaning", "residuals", "distribution", "cell", "directions", "targets", "model",
        "parameters", "unidentifiable", "outliers", "correlations", "traceability"}) {
    const std::size_t at = html.find(std::string("<section id=\"") + id + "\"");
    ASSERT_NE(at, std::string::npos) << id;
    EXPECT_GT(at, last) << id;
    last = at;
  }
}

TEST(Document, OfFourHundredTouchesStaysBelowAMegabyte) {
  const SessionShape shape{.spheres = 8, .fit = 340, .check = 60, .outliers = 8};
  EXPECT_LT(html_report(made_up_session(shape)).size(), 1U << 20U);
}

TEST(Document, ServesLightDarkAndPaper) {
  const std::string html = html_report(made_up_session());
  EXPECT_NE(html.find("prefers-color-scheme: dark"), std::string::npos);
  EXPECT_NE(html.find("@media print"), std::string::npos);
  EXPECT_NE(html.find("size: A4"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon::report::testing
