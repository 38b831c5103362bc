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
  CLI::App* command = app.add_subcommand("run");
  auto daemon = add_connection(command);
  add_progress(command, *daemon);
  add_load(command, given->load);
  auto* cell = command->add_option("--cell", given->cell);
  command->add_option("--goal", given->goal_mm)->check(between(0.01, 10.0));
  command->add_option("--touches", given->fit_touches)->check(between(4, 2000));
  command->add_flag("--find", given->find);
  command->add_flag("--accept-change", given->accept_change);
  auto* update = command->add_flag("--update", given->update);
  command->add_flag("--or-full", *or_full)->needs(update);
  command->add_option("--region", given->region)->capture_default_str();
  command->add_option("--check", given->check_touches)
      ->check(between(0, 2000))
      ->capture_default_str();
  command->add_option("--seed", given->seed)->capture_default_str();
  command->add_flag("--resume", given->resume);
  command->callback([=, &status] {
    if (!given->resume && cell->count() == 0) {
      throw CLI::RequiredError("--cell (or --resume)");
    }
    status = run(*daemon, *given, *or_full);
  });
}

/// A command that runs a session of this kind.
RequestCommand<RunRequest> add_session(CLI::App& app, int& status, SessionKind kind) {
  auto added = add_request<RunRequest>(
      app, status, to_string(kind),
      [](const Connection& daemon, const RunRequest& request) { return run(daemon, request); });
  added.given->kind = kind;
  add_progress(added.command, *added.connection);
  add_load(added.command, added.given->load);
  return added;
}

void add_qualify(CLI::App& app, int& status) {
  const auto [command, given, connection] = add_session(app, status, SessionKind::kQualify);
  command->add_option("--cell", given->cell)->required();
  command->add_option("--target", given->target);
}

void add_dry_run(CLI::App& app, int& status) {
  const auto [command, given, connection] = add_session(app, status, SessionKind::kDryRun);
  command->add_option("--cell", given->cell)->required();
  command->add_option("--touches", given->fit_touches.emplace(calib::kUsualTouches))
      ->capture_default_str()
      ->check(between(4, 2000));
  command->add_option("--check", given->check_touches)
      ->capture_default_str()
      ->check(between(0, 2000));
  command->add_option("--seed", given->seed)->capture_default_str();
}

void add_find(CLI::App& app, int& status) {
  const auto [command, given, connection] = add_session(app, status, SessionKind::kFind);
  command->add_option("--cell", given->cell)->required();
}

void add_check(CLI::App& app, int& status) {
  const auto [command, given, connection] = add_session(app, status, SessionKind::kCheck);
  command->add_option("--cell", given->cell);
  command->add_option("--calibration", given->calibration)->check(session_number());
  command->add_option("--temperature", given->temperature_c)->check(between(-40.0, 80.0));
  command->add_option("--mastered", given->mastered)
      ->delimiter(',')
      ->transform([](std::string name) { return CLI::detail::trim(name); });
}

void add_show(CLI::App& app, int& status) {
  struct Given {
    std::optional<std::int64_t> session;
    bool times = false;
  };
  const auto [command, given, connection] =
      add_request<Given>(app, status, "show", [](const Connection& daemon, const Given& of) {
        return show(daemon, of.session, of.times ? Shown::kTimes : Shown::kEventsAndResult);
      });
  command->add_option("ID", given->session)->check(session_number());
  command->add_flag("--times", given->times);
}

void add_report(CLI::App& app, int& status) {
  struct Given {
    std::optional<std::int64_t> session;
    std::filesystem::path output;
  };
  const auto [command, given, connection] =
      add_request<Given>(app, status, "report", [](const Connection& daemon, const Given& of) {
        return fetch_report(daemon, of.session, of.output);
      });
  command->add_option("ID", given->session)->check(session_number());
  add_output(*command, given->output);
}

void add_history(CLI::App& app, int& status) {
  const auto [command, drift, connection] =
      add_request<bool>(app, status, "history", [](const Connection& daemon, bool charted) {
        return charted ? show_drift(daemon) : history(daemon);
      });
  command->add_flag("--drift", *drift);
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
  CLI::App* token = app.add_subcommand("token");
  token->require_subcommand(1);
  const auto [add, given, connection] =
      add_request<Given>(*token, status, "add", [](const Connection& daemon, const Given& of) {
        return add_token(daemon, of.name, of.role);
      });
  add->add_option("--role", given->role)
      ->required()
      ->check(one_of({"look", "operate", "administer"}));
  add->add_option("--name", given->name)->required();
  add_plain(*token, status, "list", list_tokens);
  const auto [remove, name, same] =
      add_request<std::string>(*token, status, "remove", remove_token);
  remove->add_option("NAME", *name)->required();
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
  add_plain(app, status, "status", show_status);
  add_plain(app, status, "position", show_position);
  add_plain(app, status, "watch", watch);
  add_plain(app, status, "abort", abort);
  add_history(app, status);
  add_show(app, status);
  add_report(app, status);
  add_token_commands(app, status);
}

}  // namespace cellcal::daemon
