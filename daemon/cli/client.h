#pragma once
// Commands that talk to the daemon. Each returns its exit status and throws on failure.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stdexcept>
#include <string>

#include "daemon/api/http/http.h"

namespace cellcal::daemon {

struct RunRequest;

struct Connection {
  std::filesystem::path socket;
  bool json = false;
  std::string language;   ///< --language; empty: not given
  bool progress = false;  ///< a line every ten seconds, also without a terminal
};

/// Begins a session and follows it to its end. `or_full`: a full session after a withheld update, unless nothing
/// changed.
int run(const Connection& daemon, const RunRequest& request, bool or_full = false);
int show_status(const Connection& daemon);
int watch(const Connection& daemon);
int abort(const Connection& daemon);
int history(const Connection& daemon);
enum class Shown { kEventsAndResult, kTimes };
/// `session`: none: the newest.
int show(const Connection& daemon, std::optional<std::int64_t> session, Shown shown);
/// `session`: none: the newest finished one.
int fetch_report(const Connection& daemon, std::optional<std::int64_t> session,
                 const std::filesystem::path& output);

// Requests to the daemon; its errors are thrown as exceptions.

/// Error message of the daemon, with its whole answer.
struct DaemonRefusal : std::runtime_error {
  DaemonRefusal(const std::string& words, Response answer)
      : std::runtime_error(words), response(std::move(answer)) {}
  Response response;
};

/// `most`: time limit; 0: unlimited. Throws SocketError, DaemonRefusal.
Response ask(const Connection& daemon, const char* method, const std::string& target,
             const std::string& body = "", std::chrono::milliseconds most = {});
/// Throws SocketError where the body is not JSON.
nlohmann::json parse(const Response& response);

/// The target with the reader's language, which the answer's sentences are in; unchanged for JSON, which is in English.
std::string in_language(const Connection& daemon, const std::string& target);
/// Answer in the reader's language. `most`: as of ask().
nlohmann::json get(const Connection& daemon, const std::string& target,
                   std::chrono::milliseconds most = {});

/// False where the daemon's folder cannot be looked into.
bool is_missing(const std::filesystem::path& path);

/// Login name, also under sudo; printable.
std::string user_name();

}  // namespace cellcal::daemon
