#pragma once
// Request handlers of the HTTP API.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "calib/result/calibration.h"
#include "calib/result/drift_chart.h"
#include "calib/words/phrase.h"
#include "daemon/api/event_feed.h"
#include "daemon/api/http/http.h"
#include "daemon/archive/archive.h"
#include "daemon/archive/drift_watch.h"
#include "daemon/controller/advice_publisher.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/service/service.h"
#include "drivers/kuka/eki/eki_aside.h"

namespace cellcal::daemon {

class Access;
class CellFileStore;
class Examiner;
class FrameStation;
class Schedule;
namespace plant {
class ProposalBox;
}

struct Api {
  /// Web page, for paths outside /v1. Contains no data of the cell.
  using Page = std::function<std::optional<Response>(const Request&)>;
  /// Current position of the arm.
  using ReadPosition = std::function<drivers::EkiPosition()>;

  /// Without `access` there are no tokens: over the network only public resources are served. Without
  /// `examiner` the daemon has no doctor.
  explicit Api(SessionService& service, Journal& journal, Access* access = nullptr, Page page = {},
               Examiner* examiner = nullptr);

  /// Identifies the caller, or returns the refusal. Does not block.
  std::optional<Response> admit_local(Request& request) const;
  std::optional<Response> admit_network(Request& request) const;

  /// As POST /v1/abort: also revokes the confirmation that the cell is clear. False: nothing to abort. Does
  /// not block.
  bool abort_session();

  /// Answers an admitted request. None: no answer yet; to be called again after a change of the service, or
  /// with give_up.
  std::optional<Response> answer(const Request& request, bool give_up = true);

  /// The request may block on the disk or compute for long. All others never block: status, watch and abort
  /// are answered independently of slow requests.
  static bool is_slow(const Request& request);
  /// Largest body of an admitted request that is a file, such as an STL file [bytes]; 0: the server's limit.
  static std::size_t largest_body(const Request& request);

  struct Call {
    const Request& request;
    std::string_view variable;  ///< value of {id} or {name}
    bool give_up;
  };
  /// Table of all routes: method, path, required role, slowness and handler.
  struct Route {
    const char* method;
    const char* path;  ///< at most one segment in braces
    Role role;         ///< minimum role
    bool slow;
    std::optional<Response> (*answer)(Api& api, const Call& call);
  };
  static const std::vector<Route>& routes();

  SessionService& service;
  Journal& journal;
  Access* access;
  Page page;
  Examiner* examiner;

  // To be set before the first request; what they point to outlives this object. Functions are thread-safe.
  Schedule* schedule = nullptr;
  FrameStation* frames = nullptr;
  const CellFileStore* shelf = nullptr;
  plant::ProposalBox* proposals = nullptr;
  /// Status of the connection to the plant; none: no plant is configured.
  std::function<std::optional<plant::LinesStatus>()> plant_line;
  /// Result of the checks, as acknowledged by the controller.
  std::function<AdviceStatus()> advice;
  /// From a controller that reports the position outside of sessions; null: not supported.
  std::function<ReadPosition()> position;
  /// Current [retention] settings.
  std::function<RetentionRule()> retention;
  /// Folders of cell files that may be named over the network, besides those created here.
  std::vector<std::filesystem::path> cell_folders;

  std::mutex certificates;  ///< serialises lookup and notification of certificates
  DriftWatch drift_watch;
  /// One per listener thread, so that neither waits for the other.
  EventFeed local_feed, network_feed;
};

// Handlers, in the file of each table of routes.

using Call = Api::Call;
using Answer = std::optional<Response>;
inline constexpr bool kSlow = true, kAtOnce = false;

std::span<const Api::Route> token_routes();
std::span<const Api::Route> session_routes();
std::span<const Api::Route> drawing_routes();
std::span<const Api::Route> version_routes();
std::span<const Api::Route> plant_routes();
std::span<const Api::Route> frame_routes();
std::span<const Api::Route> cell_form_routes();
Answer metrics(Api& api, const Call& call);

/// Throws NotFound where the daemon has no tokens.
Access& access_of(const Api& api);
/// Throws NotFound.
SessionRecord find_session(Api& api, const Call& call);
/// Wraps actions that may cause motion. Over the network they consume the caller's confirmation that the
/// cell is clear; 412 without.
Answer with_clear_cell(Api& api, const Call& call, const std::function<Response()>& act);
/// Throws RequestError where a network request names a file outside the permitted folders; an empty name
/// passes.
void keep_among_cells(const Api& api, const Request& request, const std::filesystem::path& cell);

// Request body of POST /v1/run.

/// Throws BadRequest naming the key.
RunRequest run_request(const std::string& body);

// Author and reason in a request body.

inline constexpr std::size_t kLongestReason = 500;

/// One non-empty line. Throws BadRequest.
std::string line_in(const nlohmann::json& body, const char* key, std::size_t longest);
/// Author of a request: the name under "by", which is not verified, followed by the token's name. Throws
/// BadRequest.
std::string author_of(const Request& request, const nlohmann::json& body);

// Files of this computer that a network request may name.

/// Files of one kind, and the alternative for a file outside the folders.
struct NetworkFiles {
  const char* what;     ///< "a cell file"
  const char* instead;  ///< in the imperative
  std::vector<std::filesystem::path> folders;
};

/// Over the network a file has to lie directly in one of the folders, under its own name: neither it nor its
/// folder may be a link. Otherwise throws RequestError, with a text that does not reveal whether the file
/// exists. Over the Unix socket any file may be named.
void keep_within(const Request& request, const std::filesystem::path& file,
                 const NetworkFiles& allowed);

// Selection of the handler of a request.

/// A refused value, and where the form states it.
struct FieldError : RequestError {
  FieldError(const std::string& words, std::string of, std::string why)
      : RequestError(words), key(std::move(of)), reason(std::move(why)) {}
  std::string key, reason;  ///< as in FormFault; empty: unknown
};

/// The resource does not exist.
struct NotFound : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Match {
  const Api::Route* route = nullptr;  ///< null: no route for this method
  std::string_view variable{};        ///< value of the segment in braces
  bool path_known = false;            ///< the path exists with this or another method
};
Match match(const Request& request);

/// The body, a JSON object of these keys alone; without any, of all. Throws BadRequest.
nlohmann::json object_in(const std::string& body, std::initializer_list<const char*> known = {});
/// Integer parameter of the query; throws BadRequest where it is not an integer.
std::optional<std::int64_t> whole_number_in(const Request& request, const char* key);
/// "language" of the query: of the sentences in the answer. English by default. Throws BadRequest.
calib::Language language_in(const Request& request);
/// Non-negative, digits only.
std::optional<std::int64_t> whole_number(std::string_view text);

// Metrics of the daemon in the Prometheus text format, version 0.0.4.

/// Metrics of the state and its links, of all sessions, of the newest result, of the calibration in use and of its
/// checks (null: none). Unknown values are omitted.
std::string metrics_text(const Status& status, const std::vector<SessionRecord>& sessions,
                         const calib::Calibration* newest,
                         const calib::Calibration* in_use = nullptr,
                         const calib::DriftChart* drift = nullptr);

/// Metrics of the connection to the plant, where one is configured.
std::string metrics_text(const plant::LineStatus& line, const OutboxCount& outbox);

}  // namespace cellcal::daemon
