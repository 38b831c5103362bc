#include "daemon/api/message.h"

#include <algorithm>

namespace cellcal::daemon {

Request parse_target(const std::string& method, const std::string& target, std::string body) {
  Request request{method, target, {}, std::move(body)};
  const std::size_t mark = target.find('?');
  if (mark == std::string::npos) return request;
  request.path = target.substr(0, mark);
  std::size_t at = mark + 1;
  while (at < target.size()) {
    const std::size_t end = std::min(target.find('&', at), target.size());
    const std::string pair = target.substr(at, end - at);
    const std::size_t equals = std::min(pair.find('='), pair.size());
    request.query.emplace(pair.substr(0, equals),
                          equals < pair.size() ? pair.substr(equals + 1) : "");
    at = end + 1;
  }
  return request;
}

}  // namespace cellcal::daemon
