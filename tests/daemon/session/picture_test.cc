#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "daemon/session/session.h"

namespace cellcal::daemon {
namespace {

TEST(SessionPicture, InTheReadmeIsTheOneThatTheTableGives) {
  std::ifstream file(CELLCAL_SESSION_README);
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_NE(text.str().find("```mermaid\n" + mermaid_picture() + "```"), std::string::npos)
      << "put the output of session_picture into daemon/session/README.md";
}

TEST(SessionPicture, AsGraphvizDrawsEveryArrow) {
  const std::string dot = graphviz_picture();
  std::size_t arrows = 0, expected = 0;
  for (std::size_t at = dot.find(" -> "); at != std::string::npos; at = dot.find(" -> ", at + 1)) {
    ++arrows;
  }
  for (const Transition& row : transition_table()) {
    for (Phase phase : kAllPhases) expected += row.to && row.from.has(phase) ? 1 : 0;
  }
  EXPECT_EQ(arrows, expected);
}

}  // namespace
}  // namespace cellcal::daemon
