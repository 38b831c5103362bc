#pragma once
// HTTP request and answer, reduced to what cellcal needs.

#include <chrono>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cellcal::daemon {

// Caller and role.

/// Each role includes the permissions of those before it.
enum class Role { kNobody, kLook, kOperate, kAdminister };

const char* to_string(Role role);
/// "look", "operate", "administer"; none for any other word.
std::optional<Role> parse_role(std::string_view word);

/// Name of callers over the Unix socket.
inline constexpr const char* kLocalName = "local";

struct Caller {
  Role role = Role::kNobody;
  std::string name{};  ///< of the token; "local" over the Unix socket
};

/// A malformed request.
struct BadRequest : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Request {
  std::string method;                        ///< "GET", "POST"
  std::string path;                          ///< without the query
  std::map<std::string, std::string> query;  ///< first value of each key, %XX decoded
  std::string body;
  std::map<std::string, std::string> headers{};  ///< names in lower case; first value of each
  std::string peer{};  ///< address of the client; empty over a Unix socket
  Caller caller{};     ///< kNobody until admitted

  /// Empty where the header is missing.
  const std::string& header(const std::string& name) const;
  bool is_from_network() const { return !peer.empty(); }
};

/// A body that grows while it is read.
class Stream {
 public:
  virtual ~Stream() = default;
  /// New content since the last call, in whole pieces; empty: none. None: the reader has fallen too far
  /// back, or the stream has ended. Does not block; may be called from any one thread.
  virtual std::optional<std::string> next() = 0;
};

struct Response {
  int status = 200;
  std::string type = "application/json";
  std::string body{};
  std::vector<std::pair<std::string, std::string>> headers{};
  std::shared_ptr<Stream> stream{};   ///< replaces the body
  std::chrono::milliseconds hold{0};  ///< delay of the answer, against token guessing
};

/// Splits "/v1/watch?since=3" into path and query.
Request parse_target(const std::string& method, const std::string& target, std::string body);

/// {"error": "words"}
Response error(int status, const std::string& words);
/// Answer 503 with a Retry-After header.
Response busy(const std::string& words);

// Serialisation of JSON.

/// Foreign text may hold any bytes: invalid UTF-8 is replaced instead of throwing.
inline std::string dump(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace cellcal::daemon
