#pragma once
// A request and its answer, as far as cellcal needs HTTP.

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "daemon/api/http/role.h"

namespace cellcal::daemon {

/// A request that is wrong in itself.
struct BadRequest : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Request {
  std::string method;                        ///< "GET", "POST"
  std::string path;                          ///< without the query
  std::map<std::string, std::string> query;  ///< first value of each key, %XX decoded
  std::string body;
  std::map<std::string, std::string> headers{};  ///< names in lower case; the first of each
  std::string peer{};                            ///< the client's address; empty over a Unix socket
  Caller caller{};                               ///< nobody, until it is admitted

  /// Empty where there is none.
  const std::string& header(const std::string& name) const;
  bool is_from_network() const { return !peer.empty(); }
};

/// A body that grows while its reader looks on.
class Stream {
 public:
  virtual ~Stream() = default;
  /// What is new since the last call, whole pieces; empty: nothing. None: its reader has fallen too
  /// far behind, or there will never be more. Waits for nothing; from one thread, any.
  virtual std::optional<std::string> next() = 0;
};

struct Response {
  int status = 200;
  std::string type = "application/json";
  std::string body{};
  std::vector<std::pair<std::string, std::string>> headers{};
  std::shared_ptr<Stream> stream{};   ///< instead of a body
  std::chrono::milliseconds hold{0};  ///< it is kept back so long: of one who tries tokens
};

/// Splits "/v1/watch?since=3" into path and query.
Request parse_target(const std::string& method, const std::string& target, std::string body);

/// {"error": "words"}
Response error(int status, const std::string& words);
/// The same of 503, and when to ask again.
Response busy(const std::string& words);

}  // namespace cellcal::daemon
