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

}  // namespace

std::shared_ptr<Connection> add_connection(CLI::App* command) {
  auto daemon = std::make_shared<Connection>();
  const char* set = std::getenv("CELLCAL_SOCKET");
  daemon->socket = set != nullptr && *set != '\0' ? set : kDefaultSocket;
  command->add_option("--socket", daemon->socket, "The daemon's socket (or set $CELLCAL_SOCKET)")
      ->capture_default_str();
  command->add_flag("--json", daemon->json, "Print JSON");
  add_language(*command, daemon->language);
  return daemon;
}

namespace {

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
      "--touches 50 --check 10\n         cellcal run --cell cell.toml --goal 0.15\n         "
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
                   "Touches for the fit; with --goal the most, at least 5 per target [50, with "
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

void add_qualify(CLI::App& app, int& status) {
  auto given = std::make_shared<RunRequest>();
  given->kind = SessionKind::kQualify;
  CLI::App* command = app.add_subcommand(
      "qualify",
      "Measure the contact itself: touch noise, overtravel, latch delay, effective radius");
  command->footer(
      "Before the first calibration, and after work on tip, sensor or wiring. It touches one sphere at "
      "six\nplaces, several times each, and compares the figures with what the cell file states. Exit "
      "status 3:\nnot as stated.\nExample: cellcal qualify --cell cell.toml --target S1");
  auto daemon = add_connection(command);
  add_progress(command, *daemon);
  add_load(command, given->load);
  command->add_option("--cell", given->cell, "Cell file (TOML)")->required();
  command->add_option("--target", given->target, "Sphere to touch [the first one]");
  command->callback([=, &status] { status = run(*daemon, *given); });
}

void add_dry_run(CLI::App& app, int& status) {
  auto given = std::make_shared<RunRequest>();
  given->kind = SessionKind::kDryRun;
  CLI::App* command = app.add_subcommand(
      "dry-run", "Follow the path of a calibration slowly, without touching anything");
  command->footer(
      "Before the first calibration, and after anything was moved in the cell. From stand-off to stand-off at a tenth of "
      "the\naxis speeds or less; nothing is searched. What the tip meets stops the arm and ends it. 'cellcal run' with "
      "the\nsame cell file, touches, check and seed goes the same way. Run it in T1.\n"
      "Example: cellcal dry-run --cell cell.toml --touches 50 --check 10");
  auto daemon = add_connection(command);
  add_progress(command, *daemon);
  add_load(command, given->load);
  command->add_option("--cell", given->cell, "Cell file (TOML)")->required();
  command
      ->add_option("--touches", given->fit_touches.emplace(kPlannedTouches), "Touches for the fit")
      ->capture_default_str()
      ->check(between(4, 2000));
  command->add_option("--check", given->check_touches, "Check touches")
      ->capture_default_str()
      ->check(between(0, 2000));
  command->add_option("--seed", given->seed, "Seed of the plan")->capture_default_str();
  command->callback([=, &status] { status = run(*daemon, *given); });
}

void add_find(CLI::App& app, int& status) {
  auto given = std::make_shared<RunRequest>();
  given->kind = SessionKind::kFind;
  CLI::App* command =
      app.add_subcommand("find", "Find the spheres by touch, and print their centres");
  command->footer(
      "For a cell file with rough centres (centre_sigma_mm) or boxes to search. At least six touches of each sphere; the\n"
      "centres are good enough to plan on. Nothing is calibrated and no file is changed. A positioner stays\n"
      "at its present angles; a sphere on it is stated in the frame of its axis, with these angles (taught_deg).\n"
      "Example: cellcal find --cell cell.toml");
  auto daemon = add_connection(command);
  add_progress(command, *daemon);
  add_load(command, given->load);
  command->add_option("--cell", given->cell, "Cell file (TOML)")->required();
  command->callback([=, &status] { status = run(*daemon, *given); });
}

void add_check(CLI::App& app, int& status) {
  auto given = std::make_shared<RunRequest>();
  given->kind = SessionKind::kCheck;
  CLI::App* command = app.add_subcommand(
      "check", "Check by six to eight touches whether the last calibration still holds");
  command->footer(
      "Prints the TCP shift and, if it does not hold, what changed: the tool, a sphere, a joint or "
      "the\nlength of the whole arm, with the likelihood of each. Exit status 0: it holds; 3: it does not; 1: "
      "the check\nitself failed.\nExample: cellcal check\n         cellcal check --calibration 7 --json\n         cellcal check --mastered A2,A3");
  auto daemon = add_connection(command);
  add_progress(command, *daemon);
  add_load(command, given->load);
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
  command->callback([=, &status] { status = run(*daemon, *given); });
}

void add_watch(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("watch", "Follow the running session to its end");
  command->footer(
      "On a terminal: progress, residuals of the touches and quality of the links; elsewhere a line\n"
      "every 10 s on standard error.\nExample: cellcal watch");
  auto daemon = add_connection(command);
  add_progress(command, *daemon);  // accepted for compatibility; always active
  command->callback([=, &status] { status = watch(*daemon); });
}

void add_show(CLI::App& app, int& status) {
  struct Given {
    std::int64_t session = 0;
    bool times = false;
  };
  auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand("show", "Show one session: its events and its result");
  command->footer("Example: cellcal show 7\n         cellcal show 7 --times");
  auto daemon = add_connection(command);
  command->add_option("ID", given->session, "Number of the session")
      ->required()
      ->check(session_number());
  command->add_flag("--times", given->times, "Only the time spent, per touch and activity");
  command->callback([=, &status] {
    status = show(*daemon, given->session, given->times ? Shown::kTimes : Shown::kEventsAndResult);
  });
}

void add_report(CLI::App& app, int& status) {
  struct Given {
    std::int64_t session = 0;
    std::filesystem::path output;
  };
  auto given = std::make_shared<Given>();
  CLI::App* command =
      app.add_subcommand("report", "Print the path of a session's report, or copy it");
  command->footer("Example: cellcal report 7 -o report.html");
  auto daemon = add_connection(command);
  command
      ->add_option("ID", given->session,
                   "Number of the session; default: the newest calibration that is finished")
      ->check(session_number());
  command->add_option("-o,--output,--out", given->output, "Copy the report to this file (HTML)");
  command->callback([=, &status] {
    status = fetch_report(
        *daemon, given->session > 0 ? std::optional(given->session) : std::nullopt, given->output);
  });
}

void add_plain(CLI::App& app, int& status, const char* name, const char* words,
               int (*act)(const Connection&)) {
  CLI::App* command = app.add_subcommand(name, words);
  command->footer(std::string("Example: cellcal ") + name + " --json");
  auto daemon = add_connection(command);
  command->callback([=, &status] { status = act(*daemon); });
}

void add_position(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand(
      "position", "Print the arm's axis angles in degrees, over EKI; nothing moves");
  command->footer(
      "For a sphere that is taught: jog the tip onto its top until it just touches, release the "
      "keys, and give the angles\nto 'cellcal new-cell'. EKI only.\nExample: cellcal position");
  auto daemon = add_connection(command);
  command->callback([=, &status] { status = show_position(*daemon); });
}

void add_history(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("history", "List all sessions, newest first");
  command->footer(
      "--drift: the checks of the newest calibration as a control chart. Exit status 0: in control, a warning or too "
      "few checks;\n3: alarm.\nExample: cellcal history --json\n         cellcal history --drift");
  auto daemon = add_connection(command);
  auto drift = std::make_shared<bool>(false);
  command->add_flag("--drift", *drift,
                    "Control chart of the checks: drift, since when, what to do");
  command->callback([=, &status] { status = *drift ? show_drift(*daemon) : history(*daemon); });
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
  auto given = std::make_shared<Given>();

  CLI::App* add = token->add_subcommand("add", "Make a token and print it, once");
  add->footer("Example: cellcal token add --role look --name wall-screen");
  auto daemon = add_connection(add);
  add->add_option("--role", given->role, "look, operate or administer")
      ->required()
      ->check(CLI::IsMember({"look", "operate", "administer"}));
  add->add_option("--name", given->name, "Name in lists and logs")->required();
  add->callback([=, &status] { status = add_token(*daemon, given->name, given->role); });

  CLI::App* list = token->add_subcommand("list", "List the tokens: names and roles");
  list->footer("Example: cellcal token list --json");
  auto listed = add_connection(list);
  list->callback([=, &status] { status = list_tokens(*listed); });

  CLI::App* remove = token->add_subcommand("remove", "Revoke a token and all its logins");
  remove->footer("Example: cellcal token remove wall-screen");
  auto removed = add_connection(remove);
  remove->add_option("NAME", given->name, "Its name, as 'cellcal token list' shows it")->required();
  remove->callback([=, &status] { status = remove_token(*removed, given->name); });
}

}  // namespace

void add_client_commands(CLI::App& app, int& status) {
  add_run(app, status);
  add_qualify(app, status);
  add_find(app, status);
  add_dry_run(app, status);
  add_check(app, status);
  add_plain(app, status, "status", "Show what the daemon is doing", show_status);
  add_position(app, status);
  add_watch(app, status);
  add_plain(app, status, "abort", "Stop the arm and end the session", abort);
  add_history(app, status);
  add_show(app, status);
  add_report(app, status);
  add_token_commands(app, status);
}

}  // namespace cellcal::daemon
