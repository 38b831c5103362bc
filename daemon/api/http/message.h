#pragma once
// A request and its answer, as far as cellcal needs HTTP.

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

// Who asks, and what he may do.

/// Each may do what those before it may.
enum class Role { kNobody, kLook, kOperate, kAdminister };

const char* to_string(Role role);
/// "look", "operate", "administer"; nothing for any other word.
std::optional<Role> parse_role(std::string_view word);

/// Of who comes over the Unix socket.
inline constexpr const char* kLocalName = "local";

struct Caller {
  Role role = Role::kNobody;
  std::string name{};  ///< the token's; "local" over the Unix socket
};

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

// JSON as it is sent.

/// Words of devices may hold any bytes; what is not UTF-8 is shown as such, never thrown over.
inline std::string dump(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace cellcal::daemon
