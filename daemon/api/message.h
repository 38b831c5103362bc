#pragma once
// A request and its answer, as far as cellcal needs HTTP.

#include <map>
#include <string>

namespace cellcal::daemon {

struct Request {
  std::string method;                        ///< "GET", "POST"
  std::string path;                          ///< without the query
  std::map<std::string, std::string> query;  ///< first value of each key, as it stands
  std::string body;
};

struct Response {
  int status = 200;
  std::string type = "application/json";
  std::string body;
};

/// Splits "/v1/watch?since=3" into path and query.
Request parse_target(const std::string& method, const std::string& target, std::string body);

}  // namespace cellcal::daemon
