#pragma once
// Text of a mail, and its delivery through the system's mail program (sendmail's command line, as provided by
// postfix, exim, msmtp and others).
//
// The program inherits only PATH in an empty environment: no socket, no serial port, no blocked signal. It is
// waited for, and terminated after the time limit.

#include <chrono>
#include <string>

#include "daemon/config/notify_config.h"
#include "daemon/unattended/message.h"
#include "daemon/unattended/transfer.h"

namespace cellcal::daemon {

/// The complete mail with lines ended by
/// , as sendmail expects. `date`: RFC 5322. `id`: letters and digits, unique per mail.
std::string mail_text(const MailConfig& config, const Message& message, const std::string& date,
                      const std::string& id);

Delivery send_mail(const MailConfig& config, const std::string& mail,
                   std::chrono::milliseconds longest = std::chrono::seconds(30));

// Delivery of one mail to a mail server (SMTP, RFC 5321).

/// `mail`: complete text with lines ended by
/// . `password` is sent over TLS only, which the server has to offer if a user is configured. After a 4yz
/// answer to some addresses the delivery is to be repeated for those (`left`) only.
Delivery send_by_smtp(const MailConfig& config, const MailServer& server,
                      const std::string& password, const std::string& mail);

}  // namespace cellcal::daemon
