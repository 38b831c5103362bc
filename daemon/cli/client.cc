#include "daemon/cli/client.h"

#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

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

/// The daemon answers an abort at once, its status within a second on a busy computer, and a run when the devices of the
/// session before are closed.
constexpr std::chrono::seconds kLongestAbort{3}, kLongestStatus{10}, kLongestRun{60};

volatile std::sig_atomic_t g_detached = 0;

/// From now on Ctrl-C sets g_detached.
void catch_interrupts() {
  struct sigaction interrupt {};
  interrupt.sa_handler = [](int) { g_detached = 1; };
  interrupt.sa_flags = SA_RESTART;  // a pending request to the daemon is completed
  ::sigaction(SIGINT, &interrupt, nullptr);
}

/// How to go on after a session that is not done.
calib::Phrase then_of(const json& session) {
  const std::string anew = text_in(session, "anew"), failure = text_in(session, "failure");
  if (!anew.empty()) return {"say.cli.then.anew", {{"command", anew}}};
  if (session.value("resumable", true)) return "say.cli.then.resume";
  return calib::Phrase(say("failure." + failure) + " " + say("do." + failure));
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
  const calib::Phrase causes = phrase(counts);
  return said({causes.empty() ? "say.cli.interruptions" : "say.cli.interruptions.by_cause",
               {{"n", all}, {"causes", causes}}});
}

/// Missing links; empty without any.
calib::Phrase waited_for(const json& status) {
  const json waiting = status.value("waiting", json());
  if (!waiting.is_object()) return {};
  return calib::joined("say.join.and", waiting.value("robot", false) ? "say.cli.waiting.robot" : "",
                       waiting.value("contact", false) ? "say.cli.waiting.contact" : "");
}

/// Operator action while the controller is missing; otherwise the sensor's message.
std::string what_to_do(const json& status) {
  const json waiting = status.value("waiting", json());
  if (!waiting.is_object()) return "";
  const std::string start = waiting.value("robot", false) ? text_in(waiting, "start") : "";
  const std::string sensor = waiting.value("contact", false) ? text_in(status, "contact") : "";
  return start.empty() ? sensor : start;
}

std::string phase_words(const json& status) { return say("say.phase." + text_in(status, "phase")); }

Progress progress_of(const json& status) {
  if (const calib::Phrase what = waited_for(status); !what.empty()) {
    Progress progress{say({"say.cli.waiting.for", {{"what", what}}}),
                      "",
                      0,
                      0,
                      {},
                      figure(status["waiting"], "left_s")};
    progress.done = static_cast<std::size_t>(number(status, "touches"));
    progress.total = static_cast<std::size_t>(number(status, "planned"));
    return progress;
  }
  const std::string stage = text_in(status, "stage"), phase = phase_words(status);
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
    words += said(calib::phrase_of(line));
  words += say(last.empty() ? calib::Phrase("say.cli.figures",
                                            {{"file", text_in(status, "results") + "/" + file}})
                            : last);
  print_result(daemon.json, result, words + "\n");
  return flag == nullptr || result.value(flag, false) ? kSuccess : kNotPublishable;
}

/// Prints the result of a session; the exit status follows from it.
int conclude(const Connection& daemon, const json& status) {
  const std::int64_t session = number(status, "session");
  const std::string phase = text_in(status, "phase");
  if (const auto why = failure_words(status); !why.empty()) throw std::runtime_error(why);
  if (phase == "aborted") {
    throw std::runtime_error(
        say({"say.cli.aborted", {{"session", session}, {"then", then_of(status)}}}));
  }
  const std::string kind = text_in(status, "kind");
  if (kind == "qualify") return conclude_with(daemon, status, "qualification.json", "passed");
  if (kind == "check") return conclude_with(daemon, status, "check.json", "holds");
  if (kind == "find")
    return conclude_with(daemon, status, "found.json", nullptr, "say.cli.found.do");
  if (kind == "dry-run")  // one that did not fail has covered the whole path
    return print_result(daemon.json, status,
                        said({"say.cli.dry_run", {{"n", number(status, "touches")}}}));
  const Response calibration = ask(daemon, "GET", session_path(session) + "/calibration.json");
  const calib::Calibration result =
      calib::calibration_from_json(calibration.body, "the daemon's calibration");
  json value = status;
  value["residuals"] = json::parse(calibration.body).value("residuals", json());
  const std::string why = text_in(status, "why_ended");
  print_result(
      daemon.json, value,
      (why.empty() ? "" : said({"say.cli.stopped", {{"why", why}}})) + result_words(result) +
          said({"say.cli.report", {{"file", text_in(status, "results") + "/report.html"}}}));
  return result.verdict.publish() ? kSuccess : kNotPublishable;
}

std::string links_words(const json& status) {
  const json links = status.value("links", json());
  if (!links.is_object()) return "";
  return said(robot_link_phrase(links.value("robot", json()))) +
         said(contact_link_phrase(links.value("contact", json())));
}

/// Effect of Ctrl-C before the first motion.
enum class BeforeMotion { kCtrlCEnds, kCtrlCDetaches };

/// True before any motion: nothing moves before both links are up.
bool before_motion(const json& status) {
  const std::string phase = text_in(status, "phase");
  return phase == "planning" || phase == "connecting";
}

json request_abort(const Connection& daemon) try {
  return parse(ask(daemon, "POST", "/v1/abort", "", kLongestAbort));
} catch (const ClientSocketError& silent) {
  throw ClientSocketError({"say.cli.may_move", {{"words", silent.sentence}}});
}

/// Ends a session before its first motion; a motion begun meanwhile is stopped.
int end_session(const Connection& daemon, std::int64_t session) {
  try {
    request_abort(daemon);
  } catch (const DaemonRefusal&) {  // the session has already ended
  }
  json status = get(daemon, "/v1/status");
  while (is_running(status) && number(status, "session") == session) {
    std::this_thread::sleep_for(kPollInterval);
    status = get(daemon, "/v1/status");
  }
  if (text_in(status, "phase") != "aborted") return conclude(daemon, status);
  fmt::print(stderr, "{}", said({"say.cli.ended_at_rest", {{"session", session}}}));
  return kJobFailed;
}

/// Warnings about cell file and plan.
std::vector<std::string> warnings_of(const json& status) {
  std::vector<std::string> all;
  for (const json& one : status.value("warnings", json::array()))
    if (one.is_string())
      all.push_back(said({"say.cli.warning", {{"words", one.get<std::string>()}}}));
  return all;
}

/// Follows a session to its end, or to Ctrl-C.
int follow(const Connection& daemon, std::int64_t session, BeforeMotion ctrl_c, Shows shows) {
  catch_interrupts();
  ProgressDisplay display(shows);
  json status;
  std::size_t warned = 0;
  while (g_detached == 0) {
    try {
      status = get(daemon, "/v1/status", kLongestStatus);
    } catch (const SocketError&) {
      throw ClientSocketError({"say.cli.lost", {{"session", session}}});
    }
    if (number(status, "session") != session) {
      throw std::runtime_error(say({"say.cli.not_running", {{"session", session}}}));
    }
    for (const auto warnings = warnings_of(status); warned < warnings.size(); ++warned) {
      display.clear();
      std::fputs(warnings[warned].c_str(), stderr);
    }
    if (!is_running(status)) {
      display.clear();
      return conclude(daemon, status);
    }
    if (const calib::Phrase what = waited_for(status); !what.empty())
      display.say(
          say({ctrl_c == BeforeMotion::kCtrlCEnds ? "say.cli.waiting.ctrl_c" : "say.cli.waiting",
               {{"what", what}, {"do", what_to_do(status)}}}));
    Progress progress = progress_of(status);
    progress.links = said(arm_phrase(status.value("arm", json()))) + links_words(status);
    display.show(progress);
    std::this_thread::sleep_for(kPollInterval);
  }
  display.clear();
  // Before the first status the user has not been informed of any motion.
  if (ctrl_c == BeforeMotion::kCtrlCEnds && (status.is_null() || before_motion(status))) {
    return end_session(daemon, session);
  }
  fmt::print(stderr, "{}", said({"say.cli.detached", {{"session", session}}}));
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
    return said({text_in(left, "kind") == "dry-run" ? "say.cli.idle.interrupted.dry_run"
                                                    : "say.cli.idle.interrupted",
                 {{"session", number(left, "session")},
                  {"started", text_in(left, "started")},
                  {"touches", number(left, "touches")},
                  {"planned", number(left, "planned")},
                  {"ending", say("state." + text_in(left, "ending"))},
                  {"then", then_of(left)}}});
  }
  if (session == 0) return said("say.cli.idle");
  std::string words =
      say({"say.cli.session",
           {{"session", session}, {"phase", "say.phase." + text_in(status, "phase")}}}) +
      load_words(status) + "\n";
  words += outcome_words(status);
  for (const std::string& warning : warnings_of(status)) words += warning;
  if (number(status, "planned") > 0) words += progress_line(progress_of(status), 1000) + "\n";
  if (const calib::Phrase what = waited_for(status); !what.empty())
    words += said({"say.cli.waiting", {{"what", what}, {"do", what_to_do(status)}}});
  words += interruption_words(status);
  if (const auto left = figure(status, "busy_left_s");
      left && text_in(status, "phase") == "recovering")
    words += said({"say.cli.busy", {{"s", *left}}});
  const auto add = [&](const char* id, const char* key) {
    if (const std::string of = text_in(status, key); !of.empty())
      words += said({id, {{"words", of}}});
  };
  add("say.cli.robot", "robot");
  add("say.cli.contact", "contact");
  if (text_in(status, "phase") != "done") words += said(arm_phrase(status.value("arm", json())));
  words += links_words(status);
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

std::optional<ContactsDelay> delay_of_contacts(const json& delay) {
  const auto ms = figure(delay, "ms"), sigma_ms = figure(delay, "sigma_ms");
  if (!ms || !sigma_ms) return std::nullopt;
  return ContactsDelay{*ms / calib::kMsPerS, *sigma_ms / calib::kMsPerS,
                       static_cast<int>(number(delay, "touches"))};
}

/// Kind of a session; empty for a calibration, the default.
std::string kind_words(const json& session) {
  const std::string kind = text_in(session, "kind");
  if (kind.empty() || kind == to_string(SessionKind::kCalibrate)) return "";
  return say({"say.cli.history.kind", {{"kind", say("kind." + kind)}}});
}

/// State with the outcome, since 'done' alone would read as a success. Without a recorded outcome: whether a
/// calibration was published.
std::string state_word(const json& session) {
  const json outcome = session.value("outcome", json()),
             published = session.value("published", json());
  if (outcome.is_object()) return say("history." + text_in(outcome, "kind"));
  return say(!published.is_boolean() ? "state." + text_in(session, "state")
             : published.get<bool>() ? "history.published"
                                     : "history.withheld");
}

/// True for a session of another journal, and perhaps of another cell.
bool is_imported(const json& session) {
  return session.contains("imported") && !session["imported"].is_null();
}

std::string session_line(const json& session) {
  const std::string kind = kind_words(session);
  const std::string touches =
      text_in(session, "kind") == "dry-run"  // it makes none
          ? "-"
          : fmt::format("{:>4}/{:<4}", number(session, "touches"), number(session, "planned"));
  return fmt::format(
      "{:>5}  {:<24}  {:<15}  {:^9}  {}{}{}\n", number(session, "id"), text_in(session, "started"),
      state_word(session), touches, kind,
      text_in(session, "failure").empty() ? text_in(session, "cell") : text_in(session, "failure"),
      load_words(session) + (is_imported(session) ? say("say.cli.history.imported") : ""));
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

int run(const Connection& daemon, const RunRequest& request, bool or_full) {
  json body = body_of(request);
  // Touches are stated for a full session: neither for a resumed one, nor for the update before it.
  if (request.resume || (request.update && or_full))
    for (const char* key :
         {"touches", "goal_mm", "region", "find", "accept_change", "check", "seed"})
      body.erase(key);
  catch_interrupts();  // the arm may move from the request on
  const std::int64_t session =
      number(parse(ask(daemon, "POST", "/v1/run", body.dump(), kLongestRun)), "session");
  const int status = follow(daemon, session, BeforeMotion::kCtrlCEnds,
                            daemon.progress ? Shows::kLinesElsewhere : Shows::kLine);
  if (or_full && g_detached != 0) fmt::print(stderr, "{}", said("say.cli.no_full_session"));
  if (status != kNotPublishable || !or_full || !needs_full_session(daemon, session)) return status;
  fmt::print(stderr, "{}", said({"say.cli.full_session", {{"session", session}}}));
  RunRequest full = request;
  full.update = false;
  return run(daemon, full);
}

int show_status(const Connection& daemon) {
  const json status = get(daemon, "/v1/status", kLongestStatus);
  std::string words = status_words(status);
  if (const std::int64_t session = number(status, "session");
      !daemon.json && text_in(status, "phase") == "done" && text_in(status, "kind") == "calibrate")
    if (const auto update = update_of(daemon, session))
      words += said({"say.cli.update", {{"words", update_phrase(*update)}}});
  return print_result(daemon.json, status, words);
}

int watch(const Connection& daemon) {
  const json status = get(daemon, "/v1/status", kLongestStatus);
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
  const json answer = request_abort(daemon);
  json status = get(daemon, "/v1/status");
  while (is_running(status)) {
    std::this_thread::sleep_for(kPollInterval);
    status = get(daemon, "/v1/status");
  }
  if (text_in(status, "phase") == "failed") throw std::runtime_error(failure_words(status));
  return print_result(daemon.json, status,
                      said({"say.cli.ended",
                            {{"session", number(answer, "session")},
                             {"phase", "say.phase." + text_in(status, "phase")},
                             {"then", then_of(status)}}}));
}

int history(const Connection& daemon) {
  const json list = get(daemon, "/v1/sessions");
  std::string words = fmt::format("{:>5}  {:<24}  {:<15}  {:>9}  {}\n", "id",
                                  say("say.cli.history.started"), say("say.cli.history.outcome"),
                                  say("say.cli.history.touches"), say("say.cli.history.cell"));
  for (const json& session : list) words += session_line(session);
  return print_result(daemon.json, list, list.empty() ? said("say.cli.history.none") : words);
}

int show(const Connection& daemon, std::optional<std::int64_t> asked, Shown shown) {
  if (!asked) {
    const json list = get(daemon, "/v1/sessions");
    if (list.empty()) throw std::runtime_error(say("say.cli.history.none"));
    asked = number(list.front(), "id");
  }
  const std::int64_t session = *asked;
  const json value = get(daemon, session_path(session));
  if (daemon.json || shown == Shown::kTimes)
    return print_result(daemon.json, value, times_of(value.value("times", json::object())));
  // The remedy is read last: a session has some hundred events.
  std::string words = session_line(value);
  for (const json& event : value.value("events", json::array()))
    if (event.is_string()) words += "  " + event.get<std::string>() + "\n";
  words += outcome_words(value);
  if (const std::string dropped = text_in(value, "raw_dropped"); !dropped.empty())
    words += said({"say.cli.raw_dropped", {{"at", dropped}}});
  const json delay = value.value("contact_delay", json());
  const std::optional<ContactsDelay> contacts = delay_of_contacts(delay);
  const Response calibration =
      http_request(daemon.socket, "GET", session_path(session) + "/calibration.json");
  if (calibration.status == 200) {
    words +=
        result_words(calib::calibration_from_json(calibration.body, "the daemon's calibration"), {},
                     Detail::kAll, contacts);
    if (const std::string results = text_in(value, "results"); !is_missing(results))
      words += said({"say.cli.results", {{"words", results}}});
  }
  words += interruption_words(value.value("times", json::object()));
  if (contacts && calibration.status != 200) words += delay_words(nullptr, contacts);
  if (delay.is_object() && !text_in(delay, "warning").empty())
    words += said({"say.cli.warning", {{"words", text_in(delay, "warning")}}});
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
    if (!session) throw std::runtime_error(say("say.cli.report.none"));
  }
  const calib::Language language = language_of(daemon.language);
  const Response html =
      ask(daemon, "GET", session_path(*session) + "/report.html?language=" + language.code());
  if (!output.empty()) put(html.body, output);
  const std::string folder = text_in(get(daemon, session_path(*session)), "results");
  const std::string name =
      language == calib::Language() ? "report.html" : "report." + language.code() + ".html";
  const std::string where = output.empty() ? folder + "/" + name : output.string();
  if (output.empty() && is_missing(where))
    throw std::runtime_error(say({"say.cli.report.no_file", {{"file", where}}}));
  return print_result(daemon.json, {{"session", *session}, {"report", where}}, where + "\n");
}

std::string in_language(const Connection& daemon, const std::string& target) {
  const calib::Language language = language_of(daemon.language);
  if (daemon.json || language == calib::Language()) return target;
  return target + (target.find('?') == std::string::npos ? "?" : "&") +
         "language=" + language.code();
}

json get(const Connection& daemon, const std::string& target, std::chrono::milliseconds most) {
  return parse(ask(daemon, "GET", in_language(daemon, target), "", most));
}

json parse(const Response& response) {
  json value = calib::parse_json(response.body);
  if (value.is_discarded()) throw ClientSocketError("say.socket.no_json");
  return value;
}

bool is_missing(const std::filesystem::path& path) {
  std::error_code unknown;
  return !std::filesystem::exists(path, unknown) && !unknown;
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

}  // namespace cellcal::daemon
