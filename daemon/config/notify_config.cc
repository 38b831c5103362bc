#include "daemon/config/notify_config.h"

#include <algorithm>
#include <charconv>

#include "calib/syntax/shown.h"
#include "daemon/config/config_values.h"

namespace cellcal::daemon {

namespace {

using calib::TomlTable;

constexpr std::size_t kMostAddresses = 20, kLongestAddress = 254, kLongestUrl = 2000;

bool is_visible_ascii(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return '!' <= c && c <= '~'; });
}

/// "https://host:8443/path?query"; a user or a fragment in it is none of ours.
WebhookUrl read_url(const TomlTable& table) {
  const std::string text = table.string("webhook");
  const auto wrong = [&]() {
    table.fail("webhook", "\"" + calib::shown(text) +
                              "\" is no address for POST. Examples: \"https://hooks.plant.example/cellcal\", "
                              "\"http://10.0.0.7:8080/in\"");
  };
  WebhookUrl url;
  url.tls = text.starts_with("https://");
  if ((!url.tls && !text.starts_with("http://")) || text.size() > kLongestUrl ||
      !is_visible_ascii(text) || text.find_first_of("#\"<>\\^`{|}") != std::string::npos)
    wrong();
  const std::size_t from = url.tls ? 8 : 7;
  const std::size_t end = std::min(text.find_first_of("/?", from), text.size());
  std::string host = text.substr(from, end - from);
  url.target = text.substr(end);
  if (!url.target.starts_with("/")) url.target.insert(0, "/");
  url.port = url.tls ? "443" : "80";
  const std::size_t bracket = host.starts_with("[") ? host.find(']') : 0;
  if (bracket == std::string::npos) wrong();
  if (const std::size_t colon = host.find(':', bracket); colon != std::string::npos) {
    url.port = host.substr(colon + 1);
    host.resize(colon);
  }
  std::uint16_t port = 0;
  const auto [rest, code] =
      std::from_chars(url.port.data(), url.port.data() + url.port.size(), port);
  if (code != std::errc() || rest != url.port.data() + url.port.size() || port == 0) wrong();
  if (bracket > 0) host = host.substr(1, bracket - 1);
  const bool known_letters =
      host.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_:") ==
      std::string::npos;
  if (host.empty() || !known_letters || (bracket == 0 && host.find(':') != std::string::npos))
    wrong();
  url.host = host;
  return url;
}

/// It stands on sendmail's command line and in the head of the mail.
std::string checked_address(const TomlTable& table, const char* key, const std::string& text) {
  const std::size_t at = text.find('@');
  const bool sound = at != std::string::npos && at > 0 && at + 1 < text.size() &&
                     text.find('@', at + 1) == std::string::npos && text.front() != '-' &&
                     text.size() <= kLongestAddress && is_visible_ascii(text) &&
                     text.find_first_of(",;:<>()[]\"\\") == std::string::npos;
  if (!sound) {
    table.fail(key, "\"" + calib::shown(text) +
                        "\" is no mail address: write it bare, as in \"maintenance@plant.example\"");
  }
  return text;
}

void refuse_without(const TomlTable& table, const char* needed, std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    if (table.has(key)) table.fail(key, std::string("means nothing without ") + needed);
  }
}

WebhookConfig read_webhook(const TomlTable& table) {
  WebhookConfig webhook;
  webhook.url = read_url(table);
  if (table.has("webhook_secret_file"))
    webhook.secret_file = read_path(table, "webhook_secret_file");
  if (table.has("webhook_ca")) {
    if (!webhook.url.tls) table.fail("webhook_ca", "means nothing with http://");
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
  mail.from = checked_address(table, "mail_from", table.string_or("mail_from", "cellcal@localhost"));
  if (table.has("sendmail")) mail.program = read_path(table, "sendmail");
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
    refuse_without(table, "mail_to", {"mail_from", "sendmail"});
  }
  table.refuse_unknown();
  return notify;
}

}  // namespace cellcal::daemon
