// Network input of the API: request lines, headers, event ids, bodies. Refused with a reason, or read;
// foreign hosts and origins are never accepted as this computer's own. Also replayed over api_corpus as
// an ordinary test.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "daemon/api/event_feed.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http/http.h"

namespace {

using namespace cellcal::daemon;  // NOLINT: a fuzz target's own file

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

/// Up to the next line break, which is removed.
std::string line_of(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string line(text.substr(0, end));
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

void as_body(const std::string& text) {
  try {
    const RunRequest run = run_request(text);
    require(run.resume || !run.cell.empty(), "a run names a cell or resumes");
    require(run.cell.string().find('\n') == std::string::npos, "no line is forged");
  } catch (const BadRequest&) {
    return;
  }
}

void as_number(const Request& request) {
  try {
    const auto number = whole_number_in(request, "after");
    require(!number || *number >= 0, "numbers are whole");
  } catch (const BadRequest&) {
    return;
  }
}

void as_event_id(const std::string& text) {
  const auto id = parse_event_id(text);
  if (!id) return;
  require(text.size() <= 22, "an id of an event is a number that fits");
}

}  // namespace

/// One line each: method, target, host, origin, event id; the rest is the body.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::string method = line_of(text), target = line_of(text);
  Request request = parse_target(method, target, "");
  request.headers = {{"host", line_of(text)}, {"origin", line_of(text)}};
  const Match found = match(request);
  if (found.route != nullptr) {
    require(found.path_known && method == found.route->method, "a route is for its method");
    require(found.variable.find('/') == std::string_view::npos, "a variable is one segment");
  }
  as_number(request);
  const std::string& host = request.header("host");
  if (host_is_ours(request, {})) {
    require(host.find("example") == std::string::npos, "a foreign name is not ours");
  }
  if (origin_is_ours(request, false) && !request.header("origin").empty()) {
    require(request.header("origin").size() > host.size(), "an origin holds the host");
  }
  as_event_id(line_of(text));
  as_body(std::string(text));
  return 0;
}
