#include "tests/daemon/certificate/printed.h"

#include <regex>
#include <utility>

namespace cellcal::daemon::testing {

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != text.npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}

namespace {

std::string plain(std::string html) {
  for (const auto& [entity, text] :
       {std::pair{"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&#39;", "'"}, {"&amp;", "&"}})
    html = replaced(html, entity, text);
  return html;
}

constexpr const char* kOpen = "<span data-from=\"";

}  // namespace

std::vector<Printed> entries_of(const std::string& html, std::string& rest) {
  std::vector<Printed> entries;
  rest.clear();
  std::string body = html.substr(html.find("<body>"));
  for (std::size_t at = 0; at < body.size();) {
    const std::size_t open = body.find(kOpen, at);
    rest += body.substr(at, open - at);
    if (open == body.npos) break;
    const std::size_t from = open + std::string(kOpen).size(), quote = body.find("\">", from),
                      close = body.find("</span>", quote);
    entries.push_back(
        {plain(body.substr(from, quote - from)), plain(body.substr(quote + 2, close - quote - 2))});
    at = close + std::string("</span>").size();
  }
  rest = plain(std::regex_replace(rest, std::regex("<[^>]*>"), " "));
  return entries;
}

}  // namespace cellcal::daemon::testing
