#include "daemon/cli/client.h"

#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <thread>

#include "calib/files/calibration_json.h"
#include "calib/files/json.h"
#include "calib/model/units.h"
#include "calib/words/phrase_json.h"
#include "daemon/cli/actions.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/offline.h"
#include "daemon/cli/progress.h"
#include "daemon/doctor/wires.h"
#include "daemon/files/atomic_file.h"
#include "daemon/session/interruption.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

/// Smooth to the eye at negligible load of the daemon.
constexpr std::chrono::milliseconds kPollInterval{200};

/// The daemon answers an abort at once, and its status within a second on a busy computer.
constexpr std::chrono::seconds kLongestAbort{3}, kLongestStatus{10};

volatile std::sig_atomic_t g_detached = 0;

void on_interrupt(int) { g_detached = 1; }

/// The answer's sentences in the reader's language; JSON is in English.
std::string in_language(const Connection& daemon, const std::string& target) {
  const calib::Language language = language_of(daemon.language);
  if (daemon.json || language == calib::Language()) return target;
  return target + (target.find('?') == std::string::npos ? "?" : "&") + "language=" + language.code();
}

/// How to go on after a session that is not done.
calib::Phrase then_of(const json& session) {
  const std::string anew = text_in(session, "anew");
  if (anew.empty()) return "say.cli.then.resume";
  return {"say.cli.then.anew", {{"command", anew}}};
}

json get(const Connection& daemon, const std::string& target, std::chrono::milliseconds most = {}) {
  return parse(ask(daemon, "GET", in_language(daemon, target), "", most));
}

std::string session_path(std::int64_t session) { return fmt::format("/v1/sessions/{}", session); }

std::int64_t number(const json& value, const char* key) {
  const auto found = value.find(key);
  return found != value.end() && found->is_number_integer() ? found->get<std::int64_t>() : 0;
}

std::optional<double> figure(const json& value, const char* key) {
  const auto found = value.find(key);
  if (found == value.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

/// Interruptions by cause, from a status or the times of a recorded session. Earlier versions of the daemon send no causes.
std::string interruption_words(const json& of) {
  const std::int64_t all = number(of, "interruptions");
  if (all == 0) return {};
  InterruptionCounts counts;
  if (const json causes = of.value("interruptions_by_cause", json()); causes.is_object())
    for (std::size_t i = 0; i < counts.of.size(); ++i)
      counts.of[i] = static_cast<int>(number(causes, kCountedCauses[i].name));
  const std::string by_cause = words(counts);
  return fmt::format("interruptions: {}{}, each resumed automatically\n", all,
                     by_cause.empty() ? "" : ": " + by_cause);
}

/// Missing links: "the robot controller", "the contact sensor" or both; "" without any.
std::string waited_for(const json& status) {
  const json waiting = status.value("waiting", json());
  if (!waiting.is_object()) return "";
  const bool robot = waiting.value("robot", false), contact = waiting.value("contact", false);
  if (robot && contact) return "the robot controller and the contact sensor";
  return robot ? "the robot controller" : contact ? "the contact sensor" : "";
}

/// Operator action while the controller is missing; otherwise the sensor's message.
std::string what_to_do(const json& status) {
  const json waiting = status.value("waiting", json());
  if (!waiting.is_object()) return "";
  const std::string start = waiting.value("robot", false) ? text_in(waiting, "start") : "";
  const std::string sensor = waiting.value("contact", false) ? text_in(status, "contact") : "";
  return start.empty() ? sensor : start;
}

Progress progress_of(const json& status) {
  if (const std::string what = waited_for(status); !what.empty()) {
    Progress progress{"waiting for " + what, "", 0, 0, {}, figure(status["waiting"], "left_s")};
    progress.done = static_cast<std::size_t>(number(status, "touches"));
    progress.total = static_cast<std::size_t>(number(status, "planned"));
    return progress;
  }
  const std::string stage = text_in(status, "stage"), phase = text_in(status, "phase");
  if (const json planning = status.value("planning", json()); planning.is_object()) {
    Progress progress{phase, "", 0, 0, {}, {}};
    progress.share = figure(planning, "done");
    return progress;
  }
  return {status.value("finding", false) ? phase + " (" + stage + ")" : phase,
          text_in(status, "target"),
          static_cast<std::size_t>(number(status, "touches")),
          static_cast<std::size_t>(number(status, "planned")),
          figure(status, "residual_mm"),
          figure(status, "time_left_s"),
          figure(status, "u95_mm"),
          figure(status, "goal_mm")};
}

bool is_running(const json& status) { return status.value("running", false); }

std::string failure_words(const json& status) {
  const json failure = status.value("failure", json());
  if (!failure.is_object()) return "";
  return text_in(failure, "kind") + ": " + text_in(failure, "detail");
}

/// Prints a result file of the session, whose sentences are the daemon's; `last`: what to do next, empty: the
/// file's name. Success: the flag is set, or none is named.
int conclude_with(const Connection& daemon, const json& status, const std::string& file,
                  const char* flag, const calib::Phrase& last = {}) {
  const json result = get(daemon, session_path(number(status, "session")) + "/" + file);
  std::string words;
  // Sessions of earlier versions have their sentences in English alone.
  for (const json& line : result.value(result.contains("said") ? "said" : "words", json::array()))
    words += say(calib::phrase_of(line)) + "\n";
  words += say(last.empty() ? calib::Phrase("say.cli.figures",
                                            {{"file", text_in(status, "results") + "/" + file}})
                            : last);
  print_result(daemon.json, result, words + "\n");
  return flag == nullptr || result.value(flag, false) ? kSuccess : kNotPublishable;
}

/// A dry run that did not fail has covered the whole path.
int conclude_dry_run(const Connection& daemon, const json& status) {
  return print_result(daemon.json, status,
                      say({"say.cli.dry_run", {{"n", number(status, "touches")}}}) + "\n");
}

/// Prints the result of a session; the exit status follows from it.
int conclude(const Connection& daemon, const json& status) {
  const std::int64_t session = number(status, "session");
  const std::string phase = text_in(status, "phase");
  if (phase == "failed") throw std::runtime_error(failure_words(status));
  if (phase == "aborted") {
    throw std::runtime_error(
        say({"say.cli.aborted", {{"session", session}, {"then", then_of(status)}}}));
  }
  const std::string kind = text_in(status, "kind");
  if (kind == "qualify") return conclude_with(daemon, status, "qualification.json", "passed");
  if (kind == "check") return conclude_with(daemon, status, "check.json", "holds");
  if (kind == "find")
    return conclude_with(daemon, status, "found.json", nullptr, "say.cli.found.do");
  if (kind == "dry-run") return conclude_dry_run(daemon, status);
  const Response calibration = ask(daemon, "GET", session_path(session) + "/calibration.json");
  const calib::Calibration result =
      calib::calibration_from_json(calibration.body, "the daemon's calibration");
  json value = status;
  value["residuals"] = json::parse(calibration.body).value("residuals", json());
  const std::string why = text_in(status, "why_ended");
  print_result(
      daemon.json, value,
      (why.empty() ? "" : say({"say.cli.stopped", {{"why", why}}}) + "\n") + result_words(result) +
          say({"say.cli.report", {{"file", text_in(status, "results") + "/report.html"}}}) + "\n");
  return result.verdict.publish() ? kSuccess : kNotPublishable;
}

/// Effect of Ctrl-C before the first motion.
enum class BeforeMotion { kCtrlCEnds, kCtrlCDetaches };

/// True before any motion: nothing moves before both links are up.
bool before_motion(const json& status) {
  const std::string phase = text_in(status, "phase");
  return phase == "planning" || phase == "connecting";
}

/// Ends a session before its first motion; a motion begun meanwhile is stopped.
int end_session(const Connection& daemon, std::int64_t session) {
  http_request(daemon.socket, "POST", "/v1/abort");  // 409: the session has already ended
  json status = get(daemon, "/v1/status");
  while (is_running(status) && number(status, "session") == session) {
    std::this_thread::sleep_for(kPollInterval);
    status = get(daemon, "/v1/status");
  }
  if (text_in(status, "phase") != "aborted") return conclude(daemon, status);
  std::fprintf(stderr, "session %lld ended before anything moved\n",
               static_cast<long long>(session));
  return kJobFailed;
}

/// Warnings about cell file and plan.
std::vector<std::string> warnings_of(const json& status) {
  std::vector<std::string> all;
  for (const json& one : status.value("warnings", json::array()))
    if (one.is_string()) all.push_back("warning: " + one.get<std::string>() + "\n");
  return all;
}

/// Follows a session to its end, or to Ctrl-C.
int follow(const Connection& daemon, std::int64_t session, BeforeMotion ctrl_c, Shows shows) {
  struct sigaction interrupt {};
  interrupt.sa_handler = on_interrupt;
  interrupt.sa_flags = SA_RESTART;  // a pending request to the daemon is completed
  ::sigaction(SIGINT, &interrupt, nullptr);
  ProgressDisplay display(shows);
  json status;
  std::size_t warned = 0;
  while (g_detached == 0) {
    try {
      status = get(daemon, "/v1/status", kLongestStatus);
    } catch (const SocketError&) {
      throw SocketError(fmt::format(
          "session {} was interrupted: cellcald ended or does not answer (its log: journalctl -u cellcald). The touches "
          "made so far are kept. See that the arm has stopped, start cellcald (sudo systemctl start cellcald); how to go "
          "on: 'cellcal status'",
          session));
    }
    if (number(status, "session") != session) {
      throw std::runtime_error(
          fmt::format("session {} is no longer running: cellcald was restarted, or another session "
                      "began. See 'cellcal show {}'; how to go on: 'cellcal status'",
                      session, session));
    }
    for (const auto warnings = warnings_of(status); warned < warnings.size(); ++warned) {
      display.clear();
      std::fputs(warnings[warned].c_str(), stderr);
    }
    if (!is_running(status)) {
      display.clear();
      return conclude(daemon, status);
    }
    if (const std::string what = waited_for(status); !what.empty()) {
      const bool ends = ctrl_c == BeforeMotion::kCtrlCEnds;
      display.say("waiting for " + what + ": " + what_to_do(status) +
                  (ends ? "; Ctrl-C ends the session" : ""));
    }
    Progress progress = progress_of(status);
    progress.links =
        arm_words(status.value("arm", json())) + link_words(status.value("links", json()));
    display.show(progress);
    std::this_thread::sleep_for(kPollInterval);
  }
  display.clear();
  // Before the first status the user has not been informed of any motion.
  if (ctrl_c == BeforeMotion::kCtrlCEnds && (status.is_null() || before_motion(status))) {
    return end_session(daemon, session);
  }
  std::fprintf(stderr,
               "detached, session %lld continues. Follow it: 'cellcal watch'; stop the arm: "
               "'cellcal abort'\n",
               static_cast<long long>(session));
  // A command that began the session promises its end; `watch` only shows it.
  return ctrl_c == BeforeMotion::kCtrlCEnds ? kDetached : kSuccess;
}

/// Sentences of an outcome, one per line; empty where none is recorded.
std::string outcome_words(const json& of) {
  std::string words;
  const json outcome = of.value("outcome", json());
  if (!outcome.is_object()) return words;
  for (const json& line : outcome.value("words", json::array()))
    if (line.is_string())
      words +=
          (words.empty() ? say("say.cli.outcome") + " " : "  ") + line.get<std::string>() + "\n";
  return words;
}

std::string load_words(const json& session) {
  const std::string load = text_in(session, "load");
  return load.empty() ? "" : say({"say.cli.with_load", {{"load", load}}});
}

std::string status_words(const json& status) {
  const std::int64_t session = number(status, "session");
  if (const json left = status.value("interrupted", json()); session == 0 && left.is_object()) {
    return say({"say.cli.idle.interrupted",
                {{"session", number(left, "session")},
                 {"started", text_in(left, "started")},
                 {"touches", number(left, "touches")},
                 {"planned", number(left, "planned")},
                 {"ending", say("state." + text_in(left, "ending"))},
                 {"then", then_of(left)}}}) +
           "\n";
  }
  if (session == 0) return say("say.cli.idle") + "\n";
  std::string words =
      say({"say.cli.session",
           {{"session", session}, {"phase", "say.phase." + text_in(status, "phase")}}}) +
      load_words(status) + "\n";
  words += outcome_words(status);
  for (const std::string& warning : warnings_of(status)) words += warning;
  if (number(status, "planned") > 0) words += progress_line(progress_of(status), 1000) + "\n";
  if (const std::string what = waited_for(status); !what.empty()) {
    words += "waiting for " + what + ": " + what_to_do(status) + "\n";
  }
  words += interruption_words(status);
  if (const auto left = figure(status, "busy_left_s");
      left && text_in(status, "phase") == "recovering")
    words += say({"say.cli.busy", {{"s", *left}}}) + "\n";
  const auto add = [&](const char* id, const char* key) {
    if (const std::string of = text_in(status, key); !of.empty())
      words += say({id, {{"words", of}}}) + "\n";
  };
  add("say.cli.robot", "robot");
  add("say.cli.contact", "contact");
  if (text_in(status, "phase") != "done") words += arm_words(status.value("arm", json()));
  words += link_words(status.value("links", json()));
  if (!failure_words(status).empty()) words += failure_words(status) + "\n";
  add("say.cli.results", "results");
  return words;
}

std::string times_of(const json& times) {
  std::vector<ActivityRow> rows;
  for (const json& one : times.value("activities", json::array()))
    rows.push_back({text_in(one, "activity"), text_in(one, "driver"), number(one, "count"),
                    figure(one, "total_s").value_or(0.0), figure(one, "worst_s").value_or(0.0)});
  return times_words(number(times, "touches"), rows);
}

/// Kind of a session; empty for a calibration, the default.
std::string kind_words(const json& session) {
  const std::string kind = text_in(session, "kind");
  return kind == "qualify"   ? "qualification: "
         : kind == "dry-run" ? "dry run: "
         : kind == "find"    ? "find: "
         : kind == "check"   ? "check: "
                             : "";
}

/// State with the outcome, since 'done' alone would read as a success. Without a recorded outcome: whether a
/// calibration was published.
std::string state_word(const json& session) {
  const json outcome = session.value("outcome", json()),
             published = session.value("published", json());
  if (outcome.is_object()) {
    std::string words = text_in(outcome, "kind");
    std::ranges::replace(words, '_', ' ');
    return words;
  }
  return !published.is_boolean() ? text_in(session, "state")
         : published.get<bool>() ? "published"
                                 : "withheld";
}

/// Of another journal, and perhaps of another cell.
bool is_imported(const json& session) {
  return session.contains("imported") && !session["imported"].is_null();
}

std::string session_line(const json& session) {
  const std::string kind = kind_words(session);
  return fmt::format(
      "{:>5}  {:<24}  {:<15}  {:>4}/{:<4}  {}{}{}\n", number(session, "id"),
      text_in(session, "started"), state_word(session), number(session, "touches"),
      number(session, "planned"), kind,
      text_in(session, "failure").empty() ? text_in(session, "cell") : text_in(session, "failure"),
      load_words(session) + (is_imported(session) ? ", imported" : ""));
}

/// True where the update was withheld and a full session can resolve it: not where nothing changed, nor where
/// a sphere is displaced, so that positions are unknown.
bool needs_full_session(const Connection& daemon, std::int64_t session) {
  const json calibration = get(daemon, session_path(session) + "/calibration.json");
  const json update = calibration.value("update", json());
  if (!update.is_object() || g_detached != 0) return false;
  const std::string outcome = text_in(update, "outcome");
  return outcome != "nothing_changed" && outcome != "not_found";
}

// A field of a request in JSON; null: left out.

json stated(SessionKind kind) { return to_string(kind); }
json stated(const std::filesystem::path& file) {
  return file.empty() ? json() : json(std::filesystem::absolute(file).string());
}
json stated(const std::vector<std::string>& names) { return names.empty() ? json() : json(names); }
template <class T>
json stated(const std::optional<T>& value) {
  return value ? json(*value) : json();
}
template <class T>
json stated(const T& value) {
  return value;
}

json body_of(const RunRequest& request) {
  json body;
  each_run_key(request, [&](const char* key, const auto& value) {
    if (json given = stated(value); !given.is_null()) body[key] = std::move(given);
  });
  return body;
}

}  // namespace

int run(const Connection& daemon, const RunRequest& request, bool or_full) {
  json body = body_of(request);
  // Touches are stated for a full session: neither for a resumed one, nor for the update before it.
  if (request.resume || (request.update && or_full))
    for (const char* key :
         {"touches", "goal_mm", "region", "find", "accept_change", "check", "seed"})
      body.erase(key);
  const std::int64_t session =
      number(parse(ask(daemon, "POST", "/v1/run", body.dump())), "session");
  const int status = follow(daemon, session, BeforeMotion::kCtrlCEnds,
                            daemon.progress ? Shows::kLinesElsewhere : Shows::kLine);
  if (or_full && g_detached != 0)
    std::fprintf(stderr, "no full session follows (--or-full): this command was to begin it\n");
  if (status != kNotPublishable || !or_full || !needs_full_session(daemon, session)) return status;
  std::fprintf(stderr,
               "session %lld: the update is withheld. A full session begins now (--or-full)\n",
               static_cast<long long>(session));
  RunRequest full = request;
  full.update = false;
  return run(daemon, full);
}

int show_status(const Connection& daemon) {
  const json status = get(daemon, "/v1/status");
  std::string words = status_words(status);
  if (const std::int64_t session = number(status, "session");
      !daemon.json && text_in(status, "phase") == "done" &&
      text_in(status, "kind") == "calibrate") {
    const Response calibration =
        http_request(daemon.socket, "GET", session_path(session) + "/calibration.json");
    if (calibration.status == 200)
      if (const std::string update = update_line(parse(calibration).value("update", json()));
          !update.empty())
        words += "calibration: " + update;
  }
  return print_result(daemon.json, status, words);
}

namespace {

/// As conclude() has it, where nothing more is to be printed.
int status_of_end(const json& status) {
  const std::string phase = text_in(status, "phase");
  if (phase == "failed" || phase == "aborted") return kJobFailed;
  const json outcome = status.value("outcome", json());
  if (!outcome.is_object()) return kSuccess;
  const bool published = text_in(outcome, "kind") != "nothing_changed";  // good, and no new result
  return outcome.value("good", false) && published ? kSuccess : kNotPublishable;
}

}  // namespace

int watch(const Connection& daemon) {
  const json status = get(daemon, "/v1/status");
  if (!is_running(status) && number(status, "session") == 0) return show_status(daemon);
  if (!daemon.json)
    return follow(daemon, number(status, "session"), BeforeMotion::kCtrlCDetaches, Shows::kView);
  // Machine-readable stream: every change, one object per line.
  std::int64_t since = number(status, "seq") - 1;
  while (true) {
    const Response lines =
        ask(daemon, "GET", fmt::format("/v1/watch?since={}", std::max<std::int64_t>(0, since)));
    put(lines.body, {});
    json last;
    for (std::size_t at = 0; at < lines.body.size();) {
      const std::size_t end = std::min(lines.body.find('\n', at), lines.body.size());
      last = calib::parse_json(lines.body.substr(at, end - at));
      at = end + 1;
    }
    if (!last.is_object()) continue;
    since = number(last, "seq");
    if (!is_running(last)) return status_of_end(last);
  }
}

int abort(const Connection& daemon) {
  const json answer = [&] {
    try {
      return parse(ask(daemon, "POST", "/v1/abort", "", kLongestAbort));
    } catch (const SocketError& silent) {
      throw SocketError(std::string(silent.what()) +
                        ". The arm may be moving: press the emergency stop, or release the enabling switch");
    }
  }();
  json status = get(daemon, "/v1/status");
  while (is_running(status)) {
    std::this_thread::sleep_for(kPollInterval);
    status = get(daemon, "/v1/status");
  }
  if (text_in(status, "phase") == "failed") throw std::runtime_error(failure_words(status));
  return print_result(
      daemon.json, status,
      fmt::format("session {}: {}; its touches are kept. {}\n", number(answer, "session"),
                  text_in(status, "phase"), say(then_of(status))));
}

int history(const Connection& daemon) {
  const json list = get(daemon, "/v1/sessions");
  std::string words = fmt::format("{:>5}  {:<24}  {:<15}  {:>9}  {}\n", "id", "started", "outcome",
                                  "touches", "cell, or failure");
  for (const json& session : list) words += session_line(session);
  return print_result(daemon.json, list, list.empty() ? "no sessions yet\n" : words);
}

namespace {

std::optional<ContactsDelay> delay_of_contacts(const json& delay) {
  const auto ms = figure(delay, "ms"), sigma_ms = figure(delay, "sigma_ms");
  if (!ms || !sigma_ms) return std::nullopt;
  return ContactsDelay{*ms / calib::kMsPerS, *sigma_ms / calib::kMsPerS,
                       static_cast<int>(number(delay, "touches"))};
}

}  // namespace

int show(const Connection& daemon, std::int64_t session, Shown shown) {
  const json value = get(daemon, session_path(session));
  if (daemon.json || shown == Shown::kTimes)
    return print_result(daemon.json, value, times_of(value.value("times", json::object())));
  std::string words = session_line(value);
  words += outcome_words(value);
  if (const std::string dropped = text_in(value, "raw_dropped"); !dropped.empty())
    words += "raw events and readings were dropped " + dropped + " (retention)\n";
  const json delay = value.value("contact_delay", json());
  const std::optional<ContactsDelay> contacts = delay_of_contacts(delay);
  const Response calibration =
      http_request(daemon.socket, "GET", session_path(session) + "/calibration.json");
  if (calibration.status == 200) {
    words +=
        result_words(calib::calibration_from_json(calibration.body, "the daemon's calibration"), {},
                     Detail::kAll, contacts);
    words += "results: " + text_in(value, "results") + "\n";
  }
  words += interruption_words(value.value("times", json::object()));
  if (contacts && calibration.status != 200) words += delay_words(nullptr, contacts);
  if (delay.is_object() && !text_in(delay, "warning").empty())
    words += "warning: " + text_in(delay, "warning") + "\n";
  for (const json& event : value.value("events", json::array())) {
    if (event.is_string()) words += "  " + event.get<std::string>() + "\n";
  }
  put(words, {});
  return kSuccess;
}

int fetch_report(const Connection& daemon, std::optional<std::int64_t> session,
                 const std::filesystem::path& output) {
  if (!session) {
    for (const json& one : get(daemon, "/v1/sessions")) {
      if (text_in(one, "state") != "done" || text_in(one, "kind") != "calibrate" ||
          is_imported(one))
        continue;
      session = number(one, "id");
      break;
    }
    if (!session) throw std::runtime_error("no calibration is finished yet. See 'cellcal history'");
  }
  const calib::Language language = language_of(daemon.language);
  const Response html = ask(daemon, "GET",
                            session_path(*session) + "/report.html?language=" + language.code());
  if (!output.empty()) put(html.body, output);
  const std::string where =
      output.empty() ? text_in(get(daemon, session_path(*session)), "results") + "/" +
                           (language == calib::Language() ? "report.html"
                                                          : "report." + language.code() + ".html")
                     : output.string();
  return print_result(daemon.json, {{"session", *session}, {"report", where}}, where + "\n");
}

json parse(const Response& response) {
  json value = calib::parse_json(response.body);
  if (value.is_discarded())
    throw SocketError(
        "the daemon's answer is not JSON. Check that cellcal and cellcald are of the same version");
  return value;
}

Response ask(const Connection& daemon, const char* method, const std::string& target,
             const std::string& body, std::chrono::milliseconds most) {
  Response response = http_request(daemon.socket, method, target, body, most);
  if (response.status < 300) return response;
  const json value = calib::parse_json(response.body);
  const bool words = value.is_object() && value.contains("error") && value["error"].is_string();
  throw DaemonRefusal(words ? value["error"].get<std::string>()
                            : fmt::format("the daemon answered {}", response.status),
                      std::move(response));
}

std::string user_name() {
  const char* before_sudo = std::getenv("SUDO_USER");
  if (before_sudo != nullptr && *before_sudo != '\0') return printable(before_sudo);
  const passwd* entry = ::getpwuid(::getuid());
  return entry != nullptr ? printable(entry->pw_name) : std::to_string(::getuid());
}

int add_token(const Connection& daemon, const std::string& name, const std::string& role) {
  const json body{{"name", name}, {"role", role}};
  const json made = parse(ask(daemon, "POST", "/v1/tokens", body.dump()));
  print_result(daemon.json, made, made.value("token", "") + "\n");
  if (!daemon.json) {
    std::fprintf(stderr,
                 "token \"%s\", role %s: copy it now, it is not shown again. Revoke: 'cellcal "
                 "token remove %s'\n",
                 name.c_str(), role.c_str(), name.c_str());
  }
  return kSuccess;
}

int list_tokens(const Connection& daemon) {
  const json list = parse(ask(daemon, "GET", "/v1/tokens"));
  std::string words = fmt::format("{:<24}  {:<10}  {}\n", "name", "role", "created");
  for (const json& one : list) {
    words += fmt::format("{:<24}  {:<10}  {}\n", one.value("name", ""), one.value("role", ""),
                         one.value("created", ""));
  }
  return print_result(daemon.json, list,
                      list.empty() ? "no tokens: no access over the network\n" : words);
}

int remove_token(const Connection& daemon, const std::string& name) {
  ask(daemon, "DELETE", "/v1/tokens/" + name);
  if (!daemon.json) put("token \"" + name + "\" is no longer accepted\n", {});
  return kSuccess;
}

namespace {

constexpr std::size_t kShown = 10;

std::string entry_words(const json& entry) {
  const json& now = entry.at("now");
  const json& next = entry.at("next");
  calib::Phrase when = "say.cli.schedule.no_next";
  if (!next.is_null())
    when = {"say.cli.schedule.next",
            {{"begin", text_in(next, "begins")}, {"end", text_in(next, "ends")}}};
  if (!now.is_null())
    when = joined("say.join.semicolon", {"say.cli.schedule.now", {{"end", text_in(now, "ends")}}},
                  when);
  const bool on_request = entry.value("on_request", false);
  std::string words =
      fmt::format("{:<16}  {:<10}  {}\n", text_in(entry, "name"), text_in(entry, "kind"),
                  say({on_request ? "say.cli.schedule.entry.on_request" : "say.cli.schedule.entry",
                       {{"when", when}, {"min", entry.value("foreseen_s", 0.0) / 60.0}}}));
  if (const json& last = entry.at("last"); !last.is_null())
    words += fmt::format("{:<16}  {}\n", "",
                         say({"say.cli.schedule.last",
                              {{"at", text_in(last, "at")}, {"words", text_in(last, "words")}}}));
  return words;
}

std::string schedule_words(const json& schedule) {
  std::string text = say(schedule.value("unattended", false)
                             ? calib::Phrase("say.cli.schedule.unattended",
                                             {{"who", schedule.value("responsible", "")}})
                             : "say.cli.schedule.attended") +
                     "\n";
  if (!schedule.at("held").is_null()) text += schedule.value("held", "") + "\n";
  if (schedule.at("entries").empty()) text += say("say.cli.schedule.none") + "\n";
  for (const json& entry : schedule.at("entries")) text += entry_words(entry);
  const json& decisions = schedule.at("decisions");
  if (!decisions.empty()) text += say("say.cli.schedule.decisions") + "\n";
  for (std::size_t i = 0; i < decisions.size() && i < kShown; ++i) {
    text += fmt::format("{}  {:<16}  {}\n", decisions[i].value("at", ""),
                        decisions[i].value("entry", ""), decisions[i].value("words", ""));
  }
  return text;
}

}  // namespace

int show_schedule(const Connection& daemon) {
  const json schedule = get(daemon, "/v1/schedule");
  return print_result(daemon.json, schedule, schedule_words(schedule));
}

int begin_scheduled(const Connection& daemon, const std::string& name) {
  const json made = parse(
      ask(daemon, "POST", in_language(daemon, "/v1/schedule/begin"), json{{"name", name}}.dump()));
  return print_result(daemon.json, made,
                      say({"say.schedule.begun", {{"session", number(made, "session")}}}) + "\n");
}

int release_schedule(const Connection& daemon) {
  const json answer = parse(ask(daemon, "POST", in_language(daemon, "/v1/schedule/release")));
  return print_result(daemon.json, answer, say("say.cli.schedule.released") + "\n");
}

}  // namespace cellcal::daemon
