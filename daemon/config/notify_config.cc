#include "daemon/config/notify_config.h"

#include <algorithm>
#include <charconv>
#include <optional>

#include "calib/files/text.h"
#include "daemon/config/config_values.h"

namespace cellcal::daemon {

namespace {

using calib::TomlTable;

constexpr std::size_t kMostAddresses = 20, kLongestAddress = 254, kLongestUrl = 2000;

bool is_visible_ascii(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return '!' <= c && c <= '~'; });
}

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
    std::uint16_t port = 0;
    const char* last = address.port.data() + address.port.size();
    const auto [rest, code] = std::from_chars(address.port.data(), last, port);
    if (code != std::errc() || rest != last || port == 0) return std::nullopt;
  }
  if (bracket > 0) host = host.substr(1, bracket - 1);
  const bool known_letters =
      host.find_first_not_of(
          "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_:") ==
      std::string::npos;
  if (host.empty() || !known_letters || (bracket == 0 && host.find(':') != std::string::npos))
    return std::nullopt;
  address.host = host;
  return address;
}

WebhookUrl read_url(const TomlTable& table) {
  const std::string text = table.string("webhook");
  const auto address = read_address(text, {"http", "https"});
  if (!address)
    table.fail("webhook",
               "\"" + calib::shown(text) +
                   "\" is not a URL for POST. Examples: \"https://hooks.plant.example/cellcal\", "
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
               "\"" + calib::shown(text) +
                   "\" is not a mail server. Examples: \"smtps://mail.plant.example\", "
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
               "\"" + calib::shown(text) +
                   "\" is not a mail address: write it bare, as in \"maintenance@plant.example\"");
  }
  return text;
}

void refuse_without(const TomlTable& table, const char* needed,
                    std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    if (table.has(key)) table.fail(key, std::string("has no effect without ") + needed);
  }
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
  webhook.retries = static_cast<int>(table.integer_or("webhook_retries", webhook.retries, 0, 10));
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

}  // namespace

NotifyConfig read_notify(const TomlTable& table) {
  NotifyConfig notify;
  if (table.has("language") && table.word("language", {"en", "de"}) == "de")
    notify.language = Language::kGerman;
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

}  // namespace cellcal::daemon
