#pragma once
// HTTP/1.1 client over a Unix-domain socket, and errors of sockets.

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/words/phrase.h"

namespace cellcal::daemon {

// HTTP request and answer, reduced to what cellcal needs.

// Caller and role.

/// Each role includes the permissions of those before it.
enum class Role { kNone, kView, kOperate, kAdminister };

const char* to_string(Role role);
/// "look", "operate", "administer"; none for any other word.
std::optional<Role> parse_role(std::string_view word);

/// Name of callers over the Unix socket.
inline constexpr const char* kLocalName = "local";

struct Caller {
  Role role = Role::kNone;
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
  Caller caller{};     ///< kNone until admitted

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

/// A value of an object; empty or 0 where it is missing or of another type.
inline std::string text_in(const nlohmann::json& value, const char* key) {
  const auto found = value.find(key);
  return found != value.end() && found->is_string() ? found->get<std::string>() : "";
}
inline double number_in(const nlohmann::json& value, const char* key) {
  const auto found = value.find(key);
  return found != value.end() && found->is_number() ? found->get<double>() : 0.0;
}

/// The socket cannot be used; the text gives path, reason and remedy.
struct SocketError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// No usable answer of a program behind a socket; `sentence` states path, reason and remedy in any language.
struct ClientSocketError : SocketError {
  explicit ClientSocketError(const calib::Phrase& words)
      : SocketError(calib::words(words)), sentence(words) {}
  calib::Phrase sentence;
};

/// The socket belongs to a group that this user is not a member of.
struct SocketPermissionError : ClientSocketError {
  using ClientSocketError::ClientSocketError;
};

/// Throws SocketError where the path is empty or exceeds the system's limit.
void require_socket_path(const std::filesystem::path& socket);

/// Sends one request and returns its answer. `most`: time limit; 0: unlimited. Throws SocketError (no daemon,
/// no permission, no answer).
Response http_request(const std::filesystem::path& socket, const std::string& method,
                      const std::string& target, const std::string& body = "",
                      std::chrono::milliseconds most = {});

// Detection of requests initiated by a foreign page.

/// True if the Host header names this computer: an address, "localhost" or one of `names` (lower case). This
/// detects DNS rebinding, in which a foreign name resolves to this computer's address; a literal address
/// cannot be rebound.
bool host_is_ours(const Request& request, const std::vector<std::string>& names);

/// True without an Origin header (browsers send it with every POST), or with the origin of this host and
/// port. With `tls` only https is accepted, since a page sent in clear text can be forged; without, a proxy
/// in front of the daemon may terminate TLS.
bool origin_is_ours(const Request& request, bool tls);

/// Network that one host may use entirely: the /64 of an IPv6 address (with its interface, if any), otherwise
/// the address itself. A key for counting, not for display.
std::string network_of(const std::string& address);

// Prometheus' text format, version 0.0.4.

/// Metric families, each preceded by its help and type.
class Exposition {
 public:
  using Labels = std::vector<std::pair<const char*, std::string>>;

  void family(const char* name, const char* type, const char* help);
  void sample(double value, const Labels& labels = {}, const char* suffix = "");
  void gauge(const char* name, const char* help, double value) {
    family(name, "gauge", help);
    sample(value);
  }
  void gauge(const char* name, const char* help, const std::optional<double>& value) {
    if (value) gauge(name, help, *value);
  }
  void counter(const char* name, const char* help, double value) {
    family(name, "counter", help);
    sample(value);
  }
  std::string text() && { return std::move(text_); }
  static std::string number(double value);

 private:
  std::string text_, family_;
};

// Static files of the web page, at "/" and under "/page/". Public: they contain no data of the cell.

/// The page by the path of its asset: of a cell, or of a plant.
inline constexpr const char* kCellPage = "/";
inline constexpr const char* kFleetPage = "/fleet";

/// None for other paths. Does not block.
std::optional<Response> page_answer(const Request& request);
/// Serves that page, and no other, at "/".
std::optional<Response> page_answer_at(const Request& request, std::string_view home);

}  // namespace cellcal::daemon
