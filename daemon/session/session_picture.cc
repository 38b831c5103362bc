// Prints the session's table as a picture: Mermaid, or Graphviz with --dot.

#include <cstdio>
#include <string>

#include "daemon/session/session.h"

int main(int argc, char** argv) {
  const bool dot = argc == 2 && std::string(argv[1]) == "--dot";
  const std::string picture =
      dot ? cellcal::daemon::graphviz_picture() : cellcal::daemon::mermaid_picture();
  return std::fputs(picture.c_str(), stdout) < 0 ? 1 : 0;
}
