#pragma once
// Section [notify]: notification of the end of a session.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/files/toml.h"

namespace cellcal::daemon {

enum class Language { kEnglish, kGerman };

/// Components of a webhook address.
struct WebhookUrl {
  bool tls = false;
  std::string host;  ///< IPv6 without brackets
  std::string port;
  std::string target;  ///< path and query

  bool operator==(const WebhookUrl&) const = default;
};

struct WebhookConfig {
  WebhookUrl url;
  std::filesystem::path secret_file;  ///< its first line is sent as X-Cellcal-Secret; empty: none
  std::filesystem::path ca;           ///< PEM; empty: system store
  double timeout_s = 10.0;            ///< of one attempt
  int retries = 5;

  bool operator==(const WebhookConfig&) const = default;
};

/// SMTP server of the plant.
struct MailServer {
  bool tls = false;       ///< implicit TLS (smtps)
  bool starttls = false;  ///< STARTTLS required before any other command
  std::string host;       ///< IPv6 without brackets
  std::string port;
  std::string user;                     ///< empty: no login; otherwise over TLS only
  std::filesystem::path password_file;  ///< first line is the password
  std::filesystem::path ca;             ///< PEM; empty: system store
  double timeout_s = 30.0;              ///< of one attempt

  bool operator==(const MailServer&) const = default;
};

struct MailConfig {
  std::vector<std::string> to;
  std::string from;
  std::filesystem::path program = "/usr/sbin/sendmail";  ///< used without a server
  std::optional<MailServer> server = {};

  bool operator==(const MailConfig&) const = default;
};

struct NotifyConfig {
  Language language = Language::kEnglish;
  std::optional<WebhookConfig> webhook;
  std::optional<MailConfig> mail;

  bool operator==(const NotifyConfig&) const = default;
};

/// Throws calib::FileError.
NotifyConfig read_notify(const calib::TomlTable& table);

}  // namespace cellcal::daemon
