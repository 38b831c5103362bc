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
#include <utility>
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
struct CellForm;
class Examiner;
class FrameStation;
class Schedule;
namespace plant {
class ProposalBox;
}

class Api {
 public:
  /// Web page, for paths outside /v1. Contains no data of the cell.
  using Page = std::function<std::optional<Response>(const Request&)>;
  /// Without `access` there are no tokens: over the network only public resources are served. Without
  /// `examiner` the daemon has no doctor.
  explicit Api(SessionService& service, Journal& journal, Access* access = nullptr, Page page = {},
               Examiner* examiner = nullptr);

  /// To be called before the first request; the argument outlives this object.
  void use(Schedule& schedule) { schedule_ = &schedule; }
  void use(plant::ProposalBox& proposals) { proposals_ = &proposals; }
  void use(FrameStation& frames) { frames_ = &frames; }
  void use(const CellFileStore& shelf) { shelf_ = &shelf; }
  /// Status of the connection to the plant; none: no plant is configured. Thread-safe.
  using PlantLineStatus = std::function<std::optional<plant::LinesStatus>()>;
  void use(PlantLineStatus line) { plant_line_ = std::move(line); }
  /// Result of the checks, as acknowledged by the controller. Thread-safe.
  void use(std::function<AdviceStatus()> advice) { advice_ = std::move(advice); }
  /// Current position of the arm, from a controller that reports it outside of sessions; null: not supported.
  /// Thread-safe.
  using ReadPosition = std::function<drivers::EkiPosition()>;
  void use(std::function<ReadPosition()> position) { position_ = std::move(position); }
  /// Current [retention] settings. Thread-safe.
  void use(std::function<RetentionRule()> retention) { retention_ = std::move(retention); }
  /// Folders of cell files that may be named over the network, besides those created here.
  void use(std::vector<std::filesystem::path> cell_folders) {
    cell_folders_ = std::move(cell_folders);
  }

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
    std::optional<Response> (Api::*answer)(const Call& call);
  };
  static std::span<const Route> routes();

 private:
  std::optional<Response> health(const Call& call);
  std::optional<Response> me(const Call& call);
  std::optional<Response> status(const Call& call);
  std::optional<Response> watch(const Call& call);
  std::optional<Response> events(const Call& call);
  std::optional<Response> log_in(const Call& call);
  std::optional<Response> log_out(const Call& call);
  std::optional<Response> clear(const Call& call);
  std::optional<Response> tokens(const Call& call);
  std::optional<Response> add_token(const Call& call);
  std::optional<Response> remove_token(const Call& call);
  std::optional<Response> run(const Call& call);
  /// Wraps actions that may cause motion. Over the network they consume the caller's confirmation that the
  /// cell is clear; 412 without.
  std::optional<Response> with_clear_cell(const Call& call, const std::function<Response()>& act);
  std::optional<Response> abort(const Call& call);
  std::optional<Response> sessions(const Call& call);
  std::optional<Response> session(const Call& call);
  std::optional<Response> session_touches(const Call& call);
  std::optional<Response> session_events(const Call& call);
  std::optional<Response> touches_csv(const Call& call);
  std::optional<Response> calibration(const Call& call);
  std::optional<Response> qualification(const Call& call);
  std::optional<Response> found(const Call& call);
  std::optional<Response> check(const Call& call);
  std::optional<Response> report(const Call& call);
  // Export and import of sessions, and backup of the journal (session_handlers.cc).
  std::optional<Response> export_session(const Call& call);
  std::optional<Response> import_session(const Call& call);
  std::optional<Response> back_up(const Call& call);
  std::optional<Response> retain(const Call& call);
  // Published calibrations as versions (version_handlers.cc).
  std::optional<Response> show_versions(const Call& call);
  std::optional<Response> compare_versions(const Call& call);
  std::optional<Response> activate_version(const Call& call);
  std::optional<Response> roll_back_version(const Call& call);
  // Frames on the controller (frame_handlers.cc).
  std::optional<Response> show_frames(const Call& call);
  std::optional<Response> read_frame(const Call& call);
  std::optional<Response> set_frame(const Call& call);
  std::optional<Response> restore_frame(const Call& call);
  FrameStation& frames();
  // Position reached by jogging (frame_handlers.cc).
  std::optional<Response> read_position(const Call& call);
  // Creation of cell files over the network (cell_form_handlers.cc).
  std::optional<Response> show_cell_form(const Call& call);
  std::optional<Response> read_cell_lists(const Call& call);
  std::optional<Response> import_robot(const Call& call);
  std::optional<Response> write_cell(const Call& call);
  std::optional<Response> keep_mesh(const Call& call);
  std::optional<Response> read_cell_file(const Call& call);
  std::optional<Response> draw_cell_form(const Call& call);
  std::optional<Response> suggest_places_of_form(const Call& call);
  CellForm unfinished_form(const Call& call);
  const CellFileStore& shelf();
  /// Throws RequestError where a network request names a file outside the permitted folders; an empty name
  /// passes.
  void keep_among_cells(const Request& request, const std::filesystem::path& cell) const;
  // Unattended sessions (plant_handlers.cc).
  std::optional<Response> show_schedule(const Call& call);
  std::optional<Response> begin_scheduled(const Call& call);
  std::optional<Response> release_schedule(const Call& call);
  Schedule& schedule();
  // Proposals of the plant (plant_handlers.cc).
  std::optional<Response> show_plant(const Call& call);
  std::optional<Response> report_certificate(const Call& call);
  std::optional<Response> show_proposals(const Call& call);
  std::optional<Response> accept_proposal(const Call& call);
  std::optional<Response> refuse_proposal(const Call& call);
  plant::ProposalBox& proposals();
  // Data of the page's drawings (page_data.cc).
  std::optional<Response> scene(const Call& call);
  std::optional<Response> drift(const Call& call);
  std::optional<Response> plan(const Call& call);
  std::optional<Response> figures(const Call& call);
  std::optional<Response> plots(const Call& call);
  // Readiness steps, and the doctor within the daemon (version_handlers.cc).
  std::optional<Response> readiness(const Call& call);
  std::optional<Response> doctor(const Call& call);
  std::optional<Response> examine(const Call& call);
  std::optional<Response> adopt_examination(const Call& call);
  Examiner& examiner();
  Access& access();
  std::optional<Response> metrics(const Call& call);
  /// Throws NotFound.
  SessionRecord find(const Call& call);
  /// A result as the journal has it; throws NotFound where the session is of another kind or has none.
  Response document(const Call& call, std::string SessionRecord::*text, SessionKind kind);

  SessionService& service_;
  Journal& journal_;
  std::mutex certificates_;  ///< serialises lookup and notification of certificates
  Access* access_;
  Schedule* schedule_ = nullptr;
  FrameStation* frames_ = nullptr;
  const CellFileStore* shelf_ = nullptr;
  plant::ProposalBox* proposals_ = nullptr;
  PlantLineStatus plant_line_;
  std::function<AdviceStatus()> advice_;
  std::function<ReadPosition()> position_;
  std::function<RetentionRule()> retention_;
  std::vector<std::filesystem::path> cell_folders_;
  Page page_;
  Examiner* examiner_;
  DriftWatch drift_watch_;
  /// One per listener thread, so that neither waits for the other.
  EventFeed local_feed_, network_feed_;
};

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
