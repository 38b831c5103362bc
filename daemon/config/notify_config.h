#pragma once
// [notify]: who is told how a session ended.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/files/toml.h"

namespace cellcal::daemon {

enum class Language { kEnglish, kGerman };

/// An address for POST, taken apart.
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
  std::filesystem::path ca;           ///< PEM; empty: the system's
  double timeout_s = 10.0;            ///< of one attempt
  int retries = 5;

  bool operator==(const WebhookConfig&) const = default;
};

/// Of the plant, which takes mail over the network.
struct MailServer {
  bool tls = false;       ///< from the first byte (smtps)
  bool starttls = false;  ///< asked for before anything is said, and insisted on
  std::string host;       ///< IPv6 without brackets
  std::string port;
  std::string user;                     ///< empty: none is asked for; else over TLS alone
  std::filesystem::path password_file;  ///< its first line
  std::filesystem::path ca;             ///< PEM; empty: the system's
  double timeout_s = 30.0;              ///< of one attempt

  bool operator==(const MailServer&) const = default;
};

struct MailConfig {
  std::vector<std::string> to;
  std::string from;
  std::filesystem::path program = "/usr/sbin/sendmail";  ///< where there is no server
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
