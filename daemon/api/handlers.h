#pragma once
// From a request to its answer.

#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "daemon/advice/advice_publisher.h"
#include "daemon/api/http/message.h"
#include "daemon/api/live/event_feed.h"
#include "daemon/api/live/status_json.h"
#include "daemon/archive/retention.h"
#include "daemon/drift/drift_watch.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/service/service.h"
#include "drivers/kuka/eki/eki_position.h"

namespace cellcal::daemon {

class Access;
class CellShelf;
class Examiner;
class FrameStation;
class Schedule;
namespace plant {
class ProposalBox;
}

class Api {
 public:
  /// What a browser shows; for paths that are not below /v1. It holds no data of the cell.
  using Page = std::function<std::optional<Response>(const Request&)>;
  /// Without `access` nobody has a token: over the network only what nobody may see is answered.
  /// Without `examiner` there is no doctor within this daemon.
  explicit Api(SessionService& service, Journal& journal, Access* access = nullptr, Page page = {},
               Examiner* examiner = nullptr);

  /// Before the first request. Lives as long as this.
  void use(Schedule& schedule) { schedule_ = &schedule; }
  void use(plant::ProposalBox& proposals) { proposals_ = &proposals; }
  void use(FrameStation& frames) { frames_ = &frames; }
  void use(const CellShelf& shelf) { shelf_ = &shelf; }
  /// How the line to the plant stands; none: no plant is named. Any thread.
  using PlantLineStatus = std::function<std::optional<plant::LinesStatus>()>;
  void use(PlantLineStatus line) { plant_line_ = std::move(line); }
  /// What the checks say, as the controller has acknowledged it. Any thread.
  void use(std::function<AdviceStatus()> advice) { advice_ = std::move(advice); }
  /// Where the arm stands, from a controller that says it beside a session; null: this one does not. Any thread.
  using ReadPosition = std::function<drivers::EkiPosition()>;
  void use(std::function<ReadPosition()> position) { position_ = std::move(position); }
  /// What [retention] says now. Any thread.
  void use(std::function<RetentionRule()> retention) { retention_ = std::move(retention); }
  /// Where cell files lie that may be named over the network, beside those that are made here.
  void use(std::vector<std::filesystem::path> cell_folders) {
    cell_folders_ = std::move(cell_folders);
  }

  /// Says who asks, or refuses. For no time.
  std::optional<Response> admit_local(Request& request) const;
  std::optional<Response> admit_network(Request& request) const;

  /// As POST /v1/abort: the word that the cell is clear goes, too. False: nothing to abort. For no time.
  bool abort_session();

  /// To a request that was admitted. Nothing: there is no answer yet; ask again when the service has
  /// changed, or say give_up.
  std::optional<Response> answer(const Request& request, bool give_up = true);

  /// It may wait for the disk or for long work. Those that are not wait for nothing: status, watch
  /// and abort are answered whatever the others do.
  static bool is_slow(const Request& request);

  struct Call {
    const Request& request;
    std::string_view variable;  ///< what stands for {id} or {name}
    bool give_up;
  };
  /// All that there is: how it is asked for, who may, whether it takes time, and what answers.
  struct Route {
    const char* method;
    const char* path;  ///< with at most one segment in braces
    Role role;         ///< the least
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
  /// What may set the arm in motion. From afar it takes the caller's word that the cell is clear, once: 412 without.
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
  // Sessions out of the journal and into it, and a copy of all of it (archive_handlers.cc).
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
  // Where the arm was jogged to (position_handler.cc).
  std::optional<Response> read_position(const Call& call);
  // Cell files that are made over the network (cell_form_handlers.cc).
  std::optional<Response> show_cell_form(const Call& call);
  std::optional<Response> read_cell_lists(const Call& call);
  std::optional<Response> write_cell(const Call& call);
  const CellShelf& shelf();
  /// Throws RequestError where a request over the network names another file; empty: none is named.
  void keep_among_cells(const Request& request, const std::filesystem::path& cell) const;
  // What begins without a person (schedule_handlers.cc).
  std::optional<Response> show_schedule(const Call& call);
  std::optional<Response> begin_scheduled(const Call& call);
  std::optional<Response> release_schedule(const Call& call);
  Schedule& schedule();
  // What the plant proposed (proposal_handlers.cc).
  std::optional<Response> show_plant(const Call& call);
  std::optional<Response> take_certificate(const Call& call);
  std::optional<Response> show_proposals(const Call& call);
  std::optional<Response> accept_proposal(const Call& call);
  std::optional<Response> refuse_proposal(const Call& call);
  plant::ProposalBox& proposals();
  // What the page draws (page_data.cc).
  std::optional<Response> scene(const Call& call);
  std::optional<Response> drift(const Call& call);
  std::optional<Response> plan(const Call& call);
  std::optional<Response> figures(const Call& call);
  // Which step is next, and the doctor within the daemon (readiness_handlers.cc).
  std::optional<Response> readiness(const Call& call);
  std::optional<Response> doctor(const Call& call);
  std::optional<Response> examine(const Call& call);
  std::optional<Response> take_examination(const Call& call);
  Examiner& examiner();
  Access& access();
  std::optional<Response> metrics(const Call& call);
  /// Throws NotFound.
  SessionRecord find(const Call& call);
  /// A result as the journal has it; throws NotFound where the session is of another kind or has none.
  Response document(const Call& call, std::string SessionRecord::*text, SessionKind kind);

  SessionService& service_;
  Journal& journal_;
  std::mutex certificates_;  ///< one is looked up and told at a time
  Access* access_;
  Schedule* schedule_ = nullptr;
  FrameStation* frames_ = nullptr;
  const CellShelf* shelf_ = nullptr;
  plant::ProposalBox* proposals_ = nullptr;
  PlantLineStatus plant_line_;
  std::function<AdviceStatus()> advice_;
  std::function<ReadPosition()> position_;
  std::function<RetentionRule()> retention_;
  std::vector<std::filesystem::path> cell_folders_;
  Page page_;
  Examiner* examiner_;
  DriftWatch drift_watch_;
  /// One for each listener's thread: none waits for what the other does.
  EventFeed local_feed_, network_feed_;
};

}  // namespace cellcal::daemon
