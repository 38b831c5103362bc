#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

#include "daemon/cli/actions.h"
#include "daemon/cli/client.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/frames.h"
#include "daemon/cli/offline.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

namespace {

constexpr const char* kDefaultSocket = "/run/cellcal/cellcald.sock";

void add_progress(CLI::App* command, Connection& daemon) {
  command->add_flag("--progress", daemon.progress,
                    "Print progress every 10 s on standard error, even without a terminal");
}

void add_load(CLI::App* command, std::string& load) {
  command->add_option("--load", load,
                      "What the tools hold in all touches: a [[load]] of the cell file by its id "
                      "[nothing]");
}

void add_run(CLI::App& app, int& status) {
  auto given = std::make_shared<RunRequest>();
  auto or_full = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("run", "Calibrate the cell: touch, identify, report");
  command->footer(
      "Ctrl-C detaches and the session continues; before anything has moved it ends the "
      "session.\n'cellcal abort' stops the arm.\nExample: cellcal run --cell cell.toml "
      "--touches 100 --check 10\n         cellcal run --cell cell.toml --goal 0.15\n         "
      "cellcal run --cell cell.toml --update\n         cellcal run --resume");
  auto daemon = add_connection(command);
  add_progress(command, *daemon);
  add_load(command, given->load);
  auto* cell = command->add_option("--cell", given->cell, "Cell file (TOML)");
  command
      ->add_option("--goal", given->goal_mm,
                   "Accuracy to reach: u95 in mm, mean over the region. Each touch is chosen "
                   "from the results so far, until this is reached or more touches gain too "
                   "little")
      ->check(between(0.01, 10.0));
  command
      ->add_option("--touches", given->fit_touches,
                   "Touches for the fit; with --goal the most, at least 5 per target [100, with "
                   "--goal 200]")
      ->check(between(4, 2000));
  command->add_flag("--find", given->find,
                    "Find the spheres by touch first: for rough centres in the cell file");
  command->add_flag(
      "--accept-change", given->accept_change,
      "Publish although the arm changed since its last calibration: it was repaired, hit or "
      "mastered");
  auto* update = command->add_flag(
      "--update", given->update,
      "Calibrate again in under a minute on top of the last calibration, by at most 15 touches: "
      "for one change since (tool knocked, sphere moved, joint mastered, arm warmer). After a "
      "collision run a full session: two changes can look like one");
  command
      ->add_flag(
          "--or-full", *or_full,
          "With --update: where it is withheld (more than one change, or not resolved), go on with "
          "a full session at once, with --touches, --check, --goal as given. Not where a sphere "
          "was not found: look at it first")
      ->needs(update);
  command->add_option("--region", given->region, "Where accuracy matters, as in 'cellcal plan'")
      ->capture_default_str();
  command->add_option("--check", given->check_touches, "Held-out touches, to check the result")
      ->check(between(0, 2000))
      ->capture_default_str();
  command->add_option("--seed", given->seed, "Seed of the plan: same seed, same plan")
      ->capture_default_str();
  command->add_flag("--resume", given->resume, "Resume the newest unfinished session");
  command->callback([=, &status] {
    if (!given->resume && cell->count() == 0) {
      throw CLI::RequiredError("--cell (or --resume)");
    }
    status = run(*daemon, *given, *or_full);
  });
}

/// A command that runs a session of this kind.
RequestCommand<RunRequest> add_session(CLI::App& app, int& status, SessionKind kind,
                                       const char* words, const std::string& footer) {
  auto added = add_request<RunRequest>(
      app, status, to_string(kind), words, footer,
      [](const Connection& daemon, const RunRequest& request) { return run(daemon, request); });
  added.given->kind = kind;
  add_progress(added.command, *added.connection);
  add_load(added.command, added.given->load);
  return added;
}

void add_qualify(CLI::App& app, int& status) {
  const auto [command, given, connection] = add_session(
      app, status, SessionKind::kQualify,
      "Measure the contact itself: touch noise, overtravel, latch delay, effective radius",
      "Before the first calibration, and after work on tip, sensor or wiring. It touches one sphere at "
      "six\nplaces, several times each, and compares the figures with what the cell file states. Exit "
      "status 3:\nnot as stated.\nExample: cellcal qualify --cell cell.toml --target S1");
  command->add_option("--cell", given->cell, "Cell file (TOML)")->required();
  command->add_option("--target", given->target, "Sphere to touch [the first one]");
}

void add_dry_run(CLI::App& app, int& status) {
  const auto [command, given, connection] = add_session(
      app, status, SessionKind::kDryRun,
      "Follow the path of a calibration slowly, without touching anything",
      "Before the first calibration, and after anything was moved in the cell. From stand-off to stand-off at a tenth of "
      "the\naxis speeds or less; nothing is searched. What the tip meets stops the arm and ends it. 'cellcal run' with "
      "the\nsame cell file, touches, check and seed goes the same way. Run it in T1.\n"
      "Example: cellcal dry-run --cell cell.toml --touches 100 --check 10");
  command->add_option("--cell", given->cell, "Cell file (TOML)")->required();
  command
      ->add_option("--touches", given->fit_touches.emplace(calib::kUsualTouches), "Touches for the fit")
      ->capture_default_str()
      ->check(between(4, 2000));
  command->add_option("--check", given->check_touches, "Check touches")
      ->capture_default_str()
      ->check(between(0, 2000));
  command->add_option("--seed", given->seed, "Seed of the plan")->capture_default_str();
}

void add_find(CLI::App& app, int& status) {
  const auto [command, given, connection] = add_session(
      app, status, SessionKind::kFind, "Find the spheres by touch, and print their centres",
      "For a cell file with rough centres (centre_sigma_mm) or boxes to search. At least six touches of each sphere; the\n"
      "centres are good enough to plan on. Nothing is calibrated and no file is changed. A positioner stays\n"
      "at its present angles; a sphere on it is stated in the frame of its axis, with these angles (taught_deg).\n"
      "Example: cellcal find --cell cell.toml");
  command->add_option("--cell", given->cell, "Cell file (TOML)")->required();
}

void add_check(CLI::App& app, int& status) {
  const auto [command, given, connection] = add_session(
      app, status, SessionKind::kCheck,
      "Check by six to eight touches whether the last calibration still holds",
      "Prints the TCP shift and, if it does not hold, what changed: the tool, a sphere, a joint or "
      "the\nlength of the whole arm, with the likelihood of each. Exit status 0: it holds; 3: it does not; 1: "
      "the check\nitself failed.\nExample: cellcal check\n         cellcal check --calibration 7 --json\n         cellcal check --mastered A2,A3");
  command->add_option("--cell", given->cell,
                      "Cell file (TOML) of the calibration [the one calibrated last]");
  command
      ->add_option("--calibration", given->calibration,
                   "Session of the calibration to check [the one in use]")
      ->check(session_number());
  command
      ->add_option(
          "--temperature", given->temperature_c,
          "Cell temperature in deg C, for temperature compensation in 'cellcal history --drift'")
      ->check(between(-40.0, 80.0));
  command
      ->add_option(
          "--mastered", given->mastered,
          "Joints that were mastered by 'cellcal mastering': four to six touches in 20 s show what is left of "
          "their zeros")
      ->delimiter(',')
      ->transform([](std::string name) { return CLI::detail::trim(name); });
}

void add_watch(CLI::App& app, int& status) {
  add_request<NoOptions>(
      app, status, "watch", "Follow the running session to its end",
      "On a terminal: progress, residuals of the touches and quality of the links; elsewhere a line\n"
      "every 10 s on standard error.\nExample: cellcal watch",
      [](const Connection& daemon, const NoOptions&) { return watch(daemon); });
}

void add_show(CLI::App& app, int& status) {
  struct Given {
    std::optional<std::int64_t> session;
    bool times = false;
  };
  const auto [command, given, connection] = add_request<Given>(
      app, status, "show", "Show one session: its events and its result",
      "Example: cellcal show 7\n         cellcal show 7 --times",
      [](const Connection& daemon, const Given& of) {
        return show(daemon, of.session, of.times ? Shown::kTimes : Shown::kEventsAndResult);
      });
  command->add_option("ID", given->session, "Number of the session; default: the newest")
      ->check(session_number());
  command->add_flag("--times", given->times, "Only the time spent, per touch and activity");
}

void add_report(CLI::App& app, int& status) {
  struct Given {
    std::optional<std::int64_t> session;
    std::filesystem::path output;
  };
  const auto [command, given, connection] = add_request<Given>(
      app, status, "report", "Print the path of a session's report, or copy it",
      "Example: cellcal report 7 -o report.html", [](const Connection& daemon, const Given& of) {
        return fetch_report(daemon, of.session, of.output);
      });
  command
      ->add_option("ID", given->session,
                   "Number of the session; default: the newest calibration that is finished")
      ->check(session_number());
  add_output(*command, given->output, "Copy the report to this file (HTML)");
}

void add_plain(CLI::App& app, int& status, const char* name, const char* words,
               int (*act)(const Connection&), const std::string& footer) {
  add_request<NoOptions>(app, status, name, words, footer,
                         [act](const Connection& daemon, const NoOptions&) { return act(daemon); });
}

void add_history(CLI::App& app, int& status) {
  const auto [command, drift, connection] = add_request<bool>(
      app, status, "history", "List all sessions, newest first",
      "--drift: the checks of the newest calibration as a control chart. Exit status 0: in control, a warning or too "
      "few checks;\n3: alarm.\nExample: cellcal history --json\n         cellcal history --drift",
      [](const Connection& daemon, bool charted) {
        return charted ? show_drift(daemon) : history(daemon);
      });
  command->add_flag("--drift", *drift,
                    "Control chart of the checks: drift, since when, what to do");
}

/// Prints the token, which cannot be shown again.
int add_token(const Connection& daemon, const std::string& name, const std::string& role) {
  const nlohmann::json body{{"name", name}, {"role", role}};
  const nlohmann::json made = parse(ask(daemon, "POST", "/v1/tokens", body.dump()));
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
  const nlohmann::json list = parse(ask(daemon, "GET", "/v1/tokens"));
  std::string words = fmt::format("{:<24}  {:<10}  {}\n", "name", "role", "created");
  for (const nlohmann::json& one : list) {
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

void add_token_commands(CLI::App& app, int& status) {
  struct Given {
    std::string name, role = "look";
  };
  CLI::App* token = app.add_subcommand("token", "Manage access over the network");
  token->footer(
      "Roles: look sees everything; operate starts and aborts sessions as well; administer adds and "
      "removes tokens as well.\nExample: cellcal token add --role look --name wall-screen\n         "
      "cellcal token list --json\n         cellcal token remove wall-screen");
  token->require_subcommand(1);
  const auto [add, given, connection] =
      add_request<Given>(*token, status, "add", "Make a token and print it, once",
                         "Example: cellcal token add --role look --name wall-screen",
                         [](const Connection& daemon, const Given& of) {
                           return add_token(daemon, of.name, of.role);
                         });
  add->add_option("--role", given->role, "look, operate or administer")
      ->required()
      ->check(one_of({"look", "operate", "administer"}));
  add->add_option("--name", given->name, "Name in lists and logs")->required();
  add_plain(*token, status, "list", "List the tokens: names and roles", list_tokens,
            "Example: cellcal token list --json");
  const auto [remove, name, same] =
      add_request<std::string>(*token, status, "remove", "Revoke a token and all its logins",
                               "Example: cellcal token remove wall-screen", remove_token);
  remove->add_option("NAME", *name, "Its name, as 'cellcal token list' shows it")->required();
}

}  // namespace

std::shared_ptr<Connection> add_connection(CLI::App* command) {
  auto daemon = std::make_shared<Connection>();
  const char* set = std::getenv("CELLCAL_SOCKET");
  daemon->socket = set != nullptr && *set != '\0' ? set : kDefaultSocket;
  command->add_option("--socket", daemon->socket, "The daemon's socket (or set $CELLCAL_SOCKET)")
      ->capture_default_str();
  add_json(*command, daemon->json);
  add_language(*command, daemon->language);
  return daemon;
}

void add_client_commands(CLI::App& app, int& status) {
  add_run(app, status);
  add_qualify(app, status);
  add_find(app, status);
  add_dry_run(app, status);
  add_check(app, status);
  add_plain(app, status, "status", "Show what the daemon is doing", show_status,
            "Example: cellcal status --json");
  add_plain(
      app, status, "position", "Print the arm's axis angles in degrees, over EKI; nothing moves",
      show_position,
      "For a sphere that is taught: jog the tip onto its top until it just touches, release the "
      "keys, and give the angles\nto 'cellcal new-cell'. EKI only.\nExample: cellcal position");
  add_watch(app, status);
  add_plain(app, status, "abort", "Stop the arm and end the session", abort,
            "Example: cellcal abort --json");
  add_history(app, status);
  add_show(app, status);
  add_report(app, status);
  add_token_commands(app, status);
}

}  // namespace cellcal::daemon
