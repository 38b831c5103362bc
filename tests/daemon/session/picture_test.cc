#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "daemon/session/session.h"

namespace cellcal::daemon {
namespace {

TEST(session_picture, in_the_readme_is_the_one_that_the_table_gives) {
  std::ifstream file(CELLCAL_SESSION_README);
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_NE(text.str().find("```mermaid\n" + mermaid_picture() + "```"), std::string::npos)
      << "put the output of session_picture into daemon/session/README.md";
}

TEST(session_picture, as_graphviz_draws_every_arrow) {
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
