#include "daemon/config/unattended_config.h"

#include <algorithm>

#include "calib/files/text.h"
#include "daemon/config/config_values.h"

namespace cellcal::daemon {

namespace {

using calib::TomlTable;

constexpr std::size_t kMostAddresses = 20, kLongestAddress = 254, kLongestUrl = 2000;

struct Address {
  std::size_t scheme = 0;  ///< index into the permitted schemes
  std::string host, port;
  std::string rest;  ///< from the first / or ? on
};

/// "https://host:8443/path?query"; user and fragment are rejected. None for an invalid address.
std::optional<Address> read_address(const std::string& text,
                                    const std::vector<std::string>& schemes) {
  Address address;
  while (address.scheme < schemes.size() && !text.starts_with(schemes[address.scheme] + "://"))
    ++address.scheme;
  if (address.scheme == schemes.size() || text.size() > kLongestUrl || !is_visible_ascii(text) ||
      text.find_first_of("#\"<>\\^`{|}") != std::string::npos)
    return std::nullopt;
  const std::size_t from = schemes[address.scheme].size() + 3;
  const std::size_t end = std::min(text.find_first_of("/?", from), text.size());
  std::string host = text.substr(from, end - from);
  address.rest = text.substr(end);
  const std::size_t bracket = host.starts_with("[") ? host.find(']') : 0;
  if (bracket == std::string::npos) return std::nullopt;
  if (const std::size_t colon = host.find(':', bracket); colon != std::string::npos) {
    address.port = host.substr(colon + 1);
    host.resize(colon);
    if (!port_of(address.port)) return std::nullopt;
  }
  if (bracket > 0) host = host.substr(1, bracket - 1);
  if (host.empty() || !has_letters_digits_and(".-_:", host) ||
      (bracket == 0 && host.find(':') != std::string::npos))
    return std::nullopt;
  address.host = host;
  return address;
}

WebhookUrl read_url(const TomlTable& table) {
  const std::string text = table.string("webhook");
  const auto address = read_address(text, {"http", "https"});
  if (!address)
    table.fail("webhook",
               in_quotes(text) +
                   " is not a URL for POST. Examples: \"https://hooks.plant.example/cellcal\", "
                   "\"http://10.0.0.7:8080/in\"");
  const bool tls = address->scheme == 1;
  return {tls, address->host,
          !address->port.empty() ? address->port
          : tls                  ? "443"
                                 : "80",
          address->rest.starts_with("/") ? address->rest : "/" + address->rest};
}

MailServer read_mail_server(const TomlTable& table) {
  const std::string text = table.string("mail_server");
  const auto address = read_address(text, {"smtp", "smtps"});
  if (!address || (!address->rest.empty() && address->rest != "/"))
    table.fail("mail_server",
               in_quotes(text) +
                   " is not a mail server. Examples: \"smtps://mail.plant.example\", "
                   "\"smtp://10.0.0.7:587\"");
  MailServer server;
  server.tls = address->scheme == 1;
  server.host = address->host;
  if (table.has("mail_user")) {
    server.user = table.string("mail_user");
    if (server.user.empty() || server.user.size() > kLongestAddress ||
        !is_visible_ascii(server.user))
      table.fail("mail_user", "must have 1 to 254 visible ASCII characters");
    if (!table.has("mail_password_file")) table.fail("mail_user", "needs mail_password_file");
    server.password_file = read_path(table, "mail_password_file");
  } else if (table.has("mail_password_file")) {
    table.fail("mail_password_file", "has no effect without mail_user");
  }
  if (server.tls && table.has("mail_starttls"))
    table.fail("mail_starttls", "has no effect with smtps://");
  server.starttls = table.boolean_or("mail_starttls", !server.tls && !server.user.empty());
  if (!server.tls && !server.starttls && !server.user.empty())
    table.fail("mail_starttls",
               "must not be false with mail_user: the password would go in plain text");
  server.port = !address->port.empty() ? address->port
                : server.tls           ? "465"
                : server.user.empty()  ? "25"
                                       : "587";
  if (table.has("mail_ca")) {
    if (!server.tls && !server.starttls)
      table.fail("mail_ca", "has no effect without TLS: smtps:// or mail_starttls = true");
    server.ca = read_path(table, "mail_ca");
  }
  return server;
}

/// The address is used on sendmail's command line and in the mail header.
std::string checked_address(const TomlTable& table, const char* key, const std::string& text) {
  const std::size_t at = text.find('@');
  const bool sound = at != std::string::npos && at > 0 && at + 1 < text.size() &&
                     text.find('@', at + 1) == std::string::npos && text.front() != '-' &&
                     text.size() <= kLongestAddress && is_visible_ascii(text) &&
                     text.find_first_of(",;:<>()[]\"\\") == std::string::npos;
  if (!sound) {
    table.fail(key,
               in_quotes(text) +
                   " is not a mail address: write it bare, as in \"maintenance@plant.example\"");
  }
  return text;
}

WebhookConfig read_webhook(const TomlTable& table) {
  WebhookConfig webhook;
  webhook.url = read_url(table);
  if (table.has("webhook_secret_file"))
    webhook.secret_file = read_path(table, "webhook_secret_file");
  if (table.has("webhook_ca")) {
    if (!webhook.url.tls) table.fail("webhook_ca", "has no effect with http://");
    webhook.ca = read_path(table, "webhook_ca");
  }
  webhook.timeout_s = table.number_or("webhook_timeout_s", webhook.timeout_s, {1.0, 60.0});
  webhook.retries = integer_or(table, "webhook_retries", webhook.retries, 0, 10);
  return webhook;
}

MailConfig read_mail(const TomlTable& table) {
  MailConfig mail;
  const std::vector<std::string> given = table.strings("mail_to");
  if (given.empty() || given.size() > kMostAddresses)
    table.fail("mail_to", "must name 1 to 20 addresses; leave it out for no mail");
  for (const std::string& one : given) mail.to.push_back(checked_address(table, "mail_to", one));
  mail.from =
      checked_address(table, "mail_from", table.string_or("mail_from", "cellcal@localhost"));
  if (table.has("sendmail")) mail.program = read_path(table, "sendmail");
  if (table.has("mail_server")) {
    mail.server = read_mail_server(table);
  } else {
    refuse_without(table, "mail_server",
                   {"mail_user", "mail_password_file", "mail_ca", "mail_starttls"});
  }
  return mail;
}

constexpr std::size_t kMostSessions = 32, kLongestScheduleName = 40;
constexpr std::array<std::string_view, 7> kDays{"sun", "mon", "tue", "wed", "thu", "fri", "sat"};
constexpr const char* kKeys[] = {"name",  "kind",    "cell",  "days",    "from", "to",
                                 "begin", "touches", "check", "goal_mm", "load", "minutes"};
constexpr int kMinutesPerHour = 60, kHoursPerDay = 24;

/// "22:30" as minutes since midnight.
int read_time_of_day(const TomlTable& table, const char* key) {
  const std::string text = table.string(key);
  const auto digit = [&](std::size_t at) { return '0' <= text[at] && text[at] <= '9'; };
  const bool sound =
      text.size() == 5 && digit(0) && digit(1) && text[2] == ':' && digit(3) && digit(4);
  const auto number = [&](std::size_t at) { return 10 * (text[at] - '0') + text[at + 1] - '0'; };
  if (!sound || number(0) >= kHoursPerDay || number(3) >= kMinutesPerHour) {
    table.fail(key, in_quotes(text) +
                        " is not a time of day: write hours and minutes, \"00:00\" to \"23:59\"");
  }
  return number(0) * kMinutesPerHour + number(3);
}

std::array<bool, 7> read_days(const TomlTable& table) {
  std::array<bool, 7> days{};
  const std::vector<std::string> given = table.strings("days");
  if (given.empty()) table.fail("days", "names no day: leave it out for all of them");
  for (const std::string& name : given) {
    const auto day = std::find(kDays.begin(), kDays.end(), name);
    if (day == kDays.end()) {
      table.fail("days", in_quotes(name) + " is not a day. Use sun, mon, tue, wed, thu, fri, sat");
    }
    days[static_cast<std::size_t>(day - kDays.begin())] = true;
  }
  return days;
}

WeeklyWindow read_window(const TomlTable& table) {
  WeeklyWindow window;
  if (table.has("days")) window.days = read_days(table);
  window.from_min = read_time_of_day(table, "from");
  window.to_min = read_time_of_day(table, "to");
  if (window.from_min == window.to_min)
    table.fail("to", "must be another time of day than from: a window has a begin and an end");
  return window;
}

/// The name is used in lists, in the log and on command lines.
std::string read_session_name(const TomlTable& table) {
  const std::string name = table.string("name");
  if (name.empty() || name.size() > kLongestScheduleName || name.front() == '-' ||
      !has_letters_digits_and("_-", name)) {
    table.fail("name", in_quotes(name) +
                           " must have 1 to 40 letters, digits, - and _, such as \"nightly\"");
  }
  return name;
}

/// The session's begin shows if the cell has it.
std::string read_load(const TomlTable& table) {
  constexpr std::size_t kLongest = 64;
  const std::string load = table.string("load");
  if (load.empty() || load.size() > kLongest || calib::shown(load) != load)
    table.fail("load", in_quotes(load) +
                           " must be the id of a [[load]] of the cell file: 1 to 64 characters. "
                           "Without load leave it out");
  return load;
}

void refuse_touches_of_others(const TomlTable& table, const ScheduledSession& session) {
  if (session.kind == "calibrate") return;
  for (const char* key : {"touches", "check", "goal_mm"}) {
    if (table.has(key))
      table.fail(key, "is of kind = \"calibrate\": a session of another kind has its own touches");
  }
}

ScheduledSession read_session(const TomlTable& table) {
  ScheduledSession session;
  session.name = read_session_name(table);
  if (table.has("kind")) session.kind = table.word("kind", {"calibrate", "check", "qualify"});
  session.cell = read_path(table, "cell");
  session.window = read_window(table);
  session.on_request =
      table.has("begin") && table.word("begin", {"by itself", "on request"}) == "on request";
  refuse_touches_of_others(table, session);
  if (table.has("touches")) session.touches = static_cast<int>(table.integer("touches", 4, 2000));
  if (table.has("check")) session.check = static_cast<int>(table.integer("check", 0, 2000));
  if (table.has("goal_mm")) session.goal_mm = table.number("goal_mm", {0.01, 10.0});
  if (table.has("load")) session.load = read_load(table);
  if (table.has("minutes")) session.minutes = table.number("minutes", {0.1, 1440.0});
  table.refuse_unknown();
  return session;
}

/// A table with all keys commented out is an example and ignored.
bool has_entries(const TomlTable& table) {
  for (const char* key : kKeys)
    if (table.has(key)) return true;
  table.refuse_unknown();
  return false;
}

ProgramStart read_program_start(const TomlTable& table) {
  if (!table.has("program_start")) return ProgramStart::kNone;
  const std::string word = table.word("program_start", {"none", "left running", "cell", "run"});
  return word == "cell"           ? ProgramStart::kCell
         : word == "run"          ? ProgramStart::kRun
         : word == "left running" ? ProgramStart::kLeftRunning
                                  : ProgramStart::kNone;
}

}  // namespace

calib::Language read_language(const TomlTable& table, const calib::Language& usual) {
  if (!table.has("language")) return usual;
  const std::string code = table.string("language");
  const auto language = calib::Language::of(code);
  if (language && language->code() == code) return *language;
  std::string known;
  for (const std::string& one : calib::Language::codes())
    known += (known.empty() ? "\"" : ", \"") + one + "\"";
  table.fail("language", "\"" + code + "\" is not known here; use one of " + known);
}

NotifyConfig read_notify(const TomlTable& table, const calib::Language& usual) {
  NotifyConfig notify;
  notify.language = read_language(table, usual);
  if (table.has("webhook")) {
    notify.webhook = read_webhook(table);
  } else {
    refuse_without(table, "webhook",
                   {"webhook_secret_file", "webhook_ca", "webhook_timeout_s", "webhook_retries"});
  }
  if (table.has("mail_to")) {
    notify.mail = read_mail(table);
  } else {
    refuse_without(table, "mail_to",
                   {"mail_from", "sendmail", "mail_server", "mail_user", "mail_password_file",
                    "mail_ca", "mail_starttls"});
  }
  table.refuse_unknown();
  return notify;
}

ScheduleConfig read_schedule(const TomlTable& table) {
  ScheduleConfig schedule;
  schedule.program_start = read_program_start(table);
  schedule.unattended = table.boolean_or("unattended", false);
  schedule.responsible = table.string_or("responsible", "");
  if (schedule.unattended && schedule.responsible.empty()) {
    table.fail(
        "responsible",
        "is missing: with unattended = true sessions begin without a person. Name the person "
        "responsible for a closed and clear cell within the windows, and how to reach them");
  }
  schedule.resumes = integer_or(table, "resumes", 0, 0, 20);
  schedule.resume_wait_s = table.number_or("resume_wait_s", schedule.resume_wait_s, {10.0, 3600.0});
  const std::vector<TomlTable> sessions = table.tables("session");
  if (sessions.size() > kMostSessions)
    table.fail("session", "has " + std::to_string(sessions.size()) + " entries, at most 32 can be");
  for (const TomlTable& one : sessions) {
    if (!has_entries(one)) continue;
    ScheduledSession session = read_session(one);
    const auto same = [&](const ScheduledSession& other) { return other.name == session.name; };
    if (std::any_of(schedule.sessions.begin(), schedule.sessions.end(), same))
      one.fail("name", "\"" + session.name + "\" is the name of another session of the schedule");
    schedule.sessions.push_back(std::move(session));
  }
  table.refuse_unknown();
  return schedule;
}

}  // namespace cellcal::daemon
