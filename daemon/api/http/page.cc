#include <algorithm>

#include "daemon/api/http/http.h"
#include "daemon/web/assets.h"

namespace cellcal::daemon {

namespace {

/// No foreign content, no inline content, no embedding in frames.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' "
    "data: blob:; form-action 'self'; base-uri 'none'; frame-ancestors 'none'";
/// The name is a hash of the content, so the asset never changes.
constexpr const char* kForEver = "public, max-age=31536000, immutable";
constexpr const char* kAskAgain = "no-cache";

}  // namespace

std::optional<Response> page_answer(const Request& request) {
  return page_answer_at(request, kCellPage);
}

std::optional<Response> page_answer_at(const Request& request, std::string_view home) {
  const bool at_home = request.path == "/";
  if (!at_home && !request.path.starts_with("/page/")) return std::nullopt;
  const std::string_view path = at_home ? home : std::string_view(request.path);
  const auto all = assets();
  const auto asset =
      std::find_if(all.begin(), all.end(), [&](const Asset& one) { return one.path == path; });
  if (asset == all.end()) return std::nullopt;
  Response response{.type = std::string(asset->type)};
  response.headers.emplace_back("ETag", asset->etag);
  response.headers.emplace_back("Cache-Control", at_home ? kAskAgain : kForEver);
  response.headers.emplace_back("Content-Security-Policy", kPolicy);
  // With "no-referrer" a form without scripts, as that of the abort, would be sent with "Origin: null".
  response.headers.emplace_back("Referrer-Policy", "same-origin");
  if (request.header("if-none-match") == asset->etag) {
    response.status = 304;
    return response;
  }
  if (asset->gzipped) response.headers.emplace_back("Content-Encoding", "gzip");
  response.body = asset->body;
  return response;
}

}  // namespace cellcal::daemon
